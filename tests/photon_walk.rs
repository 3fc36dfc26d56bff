//! The photon walk over each tracer, and over both: one walk, whatever finds what its rays meet.
#![cfg(feature = "bvh")]

mod common;

use common::statistics::Random;
use common::{Component, Gpu, Offline, assert_no_errors, gpu};
use lightfall::frame::{Settings, TracerKind};
use lightfall::glam::{DAffine3, DVec3, Vec3};
use lightfall::pass::*;
use lightfall::resource::*;
use lightfall::scene::{Light, Material, Mesh, Scene, Texture, samples};
use lightfall::{read_buffer_blocking, wgpu};

const BOUNCES: u32 = 3;
const SAMPLE_OFFSET: u32 = 77;

/// A scene with what both tracers read of it.
struct World<'a> {
    gpu: &'a Gpu,
    /// Of a frame traced in image space: its environment maps, its lights' first hits.
    offline: Offline<'a>,
    bvh: BvhGeometry,
    image_space_tracer: ImageSpaceTracer,
    bvh_tracer: BvhTracer,
}

fn settings(kind: TracerKind) -> Settings {
    Settings {
        photons: 20_000,
        bounces: BOUNCES,
        env_map_count: 6,
        env_map_size: 64,
        shadow_map_size: 256,
        tracer_kind: kind,
        ..Settings::balanced()
    }
}

impl<'a> World<'a> {
    fn new(gpu: &'a Gpu, scene: &Scene) -> Self {
        let settings = settings(TracerKind::ImageSpace);
        let mut offline = Offline::new(gpu, scene.clone(), &settings, 0, [4, 4], Component::All).unwrap();
        offline.render_frame(None).unwrap();
        let mut bvh = BvhGeometry::new(&gpu.device, &gpu.queue, scene, &BvhGeometryConfig::default()).unwrap();
        bvh.prepare(&gpu.queue, offline.renderer.frame().unwrap()).unwrap();
        Self {
            gpu,
            offline,
            bvh,
            image_space_tracer: ImageSpaceTracer::new(&gpu.device, settings.trace_method),
            bvh_tracer: BvhTracer::new(&gpu.device),
        }
    }

    /// Where light first lands.
    fn first_hits(&self) -> Vec<Photon> {
        let photons = self.offline.renderer.photons().unwrap();
        let mut records = read(self.gpu, photons);
        records.truncate(photons.count() as usize);
        records
    }

    fn env_maps(&self) -> &EnvMaps {
        self.offline.renderer.env_maps().unwrap()
    }

    /// Maps none of which is asked: every ray is lost.
    fn no_maps(&self) -> EnvMaps {
        EnvMaps::new(&self.gpu.device, 1, 4).unwrap()
    }

    fn image_space(&self, env_maps: &EnvMaps, photons: &Photons, shared: Option<SharedHop<'_>>) {
        self.image_space_part(env_maps, photons, shared, None);
    }

    /// The walk of all paths, or of some.
    fn image_space_part(
        &self,
        env_maps: &EnvMaps,
        photons: &Photons,
        shared: Option<SharedHop<'_>>,
        list: Option<&PathList>,
    ) {
        let device = &self.gpu.device;
        let mut resources = ImageSpaceTracerResources::for_shared_hops(device, BOUNCES).unwrap();
        let hierarchy = DepthHierarchy::new(device, env_maps).unwrap();
        let build_inputs = DepthHierarchyBuildInputs {
            queue: &self.gpu.queue,
            env_maps,
            hierarchy: &hierarchy,
            maps: None,
            timestamps: None,
        };
        let inputs = ImageSpaceTracerInputs {
            queue: &self.gpu.queue,
            env_maps,
            hierarchy: Some(&hierarchy),
            photons,
            shared,
            guiding: None,
            sample_offset: SAMPLE_OFFSET,
            settings: &Default::default(),
            timestamps: None,
        };
        submit(self.gpu, |encoder| {
            let mut build = DepthHierarchyBuildResources::new(device, env_maps).unwrap();
            DepthHierarchyBuild::new(device).record(encoder, &mut build, &build_inputs);
            let recorded = match list {
                None => self.image_space_tracer.record(encoder, &mut resources, &inputs),
                Some(list) => self
                    .image_space_tracer
                    .record_listed(encoder, &mut resources, &inputs, list),
            };
            recorded.unwrap();
        });
    }

