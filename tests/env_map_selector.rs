//! Where environment maps are taken from: areas against arithmetic, coverage against exact visibility, and a selection
//! that arrives without anybody waiting for it.

mod common;

use bytemuck::Zeroable;
use common::meshes::room;
use common::statistics::Random;
use common::{Gpu, assert_no_errors, gpu};
use lightfall::frame::{GiRenderer, SceneInputs, Settings, ViewInputs, ViewResources};
use lightfall::glam::{DAffine3, DVec2, DVec3, Vec3};
use lightfall::pass::{
    CompositeSettings, CoverageMeasure, EnvMapSelector, EnvMapSelectorResources, EnvMapSelectorSettings,
    SelectBlockingInputs, Selection, Sight,
};
use lightfall::resource::cube_face::CUBE_FACES;
use lightfall::resource::{CameraView, MeshGeometry, Photon, PhotonState, Photons};
use lightfall::scene::{Instance, Light, LightKind, Mesh, Scene, SceneSummary, UnitFrame, samples};
use lightfall::{creation_count, read_rgba32float_blocking, wgpu};

/// Texels along a face of a candidate's map.
const SIZE: u32 = 32;

/// A scene, ready for selections among candidates of the test's choice.
struct Bench<'a> {
    gpu: &'a Gpu,
    geometry: MeshGeometry,
    selector: EnvMapSelector,
    frame: UnitFrame,
    summary: SceneSummary,
}

impl<'a> Bench<'a> {
    fn new(gpu: &'a Gpu, scene: &Scene) -> Self {
        let summary = SceneSummary::of(scene).unwrap();
        Self {
            gpu,
            geometry: MeshGeometry::new(&gpu.device, &gpu.queue, scene).unwrap(),
            selector: EnvMapSelector::new(&gpu.device),
            frame: UnitFrame::new(&summary.bounds, 1.0).unwrap(),
            summary,
        }
    }

    /// Candidates as the renderer spreads them, unit frame.
    fn candidates(&self, count: u32) -> Vec<Vec3> {
        let (min, max) = (self.summary.bounds.min, self.summary.bounds.max);
        EnvMapSelector::candidates(self.frame.point(min), self.frame.point(max), count)
    }

    fn select(
        &mut self,
        candidates: &[Vec3],
        limit: u32,
        settings: &EnvMapSelectorSettings,
    ) -> (Selection, Vec<Sight>) {
        let mut resources = EnvMapSelectorResources::new(&self.gpu.device, candidates.len() as u32).unwrap();
        self.select_into(&mut resources, candidates, limit, settings)
    }

    /// By what these photons reach, and what is seen from there.
    fn select_by(&mut self, photons: &Photons, candidates: &[Vec3], limit: u32) -> Selection {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let mut resources = EnvMapSelectorResources::new(device, candidates.len() as u32).unwrap();
        resources.set_candidates(queue, candidates).unwrap();
        let inputs = SelectBlockingInputs {
            queue,
            frame: &self.frame,
            limit,
            tag: 1,
            photons: Some(photons),
            settings: &EnvMapSelectorSettings::default(),
        };
        self.selector
            .select_blocking(&mut resources, &inputs, &mut self.geometry)
            .unwrap()
    }

    fn select_into(
        &mut self,
        resources: &mut EnvMapSelectorResources,
        candidates: &[Vec3],
        limit: u32,
        settings: &EnvMapSelectorSettings,
    ) -> (Selection, Vec<Sight>) {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        resources.set_candidates(queue, candidates).unwrap();
        let inputs = SelectBlockingInputs {
            queue,
            frame: &self.frame,
            limit,
            tag: 1,
            photons: None,
            settings,
        };
        let selection = self
            .selector
            .select_blocking(resources, &inputs, &mut self.geometry)
            .unwrap();
        let sights = resources.sights_blocking(device, queue).unwrap();
        (selection, sights)
    }
}

/// As many maps as asked for, whatever they see.
fn insatiable() -> EnvMapSelectorSettings {
    EnvMapSelectorSettings {
        coverage_target: 1.0,
        ..Default::default()
    }
}

/// Eq. 1 for a texel whose ray has this direction, in f64, with the floor of 1/32 under the cosine at which it sees its
/// surface.
fn texel_area(d: DVec3, forward: DVec3, distance: f64, normal: DVec3) -> f64 {
    let n = f64::from(SIZE);
    4.0 / (n * n) * distance.powi(2) * d.dot(forward).powi(3) / (-d.dot(normal)).max(1.0 / n)
}

