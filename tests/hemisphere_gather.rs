//! Statements about light at texels that the host's draws gather.

mod common;

use common::rooms::{block_at, bulb, move_block, with_blocks as rooms};
use common::{Component, Gpu, Offline, assert_no_errors, gpu};
use lightfall::frame::{IndirectMethod, Settings};
use lightfall::glam::{DVec3, Vec3};
use lightfall::pass::{HemisphereGather, HemisphereGatherInputs, HemisphereGatherResources};
use lightfall::resource::{
    GatherShape, Geometry, HemispherePlace, Hemispheres, IlluminationMap, MeshGeometry, PrepareContext, SurfaceLights,
};
use lightfall::scene::{Instance, Material, Mesh, Scene, SceneBounds, SurfacePlace, UnitFrame};
use lightfall::{Error, creation_count, read_buffer_blocking};
use std::f64::consts::PI;

const SHAPES: [GatherShape; 2] = [GatherShape::Cube, GatherShape::Plane { half_side: 2.0 }];

/// A unit frame that is the world.
fn unit_frame() -> UnitFrame {
    UnitFrame::new(&SceneBounds::new(DVec3::splat(-0.57), DVec3::splat(0.57)).unwrap(), 1.0).unwrap()
}

/// A scene of one mesh of quadrilaterals, each counter-clockwise from its front.
fn scene_of(quads: &[[[f32; 3]; 4]]) -> Scene {
    let mut mesh = Mesh::default();
    for quad in quads {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(quad);
        mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    }
    Scene {
        meshes: vec![mesh],
        materials: vec![Material::diffuse("white", [0.7; 3])],
        instances: vec![Instance::new(0, 0)],
        ..Scene::default()
    }
}

/// What one hemisphere gathers where all texels but those on the floor send out one unit of light: a light stands in the
/// middle of each quadrilateral.
fn gather(gpu: &Gpu, quads: &[[[f32; 3]; 4]], (shape, size): (GatherShape, u32), at: Vec3) -> [f32; 4] {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let frame = unit_frame();
    let places: Vec<_> = quads
        .iter()
        .map(|quad| {
            let [a, b, c, _] = quad.map(|p| Vec3::from(p).as_dvec3());
            SurfacePlace {
                position: 0.5 * (a + c),
                normal: (b - a).cross(c - a).normalize(),
                areas: [(b - a).cross(c - b).length(); 2],
                surface: 0,
            }
        })
        .collect();
    let mut lights = SurfaceLights::new(device, places.len() as u32, 1).unwrap();
    lights.write(queue, &frame, &places).unwrap();
    let map = IlluminationMap::new(device, &lights, 1).unwrap();
    // Two to a place, on either side; the first quadrilateral is the floor.
    let radiosity: Vec<[f32; 4]> = (0..2 * places.len())
        .map(|i| if i < 2 { [0.0; 4] } else { [1.0, 2.0, 4.0, 1.0] })
        .collect();
    queue.write_buffer(map.radiosity(), 0, bytemuck::cast_slice(&radiosity));
    let mut hemispheres = Hemispheres::new(device, queue, (shape, size), 3).unwrap();
    let place = HemispherePlace {
        position: at,
        normal: Vec3::Y,
        texel: 1,
    };
    // The last of three tiles.
    hemispheres
        .set(queue, &[place, place, HemispherePlace { texel: 2, ..place }])
        .unwrap();
    let mut geometry = MeshGeometry::new(device, queue, &scene_of(quads)).unwrap();
    let mut views = hemispheres.views();
    (0..).zip(&mut views).for_each(|(i, v)| v.index = i);
    let context = PrepareContext {
        device,
        queue,
        frame: &frame,
    };
    geometry.prepare(&context, &views).unwrap();
    let pass = HemisphereGather::new(device);
    let mut resources = HemisphereGatherResources::new(device).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut inputs = HemisphereGatherInputs {
        queue,
        hemispheres: &hemispheres,
        geometry: &geometry,
        views: &views,
        lights: &lights,
        map: &map,
        timestamps: None,
    };
    pass.record(&mut encoder, &mut resources, &inputs).unwrap();
    // Views of another number are named.
    inputs.views = &views[1..];
    let error = pass.record(&mut encoder, &mut resources, &inputs).unwrap_err();
    assert!(matches!(error, Error::CountMismatch { .. }), "{error}");
    queue.submit([encoder.finish()]);
    let gathered: Vec<[f32; 4]> = read_buffer_blocking(device, queue, map.gathered()).unwrap();
    assert_eq!(gathered[1], gathered[2], "tiles are alike");
    gathered[2]
}

