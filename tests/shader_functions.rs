//! The functions of `shaders/common/` on a GPU, against their definitions in `f64`.

mod common;

use common::evaluate::run;
use common::statistics::{Random, chi_square, chi_square_2d, gamma_tail};
use common::{Gpu, gpu};
use lightfall::glam::{DMat3, DVec2, DVec3, Vec3};
use lightfall::resource::Photon;
use lightfall::resource::cube_face::{CUBE_FACES, CubeFace};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Twice the largest relative error of rounding to `f32`, 2^-24.
const EPSILON: f64 = f32::EPSILON as f64;
/// What is right is refused with this probability, over the choice of a seed. The seeds are fixed, so that a test that
/// passes does so at every run.
const LEAST_P: f64 = 1e-4;
const LARGEST_BELOW_ONE: f32 = 1.0 - 0.5 * f32::EPSILON;

fn vec3(v: [f32; 4]) -> DVec3 {
    Vec3::from_slice(&v).as_dvec3()
}

fn vec4(v: DVec3) -> [f32; 4] {
    v.as_vec3().extend(0.0).to_array()
}

/// 1 − cos of the angle to +z, without the cancellation at small angles.
fn one_minus_cos(direction: DVec3) -> f64 {
    direction.truncate().length_squared() / (1.0 + direction.z)
}

/// The axes, the middles of all faces and edges of a cube, its corners, and directions on either side of them.
fn special_directions() -> Vec<DVec3> {
    let signs = [-1.0, 0.0, 1.0];
    let lattice = signs
        .iter()
        .flat_map(|&x| signs.iter().flat_map(move |&y| signs.map(|z| DVec3::new(x, y, z))));
    let lattice: Vec<DVec3> = lattice.filter(|&v| v != DVec3::ZERO).collect();
    let offsets = [1e-30, 1e-8, 1e-4].map(|size| lattice.iter().map(|&v| size * v).collect::<Vec<_>>());
    let nearby = lattice
        .iter()
        .flat_map(|&v| offsets.iter().flatten().map(move |&offset| v + offset));
    lattice.iter().copied().chain(nearby).map(DVec3::normalize).collect()
}

fn random_directions(count: usize, seed: u64) -> impl Iterator<Item = DVec3> {
    let mut random = Random(seed);
    (0..count).map(move |_| random.direction())
}

/// Pairs of uniform numbers, the ends of their range among them.
fn random_pairs(count: usize, seed: u64) -> Vec<[f32; 2]> {
    let ends = [0.0, 0.5 * f32::EPSILON, 0.25, 0.5, 0.75, LARGEST_BELOW_ONE];
    let mut random = Random(seed);
    let corners = ends.iter().flat_map(|&x| ends.map(|y| [x, y]));
    corners
        .chain((0..count).map(|_| [random.unit(), random.unit()]))
        .collect()
}

fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    // f64::max would drop a NaN.
    errors.fold(0.0, |largest: f64, error| {
        if largest.is_nan() || error <= largest {
            largest
        } else {
            error
        }
    })
}

#[test]
fn an_octahedral_normal_survives_packing_to_within_its_quantum() {
    let Some(gpu) = gpu() else { return };
    let directions: Vec<DVec3> = special_directions()
        .into_iter()
        .chain(random_directions(100_000, 1))
        .collect();
    let inputs: Vec<_> = directions.iter().map(|&d| vec4(d)).collect();
    let outputs = run(
        &gpu,
        "return vec4f(octahedral_unpack(octahedral_pack(input.xyz)), 0.0);",
        &inputs,
    );
    // A coordinate is off by up to a = half of 1/32767. On the octahedron |x| + |y| + |z| = 1 that is at most
    // (a, a, 2a), √6 a long; seen from the centre, 1/√3 away at the nearest, √18 a.
    let quantised = 18f64.sqrt() * 0.5 / 32767.0;
    // The f32 arithmetic of encoding, up to four roundings of a coordinate, is magnified in the same way.
    let bound = quantised + 18f64.sqrt() * 4.0 * EPSILON;
    let exact = inputs.iter().map(|&input| vec3(input).normalize());
    let error = largest(
        exact
            .zip(&outputs)
            .map(|(exact, &output)| exact.cross(vec3(output)).length()),
    );
    assert!(error <= bound, "{error:e} rad, bound {bound:e}");
    // And the bound is nearly met: the worst case is common.
    assert!(error > 0.9 * quantised, "{error:e} rad of {quantised:e}");
    assert!(exact_side(&inputs, &outputs), "a normal came back reversed");
    // inverseSqrt, from which WGSL's normalize inherits its error, is good to 2 ulp.
    let length = largest(outputs.iter().map(|&output| (vec3(output).length() - 1.0).abs()));
    assert!(length <= 3.0 * EPSILON, "length off by {length:e}");
    println!("angle off by {error:e} rad (bound {bound:e}), length by {length:e}");
}

fn exact_side(inputs: &[[f32; 4]], outputs: &[[f32; 4]]) -> bool {
    inputs
        .iter()
        .zip(outputs)
        .all(|(&input, &output)| vec3(input).dot(vec3(output)) > 0.0)
}

#[test]
fn octahedral_axes_are_exact() {
    let Some(gpu) = gpu() else { return };
    let axes: Vec<_> = CUBE_FACES
        .iter()
        .map(|face| face.forward.extend(0.0).to_array())
        .collect();
    let outputs = run(
        &gpu,
        "return vec4f(octahedral_unpack(octahedral_pack(input.xyz)), 0.0);",
        &axes,
    );
    assert_eq!(outputs, axes);
}

#[test]
fn packed_reflectance_is_off_by_half_a_quantum_at_most() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(2);
    let steps = (0..=2047).map(|i| [i as f32 / 2047.0, (i as f32 + 0.5) / 2048.0, i as f32 / 2047.0, 0.0]);
    let inputs: Vec<[f32; 4]> = steps
        .chain((0..100_000).map(|_| [(); 4].map(|()| random.unit())))
        .collect();
    let outputs = run(
        &gpu,
        "return vec4f(reflectance_unpack(reflectance_pack(input.rgb)), 0.0);",
        &inputs,
    );
    for (channel, quantum) in [1.0 / 2047.0, 1.0 / 2047.0, 1.0 / 1023.0].into_iter().enumerate() {
        // The division is good to 2.5 ulp, the product before rounding to half a one.
        let bound = 0.5 * quantum + 3.0 * EPSILON;
        let off = |(input, output): (&[f32; 4], &[f32; 4])| f64::from(input[channel]) - f64::from(output[channel]);
        let error = largest(inputs.iter().zip(&outputs).map(|pair| off(pair).abs()));
        assert!(error <= bound, "channel {channel}: {error:e}, bound {bound:e}");
        println!("channel {channel} off by {error:e}, {:.5} quanta", error / quantum);
    }
}