/// Face, row, column, direction and forward axis of all texels of a map.
fn texel_rays() -> impl Iterator<Item = ([u32; 3], DVec3, DVec3)> {
    let n = f64::from(SIZE);
    (0..6 * SIZE * SIZE).map(move |i| {
        let [face, y, x] = [i / (SIZE * SIZE), i / SIZE % SIZE, i % SIZE];
        let axes = CUBE_FACES[face as usize];
        let [forward, right, up] = [axes.forward, axes.right, axes.up].map(|a| a.as_dvec3());
        let s = 2.0 * (f64::from(x) + 0.5) / n - 1.0;
        let t = 1.0 - 2.0 * (f64::from(y) + 0.5) / n;
        ([face, y, x], (forward + s * right + t * up).normalize(), forward)
    })
}

/// The area that a map at `v` sees in a box around the origin if its texels hold the surfaces that their rays meet.
fn area_by_rays(v: DVec3, half: DVec3) -> f64 {
    texel_rays()
        .map(|(_, d, forward)| {
            let (axis, distance) = (0..3)
                .map(|a| (a, (half[a].copysign(d[a]) - v[a]) / d[a]))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap();
            texel_area(d, forward, distance, -DVec3::AXES[axis] * d[axis].signum())
        })
        .sum()
}

/// The same sum over what was captured: the texels of a candidate, read back.
fn area_by_texels(atlas: &[[u32; 4]], width: u32, candidate: u32) -> f64 {
    let columns = width / SIZE;
    texel_rays()
        .map(|([face, y, x], d, forward)| {
            let tile = 6 * candidate + face;
            let at = ((tile / columns * SIZE + y) * width + tile % columns * SIZE + x) as usize;
            let [distance, normal, _, _] = atlas[at];
            // Octahedral, 16 bits a coordinate.
            let [a, b] = [normal, normal >> 16].map(|bits| (f64::from(bits as u16 as i16) / 32767.0).max(-1.0));
            let z = 1.0 - a.abs() - b.abs();
            let folded = |p: f64, other: f64| (1.0 - other.abs()).copysign(p);
            let (x, y) = if z < 0.0 { (folded(a, b), folded(b, a)) } else { (a, b) };
            let distance = f64::from(f32::from_bits(distance));
            texel_area(d, forward, distance, DVec3::new(x, y, z).normalize())
        })
        .sum()
}

/// All texels of the atlas, row by row.
fn read_atlas(gpu: &Gpu, texture: &wgpu::Texture) -> Vec<[u32; 4]> {
    let size = texture.size();
    // Its width is a multiple of 32 texels of 16 bytes, and so of the 256 bytes that rows are aligned to.
    let row = 16 * size.width;
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("atlas"),
        size: u64::from(row) * u64::from(size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(row),
        rows_per_image: None,
    };
    let target = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout,
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, size);
    gpu.queue.submit([encoder.finish()]);
    lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, &buffer).unwrap()
}

