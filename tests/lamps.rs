//! Light from flat lamps and from surfaces that shine: photons start all over them and arrive where the formulas say.
#![cfg(all(feature = "bvh", feature = "reference"))]

mod common;

use common::{Component, Gpu, Offline, Reference, assert_no_errors, disc_over_horizon, gpu};
use lightfall::frame::{IndirectMethod, Settings, TracerKind};
use lightfall::glam::{DVec3, Vec3};
use lightfall::pass::FirstHits;
use lightfall::read_buffer_blocking;
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::resource::{Photon, PhotonState};
use lightfall::scene::{Instance, Light, LightKind, Material, Mesh, Scene, samples};

const KINDS: [TracerKind; 3] = [TracerKind::ImageSpace, TracerKind::Hybrid, TracerKind::Bvh];
const SIZE: [u32; 2] = [48, 48];

fn settings(tracer_kind: TracerKind) -> Settings {
    Settings {
        photons: 50_000,
        bounces: 2,
        env_map_count: 6,
        env_map_size: 128,
        shadow_map_size: 256,
        tracer_kind,
        ..Settings::balanced()
    }
}

/// Middle and half sides of a lamp under the ceiling of the Cornell box; its front looks down.
fn ceiling_lamp() -> [DVec3; 3] {
    [
        DVec3::new(2.78, 5.45, 2.795),
        DVec3::new(0.65, 0.0, 0.0),
        DVec3::new(0.0, 0.0, 0.525),
    ]
}

/// The Cornell box under a lamp that is a light.
fn under_rectangle(radiance: f32) -> Scene {
    let [center, half_u, half_v] = ceiling_lamp();
    let mut scene = samples::cornell(0.0);
    scene.lights = vec![Light {
        kind: LightKind::Rectangle { center, half_u, half_v },
        ..Light::point(DVec3::ZERO, radiance, [1.0, 0.8, 0.5])
    }];
    scene
}

/// The Cornell box under the same lamp as a mesh of 2 `steps`² triangles.
fn under_mesh(radiance: f32, steps: u32) -> Scene {
    let [center, half_u, half_v] = ceiling_lamp();
    let mut scene = samples::cornell(0.0);
    scene.lights.clear();
    let place = |i: u32, j: u32| {
        let [a, b] = [i, j].map(|k| 2.0 * f64::from(k) / f64::from(steps) - 1.0);
        (center + a * half_u + b * half_v).as_vec3().to_array()
    };
    let vertex = |i: u32, j: u32| i * (steps + 1) + j;
    scene.meshes.push(Mesh {
        name: "lamp".into(),
        positions: (0..=steps)
            .flat_map(|i| (0..=steps).map(move |j| place(i, j)))
            .collect(),
        indices: (0..steps)
            .flat_map(|i| (0..steps).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                [a, b, c, a, c, d]
            })
            .collect(),
        ..Mesh::default()
    });
    scene.materials.push(Material {
        emission: [1.0, 0.8, 0.5].map(|c| c * radiance),
        ..Material::diffuse("lamp", [0.0; 3])
    });
    let (mesh, material) = (scene.meshes.len() - 1, scene.materials.len() - 1);
    scene.instances.push(Instance::new(mesh, material));
    scene
}

fn frame<'a>(gpu: &'a Gpu, scene: &Scene, settings: &Settings, component: Component) -> Offline<'a> {
    let mut offline = Offline::new(gpu, scene.clone(), settings, 0, SIZE, component).unwrap();
    offline.render_frame(None).unwrap();
    assert_no_errors(gpu);
    offline
}

/// Means over all of the image: frames look at other places in their pixels.
fn accumulated(gpu: &Gpu, scene: &Scene, settings: &Settings, component: Component) -> DVec3 {
    let settings = Settings {
        frames: 8,
        photons: 25_000,
        ..settings.clone()
    };
    let pixels = common::offline::render(gpu, scene, &settings, SIZE, component).unwrap();
    assert_no_errors(gpu);
    means(&pixels)
}

/// Means over all pixels.
fn means(pixels: &[[f32; 3]]) -> DVec3 {
    pixels.iter().map(|&p| Vec3::from(p).as_dvec3()).sum::<DVec3>() / pixels.len() as f64
}

/// Means over those that do not see the lamp itself, which are no brighter than a tenth of it.
fn means_beside_the_lamp(pixels: &[[f32; 3]]) -> DVec3 {
    let others: Vec<_> = pixels.iter().copied().filter(|p| p[0] < 0.3).collect();
    assert!(20 * others.len() > 19 * pixels.len());
    means(&others)
}

