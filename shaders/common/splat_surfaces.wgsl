// Which surfaces share their light, where photons keep to the surface that they arrived at.

override splat_keeps_to_surfaces: bool = false;

// Whether light on one surface is light on another, by their numbers.
fn splat_shares(a: u32, b: u32) -> bool {
    return !splat_keeps_to_surfaces || a == b || a == 0u || b == 0u;
}