    fn triangles(&self, photons: &Photons, shared: Option<SharedHop<'_>>) {
        self.triangles_part(photons, shared, None);
    }

    /// The walk of all paths, or of some.
    fn triangles_part(&self, photons: &Photons, shared: Option<SharedHop<'_>>, list: Option<&PathList>) {
        let mut resources = BvhTracerResources::for_shared_hops(&self.gpu.device, BOUNCES).unwrap();
        let inputs = BvhTracerInputs {
            queue: &self.gpu.queue,
            geometry: &self.bvh,
            photons,
            shared,
            guiding: None,
            sample_offset: SAMPLE_OFFSET,
            roulette_from: ImageSpaceTracerSettings::default().roulette_from,
            timestamps: None,
        };
        submit(self.gpu, |encoder| match list {
            None => self.bvh_tracer.record(encoder, &mut resources, &inputs),
            Some(list) => self.bvh_tracer.record_listed(encoder, &mut resources, &inputs, list),
        });
    }

    /// The whole walk of two tracers that take turns.
    fn hybrid(&self, env_maps: &EnvMaps, photons: &Photons) {
        let lost = PathList::new(&self.gpu.device, photons).unwrap();
        for number in 1..=photons.bounces() {
            let shared = Some(SharedHop { number, lost: &lost });
            self.image_space(env_maps, photons, shared);
            self.triangles(photons, shared);
        }
    }

    /// What rays hit, asked for one by one.
    fn rays(&self, rays: &[Ray]) -> Vec<RayHit> {
        let list = Rays::new(&self.gpu.device, rays.len() as u32).unwrap();
        list.write(&self.gpu.queue, rays).unwrap();
        let mut resources = BvhTracerResources::new(&self.gpu.device).unwrap();
        let inputs = BvhTracerRayInputs {
            queue: &self.gpu.queue,
            geometry: &self.bvh,
            rays: &list,
            query: RayQuery::Closest,
            timestamps: None,
        };
        submit(self.gpu, |encoder| {
            self.bvh_tracer.record_rays(encoder, &mut resources, &inputs);
        });
        read_buffer_blocking(&self.gpu.device, &self.gpu.queue, list.hits()).unwrap()
    }
}

fn submit(gpu: &Gpu, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    record(&mut encoder);
    gpu.queue.submit([encoder.finish()]);
}

/// Photons of `BOUNCES` bounces whose first hops, all but the last, are given.
fn upload(gpu: &Gpu, paths: usize, hops: &[Photon]) -> Photons {
    let photons = Photons::new(&gpu.device, paths as u32, BOUNCES).unwrap();
    gpu.queue.write_buffer(photons.buffer(), 0, bytemuck::cast_slice(hops));
    photons
}

fn read(gpu: &Gpu, photons: &Photons) -> Vec<Photon> {
    read_buffer_blocking(&gpu.device, &gpu.queue, photons.buffer()).unwrap()
}

/// Workgroups of the indirect dispatch, and the paths.
fn read_list(gpu: &Gpu, lost: &PathList) -> ([u32; 3], Vec<u32>) {
    let words: Vec<u32> = read_buffer_blocking(&gpu.device, &gpu.queue, lost.buffer()).unwrap();
    let end = 4 + words[3] as usize;
    ([words[0], words[1], words[2]], words[4..end].to_vec())
}

/// Paths of one hop that a surer tracer should walk again.
fn unresolved(records: &[Photon], paths: usize, hop: u32) -> Vec<u32> {
    let slots = &records[hop as usize * paths..][..paths];
    (0..)
        .zip(slots)
        .filter(|(_, p)| p.is_unresolved())
        .map(|(i, _)| i)
        .collect()
}

/// Whether two records say the same; in an empty one only the state means anything.
fn agree(a: &Photon, b: &Photon) -> bool {
    a == b || (a.state() == PhotonState::Empty && b.state() == PhotonState::Empty)
}

