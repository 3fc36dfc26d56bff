//! A foreign engine with lightfall plugged in: what `examples/plug_one_stage.rs` shows is what these tests prove. The
//! engine's irradiance is that of `GiRenderer`, its environment maps are those of `MeshGeometry`, its own photons light
//! a room as arithmetic says, and none of it asks more of a device than core WebGPU.

#![allow(
    clippy::duplicate_mod,
    reason = "the example brings the modules that tests share with examples as well"
)]

mod common;
#[allow(dead_code, reason = "the example has a main function")]
#[path = "../examples/plug_one_stage.rs"]
mod plug_one_stage;

use common::{Gpu, assert_no_errors, gpu};
use lightfall::frame::{GiRenderer, SceneInputs, Settings, Upsampling, ViewInputs};
use lightfall::glam::{DVec3, Mat4, Vec3};
use lightfall::pass::{
    Bandwidth, BoundaryCorrection, Composite, CompositeInputs, CompositeResources, CompositeSettings, EnvMapCapture,
    EnvMapCaptureInputs, EnvMapCaptureResources, PhotonSplatter, PhotonSplatterInputs, PhotonSplatterResources,
    PhotonSplatterSettings,
};
use lightfall::resource::{
    CapturePurpose, CaptureTargets, CaptureView, EnvMaps, Environment, GBuffer, GBufferViews, Geometry, Irradiance,
    MeshGeometry, Photons, PrepareContext, Radiance, Subsampling,
};
use lightfall::scene::{Instance, Light, Material, Mesh, Scene, SceneSummary};
use lightfall::{read_buffer_blocking, read_rgba32float_blocking, wgpu};
use plug_one_stage::foreign_host::world::World;
use plug_one_stage::foreign_host::{Engine, Formats, begin_pass};
use plug_one_stage::{IndirectLight, Walk, camera_view, photon_buffer, photon_records};

/// A multiple of 64 wide, so that rows of four-byte texels can be copied to buffers as they are.
const SIZE: [u32; 2] = [128, 96];
const PATHS: u32 = 10_000;
const BOUNCES: u32 = 2;

/// Packed as engines have it, but with a target that can be read back.
const PACKED: Formats = Formats {
    hdr: Formats::WIDE.hdr,
    ..Formats::PACKED
};

fn engine(gpu: &Gpu, world: World, formats: Formats, size: [u32; 2], largest: [u32; 2]) -> Engine {
    Engine::new((&gpu.device, &gpu.queue), world, formats, size, largest)
}

/// The engine with lightfall plugged in, lit by photons of its own.
fn with_own_photons(engine: &Engine, paths: u32, bounces: u32) -> IndirectLight {
    with_own_photons_at(engine, Subsampling::Full, paths, bounces)
}

fn with_own_photons_at(engine: &Engine, subsampling: Subsampling, paths: u32, bounces: u32) -> IndirectLight {
    let buffer = photon_buffer(&engine.device, paths, bounces);
    let photons = Photons::from_buffer(&buffer, paths, bounces).unwrap();
    let indirect = IndirectLight::new(engine, photons, subsampling).unwrap();
    trace(engine, &indirect);
    indirect
}

/// Fills the photons with paths through the engine's world as it is now.
fn trace(engine: &Engine, indirect: &IndirectLight) {
    let (paths, bounces) = (indirect.photons.count(), indirect.photons.bounces());
    let landings = engine.world.trace_paths(paths, bounces, 7);
    let records = photon_records(&indirect.frame, &landings, paths);
    let bytes = bytemuck::cast_slice(&records);
    engine.queue.write_buffer(indirect.photons.buffer(), 0, bytes);
}

/// A frame of the engine: its own pass, lightfall's, its own again, in one encoder.
fn draw(engine: &Engine, indirect: &mut IndirectLight, direct_weight: f32) {
    draw_with(engine, indirect, None, direct_weight);
}

fn draw_with(engine: &Engine, indirect: &mut IndirectLight, walk: Option<&mut Walk>, direct_weight: f32) {
    engine.upload(indirect.frame.output_scale(1.0).unwrap(), direct_weight);
    let mut encoder = engine.device.create_command_encoder(&Default::default());
    engine.record_g_buffer(&mut encoder);
    if let Some(walk) = walk {
        walk.record(&mut encoder, engine, &indirect.photons).unwrap();
    }
    indirect.record(&mut encoder, engine);
    engine.record_lighting(&mut encoder, indirect.irradiance.view());
    engine.queue.submit([encoder.finish()]);
}

fn read(engine: &Engine, view: &wgpu::TextureView) -> Vec<[f32; 4]> {
    read_rgba32float_blocking(&engine.device, &engine.queue, view.texture()).unwrap()
}

