//! Mirrors, metal and glass: what photons do at them, and what the eye sees in them.
#![cfg(all(feature = "bvh", feature = "reference"))]

mod common;

use common::evaluate::run;
use common::{Component, Gpu, Offline, Reference, assert_no_errors, gpu, offline};
use lightfall::frame::{CausticSettings, Settings, Stage, TracerKind};
use lightfall::glam::{DAffine3, DQuat, DVec3, Vec3};
use lightfall::pass::{Bandwidth, PhotonSplatterSettings};
use lightfall::read_buffer_blocking;
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::resource::{Photon, PhotonState};
use lightfall::scene::{Camera, Instance, Light, LightKind, Material, Mesh, Projection, Scene, UnitFrame, samples};

const SIZE: [u32; 2] = [48, 48];

fn settings() -> Settings {
    Settings {
        photons: 25_000,
        frames: 8,
        bounces: 4,
        shadow_map_size: 256,
        caustic: CausticSettings {
            photons: 25_000,
            kernel_photons: 5.0,
            min_radius: 0.0,
            ..CausticSettings::default()
        },
        specular_paths: 1,
        specular_surfaces: 5,
        tracer_kind: TracerKind::Bvh,
        // Narrow kernels: frames average their noise.
        splatter: PhotonSplatterSettings {
            bandwidth: Bandwidth::Density {
                photons: 60.0,
                clamp: [0.25, 1.0],
            },
            ..Default::default()
        },
        ..Settings::balanced()
    }
}

fn mirror() -> Material {
    Material {
        name: "mirror".into(),
        base_color: [0.9; 3],
        metallic: 1.0,
        roughness: 0.0,
        ..Material::default()
    }
}

fn glass() -> Material {
    Material {
        name: "glass".into(),
        transmission: 1.0,
        roughness: 0.0,
        ..Material::default()
    }
}

fn brass() -> Material {
    Material {
        name: "brass".into(),
        base_color: [0.9, 0.7, 0.3],
        metallic: 1.0,
        roughness: 0.3,
        ..Material::default()
    }
}

/// A lamp in the Cornell box of this half side, metres.
fn square_under_ceiling(half: f64) -> LightKind {
    LightKind::Rectangle {
        center: DVec3::new(2.78, 5.4, 2.795),
        half_u: DVec3::new(half, 0.0, 0.0),
        half_v: DVec3::new(0.0, 0.0, half),
    }
}

/// The Cornell box under a lamp, which paths from the eye can run into, with a ball of this material over the short block.
fn with_ball(material: Material) -> Scene {
    let mut scene = samples::cornell(0.0);
    scene.lights[0].kind = square_under_ceiling(0.45);
    let mut ball = samples::furnace(0.0, 0.0).meshes.remove(0);
    for triangle in ball.indices.chunks_exact_mut(3) {
        triangle.swap(1, 2);
    }
    ball.normals = ball.positions.clone();
    scene.meshes.push(ball);
    scene.materials.push(material);
    scene.instances.push(Instance {
        transform: DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.8),
            DQuat::IDENTITY,
            DVec3::new(1.9, 2.6, 1.5),
        ),
        ..Instance::new(scene.meshes.len() - 1, scene.materials.len() - 1)
    });
    scene
}

fn means(pixels: &[[f32; 3]]) -> DVec3 {
    pixels.iter().map(|&p| Vec3::from(p).as_dvec3()).sum::<DVec3>() / pixels.len() as f64
}

/// Mean of all pixels and its standard error.
fn reference(gpu: &Gpu, scene: &Scene, component: PathComponent, samples: u32) -> [DVec3; 2] {
    let settings = PathTracerSettings {
        component,
        bounces: 4,
        ..PathTracerSettings::default()
    };
    let mut reference = Reference::new(gpu, scene.clone(), &settings, 0, SIZE).unwrap();
    (0..samples).for_each(|_| reference.render_sample(None).unwrap());
    let estimate = reference.read().unwrap();
    let squared: Vec<_> = estimate.standard_error.iter().map(|e| e.map(|e| e * e)).collect();
    let error = (means(&squared) / squared.len() as f64).to_array().map(f64::sqrt);
    [means(&estimate.mean), DVec3::from(error)]
}