/// Faces of a box, seen from inside, the floor first.
fn closed_box(low: [f32; 3], high: [f32; 3]) -> [[[f32; 3]; 4]; 6] {
    let ([x0, y0, z0], [x1, y1, z1]) = (low, high);
    [
        [[x0, y0, z0], [x0, y0, z1], [x1, y0, z1], [x1, y0, z0]],
        [[x0, y1, z0], [x1, y1, z0], [x1, y1, z1], [x0, y1, z1]],
        [[x0, y0, z0], [x0, y1, z0], [x0, y1, z1], [x0, y0, z1]],
        [[x1, y0, z0], [x1, y0, z1], [x1, y1, z1], [x1, y1, z0]],
        [[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]],
        [[x0, y0, z1], [x0, y1, z1], [x1, y1, z1], [x1, y0, z1]],
    ]
}

#[test]
fn all_around_the_same_light_is_gathered_whole() {
    let Some(gpu) = gpu() else { return };
    let room = closed_box([-0.3, -0.2, -0.4], [0.5, 0.3, 0.4]);
    for shape in SHAPES {
        for size in [2, 8, 32, 128] {
            for at in [Vec3::new(0.1, -0.2, 0.0), Vec3::new(-0.29, -0.2, 0.39)] {
                let light = gather(&gpu, &room, (shape, size), at);
                for (found, wanted) in light.into_iter().zip([1.0, 2.0, 4.0, 1.0]) {
                    assert!((found / wanted - 1.0).abs() < 1e-5, "{shape:?} {size} {at}: {light:?}");
                }
            }
        }
    }
    assert_no_errors(&gpu);
}

/// Form factor from a point on the floor to an upright rectangle at distance d, of height h, which reaches w to each side of
/// the foot.
fn of_wall(d: f64, h: f64, w: f64) -> f64 {
    let slant = d.hypot(h);
    ((w / d).atan() - d / slant * (w / slant).atan()) / PI
}

#[test]
fn a_wall_s_light_is_its_form_factor() {
    let Some(gpu) = gpu() else { return };
    let (d, h, w) = (0.2f32, 0.3f32, 0.25f32);
    let floor = [[-0.5, 0.0, -0.5], [-0.5, 0.0, 0.5], [0.5, 0.0, 0.5], [0.5, 0.0, -0.5]];
    let wall = [[d, 0.0, -w], [d, 0.0, w], [d, h, w], [d, h, -w]];
    let exact = of_wall(f64::from(d), f64::from(h), f64::from(w));
    let mut errors = Vec::new();
    for size in [8, 32, 128] {
        let light = gather(&gpu, &[floor, wall], (GatherShape::Cube, size), Vec3::ZERO);
        assert_eq!(light[3], 1.0, "no back is seen");
        errors.push((f64::from(light[0]) / exact - 1.0).abs());
    }
    println!("form factor {exact:.4}, errors of 8, 32, 128 pixels: {errors:.5?}");
    // About a row of pixels is seen or not by chance.
    let allowed = [8.0, 32.0, 128.0].map(|size| 1.15 / size);
    assert!(errors.iter().zip(allowed).all(|(error, allowed)| *error < allowed));
    // A plane sees it as far as it reaches, and that stands for all.
    let light = gather(
        &gpu,
        &[floor, wall],
        (GatherShape::Plane { half_side: 3.0 }, 128),
        Vec3::ZERO,
    );
    assert!((f64::from(light[0]) / exact - 1.0).abs() < 0.3, "{light:?}");
    assert_no_errors(&gpu);
}