#[test]
fn a_depth_range_holds_what_was_packed_and_little_more() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(9);
    // Inverse depths from beyond all rays to a ten-thousandth of the region; infinitely far; powers of two.
    let mut inputs: Vec<[f32; 4]> = (0..100_000)
        .map(|_| {
            let [a, b] = [0, 1].map(|_| 2f32.powf(18.0 * random.unit() - 4.0));
            [a.min(b), a.max(b), (random.bits() & 31) as f32, 0.0]
        })
        .collect();
    inputs.extend((-4..14).map(|e| [2f32.powi(e), 2f32.powi(e), 0.0, 0.0]));
    inputs.extend([[0.0, 0.0, 31.0, 0.0], [0.0, 7.5, 16.0, 0.0]]);
    let outputs = run(
        &gpu,
        "let bits = depth_range_pack(DepthRange(input.x, input.y), u32(input.z));
         let range = depth_range_unpack(bits);
         var flags = 16u * u32(depth_range_is_flat(bits));
         for (var quadrant = 0u; quadrant < 4u; quadrant++) {
             flags += u32(depth_range_agrees(bits, quadrant)) << quadrant;
         }
         return vec4f(range.least, range.greatest, f32(flags), 0.0);",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let [least, greatest, flags, _] = *input;
        assert!(output[0] <= least && output[1] >= greatest, "{input:?} {output:?}");
        // 8 bits of mantissa; nearer than 2^-4 of nothing is as good as nothing.
        assert!(
            output[0] >= least * (1.0 - 1.0 / 256.0) || least <= 0.0628,
            "{input:?} {output:?}"
        );
        assert!(
            output[1] <= (greatest * (1.0 + 1.0 / 256.0)).max(0.0628),
            "{input:?} {output:?}"
        );
        assert_eq!(output[2], flags);
    }
    assert_eq!(outputs[outputs.len() - 2], [0.0, 0.0, 31.0, 0.0]);
}

#[test]
fn a_joined_depth_range_holds_both() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(10);
    let inputs: Vec<[f32; 4]> = (0..10_000)
        .map(|_| {
            let mut pair = || {
                let [a, b] = [0, 1].map(|_| {
                    if random.unit() < 0.1 {
                        0.0
                    } else {
                        2f32.powf(10.0 * random.unit() - 3.0)
                    }
                });
                [a.min(b), a.max(b)]
            };
            let ([a, b], [c, d]) = (pair(), pair());
            [a, b, c, d]
        })
        .collect();
    let outputs = run(
        &gpu,
        "let a = depth_range_pack(DepthRange(input.x, input.y), 31u);
         let b = depth_range_pack(DepthRange(input.z, input.w), 0u);
         let both = depth_range_unpack(depth_range_join(a, b));
         let own = depth_range_unpack(a);
         let other = depth_range_unpack(b);
         let is_least = both.least == min(own.least, other.least);
         let is_greatest = both.greatest == max(own.greatest, other.greatest);
         return vec4f(f32(is_least), f32(is_greatest), f32(depth_range_join(a, b) >> 26u), 0.0);",
        &inputs,
    );
    assert!(outputs.iter().all(|o| *o == [1.0, 1.0, 0.0, 0.0]));
}

#[test]
fn black_and_white_reflectance_are_exact_and_out_of_range_is_clamped() {
    let Some(gpu) = gpu() else { return };
    let inputs = [
        [0.0, 0.0, 0.0, 0.0],
        [1.0, 1.0, 1.0, 0.0],
        [-0.0, 1.0, 0.0, 0.0],
        [-1.0, 2.0, -1e-30, 0.0],
        [f32::MAX, f32::MIN, 1.0 + f32::EPSILON, 0.0],
    ];
    let expected = [
        [0.0, 0.0, 0.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 1.0],
    ];
    let outputs = run(
        &gpu,
        "return vec4f(reflectance_unpack(reflectance_pack(input.rgb)), 0.0);",
        &inputs,
    );
    for ((input, output), expected) in inputs.iter().zip(outputs).zip(expected) {
        assert_eq!(output[..3], expected, "{input:?}");
    }
    let words =
        "let bits = reflectance_pack(input.rgb); return vec4f(f32(bits & 0xffffu), f32(bits >> 16u), 0.0, 0.0);";
    let outputs = run(&gpu, words, &inputs[..2]);
    assert_eq!(outputs, [[0.0; 4], [65535.0, 65535.0, 0.0, 0.0]]);
}

#[test]
fn cube_faces_have_the_axes_of_their_twin() {
    let Some(gpu) = gpu() else { return };
    let faces: Vec<[u32; 4]> = (0..6).map(|face| [face, 0, 0, 0]).collect();
    let axis = |name: &str| run(&gpu, &format!("return vec4f(cube_face_{name}(input.x), 0.0);"), &faces);
    let (forward, right, up) = (axis("forward"), axis("right"), axis("up"));
    for (i, face) in CUBE_FACES.into_iter().enumerate() {
        let found = [forward[i], right[i], up[i]].map(|v| Vec3::from_slice(&v));
        assert_eq!(found, [face.forward, face.right, face.up], "face {i}");
    }
}

/// Directions of every length that an `f32` scene could have.
fn directions_of_all_lengths() -> Vec<[f32; 4]> {
    let lengths = [1e-30, 1e-10, 0.3, 1.0, 7.0, 1e10, 1e30];
    let of_length = |d: DVec3| lengths.map(|length| vec4(length * d));
    // Longest component 1, so that edges and corners stay ties in f32.
    let special = special_directions().into_iter().map(|d| d / d.abs().max_element());
    special
        .chain(random_directions(20_000, 3))
        .flat_map(of_length)
        .collect()
}

/// The face that a direction leaves the cube through; on edges the first axis wins.
fn face_of(d: DVec3) -> usize {
    let a = d.abs();
    let axis = if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    };
    2 * axis + usize::from(d[axis] < 0.0)
}

fn uv_on(face: CubeFace, d: DVec3) -> DVec2 {
    let [forward, right, up] = [face.forward, face.right, face.up].map(|axis| d.dot(axis.as_dvec3()));
    DVec2::new(0.5 + 0.5 * right / forward, 0.5 - 0.5 * up / forward)
}