#[test]
fn lobes_survive_packing_to_within_their_quantum() {
    let Some(gpu) = gpu() else { return };
    let inputs: Vec<[f32; 4]> = (0..=128)
        .map(|i| [i as f32 / 128.0, 1.0 + i as f32 / 65.0, 0.0, 0.0])
        .collect();
    let metal = run(
        &gpu,
        "let lobe = lobe_metal(input.x);
        let there = photon_lobe(photon_lobe_state(lobe | HIT_BACK), photon_lobe_light(lobe));
        return vec4f(lobe_roughness(there), f32(lobe_kind(there)), f32(there == lobe), f32(lobe_is_specular(there)));",
        &inputs,
    );
    let multiple = run(
        &gpu,
        "let lobe = lobe_metal(LOBE_MULTIPLE + input.x);
        let there = photon_lobe(photon_lobe_state(lobe | HIT_BACK), photon_lobe_light(lobe));
        return vec4f(lobe_roughness(there), f32(lobe_kind(there)), 0.0, 0.0);",
        &inputs,
    );
    for (input, multiple) in inputs.iter().zip(&multiple) {
        // Smooth surfaces have no facets.
        let expected = input[0] + if input[0] < 0.03 { 0.0 } else { 2.0 };
        assert!(
            (multiple[0] - expected).abs() <= 0.501 / 2047.0,
            "{input:?}: {multiple:?}"
        );
        assert_eq!(multiple[1], 1.0);
    }
    let glass = run(
        &gpu,
        "let lobe = lobe_glass(input.x, input.y);
        let texel = SurfaceTexel(1.0, vec3f(0.0, 1.0, 0.0), vec3f(0.5), SURFACE_TEXEL_BACK_FACE);
        let on = surface_texel_on(surface_texel_scattering(texel, lobe), 65535u);
        let there = surface_texel_lobe(surface_texel_unpack(surface_texel_pack(on)));
        let kept = f32(surface_texel_surface(on) == 65535u && (on.flags & SURFACE_TEXEL_BACK_FACE) != 0u);
        return vec4f(lobe_roughness(there), lobe_index_of_refraction(there), f32(lobe_kind(there)), kept);",
        &inputs,
    );
    for ((input, metal), glass) in inputs.iter().zip(&metal).zip(&glass) {
        assert!((metal[0] - input[0]).abs() <= 0.501 / 2047.0, "{input:?}: {metal:?}");
        assert_eq!(metal[1..], [1.0, 1.0, 1.0]);
        assert!((glass[0] - input[0]).abs() <= 0.501 / 31.0, "{input:?}: {glass:?}");
        assert!(
            (glass[1] - input[1].min(1.0 + 127.0 / 64.0)).abs() <= 0.501 / 64.0,
            "{input:?}: {glass:?}"
        );
        assert_eq!(glass[2..], [2.0, 1.0]);
    }
}

/// Photons of a frame, by hop, and the frame that they are in.
fn photons(gpu: &Gpu, scene: &Scene) -> (Vec<Vec<Photon>>, UnitFrame) {
    let settings = Settings {
        frames: 1,
        ..settings()
    };
    let mut offline = Offline::new(gpu, scene.clone(), &settings, 0, SIZE, Component::All).unwrap();
    offline.render_frame(None).unwrap();
    let photons = offline.renderer.photons().unwrap();
    let records: Vec<Photon> = read_buffer_blocking(&gpu.device, &gpu.queue, photons.buffer()).unwrap();
    let hops = records
        .chunks(photons.count() as usize)
        .map(<[Photon]>::to_vec)
        .collect();
    assert_no_errors(gpu);
    (hops, *offline.renderer.frame().unwrap())
}