#[test]
fn hops_walked_one_at_a_time_are_those_of_the_whole_walk_and_lists_hold_what_was_lost_in_order() {
    let Some(gpu) = gpu() else { return };
    for scene in [samples::cornell(0.3), samples::two_rooms(0.3), samples::pillars(0.3)] {
        let world = World::new(&gpu, &scene);
        let first = world.first_hits();
        let whole = upload(&gpu, first.len(), &first);
        world.image_space(world.env_maps(), &whole, None);
        let hops = upload(&gpu, first.len(), &first);
        let lost = PathList::new(&gpu.device, &hops).unwrap();
        let whole = read(&gpu, &whole);
        let mut counts = Vec::new();
        for number in 1..=BOUNCES {
            world.image_space(world.env_maps(), &hops, Some(SharedHop { number, lost: &lost }));
            let (workgroups, paths) = read_list(&gpu, &lost);
            assert_eq!(paths, unresolved(&whole, first.len(), number));
            assert_eq!(workgroups, [paths.len().div_ceil(64) as u32, 1, 1]);
            counts.push(paths.len());
        }
        println!("{counts:?} of {} paths were lost", first.len());
        assert!(counts.iter().all(|&count| count > 0));
        assert!(read(&gpu, &hops) == whole);
        assert_no_errors(&gpu);
    }
}

#[test]
fn what_image_space_loses_continues_with_what_the_triangles_say() {
    let Some(gpu) = gpu() else { return };
    for scene in [samples::cornell(0.3), samples::two_rooms(0.3), samples::pillars(0.3)] {
        let world = World::new(&gpu, &scene);
        let first = world.first_hits();
        let paths = first.len();
        let (alone, both) = (upload(&gpu, paths, &first), upload(&gpu, paths, &first));
        world.image_space(world.env_maps(), &alone, None);
        world.hybrid(world.env_maps(), &both);
        let (alone, both) = (read(&gpu, &alone), read(&gpu, &both));
        let mut compared = 0;
        for hop in 1..=BOUNCES {
            // This hop of all paths, from where image space had come to, along the same directions, against triangles.
            let again = upload(&gpu, paths, &alone[..hop as usize * paths]);
            let lost = PathList::new(&gpu.device, &again).unwrap();
            let shared = Some(SharedHop {
                number: hop,
                lost: &lost,
            });
            world.image_space(&world.no_maps(), &again, shared);
            world.triangles(&again, shared);
            let again = read(&gpu, &again);
            for path in unresolved(&alone, paths, hop) {
                let slot = hop as usize * paths + path as usize;
                // Where an earlier hop was unresolved the two came to different places.
                if (1..hop as usize).any(|h| alone[h * paths + path as usize].is_unresolved()) {
                    continue;
                }
                assert_eq!(both[slot], again[slot], "path {path}, hop {hop}");
                assert!(!both[slot].is_unresolved());
                compared += 1;
            }
        }
        assert!(compared > 50, "{compared} rays were lost");
        // Until a path is lost, and if it never is, it is the same.
        for path in 0..paths {
            for slot in (0..=BOUNCES as usize).map(|hop| hop * paths + path) {
                if alone[slot].is_unresolved() {
                    break;
                }
                assert!(agree(&alone[slot], &both[slot]), "path {path}, slot {slot}");
            }
        }
        assert_no_errors(&gpu);
    }
}

