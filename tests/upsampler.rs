//! Up-sampling against arithmetic: what interpolation on a plane must give, what must not cross an edge, and an f64 twin of
//! the weights. Also that a sub-sampled estimate is the full one where its samples stand.

mod common;

use common::statistics::Random;
use common::{Component, Gpu, Offline, assert_no_errors, evaluate, gpu};
use lightfall::frame::Settings;
use lightfall::glam::{DAffine3, DMat4, DQuat, DVec2, DVec3};
use lightfall::pass::{
    Bandwidth, MarkedSplatInputs, PhotonSplatter, PhotonSplatterConfig, PhotonSplatterInputs, PhotonSplatterResources,
    PhotonSplatterSettings, SplatShape, Upsampler, UpsamplerInputs, UpsamplerResources, UpsamplerSettings,
};
use lightfall::resource::{
    CameraView, GBuffer, GBufferViews, Irradiance, MarkedPixels, NormalEncoding, PHOTON_BYTES, Photon, Photons,
    Subsampling,
};
use lightfall::scene::{Camera, Instance, Light, Material, Mesh, Projection, Scene, SceneBounds, UnitFrame};
use lightfall::{read_rgba32float_blocking, wgpu};

const FACTORS: [Subsampling; 3] = [Subsampling::Half, Subsampling::Quarter, Subsampling::Eighth];

/// Where a ray meets a surface, and its normal towards the ray's origin; unit frame.
type Surface = (DVec3, DVec3);

/// A G-buffer that the test itself made, and what it holds before rounding.
struct Picture {
    g_buffer: GBuffer,
    view: CameraView,
    size: [u32; 2],
    pixels: Vec<Option<Surface>>,
}

impl Picture {
    fn at(&self, [x, y]: [u32; 2]) -> Option<Surface> {
        self.pixels[(y * self.size[0] + x) as usize]
    }

    /// Every pixel, row by row.
    fn coordinates(&self) -> impl Iterator<Item = [u32; 2]> {
        let [width, height] = self.size;
        (0..height).flat_map(move |y| (0..width).map(move |x| [x, y]))
    }

    /// What a function of position says at the samples.
    fn coarse(&self, subsampling: Subsampling, value: impl Fn(DVec3) -> f64) -> Vec<[f32; 4]> {
        let at = |sample| self.at(subsampling.pixel(sample, self.size));
        let values = samples(subsampling, self.size).map(|sample| at(sample).map_or(0.0, |(p, _)| value(p)) as f32);
        values.map(|v| [v, 0.5 * v, 0.25 * v, 0.0]).collect()
    }
}

fn samples(subsampling: Subsampling, full: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    let [columns, rows] = subsampling.size(full);
    (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y]))
}

/// A view in a unit frame of length scale 1 around the origin; lengths are unit-frame lengths.
fn view(eye: DVec3, target: DVec3, projection: Projection, size: [u32; 2]) -> CameraView {
    let bounds = SceneBounds::new(DVec3::splat(-0.5), DVec3::splat(0.5)).unwrap();
    let frame = UnitFrame::new(&bounds, 1.0).unwrap();
    assert_eq!(frame.length_scale(), 1.0);
    CameraView::new(&frame, &camera(eye, target, projection), size, [0.0; 2])
}

fn camera(eye: DVec3, target: DVec3, projection: Projection) -> Camera {
    let back = (eye - target).normalize();
    let right = DVec3::Y.cross(back).normalize();
    Camera {
        name: String::new(),
        transform: DAffine3::from_cols(right, back.cross(right), back, eye),
        projection,
    }
}

fn perspective(degrees: f64) -> Projection {
    Projection::Perspective {
        fov_y: degrees.to_radians(),
    }
}

/// What `see(origin, direction)` finds through every pixel, as a host's textures, somewhere inside larger ones whose rest
/// would be noticed.
fn picture(
    gpu: &Gpu,
    view: CameraView,
    size: [u32; 2],
    see: impl Fn(DVec3, DVec3) -> Option<(DVec3, DVec3)>,
) -> Picture {
    const ORIGIN: [u32; 2] = [3, 5];
    let full = [size[0] + 7, size[1] + 6];
    let matrix = matrix(&view);
    let inverse = matrix.inverse();
    let (mut depths, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    let mut pixels = Vec::new();
    for y in 0..full[1] {
        for x in 0..full[0] {
            let inside = |v: u32, axis: usize| v >= ORIGIN[axis] && v < ORIGIN[axis] + size[axis];
            if !inside(x, 0) || !inside(y, 1) {
                depths.push(0.9f32);
                normals.push([1.0f32, 0.0, 0.0, 0.0]);
                colors.push([255u8; 4]);
                continue;
            }
            let at = |v: u32, axis: usize| 2.0 * (f64::from(v - ORIGIN[axis]) + 0.5) / f64::from(size[axis]) - 1.0;
            let through = |depth: f64| inverse.project_point3(DVec3::new(at(x, 0), -at(y, 1), depth));
            let origin = through(1.0);
            let surface = see(origin, (through(0.5) - origin).normalize());
            let clip = surface.map(|(p, _)| matrix * p.extend(1.0));
            depths.push(clip.map_or(0.0, |c| c.z / c.w) as f32);
            normals.push(surface.map_or([0.0; 4], |(_, n)| n.as_vec3().extend(0.0).to_array()));
            colors.push(if surface.is_some() { [255; 4] } else { [0; 4] });
            pixels.push(surface);
        }
    }
    use wgpu::TextureFormat as F;
    let views = GBufferViews {
        depth: texture(gpu, full, F::R32Float, bytemuck::cast_slice(&depths)),
        normal: texture(gpu, full, F::Rgba32Float, bytemuck::cast_slice(&normals)),
        normal_encoding: NormalEncoding::Signed,
        base_color: texture(gpu, full, F::Rgba8Unorm, bytemuck::cast_slice(&colors)),
        emission: texture(gpu, full, F::Rgba8Unorm, bytemuck::cast_slice(&colors)),
        surfaces: None,
        rectangle: Some([ORIGIN[0], ORIGIN[1], size[0], size[1]]),
    };
    let mut g_buffer = GBuffer::from_views(&gpu.device, views).unwrap();
    g_buffer.set_view(&gpu.queue, &view);
    Picture {
        g_buffer,
        view,
        size,
        pixels,
    }
}

fn matrix(view: &CameraView) -> DMat4 {
    DMat4::from_cols_array_2d(&view.capture.view_projection.map(|c| c.map(f64::from)))
}

fn texture(gpu: &Gpu, size: [u32; 2], format: wgpu::TextureFormat, texels: &[u8]) -> wgpu::TextureView {
    let extent = wgpu::Extent3d {
        width: size[0],
        height: size[1],
        depth_or_array_layers: 1,
    };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: extent,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(texels.len() as u32 / size[1]),
        rows_per_image: None,
    };
    gpu.queue.write_texture(texture.as_image_copy(), texels, layout, extent);
    texture.create_view(&Default::default())
}