#[test]
fn photons_leave_a_flat_mirror_by_the_law_of_reflection_and_arrive_as_densely_as_from_behind_it() {
    let Some(gpu) = gpu() else { return };
    // A mirror that stands upright beside a bulb, over a floor.
    let mut scene = samples::plane();
    for position in &mut scene.meshes[0].positions {
        *position = position.map(|x| 0.1 * x);
    }
    let bulb = DVec3::new(0.0, 2.0, 0.0);
    scene.lights = vec![Light::point(bulb, 10.0, [1.0; 3])];
    scene.meshes.push(Mesh {
        name: "mirror".into(),
        positions: vec![[3.0, 0.5, -3.0], [3.0, 0.5, 3.0], [3.0, 5.0, 3.0], [3.0, 5.0, -3.0]],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    });
    scene.materials.push(mirror());
    scene.instances.push(Instance::new(1, 1));
    let (hops, frame) = photons(&gpu, &scene);
    let place = |p: &Photon| frame.world_point(Vec3::from(p.position));
    let image = DVec3::new(6.0, 2.0, 0.0);
    let mut checked = 0;
    for (first, second) in hops[0].iter().zip(&hops[1]) {
        let is_on_mirror = first.state() == PhotonState::Stored && (place(first).x - 3.0).abs() < 1e-3;
        if !is_on_mirror || second.state() != PhotonState::Stored {
            continue;
        }
        checked += 1;
        // Seen from the floor the light comes from its mirror image.
        let way = place(second) - image;
        assert!(way.normalize().dot((place(first) - image).normalize()) > 1.0 - 1e-6);
        for channel in 0..3 {
            let share = second.flux[channel] / first.flux[channel];
            assert!((share - 0.9).abs() < 1e-3, "{share}");
        }
        let unit = way / frame.length_scale();
        let density = way.normalize().y.abs() / (4.0 * std::f64::consts::PI * unit.length_squared());
        // The footprint is kept in halves of 8 bits.
        assert!(
            (f64::from(second.density) / density - 1.0).abs() < 0.02,
            "{} {density}",
            second.density
        );
    }
    println!("{checked} photons by way of the mirror");
    assert!(checked > 500);
}

#[test]
fn photons_that_meet_glass_keep_their_flux_and_those_through_a_plate_go_on_as_before() {
    let Some(gpu) = gpu() else { return };
    let mut scene = samples::plane();
    for position in &mut scene.meshes[0].positions {
        *position = position.map(|x| 0.1 * x);
    }
    scene.lights = vec![Light::point(DVec3::new(0.0, 2.0, 0.0), 10.0, [1.0; 3])];
    let plate = |y: f32, is_up: bool| Mesh {
        name: "plate".into(),
        positions: vec![[-3.0, y, -3.0], [-3.0, y, 3.0], [3.0, y, 3.0], [3.0, y, -3.0]],
        indices: if is_up {
            vec![0, 1, 2, 0, 2, 3]
        } else {
            vec![0, 2, 1, 0, 3, 2]
        },
        ..Mesh::default()
    };
    scene.meshes.extend([plate(1.2, true), plate(1.0, false)]);
    scene.materials.push(glass());
    scene.instances.extend([Instance::new(1, 1), Instance::new(2, 1)]);
    let (hops, frame) = photons(&gpu, &scene);
    let height = |p: &Photon| frame.world_point(Vec3::from(p.position)).y;
    let direction = |path: usize, hop: usize| {
        let [a, b] = [&hops[hop - 1][path], &hops[hop][path]].map(|p| Vec3::from(p.position).as_dvec3());
        (b - a).normalize()
    };
    let (mut through, mut met) = (0, 0);
    for (path, first) in hops[0].iter().enumerate() {
        let stored = |hop: usize| hops[hop][path].state() == PhotonState::Stored;
        if !stored(0) || (height(first) - 1.2).abs() > 1e-3 || !stored(1) || !stored(2) {
            continue;
        }
        met += 1;
        assert_eq!(first.flux, hops[1][path].flux);
        if (height(&hops[1][path]) - 1.0).abs() > 1e-3 || height(&hops[2][path]).abs() > 1e-3 {
            continue;
        }
        through += 1;
        // Inside it is bent towards the normal by 1.5, outside it goes as it came.
        let way = frame.world_point(Vec3::from(first.position)) - DVec3::new(0.0, 2.0, 0.0);
        let sine = |d: DVec3| d.with_y(0.0).length();
        assert!((sine(way.normalize()) / sine(direction(path, 1)) - 1.5).abs() < 5e-3);
        assert!(direction(path, 2).dot(way.normalize()) > 1.0 - 1e-5);
    }
    println!("{through} of {met} photons went through the plate");
    // At least what Fresnel says for light from straight above, 0.92, less at grazing angles.
    assert!(through as f64 > 0.75 * f64::from(met) && met > 1000);
}

#[test]
fn direct_and_indirect_light_are_all_light_pixel_by_pixel() {
    let Some(gpu) = gpu() else { return };
    for material in [mirror(), glass(), brass()] {
        let name = material.name.clone();
        let scene = with_ball(material);
        let settings = Settings {
            frames: 2,
            ..settings()
        };
        let part = |component| offline::render(&gpu, &scene, &settings, SIZE, component).unwrap();
        let [all, direct, indirect] = [Component::All, Component::Direct, Component::Indirect].map(part);
        for ((all, direct), indirect) in all.iter().zip(&direct).zip(&indirect) {
            let [all, direct, indirect] = [all, direct, indirect].map(|&pixel| Vec3::from(pixel));
            let difference = (direct + indirect - all).abs().max_element();
            assert!(
                difference <= 1e-3 * all.max_element(),
                "{name}: {direct} + {indirect}, {all}"
            );
        }
    }
    assert_no_errors(&gpu);
}

