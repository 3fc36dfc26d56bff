//! Numbers of surfaces, from the scene to photons, the G-buffer, and what is interpolated along them.
#![cfg(feature = "bvh")]

mod common;

#[allow(dead_code, reason = "the study uses all of it")]
#[path = "../examples/trace_study/bench.rs"]
mod bench;
#[allow(dead_code, reason = "the study uses all of it")]
#[path = "../examples/trace_study/judge.rs"]
mod judge;

use bench::Bench;
use common::{Component, Gpu, Offline, assert_no_errors, gpu};
use lightfall::frame::{Settings, TracerKind};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::pass::*;
use lightfall::resource::*;
use lightfall::scene::{Camera, Instance, Light, Material, Mesh, Projection, Scene, samples};
use lightfall::{read_buffer_blocking, read_rgba32float_blocking, wgpu};

/// That of the plane at distance 1 from the eye: further off than points near the eye, whose differences have no digits.
const DEPTH: f32 = 1.0 / 16_777_216.0;

/// A Cornell box whose instances are numbered from 1, each of a reflectance and an emission of its own.
fn numbered_box() -> Scene {
    let mut scene = samples::cornell(0.0);
    scene.materials.clear();
    for (number, instance) in (1u16..).zip(&mut scene.instances) {
        instance.surface = number;
        instance.material = scene.materials.len();
        scene.materials.push(Material {
            emission: [f32::from(number); 3],
            ..Material::diffuse("", reflectance(number))
        });
    }
    scene
}

fn reflectance(number: u16) -> [f32; 3] {
    [0.1 * f32::from(number), 0.5, 0.5]
}

/// Numbers of the surfaces that pixels see; the width a multiple of 64.
fn seen(gpu: &Gpu, g_buffer: &GBuffer) -> Vec<u32> {
    let texture = g_buffer.views().surfaces.as_ref().unwrap().texture();
    let row = 4 * texture.width();
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * texture.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let target = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout: wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        },
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    gpu.queue.submit([encoder.finish()]);
    read_buffer_blocking(&gpu.device, &gpu.queue, &buffer).unwrap()
}

#[test]
fn photons_and_pixels_know_the_number_of_what_they_meet_whatever_traces_them() {
    let Some(gpu) = gpu() else { return };
    let scene = numbered_box();
    for tracer_kind in [TracerKind::ImageSpace, TracerKind::Bvh, TracerKind::Hybrid] {
        let settings = Settings {
            photons: 5000,
            tracer_kind,
            ..Settings::fast()
        };
        let mut offline = Offline::new(&gpu, scene.clone(), &settings, 0, [64, 48], Component::All).unwrap();
        offline.render_frame(None).unwrap();
        let photons = offline.renderer.photons().unwrap();
        let records: Vec<Photon> = read_buffer_blocking(&gpu.device, &gpu.queue, photons.buffer()).unwrap();
        let (mut met, mut from_bulb) = ([0; 32], 0);
        for photon in records.iter().filter(|p| p.state() == PhotonState::Stored) {
            let number = photon.surface();
            // Eleven bits hold the reflectance.
            assert!(
                (photon.reflectance()[0] - reflectance(number)[0]).abs() < 1e-3,
                "{number}: {photon:?}"
            );
            // The bulb, or one of the surfaces, which shine too.
            assert!(photon.light() as usize <= scene.instances.len() * 6, "{photon:?}");
            from_bulb += usize::from(photon.light() == 0);
            met[usize::from(number)] += 1;
        }
        println!(
            "{tracer_kind:?}: {:?} photons by number",
            &met[..=scene.instances.len()]
        );
        assert!(from_bulb > 0 && from_bulb < records.len());
        assert!(met[0] == 0 && met[1..=scene.instances.len()].iter().all(|&n| n > 10));
        let g_buffer = offline.view.g_buffer();
        let emission = g_buffer.views().emission.texture();
        let emission = read_rgba32float_blocking(&gpu.device, &gpu.queue, emission).unwrap();
        // Emission is in units of the frame, and of fronts alone.
        let pairs = emission.iter().zip(seen(&gpu, g_buffer));
        let units: Vec<f32> = pairs
            .filter(|(e, _)| e[0] > 0.0)
            .map(|(e, n)| e[0] / n as f32)
            .collect();
        assert!(units.len() > emission.len() / 2);
        assert!(units.iter().all(|u| (u / units[0] - 1.0).abs() < 1e-5));
    }
    assert_no_errors(&gpu);
}

/// Two squares side by side in the plane z = 0, of these numbers, that fill the view of a camera over it.
fn two_squares(surfaces: [u16; 2]) -> Scene {
    let mut scene = Scene {
        materials: vec![Material::diffuse("", [0.5; 3])],
        lights: vec![Light::point(DVec3::Z, 1.0, [1.0; 3])],
        ..Scene::default()
    };
    for (from, surface) in [-2.0f32, 0.0].into_iter().zip(surfaces) {
        let corner = |x: f32, y: f32| [from + 2.0 * x, 4.0 * y - 2.0, 0.0];
        scene.instances.push(Instance {
            surface,
            ..Instance::new(scene.meshes.len(), 0)
        });
        scene.meshes.push(Mesh {
            positions: vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        });
    }
    scene
}