#[test]
fn a_direction_of_any_length_leaves_the_cube_where_its_twin_says() {
    let Some(gpu) = gpu() else { return };
    let inputs = directions_of_all_lengths();
    let points = run(
        &gpu,
        "let point = cube_face_point(input.xyz); return vec4f(point.uv, f32(point.face), 0.0);",
        &inputs,
    );
    let same_face = "let point = cube_face_point(input.xyz);
        return vec4f(cube_face_uv(point.face, input.xyz), f32(point.face), 0.0);";
    let projected = run(&gpu, same_face, &inputs);
    // A division good to 2.5 ulp of a number up to 1, halved, and a sum rounded.
    let bound = 2.0 * EPSILON;
    for (name, points) in [("cube_face_point", points), ("cube_face_uv", projected)] {
        let error = largest(inputs.iter().zip(&points).map(|(&input, &[u, v, face, _])| {
            let d = vec3(input);
            assert_eq!(face as usize, face_of(d), "{name} of {d}");
            (DVec2::new(f64::from(u), f64::from(v)) - uv_on(CUBE_FACES[face as usize], d))
                .abs()
                .max_element()
        }));
        assert!(error <= bound, "{name} is off by {error:e}");
        println!("{name} is off by {error:e}");
    }
}

#[test]
fn a_cube_point_leads_back_to_its_direction() {
    let Some(gpu) = gpu() else { return };
    let inputs = directions_of_all_lengths();
    let back = "let point = cube_face_point(input.xyz);
        let d = cube_face_direction(point.face, point.uv);
        return vec4f(d, dot(d, cube_face_forward(point.face)));";
    let outputs = run(&gpu, back, &inputs);
    assert!(
        outputs.iter().all(|output| output[3] == 1.0),
        "the direction does not end on the cube"
    );
    let angle = |(&input, &output): (&[f32; 4], &[f32; 4])| {
        assert!(vec3(input).dot(vec3(output)) > 0.0, "{input:?} came back reversed");
        vec3(input).normalize().cross(vec3(output).normalize()).length()
    };
    let error = largest(inputs.iter().zip(&outputs).map(angle));
    // Each of two coordinates is off by 2 EPSILON in uv (above), 4 on the cube, √2 of that together; one more for 2uv −
    // 1.
    let bound = 7.0 * EPSILON;
    assert!(error <= bound, "{error:e} rad");
    println!("off by {error:e} rad");
}

#[test]
fn every_point_of_a_face_has_a_texel() {
    let Some(gpu) = gpu() else { return };
    let below = LARGEST_BELOW_ONE;
    let uvs = [
        [0.0, 1.0],
        [-1e-7, 1.0 + 1e-7],
        [below, 0.5],
        [0.999, 0.25],
        [-3.0, 1e9],
    ];
    for size in [1u32, 2, 3, 64, 1024, 8192] {
        let inputs: Vec<[f32; 4]> = uvs.iter().map(|&[u, v]| [u, v, size as f32, 0.0]).collect();
        let outputs = run(
            &gpu,
            "return vec4f(vec2f(cube_face_texel(input.xy, u32(input.z))), 0.0, 0.0);",
            &inputs,
        );
        for ([u, v], output) in uvs.into_iter().zip(outputs) {
            // As `f32`, in which `below` times a power of two keeps below it.
            let texel = |x: f32| ((x.max(0.0) * size as f32) as u32).min(size - 1) as f32;
            assert_eq!(output[..2], [texel(u), texel(v)], "({u}, {v}) of {size}");
        }
    }
}

const BASES: [u64; 6] = [2, 3, 5, 7, 11, 13];
/// As many as fit the 24 bits of an `f32` (base 2) or 32 bits.
const DIGITS: [u32; 6] = [24, 20, 13, 11, 9, 8];

/// The radical inverse of the digits that are kept, exactly, as a fraction.
fn radical_inverse(index: u32, dimension: usize) -> (u64, u64) {
    let base = BASES[dimension];
    let (mut rest, mut reversed) = (u64::from(index), 0);
    for _ in 0..DIGITS[dimension] {
        reversed = reversed * base + rest % base;
        rest /= base;
    }
    (reversed, base.pow(DIGITS[dimension]))
}

fn halton_indices() -> Vec<u32> {
    let powers = BASES
        .iter()
        .flat_map(|&base| (1..).map(move |k| base.pow(k)).take_while(|&power| power <= 1 << 32));
    let around = powers
        .flat_map(|power| [power - 1, power, power + 1])
        .filter_map(|index| u32::try_from(index).ok());
    let ends = [(1 << 31) - 1, 1 << 31, (1 << 31) + 1, u32::MAX - 1, u32::MAX];
    let mut random = Random(4);
    let random = (0..10_000).map(move |_| random.bits());
    (0..=1000).chain(around).chain(ends).chain(random).collect()
}

fn with_dimension(indices: &[u32], dimension: usize) -> Vec<[u32; 4]> {
    indices.iter().map(|&index| [index, dimension as u32, 0, 0]).collect()
}

const HALTON: &str = "return vec4f(halton(input.x, input.y));";

#[test]
fn halton_is_the_radical_inverse_and_stays_below_one() {
    let Some(gpu) = gpu() else { return };
    let indices = halton_indices();
    for dimension in 0..6 {
        let outputs = run(&gpu, HALTON, &with_dimension(&indices, dimension));
        let error = largest(indices.iter().zip(&outputs).map(|(&index, &[x, ..])| {
            let (numerator, denominator) = radical_inverse(index, dimension);
            assert!((0.0..1.0).contains(&x), "halton({index}, {dimension}) = {x}");
            (f64::from(x) - numerator as f64 / denominator as f64).abs()
        }));
        // Base 2 is arithmetic of bits. Else two conversions of half an ulp each and a division good to 2.5.
        let bound = if dimension == 0 { 0.0 } else { 3.5 * EPSILON };
        assert!(error <= bound, "dimension {dimension}: {error:e}");
        println!("dimension {dimension} off by {error:e}");
    }
}

#[test]
fn halton_fills_elementary_boxes_evenly() {
    let Some(gpu) = gpu() else { return };
    let indices: Vec<u32> = (0..4096).collect();
    let axis = |dimension| run(&gpu, HALTON, &with_dimension(&indices, dimension));
    // These indices have at most 8 digits in base 3, so the exact values are multiples of 3^-8, 1.5e-4. A shift of 1e-5
    // puts one that was rounded across the edge of a box back, and moves no other.
    let position = |value: &[f32; 4]| f64::from(value[0]) + 1e-5;
    let points: Vec<(f64, f64)> = axis(0).iter().map(position).zip(axis(1).iter().map(position)).collect();
    let mut boxes = 0;
    let sides = (0..=12).flat_map(|a| (0..=7).map(move |b| (2usize.pow(a), 3usize.pow(b))));
    // With many more boxes than points, hardly any box could hold a second one.
    for (columns, rows) in sides.filter(|(columns, rows)| columns * rows <= 1 << 16) {
        // By the Chinese remainder theorem one in columns × rows consecutive indices falls into each box.
        for count in [4096, 3456, 2187, 1000] {
            let mut found = vec![0; columns * rows];
            for (x, y) in &points[..count] {
                found[(y * rows as f64) as usize * columns + (x * columns as f64) as usize] += 1;
            }
            let expected = count / found.len()..=count.div_ceil(found.len());
            assert!(
                found.iter().all(|n| expected.contains(n)),
                "{columns} × {rows} boxes, {count} points"
            );
            boxes += found.len();
        }
    }
    println!("{boxes} boxes");
}