/// Renders parts of the light and compares their energy with what the path tracer finds in so many samples.
fn compare_energy<const N: usize>(
    gpu: &Gpu,
    scene: &Scene,
    settings: &Settings,
    parts: [(Component, PathComponent, u32); N],
) {
    let name = &scene.materials.last().unwrap().name;
    for (component, path_component, samples) in parts {
        let found = means(&offline::render(gpu, scene, settings, SIZE, component).unwrap());
        let [expected, noise] = reference(gpu, scene, path_component, samples);
        println!(
            "{name}, {path_component:?}: {found}, {:+.2} %, noise {:.2} %",
            100.0 * (found / expected - 1.0),
            100.0 * noise / expected
        );
        let error = (found - expected).abs() - 2.0 * noise;
        assert!(
            (error / expected).max_element() < 0.03,
            "{name}, {path_component:?}: {found}, {expected}"
        );
    }
}

#[test]
fn rooms_with_a_mirror_glass_or_brass_have_as_much_light_as_the_path_tracer_finds() {
    let Some(gpu) = gpu() else { return };
    // What a ball shows of this lamp is smaller than a pixel: more frames take the pixels at more places.
    let mut settings = settings();
    settings.frames *= 4;
    settings.photons /= 4;
    settings.caustic.photons /= 4;
    for material in [mirror(), glass(), brass()] {
        let scene = with_ball(material);
        let parts = [
            (Component::Direct, PathComponent::Direct, 256),
            (Component::Indirect, PathComponent::Indirect, 256),
        ];
        compare_energy(&gpu, &scene, &settings, parts);
    }
    assert_no_errors(&gpu);
}

#[test]
fn caustics_of_their_own_or_among_all_photons_are_as_bright() {
    let Some(gpu) = gpu() else { return };
    let scene = with_ball(glass());
    let indirect = |caustic_photons| {
        let mut settings = settings();
        settings.caustic.photons = caustic_photons;
        means(&offline::render(&gpu, &scene, &settings, SIZE, Component::Indirect).unwrap())
    };
    let (apart, together) = (indirect(settings().caustic.photons), indirect(0));
    println!("{apart} apart, {together} together");
    assert!(
        (together / apart - 1.0).abs().max_element() < 0.02,
        "{together} or {apart}"
    );
    assert_no_errors(&gpu);
}

/// Makes the lamp as large as the ceiling, so that paths from the eye run into it soon and its image in a ball is larger than a
/// pixel, and the walls dark: surfaces behind a ball send on light of as many bounces as those before it, the path tracer's of
/// as many fewer as light took to the eye, and in a dark room those bounces are worth nothing.
fn widen_lamp_and_darken_walls(scene: &mut Scene) {
    let ball = scene.materials.len() - 1;
    for material in &mut scene.materials[..ball] {
        material.base_color = material.base_color.map(|albedo| 0.3 * albedo);
    }
    scene.lights[0].kind = square_under_ceiling(2.2);
}

#[test]
fn balls_throw_and_show_as_much_light_as_the_path_tracer_finds() {
    let Some(gpu) = gpu() else { return };
    for material in [mirror(), glass(), brass()] {
        let mut scene = with_ball(material);
        widen_lamp_and_darken_walls(&mut scene);
        let parts = [
            (Component::Caustic, PathComponent::Caustic, 512),
            (Component::Specular, PathComponent::Specular, 256),
        ];
        compare_energy(&gpu, &scene, &settings(), parts);
    }
    assert_no_errors(&gpu);
}

#[test]
fn glass_with_a_bubble_in_it_throws_as_much_light_as_the_path_tracer_finds() {
    let Some(gpu) = gpu() else { return };
    let mut scene = with_ball(glass());
    widen_lamp_and_darken_walls(&mut scene);
    let ball = scene.instances.last().unwrap().clone();
    let mut bubble = scene.meshes[ball.mesh].clone();
    for triangle in bubble.indices.chunks_exact_mut(3) {
        triangle.swap(1, 2);
    }
    bubble.normals = bubble.normals.iter().map(|n| n.map(|x| -x)).collect();
    scene.meshes.push(bubble);
    scene.instances.push(Instance {
        mesh: scene.meshes.len() - 1,
        transform: ball.transform * DAffine3::from_scale(DVec3::splat(0.6)),
        ..ball
    });
    // Four surfaces of glass, then a wall.
    compare_energy(
        &gpu,
        &scene,
        &settings(),
        [(Component::Caustic, PathComponent::Caustic, 512)],
    );
    assert_no_errors(&gpu);
}