/// All texels of a texture of whole 256-byte rows, layer after layer.
fn read_texels<T: bytemuck::Pod>(engine: &Engine, texture: &wgpu::Texture) -> Vec<T> {
    let row = texture.width() * size_of::<T>() as u32;
    assert_eq!(row % wgpu::COPY_BYTES_PER_ROW_ALIGNMENT, 0);
    let rows = texture.height() * texture.depth_or_array_layers();
    let buffer = engine.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read"),
        size: u64::from(row) * u64::from(rows),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = engine.device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(row),
        rows_per_image: Some(texture.height()),
    };
    let target = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout,
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    engine.queue.submit([encoder.finish()]);
    read_buffer_blocking(&engine.device, &engine.queue, &buffer).unwrap()
}

/// The engine's world as lightfall describes scenes: a mesh for each of its quads, in the engine's order.
fn scene_of(world: &World) -> Scene {
    let mut scene = Scene::default();
    for object in &world.objects {
        for (quad, vertices) in (0..).zip(object.vertices.chunks_exact(4)) {
            let color = [0, 1, 2].map(|c| f32::from(vertices[0].color[c]) / 255.0 * object.tint[c]);
            scene.materials.push(Material::diffuse("", color));
            scene.meshes.push(Mesh {
                positions: vertices.iter().map(|v| v.position).collect(),
                normals: vertices
                    .iter()
                    .map(|v| [0, 1, 2].map(|c| f32::from(v.normal[c]) / 127.0))
                    .collect(),
                indices: object
                    .indices
                    .iter()
                    .filter(|&&i| i / 4 == quad)
                    .map(|i| u32::from(i % 4))
                    .collect(),
                ..Mesh::default()
            });
            scene.instances.push(Instance {
                transform: object.transform,
                ..Instance::new(scene.meshes.len() - 1, scene.materials.len() - 1)
            });
        }
    }
    // Intensity times colour, both f32: here exactly the engine's.
    let color = world.lamp.intensity.as_vec3().to_array();
    scene.lights.push(Light::point(world.lamp.position, 1.0, color));
    scene
}

/// What `GiRenderer` makes of the engine's world, seen by the engine's camera.
struct Composed {
    renderer: GiRenderer,
    /// Two f16 a texel.
    normals: Vec<[u16; 2]>,
    indirect: Vec<[f32; 4]>,
    radiance: Vec<[f32; 4]>,
}

fn composed(engine: &Engine, subsampling: Subsampling) -> Composed {
    let (device, queue, scene) = (&engine.device, &engine.queue, scene_of(&engine.world));
    let settings = Settings {
        photons: PATHS,
        bounces: BOUNCES,
        env_map_count: 4,
        env_map_size: 64,
        shadow_map_size: 128,
        subsampling,
        splatter: splatting(),
        upsampling: Upsampling::AtOnce,
        ..Settings::balanced()
    };
    let mut geometry = MeshGeometry::new(device, queue, &scene).unwrap();
    let mut renderer = GiRenderer::new(device, &settings).unwrap();
    let summary = SceneSummary::of(&scene).unwrap();
    let frame = renderer.set_scene(queue, &summary, &scene.lights).unwrap();
    let mut view = renderer.new_view(engine.size).unwrap();
    let mut cameras = [camera_view(engine, &frame)];
    renderer.prepare(queue, &mut geometry, &mut cameras).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let (geometry, timestamps) = (&geometry, None);
    let scene_inputs = SceneInputs {
        queue,
        geometry,
        bvh: None,
        sample_offset: 0,
        timestamps,
    };
    renderer.record_scene(&mut encoder, &scene_inputs).unwrap();
    let composite = CompositeSettings {
        output_scale: frame.output_scale(1.0).unwrap(),
        direct: 0.0,
        ..Default::default()
    };
    let inputs = ViewInputs {
        queue,
        geometry,
        bvh: None,
        view: &cameras[0],
        accumulated: 0,
        composite: &composite,
        timestamps,
    };
    renderer.record_view(&mut encoder, &mut view, &inputs).unwrap();
    queue.submit([encoder.finish()]);
    Composed {
        normals: read_texels(engine, view.g_buffer().views().normal.texture()),
        indirect: read(engine, view.indirect().unwrap().view()),
        radiance: read(engine, view.radiance().view()),
        renderer,
    }
}

/// Lights the engine by the photons of the renderer.
fn fed_by(engine: &Engine, composed: &Composed) -> IndirectLight {
    let theirs = composed.renderer.photons().unwrap();
    let photons = Photons::from_buffer(theirs.buffer(), theirs.count(), theirs.bounces()).unwrap();
    let mut indirect = IndirectLight::new(engine, photons, composed.renderer.settings().subsampling).unwrap();
    let frame = composed.renderer.frame().unwrap();
    assert!(indirect.frame.maps_like(frame), "both normalise the same region");
    indirect.settings = splatting();
    draw(engine, &mut indirect, 0.0);
    indirect
}