fn irradiance(gpu: &Gpu, size: [u32; 2], texels: &[[f32; 4]]) -> Irradiance {
    let format = wgpu::TextureFormat::Rgba32Float;
    Irradiance::from_view(&texture(gpu, size, format, bytemuck::cast_slice(texels))).unwrap()
}

/// Up-samples into irradiance of `size`.
fn upsample_into(
    gpu: &Gpu,
    (g_buffer, size): (&GBuffer, [u32; 2]),
    (subsampling, coarse): (Subsampling, &Irradiance),
    settings: &UpsamplerSettings,
) -> Vec<[f32; 4]> {
    let fine = Irradiance::new(&gpu.device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let inputs = UpsamplerInputs {
        queue: &gpu.queue,
        g_buffer,
        coarse,
        subsampling,
        target: Subsampling::Full,
        irradiance: &fine,
        marked: None,
        settings,
        timestamps: None,
    };
    let mut resources = UpsamplerResources::new(&gpu.device).unwrap();
    Upsampler::new(&gpu.device).record(&mut encoder, &mut resources, &inputs);
    gpu.queue.submit([encoder.finish()]);
    read_rgba32float_blocking(&gpu.device, &gpu.queue, fine.view().texture()).unwrap()
}

fn upsample(gpu: &Gpu, g_buffer: &GBuffer, subsampling: Subsampling, coarse: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let coarse = irradiance(gpu, subsampling.size(g_buffer.size()), coarse);
    let into = (g_buffer, g_buffer.size());
    upsample_into(gpu, into, (subsampling, &coarse), &UpsamplerSettings::default())
}

/// The plane through `point` across `normal`.
fn plane(point: DVec3, normal: DVec3) -> impl Fn(DVec3, DVec3) -> Option<Surface> {
    move |origin, direction| {
        let t = (point - origin).dot(normal) / direction.dot(normal);
        let facing = if direction.dot(normal) < 0.0 { normal } else { -normal };
        (t > 0.0).then(|| (origin + t * direction, facing))
    }
}

fn sphere(center: DVec3, radius: f64) -> impl Fn(DVec3, DVec3) -> Option<Surface> {
    move |origin, direction| {
        let b = (center - origin).dot(direction);
        let root = b * b - (center - origin).length_squared() + radius * radius;
        let t = b - root.max(0.0).sqrt();
        let p = origin + t * direction;
        (root > 0.0 && t > 0.0).then(|| (p, (p - center) / radius))
    }
}

/// The nearer of two.
fn nearer(
    a: impl Fn(DVec3, DVec3) -> Option<Surface>,
    b: impl Fn(DVec3, DVec3) -> Option<Surface>,
) -> impl Fn(DVec3, DVec3) -> Option<Surface> {
    move |origin, direction| {
        let found = [a(origin, direction), b(origin, direction)].into_iter().flatten();
        found.min_by(|l, r| l.0.distance_squared(origin).total_cmp(&r.0.distance_squared(origin)))
    }
}

/// Views that see nothing but the floor y = −0.3: from above, at 3 to 8 degrees (near pixels twice as near as far ones,
/// which stretch 7 to 20 times), and parallel at 10.
fn floor_views(size: [u32; 2]) -> [(&'static str, CameraView); 3] {
    let low = DVec3::new(0.1, -0.2, 0.9);
    let ahead = |degrees: f64| low + DVec3::new(0.2, -degrees.to_radians().tan(), -1.0);
    let parallel = Projection::Orthographic { half_height: 0.03 };
    [
        (
            "steep",
            view(
                DVec3::new(0.2, 0.8, 0.1),
                DVec3::new(0.0, -0.3, 0.0),
                perspective(40.0),
                size,
            ),
        ),
        ("grazing", view(low, ahead(5.6), perspective(5.0), size)),
        ("parallel", view(low, ahead(10.0), parallel, size)),
    ]
}

/// Sizes that are no multiple of any factor, and one that is.
const SIZES: [[u32; 2]; 3] = [[61, 43], [66, 51], [64, 48]];

#[test]
fn a_linear_ramp_on_a_plane_is_reproduced_in_any_view() {
    let Some(gpu) = gpu() else { return };
    let ramp = |p: DVec3| 3.0 + 1.7 * p.x - 0.9 * p.z;
    for size in SIZES {
        for (name, view) in floor_views(size) {
            let picture = picture(&gpu, view, size, plane(DVec3::new(0.0, -0.3, 0.0), DVec3::Y));
            assert!(picture.pixels.iter().all(Option::is_some), "{name} sees only the floor");
            for subsampling in FACTORS {
                let pixels = upsample(&gpu, &picture.g_buffer, subsampling, &picture.coarse(subsampling, ramp));
                let columns = subsampling.size(size);
                let (first, last) = (
                    subsampling.pixel([0, 0], size),
                    subsampling.pixel(columns.map(|n| n - 1), size),
                );
                let (mut worst, mut plain) = (0f64, 0f64);
                for (pixel, found) in picture.coordinates().zip(&pixels) {
                    // Outside the outermost samples they count alone. Inside, weights over w are exact on a plane, so what
                    // is left is rounding.
                    let inner = [0, 1].map(|axis| pixel[axis].clamp(first[axis], last[axis]));
                    let wanted = ramp(picture.at(inner).unwrap().0);
                    worst = worst.max((f64::from(found[0]) / wanted - 1.0).abs());
                    let bilinear = bilinear(&picture, subsampling, pixel, ramp);
                    plain = plain.max((bilinear / wanted - 1.0).abs());
                    assert_eq!(found[3], 1.0, "{name}, {size:?}, {subsampling:?}: {pixel:?} is marked");
                }
                println!("{name}, {size:?}, {subsampling:?}: {worst:.1e}; linear on the screen: {plain:.1e}");
                // Seen at 3 degrees, a rounding of 2^-24 in the direction of a pixel moves its point by 20 times as much,
                // and each of the positions behind a weight has some ten of them: 20 * 10 * 6e-8, of a ramp of slope 2.
                assert!(worst < 2.5e-5, "{name}, {size:?}, {subsampling:?}: {worst}");
            }
        }
    }
    assert_no_errors(&gpu);
}

/// The samples around a pixel, and how far it is from the first towards the second, by axis.
fn around(subsampling: Subsampling, size: [u32; 2], pixel: [u32; 2]) -> [([u32; 2], f64); 2] {
    [0, 1].map(|axis| {
        let count = subsampling.size(size)[axis];
        let at = |sample: u32| subsampling.pixel([sample; 2], size)[axis];
        let low = (0..count).rev().find(|&s| at(s) <= pixel[axis]).unwrap_or(0);
        let high = (low + 1).min(count - 1);
        let span = f64::from(at(high).saturating_sub(at(low)).max(1));
        (
            [low, high],
            ((f64::from(pixel[axis]) - f64::from(at(low))) / span).clamp(0.0, 1.0),
        )
    })
}

/// What interpolation that is linear on the screen gives.
fn bilinear(picture: &Picture, subsampling: Subsampling, pixel: [u32; 2], value: impl Fn(DVec3) -> f64) -> f64 {
    let [(columns, tx), (rows, ty)] = around(subsampling, picture.size, pixel);
    let at = |x: usize, y: usize| {
        let sample = subsampling.pixel([columns[x], rows[y]], picture.size);
        value(picture.at(sample).unwrap().0)
    };
    let row = |y| at(0, y) * (1.0 - tx) + at(1, y) * tx;
    row(0) * (1.0 - ty) + row(1) * ty
}

/// A ball before a wall, with sky beside both.
fn ball_and_wall(gpu: &Gpu, size: [u32; 2]) -> Picture {
    let eye = DVec3::new(0.1, 0.2, 0.9);
    let view = view(eye, DVec3::ZERO, perspective(50.0), size);
    let slanted = DVec3::new(0.5, 0.1, 1.0).normalize();
    let wall = plane(DVec3::new(0.0, 0.0, -0.3), slanted);
    let bounded = move |o: DVec3, d: DVec3| wall(o, d).filter(|(p, _)| p.x > -0.35 && p.y < 0.3);
    picture(
        gpu,
        view,
        size,
        nearer(sphere(DVec3::new(0.05, -0.05, 0.1), 0.2), bounded),
    )
}

fn noise(count: usize, seed: u64) -> Vec<[f32; 4]> {
    let mut random = Random(seed);
    (0..count).map(|_| [0; 4].map(|_| random.unit())).collect()
}

#[test]
fn constant_irradiance_stays_constant_to_the_bit_and_the_sky_stays_black() {
    let Some(gpu) = gpu() else { return };
    for size in [[61, 43], [1, 1], [1, 9], [9, 1], [3, 2]] {
        let picture = ball_and_wall(&gpu, size);
        for subsampling in [Subsampling::Full].into_iter().chain(FACTORS) {
            let value = [0.7, 1.0 / 3.0, 123.4, 0.0];
            // Also where samples see the sky: which sample is taken must not show.
            let [columns, rows] = subsampling.size(size);
            let coarse = vec![value; (columns * rows) as usize];
            let pixels = upsample(&gpu, &picture.g_buffer, subsampling, &coarse);
            for (pixel, found) in picture.coordinates().zip(&pixels) {
                // A thing that none of the sixteen samples around sees has nothing to be interpolated from.
                let sampled = samples(subsampling, size).any(|s| picture.at(subsampling.pixel(s, size)).is_some());
                match picture.at(pixel) {
                    None => assert_eq!(*found, [0.0; 4], "{size:?}, {subsampling:?}: {pixel:?} is sky"),
                    Some(_) if sampled => assert_eq!(found[..3], value[..3], "{size:?}, {subsampling:?}: {pixel:?}"),
                    Some(_) => assert_eq!(*found, [0.0; 4], "{size:?}, {subsampling:?}: {pixel:?} sees no sample"),
                }
            }
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_power_of_two_in_irradiance_changes_no_other_bit() {
    let Some(gpu) = gpu() else { return };
    let size = [61, 43];
    let picture = ball_and_wall(&gpu, size);
    for subsampling in FACTORS {
        let [columns, rows] = subsampling.size(size);
        let coarse = noise((columns * rows) as usize, 3);
        let scaled = |by: f32| coarse.iter().map(|t| t.map(|v| v * by)).collect::<Vec<_>>();
        let reference = upsample(&gpu, &picture.g_buffer, subsampling, &coarse);
        for exponent in [-40, -1, 40] {
            let by = 2f32.powi(exponent);
            let found = upsample(&gpu, &picture.g_buffer, subsampling, &scaled(by));
            let same = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).all(|c| a[c] * by == b[c]) && a[3] == b[3];
            assert!(reference.iter().zip(&found).all(same), "{subsampling:?}, 2^{exponent}");
        }
    }
    assert_no_errors(&gpu);
}

/// What the shader makes of a pixel.
struct Twin {
    irradiance: DVec3,
    alpha: f64,
    /// That fitting samples had in all.
    weight: f64,
    /// How far those of the four around the pixel differ, over the middle of them; above all disagreement where they do not
    /// suffice.
    doubt: f64,
}

/// Twin of `shaders/pass/upsampler.wgsl`.
fn twin(picture: &Picture, subsampling: Subsampling, coarse: &[[f32; 4]], pixel: [u32; 2]) -> Twin {
    let found = |irradiance, alpha, weight, doubt| Twin {
        irradiance,
        alpha,
        weight,
        doubt,
    };
    let settings = UpsamplerSettings::default();
    let size = picture.size;
    let Some((position, shading)) = picture.at(pixel) else {
        return found(DVec3::ZERO, 0.0, 1.0, 0.0);
    };
    let matrix = matrix(&picture.view);
    let row = |i: usize| matrix.row(i);
    let w_of = |p: DVec3| row(3).dot(p.extend(1.0));
    let scale = |i: usize| row(i).truncate().length() * f64::from(size[i]);
    let pixel_width = 2.0 * w_of(position) / scale(0).max(scale(1));
    let normal = geometric_normal(picture, pixel);
    // Irradiance, fit, misfit.
    let sample = |index: [u32; 2]| {
        let at = subsampling.pixel(index, size);
        let (p, n) = picture.at(at)?;
        let turned = (1.0 - n.dot(shading)) / (1.0 - f64::from(settings.normal_agreement));
        let apart = DVec2::new(
            f64::from(at[0]) - f64::from(pixel[0]),
            f64::from(at[1]) - f64::from(pixel[1]),
        );
        let limit = f64::from(settings.plane_distance) * pixel_width * apart.length();
        let rounding = 2f64.powi(-20) * (1.0 + w_of(position));
        let off_plane = [normal, shading].map(|n| (p - position).dot(n).abs());
        let lifted = off_plane[0].min(off_plane[1]) / (limit + rounding);
        let fit = (1.0 - turned).max(0.0) * (1.0 - lifted).max(0.0) * w_of(position) / w_of(p);
        let texel = coarse[(index[1] * subsampling.size(size)[0] + index[0]) as usize];
        let e = DVec3::new(texel[0].into(), texel[1].into(), texel[2].into());
        Some((e, fit, turned + lifted))
    };
    let mean = |weighted: &[(DVec3, f64)]| {
        let total: f64 = weighted.iter().map(|(_, w)| w).sum();
        let sum: DVec3 = weighted.iter().map(|(e, w)| *e * *w).sum();
        (sum / total, total)
    };
    let [(columns, tx), (rows, ty)] = around(subsampling, size, pixel);
    let (tx, ty) = ([1.0 - tx, tx], [1.0 - ty, ty]);
    let four: Vec<_> = [[0, 0], [1, 0], [0, 1], [1, 1]]
        .into_iter()
        .filter_map(|[x, y]| sample([columns[x], rows[y]]).map(|(e, fit, _)| (e, tx[x] * ty[y] * fit)))
        .collect();
    let (value, total) = mean(&four);
    if total > 0.0 {
        let lights = four
            .iter()
            .filter(|(_, weight)| *weight > 0.0)
            .map(|(e, _)| e.element_sum());
        let (least, most) = (lights.clone().fold(f64::INFINITY, f64::min), lights.fold(0.0, f64::max));
        let doubt = if total < 0.25 {
            f64::INFINITY
        } else {
            2.0 * (most - least) / (most + least)
        };
        return found(value, 1.0, total, doubt);
    }
    let counts = subsampling.size(size);
    let near = |low: u32, count: u32| low.saturating_sub(1)..(low + 3).min(count);
    let indices = near(rows[0], counts[1]).flat_map(|y| near(columns[0], counts[0]).map(move |x| [x, y]));
    let sixteen: Vec<_> = indices.filter_map(|i| sample(i).map(|s| (i, s))).collect();
    let weighted: Vec<_> = sixteen
        .iter()
        .map(|&(index, (e, fit, _))| {
            let at = subsampling.pixel(index, size);
            let tent = |axis: usize| 2.0 - f64::from(at[axis].abs_diff(pixel[axis])) / f64::from(subsampling.factor());
            (e, tent(0).max(0.0) * tent(1).max(0.0) * fit)
        })
        .collect();
    let (value, total) = mean(&weighted);
    if total > 0.0 {
        return found(value, 1.0, total, f64::INFINITY);
    }
    let best = sixteen.iter().map(|(_, s)| s).min_by(|a, b| a.2.total_cmp(&b.2));
    found(best.map_or(DVec3::ZERO, |s| s.0), 0.0, 1.0, f64::INFINITY)
}

/// Twin of `g_buffer_geometric_normal`.
fn geometric_normal(picture: &Picture, pixel: [u32; 2]) -> DVec3 {
    let (p, shading) = picture.at(pixel).unwrap();
    let tangent = |axis: usize| {
        let mut neighbours = Vec::new();
        for (step, sign) in [(-1i64, -1.0), (1, 1.0)] {
            let moved = i64::from(pixel[axis]) + step;
            if (0..i64::from(picture.size[axis])).contains(&moved) {
                let mut at = pixel;
                at[axis] = moved as u32;
                // The sky is infinitely far.
                neighbours.extend(picture.at(at).map(|(q, _)| sign * (q - p)));
            }
        }
        let on_surface = |v: &DVec3| v.dot(shading).abs() <= 0.02 * v.length();
        neighbours.into_iter().reduce(|a, b| {
            let second = match (on_surface(&a), on_surface(&b)) {
                (true, false) => false,
                (false, true) => true,
                _ => b.length_squared() < a.length_squared(),
            };
            if second { b } else { a }
        })
    };
    let (Some(x), Some(y)) = (tangent(0), tangent(1)) else {
        return shading;
    };
    let n = x.cross(y).normalize();
    let facing = if n.dot(shading) > 0.0 { n } else { -n };
    if facing.dot(shading) > 0.7 { facing } else { shading }
}

#[test]
fn the_shader_weighs_as_its_twin_does() {
    let Some(gpu) = gpu() else { return };
    let size = [61, 43];
    let picture = ball_and_wall(&gpu, size);
    for subsampling in FACTORS {
        let [columns, rows] = subsampling.size(size);
        let coarse = noise((columns * rows) as usize, 5);
        let pixels = upsample(&gpu, &picture.g_buffer, subsampling, &coarse);
        let (mut worst, mut on_the_verge) = (0f64, 0);
        for (pixel, found) in picture.coordinates().zip(&pixels) {
            let wanted = twin(&picture, subsampling, &coarse, pixel);
            // A sample that barely fits may not fit after rounding, and weights are as uncertain as what they are the
            // small difference of: positions to 1e-6 of a pixel's 0.02, times 2 for `plane_distance`.
            if wanted.weight < 0.01 {
                on_the_verge += 1;
                continue;
            }
            assert_eq!(f64::from(found[3]), wanted.alpha, "{subsampling:?}: alpha of {pixel:?}");
            let error = (DVec3::new(found[0].into(), found[1].into(), found[2].into()) - wanted.irradiance).abs();
            worst = worst.max(error.max_element() * wanted.weight);
        }
        println!("{subsampling:?}: worst {worst:.1e}, {on_the_verge} pixels on the verge");
        assert!(worst < 2e-4, "{subsampling:?}: {worst}");
        assert!(on_the_verge * 50 < pixels.len(), "{on_the_verge}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn alpha_marks_what_no_sample_fits() {
    let Some(gpu) = gpu() else { return };
    // A post of one pixel's width between the samples of a factor of 8, before a wall; sky above.
    let size = [32, 24];
    let flat = view(
        DVec3::Z,
        DVec3::ZERO,
        Projection::Orthographic { half_height: 0.5 },
        size,
    );
    let pixel = 1.0 / 24.0;
    let column = |p: DVec3| ((p.x + 16.0 * pixel) / pixel).floor() as u32;
    let wall = plane(DVec3::new(0.0, 0.0, -0.4), DVec3::Z);
    let bounded = move |o: DVec3, d: DVec3| wall(o, d).filter(|(p, _)| p.y < 0.3);
    let post = plane(DVec3::new(0.0, 0.0, 0.3), DVec3::Z);
    let narrow = move |o: DVec3, d: DVec3| post(o, d).filter(|(p, _)| column(*p) == 16 && p.y < 0.3);
    let picture = picture(&gpu, flat, size, nearer(narrow, bounded));
    for (subsampling, sees_post) in [
        (Subsampling::Half, false),
        (Subsampling::Quarter, false),
        (Subsampling::Eighth, false),
        (Subsampling::Full, true),
    ] {
        let pixels = upsample(
            &gpu,
            &picture.g_buffer,
            subsampling,
            &picture.coarse(subsampling, |p| p.z + 1.0),
        );
        for ([x, y], found) in picture.coordinates().zip(&pixels) {
            let Some((p, _)) = picture.at([x, y]) else {
                assert_eq!(*found, [0.0; 4]);
                continue;
            };
            let fits = p.z < 0.0 || sees_post;
            assert_eq!(found[3], f32::from(u8::from(fits)), "{subsampling:?}: ({x}, {y})");
            let nearest = if fits { p.z + 1.0 } else { 0.6 };
            assert!(
                (f64::from(found[0]) - nearest).abs() < 1e-6,
                "never black: {}",
                found[0]
            );
        }
    }
    assert_no_errors(&gpu);
}

/// A turned box in front of a wall, or standing on a floor. Emission numbers the plane surfaces, so that the G-buffer tells
/// which pixel sees which: 0 is the sky, 1 what the box stands before or on, the others are its sides.
fn box_scene(on_floor: bool, camera: Camera) -> Scene {
    let mut scene = Scene::default();
    let square = if on_floor {
        [
            [-20.0, 0.0, 20.0],
            [20.0, 0.0, 20.0],
            [20.0, 0.0, -20.0],
            [-20.0, 0.0, -20.0],
        ]
    } else {
        [
            [-20.0, -20.0, -2.0],
            [20.0, -20.0, -2.0],
            [20.0, 20.0, -2.0],
            [-20.0, 20.0, -2.0],
        ]
    };
    let mut squares = vec![square];
    for (axis, side) in [(0, -0.5f32), (0, 0.5), (1, -0.5), (1, 0.5), (2, -0.5), (2, 0.5)] {
        let (u, v) = if side > 0.0 { (1, 2) } else { (2, 1) };
        squares.push(
            [(-0.5f32, -0.5f32), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(a, b)| {
                let mut corner = [0.0f32; 3];
                corner[axis] = side;
                corner[(axis + u) % 3] = a;
                corner[(axis + v) % 3] = b;
                corner
            }),
        );
    }
    let turn = DQuat::from_rotation_y(0.5);
    let place = if on_floor {
        DAffine3::from_rotation_translation(turn, DVec3::new(0.0, 0.5, 0.0))
    } else {
        DAffine3::from_rotation_translation(DQuat::from_rotation_z(0.3) * turn, DVec3::ZERO)
    };
    for (number, square) in squares.into_iter().enumerate() {
        scene.materials.push(Material {
            emission: [number as f32 + 1.0; 3],
            ..Material::diffuse("", [0.5; 3])
        });
        scene.meshes.push(Mesh {
            positions: square.to_vec(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        });
        scene.instances.push(Instance {
            transform: if number == 0 { DAffine3::IDENTITY } else { place },
            ..Instance::new(number, number)
        });
    }
    scene
        .lights
        .push(Light::point(DVec3::new(0.0, 5.0, 5.0), 1.0, [1.0; 3]));
    scene.cameras.push(camera);
    scene
}

/// Of pixels at the outline of the box, which see it where a neighbour does not or the other way round: how far from their
/// own thing's value they came out.
#[derive(Default)]
struct Leak {
    count: usize,
    marked: usize,
    worst: f64,
    sum: f64,
    /// Anywhere: the largest error of a pixel that is not marked.
    worst_unmarked: f64,
    /// Anywhere: pixels that are marked though one of the sixteen samples around sees the same plane.
    marked_for_nothing: usize,
}

fn leak(planes: &[usize], pixels: &[[f32; 4]], size: [u32; 2], subsampling: Subsampling) -> Leak {
    let mut leak = Leak::default();
    let plane_at = |[x, y]: [u32; 2]| planes[(y * size[0] + x) as usize];
    let counts = subsampling.size(size);
    for (i, pixel) in (0..).zip(pixels) {
        let at = [i % size[0], i / size[0]];
        let plane = plane_at(at);
        let is_box = |plane: usize| if plane > 1 { 1.0 } else { 0.0 };
        if plane == 0 {
            assert_eq!(*pixel, [0.0; 4], "the sky at {at:?}");
            continue;
        }
        let off = (f64::from(pixel[0]) - is_box(plane)).abs();
        if pixel[3] > 0.5 {
            leak.worst_unmarked = leak.worst_unmarked.max(off);
        } else {
            let [(columns, _), (rows, _)] = around(subsampling, size, at);
            let near = |low: u32, count: u32| low.saturating_sub(1)..(low + 3).min(count);
            let mut samples = near(rows[0], counts[1]).flat_map(|y| near(columns[0], counts[0]).map(move |x| [x, y]));
            let reach = 2 * subsampling.factor();
            let fits = samples.any(|sample| {
                let p = subsampling.pixel(sample, size);
                let in_reach = p[0].abs_diff(at[0]) < reach && p[1].abs_diff(at[1]) < reach;
                in_reach && plane_at(p) == plane
            });
            leak.marked_for_nothing += usize::from(fits);
        }
        let [x, y] = at;
        let neighbours = [[x.wrapping_sub(1), y], [x + 1, y], [x, y.wrapping_sub(1)], [x, y + 1]];
        let mut inside = neighbours.into_iter().filter(|[x, y]| *x < size[0] && *y < size[1]);
        if inside.any(|n| is_box(plane_at(n)) != is_box(plane)) {
            leak.count += 1;
            leak.marked += usize::from(pixel[3] < 0.5);
            leak.worst = leak.worst.max(off);
            leak.sum += off;
        }
    }
    leak
}

#[test]
fn no_light_leaks_across_the_outline_of_a_box() {
    let Some(gpu) = gpu() else { return };
    let size = [203, 141];
    let looks = |eye: DVec3, at: DVec3| camera(eye, at, perspective(30.0));
    let middle = DVec3::new(0.0, 0.4, 0.0);
    // Nothing but the G-buffer is of interest.
    let settings = Settings {
        bounces: 0,
        shadow_map_size: 16,
        ..Settings::fast()
    };
    for (name, scene) in [
        (
            "before a wall",
            box_scene(false, looks(DVec3::new(0.6, 0.5, 5.0), DVec3::ZERO)),
        ),
        ("on a floor", box_scene(true, looks(DVec3::new(1.0, 2.5, 4.0), middle))),
        // The top is seen at 6 degrees, and beyond it the floor at as much.
        (
            "on a floor, grazing",
            box_scene(true, looks(DVec3::new(1.0, 1.5, 5.0), middle)),
        ),
    ] {
        let mut offline = Offline::new(&gpu, scene, &settings, 0, size, Component::All).unwrap();
        offline.render_frame(None).unwrap();
        let g_buffer = offline.view.g_buffer();
        let emission = g_buffer.views().emission.texture();
        let emission = read_rgba32float_blocking(&gpu.device, &gpu.queue, emission).unwrap();
        let unit = offline.renderer.frame().unwrap().radiance_scale();
        let planes: Vec<_> = emission
            .iter()
            .map(|e| (f64::from(e[0]) * unit).round() as usize)
            .collect();
        assert!(planes.iter().filter(|&&p| p > 1).count() > 1000, "the box is seen");
        for subsampling in FACTORS {
            let texel = |sample| {
                let [x, y] = subsampling.pixel(sample, size);
                let plane = planes[(y * size[0] + x) as usize];
                [if plane > 1 { 1.0 } else { 0.0 }; 4]
            };
            let coarse: Vec<[f32; 4]> = samples(subsampling, size).map(texel).collect();
            let coarse = irradiance(&gpu, subsampling.size(size), &coarse);
            // Settings that exclude nothing.
            let any_normal = UpsamplerSettings {
                normal_agreement: -1e9,
                ..Default::default()
            };
            let any_plane = UpsamplerSettings {
                plane_distance: 1e9,
                ..Default::default()
            };
            let bilinear = UpsamplerSettings {
                plane_distance: 1e9,
                ..any_normal
            };
            let leaks = [
                ("joint", UpsamplerSettings::default()),
                ("normals alone", any_plane),
                ("plane alone", any_normal),
                ("bilinear", bilinear),
            ]
            .map(|(what, settings)| {
                let pixels = upsample_into(&gpu, (g_buffer, size), (subsampling, &coarse), &settings);
                let leak = leak(&planes, &pixels, size, subsampling);
                println!(
                    "{name}, {subsampling:?}, {what}: {} pixels at the outline, off by {:.4} at most, {:.4} on average, \
                     {:.2} % marked; not marked, off by {:.4} at most; {} marked for nothing",
                    leak.count,
                    leak.worst,
                    leak.sum / leak.count as f64,
                    100.0 * leak.marked as f64 / leak.count as f64,
                    leak.worst_unmarked,
                    leak.marked_for_nothing
                );
                leak
            });
            let [joint, normals, plane, bilinear] = &leaks;
            assert!(joint.count > 200, "{name}: the outline is seen");
            assert_eq!(joint.worst_unmarked, 0.0, "{name}, {subsampling:?}");
            assert_eq!(joint.marked_for_nothing, 0, "{name}, {subsampling:?}");
            assert!(
                bilinear.sum > 0.1 * bilinear.count as f64,
                "{name}: without weights light leaks"
            );
            assert!(normals.worst_unmarked > 0.1, "{name}: normals alone do not suffice");
            if name != "before a wall" {
                assert!(plane.worst_unmarked > 0.1, "{name}: the plane alone does not suffice");
            }
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn sixteen_bit_irradiance_is_read_and_sizes_that_do_not_match_do_no_harm() {
    let Some(gpu) = gpu() else { return };
    let size = [61, 43];
    let picture = ball_and_wall(&gpu, size);
    let settings = UpsamplerSettings::default();
    for subsampling in FACTORS {
        let right = subsampling.size(size);
        for coarse_size in [right, [1, 1], [right[0] - 1, right[1] + 3], [100, 100]] {
            // One half in sixteen bits.
            let texels = [0x3800u16; 4].repeat((coarse_size[0] * coarse_size[1]) as usize);
            let format = wgpu::TextureFormat::Rgba16Float;
            let coarse = texture(&gpu, coarse_size, format, bytemuck::cast_slice(&texels));
            let coarse = Irradiance::from_view(&coarse).unwrap();
            for fine_size in [size, [7, 100]] {
                let into = (&picture.g_buffer, fine_size);
                let pixels = upsample_into(&gpu, into, (subsampling, &coarse), &settings);
                for (i, found) in (0..).zip(&pixels) {
                    let at = [i % fine_size[0], i / fine_size[0]];
                    let is_seen = at[0] < size[0] && at[1] < size[1] && picture.at(at).is_some();
                    // With every sample where it belongs all that is seen is lit; else it may also stay black.
                    let lit = found[..3] == [0.5; 3];
                    assert!(
                        lit == is_seen || (coarse_size != right && *found == [0.0; 4]),
                        "{at:?}: {found:?}"
                    );
                }
            }
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn samples_stand_where_the_documentation_says_on_both_sides() {
    let Some(gpu) = gpu() else { return };
    for subsampling in [Subsampling::Full].into_iter().chain(FACTORS) {
        let inputs: Vec<[u32; 4]> = (1..40).flat_map(|full| (0..5).map(move |i| [i, full, 0, 0])).collect();
        let factor = subsampling.factor();
        let body = format!(
            "let size = subsampling_size(vec2u(input.y), {factor}u);
            let pixel = subsampling_pixel(vec2u(input.x), {factor}u, vec2u(input.y));
            return vec4f(vec4u(size, pixel));"
        );
        for (input, found) in inputs.iter().zip(evaluate::run(&gpu, &body, &inputs)) {
            let full = [input[1]; 2];
            let (size, pixel) = (subsampling.size(full), subsampling.pixel([input[0]; 2], full));
            let wanted = [size[0], size[1], pixel[0], pixel[1]];
            assert_eq!(found.map(|v| v as u32), wanted, "{subsampling:?}, {input:?}");
            // Every block has a sample of its own, inside the image.
            let last = subsampling.pixel(size.map(|n| n - 1), full)[0];
            assert!(
                last < full[0] && last >= (size[0] - 1) * factor,
                "{subsampling:?}, {full:?}"
            );
        }
    }
    assert_no_errors(&gpu);
}

/// Irradiance at the samples from photons of one size of kernel, whose photons stand as hop 1 of as many paths.
fn splat(
    gpu: &Gpu,
    picture: &Picture,
    (shape, radius): (SplatShape, f32),
    subsampling: Subsampling,
    photons: &Photons,
) -> Vec<[f32; 4]> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let (_, _, target) = record_splat(gpu, picture, (shape, radius), subsampling, photons, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    read_rgba32float_blocking(&gpu.device, &gpu.queue, target.view().texture()).unwrap()
}

fn record_splat(
    gpu: &Gpu,
    picture: &Picture,
    (shape, radius): (SplatShape, f32),
    subsampling: Subsampling,
    photons: &Photons,
    encoder: &mut wgpu::CommandEncoder,
) -> (PhotonSplatter, PhotonSplatterResources, Irradiance) {
    let config = PhotonSplatterConfig {
        shape,
        ..Default::default()
    };
    let size = subsampling.size(picture.size);
    let pass = PhotonSplatter::new(&gpu.device, &config).unwrap();
    let mut resources = PhotonSplatterResources::new(&gpu.device, &config, photons, size).unwrap();
    let target = Irradiance::new(&gpu.device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
    let settings = PhotonSplatterSettings {
        bandwidth: Bandwidth::Fixed(radius),
        ..Default::default()
    };
    let inputs = PhotonSplatterInputs {
        queue: &gpu.queue,
        photons,
        g_buffer: &picture.g_buffer,
        subsampling,
        irradiance: &target,
        area: 1.0,
        radius: 1.0,
        sample_offset: 0,
        settings: &settings,
        timestamps: None,
    };
    pass.record(encoder, &mut resources, &inputs);
    (pass, resources, target)
}

/// A tilted plane with photons strewn over it.
fn strewn_plane(gpu: &Gpu, size: [u32; 2]) -> (Picture, Photons) {
    let seen = DVec3::new(0.0, -0.1, 0.0);
    let normal = DVec3::new(0.3, 0.8, 0.4).normalize();
    let view = view(DVec3::new(0.1, 0.5, 0.9), seen, perspective(30.0), size);
    let picture = picture(gpu, view, size, plane(seen, normal));
    // Some 130 unit-length focal pixels: a kernel of 0.04 at distance 0.7 to 1.4 spans up to 14 of the 23 pixels.
    let mut random = Random(17);
    let (u, v) = (
        normal.cross(DVec3::X).normalize(),
        normal.cross(normal.cross(DVec3::X)).normalize(),
    );
    let hits: Vec<Photon> = (0..4000)
        .map(|_| {
            let mut along = || f64::from(random.unit()) - 0.5;
            let position = seen + along() * u + along() * v;
            Photon {
                position: position.as_vec3().to_array(),
                state: 1,
                flux: [random.unit(), random.unit(), random.unit()],
                density: 1.0,
                normal: octahedral(normal),
                direction: 0,
                reflectance: 0,
                light_and_surface: 0,
            }
        })
        .collect();
    let photons = Photons::new(&gpu.device, hits.len() as u32, 1).unwrap();
    let offset = hits.len() as u64 * PHOTON_BYTES;
    gpu.queue
        .write_buffer(photons.buffer(), offset, bytemuck::cast_slice(&hits));
    (picture, photons)
}

/// The largest difference of a channel, over the largest channel of what is wanted.
fn worst_difference<'a>(pairs: impl Iterator<Item = (&'a [f32; 4], &'a [f32; 4])>, wanted: &[[f32; 4]]) -> f32 {
    let brightest = wanted.iter().flat_map(|t| &t[..3]).fold(0f32, |a, &b| a.max(b));
    assert!(brightest > 0.0);
    let differ = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).fold(0f32, |w, c| w.max((a[c] - b[c]).abs()));
    pairs.map(differ).fold(0f32, f32::max) / brightest
}

#[test]
fn a_subsampled_estimate_is_the_full_one_where_its_samples_stand() {
    let Some(gpu) = gpu() else { return };
    for size in [[133, 91], [97, 70]] {
        let (picture, photons) = strewn_plane(&gpu, size);
        // Down to kernels of a pixel or two of the coarsest samples.
        for (shape, radius) in [SplatShape::Tiled, SplatShape::Quads]
            .into_iter()
            .flat_map(|s| [0.04, 0.02, 0.01].map(|r| (s, r)))
        {
            let full = splat(&gpu, &picture, (shape, radius), Subsampling::Full, &photons);
            for subsampling in FACTORS {
                let coarse = splat(&gpu, &picture, (shape, radius), subsampling, &photons);
                let pairs = samples(subsampling, size).zip(&coarse).filter_map(|(sample, found)| {
                    let at = subsampling.pixel(sample, size);
                    let held_back = [0, 1]
                        .iter()
                        .any(|&a| at[a] != sample[a] * subsampling.factor() + subsampling.factor() / 2);
                    // Of quads a documented limit.
                    let is_compared = shape == SplatShape::Tiled || !held_back;
                    is_compared.then_some((found, &full[(at[1] * size[0] + at[0]) as usize]))
                });
                let worst = worst_difference(pairs, &full);
                println!("{shape:?}, {radius}, {size:?}, {subsampling:?}: off by {worst:.1e} of the brightest");
                // Tiles add in another order: some hundred kernels overlap. Quads add the same numbers in the same order.
                let tolerance = if shape == SplatShape::Tiled { 1e-6 } else { 0.0 };
                assert!(
                    worst <= tolerance,
                    "{shape:?}, {radius}, {size:?}, {subsampling:?}: {worst}"
                );
            }
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn what_is_estimated_anew_is_the_full_estimate() {
    let Some(gpu) = gpu() else { return };
    let size = [133, 91];
    let (picture, photons) = strewn_plane(&gpu, size);
    let full = splat(&gpu, &picture, (SplatShape::Tiled, 0.04), Subsampling::Full, &photons);
    for subsampling in FACTORS {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let (pass, mut resources, coarse) = record_splat(
            &gpu,
            &picture,
            (SplatShape::Tiled, 0.04),
            subsampling,
            &photons,
            &mut encoder,
        );
        let fine = Irradiance::new(&gpu.device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
        let marked = MarkedPixels::new(&gpu.device, size).unwrap();
        let settings = UpsamplerSettings {
            disagreement: 0.02,
            ..Default::default()
        };
        let inputs = UpsamplerInputs {
            queue: &gpu.queue,
            g_buffer: &picture.g_buffer,
            coarse: &coarse,
            subsampling,
            target: Subsampling::Full,
            irradiance: &fine,
            marked: Some(&marked),
            settings: &settings,
            timestamps: None,
        };
        let mut upsampler = UpsamplerResources::new(&gpu.device).unwrap();
        Upsampler::new(&gpu.device).record(&mut encoder, &mut upsampler, &inputs);
        let inputs = MarkedSplatInputs {
            queue: &gpu.queue,
            g_buffer: &picture.g_buffer,
            subsampling: Subsampling::Full,
            irradiance: &fine,
            marked: &marked,
            timestamps: None,
        };
        pass.record_marked(&mut encoder, &mut resources, &inputs);
        gpu.queue.submit([encoder.finish()]);
        let found = read_rgba32float_blocking(&gpu.device, &gpu.queue, fine.view().texture()).unwrap();
        let coarse = read_rgba32float_blocking(&gpu.device, &gpu.queue, coarse.view().texture()).unwrap();
        let interpolated = upsample(&gpu, &picture.g_buffer, subsampling, &coarse);
        let list = marked.read_blocking(&gpu.device, &gpu.queue).unwrap();
        let index = |[x, y]: &[u32; 2]| (y * size[0] + x) as usize;
        let worst = worst_difference(list.iter().map(|p| (&found[index(p)], &full[index(p)])), &full);
        println!(
            "{subsampling:?}: {} of {} marked, off by {worst:.1e}",
            list.len(),
            full.len()
        );
        assert!(
            list.len() > 1000 && list.len() < full.len() - 100,
            "{subsampling:?}: {}",
            list.len()
        );
        // Another order of additions, and a normal that is not rounded to sixteen bits.
        assert!(worst < 1e-4, "{subsampling:?}: {worst}");
        let mut is_marked = vec![false; full.len()];
        for pixel in &list {
            is_marked[index(pixel)] = true;
        }
        for (i, &is_marked) in is_marked.iter().enumerate() {
            assert!(is_marked || found[i] == interpolated[i], "{subsampling:?}, {i}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn pixels_are_marked_between_samples_that_disagree() {
    let Some(gpu) = gpu() else { return };
    let size = [61, 43];
    let picture = ball_and_wall(&gpu, size);
    for subsampling in FACTORS {
        let texels = noise((subsampling.size(size)[0] * subsampling.size(size)[1]) as usize, 5);
        let coarse = irradiance(&gpu, subsampling.size(size), &texels);
        let target = subsampling.finer().unwrap();
        let target_size = target.size(size);
        for disagreement in [0.1f32, 0.5, 1.5] {
            let fine = Irradiance::new(&gpu.device, target_size, wgpu::TextureFormat::Rgba32Float).unwrap();
            let marked = MarkedPixels::new(&gpu.device, target_size).unwrap();
            let settings = UpsamplerSettings {
                disagreement,
                ..Default::default()
            };
            let inputs = UpsamplerInputs {
                queue: &gpu.queue,
                g_buffer: &picture.g_buffer,
                coarse: &coarse,
                subsampling,
                target,
                irradiance: &fine,
                marked: Some(&marked),
                settings: &settings,
                timestamps: None,
            };
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut upsampler = UpsamplerResources::new(&gpu.device).unwrap();
            let pass = Upsampler::new(&gpu.device);
            // Twice: the list begins anew.
            pass.record(&mut encoder, &mut upsampler, &inputs);
            pass.record(&mut encoder, &mut upsampler, &inputs);
            gpu.queue.submit([encoder.finish()]);
            let list = marked.read_blocking(&gpu.device, &gpu.queue).unwrap();
            let mut undecided = 0;
            let mut wanted = Vec::new();
            for sample in samples(target, size) {
                let pixel = target.pixel(sample, size);
                match (picture.at(pixel), twin(&picture, subsampling, &texels, pixel).doubt) {
                    (None, _) => {}
                    (_, doubt) if (doubt - f64::from(disagreement)).abs() < 1e-3 => undecided += 1,
                    (_, doubt) if doubt > f64::from(disagreement) => wanted.push(sample),
                    _ => assert!(!list.contains(&sample), "{subsampling:?}, {disagreement}, {sample:?}"),
                }
            }
            println!(
                "{subsampling:?}, {disagreement}: {} wanted, {} marked",
                wanted.len(),
                list.len()
            );
            assert!(
                wanted.iter().all(|sample| list.contains(sample)),
                "{subsampling:?}, {disagreement}"
            );
            assert!(list.len() <= wanted.len() + undecided && undecided < 10);
        }
    }
    assert_no_errors(&gpu);
}

/// Two signed 16-bit numbers, as `pack2x16snorm` packs them.
fn octahedral(n: DVec3) -> u32 {
    let p = n / (n.x.abs() + n.y.abs() + n.z.abs());
    assert!(p.z >= 0.0, "the upper half is enough here");
    let snorm = |v: f64| u32::from(((v * 32767.0).round() as i16).cast_unsigned());
    snorm(p.x) | (snorm(p.y) << 16)
}