fn first_hits(offline: &Offline<'_>, gpu: &Gpu) -> Vec<Photon> {
    let photons = offline.renderer.photons().unwrap();
    let mut records: Vec<Photon> = read_buffer_blocking(&gpu.device, &gpu.queue, photons.buffer()).unwrap();
    records.truncate(photons.count() as usize);
    records
}

/// Irradiance over the radiance of the ceiling lamp at a point of the floor, by the midpoint rule.
fn floor_irradiance(p: DVec3) -> f64 {
    const STEPS: u32 = 32;
    let [center, half_u, half_v] = ceiling_lamp();
    let cell = 4.0 * half_u.cross(half_v).length() / f64::from(STEPS * STEPS);
    let at = |k: u32| (2.0 * f64::from(k) + 1.0) / f64::from(STEPS) - 1.0;
    (0..STEPS * STEPS)
        .map(|k| {
            let way = center + at(k % STEPS) * half_u + at(k / STEPS) * half_v - p;
            let cosine = way.normalize().y;
            cell * cosine * cosine / way.length_squared()
        })
        .sum()
}

#[test]
fn first_hits_carry_the_lamps_flux_and_land_as_densely_as_they_say_and_the_formula_does() {
    let Some(gpu) = gpu() else { return };
    let mut floor = samples::plane();
    floor.lights.clear();
    for position in &mut floor.meshes[0].positions {
        *position = position.map(|x| 0.2 * x);
    }
    let lamp = under_rectangle(3.0).lights.remove(0);
    let flux = lamp.flux(1.0);
    floor.lights.push(lamp);
    for kind in KINDS {
        let offline = frame(&gpu, &floor, &settings(kind), Component::All);
        let unit = *offline.renderer.frame().unwrap();
        let hits = first_hits(&offline, &gpu);
        let carried: f64 = hits.iter().map(|p| f64::from(p.flux[1])).sum::<f64>() * unit.flux_scale();
        assert!(
            (carried / flux.y - 1.0).abs() < 1e-5,
            "{kind:?}: {carried} of {}",
            flux.y
        );
        // A square of the floor off the lamp's middle, far beyond the lamp's size.
        let (from, to) = (DVec3::new(3.0, 0.0, 1.0), DVec3::new(9.0, 0.0, 7.0));
        let inside = |p: &&Photon| {
            let at = unit.world_point(Vec3::from(p.position));
            p.state() == PhotonState::Stored && at.x >= from.x && at.x < to.x && at.z >= from.z && at.z < to.z
        };
        let landed: Vec<&Photon> = hits.iter().filter(inside).collect();
        const STEPS: u32 = 48;
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(STEPS);
        let points =
            (0..STEPS * STEPS).map(|k| from + (to - from) * DVec3::new(place(k % STEPS), 0.0, place(k / STEPS)));
        let expected = 36.0 / f64::from(STEPS * STEPS) * points.map(floor_irradiance).sum::<f64>() * 3.0 * 0.8;
        let found = landed.iter().map(|p| f64::from(p.flux[1])).sum::<f64>() * unit.flux_scale();
        println!("{kind:?}: {found:.4} W on the square, expected {expected:.4}");
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{kind:?}: {found}, expected {expected}"
        );
        // The mean of one over the density is the area over the photons' number, whatever the densities are.
        let area = landed.iter().map(|p| 1.0 / f64::from(p.density)).sum::<f64>() / hits.len() as f64;
        let area = area * unit.length_scale().powi(2);
        println!("{kind:?}: densities make the square {area:.3} m²");
        assert!((area / 36.0 - 1.0).abs() < 0.05, "{kind:?}: {area}");
        assert!(
            hits.iter()
                .all(|p| p.state() != PhotonState::Stored || p.is_first_hit())
        );
    }
}

#[test]
fn a_mesh_that_shines_lights_a_room_like_the_lamp_that_it_looks_like() {
    let Some(gpu) = gpu() else { return };
    for component in [Component::Direct, Component::Indirect] {
        let mean = |scene| {
            let offline = frame(&gpu, &scene, &settings(TracerKind::Bvh), component);
            means_beside_the_lamp(&offline.read().unwrap())
        };
        // In the rectangle's place a dark mesh takes as much indirect light.
        let mut beside = under_mesh(0.0, 1);
        beside.lights = under_rectangle(3.0).lights;
        let light = mean(beside);
        // Two triangles and eighteen: by polygons, and by the rectangle that stands for them.
        for steps in [1, 3] {
            let mesh = mean(under_mesh(3.0, steps));
            println!("{component:?}, {} triangles: {mesh} against {light}", 2 * steps * steps);
            assert!(
                (mesh / light - 1.0).abs().max_element() < 0.02,
                "{component:?}: {mesh}, {light}"
            );
        }
    }
}