/// Sums as they are: what is made up for at edges hangs on shading normals in more ways than can be foreseen here.
fn splatting() -> PhotonSplatterSettings {
    PhotonSplatterSettings {
        // Narrow: on a sphere a slab holds a narrow disc of photons wholly.
        bandwidth: Bandwidth::Density {
            photons: 150.0,
            clamp: [0.25, 1.0],
        },
        boundary: BoundaryCorrection::Off,
        ..Default::default()
    }
}

/// Twin of `SPLAT_NORMAL_AGREEMENT`.
const AGREEMENT: f64 = 0.7;

/// Pixels at which shading normals that are off by `error` may decide otherwise than exact ones. A shading normal
/// reaches the estimate by one comparison only: whether it agrees with the normal that depth gives (cosine above
/// `AGREEMENT`), in whichever pair of neighbours that is taken from. An error e of a unit vector moves a cosine by no
/// more than e.
fn undecided(engine: &Engine, indirect: &IndirectLight, error: f64) -> Vec<bool> {
    let [width, height] = engine.size.map(|s| s as i32);
    let full_width = engine.targets.depth.texture().width() as i32;
    let depth: Vec<f32> = read_texels(engine, engine.targets.depth.texture());
    let inverse = Mat4::from_cols_array_2d(&camera_view(engine, &indirect.frame).inverse_view_projection).as_dmat4();
    let at = |x: i32, y: i32| {
        let (x, y) = (x.clamp(0, width - 1), y.clamp(0, height - 1));
        let ndc = |i: i32, size: i32| 2.0 * (f64::from(i) + 0.5) / f64::from(size) - 1.0;
        let z = f64::from(depth[(y * full_width + x) as usize]);
        inverse.project_point3(DVec3::new(ndc(x, width), -ndc(y, height), z))
    };
    let normals = face_normals(&engine.world);
    let pixel = |i: i32| {
        let (x, y) = (i % width, i / width);
        let p = at(x, y);
        let along = [p - at(x - 1, y), at(x + 1, y) - p];
        let down = [p - at(x, y - 1), at(x, y + 1) - p];
        let pairs = along.into_iter().flat_map(|a| down.map(|d| a.cross(d)));
        pairs.filter(|n| n.length_squared() > 0.0).any(|n| {
            // Whichever face the pixel shows; a superset that needs no decoding.
            normals
                .iter()
                .any(|face| (n.normalize().dot(*face).abs() - AGREEMENT).abs() < error)
        })
    };
    (0..width * height).map(pixel).collect()
}

fn face_normals(world: &World) -> Vec<DVec3> {
    let faces = world.objects.iter().flat_map(|object| {
        let quads = object.vertices.chunks_exact(4);
        quads.map(|v| {
            let [a, b, c] = [v[0], v[1], v[2]].map(|v| DVec3::from(v.position.map(f64::from)));
            object.transform.transform_vector3((b - a).cross(c - a)).normalize()
        })
    });
    faces.collect()
}

#[test]
fn an_engine_fed_the_renderers_photons_has_the_renderers_irradiance() {
    let Some(gpu) = gpu() else { return };
    for subsampling in [Subsampling::Full, Subsampling::Half, Subsampling::Eighth] {
        let engine = engine(&gpu, World::room(), Formats::WIDE, SIZE, SIZE);
        let composed = composed(&engine, subsampling);
        let indirect = fed_by(&engine, &composed);
        let normals: Vec<[u16; 2]> = read_texels(&engine, engine.targets.normal.texture());
        assert!(normals == composed.normals);
        let found = read(&engine, indirect.irradiance.view());
        assert!(found.iter().filter(|p| p[0] > 0.0).count() > found.len() / 2);
        assert!(found == composed.indirect, "{subsampling:?}");
    }
    assert_no_errors(&gpu);
}

/// Largest error of a normal × 0.5 + 0.5 in ten bits beside an octahedral one in `rg16float`: of the former conversion may miss
/// 0.6 of a step of 2/1023, in three components; of the latter half a step of 2^-11 in two coordinates, which move the point
/// of the octahedron by at most 2.5 times that, and the octahedron comes no nearer to the origin than 1/√3. Twice that for
/// normalising them again.
const NORMAL_ERROR: f64 = 2.0 * 1.7321 * (1.2 / 1023.0 + 2.5 / 4096.0);