#[test]
fn a_candidate_sees_the_area_of_the_room_it_stands_in() {
    let Some(gpu) = gpu() else { return };
    for half in [DVec3::ONE, DVec3::new(4.0, 1.0, 1.0)] {
        let mut bench = Bench::new(&gpu, &room(half));
        let half_unit = half / bench.frame.length_scale();
        let mut random = Random(7);
        let mut inside = |_| {
            let share = DVec3::from_array([(); 3].map(|()| 0.95 * (2.0 * f64::from(random.unit()) - 1.0)));
            (share * half_unit).as_vec3()
        };
        let mut candidates = vec![Vec3::ZERO];
        candidates.extend((0..100).map(&mut inside));
        let mut resources = EnvMapSelectorResources::new(&gpu.device, candidates.len() as u32).unwrap();
        let (_, sights) = bench.select_into(&mut resources, &candidates, 1, &insatiable());
        let area = 8.0 * (half_unit.x * half_unit.y + half_unit.y * half_unit.z + half_unit.z * half_unit.x);
        let sums: Vec<f64> = sights.iter().map(|s| f64::from(s.area)).collect();
        let sorted = |mut errors: Vec<f64>| {
            errors.sort_by(f64::total_cmp);
            errors
        };
        println!("{half}: at the centre {:.3} % off", 100.0 * (sums[0] / area - 1.0));
        assert!((sums[0] / area - 1.0).abs() < 0.03);
        let errors = sorted(sums[1..].iter().map(|s| (s / area - 1.0).abs()).collect());
        let rays = (1..=100).map(|i| area_by_rays(candidates[i].as_dvec3(), half_unit));
        let by_rays = sorted(rays.map(|s| (s / area - 1.0).abs()).collect());
        println!(
            "{half}: of 100 random places median {:.1} %, 95th percentile {:.1} % (exact rays: {:.1} %, {:.1} %)",
            100.0 * errors[50],
            100.0 * errors[95],
            100.0 * by_rays[50],
            100.0 * by_rays[95]
        );
        let texture = resources.atlas().texture();
        let atlas = read_atlas(&gpu, texture);
        assert!(sums.iter().all(|s| s.is_finite()));
        let off_twin = (0..)
            .zip(&sums)
            .map(|(i, s)| (s / area_by_texels(&atlas, texture.width(), i) - 1.0).abs())
            .fold(0.0, f64::max);
        println!(
            "{half}: largest difference from the sum in f64 {:.5} %",
            100.0 * off_twin
        );
        assert!(off_twin < 1e-3);
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_convex_room_needs_one_map() {
    let Some(gpu) = gpu() else { return };
    let settings = EnvMapSelectorSettings::default();
    for (name, scene) in [
        ("cube", room(DVec3::ONE)),
        ("4:1:1 box", room(DVec3::new(4.0, 1.0, 1.0))),
        ("sphere", samples::furnace(0.5, 1.0)),
    ] {
        let mut bench = Bench::new(&gpu, &scene);
        let candidates = bench.candidates(40);
        let (selection, _) = bench.select(&candidates, 8, &settings);
        println!(
            "{name}: {} map(s), coverage {:.4}",
            selection.centers.len(),
            selection.coverage
        );
        assert_eq!(selection.centers.len(), 1, "{name}");
        assert!(selection.coverage >= settings.coverage_target, "{name}");
    }
    assert_no_errors(&gpu);
}

/// Exact visibility: a scene's triangles, world space, f64.
struct Triangles(Vec<[DVec3; 3]>);

impl Triangles {
    fn of(scene: &Scene) -> Self {
        let mut all = Vec::new();
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh];
            let at = |i: u32| {
                let p = Vec3::from(mesh.positions[i as usize]).as_dvec3();
                instance.transform.transform_point3(p)
            };
            all.extend(mesh.indices.chunks_exact(3).map(|t| [at(t[0]), at(t[1]), at(t[2])]));
        }
        Self(all)
    }

    /// Points spread evenly by area, with their normals.
    fn samples(&self, count: usize, random: &mut Random) -> Vec<(DVec3, DVec3)> {
        let area = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).length();
        let total: f64 = self.0.iter().map(area).sum();
        (0..count)
            .map(|i| {
                let mut at = (i as f64 + f64::from(random.unit())) / count as f64 * total;
                let t = self.0.iter().find(|t| {
                    at -= area(t);
                    at <= 0.0
                });
                let [a, b, c] = *t.unwrap_or(&self.0[0]);
                let (mut u, mut v) = (f64::from(random.unit()), f64::from(random.unit()));
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                (a + u * (b - a) + v * (c - a), (b - a).cross(c - a).normalize())
            })
            .collect()
    }

    /// Whether the front of the surface at p is seen from `eye`.
    fn sees(&self, eye: DVec3, p: DVec3, normal: DVec3) -> bool {
        let to_p = p - eye;
        if normal.dot(to_p) >= 0.0 {
            return false;
        }
        // Moeller and Trumbore; what lies within a millionth of the ends does not count.
        !self.0.iter().any(|[a, b, c]| {
            let (e1, e2) = (b - a, c - a);
            let h = to_p.cross(e2);
            let determinant = e1.dot(h);
            if determinant.abs() < 1e-12 {
                return false;
            }
            let s = eye - a;
            let u = s.dot(h) / determinant;
            let q = s.cross(e1);
            let v = to_p.dot(q) / determinant;
            let t = e2.dot(q) / determinant;
            u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 1e-6 && t < 1.0 - 1e-6
        })
    }
}

/// Share of the samples in `visible` (by candidate, by sample) that a set of candidates sees.
fn covered(visible: &[Vec<bool>], set: &[usize]) -> f64 {
    let count = visible[0].len();
    let seen = (0..count).filter(|&s| set.iter().any(|&c| visible[c][s])).count();
    seen as f64 / count as f64
}