#[test]
fn a_room_under_a_lamp_of_triangles_has_as_much_light_as_the_path_tracer_finds() {
    let Some(gpu) = gpu() else { return };
    // The eye sees the mesh shine, which counts as direct light, and does not see the rectangle.
    let (scene, unseen) = (under_mesh(3.0, 1), under_rectangle(3.0));
    let reference = |scene: &Scene, component| {
        let settings = PathTracerSettings {
            component,
            bounces: 2,
            ..PathTracerSettings::default()
        };
        let mut reference = Reference::new(&gpu, scene.clone(), &settings, 0, SIZE).unwrap();
        (0..256).for_each(|_| reference.render_sample(None).unwrap());
        means(&reference.read().unwrap().mean)
    };
    let direct = reference(&unseen, PathComponent::Direct);
    let indirect = reference(&scene, PathComponent::Indirect);
    let lost_at_most = [0.03, 0.02, 0.02];
    for (kind, most) in KINDS.into_iter().zip(lost_at_most) {
        let found = accumulated(&gpu, &scene, &settings(kind), Component::Indirect);
        println!("{kind:?}: indirect {found} against {indirect}");
        assert!(
            (found / indirect - 1.0).abs().max_element() < most,
            "{kind:?}: {found}, {indirect}"
        );
    }
    let found = accumulated(&gpu, &unseen, &settings(TracerKind::Bvh), Component::Direct);
    println!("direct {found} against {direct}");
    assert!((found / direct - 1.0).abs().max_element() < 0.03, "{found}, {direct}");
}

#[test]
fn photons_that_are_traced_from_their_light_start_all_over_its_extent() {
    let Some(gpu) = gpu() else { return };
    let at = DVec3::new(2.0, 3.6, 2.2);
    let kinds = [
        LightKind::Point {
            position: at,
            radius: 0.9,
        },
        LightKind::Spot {
            position: at,
            direction: DVec3::new(0.1, -1.0, 0.0),
            inner_angle: 0.2,
            outer_angle: 0.7,
            radius: 0.9,
        },
    ];
    let settings = |first_hits| Settings {
        first_hits,
        ..settings(TracerKind::Bvh)
    };
    // Over what the path tracer finds: from the middle of the light and from all of it.
    let bias = |kind: LightKind| {
        let mut scene = samples::cornell(0.0);
        scene.lights = vec![Light {
            kind,
            ..Light::point(at, 10.0, [1.0, 0.8, 0.5])
        }];
        let paths = PathTracerSettings {
            component: PathComponent::Indirect,
            bounces: 2,
            ..Default::default()
        };
        let mut reference = Reference::new(&gpu, scene.clone(), &paths, 0, SIZE).unwrap();
        (0..256).for_each(|_| reference.render_sample(None).unwrap());
        let truth = means(&reference.read().unwrap().mean);
        [FirstHits::ShadowMaps, FirstHits::Traced]
            .map(|first| accumulated(&gpu, &scene, &settings(first), Component::Indirect) / truth)
    };
    for kind in kinds {
        // Kernels and what is lost at edges are the same without an extent.
        let without = bias(match kind {
            LightKind::Point { position, .. } => LightKind::Point { position, radius: 0.0 },
            LightKind::Spot {
                position,
                direction,
                inner_angle,
                outer_angle,
                ..
            } => LightKind::Spot {
                position,
                direction,
                inner_angle,
                outer_angle,
                radius: 0.0,
            },
            other => other,
        })[1];
        let [from_middle, from_all] = bias(kind).map(|b| b / without - 1.0);
        println!(
            "{kind:?}: from the middle {from_middle:+.4}, from all of it {from_all:+.4}; without extent {without:.4}"
        );
        assert!(from_all.abs().max_element() < 0.015, "{from_all}");
        assert!(from_all.length() < from_middle.length(), "{from_middle}");
    }
}

#[test]
fn photons_of_a_wide_sun_that_sets_come_from_the_part_above_the_horizon() {
    let Some(gpu) = gpu() else { return };
    let angle = 0.5;
    let settings = Settings {
        first_hits: FirstHits::Traced,
        bounces: 1,
        photons: 200_000,
        ..settings(TracerKind::Bvh)
    };
    for elevation in [0.7, 0.3, 0.0, -0.2] {
        let mut scene = samples::plane();
        scene.lights[0].kind = LightKind::Directional {
            direction: -DVec3::new(f64::cos(elevation), f64::sin(elevation), 0.0),
            angle,
        };
        let offline = frame(&gpu, &scene, &settings, Component::Indirect);
        let unit = offline.renderer.frame().unwrap().flux_scale();
        let up = Photon::pack_unit_vector(Vec3::Y);
        let above = |p: &&Photon| p.state() == PhotonState::Stored && p.normal == up;
        let found: f64 = first_hits(&offline, &gpu)
            .iter()
            .filter(above)
            .map(|p| f64::from(p.flux[0]))
            .sum();
        // 10 W/m² on 200 by 200 m.
        let expected = 10.0 * 4e4 * disc_over_horizon(elevation, angle);
        let off = found * unit / expected - 1.0;
        println!("elevation {elevation}: {:+.2} %", 100.0 * off);
        assert!(off.abs() < 0.01, "{elevation}: {found}, expected {expected}");
    }
}

