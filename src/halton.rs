//! Beside the layers: the Halton sequence on the CPU, for places and jitter.

/// `index` in base `base`, mirrored at the radix point: in [0, 1).
pub(crate) fn radical_inverse(mut index: u32, base: u32) -> f64 {
    let (mut value, mut weight) = (0.0, 1.0);
    while index > 0 {
        weight /= f64::from(base);
        value += weight * f64::from(index % base);
        index /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::radical_inverse;

    #[test]
    fn digits_are_mirrored() {
        assert_eq!(
            [1, 2, 3, 4, 6].map(|i| radical_inverse(i, 2)),
            [0.5, 0.25, 0.75, 0.125, 0.375]
        );
        assert!((radical_inverse(5, 3) - 7.0 / 9.0).abs() < 1e-15);
    }
}