#[test]
fn greedy_selection_sees_more_than_chance() {
    let Some(gpu) = gpu() else { return };
    for name in ["cornell", "two-rooms", "pillars"] {
        let scene = samples::by_name(name, 0.0).unwrap();
        let mut bench = Bench::new(&gpu, &scene);
        let candidates = bench.candidates(40);
        let (_, sights) = bench.select(&candidates, 1, &insatiable());
        let valid: Vec<usize> = (0..candidates.len()).filter(|&c| sights[c].is_valid).collect();
        let triangles = Triangles::of(&scene);
        let mut random = Random(11);
        let eyes: Vec<DVec3> = candidates.iter().map(|&c| bench.frame.world_point(c)).collect();
        // Of what can be seen at all: points that some valid candidate sees.
        let mut points = triangles.samples(4000, &mut random);
        points.retain(|&(p, n)| valid.iter().any(|&c| triangles.sees(eyes[c], p, n)));
        let visible: Vec<Vec<bool>> = eyes
            .iter()
            .map(|&eye| points.iter().map(|&(p, n)| triangles.sees(eye, p, n)).collect())
            .collect();
        for k in [4, 8] {
            let (selection, _) = bench.select(&candidates, k, &insatiable());
            assert!((1..=k as usize).contains(&selection.candidates.len()));
            let ours = covered(&visible, &selection.candidates);
            let chance: Vec<f64> = (0..200)
                .map(|_| {
                    let mut left = valid.clone();
                    let set: Vec<usize> = (0..k)
                        .map(|_| left.swap_remove(random.bits() as usize % left.len()))
                        .collect();
                    covered(&visible, &set)
                })
                .collect();
            let mean = chance.iter().sum::<f64>() / chance.len() as f64;
            let better = chance.iter().filter(|&&c| c > ours).count() as f64 / chance.len() as f64;
            println!(
                "{name}, {} valid, k = {k}: {} maps see {:.2} % of what can be seen (estimated {:.2} %), chance {:.2} % on \
                 average; {:.1} % of 200 random sets see more; {} swap(s)",
                valid.len(),
                selection.candidates.len(),
                100.0 * ours,
                100.0 * selection.coverage,
                100.0 * mean,
                100.0 * better,
                selection.swaps
            );
            assert!(ours > mean, "{name}, k = {k}");
        }
    }
    assert_no_errors(&gpu);
}

/// Photons that arrived at these points, world space, with their normals.
fn photons_at(gpu: &Gpu, frame: &UnitFrame, points: &[(DVec3, DVec3)]) -> Photons {
    let records: Vec<Photon> = points
        .iter()
        .map(|&(p, n)| Photon {
            position: frame.point(p).to_array(),
            state: PhotonState::Stored as u32,
            normal: Photon::pack_unit_vector(n.as_vec3()),
            ..Zeroable::zeroed()
        })
        .collect();
    let photons = Photons::new(&gpu.device, records.len() as u32, 0).unwrap();
    gpu.queue
        .write_buffer(photons.buffer(), 0, bytemuck::cast_slice(&records));
    photons
}

/// Photons reach only what maps see, so a place that no map sees looks dark: it gets a map all the same.
#[test]
fn what_no_photon_reaches_is_seen_too_if_it_lies_where_light_is() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let mut bench = Bench::new(&gpu, &scene);
    let candidates = bench.candidates(100);
    let triangles = Triangles::of(&scene);
    let points = triangles.samples(60_000, &mut Random(5));
    #[expect(clippy::approx_constant, reason = "a corner that was measured so")]
    let walls: [[[f64; 2]; 4]; 2] = [
        [[1.30, 0.65], [0.82, 2.25], [2.40, 2.72], [2.90, 1.14]],
        [[4.23, 2.47], [2.65, 2.96], [3.14, 4.56], [4.72, 4.06]],
    ];
    for (block, face) in (0..8).map(|i| (i / 4, i % 4)) {
        let [a, b] = [0, 1].map(|k| DVec2::from(walls[block][(face + k) % 4]));
        let side = (b - a).perp().normalize();
        let is_dark = |&&(p, n): &&(DVec3, DVec3)| {
            let (p, n) = (DVec2::new(p.x, p.z), DVec2::new(n.x, n.z));
            (p - a).dot(side).abs() < 1e-3 && n.dot(side).abs() > 0.999
        };
        let dark: Vec<_> = points.iter().filter(is_dark).copied().collect();
        let lit: Vec<_> = points.iter().filter(|p| !is_dark(p)).copied().collect();
        assert!(dark.len() > 300, "block {block}, face {face}: {} points", dark.len());
        let photons = photons_at(&gpu, &bench.frame, &lit);
        let selection = bench.select_by(&photons, &candidates, 3);
        let eyes: Vec<DVec3> = selection.centers.iter().map(|&c| bench.frame.world_point(c)).collect();
        let seen = dark
            .iter()
            .filter(|&&(p, n)| eyes.iter().any(|&eye| triangles.sees(eye, p, n)));
        let share = seen.count() as f64 / dark.len() as f64;
        println!(
            "block {block}, face {face} dark: {} maps see {:.1} % of it",
            eyes.len(),
            100.0 * share
        );
        assert!(share > 0.9);
    }
    assert_no_errors(&gpu);
}