#[test]
fn what_stands_inside_of_something_says_so() {
    let Some(gpu) = gpu() else { return };
    // Seen from outside, a box faces inward: the point is in a solid.
    let mut solid = closed_box([-0.3, -0.3, -0.3], [0.3, 0.3, 0.3]);
    solid.iter_mut().for_each(|quad| quad.reverse());
    for shape in SHAPES {
        let light = gather(&gpu, &solid, (shape, 16), Vec3::new(0.0, -0.3, 0.0));
        assert!(light[3] > 0.0 && light[3] < 0.01, "{shape:?} {light:?}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn what_cannot_be_is_named() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let new = |shape, size, capacity| Hemispheres::new(device, queue, (shape, size), capacity);
    for half_side in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let error = new(GatherShape::Plane { half_side }, 8, 1).unwrap_err();
        assert!(matches!(error, Error::InvalidSetting { .. }), "{error}");
    }
    for size in [0, 1, 7] {
        let error = new(GatherShape::Cube, size, 1).unwrap_err();
        assert!(matches!(error, Error::InvalidSetting { .. }), "{error}");
    }
    for (size, capacity) in [(128, 60_000), (2, 70_000), (65_536, 1), (u32::MAX - 1, u32::MAX)] {
        let error = new(GatherShape::Cube, size, capacity).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
    }
    let mut one = new(GatherShape::Cube, 8, 1).unwrap();
    let place = HemispherePlace {
        position: Vec3::ZERO,
        normal: Vec3::Y,
        texel: 0,
    };
    let error = one.set(queue, &[place; 2]).unwrap_err();
    assert!(matches!(error, Error::CountMismatch { .. }), "{error}");
    assert!(one.places().is_empty());
    assert_no_errors(&gpu);
}

fn settings(overrides: &[(&str, &str)]) -> Settings {
    let mut settings = Settings {
        indirect_method: IndirectMethod::IlluminationMaps,
        photons: 20_000,
        bounces: 2,
        shadow_map_size: 128,
        ..Settings::fast()
    };
    let own = [
        ("illumination_maps.texels", "300"),
        ("illumination_maps.method", "cube"),
        ("illumination_maps.hemisphere_size", "16"),
        ("illumination_maps.a_frame", "60"),
        ("illumination_maps.blend", "1"),
        ("selective.budget", "20000"),
    ];
    for (name, value) in own.iter().chain(overrides) {
        settings.set(name, value).unwrap();
    }
    settings
}

fn offline<'a>(gpu: &'a Gpu, scene: &Scene, settings: &Settings) -> Offline<'a> {
    let mut offline = Offline::new(gpu, scene.clone(), settings, 0, [64, 48], Component::Indirect).unwrap();
    offline.render_frame(None).unwrap();
    offline
}

fn texels(gpu: &Gpu, offline: &Offline<'_>) -> Vec<[f32; 4]> {
    let map = offline.renderer.illumination_map().unwrap();
    let mut light: Vec<[f32; 4]> = read_buffer_blocking(&gpu.device, &gpu.queue, map.gathered()).unwrap();
    light.truncate(offline.renderer.surface_lights().unwrap().count() as usize);
    light
}

fn waiting(gpu: &Gpu, offline: &Offline<'_>) -> usize {
    let map = offline.renderer.illumination_map().unwrap();
    let due: Vec<u32> = read_buffer_blocking(&gpu.device, &gpu.queue, map.due()).unwrap();
    due.iter().filter(|&&d| d > 0).count()
}