/// Flux that arrives at specular surfaces straight from the lights, and which share of the photons brings it: of those of all
/// light, and of those of caustics.
fn first_flux(gpu: &Gpu, scene: &Scene, tracer_kind: TracerKind) -> [(DVec3, f64); 2] {
    let settings = Settings {
        frames: 1,
        photons: 100_000,
        bounces: 1,
        tracer_kind,
        shadow_map_size: 1024,
        ..settings()
    };
    let mut offline = Offline::new(gpu, scene.clone(), &settings, 0, SIZE, Component::All).unwrap();
    offline.render_frame(None).unwrap();
    [offline.renderer.photons(), offline.renderer.caustic_photons()].map(|photons| {
        let photons = photons.unwrap();
        let records: Vec<Photon> = read_buffer_blocking(&gpu.device, &gpu.queue, photons.buffer()).unwrap();
        let first = &records[..photons.count() as usize];
        // Bits 2 and 3: metal or glass.
        let is_specular = |p: &&Photon| p.state() == PhotonState::Stored && p.state & 12 != 0;
        let landed: Vec<_> = first.iter().filter(is_specular).collect();
        let flux = landed.iter().map(|p| Vec3::from(p.flux).as_dvec3()).sum();
        (flux, landed.len() as f64 / first.len() as f64)
    })
}

#[test]
fn photons_that_are_aimed_bring_as_much_light_as_those_that_are_not_and_more_of_them_arrive() {
    let Some(gpu) = gpu() else { return };
    // Three balls, of which two overlap as the lamps see them.
    let mut scene = with_ball(mirror());
    let ball = scene.instances.last().unwrap().clone();
    for (x, z) in [(2.7, 1.9), (4.2, 3.4)] {
        scene.instances.push(Instance {
            transform: DAffine3::from_translation(DVec3::new(x - 1.9, -0.4, z - 1.5)) * ball.transform,
            ..ball.clone()
        });
    }
    let above = DVec3::new(2.78, 5.2, 2.795);
    let lamps = [
        ("point", Light::point(above, 30.0, [1.0, 0.8, 0.5])),
        (
            "spot",
            Light {
                kind: LightKind::Spot {
                    position: above,
                    direction: DVec3::new(-0.1, -1.0, -0.2).normalize(),
                    inner_angle: 0.2,
                    outer_angle: 0.6,
                    radius: 0.0,
                },
                ..Light::point(above, 30.0, [1.0, 0.8, 0.5])
            },
        ),
        ("rectangle", scene.lights[0].clone()),
    ];
    let check = |name: &str, scene: &Scene, kind: TracerKind| {
        let [(even, even_share), (aimed, aimed_share)] = first_flux(&gpu, scene, kind);
        println!("{name}, {kind:?}: evenly {even} by {even_share:.3}, aimed {aimed} by {aimed_share:.3}");
        assert!((aimed / even - 1.0).abs().max_element() < 0.015, "{name}, {kind:?}");
        assert!(aimed_share > even_share && aimed_share > 0.5, "{name}, {kind:?}");
    };
    for (name, lamp) in lamps {
        scene.lights = vec![lamp];
        check(name, &scene, TracerKind::Bvh);
    }
    // A sun shines into no closed box.
    scene.lights = vec![Light {
        kind: LightKind::Directional {
            direction: DVec3::new(0.2, -1.0, 0.3).normalize(),
            angle: 0.0,
        },
        ..Light::point(above, 3.0, [1.0, 0.8, 0.5])
    }];
    scene.instances.drain(..scene.instances.len() - 3);
    for kind in [TracerKind::Bvh, TracerKind::ImageSpace] {
        check("sun", &scene, kind);
    }
    assert_no_errors(&gpu);
}