#[test]
fn maps_stop_being_added_where_enough_is_seen() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, &samples::pillars(0.0));
    let candidates = bench.candidates(40);
    let mut last = 0;
    for target in [0.3, 0.6, 0.8, 0.95] {
        let settings = EnvMapSelectorSettings {
            coverage_target: target,
            ..insatiable()
        };
        let (selection, _) = bench.select(&candidates, 31, &settings);
        println!(
            "target {target}: {} maps, {:.4}",
            selection.centers.len(),
            selection.coverage
        );
        assert!(selection.coverage >= target);
        assert!(selection.centers.len() >= last);
        last = selection.centers.len();
    }
    assert!(last > 2 && last < 31);
    assert_eq!(bench.select(&candidates, 31, &insatiable()).0.centers.len(), 31);
    assert_no_errors(&gpu);
}

#[test]
fn invalid_candidates_are_passed_over_and_a_scene_of_backs_still_gets_maps() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let mut bench = Bench::new(&gpu, &scene);
    let at = |bench: &Bench<'_>, x, y, z| bench.frame.point(DVec3::new(x, y, z));
    let candidates = [
        at(&bench, 3.7, 1.5, 3.5),   // in the tall block
        at(&bench, 2.78, 2.7, 2.0),  // free
        at(&bench, 1.8, 0.8, 1.7),   // in the short block
        at(&bench, 2.78, 2.7, 5.58), // at the back wall
        at(&bench, 1.0, 4.0, 4.0),   // free
    ];
    let (selection, sights) = bench.select(&candidates, 5, &insatiable());
    let valid: Vec<bool> = sights.iter().map(|s| s.is_valid).collect();
    assert_eq!(valid, [false, true, false, false, true]);
    let mut chosen = selection.candidates.clone();
    chosen.sort_unstable();
    assert_eq!(chosen, [1, 4]);
    assert!(sights[0].back_faces > 0.5 && sights[1].back_faces < 0.2);
    // A closed box around every candidate, all of its faces turned away.
    let mut inside_out = room(DVec3::ONE);
    for triangle in inside_out.meshes[0].indices.chunks_exact_mut(3) {
        triangle.swap(0, 1);
    }
    let mut bench = Bench::new(&gpu, &inside_out);
    let candidates = bench.candidates(12);
    for settings in [insatiable(), EnvMapSelectorSettings::default()] {
        let (selection, sights) = bench.select(&candidates, 4, &settings);
        assert!(sights.iter().all(|s| s.back_faces > 0.99 && s.area == 0.0));
        assert_eq!(selection.centers.len(), 4);
        assert_eq!(selection.coverage, 0.0);
    }
    assert_no_errors(&gpu);
}

/// Frames alike after which a selection counts as at rest.
const AT_REST: u32 = 12;

/// A renderer and what it draws, frame after frame, without ever waiting on its own.
struct Host<'a> {
    gpu: &'a Gpu,
    scene: Scene,
    geometry: MeshGeometry,
    renderer: GiRenderer,
    view: ViewResources,
}

impl<'a> Host<'a> {
    fn new(gpu: &'a Gpu, scene: Scene) -> Self {
        Self::by(gpu, scene, CoverageMeasure::Area, 8)
    }

    fn by(gpu: &'a Gpu, scene: Scene, measure: CoverageMeasure, env_map_count: u32) -> Self {
        let settings = Settings {
            photons: 3000,
            env_map_count,
            env_map_size: 32,
            shadow_map_size: 64,
            selector: EnvMapSelectorSettings {
                candidates: 40,
                coverage_target: 0.999,
                measure,
                ..Default::default()
            },
            ..Settings::balanced()
        };
        let renderer = GiRenderer::new(&gpu.device, &settings).unwrap();
        Self {
            gpu,
            geometry: MeshGeometry::new(&gpu.device, &gpu.queue, &scene).unwrap(),
            view: renderer.new_view([24, 24]).unwrap(),
            renderer,
            scene,
        }
    }

    fn frame(&mut self) {
        let encoder = self.record();
        self.gpu.queue.submit([encoder.finish()]);
        // The host's own, once a frame, as engines do; it does not wait.
        self.gpu.device.poll(wgpu::PollType::Poll).unwrap();
    }

    fn record(&mut self) -> wgpu::CommandEncoder {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let summary = SceneSummary::of(&self.scene).unwrap();
        let frame = self.renderer.set_scene(queue, &summary, &self.scene.lights).unwrap();
        let mut cameras = [CameraView::new(&frame, &self.scene.cameras[0], [24, 24], [0.0; 2])];
        self.renderer.prepare(queue, &mut self.geometry, &mut cameras).unwrap();
        let mut encoder = device.create_command_encoder(&Default::default());
        let scene_inputs = SceneInputs {
            queue,
            geometry: &self.geometry,
            bvh: None,
            sample_offset: 0,
            timestamps: None,
        };
        self.renderer.record_scene(&mut encoder, &scene_inputs).unwrap();
        let view_inputs = ViewInputs {
            queue,
            geometry: &self.geometry,
            bvh: None,
            view: &cameras[0],
            accumulated: 0,
            composite: &CompositeSettings::default(),
            timestamps: None,
        };
        self.renderer
            .record_view(&mut encoder, &mut self.view, &view_inputs)
            .unwrap();
        encoder
    }