#[test]
fn irradiance_is_neither_interpolated_nor_evened_out_across_numbers() {
    let Some(gpu) = gpu() else { return };
    let size = [64, 48];
    let Gpu { device, queue, .. } = &gpu;
    // The smallest and the largest difference from 0 and 1, what the squares have.
    let mixed = |surfaces: [u16; 2]| {
        let mut bench = Bench::new(&gpu, two_squares(surfaces)).unwrap();
        let camera = Camera {
            name: String::new(),
            transform: DAffine3::from_translation(DVec3::new(0.1, 0.0, 1.0)),
            projection: Projection::Perspective { fov_y: 1.0 },
        };
        let mut view = CameraView::new(&bench.frame, &camera, size, [0.0; 2]);
        let mut views = [view.capture];
        bench.prepare(&mut views).unwrap();
        view.capture = views[0];
        let mut g_buffer = GBuffer::new(device, size).unwrap();
        let mut encoder = device.create_command_encoder(&Default::default());
        let inputs = GBufferCaptureInputs {
            queue,
            geometry: &bench.geometry,
            view: &view,
            timestamps: None,
        };
        GBufferCapture::new().record(&mut encoder, &mut g_buffer, &inputs);
        queue.submit([encoder.finish()]);
        let is_right = |x: u32| {
            let inverse = lightfall::glam::Mat4::from_cols_array_2d(&view.inverse_view_projection);
            let ndc = 2.0 * (x as f32 + 0.5) / size[0] as f32 - 1.0;
            let eye = lightfall::glam::Vec3::from_slice(&view.capture.eye[..3]);
            let toward = inverse.project_point3(lightfall::glam::Vec3::new(ndc, 0.0, DEPTH)) - eye;
            let boundary = bench.frame.point(DVec3::ZERO).x;
            (eye - toward * (eye.z - bench.frame.point(DVec3::ZERO).z) / toward.z).x > boundary
        };
        let subsampling = Subsampling::Quarter;
        let coarse_size = subsampling.size(size);
        let texels: Vec<[f32; 4]> = (0..coarse_size[0] * coarse_size[1])
            .map(|i| {
                let x = (4 * (i % coarse_size[0]) + 2).min(size[0] - 1);
                [f32::from(u8::from(is_right(x))), 0.0, 0.0, 1.0]
            })
            .collect();
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: coarse_size[0],
                height: coarse_size[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(16 * coarse_size[0]),
            rows_per_image: None,
        };
        queue.write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(&texels),
            layout,
            texture.size(),
        );
        let coarse = Irradiance::from_view(&texture.create_view(&Default::default())).unwrap();
        let made = |size| Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
        let (filtered, upsampled) = (made(coarse_size), made(size));
        let mut encoder = device.create_command_encoder(&Default::default());
        let settings = UpsamplerSettings::default();
        let filter_inputs = IrradianceFilterInputs {
            queue,
            g_buffer: &g_buffer,
            subsampling,
            estimate: &coarse,
            plus: None,
            irradiance: &filtered,
            settings: &IrradianceFilterSettings {
                radius: 2,
                normal_agreement: settings.normal_agreement,
                plane_distance: settings.plane_distance,
            },
            timestamps: None,
        };
        let mut filter_own = IrradianceFilterResources::new(device).unwrap();
        IrradianceFilter::new(device).record(&mut encoder, &mut filter_own, &filter_inputs);
        let upsampler_inputs = UpsamplerInputs {
            queue,
            g_buffer: &g_buffer,
            coarse: &coarse,
            subsampling,
            target: Subsampling::Full,
            irradiance: &upsampled,
            marked: None,
            settings: &settings,
            timestamps: None,
        };
        let mut upsampler_own = UpsamplerResources::new(device).unwrap();
        Upsampler::new(device).record(&mut encoder, &mut upsampler_own, &upsampler_inputs);
        queue.submit([encoder.finish()]);
        [&filtered, &upsampled].map(|irradiance| {
            let pixels = read_rgba32float_blocking(device, queue, irradiance.view().texture()).unwrap();
            let off = pixels.iter().map(|p| p[0].min(1.0 - p[0]).abs());
            off.fold(0f32, f32::max)
        })
    };
    let (apart, together, unnumbered) = (mixed([1, 2]), mixed([7, 7]), mixed([0, 9]));
    println!(
        "filtered and interpolated: {apart:?} apart, {together:?} on one surface, {unnumbered:?} if one has no number"
    );
    assert_eq!(apart, [0.0; 2]);
    assert!(together.iter().chain(&unnumbered).all(|&m| m > 0.1));
    assert_no_errors(&gpu);
}
