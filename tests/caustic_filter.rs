//! Statements about caustics as points on the screen that a filter evens out.

mod common;

use common::rooms::bulb;
use common::statistics::Random;
use common::{Component, Gpu, Offline, assert_no_errors, gpu, offline};
use lightfall::frame::Settings;
use lightfall::glam::{DAffine3, DMat3, DVec3};
use lightfall::pass::*;
use lightfall::resource::*;
use lightfall::scene::{Camera, Light, Projection, Scene, SceneBounds, UnitFrame, samples};
use lightfall::{Error, read_buffer_blocking, read_rgba32float_blocking, wgpu};

const SIZE: [u32; 2] = [96, 64];

/// A frame that is the world, or nearly.
fn frame() -> UnitFrame {
    UnitFrame::new(&SceneBounds::new(DVec3::splat(-0.57), DVec3::splat(0.57)).unwrap(), 1.0).unwrap()
}

/// An eye that looks at the origin of the floor y = 0, from so far and at so many degrees from the normal.
fn eye(distance: f64, oblique: f64) -> CameraView {
    let (sin, cos) = oblique.to_radians().sin_cos();
    let back = DVec3::new(0.0, cos, sin);
    let up = DVec3::new(0.0, sin, -cos);
    let camera = Camera {
        name: String::new(),
        transform: DAffine3 {
            matrix3: DMat3::from_cols(DVec3::X, up, back),
            translation: distance * back,
        },
        projection: Projection::Perspective { fov_y: 0.7 },
    };
    CameraView::new(&frame(), &camera, SIZE, [0.0; 2])
}

/// What such an eye sees of the floor: depths from its matrix.
fn floor(gpu: &Gpu, view: &CameraView, surfaces: Option<&dyn Fn(f32) -> u16>) -> GBuffer {
    let [width, height] = SIZE;
    let m = view.capture.view_projection;
    let row = |i: usize| [m[0][i], m[1][i], m[2][i], m[3][i]].map(f64::from);
    let rows = [0, 1, 2, 3].map(row);
    let mut depth = Vec::new();
    let mut numbers = Vec::new();
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let ndc = [
            2.0 * (f64::from(x) + 0.5) / f64::from(width) - 1.0,
            1.0 - 2.0 * (f64::from(y) + 0.5) / f64::from(height),
        ];
        // Where on the floor: two linear equations for x and z at y = 0.
        let a = [0, 2].map(|c| rows[0][c] - ndc[0] * rows[3][c]);
        let b = [0, 2].map(|c| rows[1][c] - ndc[1] * rows[3][c]);
        let right = [rows[0][3] - ndc[0] * rows[3][3], rows[1][3] - ndc[1] * rows[3][3]].map(|v| -v);
        let determinant = a[0] * b[1] - a[1] * b[0];
        let p = [
            (right[0] * b[1] - a[1] * right[1]) / determinant,
            (a[0] * right[1] - right[0] * b[0]) / determinant,
        ];
        let at = |r: &[f64; 4]| r[0] * p[0] + r[2] * p[1] + r[3];
        depth.push((at(&rows[2]) / at(&rows[3])) as f32);
        numbers.push(surfaces.map_or(0, |s| s(p[0] as f32)));
    }
    let texture = |format, texels: &[u8]| {
        let size = wgpu::Extent3d {
            width,
            height,
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
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(texels.len() as u32 / height),
            rows_per_image: None,
        };
        gpu.queue.write_texture(texture.as_image_copy(), texels, layout, size);
        texture.create_view(&Default::default())
    };
    use wgpu::TextureFormat as F;
    let all = |texel: [u8; 4]| texel.repeat((width * height) as usize);
    let normals: Vec<u8> = bytemuck::cast_slice(&[0.0f32, 1.0, 0.0, 0.0]).repeat((width * height) as usize);
    let views = GBufferViews {
        depth: texture(F::R32Float, bytemuck::cast_slice(&depth)),
        normal: texture(F::Rgba32Float, &normals),
        normal_encoding: NormalEncoding::Signed,
        base_color: texture(F::Rgba8Unorm, &all([255; 4])),
        emission: texture(F::Rgba8Unorm, &all([0; 4])),
        surfaces: surfaces.map(|_| texture(F::R16Uint, bytemuck::cast_slice(&numbers))),
        rectangle: None,
    };
    let mut g_buffer = GBuffer::from_views(&gpu.device, views).unwrap();
    g_buffer.set_view(&gpu.queue, view);
    g_buffer
}