    fn move_instance(&mut self, instance: usize, transform: DAffine3) {
        self.scene.instances[instance].transform = transform;
        self.geometry.set_transform(instance, transform).unwrap();
        self.renderer.geometry_changed();
    }

    /// Maps and coverage of a selection made at once of the scene as it is now.
    fn selected_anew(&self) -> (usize, f32) {
        let mut other = Host::new(self.gpu, self.scene.clone());
        let summary = SceneSummary::of(&self.scene).unwrap();
        other
            .renderer
            .set_scene(&self.gpu.queue, &summary, &self.scene.lights)
            .unwrap();
        other
            .renderer
            .place_env_maps_blocking(&self.gpu.queue, &mut other.geometry)
            .unwrap();
        (other.centers().len(), other.renderer.env_map_coverage().unwrap())
    }

    fn selected(&self) -> (usize, f32) {
        (self.centers().len(), self.renderer.env_map_coverage().unwrap())
    }

    /// Frames until the selection is at rest: no frame records a pass of it any more. How many that took.
    fn settle(&mut self) -> u32 {
        let (mut frames, mut last, mut alike) = (0, 0, 0);
        // A round takes five frames, its last one a pass more; twelve frames alike are two rounds in which none was drawn.
        while alike < AT_REST {
            let before = creation_count().passes;
            self.frame();
            // Time for the GPU, so that results arrive as on a machine whose frames last.
            std::thread::sleep(std::time::Duration::from_millis(5));
            let passes = creation_count().passes - before;
            alike = if passes == last { alike + 1 } else { 0 };
            last = passes;
            frames += 1;
            assert!(frames < 500, "the selection does not come to rest");
        }
        frames - AT_REST
    }

    fn centers(&self) -> Vec<DVec3> {
        let frame = *self.renderer.frame().unwrap();
        let maps = self.renderer.env_maps().unwrap();
        maps.centers().iter().map(|&c| frame.world_point(c)).collect()
    }

    fn image(&self) -> Vec<[f32; 4]> {
        let texture = self.view.radiance().view().texture();
        read_rgba32float_blocking(&self.gpu.device, &self.gpu.queue, texture).unwrap()
    }
}

#[test]
fn a_selection_arrives_without_a_wait_and_then_the_same_frame_has_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let mut host = Host::new(&gpu, scene.clone());
    let before = creation_count();
    host.frame();
    let provisional = host.centers();
    assert!(
        host.renderer.env_map_coverage().is_none(),
        "nothing can have arrived yet"
    );
    let frames = host.settle();
    let after = creation_count();
    println!("at rest after {frames} frames");
    assert_eq!(after.waits, before.waits, "the crate waited for the GPU");
    assert_ne!(host.centers(), provisional);
    assert!(host.renderer.env_map_coverage().unwrap() > 0.5);
    // The same as when somebody waits for it.
    let mut waiting = Host::new(&gpu, scene.clone());
    let summary = SceneSummary::of(&scene).unwrap();
    waiting.renderer.set_scene(&gpu.queue, &summary, &scene.lights).unwrap();
    waiting
        .renderer
        .place_env_maps_blocking(&gpu.queue, &mut waiting.geometry)
        .unwrap();
    assert!(creation_count().waits > after.waits, "and that is counted");
    assert_eq!(waiting.centers(), host.centers());
    host.frame();
    let image = host.image();
    host.frame();
    assert!(image.iter().flatten().any(|&v| v > 0.0));
    assert!(host.image() == image);
    assert_no_errors(&gpu);
}

#[test]
fn until_a_selection_arrives_maps_inside_solids_are_switched_off() {
    let Some(gpu) = gpu() else { return };
    // The first candidate stands in the tall block; with it on, rays leave through the block's back faces.
    let mut host = Host::new(&gpu, samples::cornell(0.0));
    host.frame();
    let provisional = host.centers();
    let buffer = host.renderer.env_maps().unwrap().centers_buffer().clone();
    let records: Vec<[f32; 4]> = lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, &buffer).unwrap();
    let mut bench = Bench::new(&gpu, &host.scene);
    let candidates: Vec<Vec3> = provisional.iter().map(|&c| bench.frame.point(c)).collect();
    let (_, sights) = bench.select(&candidates, 1, &insatiable());
    let on: Vec<bool> = records.iter().map(|r| r[3] > 0.0).collect();
    let valid: Vec<bool> = sights.iter().map(|s| s.is_valid).collect();
    assert_eq!(on, valid);
    assert!(on.contains(&false) && on.contains(&true), "{on:?}");
    assert_no_errors(&gpu);
}