#[test]
fn nothing_is_made_or_recorded_for_specular_surfaces_where_there_are_none() {
    let Some(gpu) = gpu() else { return };
    let settings = Settings {
        frames: 1,
        ..settings()
    };
    let used = |scene: Scene| {
        let mut offline = Offline::new(&gpu, scene, &settings, 0, SIZE, Component::All).unwrap();
        offline.render_frame(None).unwrap();
        let plan = offline.renderer.plan().unwrap();
        let on = [Stage::CausticMap, Stage::PhotonGrid, Stage::SpecularPaths].map(|stage| plan.is_on(stage));
        let memory = offline.memory_by_resource();
        let names = ["caustic_photons", "caustic_irradiance", "photon_grid", "specular_paths"];
        let made = names.map(|name| memory.iter().any(|(n, _)| *n == name));
        (on, made)
    };
    assert_eq!(used(samples::cornell(0.0)), ([false; 3], [false; 4]));
    assert_eq!(used(with_ball(mirror())), ([true; 3], [true; 4]));
    let image = |settings: &Settings| {
        let pixels = offline::render(&gpu, &samples::cornell(0.0), settings, SIZE, Component::All).unwrap();
        pixels.into_iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>()
    };
    let mut other = settings.clone();
    (other.specular_paths, other.specular_surfaces, other.caustic.photons) = (3, 1, 0);
    assert!(image(&settings) == image(&other));
    assert_no_errors(&gpu);
}

#[test]
fn a_flat_mirror_shows_the_room_before_it() {
    let Some(gpu) = gpu() else { return };
    // A pane before the back wall of the box, which is 5.592 m deep.
    let back = 5.59;
    let mut mirrored = samples::cornell(0.0);
    mirrored.materials.push(Material {
        base_color: [1.0; 3],
        ..mirror()
    });
    let pane = Mesh {
        name: "pane".into(),
        positions: vec![[1.0, 1.0, back], [1.0, 4.0, back], [4.5, 4.0, back], [4.5, 1.0, back]],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    };
    mirrored.meshes.push(pane);
    mirrored
        .instances
        .push(Instance::new(mirrored.meshes.len() - 1, mirrored.materials.len() - 1));
    let pixels = offline::render(&gpu, &mirrored, &settings(), SIZE, Component::All).unwrap();
    let expected = {
        let settings = PathTracerSettings {
            bounces: 4,
            ..PathTracerSettings::default()
        };
        let mut reference = Reference::new(&gpu, mirrored, &settings, 0, SIZE).unwrap();
        (0..512).for_each(|_| reference.render_sample(None).unwrap());
        reference.read().unwrap().mean
    };
    // The middle of the image lies in the pane.
    let middle = |image: &[[f32; 3]]| {
        let kept: Vec<_> = (18..26)
            .flat_map(|y| (20..28).map(move |x| y * 48 + x))
            .map(|i: usize| image[i])
            .collect();
        means(&kept)
    };
    let (found, wanted) = (middle(&pixels), middle(&expected));
    println!("in the mirror {found}, expected {wanted}");
    assert!((found / wanted - 1.0).abs().max_element() < 0.05, "{found}, {wanted}");
    assert_no_errors(&gpu);
}

#[test]
fn a_flat_mirror_shows_lamps_with_an_extent() {
    let Some(gpu) = gpu() else { return };
    let position = DVec3::new(0.0, 1.5, -0.5);
    let lamps = [
        ("sphere", LightKind::Point { position, radius: 0.3 }),
        (
            "spot",
            LightKind::Spot {
                position,
                direction: DVec3::new(0.3, -1.0, 0.4).normalize(),
                inner_angle: 0.3,
                outer_angle: 0.9,
                radius: 0.4,
            },
        ),
        (
            "sun",
            LightKind::Directional {
                direction: DVec3::new(0.1, -0.8, 1.0).normalize(),
                angle: 0.15,
            },
        ),
    ];
    for (name, kind) in lamps {
        let mut scene = samples::plane();
        scene.materials[0] = mirror();
        scene.lights[0].kind = kind;
        scene.lights[0].intensity = 2.0;
        scene.cameras[0] = Camera {
            transform: DAffine3::from_rotation_translation(DQuat::from_rotation_x(-0.58), DVec3::new(0.0, 1.5, 2.5)),
            projection: Projection::Perspective { fov_y: 0.9 },
            ..scene.cameras[0].clone()
        };
        let found = means(&offline::render(&gpu, &scene, &settings(), SIZE, Component::Direct).unwrap());
        let [expected, noise] = reference(&gpu, &scene, PathComponent::Direct, 64);
        println!("{name} in a mirror: {found}, expected {expected} ± {noise}");
        assert!(
            (found / expected - 1.0).abs().max_element() < 0.02,
            "{name}: {found}, {expected}"
        );
    }
    assert_no_errors(&gpu);
}