/// Neighbours, the first beyond the Halton sequence, one far along a walk, and the last.
const HASHED: [u32; 7] = [0, 1, 6, 7, 33, 1000, u32::MAX];
const HASH: &str = "return vec4f(hash_unit(input.x, input.y), hash_unit(input.x, input.y + 1u), 0.0, 0.0);";

/// Numbers of consecutive indices in this dimension, and those of the next beside them.
fn hashed(gpu: &Gpu, dimension: u32, count: u32) -> Vec<[f64; 2]> {
    let inputs: Vec<[u32; 4]> = (0..count).map(|index| [index, dimension, 0, 0]).collect();
    run(gpu, HASH, &inputs)
        .iter()
        .map(|v| [f64::from(v[0]), f64::from(v[1])])
        .collect()
}

#[test]
fn hashed_numbers_are_uniform() {
    let Some(gpu) = gpu() else { return };
    let count = 1 << 18;
    for dimension in HASHED {
        let values: Vec<f64> = hashed(&gpu, dimension, count).iter().map(|pair| pair[0]).collect();
        assert!(values.iter().all(|x| (0.0..1.0).contains(x)));
        let n = f64::from(count);
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>() / n;
        // Of a uniform number x, and of (x − ½)²; in standard errors. 5 of them are exceeded once in 1.7 million.
        let mean_error = (mean - 0.5) * (12.0 * n).sqrt();
        let variance_error = (variance - 1.0 / 12.0) * (180.0 * n).sqrt();
        assert!(mean_error.abs() < 5.0, "dimension {dimension}: mean {mean}");
        assert!(variance_error.abs() < 5.0, "dimension {dimension}: variance {variance}");
        let mut counts = [0.0; 64];
        values.iter().for_each(|x| counts[(x * 64.0) as usize] += 1.0);
        let p = chi_square(&counts, &[n / 64.0; 64]);
        assert!(p > LEAST_P, "dimension {dimension}: p = {p:e}");
        println!("dimension {dimension}: mean {mean_error:+.2} σ, variance {variance_error:+.2} σ, p {p:.4}");
    }
}

#[test]
fn hashed_numbers_are_independent_of_their_neighbours() {
    let Some(gpu) = gpu() else { return };
    let count = 1 << 18;
    for dimension in HASHED {
        let pairs = hashed(&gpu, dimension, count);
        // In standard errors: the product of two independent (x − ½) has variance 1/144.
        for lag in [1, 2, 64] {
            let products = pairs
                .iter()
                .zip(&pairs[lag..])
                .map(|(a, b)| (a[0] - 0.5) * (b[0] - 0.5));
            let correlation = 12.0 * products.sum::<f64>() / f64::from(count).sqrt();
            assert!(
                correlation.abs() < 5.0,
                "dimension {dimension}, lag {lag}: {correlation} σ"
            );
        }
        let consecutive: Vec<[f64; 2]> = pairs.windows(2).map(|w| [w[0][0], w[1][0]]).collect();
        let p = [
            chi_square_2d(&pairs, |_| 1.0, |_| 1.0),
            chi_square_2d(&consecutive, |_| 1.0, |_| 1.0),
        ];
        assert!(p.iter().all(|&p| p > LEAST_P), "dimension {dimension}: p = {p:?}");
        println!(
            "dimension {dimension}: p {:.4} with the next, {:.4} along the index",
            p[0], p[1]
        );
    }
}

#[test]
fn random_numbers_are_halton_up_to_dimension_six_and_hashed_from_there() {
    let Some(gpu) = gpu() else { return };
    let indices = halton_indices();
    let body = "return vec4f(random_pair(input.x, input.y), halton(input.x, input.y), hash_unit(input.x, input.y));";
    for dimension in [0, 1, 2, 3, 4, 5, 6, 7, 100, u32::MAX] {
        let inputs: Vec<_> = indices.iter().map(|&index| [index, dimension, 0, 0]).collect();
        let next: Vec<_> = indices
            .iter()
            .map(|&index| [index, dimension.wrapping_add(1), 0, 0])
            .collect();
        let unit = run(&gpu, "return vec4f(random_unit(input.x, input.y));", &inputs);
        let next = run(&gpu, "return vec4f(random_unit(input.x, input.y));", &next);
        for (i, [x, y, halton, hash]) in run(&gpu, body, &inputs).into_iter().enumerate() {
            let expected = if dimension < 6 { halton } else { hash };
            assert_eq!(
                [x, y],
                [unit[i][0], next[i][0]],
                "index {}, dimension {dimension}",
                indices[i]
            );
            assert_eq!(x, expected, "index {}, dimension {dimension}", indices[i]);
            assert!(
                (0.0..1.0).contains(&x),
                "index {}, dimension {dimension}: {x}",
                indices[i]
            );
        }
    }
}

#[test]
fn a_frame_is_orthonormal_right_handed_and_keeps_its_axis() {
    let Some(gpu) = gpu() else { return };
    let near_poles = [1e-30f64, 1e-12, 1e-8, 1e-6, 1e-4, 1e-3].into_iter().flat_map(|x| {
        let around = [[x, 0.0], [0.0, x], [-x, x], [x, -x]].map(DVec2::from_array);
        around
            .into_iter()
            .flat_map(|xy| [-1.0, 1.0].map(|z| xy.extend(z).normalize()))
    });
    let directions = special_directions()
        .into_iter()
        .chain(near_poles)
        .chain(random_directions(50_000, 5));
    let mut inputs: Vec<[f32; 4]> = directions.map(vec4).collect();
    inputs.extend([[1.0, 0.0, -0.0, 0.0], [0.6, 0.8, -0.0, 0.0], [0.6, 0.8, -1e-30, 0.0]]);
    let column = |i: u32| {
        run(
            &gpu,
            &format!("return vec4f(sampling_frame(input.xyz)[{i}], 0.0);"),
            &inputs,
        )
    };
    let (x, y, z) = (column(0), column(1), column(2));
    let error = largest((0..inputs.len()).map(|i| {
        assert_eq!(z[i], inputs[i]);
        let frame = DMat3::from_cols(vec3(x[i]), vec3(y[i]), vec3(z[i]));
        assert!(frame.determinant() > 0.0, "{:?} gives a left-handed frame", inputs[i]);
        let off = frame.transpose() * frame - DMat3::IDENTITY;
        largest(off.to_cols_array().into_iter().map(f64::abs))
    }));
    // The axis itself is rounded, up to EPSILON off unit length, and each component of the other two by some 3
    // roundings.
    assert!(error < 1e-6, "{error:e}");
    println!("frame off by {error:e}");
}