#[test]
fn a_map_that_something_moves_over_is_given_up() {
    let Some(gpu) = gpu() else { return };
    let mut host = Host::new(&gpu, samples::cornell(0.0));
    host.frame();
    host.settle();
    let before = host.centers();
    // The tall block, 3.3 m high, over the map nearest to the room's middle.
    let block = host.scene.instances.len() - 1;
    let (from, to) = (DVec3::new(3.685, 0.0, 3.515), DVec3::new(2.78, 0.0, 2.8));
    let near = |c: &DVec3| DVec3::new(c.x - to.x, 0.0, c.z - to.z).length();
    let middle = *before.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
    let over = DVec3::new(middle.x, middle.y - 1.65, middle.z);
    host.move_instance(block, DAffine3::from_translation(over - from));
    let waits = creation_count().waits;
    let frames = host.settle();
    println!("at rest {frames} frames after the block moved");
    assert_eq!(creation_count().waits, waits);
    let after = host.centers();
    assert!(!after.contains(&middle), "{middle} is inside the block");
    assert!(
        after.iter().any(|c| before.contains(c)),
        "maps that are still good stay"
    );
    assert_no_errors(&gpu);
}

/// A room of 4 × 2 × 4 m with a camera, and four upright slabs in it, so small that they lie in a corner's shadow.
fn room_with_slabs() -> (Scene, [DAffine3; 4], [DAffine3; 4]) {
    let mut scene = room(DVec3::new(2.0, 1.0, 2.0));
    scene.cameras = samples::furnace(0.5, 1.0).cameras;
    scene.lights = vec![Light::point(DVec3::new(0.9, 0.5, 0.4), 1.0, [1.0; 3])];
    // The room's own mesh turned inside out: a box of half extents 2, 1, 2 seen from outside.
    let mut slab = scene.meshes[0].clone();
    for triangle in slab.indices.chunks_exact_mut(3) {
        triangle.swap(0, 1);
    }
    scene.meshes.push(slab);
    let hidden = [(); 4].map(|()| {
        DAffine3::from_scale_rotation_translation(DVec3::splat(1e-4), Default::default(), DVec3::new(1.99, 0.99, 1.99))
    });
    let place = |x: f64, z: f64, sx: f64, sz: f64| {
        DAffine3::from_scale_rotation_translation(DVec3::new(sx, 0.9, sz), Default::default(), DVec3::new(x, 0.0, z))
    };
    let standing = [
        place(-1.0, -0.4, 0.02, 0.3),
        place(0.0, 0.5, 0.02, 0.35),
        place(1.0, -0.5, 0.02, 0.3),
        place(0.3, -1.2, 0.3, 0.02),
    ];
    for transform in hidden {
        let mut instance = Instance::new(1, 0);
        instance.transform = transform;
        scene.instances.push(instance);
    }
    (scene, hidden, standing)
}

#[test]
fn maintenance_follows_a_room_that_fills_and_empties() {
    let Some(gpu) = gpu() else { return };
    let (scene, hidden, standing) = room_with_slabs();
    let mut host = Host::new(&gpu, scene);
    host.frame();
    host.settle();
    assert_eq!(host.selected().0, 1, "a convex room");
    for (i, transform) in standing.into_iter().enumerate() {
        host.move_instance(i + 1, transform);
    }
    let frames = host.settle();
    let (maintained, anew) = (host.selected(), host.selected_anew());
    println!("slabs: {maintained:?} after {frames} frames, selected anew {anew:?}");
    assert!(maintained.0 > 2);
    assert!(maintained.1 > anew.1 - 0.01);
    for (i, transform) in hidden.into_iter().enumerate() {
        host.move_instance(i + 1, transform);
    }
    let frames = host.settle();
    println!("none: {:?} after {frames} frames", host.selected());
    assert_eq!(host.selected().0, 1, "convex again");
    assert_no_errors(&gpu);
}

#[test]
fn a_frame_that_is_never_submitted_loses_no_selection() {
    let Some(gpu) = gpu() else { return };
    let mut host = Host::new(&gpu, samples::pillars(0.0));
    drop(host.record());
    drop(host.record());
    host.settle();
    assert_eq!(host.selected(), host.selected_anew());
    // Nor does it go by photons that were never traced.
    let mut host = Host::by(&gpu, samples::pillars(0.0), CoverageMeasure::Photons, 8);
    drop(host.record());
    host.settle();
    assert!(
        host.selected().0 > 2 && host.selected().1 > 0.99,
        "{:?}",
        host.selected()
    );
    assert_no_errors(&gpu);
}