/// A photon of this flux on the floor.
fn photon(x: f32, z: f32, flux: f32) -> Photon {
    Photon {
        position: [x, 0.0, z],
        state: 1,
        flux: [flux; 3],
        density: 1.0,
        normal: Photon::pack_unit_vector(lightfall::glam::Vec3::Y),
        direction: 0,
        reflectance: 0,
        light_and_surface: 0,
    }
}

/// Photons as hop 1.
fn upload(gpu: &Gpu, all: &[Photon]) -> Photons {
    let photons = Photons::new(&gpu.device, all.len() as u32, 1).unwrap();
    let offset = PHOTON_BYTES * all.len() as u64;
    gpu.queue
        .write_buffer(photons.buffer(), offset, bytemuck::cast_slice(all));
    photons
}

struct Filtered {
    pixels: Vec<[f32; 4]>,
    tiles: usize,
}

fn filter(gpu: &Gpu, g_buffer: &GBuffer, photons: &[&Photons], settings: &CausticFilterSettings) -> Filtered {
    let Gpu { device, queue, .. } = gpu;
    let pass = CausticFilter::new(device);
    let mut own = CausticFilterResources::new(device, SIZE).unwrap();
    let irradiance = Irradiance::new(device, SIZE, wgpu::TextureFormat::Rgba32Float).unwrap();
    let inputs = CausticFilterInputs {
        queue,
        photons,
        g_buffer,
        irradiance: &irradiance,
        radius: 1.0,
        settings,
        timestamps: None,
    };
    let mut encoder = device.create_command_encoder(&Default::default());
    pass.record(&mut encoder, &mut own, &inputs).unwrap();
    queue.submit([encoder.finish()]);
    let words: Vec<u32> = read_buffer_blocking(device, queue, own.tiles()).unwrap();
    Filtered {
        pixels: read_rgba32float_blocking(device, queue, irradiance.view().texture()).unwrap(),
        tiles: words[3] as usize,
    }
}

/// One watt a square metre on a square of this side, by as many photons a side.
fn square(side: f32, count: u32) -> Vec<Photon> {
    let mut random = Random(5);
    let step = side / count as f32;
    let cells = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
    let mut at = |i: u32| step * (i as f32 + random.unit()) - 0.5 * side;
    cells.map(|(i, j)| photon(at(i), at(j), step * step)).collect()
}