#[test]
fn ten_bits_of_normal_in_a_part_of_larger_textures_change_no_bit_of_irradiance() {
    let Some(gpu) = gpu() else { return };
    let engine = engine(&gpu, World::room(), PACKED, SIZE, [192, 120]);
    let composed = composed(&engine, Subsampling::Full);
    let indirect = fed_by(&engine, &composed);
    let found = read(&engine, indirect.irradiance.view());
    assert!(found.iter().filter(|p| p[0] > 0.0).count() > found.len() / 2);

    // Where depth does not help, the shading normal is compared with photons' normals (16-bit octahedral, 1e-4). No two
    // faces come near that threshold.
    let normals = face_normals(&engine.world);
    for cosine in normals.iter().flat_map(|a| normals.iter().map(|b| a.dot(*b))) {
        assert!((cosine - AGREEMENT).abs() > NORMAL_ERROR + 2e-4, "{cosine}");
    }
    let undecided = undecided(&engine, &indirect, NORMAL_ERROR);
    let left_out = undecided.iter().filter(|u| **u).count();
    let pairs = found.iter().zip(&composed.indirect).zip(&undecided);
    let unequal = pairs.filter(|((a, b), undecided)| !**undecided && a != b).count();
    println!(
        "{left_out} of {} pixels undecided, {unequal} others unequal",
        found.len()
    );
    assert_eq!(unequal, 0);
    assert!(left_out * 50 < found.len(), "{left_out}: too many to say much");
    assert_no_errors(&gpu);
}