/// A sampler, and what it should sample. A sample is told by its position, from 0 in the middle of the support to 1 at
/// its end, and by its azimuth, on which no pdf here depends. Every function takes the parameters last.
struct Sampler {
    name: String,
    /// WGSL expression in `input`: xy uniform numbers, zw the parameters
    wgsl: &'static str,
    parameters: [f32; 2],
    position: fn(DVec3, [f64; 2]) -> f64,
    /// Solid angle or area per position
    measure: fn(f64, [f64; 2]) -> f64,
    /// Per solid angle or area
    pdf: fn(f64, [f64; 2]) -> f64,
    /// Integrates to one over the same support
    wrong_pdf: fn(f64, [f64; 2]) -> f64,
    /// Probability within a position
    cdf: fn(f64, [f64; 2]) -> f64,
}

impl Sampler {
    fn sample(&self, gpu: &Gpu, pairs: &[[f32; 2]]) -> Vec<DVec3> {
        let [a, b] = self.parameters;
        let inputs: Vec<_> = pairs.iter().map(|&[x, y]| [x, y, a, b]).collect();
        let outputs = run(gpu, &format!("return vec4f({}, 0.0);", self.wgsl), &inputs);
        outputs.into_iter().map(vec3).collect()
    }

    fn parameters(&self) -> [f64; 2] {
        self.parameters.map(f64::from)
    }

    fn position(&self, sample: DVec3) -> f64 {
        (self.position)(sample, self.parameters())
    }

    /// Probability that samples of this pdf are at least as unlike it as these.
    fn p_value(&self, samples: &[DVec3], pdf: fn(f64, [f64; 2]) -> f64) -> f64 {
        let parameters = self.parameters();
        let points: Vec<_> = samples.iter().map(|&s| [self.position(s), turn(s)]).collect();
        chi_square_2d(&points, |t| pdf(t, parameters) * (self.measure)(t, parameters), |_| 1.0)
    }
}

/// Azimuth, from 0 to 1.
fn turn(sample: DVec3) -> f64 {
    (sample.y.atan2(sample.x) / TAU).rem_euclid(1.0)
}

/// Half angles of spots in degrees, inner and outer.
const SPOTS: [[f64; 2]; 12] = [
    [0.0, 32.0],
    [20.0, 32.0],
    [20.0, 20.0],
    [29.99, 30.0],
    [0.0, 0.01],
    [0.005, 0.01],
    [0.01, 0.01],
    [0.0, 89.9],
    [0.01, 89.9],
    [45.0, 89.9],
    [89.9, 89.9],
    [90.0, 90.0],
];

/// 1 − cos of an angle in degrees, as the light record has it.
fn spot_edge(degrees: f64) -> f32 {
    (2.0 * (0.5 * degrees.to_radians()).sin().powi(2)) as f32
}

/// Falloff at v = 1 − cos θ by its definition.
fn spot_falloff(v: f64, [inner, outer]: [f64; 2]) -> f64 {
    if v <= inner {
        1.0
    } else if v >= outer {
        0.0
    } else {
        ((outer - v) / (outer - inner)).powi(2)
    }
}

/// Its integral over the solid angle, by 2π.
fn spot_flux([inner, outer]: [f64; 2]) -> f64 {
    inner + (outer - inner) / 3.0
}

fn spot_pdf(v: f64, spot: [f64; 2]) -> f64 {
    spot_falloff(v, spot) / (TAU * spot_flux(spot))
}

fn spot_cdf(v: f64, [inner, outer]: [f64; 2]) -> f64 {
    let penumbra = if v > inner {
        (outer - inner) / 3.0 * (1.0 - ((outer - v) / (outer - inner)).powi(3))
    } else {
        0.0
    };
    (v.min(inner) + penumbra) / spot_flux([inner, outer])
}

fn direction_samplers() -> Vec<Sampler> {
    let sphere = Sampler {
        name: "sphere".into(),
        wgsl: "sampling_sphere(input.xy)",
        parameters: [0.0; 2],
        position: |d, _| 0.5 * (1.0 - d.z),
        measure: |_, _| 4.0 * PI,
        pdf: |_, _| 0.25 * FRAC_1_PI,
        wrong_pdf: |t, _| 0.25 * FRAC_1_PI * (1.0 + 0.1 * (1.0 - 2.0 * t)),
        cdf: |t, _| t,
    };
    let cosine = Sampler {
        name: "cosine".into(),
        wgsl: "sampling_cosine(input.xy)",
        parameters: [0.0; 2],
        position: |d, _| 1.0 - d.z,
        measure: |_, _| TAU,
        pdf: |t, _| FRAC_1_PI * (1.0 - t),
        wrong_pdf: |_, _| 0.5 * FRAC_1_PI,
        cdf: |t, _| 1.0 - (1.0 - t).powi(2),
    };
    let spots = SPOTS.map(|degrees| Sampler {
        name: format!("spot {degrees:?}°"),
        wgsl: "sampling_spot(input.xy, input.z, input.w)",
        parameters: degrees.map(spot_edge),
        position: |d, [_, outer]| one_minus_cos(d) / outer,
        measure: |_, [_, outer]| TAU * outer,
        pdf: |t, spot| spot_pdf(t * spot[1], spot),
        // All umbra for all penumbra, and the other way round
        wrong_pdf: |t, [inner, outer]| spot_pdf(t * outer, [if inner < 0.5 * outer { outer } else { 0.0 }, outer]),
        cdf: |t, spot| spot_cdf(t * spot[1], spot),
    });
    [sphere, cosine].into_iter().chain(spots).collect()
}

fn samplers() -> Vec<Sampler> {
    let disc = Sampler {
        name: "disc".into(),
        wgsl: "sampling_disc(input.xy), 0.0",
        parameters: [0.0; 2],
        position: |p, _| p.truncate().length(),
        measure: |r, _| TAU * r,
        pdf: |_, _| FRAC_1_PI,
        // Uniform in the radius
        wrong_pdf: |r, _| 0.5 * FRAC_1_PI / r,
        cdf: |r, _| r * r,
    };
    direction_samplers().into_iter().chain([disc]).collect()
}

#[test]
fn sampled_directions_are_unit_vectors() {
    let Some(gpu) = gpu() else { return };
    let pairs = random_pairs(100_000, 6);
    for sampler in direction_samplers() {
        let samples = sampler.sample(&gpu, &pairs);
        let error = largest(samples.iter().map(|d| (d.length() - 1.0).abs()));
        // Sine and cosine to some 2^-21 each, as graphics hardware has them, make 2^-20.5 together.
        assert!(error <= 1e-6, "{}: {error:e}", sampler.name);
        println!("{}: length off by {error:e}", sampler.name);
    }
}