#[test]
fn caustics_are_as_bright_from_anywhere() {
    let Some(gpu) = gpu() else { return };
    let settings = CausticFilterSettings {
        radius: 0.01,
        ..Default::default()
    };
    for (distance, oblique) in [
        (0.3, 0.0),
        (0.6, 0.0),
        (1.2, 0.0),
        (0.4, 45.0),
        (0.4, 60.0),
        (0.4, 75.0),
        (1.2, 75.0),
    ] {
        let view = eye(distance, oblique);
        // As many pixels wide from anywhere.
        let side = 0.5 * distance;
        let photons = upload(&gpu, &square(side as f32, 500));
        let found = filter(&gpu, &floor(&gpu, &view, None), &[&photons], &settings);
        // Pixels well within the square: those whose middle is near the picture's.
        let reach = (0.25 * side / distance / 0.7 * f64::from(SIZE[1])) as i32;
        let rows = (f64::from(reach) * oblique.to_radians().cos()) as i32;
        let mut values = Vec::new();
        for (dy, dx) in (-rows..=rows).flat_map(|y| (-reach..=reach).map(move |x| (y, x))) {
            let (x, y) = (SIZE[0] as i32 / 2 + dx, SIZE[1] as i32 / 2 + dy);
            values.push(f64::from(found.pixels[(y * SIZE[0] as i32 + x) as usize][0]));
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        println!(
            "distance {distance}, {oblique} degrees: {mean:.4} over {} pixels",
            values.len()
        );
        assert!((mean - 1.0).abs() < 0.05, "{distance}, {oblique}: {mean}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn flux_is_kept_and_only_tiles_around_photons_are_filtered() {
    let Some(gpu) = gpu() else { return };
    let view = eye(0.6, 0.0);
    let g_buffer = floor(&gpu, &view, None);
    let few: Vec<Photon> = [(0.0, 0.0), (0.05, 0.03)].map(|(x, z)| photon(x, z, 0.5)).to_vec();
    let settings = CausticFilterSettings {
        radius: 0.02,
        pixels: [1, 7],
    };
    let found = filter(&gpu, &g_buffer, &[&upload(&gpu, &few)], &settings);
    // Side of a pixel on the floor.
    let pixel = 2.0 * 0.6 * (0.35f64).tan() / f64::from(SIZE[1]);
    let flux: f64 = found.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() * pixel * pixel;
    println!("flux {flux:.4}, {} tiles of {}", found.tiles, 12 * 8);
    assert!((flux - 1.0).abs() < 0.02, "{flux}");
    assert!((2..=12).contains(&found.tiles));
    assert!(found.pixels.iter().filter(|p| p[3] == 0.0).count() > 60 * 64);
    // In two parts each holds all of it.
    let photons = upload(&gpu, &few);
    let twice = filter(&gpu, &g_buffer, &[&photons, &photons], &settings);
    assert!(twice.pixels == found.pixels);
    // And none: nothing.
    let none = filter(&gpu, &g_buffer, &[], &settings);
    assert!(none.tiles == 0 && none.pixels.iter().all(|p| *p == [0.0; 4]));
    assert_no_errors(&gpu);
}

#[test]
fn light_stays_on_its_surface() {
    let Some(gpu) = gpu() else { return };
    let view = eye(0.6, 0.0);
    // Light on the left half alone.
    let all: Vec<Photon> = square(0.4, 400).into_iter().filter(|p| p.position[0] < 0.0).collect();
    let photons = upload(&gpu, &all);
    let settings = CausticFilterSettings {
        radius: 0.03,
        pixels: [1, 7],
    };
    let halves = |x: f32| if x < 0.0 { 1 } else { 2 };
    let apart = filter(&gpu, &floor(&gpu, &view, Some(&halves)), &[&photons], &settings);
    let joined = filter(&gpu, &floor(&gpu, &view, None), &[&photons], &settings);
    let at = |f: &Filtered, x: u32| f.pixels[(SIZE[1] / 2 * SIZE[0] + x) as usize][0];
    println!(
        "apart {} {}, joined {} {}",
        at(&apart, 47),
        at(&apart, 48),
        at(&joined, 47),
        at(&joined, 48)
    );
    assert!((at(&apart, 46) - 1.0).abs() < 0.1 && at(&apart, 49) == 0.0);
    assert!(at(&joined, 46) < 0.8 && at(&joined, 49) > 0.2);
    assert_no_errors(&gpu);
}

#[test]
fn splatted_or_filtered_caustics_are_as_bright() {
    let Some(gpu) = gpu() else { return };
    let mean = |method: &str| {
        let mut settings = Settings {
            photons: 10_000,
            ..Settings::fast()
        };
        settings.caustic.photons = 100_000;
        settings.set("caustic.method", method).unwrap();
        #[cfg(feature = "bvh")]
        settings.set("tracer.kind", "bvh").unwrap();
        let image = offline::render(
            &gpu,
            &samples::glass_sphere(0.0),
            &settings,
            [96, 96],
            Component::Caustic,
        )
        .unwrap();
        image.iter().flatten().map(|&v| f64::from(v)).sum::<f64>() / (3 * image.len()) as f64
    };
    let (splatted, filtered) = (mean("splatting"), mean("filter"));
    println!("{splatted:.5} splatted, {filtered:.5} filtered");
    assert!((filtered / splatted - 1.0).abs() < 0.05);
    assert_no_errors(&gpu);
}

/// Caustics of the glass ball, in so many rounds.
fn in_rounds<'a>(gpu: &'a Gpu, scene: &Scene, rounds: u32, overrides: &[(&str, &str)]) -> Offline<'a> {
    let mut settings = Settings {
        photons: 10_000,
        env_map_size: 32,
        ..Settings::fast()
    };
    settings.caustic.photons = 20_000;
    settings.caustic.rounds = rounds;
    for (key, value) in overrides {
        settings.set(key, value).unwrap();
    }
    let mut offline = Offline::new(gpu, scene.clone(), &settings, 0, [64, 64], Component::Caustic).unwrap();
    if offline.renderer.env_maps().is_some() {
        // Maps that find better places have all traced anew.
        let centers = [DVec3::new(0.0, 2.0, 0.0), DVec3::new(1.0, 0.5, 1.0)];
        offline.renderer.set_env_map_centers(&gpu.queue, &centers).unwrap();
    }
    offline
}

/// So many frames on.
fn after(offline: &mut Offline<'_>, frames: u32) -> Vec<[f32; 3]> {
    for _ in 0..frames {
        offline.render_frame(None).unwrap();
    }
    offline.read().unwrap()
}

/// Either tracer with either way to the pixels.
fn ways() -> Vec<[(&'static str, &'static str); 2]> {
    let tracers: &[_] = if cfg!(feature = "bvh") {
        &["image-space", "bvh"]
    } else {
        &["image-space"]
    };
    let methods = ["splatting", "filter"];
    let all = tracers
        .iter()
        .flat_map(|&t| methods.map(|m| [("tracer.kind", t), ("caustic.method", m)]));
    all.collect()
}

#[test]
fn in_rounds_a_picture_is_what_it_is_without_from_the_first_frame_on() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::glass_sphere(0.0);
    for way in ways() {
        let [mut all, mut parts] = [1, 8].map(|rounds| in_rounds(&gpu, &scene, rounds, &way));
        let picture = after(&mut all, 1);
        assert!(picture.iter().any(|p| p[0] > 0.0));
        assert!(after(&mut parts, 1) == picture, "{way:?}: first frame");
        for frames in [1, 7] {
            assert!(
                after(&mut all, frames) == picture && after(&mut parts, frames) == picture,
                "{way:?}"
            );
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn in_rounds_light_follows_within_as_many_frames_and_a_part_of_it_in_each() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::glass_sphere(0.0);
    let mut moved = scene.clone();
    bulb(&mut moved, 0).x += 0.4;
    let paths = |offline: &Offline<'_>| {
        let photons = offline.renderer.caustic_photons().unwrap();
        let mut all: Vec<Photon> = read_buffer_blocking(&gpu.device, &gpu.queue, photons.buffer()).unwrap();
        all.truncate(photons.count() as usize);
        all
    };
    let others = |a: &[Photon], b: &[Photon]| a.iter().zip(b).filter(|(a, b)| a != b).count() as f64;
    for way in ways() {
        let mut fresh = in_rounds(&gpu, &moved, 1, &way);
        let new = after(&mut fresh, 1);
        let mut offline = in_rounds(&gpu, &scene, 8, &way);
        let old = after(&mut offline, 3);
        let before = paths(&offline);
        let all = others(&before, &paths(&fresh));
        offline.set_scene(moved.clone()).unwrap();
        for frame in 1..=8 {
            let picture = after(&mut offline, 1);
            let share = others(&before, &paths(&offline)) / all;
            assert!(
                (share - f64::from(frame) / 8.0).abs() < 0.02,
                "{way:?}, frame {frame}: {share}"
            );
            assert_eq!(picture == new, frame == 8, "{way:?}: frame {frame}");
            if frame == 4 {
                // Halfway from one picture to the other, everywhere.
                let sum = |of: &dyn Fn(usize) -> f32| (0..new.len()).map(|i| f64::from(of(i))).sum::<f64>();
                let change = sum(&|i| (new[i][0] - old[i][0]).abs());
                let off = sum(&|i| (picture[i][0] - 0.5 * (new[i][0] + old[i][0])).abs()) / change;
                println!("{way:?}: halfway but for {off:.4} of the change");
                assert!(off < 0.1);
            }
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn rounds_start_anew_with_another_number_of_lights_and_other_photons() {
    let Some(gpu) = gpu() else { return };
    let mut scene = samples::glass_sphere(0.0);
    let mut offline = in_rounds(&gpu, &scene, 8, &[]);
    after(&mut offline, 2);
    scene
        .lights
        .push(Light::point(DVec3::new(1.0, 3.0, 1.0), 20.0, [1.0, 0.5, 0.2]));
    offline.set_scene(scene.clone()).unwrap();
    assert!(after(&mut offline, 1) == after(&mut in_rounds(&gpu, &scene, 1, &[]), 1));
    // Each accumulated frame has its own.
    let [all, parts] = [1, 8].map(|rounds| after(&mut in_rounds(&gpu, &scene, rounds, &[("frames", "3")]), 3));
    assert!(all == parts);
    assert_no_errors(&gpu);
}

#[test]
fn too_little_room_and_uneven_parts_are_named() {
    let Some(gpu) = gpu() else { return };
    let view = eye(0.6, 0.0);
    let g_buffer = floor(&gpu, &view, None);
    let (a, b) = (upload(&gpu, &square(0.1, 3)), upload(&gpu, &square(0.1, 4)));
    let pass = CausticFilter::new(&gpu.device);
    let irradiance = Irradiance::new(&gpu.device, SIZE, wgpu::TextureFormat::Rgba32Float).unwrap();
    for (photons, size) in [(vec![&a, &b], SIZE), (vec![&a], [SIZE[0] - 1, SIZE[1]])] {
        let mut own = CausticFilterResources::new(&gpu.device, size).unwrap();
        let inputs = CausticFilterInputs {
            queue: &gpu.queue,
            photons: &photons,
            g_buffer: &g_buffer,
            irradiance: &irradiance,
            radius: 1.0,
            settings: &CausticFilterSettings::default(),
            timestamps: None,
        };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let error = pass.record(&mut encoder, &mut own, &inputs).unwrap_err();
        assert!(matches!(error, Error::CountMismatch { .. }), "{error}");
    }
    assert_no_errors(&gpu);
}