#[test]
fn a_picture_that_the_engine_composes_is_the_renderers() {
    let Some(gpu) = gpu() else { return };
    for subsampling in [Subsampling::Full, Subsampling::Half] {
        let engine = engine(&gpu, World::room(), Formats::WIDE, SIZE, SIZE);
        let composed = composed(&engine, subsampling);
        fed_by(&engine, &composed);
        let picture = read(&engine, &engine.targets.hdr);
        assert!(picture.iter().filter(|p| p[0] > 0.0).count() > picture.len() / 2);
        assert!(picture == composed.radiance, "{subsampling:?}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn an_engine_without_emission_gives_one_black_texel_and_the_composite_adds_nothing() {
    let Some(gpu) = gpu() else { return };
    let engine = engine(&gpu, World::room(), Formats::WIDE, SIZE, SIZE);
    let mut indirect = with_own_photons(&engine, PATHS, BOUNCES);
    draw(&engine, &mut indirect, 0.0);
    let (device, queue) = (&engine.device, &engine.queue);
    let black = Irradiance::new(device, SIZE, wgpu::TextureFormat::Rgba32Float).unwrap();
    let radiance = Radiance::new(device, SIZE).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let inputs = CompositeInputs {
        queue,
        g_buffer: &indirect.g_buffer,
        direct: &black,
        indirect: &indirect.irradiance,
        caustic: None,
        specular: None,
        environment: &Environment::black(device).unwrap(),
        radiance: &radiance,
        settings: &CompositeSettings {
            output_scale: indirect.frame.output_scale(1.0).unwrap(),
            ..Default::default()
        },
        timestamps: None,
    };
    let mut resources = CompositeResources::new(device).unwrap();
    Composite::new(device, wgpu::TextureFormat::Rgba32Float).record(&mut encoder, &mut resources, &inputs);
    queue.submit([encoder.finish()]);
    let picture = read(&engine, radiance.view());
    assert!(picture.iter().filter(|p| p[0] > 0.0).count() > picture.len() / 2);
    assert!(picture == read(&engine, &engine.targets.hdr));
    assert_no_errors(&gpu);
}

#[test]
fn eight_bits_of_base_colour_change_a_picture_by_no_more_than_their_rounding() {
    let Some(gpu) = gpu() else { return };
    // Steps of 1/255 by which a colour may be off. Linear: writing may miss 0.6 of one. sRGB: besides, reading may be
    // off by 0.5 of one on the encoded side, and the curve turns a step into its slope (Direct3D 11.3 specification,
    // 3.2.3).
    let linear = |_: f64| 0.6;
    let srgb = |reflectance: f64| {
        let encoded = 1.055 * reflectance.powf(1.0 / 2.4) - 0.055 + 1.1 / 255.0;
        1.1 * (2.4 / 1.055 * ((encoded + 0.055) / 1.055).powf(1.4)).max(1.0 / 12.92)
    };
    let formats = |base_color| Formats { base_color, ..PACKED };
    base_color_rounds(&gpu, formats(wgpu::TextureFormat::Rgba8Unorm), linear);
    base_color_rounds(&gpu, formats(wgpu::TextureFormat::Rgba8UnormSrgb), srgb);
    assert_no_errors(&gpu);
}

/// The engine's picture is the renderer's to within this many steps of 1/255 of reflectance.
fn base_color_rounds(gpu: &Gpu, formats: Formats, steps: impl Fn(f64) -> f64) {
    let engine = engine(gpu, World::room(), formats, SIZE, SIZE);
    let composed = composed(&engine, Subsampling::Full);
    let indirect = fed_by(&engine, &composed);
    let (irradiance, picture) = (
        read(&engine, indirect.irradiance.view()),
        read(&engine, &engine.targets.hdr),
    );
    let scale = f64::from(indirect.frame.output_scale(1.0).unwrap());
    let (mut worst, mut compared) = (0f64, 0);
    for i in (0..picture.len()).filter(|&i| irradiance[i] == composed.indirect[i]) {
        for c in 0..3 {
            let (found, wanted) = (f64::from(picture[i][c]), f64::from(composed.radiance[i][c]));
            let e = f64::from(irradiance[i][c]) * scale / std::f64::consts::PI;
            if e == 0.0 {
                assert_eq!(found, wanted);
                continue;
            }
            // The renderer's own colours are rounded to eleven bits; products round by a few f32 steps.
            let reflectance = wanted / e;
            let rounding = reflectance / 2048.0 + reflectance * 4.0 * f64::from(f32::EPSILON);
            worst = worst.max((found - wanted).abs() / e / (steps(reflectance) / 255.0 + rounding));
            compared += 1;
        }
    }
    println!(
        "{:?}: {compared} values, worst error {worst:.2} of the bound",
        formats.base_color
    );
    assert!(worst <= 1.0 && worst > 0.0, "{worst}");
    assert!(compared > picture.len());
}

#[test]
fn a_part_anywhere_in_larger_textures_is_lit_as_if_it_were_alone() {
    let Some(gpu) = gpu() else { return };
    let engine = engine(&gpu, World::room(), Formats::WIDE, SIZE, SIZE);
    let mut indirect = with_own_photons(&engine, PATHS, BOUNCES);
    draw(&engine, &mut indirect, 1.0);

    // The engine's G-buffer moved by (17, 5) into larger textures of garbage; its depth as r32float.
    let (at, largest) = ([17, 5], [192, 128]);
    let (device, queue) = (&engine.device, &engine.queue);
    let moved = |source: &wgpu::TextureView, format: wgpu::TextureFormat, texel_bytes: u32| {
        let source = source.texture();
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("moved"),
            size: wgpu::Extent3d {
                width: largest[0],
                height: largest[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let row = |width| wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(width * texel_bytes),
            rows_per_image: None,
        };
        let garbage = vec![0x3a; (largest[0] * largest[1] * texel_bytes) as usize];
        queue.write_texture(texture.as_image_copy(), &garbage, row(largest[0]), texture.size());
        let texels: Vec<u8> = match texel_bytes {
            4 => bytemuck::cast_vec::<[u8; 4], u8>(read_texels(&engine, source)),
            _ => bytemuck::cast_vec::<[u8; 8], u8>(read_texels(&engine, source)),
        };
        let target = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d {
                x: at[0],
                y: at[1],
                z: 0,
            },
            ..texture.as_image_copy()
        };
        queue.write_texture(target, &texels, row(SIZE[0]), source.size());
        texture.create_view(&Default::default())
    };
    let targets = &engine.targets;
    let views = GBufferViews {
        depth: moved(&targets.depth, wgpu::TextureFormat::R32Float, 4),
        normal: moved(&targets.normal, engine.formats.normal, 4),
        normal_encoding: engine.formats.normals().into(),
        base_color: moved(&targets.base_color, engine.formats.base_color, 8),
        emission: moved(&targets.base_color, engine.formats.base_color, 8),
        surfaces: None,
        rectangle: Some([at[0], at[1], SIZE[0], SIZE[1]]),
    };
    let mut g_buffer = GBuffer::from_views(device, views).unwrap();
    g_buffer.set_view(queue, &camera_view(&engine, &indirect.frame));
    let config = Default::default();
    let irradiance = Irradiance::new(device, SIZE, wgpu::TextureFormat::Rgba32Float).unwrap();
    let pass = PhotonSplatter::new(device, &config).unwrap();
    let mut resources = PhotonSplatterResources::new(device, &config, &indirect.photons, SIZE).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let inputs = PhotonSplatterInputs {
        queue,
        photons: &indirect.photons,
        g_buffer: &g_buffer,
        subsampling: Subsampling::Full,
        irradiance: &irradiance,
        area: indirect.frame.area(engine.world.area()),
        radius: indirect.frame.radius(),
        sample_offset: 0,
        settings: &PhotonSplatterSettings::default(),
        timestamps: None,
    };
    pass.record(&mut encoder, &mut resources, &inputs);
    queue.submit([encoder.finish()]);
    let (moved, alone) = (
        read(&engine, irradiance.view()),
        read(&engine, indirect.irradiance.view()),
    );
    assert!(alone.iter().filter(|p| p[0] > 0.0).count() > alone.len() / 2);
    assert!(moved == alone);
    assert_no_errors(&gpu);
}

#[test]
fn wherever_the_engines_origin_is_the_view_handed_over_is_its_own() {
    let Some(gpu) = gpu() else { return };
    let mut engine = engine(&gpu, World::room(), Formats::WIDE, SIZE, SIZE);
    let indirect = with_own_photons(&engine, 64, 1);
    for shift in [DVec3::ZERO, DVec3::new(3.0, -7.5, 11.3), DVec3::new(-64.0, 0.1, 0.7)] {
        engine.origin += shift;
        let view = camera_view(&engine, &indirect.frame);
        let matrices = [view.capture.view_projection, view.inverse_view_projection];
        let [clip_from_unit, unit_from_clip] = matrices.map(|m| Mat4::from_cols_array_2d(&m).as_dmat4());
        for landing in engine.world.trace_paths(100, 0, 3).into_iter().flatten() {
            let by_engine = engine.clip_from_render().as_dmat4() * (landing.position - engine.origin).extend(1.0);
            let unit = indirect.frame.point(landing.position).as_dvec3();
            let by_lightfall = clip_from_unit * unit.extend(1.0);
            // Numbers of an f32 matrix times positions about the engine's origin: eight roundings of 2^-24 of the
            // largest.
            let size = (landing.position - engine.origin).abs().max_element() + engine.eye().abs().max_element() as f64;
            let bound = 8.0 * 2f64.powi(-24) * 4.0 * size;
            assert!(
                (by_engine - by_lightfall).length() < bound,
                "{by_engine} {by_lightfall}"
            );
            let back = unit_from_clip.project_point3(by_lightfall.truncate() / by_lightfall.w);
            // The distance of the wall is lost to depth's rounding and to the inverse's: relative to the way from the
            // eye.
            let reach = (landing.position - engine.world.eye.position).length() + size;
            let bound = 16.0 * 2f64.powi(-24) * 4.0 * reach / indirect.frame.length_scale();
            assert!((back - unit).length() < bound, "{back} {unit} {bound}");
        }
    }
    assert_no_errors(&gpu);
}

/// Environment maps around these places, filled by a geometry: by `EnvMapCapture`.
fn captured(engine: &Engine, geometry: &mut dyn Geometry, indirect: &IndirectLight, centers: &[Vec3]) -> EnvMaps {
    let (device, queue) = (&engine.device, &engine.queue);
    let mut env_maps = EnvMaps::new(device, centers.len() as u32, Walk::MAP_SIZE).unwrap();
    env_maps.set_centers(queue, centers).unwrap();
    let views = numbered(&env_maps);
    let context = PrepareContext {
        device,
        queue,
        frame: &indirect.frame,
    };
    geometry.prepare(&context, &views).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let inputs = EnvMapCaptureInputs {
        env_maps: &env_maps,
        geometry,
        views: &views,
        layers: None,
        timestamps: None,
    };
    let mut resources = EnvMapCaptureResources::new(device, Walk::MAP_SIZE).unwrap();
    EnvMapCapture::new().record(&mut encoder, &mut resources, &inputs);
    queue.submit([encoder.finish()]);
    env_maps
}

fn numbered(env_maps: &EnvMaps) -> Vec<CaptureView> {
    let mut views: Vec<_> = env_maps.views(CapturePurpose::EnvMap).collect();
    for (index, view) in (0..).zip(&mut views) {
        view.index = index;
    }
    views
}

#[test]
fn environment_maps_that_the_engine_draws_are_those_of_the_ready_made_geometry() {
    let Some(gpu) = gpu() else { return };
    let mut engine = engine(&gpu, World::room(), Formats::PACKED, SIZE, SIZE);
    let mut indirect = with_own_photons(&engine, 64, 1);
    let mut walk = Walk::new(&engine, &indirect).unwrap();
    // Also from within the box and from behind a wall, where backs are seen.
    let mut centers = walk.env_maps.centers().to_vec();
    centers[0] = indirect.frame.point(engine.world.objects[1].transform.translation);
    centers[1] = Vec3::new(-1.2, 0.1, 0.2);
    walk.env_maps.set_centers(&engine.queue, &centers).unwrap();
    // By the example's way, through the engine's `Geometry`.
    walk.prepare(&mut engine, &indirect.frame).unwrap();
    draw_with(&engine, &mut indirect, Some(&mut walk), 1.0);
    let drawn: Vec<[u32; 4]> = read_texels(&engine, walk.env_maps.view().texture());

    let scene = scene_of(&engine.world);
    let mut meshes = MeshGeometry::new(&engine.device, &engine.queue, &scene).unwrap();
    let ready_made = captured(&engine, &mut meshes, &indirect, &centers);
    let wanted: Vec<[u32; 4]> = read_texels(&engine, ready_made.view().texture());
    let seen = wanted.iter().filter(|t| t[0] != 0).count();
    let unequal = drawn.iter().zip(&wanted).filter(|(a, b)| a != b).count();
    let backs = wanted.iter().filter(|t| t[3] & 256 != 0).count();
    println!(
        "{seen} texels see a surface, {backs} its back; {unequal} of {} unequal",
        wanted.len()
    );
    assert!(seen > wanted.len() / 2 && backs > wanted.len() / 10);
    assert_eq!(unequal, 0);

    // Or by passes of the engine's own, into the faces themselves.
    let by_hand = EnvMaps::new(&engine.device, walk.env_maps.centers().len() as u32, Walk::MAP_SIZE).unwrap();
    let depth = engine.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("engine"),
        size: wgpu::Extent3d {
            width: Walk::MAP_SIZE,
            height: Walk::MAP_SIZE,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: CaptureTargets::of(CapturePurpose::EnvMap).depth,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let depth = depth.create_view(&Default::default());
    let mut encoder = engine.device.create_command_encoder(&Default::default());
    for (layer, view) in (0..).zip(numbered(&walk.env_maps)) {
        let face = by_hand.face_view(layer).unwrap();
        engine.draw(&mut begin_pass(&mut encoder, &[face], Some(&depth)), &view);
    }
    engine.queue.submit([encoder.finish()]);
    assert!(drawn == read_texels::<[u32; 4]>(&engine, by_hand.view().texture()));
    assert_no_errors(&gpu);
}

/// Light that the sphere's walls receive from one another, over up to `BOUNCES` bounces.
const SPHERE_PATHS: u32 = 20_000;

#[test]
fn in_a_closed_sphere_indirect_irradiance_is_what_the_walls_send_back() {
    let Some(gpu) = gpu() else { return };
    let size = [64, 64];
    let formats = Formats {
        normal: wgpu::TextureFormat::Rgba32Float,
        ..Formats::WIDE
    };
    let mut engine = engine(&gpu, World::sphere(), formats, size, size);
    let mut indirect = with_own_photons(&engine, SPHERE_PATHS, BOUNCES);
    indirect.settings = splatting();
    let landings = engine.world.trace_paths(SPHERE_PATHS, BOUNCES, 7);
    assert!(landings.iter().all(Option::is_some), "nothing leaves");
    let reflected: Vec<_> = landings[SPHERE_PATHS as usize..].iter().flatten().collect();

    // A sphere's walls see each other all alike: whatever the first surface sends back arrives evenly, ρ Φ / A, and of
    // that ρ² Φ / A, and so on.
    let (world, reflectance) = (&engine.world, 128.0 / 255.0);
    let series: f64 = (1..=BOUNCES as i32).map(|b| f64::powi(reflectance, b)).sum();
    let expected = world.flux() * series / world.area();
    let brought: DVec3 = reflected.iter().map(|l| l.flux).sum();
    assert!(((brought / world.area() - expected) / expected).abs().max_element() < 1e-9);

    let eye = world.eye.position;
    let irradiance_scale = indirect.frame.radiance_scale();
    let mut received = DVec3::ZERO;
    for (direction, up) in [
        (DVec3::X, DVec3::Y),
        (DVec3::NEG_X, DVec3::Y),
        (DVec3::Y, DVec3::Z),
        (DVec3::NEG_Y, DVec3::Z),
        (DVec3::Z, DVec3::Y),
        (DVec3::NEG_Z, DVec3::Y),
    ] {
        (engine.world.eye.direction, engine.world.eye.up) = (direction, up);
        draw(&engine, &mut indirect, 0.0);
        let pixels = read(&engine, indirect.irradiance.view());
        let normals = read(&engine, &engine.targets.normal);
        let depth: Vec<f32> = read_texels(&engine, engine.targets.depth.texture());
        let mut mean = DVec3::ZERO;
        let inverse = engine.clip_from_render().as_dmat4().inverse();
        for (i, pixel) in (0..).zip(&pixels) {
            let e = DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into()) * irradiance_scale;
            mean += e / pixels.len() as f64;
            let ndc = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(size[0]) - 1.0;
            let at = DVec3::new(ndc(i % size[0]), -ndc(i / size[0]), depth[i as usize].into());
            let ray = inverse.project_point3(at) - (eye - engine.origin);
            // A pixel's solid angle is 4 cos³ / n², and a surface in it measures d² / cos of that.
            let solid_angle = 4.0 / pixels.len() as f64 * ray.normalize().dot(direction).powi(3);
            let normal = Vec3::from_slice(&normals[i as usize][..3]).as_dvec3();
            received += e * (solid_angle * ray.length_squared() / -normal.dot(ray.normalize()));
        }
        // Photons land independently, and each weighs in the mean as pixels lie dense where it lands, which is as cos³.
        let in_view = |l: &DVec3| (*l - eye).normalize().dot(direction).powi(3);
        let sees = |l: &DVec3| {
            let v = *l - eye;
            v.dot(direction) >= v.abs().max_element() * (1.0 - 1e-9)
        };
        let weights = reflected
            .iter()
            .filter(|l| sees(&l.position))
            .map(|l| l.flux.x * in_view(&l.position));
        let (sum, squares) = weights.fold((0.0, 0.0), |(s, q), w| (s + w, q + w * w));
        let five_sigma = 5.0 * squares.sqrt() / sum;
        let error = ((mean - expected) / expected).abs().max_element();
        println!("towards {direction}: error {error:.4}, five sigma {five_sigma:.4}");
        assert!(error < five_sigma, "{mean} instead of {expected}");
    }
    // A kernel's discs integrate to one on a plane, and on a sphere as well: the cap within a chord c has area π c²
    // (Archimedes). Facets stand between the two; they fall short of the sphere's area by this share.
    let shortfall = 1.0 - engine.world.area() / (4.0 * std::f64::consts::PI * 4.0);
    let error = ((received - brought) / brought).abs().max_element();
    println!("brought {brought:.4} W, received {received:.4} W: error {error:.5}, facets' {shortfall:.5}");
    assert!(error < shortfall);
    assert_no_errors(&gpu);
}

#[test]
fn light_straight_from_the_lamp_is_left_to_the_engine() {
    let Some(gpu) = gpu() else { return };
    let engine = engine(&gpu, World::room(), Formats::WIDE, SIZE, SIZE);
    let mut indirect = with_own_photons(&engine, 1000, 1);
    let bytes = vec![0; (indirect.photons.buffer().size() / 2) as usize];
    let hop_1 = bytes.len() as u64;
    engine.queue.write_buffer(indirect.photons.buffer(), hop_1, &bytes);
    draw(&engine, &mut indirect, 1.0);
    let irradiance = read(&engine, indirect.irradiance.view());
    assert!(irradiance.iter().all(|p| p[..3] == [0.0; 3]));
    assert!(read(&engine, &engine.targets.hdr).iter().any(|p| p[0] > 0.0));
    assert_no_errors(&gpu);
}

#[test]
fn an_object_that_moves_changes_the_light_and_one_that_stays_does_not() {
    let Some(gpu) = gpu() else { return };
    let mut engine = engine(&gpu, World::room(), PACKED, SIZE, SIZE);
    let mut indirect = with_own_photons(&engine, PATHS, BOUNCES);
    let mut walk = Walk::new(&engine, &indirect).unwrap();
    for by_walk in [false, true] {
        let mut frame = |seconds: f64| {
            engine.world.set_time(seconds);
            trace(&engine, &indirect);
            let walk = if by_walk {
                walk.prepare(&mut engine, &indirect.frame).unwrap();
                Some(&mut walk)
            } else {
                None
            };
            draw_with(&engine, &mut indirect, walk, 1.0);
            (
                read(&engine, indirect.irradiance.view()),
                read(&engine, &engine.targets.hdr),
            )
        };
        let (first, again, moved) = (frame(0.0), frame(0.0), frame(0.5));
        assert!(first == again, "by walk: {by_walk}");
        // The wall behind the box and far from it: still the same surface, yet under other light.
        let far_left = |frame: &[[f32; 4]]| (30..40).map(|y| frame[y * SIZE[0] as usize + 40]).collect::<Vec<_>>();
        assert_ne!(far_left(&first.0), far_left(&moved.0), "by walk: {by_walk}");
        assert_ne!(first.1, moved.1);
        assert!(frame(0.0) == first, "back where it was, by walk: {by_walk}");
    }
    assert_no_errors(&gpu);
}

/// Two frames with everything plugged in, lightfall's passes between the engine's, all in one encoder.
fn record_everything(device: &wgpu::Device, queue: &wgpu::Queue) {
    assert_eq!(device.features(), wgpu::Features::empty());
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    for (formats, subsampling) in [
        (Formats::PACKED, Subsampling::Full),
        (Formats::PACKED, Subsampling::Quarter),
        (Formats::WIDE, Subsampling::Half),
    ] {
        let mut engine = Engine::new((device, queue), World::room(), formats, [33, 17], [64, 20]);
        let mut indirect = with_own_photons_at(&engine, subsampling, 100, BOUNCES);
        let mut walk = Walk::new(&engine, &indirect).unwrap();
        for seconds in [0.0, 0.5] {
            engine.world.set_time(seconds);
            engine.upload(indirect.frame.output_scale(1.0).unwrap(), 1.0);
            walk.prepare(&mut engine, &indirect.frame).unwrap();
            let mut encoder = device.create_command_encoder(&Default::default());
            engine.record_g_buffer(&mut encoder);
            walk.record(&mut encoder, &engine, &indirect.photons).unwrap();
            engine.record_g_buffer(&mut encoder);
            indirect.record(&mut encoder, &engine);
            engine.record_lighting(&mut encoder, indirect.irradiance.view());
            queue.submit([encoder.finish()]);
        }
    }
    let error = pollster::block_on(scope.pop());
    assert!(error.is_none(), "{error:?}");
}

#[test]
fn it_all_runs_on_a_device_that_grants_only_the_defaults() {
    let (device, queue) = wgpu::Device::noop(&wgpu::DeviceDescriptor::default());
    record_everything(&device, &queue);
    let Some(gpu) = gpu() else { return };
    record_everything(&gpu.device, &gpu.queue);
    assert_no_errors(&gpu);
}
