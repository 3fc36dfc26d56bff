//! Density estimation against arithmetic: photons that the test itself made, on a plane of a G-buffer that the test itself
//! made. Also what a host does that plugs in this one stage.

mod common;

use common::statistics::Random;
use common::{Gpu, Wishes, assert_no_errors, gpu, gpu_with};
use lightfall::pass::{
    Bandwidth, BoundaryCorrection, Kernel, PhotonSplatter, PhotonSplatterConfig, PhotonSplatterInputs,
    PhotonSplatterResources, PhotonSplatterSettings, SplatShape,
};
use lightfall::resource::{
    CameraView, GBuffer, GBufferViews, Irradiance, NormalEncoding, Photon, Photons, Subsampling,
};
use lightfall::{read_rgba32float_blocking, wgpu};
use std::sync::LazyLock;

const SIZE: u32 = 64;

/// The plane z = 0 seen along −z: x and y in [−1, 1] fill the view.
fn plane_g_buffer(gpu: &Gpu) -> GBuffer {
    masked_g_buffer(gpu, &[255; (SIZE * SIZE) as usize])
}

/// The same where it is cut away in pixels whose mask is 0.
fn masked_g_buffer(gpu: &Gpu, mask: &[u8]) -> GBuffer {
    numbered_g_buffer(gpu, mask, None)
}

/// The same with a number of the surface for each pixel.
fn numbered_g_buffer(gpu: &Gpu, mask: &[u8], surfaces: Option<&[u16]>) -> GBuffer {
    let mut g_buffer = textured_g_buffer(gpu, mask, surfaces, &PLANE);
    g_buffer.set_view(&gpu.queue, &orthographic_view());
    g_buffer
}

/// The texels of depth and normal; one stands for all.
struct Relief {
    depth: Vec<f32>,
    normal: Vec<[u8; 4]>,
}

/// +z as × 0.5 + 0.5; 128 / 255 is as near to zero as eight bits come.
static PLANE: LazyLock<Relief> = LazyLock::new(|| Relief {
    depth: vec![0.5],
    normal: vec![[128, 128, 255, 0]],
});

/// x and y in [−1, 1], depth 0.5 + 0.5 z.
fn orthographic_view() -> CameraView {
    let matrix = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.5, 0.0],
        [0.0, 0.0, 0.5, 1.0],
    ];
    CameraView::from_matrix(matrix, [0.0, 0.0, -1.0, 0.0], SIZE as f32)
}

/// Without a view.
fn textured_g_buffer(gpu: &Gpu, mask: &[u8], surfaces: Option<&[u16]>, relief: &Relief) -> GBuffer {
    let base_color: Vec<u8> = mask.iter().flat_map(|&alpha| [255, 255, 255, alpha]).collect();
    let texture = |format: wgpu::TextureFormat, texel: &[u8]| {
        let size = wgpu::Extent3d {
            width: SIZE,
            height: SIZE,
            depth_or_array_layers: 1,
        };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let texels = match texel.len() {
            1..=16 => texel.repeat((SIZE * SIZE) as usize),
            _ => texel.to_vec(),
        };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((texels.len() as u32) / SIZE),
            rows_per_image: None,
        };
        gpu.queue.write_texture(texture.as_image_copy(), &texels, layout, size);
        texture.create_view(&Default::default())
    };
    use wgpu::TextureFormat as F;
    let views = GBufferViews {
        depth: texture(F::R32Float, bytemuck::cast_slice(&relief.depth)),
        normal: texture(F::Rgba8Unorm, bytemuck::cast_slice(&relief.normal)),
        normal_encoding: NormalEncoding::HalfOffset,
        base_color: texture(F::Rgba8Unorm, &base_color),
        emission: texture(F::Rgba8Unorm, &[0; 4]),
        surfaces: surfaces.map(|s| texture(F::R16Uint, bytemuck::cast_slice(s))),
        rectangle: None,
    };
    GBuffer::from_views(&gpu.device, views).unwrap()
}