#[test]
fn samples_lie_within_their_support() {
    let Some(gpu) = gpu() else { return };
    let pairs = random_pairs(100_000, 7);
    for sampler in samplers() {
        let samples = sampler.sample(&gpu, &pairs);
        let positions: Vec<f64> = samples.iter().map(|&s| sampler.position(s)).collect();
        let excess = largest(positions.iter().map(|t| t - 1.0));
        // What a sample's length may be off by, twice in 1 − cos.
        assert!(excess <= 2e-6, "{}: {excess:e} outside", sampler.name);
        assert!(positions.iter().all(|&t| t >= 0.0), "{}", sampler.name);
        if sampler.name == "cosine" {
            assert!(
                samples.iter().all(|d| d.z > 0.0),
                "a direction along the surface never leaves it"
            );
        }
        println!("{}: {excess:e} outside", sampler.name);
    }
}

#[test]
fn a_sample_leads_back_to_its_random_numbers() {
    let Some(gpu) = gpu() else { return };
    let pairs = random_pairs(100_000, 8);
    for sampler in samplers() {
        let samples = sampler.sample(&gpu, &pairs);
        let of_position = largest(pairs.iter().zip(&samples).map(|(&[x, _], &sample)| {
            let t = sampler.position(sample).min(1.0);
            ((sampler.cdf)(t, sampler.parameters()) - f64::from(x)).abs()
        }));
        let in_plane = pairs
            .iter()
            .zip(&samples)
            .filter(|(_, sample)| sample.truncate() != DVec2::ZERO);
        let of_azimuth = largest(in_plane.map(|(&[_, y], &sample)| {
            let off = (turn(sample) - f64::from(y)).abs();
            off.min(1.0 - off)
        }));
        let name = sampler.name;
        // Vulkan lets pow be off by some 2^-20 of itself (log2 by 2^-21, exp2 by a few ulp); the cdf changes up to 3
        // times as fast as the position. The rest is a handful of roundings.
        assert!(of_position <= 32.0 * EPSILON, "{name}: {of_position:e}");
        // Sine and cosine to 2^-21, as in the length of directions, by 2π, and the rounding of 2π u.
        assert!(of_azimuth <= 2.0 * EPSILON, "{name}: {of_azimuth:e} turns");
        println!("{name}: off by {of_position:e}, {of_azimuth:e} turns");
    }
}

#[test]
fn samples_follow_their_pdf_and_no_other() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(9);
    for sampler in samplers() {
        let pairs: Vec<_> = (0..1 << 18).map(|_| [random.unit(), random.unit()]).collect();
        let samples = sampler.sample(&gpu, &pairs);
        let p = sampler.p_value(&samples, sampler.pdf);
        let wrong = sampler.p_value(&samples, sampler.wrong_pdf);
        assert!(p > LEAST_P, "{}: p = {p:e}", sampler.name);
        assert!(
            wrong < LEAST_P,
            "{}: a wrong pdf passes with p = {wrong:e}",
            sampler.name
        );
        println!("{}: p {p:.4}, of a wrong pdf {wrong:e}", sampler.name);
    }
}

const FALLOFF: &str = "return vec4f(sampling_spot_falloff(input.x, input.y, input.z));";

#[test]
fn the_falloff_of_a_spot_averages_to_its_flux() {
    let Some(gpu) = gpu() else { return };
    for spot in SPOTS.map(|degrees| degrees.map(spot_edge)) {
        let [inner, outer] = spot;
        let count = 1 << 16;
        let cone = (0..count).map(|i| outer * (i as f32 + 0.5) / count as f32);
        let inputs: Vec<_> = cone.map(|v| [v, inner, outer, 0.0]).collect();
        let falloff = run(&gpu, FALLOFF, &inputs);
        let mean = falloff.iter().map(|f| f64::from(f[0])).sum::<f64>() / f64::from(count);
        let spot = spot.map(f64::from);
        let expected = spot_flux(spot) / spot[1];
        // The midpoint rule meets the kink with a slope of 2 outer / (outer − inner) per cone: h²/8 of that, and as
        // much for the curvature; the steps themselves and f are rounded.
        let h = 1.0 / f64::from(count);
        let bound = if inner < outer {
            h * h * (spot[1] / (spot[1] - spot[0])).powi(2)
        } else {
            0.0
        } + 4.0 * EPSILON;
        assert!(
            (mean - expected).abs() <= bound,
            "{spot:?}: {mean} for {expected}, bound {bound:e}"
        );
    }
}

#[test]
fn the_falloff_of_a_spot_is_exact_at_its_edges_and_at_any_scale() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(10);
    let mut spots: Vec<[f32; 2]> = SPOTS.map(|degrees| degrees.map(spot_edge)).to_vec();
    // The narrowest penumbra, and an angle of 10^-7 degrees.
    spots.extend([[0.1, 0.1f32.next_up()], [0.0, spot_edge(1e-7)]]);
    for [inner, outer] in spots {
        let edges = [
            0.0,
            inner,
            inner.next_up(),
            outer.next_down(),
            outer,
            outer.next_up(),
            2.0,
        ];
        let random = (0..10_000).map(|_| 1.2 * outer * random.unit());
        let inputs: Vec<_> = edges
            .into_iter()
            .chain(random)
            .map(|v| [v, inner, outer, 0.0])
            .collect();
        let outputs = run(&gpu, FALLOFF, &inputs);
        let spot = [inner, outer].map(f64::from);
        for (&[v, ..], &[f, ..]) in inputs.iter().zip(&outputs) {
            let expected = spot_falloff(f64::from(v), spot);
            // Two differences rounded, a division good to 2.5 ulp, squared, and rounded: 3.5 EPSILON twice and a half.
            let bound = 7.5 * EPSILON * expected;
            let error = (f64::from(f) - expected).abs();
            assert!(
                error <= bound,
                "f({v:e}) = {f:e} for {expected:e}, inner {inner:e}, outer {outer:e}"
            );
        }
    }
}