#[test]
fn by_photons_a_selection_arrives_without_a_wait_too_and_comes_to_rest() {
    let Some(gpu) = gpu() else { return };
    for (scene, maps) in [
        (room_with_slabs().0, 1..2),
        (samples::cornell(0.0), 2..9),
        (samples::pillars(0.0), 4..9),
    ] {
        let mut host = Host::by(&gpu, scene, CoverageMeasure::Photons, 8);
        host.frame();
        let before = creation_count();
        let frames = host.settle();
        assert_eq!(creation_count().waits, before.waits, "the crate waited for the GPU");
        println!(
            "{:?} after {frames} frames, at once {:?}",
            host.selected(),
            host.selected_anew()
        );
        assert!(maps.contains(&host.selected().0));
        assert!(host.selected().1 > host.selected_anew().1 - 0.01);
        host.frame();
        let image = host.image();
        host.frame();
        assert!(image.iter().flatten().any(|&v| v > 0.0));
        assert!(host.image() == image);
    }
    assert_no_errors(&gpu);
}

/// A house, the lamp in its only room, on wide ground.
fn house() -> Scene {
    let mut scene = room(DVec3::ONE);
    let mut outside = scene.meshes[0].clone();
    for triangle in outside.indices.chunks_exact_mut(3) {
        triangle.swap(0, 1);
    }
    let ground = Mesh {
        positions: vec![
            [-3.0, -1.1, 3.0],
            [3.0, -1.1, 3.0],
            [3.0, -1.1, -3.0],
            [-3.0, -1.1, -3.0],
        ],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    };
    scene.meshes.extend([outside, ground]);
    let mut shell = Instance::new(1, 0);
    shell.transform = DAffine3::from_scale(DVec3::splat(1.05));
    scene.instances.extend([shell, Instance::new(2, 0)]);
    scene.cameras = samples::furnace(0.5, 1.0).cameras;
    scene
}

#[test]
fn by_photons_maps_follow_a_lamp_into_another_room() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::two_rooms(0.0);
    let mut host = Host::by(&gpu, scene, CoverageMeasure::Photons, 1);
    host.frame();
    host.settle();
    assert!(
        host.centers()[0].z < 0.0,
        "the lamp is in the near room, and the door is closed"
    );
    host.scene.lights[0].kind = LightKind::Point {
        position: DVec3::new(0.8, 2.4, 2.2),
        radius: 0.0,
    };
    host.frame();
    host.settle();
    println!("{:.2?}", host.centers());
    assert!(host.centers()[0].z > 0.0, "now it is in the far one");
    assert_no_errors(&gpu);
}

#[test]
fn by_photons_maps_stand_where_the_light_is() {
    let Some(gpu) = gpu() else { return };
    let stands_inside = |measure| {
        let mut host = Host::by(&gpu, house(), measure, 1);
        host.frame();
        host.settle();
        println!("{measure:?}: {:.2?}", host.centers());
        host.centers()[0].abs().max_element() < 1.0
    };
    assert!(
        !stands_inside(CoverageMeasure::Area),
        "the outside has by far the larger area"
    );
    assert!(stands_inside(CoverageMeasure::Photons));
    assert_no_errors(&gpu);
}

#[test]
fn what_changed_in_the_dark_is_seen_when_the_light_is_on_again() {
    let Some(gpu) = gpu() else { return };
    let (mut scene, _, standing) = room_with_slabs();
    let lights = std::mem::take(&mut scene.lights);
    let mut host = Host::new(&gpu, scene);
    host.scene.lights = lights.clone();
    host.frame();
    host.settle();
    assert_eq!(host.selected().0, 1);
    host.scene.lights.clear();
    host.frame();
    for (i, transform) in standing.into_iter().enumerate() {
        host.move_instance(i + 1, transform);
    }
    host.frame();
    host.scene.lights = lights;
    host.frame();
    host.settle();
    assert_eq!(host.selected(), host.selected_anew());
    assert_no_errors(&gpu);
}

#[test]
fn nothing_but_the_blocking_read_back_polls_or_maps() {
    fn sources(folder: &std::path::Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                sources(&path, found);
            } else {
                found.push(path);
            }
        }
    }
    let mut files = Vec::new();
    sources(
        &std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src"),
        &mut files,
    );
    assert!(files.len() > 40);
    let waiting: Vec<_> = files
        .iter()
        .filter(|f| {
            let text = std::fs::read_to_string(f).unwrap();
            [".poll(", "map_async", "wait_indefinitely"]
                .iter()
                .any(|w| text.contains(w))
        })
        .map(|f| f.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    assert_eq!(waiting, ["read_back.rs"]);
}