#[test]
fn light_gathered_from_lit_maps_comes_from_lamps_too() {
    let Some(gpu) = gpu() else { return };
    let scene = under_mesh(3.0, 1);
    let mean = |indirect_method| {
        let settings = Settings {
            indirect_method,
            // Gathering adds a bounce.
            bounces: if indirect_method == IndirectMethod::FinalGather {
                1
            } else {
                2
            },
            ..settings(TracerKind::Bvh)
        };
        means(&frame(&gpu, &scene, &settings, Component::Indirect).read().unwrap())
    };
    let (splatted, gathered) = (mean(IndirectMethod::Splatting), mean(IndirectMethod::FinalGather));
    println!("gathered {gathered}, splatted {splatted}");
    assert!(
        (gathered / splatted - 1.0).abs().max_element() < 0.05,
        "{gathered}, {splatted}"
    );
}

#[test]
fn lamps_that_come_and_go_while_frames_run_take_their_light_along() {
    let Some(gpu) = gpu() else { return };
    let settings = settings(TracerKind::Hybrid);
    let mut offline = Offline::new(&gpu, under_rectangle(3.0), &settings, 0, SIZE, Component::All).unwrap();
    let mut light_of = |scene: Scene| {
        offline.set_scene(scene).unwrap();
        offline.render_frame(None).unwrap();
        means(&offline.read().unwrap()).element_sum()
    };
    let one = light_of(under_rectangle(3.0));
    let mut dark = under_rectangle(3.0);
    dark.lights[0].intensity = 0.0;
    assert_eq!(light_of(dark), 0.0);
    let mut many = under_rectangle(3.0);
    let [center, half_u, half_v] = ceiling_lamp();
    let half = |side: f64| LightKind::Rectangle {
        center: center + side * 0.5 * half_u,
        half_u: 0.5 * half_u,
        half_v,
    };
    many.lights[0].kind = half(1.0);
    many.lights.push(Light {
        kind: half(-1.0),
        ..many.lights[0].clone()
    });
    let two = light_of(many);
    assert!((two / one - 1.0).abs() < 0.02, "{two}, {one}");
    assert!((light_of(under_rectangle(6.0)) / (2.0 * one) - 1.0).abs() < 0.02);
    assert_no_errors(&gpu);
}

#[test]
fn a_closed_box_that_shines_everywhere_is_as_bright_as_the_series_says() {
    let Some(gpu) = gpu() else { return };
    // Six walls of two triangles, seen from the middle, each a lamp: radiance L_e, reflectance ρ, two bounces.
    let (emitted, reflectance) = (2.0, 0.5);
    let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 0 { -1.0 } else { 1.0 });
    let walls = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    let mut scene = samples::furnace(reflectance, emitted);
    let inward = |quad: [u32; 4]| {
        let [a, b, c] = [quad[0], quad[1], quad[2]].map(|i| Vec3::from(corner(i)));
        let is_inward = (b - a).cross(c - a).dot(a) < 0.0;
        if is_inward {
            quad
        } else {
            [quad[0], quad[3], quad[2], quad[1]]
        }
    };
    scene.meshes[0] = Mesh {
        name: "box".into(),
        positions: walls.iter().flat_map(|&w| inward(w).map(corner)).collect(),
        indices: (0..6).flat_map(|w| [0, 1, 2, 0, 2, 3].map(|i| 4 * w + i)).collect(),
        ..Mesh::default()
    };
    // Emitted, direct, and one more for each bounce.
    let series: f64 = (0..4).map(|n| f64::from(reflectance).powi(n)).sum();
    for kind in [TracerKind::ImageSpace, TracerKind::Bvh] {
        let found = means(&frame(&gpu, &scene, &settings(kind), Component::All).read().unwrap());
        let expected = f64::from(emitted) * series;
        println!("{kind:?}: {found}, expected {expected}");
        assert!(
            (found / expected - 1.0).abs().max_element() < 0.03,
            "{kind:?}: {found}, {expected}"
        );
    }
}