#[test]
fn some_paths_walked_alone_are_those_of_the_whole_walk_and_others_stay() {
    let Some(gpu) = gpu() else { return };
    let world = World::new(&gpu, &samples::pillars(0.3));
    let first = world.first_hits();
    let mut some: Vec<u32> = (0..first.len() as u32)
        .filter(|i| i % 7 == 3 || i.is_multiple_of(11))
        .collect();
    // In no particular order.
    some.reverse();
    let whole = [(); 2].map(|()| upload(&gpu, first.len(), &first));
    let part = [(); 2].map(|()| upload(&gpu, first.len(), &first));
    let list = PathList::new(&gpu.device, &whole[0]).unwrap();
    let groups = some.len().div_ceil(64) as u32;
    let words = [&[groups, 1, 1, some.len() as u32], &some[..]].concat();
    gpu.queue.write_buffer(list.buffer(), 0, bytemuck::cast_slice(&words));
    world.triangles(&whole[0], None);
    world.triangles_part(&part[0], None, Some(&list));
    world.image_space(world.env_maps(), &whole[1], None);
    world.image_space_part(world.env_maps(), &part[1], None, Some(&list));
    for (whole, part) in whole.iter().zip(&part) {
        let (whole, part) = (read(&gpu, whole), read(&gpu, part));
        assert!(whole.iter().filter(|p| p.state() == PhotonState::Stored).count() > 2 * first.len());
        for (slot, (whole, part)) in whole.iter().zip(&part).enumerate().skip(first.len()) {
            let path = (slot % first.len()) as u32;
            match path % 7 == 3 || path.is_multiple_of(11) {
                true => assert!(agree(whole, part), "slot {slot}"),
                false => assert!(*part == bytemuck::Zeroable::zeroed(), "slot {slot}"),
            }
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn where_image_space_sees_nothing_the_triangles_do_all_and_the_list_holds_every_path() {
    let Some(gpu) = gpu() else { return };
    let world = World::new(&gpu, &samples::two_rooms(0.3));
    let first = world.first_hits();
    assert!(first.iter().all(|p| p.state() == PhotonState::Stored), "a closed room");
    let (alone, both) = (upload(&gpu, first.len(), &first), upload(&gpu, first.len(), &first));
    let lost = PathList::new(&gpu.device, &both).unwrap();
    world.image_space(&world.no_maps(), &both, Some(SharedHop { number: 1, lost: &lost }));
    let (workgroups, paths) = read_list(&gpu, &lost);
    assert!(paths.into_iter().eq(0..first.len() as u32));
    assert_eq!(workgroups, [first.len().div_ceil(64) as u32, 1, 1]);
    world.triangles(&alone, None);
    world.hybrid(&world.no_maps(), &both);
    let (alone, both) = (read(&gpu, &alone), read(&gpu, &both));
    assert!(alone.iter().zip(&both).all(|(a, b)| agree(a, b)));
    assert_no_errors(&gpu);
}

/// First hits on an endless floor, stored where `is_stored`, empty elsewhere.
fn floor_hits(count: usize, mut is_stored: impl FnMut(usize) -> bool) -> Vec<Photon> {
    let photon = Photon {
        position: [0.0; 3],
        state: 0,
        flux: [1.0 / count as f32; 3],
        density: 1.0,
        normal: Photon::pack_unit_vector(Vec3::Y),
        direction: Photon::pack_unit_vector(Vec3::NEG_Y),
        reflectance: Photon::pack_reflectance([0.5; 3]),
        light_and_surface: 0,
    };
    let state = |stored| {
        if stored {
            PhotonState::Stored
        } else {
            PhotonState::Empty
        }
    };
    let hit = |i| Photon {
        state: state(is_stored(i)) as u32,
        ..photon
    };
    (0..count).map(hit).collect()
}

#[test]
fn lists_of_any_length_are_in_order() {
    let Some(gpu) = gpu() else { return };
    let world = World::new(&gpu, &samples::plane());
    let mut random = Random(5);
    // Around a block of 64 paths, around the 256 blocks that one round of the sum takes, and beyond.
    for count in [1, 63, 64, 65, 127, 1000, 16_384, 16_385, 70_001] {
        for share in [0.0, 0.02, 0.5, 1.0] {
            let first = floor_hits(count, |_| random.unit() < share);
            let expected: Vec<u32> = (0..)
                .zip(&first)
                .filter(|(_, p)| p.state() == PhotonState::Stored)
                .map(|(i, _)| i)
                .collect();
            let photons = upload(&gpu, count, &first);
            let lost = PathList::new(&gpu.device, &photons).unwrap();
            let shared = Some(SharedHop { number: 1, lost: &lost });
            world.image_space(&world.no_maps(), &photons, shared);
            let (workgroups, paths) = read_list(&gpu, &lost);
            assert!(paths == expected, "{share} of {count}: {paths:?}");
            assert_eq!(workgroups, [expected.len().div_ceil(64) as u32, 1, 1]);
            // All rays leave the floor upwards: each that is listed escapes, no other slot is touched.
            world.triangles(&photons, shared);
            let records = read(&gpu, &photons);
            let escaped = records[count..2 * count].iter().zip(0..);
            let escaped = escaped
                .filter(|(p, _)| p.state() == PhotonState::Escaped)
                .map(|(_, i)| i);
            assert!(escaped.eq(expected), "{share} of {count}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_list_with_less_room_holds_the_paths_that_it_has_room_for() {
    let Some(gpu) = gpu() else { return };
    let world = World::new(&gpu, &samples::plane());
    let photons = upload(&gpu, 1000, &floor_hits(1000, |i| i % 3 == 0));
    let fewer = Photons::new(&gpu.device, 200, 1).unwrap();
    let lost = PathList::new(&gpu.device, &fewer).unwrap();
    let shared = SharedHop { number: 1, lost: &lost };
    world.image_space(&world.no_maps(), &photons, Some(shared));
    let expected: Vec<u32> = (0..200).filter(|i| i % 3 == 0).collect();
    assert_eq!(read_list(&gpu, &lost).1, expected);
    // Hops that there are not are left out.
    let before = read(&gpu, &photons);
    for number in [0, BOUNCES + 1, u32::MAX] {
        world.image_space(&world.no_maps(), &photons, Some(SharedHop { number, ..shared }));
        world.triangles(&photons, Some(SharedHop { number, ..shared }));
    }
    assert!(read(&gpu, &photons) == before);
    assert_no_errors(&gpu);
}

#[test]
fn lists_spread_over_two_dimensions_of_workgroups_are_traced_to_the_end() {
    let Some(gpu) = gpu() else { return };
    let world = World::new(&gpu, &samples::plane());
    let photons = upload(&gpu, 2000, &floor_hits(2000, |_| true));
    let lost = PathList::new(&gpu.device, &photons).unwrap();
    // 7 × 3 workgroups of 64, the last one of them with two paths.
    let paths: Vec<u32> = (0..20 * 64 + 2).map(|i| (i * 7) % 2000).collect();
    let list = [&[7, 3, 1, paths.len() as u32], &paths[..]].concat();
    gpu.queue.write_buffer(lost.buffer(), 0, bytemuck::cast_slice(&list));
    world.triangles(&photons, Some(SharedHop { number: 1, lost: &lost }));
    for (path, photon) in (0..).zip(&read(&gpu, &photons)[2000..4000]) {
        assert_eq!(photon.state() == PhotonState::Escaped, paths.contains(&path), "{path}");
    }
    assert_no_errors(&gpu);
}

/// 64 ulps of the largest coordinate, or of a quarter, along the normal: `bvh_offset`.
fn offset(position: Vec3, normal: Vec3) -> Vec3 {
    let reach = position.abs().max_element().max(0.25);
    let ulp = f32::from_bits(reach.to_bits() & 0x7f80_0000) * f32::EPSILON;
    position + 64.0 * ulp * normal
}

#[test]
fn photons_land_where_rays_do_on_the_side_that_they_come_to() {
    let Some(gpu) = gpu() else { return };
    // The canopy is met from behind.
    for scene in [samples::cornell(0.3), samples::pillars(0.3), floor_under_canopy(0.8)] {
        let world = World::new(&gpu, &scene);
        let first = world.first_hits();
        let photons = upload(&gpu, first.len(), &first);
        world.triangles(&photons, None);
        let records = read(&gpu, &photons);
        let paths = first.len();
        let (mut rays, mut expected) = (Vec::new(), Vec::new());
        for slot in paths..4 * paths {
            let (from, to) = (&records[slot - paths], &records[slot]);
            if to.state() == PhotonState::Empty {
                continue;
            }
            assert!(!to.is_unresolved());
            let origin = offset(Vec3::from(from.position), Photon::unpack_unit_vector(from.normal));
            let stored = to.state() == PhotonState::Stored;
            let travelled = Photon::unpack_unit_vector(to.direction);
            let way = Vec3::from(to.position) - origin;
            if stored {
                // Packed directions are good to 2.5 / 65534 of the octahedron, which comes within 1/√3 of its middle.
                assert!((way.normalize() - travelled).length() < 1e-4 + 1e-6 / way.length());
                assert!(
                    Photon::unpack_unit_vector(to.normal).dot(travelled) < 1e-4,
                    "it faces where the ray came from"
                );
                assert!(to.density.is_finite() && to.density >= 0.0);
            }
            rays.push(Ray {
                origin: origin.to_array(),
                furthest: Ray::FURTHEST,
                direction: if stored { way.normalize() } else { travelled }.to_array(),
                mask: Ray::IN_ENV_MAPS,
            });
            expected.push(stored.then(|| way.length()));
        }
        let hits = world.rays(&rays);
        let agrees = |(hit, expected): (&RayHit, &Option<f32>)| match expected {
            Some(distance) => hit.is_hit() && (hit.distance - distance).abs() < 1e-5,
            None => !hit.is_hit(),
        };
        let differ = hits.iter().zip(&expected).filter(|&pair| !agrees(pair)).count();
        println!("{differ} of {} rays differ", rays.len());
        // Directions are known from records alone, so that a ray past an edge may miss it.
        assert!(differ * 1000 < rays.len(), "{differ} of {}", rays.len());
        assert_no_errors(&gpu);
    }
}

#[test]
fn triangles_lose_no_light_alone_nor_where_image_space_does() {
    let Some(gpu) = gpu() else { return };
    for name in ["cornell", "cornell-spot", "plane", "two-rooms", "pillars", "penumbra"] {
        let scene = samples::by_name(name, 0.6).unwrap();
        let (mut lost, mut escaped) = (Vec::new(), Vec::new());
        for kind in [TracerKind::ImageSpace, TracerKind::Bvh, TracerKind::Hybrid] {
            let mut offline = Offline::new(&gpu, scene.clone(), &settings(kind), 0, [4, 4], Component::All).unwrap();
            offline.render_frame(None).unwrap();
            let hops = offline.statistics().unwrap();
            let (mut stays, mut gone) = (0.0, 0.0);
            for (number, hop) in hops.iter().enumerate() {
                for c in 0..3 {
                    gone += f64::from(hop.escaped[c] + hop.lost[c]);
                    stays += f64::from(hop.absorbed[c]);
                    // What a hop leaves, the next carries.
                    if let Some(next) = hops.get(number + 1) {
                        let passed_on = hop.stored[c] - hop.absorbed[c];
                        assert!(
                            (next.emitted[c] - passed_on).abs() <= 1e-4 * passed_on,
                            "{name} {kind:?} {number}"
                        );
                    }
                }
            }
            let last = &hops[BOUNCES as usize];
            let goes_on: f64 = (0..3).map(|c| f64::from(last.stored[c] - last.absorbed[c])).sum();
            let emitted: f64 = hops[0].emitted.iter().map(|&v| f64::from(v)).sum();
            let sum = stays + gone + goes_on;
            assert!(
                (sum / emitted - 1.0).abs() < 1e-4,
                "{name} {kind:?}: {sum} of {emitted}"
            );
            let share =
                |of: fn(&HopStatistics) -> [f32; 3]| hops.iter().flat_map(of).map(f64::from).sum::<f64>() / emitted;
            lost.push(share(|h| h.lost));
            escaped.push(share(|h| h.escaped));
        }
        println!("{name}: lost of the light {lost:?}, escaped {escaped:?}");
        assert_eq!(lost[1..], [0.0, 0.0], "{name}");
        if ["two-rooms", "pillars"].contains(&name) {
            // Closed rooms. A first hit in a corner may lie half a texel of the shadow map beyond the other wall; a path
            // that image space has led, half a texel of an environment map.
            assert!(escaped[1] < 1e-3, "{name}");
            assert!(
                escaped[2] < 0.25 * lost[0],
                "{name}: most of what was lost is found inside"
            );
        }
    }
    assert_no_errors(&gpu);
}

/// A floor with a picture of four colours, a lamp above it, and a canopy of `canopy` reflectance above both.
fn floor_under_canopy(canopy: f32) -> Scene {
    let quad = |name: &str, y: f32, half: f32| Mesh {
        name: name.into(),
        positions: vec![[-half, y, half], [half, y, half], [half, y, -half], [-half, y, -half]],
        tex_coords: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Default::default()
    };
    let mut scene = samples::plane();
    scene.meshes = vec![quad("floor", 0.0, 1.0), quad("canopy", 1.0, 1.0)];
    let quarter = |texel: u32| match (texel % 32 < 16, texel / 32 < 16) {
        (true, true) => [255, 0, 0, 255],
        (false, true) => [0, 255, 0, 255],
        (true, false) => [0, 0, 255, 255],
        (false, false) => [255; 4],
    };
    scene.textures = vec![Texture {
        name: "four colours".into(),
        width: 32,
        height: 32,
        srgb: false,
        rgba: (0..32 * 32).flat_map(quarter).collect(),
    }];
    scene.materials = vec![
        Material {
            base_color_texture: Some(0),
            ..Material::diffuse("picture", [1.0, 0.5, 0.25])
        },
        Material::diffuse("canopy", [canopy; 3]),
    ];
    let mut instance = scene.instances[0].clone();
    instance.transform = DAffine3::IDENTITY;
    scene.instances = (0..2)
        .map(|i| lightfall::scene::Instance {
            mesh: i,
            material: i,
            ..instance.clone()
        })
        .collect();
    scene.lights = vec![Light::point(DVec3::new(0.0, 0.5, 0.0), 1.0, [1.0; 3])];
    scene
}

#[test]
fn photons_take_the_colour_of_the_texture_where_they_land() {
    let Some(gpu) = gpu() else { return };
    let world = World::new(&gpu, &floor_under_canopy(0.8));
    let first = world.first_hits();
    let photons = upload(&gpu, first.len(), &first);
    world.triangles(&photons, None);
    let records = read(&gpu, &photons);
    let frame = *world.offline.renderer.frame().unwrap();
    let mut seen = [0; 4];
    for photon in records[first.len()..]
        .iter()
        .filter(|p| p.state() == PhotonState::Stored)
    {
        let at = frame.world_point(Vec3::from(photon.position));
        if at.y > 0.5 {
            for channel in photon.reflectance() {
                assert!((channel - 0.8).abs() < 1e-3);
            }
            continue;
        }
        // Texture coordinate (0, 0) lies at (-1, 0, 1). Within half a texel of a border two colours blend.
        let uv = [0.5 + 0.5 * at.x, 0.5 - 0.5 * at.z];
        if uv.iter().any(|u| (2.0 * u - (2.0 * u).round()).abs() < 1.0 / 32.0) {
            continue;
        }
        let texel = usize::from(uv[0] > 0.5) + 2 * usize::from(uv[1] > 0.5);
        let expected = [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.25], [1.0, 0.5, 0.25]][texel];
        for (found, expected) in photon.reflectance().into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-3, "{uv:?}: {:?}", photon.reflectance());
        }
        seen[texel] += 1;
    }
    println!("{seen:?} photons on each texel");
    assert!(seen.iter().all(|&n| n > 20), "{seen:?}");
    assert_no_errors(&gpu);
}

#[test]
fn what_environment_maps_do_not_see_photons_pass_whatever_the_tracer() {
    let Some(gpu) = gpu() else { return };
    let mut scene = floor_under_canopy(0.8);
    scene.instances[1].in_env_maps = false;
    for kind in [TracerKind::ImageSpace, TracerKind::Bvh, TracerKind::Hybrid] {
        let mut offline = Offline::new(&gpu, scene.clone(), &settings(kind), 0, [4, 4], Component::All).unwrap();
        offline.render_frame(None).unwrap();
        let frame = *offline.renderer.frame().unwrap();
        let paths = settings(kind).photons as usize;
        let records = read(&gpu, offline.renderer.photons().unwrap());
        let is_on_canopy =
            |p: &&Photon| p.state() == PhotonState::Stored && frame.world_point(Vec3::from(p.position)).y > 0.5;
        let first = records[..paths].iter().filter(is_on_canopy).count();
        let later = records[paths..].iter().filter(is_on_canopy).count();
        println!("{kind:?}: {first} first hits on the canopy, {later} later ones");
        assert!(first > 1000, "its shadow is cast");
        assert_eq!(later, 0);
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_moved_block_is_met_where_it_went() {
    let Some(gpu) = gpu() else { return };
    let show = |offline: &mut Offline<'_>| {
        offline.render_frame(None).unwrap();
        read(&gpu, offline.renderer.photons().unwrap())
    };
    let settings = settings(TracerKind::Bvh);
    let new = |time| Offline::new(&gpu, samples::cornell(time), &settings, 0, [4, 4], Component::All).unwrap();
    let mut moving = new(0.0);
    let before = show(&mut moving);
    moving.set_scene(samples::cornell(1.0)).unwrap();
    let after = show(&mut moving);
    let there = show(&mut new(1.0));
    let all_agree = |a: &[Photon], b: &[Photon]| a.iter().zip(b).all(|(a, b)| agree(a, b));
    assert!(!all_agree(&before, &after));
    assert!(all_agree(&after, &there));
    assert_no_errors(&gpu);
}