/// A photon of this flux on the plane; normal +z is octahedral (0, 0).
fn photon(x: f32, y: f32, flux: [f32; 3]) -> Photon {
    Photon {
        position: [x, y, 0.0],
        state: 1,
        flux,
        density: 1.0,
        normal: 0,
        direction: 0,
        reflectance: 0,
        light_and_surface: 0,
    }
}

/// Irradiance of every pixel of the whole plane from these photons, RGB, without correction at the view's rim.
fn splat(gpu: &Gpu, config: PhotonSplatterConfig, photons: &[Photon], radius: f32) -> Vec<[f32; 4]> {
    let settings = PhotonSplatterSettings {
        bandwidth: Bandwidth::Fixed(radius),
        boundary: BoundaryCorrection::Off,
        ..Default::default()
    };
    splat_onto(gpu, &plane_g_buffer(gpu), config, photons, &settings)
}

/// The same with these settings, of any G-buffer.
fn splat_onto(
    gpu: &Gpu,
    g_buffer: &GBuffer,
    config: PhotonSplatterConfig,
    photons: &[Photon],
    settings: &PhotonSplatterSettings,
) -> Vec<[f32; 4]> {
    splat_sampled(gpu, g_buffer, config, photons, settings, Subsampling::Full)
}

/// The same at some of its pixels.
fn splat_sampled(
    gpu: &Gpu,
    g_buffer: &GBuffer,
    config: PhotonSplatterConfig,
    photons: &[Photon],
    settings: &PhotonSplatterSettings,
    subsampling: Subsampling,
) -> Vec<[f32; 4]> {
    let size = subsampling.size([SIZE; 2]);
    let count = photons.len() as u32;
    // Hop 0 is direct light and stays out: photons are hop 1 of as many paths.
    let resource = Photons::new(&gpu.device, count, 1).unwrap();
    let offset = u64::from(count) * lightfall::resource::PHOTON_BYTES;
    gpu.queue
        .write_buffer(resource.buffer(), offset, bytemuck::cast_slice(photons));
    let pass = PhotonSplatter::new(&gpu.device, &config).unwrap();
    let mut resources = PhotonSplatterResources::new(&gpu.device, &config, &resource, size).unwrap();
    let irradiance = Irradiance::new(&gpu.device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let inputs = PhotonSplatterInputs {
        queue: &gpu.queue,
        photons: &resource,
        g_buffer,
        subsampling,
        irradiance: &irradiance,
        area: 4.0,
        radius: 1.0,
        sample_offset: 0,
        settings,
        timestamps: None,
    };
    pass.record(&mut encoder, &mut resources, &inputs);
    gpu.queue.submit([encoder.finish()]);
    read_rgba32float_blocking(&gpu.device, &gpu.queue, irradiance.view().texture()).unwrap()
}

/// Photons of equal flux, one watt in all, at random in the middle quarter of the view, so that no kernel hangs over.
fn square_of_photons(count: u32) -> Vec<Photon> {
    let mut random = Random(11);
    let flux = [1.0 / count as f32; 3];
    (0..count)
        .map(|_| photon(random.unit() - 0.5, random.unit() - 0.5, flux))
        .collect()
}

/// Flux that arrives: sum over pixels of irradiance times pixel area.
fn arriving(pixels: &[[f32; 4]]) -> f64 {
    let pixel_area = (2.0 / f64::from(SIZE)).powi(2);
    pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() * pixel_area
}

/// Eight pixels.
const RADIUS: f32 = 0.25;

/// So many photons that this many kernels overlap in the middle of the square of area 1.
fn photons_for_overlap(overlap: f64) -> u32 {
    (overlap / (std::f64::consts::PI * f64::from(RADIUS * RADIUS))).round() as u32
}

fn config(shape: SplatShape) -> PhotonSplatterConfig {
    PhotonSplatterConfig {
        shape,
        ..Default::default()
    }
}

#[test]
fn every_kernel_integrates_to_one() {
    let Some(gpu) = gpu() else { return };
    for kernel in [Kernel::Constant, Kernel::Cone, Kernel::Epanechnikov] {
        // 24 pixels, at 2000 places within a pixel: the error of sampling a disc at pixel centres averages out.
        let config = PhotonSplatterConfig {
            kernel,
            ..Default::default()
        };
        let mut random = Random(5);
        let photons: Vec<_> = (0..2000)
            .map(|_| photon(random.unit() / 32.0, random.unit() / 32.0, [5e-4; 3]))
            .collect();
        let sum = arriving(&splat(&gpu, config, &photons, 0.74));
        println!("{kernel:?}: {sum:.5}");
        assert!((sum - 1.0).abs() < 1e-3, "{kernel:?}: {sum}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn tiles_keep_all_energy_at_any_number_of_photons_a_pixel() {
    let Some(gpu) = gpu() else { return };
    for overlap in [1.0, 100.0, 10_000.0] {
        let photons = square_of_photons(photons_for_overlap(overlap));
        let sum = arriving(&splat(&gpu, config(SplatShape::Tiled), &photons, RADIUS));
        println!("{overlap} photons a pixel: {sum:.5}");
        assert!((sum - 1.0).abs() < 5e-3, "{overlap}: {sum}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn quads_in_sixteen_bits_lose_no_more_than_rounding_until_they_stagnate() {
    let Some(gpu) = gpu() else { return };
    for overlap in [1.0, 100.0, 10_000.0] {
        let photons = square_of_photons(photons_for_overlap(overlap));
        let sum = arriving(&splat(&gpu, config(SplatShape::Quads), &photons, RADIUS));
        println!("{overlap} photons a pixel: {sum:.5}");
        if overlap <= 100.0 {
            // Each addition may cut off a whole step of eleven bits, and a sum holds about `overlap` of them.
            let rounding = overlap / 2048.0;
            assert!((sum - 1.0).abs() < 5e-3 + rounding, "{overlap}: {sum}");
        } else {
            // The documented limit of the format: if this fails, the documentation is out of date.
            assert!(sum < 0.99, "sixteen-bit sums no longer stagnate: {sum}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn quads_in_thirty_two_bits_keep_all_energy_where_the_device_blends_them() {
    let config = PhotonSplatterConfig {
        shape: SplatShape::Quads,
        blend_format: Some(wgpu::TextureFormat::Rgba32Float),
        ..Default::default()
    };
    let features = PhotonSplatter::required_features(&config);
    let wishes = Wishes {
        features,
        ..Default::default()
    };
    if Gpu::open(None, wishes).is_err() {
        println!("skipped: no adapter with {features:?}");
        return;
    }
    let Some(gpu) = gpu_with(wishes) else { return };
    for overlap in [1.0, 100.0, 10_000.0] {
        let photons = square_of_photons(photons_for_overlap(overlap));
        let sum = arriving(&splat(&gpu, config, &photons, RADIUS));
        println!("{overlap} photons a pixel: {sum:.5}");
        assert!((sum - 1.0).abs() < 5e-3, "{overlap}: {sum}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_photon_gives_each_pixel_what_its_kernel_says() {
    let Some(gpu) = gpu() else { return };
    let (x, y, h) = (0.013f32, -0.021f32, 0.3f64);
    let pixels = splat(
        &gpu,
        config(SplatShape::Tiled),
        &[photon(x, y, [1.0, 0.5, 0.25])],
        h as f32,
    );
    for (i, pixel) in (0..).zip(&pixels) {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(SIZE) * 2.0 - 1.0;
        let (dx, dy) = (at(i % SIZE) - f64::from(x), -at(i / SIZE) - f64::from(y));
        let q = (dx * dx + dy * dy) / (h * h);
        let expected = if q < 1.0 {
            2.0 / std::f64::consts::PI * (1.0 - q) / (h * h)
        } else {
            0.0
        };
        for (channel, share) in [(0, 1.0), (1, 0.5), (2, 0.25)] {
            let error = (f64::from(pixel[channel]) - expected * share).abs();
            assert!(
                error < 1e-5 * 2.0 / (std::f64::consts::PI * h * h),
                "pixel {i}: {error}"
            );
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn one_light_a_billion_times_brighter_than_another_leaves_both_right() {
    let Some(gpu) = gpu() else { return };
    // Far apart: each in tiles of its own.
    let photons = [photon(-0.6, 0.0, [1.0; 3]), photon(0.6, 0.0, [1e-9; 3])];
    let pixels = splat(&gpu, config(SplatShape::Tiled), &photons, 0.2);
    let half = |right: bool| {
        let kept = (0..).zip(&pixels).filter(|(i, _)| (i % SIZE >= SIZE / 2) == right);
        kept.map(|(_, p)| f64::from(p[0])).sum::<f64>() * (2.0 / f64::from(SIZE)).powi(2)
    };
    let (bright, dim) = (half(false), half(true) * 1e9);
    println!("bright {bright:.4}, dim {dim:.4}");
    assert!((bright - 1.0).abs() < 0.02 && (dim / bright - 1.0).abs() < 1e-3);
    assert_no_errors(&gpu);
}

#[test]
fn the_same_photons_give_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let photons = square_of_photons(3000);
    for shape in [SplatShape::Tiled, SplatShape::Quads, SplatShape::Volumes] {
        let first = splat(&gpu, config(shape), &photons, RADIUS);
        for _ in 0..3 {
            assert!(splat(&gpu, config(shape), &photons, RADIUS) == first, "{shape:?}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn the_order_of_photons_changes_no_more_than_rounding() {
    let Some(gpu) = gpu() else { return };
    let mut photons = square_of_photons(3000);
    let forward = splat(&gpu, config(SplatShape::Tiled), &photons, RADIUS);
    photons.reverse();
    let backward = splat(&gpu, config(SplatShape::Tiled), &photons, RADIUS);
    for (a, b) in forward.iter().zip(&backward) {
        // Some 600 photons under a kernel: each sum is rounded as often, half of a 2^-24 at a time.
        assert!((a[0] - b[0]).abs() <= 600.0 * 2f32.powi(-24) * a[0]);
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_photon_on_the_other_side_gives_nothing() {
    let Some(gpu) = gpu() else { return };
    // −z is octahedral (1, 1): both coordinates 32767.
    let below = Photon {
        normal: 0x7fff_7fff,
        ..photon(0.0, 0.0, [1.0; 3])
    };
    let above = Photon {
        position: [0.0, 0.0, 0.2],
        ..photon(0.0, 0.0, [1.0; 3])
    };
    for (what, p) in [("behind the plane", below), ("on a plane above", above)] {
        let sum = arriving(&splat(&gpu, config(SplatShape::Tiled), &[p], 0.3));
        assert_eq!(sum, 0.0, "{what}");
    }
    assert_no_errors(&gpu);
}

/// The square |x|, |y| < 1/2 of the view.
fn is_on_plate(pixel: u32) -> bool {
    let (x, y) = (pixel % SIZE, pixel / SIZE);
    let inside = SIZE / 4..SIZE - SIZE / 4;
    inside.contains(&x) && inside.contains(&y)
}

/// A plate of 1 m², and `side`² photons of a watt in all spread evenly over it: irradiance is 1 W/m² everywhere.
fn plate(gpu: &Gpu, side: u32) -> (GBuffer, Vec<Photon>) {
    let mask: Vec<u8> = (0..SIZE * SIZE).map(|i| if is_on_plate(i) { 255 } else { 0 }).collect();
    let at = |i: u32| (i as f32 + 0.5) / side as f32 - 0.5;
    let flux = [1.0 / (side * side) as f32; 3];
    let photons = (0..side * side).map(|i| photon(at(i % side), at(i / side), flux));
    (masked_g_buffer(gpu, &mask), photons.collect())
}

#[test]
fn light_at_the_rim_of_a_plate_is_as_bright_as_in_its_middle_once_kernels_are_cut() {
    let Some(gpu) = gpu() else { return };
    let (g_buffer, photons) = plate(&gpu, 160);
    // A corner holds 16 of the 64 points: two more or less are an eighth.
    for kernel in [Kernel::Constant, Kernel::Cone, Kernel::Epanechnikov] {
        let range = |boundary| {
            let config = PhotonSplatterConfig {
                kernel,
                ..Default::default()
            };
            let settings = PhotonSplatterSettings {
                bandwidth: Bandwidth::Fixed(RADIUS),
                boundary,
                ..Default::default()
            };
            let pixels = splat_onto(&gpu, &g_buffer, config, &photons, &settings);
            let plate = (0..).zip(&pixels).filter(|&(i, _)| is_on_plate(i));
            plate.fold((f32::MAX, 0f32), |(least, most), (_, p)| {
                (least.min(p[0]), most.max(p[0]))
            })
        };
        let (off, corrected) = (range(BoundaryCorrection::Off), range(BoundaryCorrection::KernelArea));
        println!("{kernel:?}: {off:?} uncorrected, {corrected:?} corrected");
        assert!(off.0 < 0.35 && off.1 < 1.01, "{kernel:?}: a quarter in the corners");
        assert!(corrected.0 > 0.87 && corrected.1 < 1.15, "{kernel:?}: {corrected:?}");
    }
    assert_no_errors(&gpu);
}

/// Two surfaces in one plane that meet in the view's middle, 3 to the left of 70, and a plane of 1 m² half on either with even
/// light on 3 alone, of photons on `surface`.
fn two_surfaces(gpu: &Gpu, surface: u32) -> (GBuffer, Vec<Photon>) {
    let is_left = |i: u32| i % SIZE < SIZE / 2;
    let mask: Vec<u8> = (0..SIZE * SIZE).map(|i| if is_on_plate(i) { 255 } else { 0 }).collect();
    let numbers: Vec<u16> = (0..SIZE * SIZE).map(|i| if is_left(i) { 3 } else { 70 }).collect();
    let (_, photons) = plate(gpu, 60);
    let on_left = photons.into_iter().filter(|p| p.position[0] < 0.0);
    let numbered = on_left.map(|p| Photon {
        light_and_surface: surface << 16,
        ..p
    });
    (numbered_g_buffer(gpu, &mask, Some(&numbers)), numbered.collect())
}

#[test]
fn light_keeps_to_its_surface_and_is_whole_at_the_rim_of_it() {
    let Some(gpu) = gpu() else { return };
    let (g_buffer, photons) = two_surfaces(&gpu, 3);
    // Some 113 photons under a kernel: each addition in sixteen bits may cut off half a step of 2^-11.
    let lost = 113.0 / 4096.0;
    let settings = PhotonSplatterSettings {
        bandwidth: Bandwidth::Fixed(0.1),
        ..Default::default()
    };
    // Irradiance just left and right of the border, away from the plate's rim.
    let beside = |config: PhotonSplatterConfig, photons: &[Photon]| {
        let pixels = splat_onto(&gpu, &g_buffer, config, photons, &settings);
        let at = |x: u32| pixels[(SIZE / 2 * SIZE + x) as usize][0];
        [at(SIZE / 2 - 1), at(SIZE / 2)]
    };
    for shape in [SplatShape::Tiled, SplatShape::Quads, SplatShape::Volumes] {
        let keeps = PhotonSplatterConfig {
            keeps_to_surfaces: true,
            ..config(shape)
        };
        let [left, right] = beside(keeps, &photons);
        let spilt = beside(config(shape), &photons);
        println!("{shape:?}: {left:.3} and {right:.3} W/m² beside the border, {spilt:.3?} where light spills over");
        // A straight rim holds 32 of the 64 points: two more or less are a sixteenth.
        assert!(left < 1.07 && left > 0.93 - lost && right == 0.0, "{shape:?}");
        // A kernel that stands half a pixel, 0.156 of its radius, off the border has half and 8 / 3π times that on its own
        // side, 8 / 3π being what (1 - r²) 2 / π integrates to along the border.
        for (found, wanted) in spilt.into_iter().zip([0.631, 0.369]) {
            assert!((found - wanted).abs() < 0.01 + lost, "{shape:?}: {found}");
        }
        // No surface in particular takes part in all.
        let unnumbered: Vec<_> = photons
            .iter()
            .map(|&p| Photon {
                light_and_surface: 0,
                ..p
            })
            .collect();
        let [_, right] = beside(keeps, &unnumbered);
        assert!(right > 0.4, "{shape:?}: {right}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn all_shapes_and_rules_give_the_same_light() {
    let Some(gpu) = gpu() else { return };
    let (g_buffer, photons) = plate(&gpu, 60);
    // A radius of 0.1 holds π/100 of the plate's photons, which cover a quarter of the view's area: their density is four
    // times the uniform one. By the screen, radii at the rim are up to twice as wide, for the bins there are half empty.
    // Each addition in sixteen bits may cut off half a step of 2^-11.
    let under_a_kernel = 0.01 * std::f32::consts::PI * 3600.0;
    let rules = [
        Bandwidth::Fixed(0.1),
        Bandwidth::Density {
            photons: under_a_kernel,
            clamp: [4.0, 4.0],
        },
        Bandwidth::Screen {
            photons: under_a_kernel,
            clamp: [1.0, 100.0],
        },
    ];
    for (bandwidth, additions) in rules.into_iter().zip([114.0, 114.0, 456.0]) {
        let settings = PhotonSplatterSettings {
            bandwidth,
            ..Default::default()
        };
        let image = |shape| splat_onto(&gpu, &g_buffer, config(shape), &photons, &settings);
        let tiled = image(SplatShape::Tiled);
        let sum = arriving(&tiled);
        println!("{bandwidth:?}: {sum:.4} W");
        assert!((sum - 1.0).abs() < 0.02, "{bandwidth:?}: {sum} W");
        for shape in [SplatShape::Quads, SplatShape::Volumes] {
            let pairs = image(shape).into_iter().zip(&tiled);
            let worst = pairs.map(|(a, b)| (a[0] - b[0]).abs()).fold(0f32, f32::max);
            println!("    {shape:?}: off by {worst:.4} W/m² at most");
            assert!(worst < additions / 4096.0, "{bandwidth:?}, {shape:?}: {worst}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn an_eye_inside_of_kernels_loses_no_light() {
    let Some(gpu) = gpu() else { return };
    // The plane from this far above, a right angle wide: kernels are five times as wide as the image, and thicker than the eye
    // is high.
    let (eye, radius) = (0.1f32, 0.5f32);
    let near = 0.5 * eye;
    let matrix = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
        [0.0, 0.0, near, eye],
    ];
    let mut g_buffer = textured_g_buffer(&gpu, &[255; (SIZE * SIZE) as usize], None, &PLANE);
    let pixels_per_radian = SIZE as f32 / 2.0;
    g_buffer.set_view(
        &gpu.queue,
        &CameraView::from_matrix(matrix, [0.0, 0.0, eye, 1.0], pixels_per_radian),
    );
    // One watt a square metre over the 2 x 2 m around.
    let side = 40;
    let at = |i: u32| (2.0 * i as f32 + 1.0) / side as f32 - 1.0;
    let flux = [4.0 / (side * side) as f32; 3];
    let photons: Vec<_> = (0..side * side)
        .map(|i| photon(at(i % side), at(i / side), flux))
        .collect();
    let settings = PhotonSplatterSettings {
        bandwidth: Bandwidth::Fixed(radius),
        ..Default::default()
    };
    // Some 314 photons under a kernel: each addition in sixteen bits may cut off half a step of 2^-11.
    for (shape, lost) in [
        (SplatShape::Tiled, 0.0),
        (SplatShape::Quads, 314.0 / 4096.0),
        (SplatShape::Volumes, 314.0 / 4096.0),
    ] {
        let pixels = splat_sampled(&gpu, &g_buffer, config(shape), &photons, &settings, Subsampling::Eighth);
        let range = pixels
            .iter()
            .fold([f32::MAX, 0.0], |[least, most], p| [least.min(p[0]), most.max(p[0])]);
        println!("{shape:?}: {range:?} W/m²");
        assert!(range[0] > 0.99 - lost && range[1] < 1.01, "{shape:?}: {range:?}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn light_across_a_crease_is_continuous() {
    let Some(gpu) = gpu() else { return };
    // Two planes that meet along x = 0 of the view, each tilted by this angle, as a valley and as a ridge, evenly lit.
    for (tilt, is_valley) in [(10f32, true), (10.0, false), (45.0, true), (45.0, false)] {
        let (sine, cosine) = tilt.to_radians().sin_cos();
        let slope = if is_valley { sine / cosine } else { -sine / cosine };
        let across = |x: f32| -x.signum() * slope * cosine;
        let encode = |v: f32| (127.5 * v + 127.5).round() as u8;
        let x_of = |i: u32| ((i % SIZE) as f32 + 0.5) / SIZE as f32 * 2.0 - 1.0;
        let pixels = 0..SIZE * SIZE;
        let relief = Relief {
            depth: pixels.clone().map(|i| 0.5 + 0.5 * slope * x_of(i).abs()).collect(),
            normal: pixels
                .map(|i| [encode(across(x_of(i))), 128, encode(cosine), 0])
                .collect(),
        };
        let mut g_buffer = textured_g_buffer(&gpu, &[255; (SIZE * SIZE) as usize], None, &relief);
        g_buffer.set_view(&gpu.queue, &orthographic_view());
        // As many on a square metre of either plane: one watt each.
        let side = 80;
        let at = |i: u32| (2.0 * i as f32 + 1.0) / side as f32 - 1.0;
        let flux = [4.0 / (cosine * (side * side) as f32); 3];
        let photons: Vec<_> = (0..side * side)
            .map(|i| {
                let x = at(i % side);
                // Octahedral: x over the sum of the three coordinates' sizes, in sixteen bits.
                let folded = across(x) / (across(x).abs() + cosine);
                Photon {
                    position: [x, at(i / side), slope * x.abs()],
                    normal: u32::from((32767.0 * folded).round() as i16 as u16),
                    ..photon(x, 0.0, flux)
                }
            })
            .collect();
        for boundary in [BoundaryCorrection::Off, BoundaryCorrection::KernelArea] {
            let settings = PhotonSplatterSettings {
                bandwidth: Bandwidth::Fixed(0.15),
                boundary,
                ..Default::default()
            };
            let image = splat_onto(&gpu, &g_buffer, config(SplatShape::Tiled), &photons, &settings);
            // Of the middle row, away from the view's rim.
            let row = &image[(SIZE / 2 * SIZE) as usize..][..SIZE as usize];
            let inner = &row[SIZE as usize / 4..3 * SIZE as usize / 4];
            let range = inner
                .iter()
                .fold([f32::MAX, 0.0], |[least, most], p| [least.min(p[0]), most.max(p[0])]);
            println!("{tilt}°, valley: {is_valley}, {boundary:?}: {range:?} W/m²");
            let turns_away = 2.0 * tilt > 45.0;
            match (turns_away, boundary) {
                // Photons shine across.
                (false, _) => assert!(range[0] > 0.99 && range[1] < 1.01),
                // Half a pixel, 0.1 of a radius, off the crease: see `light_keeps_to_its_surface_and_is_whole_at_the_rim_of_it`.
                (true, BoundaryCorrection::Off) => assert!(range[0] < 0.65 && range[1] < 1.01),
                // A straight rim holds 32 of the 64 points: two more or less are a sixteenth.
                (true, BoundaryCorrection::KernelArea) => assert!(range[0] > 0.93 && range[1] < 1.07),
            }
        }
    }
    assert_no_errors(&gpu);
}