#[test]
fn the_falloff_of_a_spot_is_the_square_of_its_cosines_share() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(11);
    for degrees in SPOTS.into_iter().filter(|[inner, outer]| inner < outer) {
        let angles: Vec<f64> = (0..10_000)
            .map(|_| 1.2 * degrees[1] * f64::from(random.unit()))
            .collect();
        let [inner, outer] = degrees.map(spot_edge);
        let inputs: Vec<_> = angles
            .iter()
            .map(|&angle| [spot_edge(angle), inner, outer, 0.0])
            .collect();
        let outputs = run(&gpu, FALLOFF, &inputs);
        let [inner, outer] = degrees.map(|angle| angle.to_radians().cos());
        let error = largest(angles.iter().zip(&outputs).map(|(angle, &[f, ..])| {
            let share = (angle.to_radians().cos() - outer) / (inner - outer);
            (share.clamp(0.0, 1.0).powi(2) - f64::from(f)).abs()
        }));
        // v, inner and outer are rounded, by EPSILON / 2 of outer each, and the share of the penumbra magnifies that;
        // as much again for the f32 arithmetic. f64 cosines of 0.01° differ by 1.5e-8 ± 1e-16.
        let bound = 6.0 * EPSILON * (1.0 - outer) / (inner - outer) + 2e-16 / (inner - outer);
        assert!(error <= bound, "{degrees:?}: {error:e}, bound {bound:e}");
        println!("{degrees:?}°: off by {error:e} of {bound:e}");
    }
}

#[test]
fn one_minus_cosine_keeps_its_digits_at_small_angles() {
    let Some(gpu) = gpu() else { return };
    let pairs = random_pairs(10_000, 12);
    for sampler in direction_samplers() {
        let samples = sampler.sample(&gpu, &pairs);
        let inputs: Vec<_> = samples.iter().map(|&d| vec4(d)).collect();
        let outputs = run(
            &gpu,
            "return vec4f(sampling_one_minus_cos(input.xyz, vec3f(0.0, 0.0, 1.0)));",
            &inputs,
        );
        let error = largest(samples.iter().zip(&outputs).map(|(&d, &[v, ..])| {
            let exact = 0.5 * (d - DVec3::Z).length_squared();
            if exact > 0.0 {
                (f64::from(v) - exact).abs() / exact
            } else {
                f64::from(v)
            }
        }));
        // z − 1 is exact near z = 1 and rounded elsewhere; then squares and sums of positive numbers, a rounding each.
        assert!(error <= 3.0 * EPSILON, "{}: {error:e}", sampler.name);
        println!("{}: off by {error:e} of itself", sampler.name);
    }
}

#[test]
fn a_spot_direction_has_the_falloff_it_was_drawn_with() {
    let Some(gpu) = gpu() else { return };
    let pairs = random_pairs(100_000, 13);
    for sampler in direction_samplers()
        .iter()
        .filter(|sampler| sampler.name.starts_with("spot"))
    {
        let [inner, outer] = sampler.parameters;
        // In two dispatches: seeing both functions at once, a compiler may turn 1 - (1 - v) back into v.
        let directions: Vec<_> = sampler.sample(&gpu, &pairs).into_iter().map(vec4).collect();
        let body = format!(
            "let v = sampling_one_minus_cos(input.xyz, vec3f(0.0, 0.0, 1.0));
            return vec4f(sampling_spot_falloff(v, {inner:?}, {outer:?}));"
        );
        let outputs = run(&gpu, &body, &directions);
        let spot = sampler.parameters();
        // Of the flux, what of the penumbra lies further out is the cube of the falloff's root.
        let share = spot[0] / spot_flux(spot);
        let errors = pairs.iter().zip(&outputs).map(|(&[x, _], &[f, ..])| {
            let x = f64::from(x);
            let rest = (1.0 - x) / (1.0 - share);
            let expected = if x <= share { 1.0 } else { rest.powf(2.0 / 3.0) };
            // Within rounding of a hard edge, either side is right.
            let is_open = inner == outer && x > 1.0 - 4.0 * EPSILON;
            if is_open { 0.0 } else { (f64::from(f) - expected).abs() }
        });
        let error = largest(errors);
        // The penumbra has 1 - share of the flux, so roundings of x, inner and outer are 3 EPSILON / (1 - share) of
        // `rest`, and |a^(2/3) - b^(2/3)| <= |a - b|^(2/3). v, some 3 EPSILON off, is compared with outer - inner, and
        // squared.
        let soft = (3.0 * EPSILON / (1.0 - share)).powf(2.0 / 3.0) + 6.0 * EPSILON * spot[1] / (spot[1] - spot[0]);
        let bound = if inner < outer { soft } else { 0.0 };
        assert!(error <= bound, "{}: {error:e}, bound {bound:e}", sampler.name);
        println!("{}: falloff off by {error:e} of {bound:e}", sampler.name);
    }
}

#[test]
fn the_tail_of_chi_square_has_its_tabulated_values() {
    // Upper 5 % points to the digits of the tables, and the closed form Q(1, x) = exp(−x).
    for (freedom, statistic) in [
        (1.0, 3.841_459),
        (2.0, 5.991_465),
        (10.0, 18.307_038),
        (100.0, 124.342_113),
    ] {
        let p = gamma_tail(0.5 * freedom, 0.5 * statistic);
        assert!((p - 0.05).abs() < 1e-7, "{freedom} degrees of freedom: {p}");
    }
    for x in [1e-3, 0.5, 1.9, 2.1, 30.0] {
        assert!((gamma_tail(1.0, x) / (-x).exp() - 1.0).abs() < 1e-11, "Q(1, {x})");
    }
    // Wilson and Hilferty's cube root is normal to about 1e-4 at this many degrees of freedom: its median.
    let median = 1023.0 * (1.0f64 - 2.0 / (9.0 * 1023.0)).powi(3);
    assert!((gamma_tail(0.5 * 1023.0, 0.5 * median) - 0.5).abs() < 1e-4);
}

#[test]
fn chi_square_sees_a_wrong_azimuth_too() {
    let mut random = Random(14);
    let points: Vec<_> = (0..1 << 18)
        .map(|_| [(); 2].map(|()| f64::from(random.unit())))
        .collect();
    assert!(chi_square_2d(&points, |_| 1.0, |_| 1.0) > LEAST_P);
    assert!(chi_square_2d(&points, |_| 1.0, |y| 1.0 + 0.05 * (TAU * y).cos()) < LEAST_P);
    assert!(chi_square_2d(&points, |x| 1.0 + 0.1 * (x - 0.5), |_| 1.0) < LEAST_P);
}

#[test]
fn workgroups_for_lost_rays_hold_all_of_them_within_the_limit() {
    let Some(gpu) = gpu() else { return };
    const MOST: u32 = 65_535;
    let borders = [1, 2, 3, 64, 1024].map(|rows| rows * MOST).map(|groups| groups * 64);
    let mut random = Random(11);
    let counts: Vec<[u32; 4]> = borders
        .into_iter()
        .flat_map(|count| [count - 64, count - 1, count, count + 1, count + 65])
        .chain([0, 1, 63, 64, 65, u32::MAX])
        .chain((0..1000).map(|_| random.bits() >> (random.bits() % 32)))
        .map(|count| [count; 4])
        .collect();
    let body = "
        let groups = path_list_workgroups(input.x);
        return vec4f(f32(groups[0]), f32(groups[1]), f32(groups[2]), 0.0);";
    for ([count, ..], groups) in counts.iter().zip(run(&gpu, body, &counts)) {
        let [x, y, z, _] = groups.map(|v| v as u32);
        assert!(x <= MOST && y <= MOST && z == 1, "{count}: {x} {y} {z}");
        let (needed, held) = (count.div_ceil(64), u64::from(x) * u64::from(y));
        assert!(held >= u64::from(needed), "{count}: {x} {y}");
        // No row is empty, and none is longer than it must be.
        assert!(held < u64::from(needed) + u64::from(y), "{count}: {x} {y}");
        if needed <= MOST {
            assert_eq!([x, y], [needed, 1], "{count}");
        }
    }
}