fn rms(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let squares = a
        .iter()
        .zip(b)
        .flat_map(|(a, b)| (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)));
    (squares.sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

#[test]
#[cfg(feature = "bvh")]
fn draws_gather_what_rays_do() {
    let Some(gpu) = gpu() else { return };
    let scene = rooms(1.0);
    let by = |overrides: &[(&str, &str)]| {
        let mut all = vec![("tracer.kind", "bvh"), ("illumination_maps.hemisphere_size", "64")];
        all.extend(overrides);
        texels(&gpu, &offline(&gpu, &scene, &settings(&all)))
    };
    let cube = by(&[]);
    let rays = by(&[("illumination_maps.method", "rays"), ("illumination_maps.rays", "4096")]);
    let zero = vec![[0.0; 4]; cube.len()];
    // Of those that stand in the open.
    let kept: Vec<usize> = (0..cube.len()).filter(|&i| rays[i][3] > 0.999).collect();
    let of = |all: &[[f32; 4]]| kept.iter().map(|&i| all[i]).collect::<Vec<_>>();
    let error = rms(&of(&cube), &of(&rays)) / rms(&of(&zero), &of(&rays));
    println!("{} texels, cube of 64 against 4096 rays: {error:.4}", kept.len());
    assert!(kept.len() > 400 && error < 0.03);
    assert_no_errors(&gpu);
}

#[test]
#[cfg(all(feature = "bvh", feature = "reference"))]
fn a_cube_gathers_what_paths_bring() {
    let Some(gpu) = gpu() else { return };
    let scene = lightfall::scene::samples::pillars(0.3);
    let settings = settings(&[
        ("tracer.kind", "bvh"),
        ("emission.first_hits", "traced"),
        ("bounces", "1"),
        ("photons", "400000"),
        ("illumination_maps.texels", "1500"),
        ("illumination_maps.a_frame", "100"),
        ("illumination_maps.hemisphere_size", "64"),
    ]);
    let offline = offline(&gpu, &scene, &settings);
    let light = texels(&gpu, &offline);
    let lights = offline.renderer.surface_lights().unwrap();
    let records: Vec<[f32; 8]> = read_buffer_blocking(&gpu.device, &gpu.queue, lights.shining()).unwrap();
    let frame = offline.renderer.frame().unwrap();
    let scale = f64::from(frame.output_scale(1.0).unwrap());
    let paths = lightfall::reference::PathTracerSettings {
        // The surface that is seen scatters, too.
        bounces: 0,
        ..Default::default()
    };
    let mut reference = common::Reference::new(&gpu, scene, &paths, 0, [64; 2]).unwrap();
    let open = (0..light.len()).filter(|&i| light[i][3] > 0.999 && light[i][0] > 0.0);
    let error = |texel: usize| {
        let [x, y, z, _, nx, ny, nz, _] = records[texel];
        let normal = Vec3::new(nx, ny, nz).as_dvec3();
        let truth = reference.irradiance((frame.world_point(Vec3::new(x, y, z)), normal), 40_000);
        let own: f64 = light[texel][..3].iter().map(|&v| f64::from(v) * scale).sum();
        (own / truth.unwrap()[0] - 1.0).abs()
    };
    let mut errors: Vec<f64> = open.step_by(97).map(error).collect();
    errors.sort_by(f64::total_cmp);
    println!("{} texels: {errors:.4?}", errors.len());
    assert!(errors.len() >= 15 && errors[errors.len() / 2] < 0.02 && errors[errors.len() * 9 / 10] < 0.05);
    assert_no_errors(&gpu);
}

/// Draws frames after a bulb jumps until nothing waits; which part of the change is left then against a fresh start.
fn left_after_a_jump(gpu: &Gpu, tracer: &str) -> f64 {
    let settings = settings(&[("tracer.kind", tracer), ("illumination_maps.threshold", "0")]);
    let mut scene = rooms(1.0);
    let mut offline = offline(gpu, &scene, &settings);
    let before = texels(gpu, &offline);
    for _ in 0..3 {
        offline.render_frame(None).unwrap();
    }
    assert!(texels(gpu, &offline) == before, "nothing changes");
    assert_eq!(waiting(gpu, &offline), 0);
    bulb(&mut scene, 1).x += 1.2;
    let fresh = texels(gpu, &self::offline(gpu, &scene, &settings));
    offline.set_scene(scene).unwrap();
    let (mut frames, mut until) = (0, None);
    while frames < 50 || waiting(gpu, &offline) > 0 {
        let counted = creation_count();
        offline.render_frame(None).unwrap();
        let now = creation_count();
        assert_eq!(now.waits, counted.waits);
        assert!(frames < 3 || now.bytes == counted.bytes, "nothing is allocated");
        frames += 1;
        assert!(frames < 200, "it comes to rest");
        if until.is_none() && rms(&texels(gpu, &offline), &fresh) <= 0.05 * rms(&before, &fresh) {
            until = Some(frames);
        }
    }
    let left = rms(&texels(gpu, &offline), &fresh) / rms(&before, &fresh);
    println!("{tracer}: 95 % after {until:?} frames; after {frames} {left:.1e} of the change is left");
    left
}

#[test]
#[cfg(feature = "bvh")]
fn draws_follow_a_change_without_a_wait_and_come_to_rest_where_a_fresh_start_does() {
    let Some(gpu) = gpu() else { return };
    // Where a texel stands is some frames older than the light that it gathers.
    assert!(left_after_a_jump(&gpu, "bvh") < 0.01);
    assert_no_errors(&gpu);
}

#[test]
fn draws_follow_without_triangles() {
    let Some(gpu) = gpu() else { return };
    // Environment maps of the fresh start have other places.
    assert!(left_after_a_jump(&gpu, "image-space") < 0.15);
    assert_no_errors(&gpu);
}

#[test]
#[cfg(feature = "bvh")]
fn what_changed_once_is_drawn_once() {
    let Some(gpu) = gpu() else { return };
    let settings = settings(&[("tracer.kind", "bvh"), ("illumination_maps.threshold", "0")]);
    let mut scene = rooms(1.0);
    let mut offline = offline(&gpu, &scene, &settings);
    bulb(&mut scene, 1).x += 1.2;
    offline.set_scene(scene).unwrap();
    let mut draws = vec![0; texels(&gpu, &offline).len()];
    let (mut frames, mut most, mut were_due) = (0, 0, 0);
    while frames < 50 || waiting(&gpu, &offline) > 0 {
        // What is gathered is written over it.
        let unwritten = vec![[-1.0_f32; 4]; draws.len()];
        let map = offline.renderer.illumination_map().unwrap();
        gpu.queue
            .write_buffer(map.gathered(), 0, bytemuck::cast_slice(&unwritten));
        offline.render_frame(None).unwrap();
        were_due = were_due.max(waiting(&gpu, &offline));
        let light = texels(&gpu, &offline);
        let is_drawn = |texel: usize| light[texel] != unwritten[texel];
        let drawn: Vec<usize> = (0..draws.len()).filter(|&t| is_drawn(t)).collect();
        drawn.iter().for_each(|&t| draws[t] += 1);
        most = most.max(drawn.len());
        frames += 1;
        assert!(frames < 200, "it comes to rest");
    }
    let of = |count: i32| draws.iter().filter(|&&d| d == count).count();
    println!(
        "{were_due} due, drawn once {}, never {}, at most {most} a frame",
        of(1),
        of(0)
    );
    assert!(of(1) == were_due && of(0) + of(1) == draws.len());
    assert!(were_due > 200 && most == 60);
    assert_no_errors(&gpu);
}

#[test]
#[cfg(feature = "bvh")]
fn behind_a_closed_door_no_texel_is_drawn() {
    let Some(gpu) = gpu() else { return };
    let mut scene = rooms(0.0);
    let mut offline = offline(&gpu, &scene, &settings(&[("tracer.kind", "bvh")]));
    let before = texels(&gpu, &offline);
    move_block(&mut scene, "near block", block_at(-0.5, -1.5, 0.5));
    offline.set_scene(scene).unwrap();
    for _ in 0..60 {
        offline.render_frame(None).unwrap();
    }
    let after = texels(&gpu, &offline);
    let lights = offline.renderer.surface_lights().unwrap();
    let places: Vec<[f32; 8]> = read_buffer_blocking(&gpu.device, &gpu.queue, lights.records()).unwrap();
    let mut changed = [0; 2];
    for ((a, b), place) in before.iter().zip(&after).zip(&places) {
        changed[usize::from(place[2] > 0.02)] += usize::from(a != b);
    }
    println!("changed near {}, far {}", changed[0], changed[1]);
    assert!(changed[0] > 50 && changed[1] == 0);
    assert_no_errors(&gpu);
}