#[test]
fn hops_to_walk_again_are_those_that_are_lost_or_tentative() {
    let Some(gpu) = gpu() else { return };
    let states: Vec<[u32; 4]> = (0..1024).map(|state| [state; 4]).collect();
    let body = "return vec4f(f32(photon_is_unresolved(input.x)));";
    for ([state, ..], [found, ..]) in states.iter().zip(run(&gpu, body, &states)) {
        let photon = Photon {
            state: *state,
            ..bytemuck::Zeroable::zeroed()
        };
        assert_eq!(found == 1.0, photon.is_unresolved(), "{state}");
        assert_eq!(photon.is_unresolved(), state & 3 == 3 || state & 512 != 0, "{state}");
    }
}

/// Of a front of radiance 1 at p with normal n, by the midpoint rule over a parallelogram or its first half.
fn flat_irradiance(corner: DVec3, [u, v]: [DVec3; 2], is_triangle: bool, p: DVec3, n: DVec3) -> f64 {
    const STEPS: u32 = 300;
    let front = u.cross(v).normalize();
    let cell = u.cross(v).length() / f64::from(STEPS * STEPS);
    let mut sum = 0.0;
    for i in 0..STEPS {
        for j in 0..STEPS {
            let [a, b] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(STEPS));
            // The diagonal halves the cells that it crosses.
            let share = match i + j + 1 {
                _ if !is_triangle => 1.0,
                k if k < STEPS => 1.0,
                STEPS => 0.5,
                _ => 0.0,
            };
            let way = corner + a * u + b * v - p;
            let direction = way.normalize();
            let cosines = n.dot(direction).max(0.0) * (-front.dot(direction)).max(0.0);
            sum += share * cell * cosines / way.length_squared();
        }
    }
    sum
}

#[test]
fn a_polygon_gives_the_light_that_all_its_points_give_together() {
    let Some(gpu) = gpu() else { return };
    let corner = DVec3::new(-0.5, 1.0, -0.25);
    let sides = [DVec3::new(0.25, 0.0, 1.0), DVec3::new(1.0, 0.25, 0.0)];
    let middle = corner + 0.5 * (sides[0] + sides[1]);
    // Around the front, behind it, and up to where it counts as a point.
    let mut random = Random(31);
    let near = (0..150).map(|_| middle + 0.5 * DVec3::Y + 1.5 * random.direction());
    let mut points: Vec<DVec3> = near.collect();
    points.extend((0..50).map(|_| middle + 200.0 * (random.direction() + 0.5 * DVec3::Y)));
    points.extend((0..50).map(|_| middle + 400.0 * (random.direction() + 0.5 * DVec3::Y)));
    // The normal is made of the fourth number, in the shader and here.
    let inputs: Vec<[f32; 4]> = points
        .iter()
        .map(|p| p.as_vec3().extend(2.0 * random.unit() - 1.0).to_array())
        .collect();
    for (corners, is_triangle) in [(3, true), (4, false)] {
        let body = format!(
            "let n = normalize(vec3f(input.w, input.w * input.w - 1.0, 0.5 * input.w + 0.25));
            let polygon = Polygon(
                vec3f(-0.5, 1.0, -0.25), {corners}u, vec3f(0.25, 0.0, 1.0), 1.0, vec3f(1.0, 0.25, 0.0), 1.0, vec3f(1.0),
            );
            let area = select(1.0, 0.5, {is_triangle}) * length(cross(polygon.u, polygon.v));
            let sized = Polygon(polygon.corner, polygon.corners, polygon.u, 1.0, polygon.v, area, polygon.radiance);
            return vec4f(polygon_irradiance(sized, input.xyz, n));"
        );
        let outputs = run(&gpu, &body, &inputs);
        let (mut worst, mut lit, mut cut) = (0.0, 0, 0);
        for (input, output) in inputs.iter().zip(&outputs) {
            let (p, w) = (vec3(*input), f64::from(input[3]));
            let n = DVec3::new(w, w * w - 1.0, 0.5 * w + 0.25).normalize();
            let expected = flat_irradiance(corner, sides, is_triangle, p, n);
            let whole = sides[0].cross(sides[1]).length() / (middle - p).length_squared();
            // Against what it could be at most: near the horizon all of it goes to zero.
            let error = (f64::from(output[0]) - expected).abs() / whole.min(PI);
            assert!(error < 1e-3, "{p} {n}: {} of {expected}", output[0]);
            worst = error.max(worst);
            lit += u32::from(expected > 0.0);
            let heights = [DVec3::ZERO, sides[0], sides[1]].map(|c| n.dot(corner + c - p) > 0.0);
            cut += u32::from(expected > 0.0 && heights.contains(&true) && heights.contains(&false));
        }
        println!("{corners} corners: {lit} lit, {cut} cut by the horizon, worst {worst:.2e} of the most");
        assert!(lit > 80 && cut > 5, "{lit}, {cut}");
    }
}

#[test]
fn the_additive_recurrence_fills_the_square_evenly() {
    let Some(gpu) = gpu() else { return };
    let inputs: Vec<[u32; 4]> = (0..4096).map(|i| [i, 0, 0, 0]).collect();
    let outputs = run(&gpu, "return vec4f(random_recurrence(input.x), 0.0, 0.0);", &inputs);
    // In 16 × 16 cells 16 points each; by chance some cells would hold fewer than 7 or more than 27.
    let mut counts = [0; 256];
    for output in &outputs {
        assert!(output[..2].iter().all(|x| (0.0..1.0).contains(x)));
        counts[(16.0 * output[0]) as usize * 16 + (16.0 * output[1]) as usize] += 1;
    }
    let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
    assert!(*least >= 12 && *most <= 20, "{least} to {most} points a cell");
    let exact = |alpha: u64, i: u64| ((alpha * i) as u32 >> 8) as f32 / (1 << 24) as f32;
    assert!(
        (0..)
            .zip(&outputs)
            .all(|(i, o)| o[0] == exact(3_242_174_889, i) && o[1] == exact(2_447_445_414, i))
    );
}
