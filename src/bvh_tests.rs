//! What a ray finds where it hits, and from where it leaves: functions of `shaders/common/bvh*.wgsl`, which need the
//! bindings of the trees, on a GPU.

#[path = "../examples/common/adapter.rs"]
#[allow(dead_code, reason = "shared with the examples")]
mod adapter;
#[path = "../tests/common/meshes.rs"]
#[allow(dead_code, reason = "shared with the other tests")]
mod meshes;
#[path = "../tests/common/statistics.rs"]
#[allow(dead_code, reason = "shared with the other tests")]
mod statistics;
#[path = "../tests/common/texture.rs"]
#[allow(dead_code, reason = "shared with the other tests")]
mod texture;

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::bvh_geometry::BVH_SLOTS;
use crate::resource::{BvhGeometry, BvhGeometryConfig, Ray};
use crate::scene::{Instance, Material, Mesh, Scene, SceneBounds, Texture, UnitFrame};
use crate::{read_buffer_blocking, wgsl};
use adapter::{Gpu, Wishes};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use statistics::Random;
use texture::{bilinear, srgb_to_linear};

/// A device, or `None` with a printed reason where the machine has no usable adapter; a failure where
/// `LIGHTFALL_REQUIRE_GPU=1` says that there must be one.
fn gpu() -> Option<Gpu> {
    match Gpu::open(None, Wishes::default()) {
        Ok(gpu) => Some(gpu),
        Err(reason) if std::env::var("LIGHTFALL_REQUIRE_GPU").as_deref() == Ok("1") => panic!("{reason}"),
        Err(reason) => {
            println!("skipped: {reason}");
            None
        }
    }
}

/// Evaluates the body of a WGSL function of `ray: Ray` that returns a `vec4f`, once per ray.
fn evaluate(gpu: &Gpu, geometry: &BvhGeometry, body: &str, rays: &[Ray]) -> Vec<[f32; 4]> {
    use wgpu::BufferUsages as U;
    let Gpu { device, queue, .. } = gpu;
    let source = format!(
        "struct Ray {{ origin: vec3f, furthest: f32, direction: vec3f, mask: u32 }}
        @group(0) @binding(0) var<storage, read> rays: array<Ray>;
        @group(0) @binding(1) var<storage, read_write> outputs: array<vec4f>;
        fn evaluate(ray: Ray) -> vec4f {{ {body} }}
        @compute @workgroup_size(64)
        fn evaluate_all(@builtin(global_invocation_id) id: vec3u) {{
            if id.x < arrayLength(&rays) {{
                outputs[id.x] = evaluate(rays[id.x]);
            }}
        }}
        {}",
        wgsl::BVH_FUNCTIONS
    );
    let stages = wgpu::ShaderStages::COMPUTE;
    let layouts =
        [&[Slot::Storage, Slot::StorageMut][..], &BVH_SLOTS].map(|s| device::layout(device, "test", stages, s));
    let pipeline = device::compute_pipeline(
        device,
        &ComputeSpec {
            label: "test",
            source: source.leak(),
            entry_point: "evaluate_all",
            layouts: &[&layouts[0], &layouts[1]],
            constants: &[],
        },
    );
    let inputs = device::buffer(device, "rays", size_of_val(rays) as u64, U::STORAGE | U::COPY_DST).unwrap();
    queue.write_buffer(&inputs, 0, bytemuck::cast_slice(rays));
    let outputs = device::buffer(device, "outputs", 16 * rays.len() as u64, U::STORAGE | U::COPY_SRC).unwrap();
    let own = BindGroupCache::default().get(device, "test", &layouts[0], &[(&inputs).into(), (&outputs).into()]);
    let trees = BindGroupCache::default().get(device, "test", &layouts[1], &geometry.bound());
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = device::compute_pass(&mut encoder, "test", None);
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &own, &[]);
    pass.set_bind_group(1, &trees, &[]);
    pass.dispatch_workgroups(rays.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    queue.submit([encoder.finish()]);
    let outputs = read_buffer_blocking(device, queue, &outputs);
    let errors = gpu.take_errors();
    assert!(errors.is_empty(), "{}", errors.join("\n"));
    outputs.unwrap()
}

/// A point of the box from −1 to 1.
fn point(random: &mut Random) -> DVec3 {
    DVec3::from([(); 3].map(|()| 2.0 * f64::from(random.unit()) - 1.0))
}

/// Convex meshes and squares, large and small, all over the unit frame and at its border, modelled about their own centre
/// or far from it.
fn strewn(random: &mut Random) -> Scene {
    let shapes = [meshes::sphere(16, 32, 0.0), meshes::cube(), meshes::grid(3, |_, _| 0.0)];
    let off_centre = shapes.clone().map(|mesh| Mesh {
        positions: mesh.positions.iter().map(|p| [p[0] + 7.0, p[1] - 3.0, p[2]]).collect(),
        ..mesh
    });
    let mut scene = Scene {
        meshes: shapes.into_iter().chain(off_centre).collect(),
        materials: vec![Material::default()],
        ..Scene::default()
    };
    for i in 0..120 {
        let mesh = i % scene.meshes.len();
        let size = 0.3 * (10f64).powf(-2.0 * f64::from(random.unit()));
        let stretch = DVec3::from([(); 3].map(|()| size * (0.3 + f64::from(random.unit()))));
        let turn = DQuat::from_axis_angle(random.direction(), 3.0 * f64::from(random.unit()));
        let center = if mesh >= 3 {
            DVec3::new(7.0, -3.0, 0.0)
        } else {
            DVec3::ZERO
        };
        let transform = DAffine3::from_translation(point(random))
            * DAffine3::from_quat(turn)
            * DAffine3::from_scale(stretch)
            * DAffine3::from_translation(-center);
        scene.instances.push(Instance {
            transform,
            ..Instance::new(mesh, 0)
        });
    }
    scene
}

/// Squares up to a thousand times as large as the region, which pass through it in all directions.
fn vast(random: &mut Random) -> Scene {
    let mut scene = Scene {
        meshes: vec![meshes::grid(3, |_, _| 0.0)],
        materials: vec![Material::default()],
        ..Scene::default()
    };
    for i in 0..20 {
        let turn = DQuat::from_axis_angle(random.direction(), 3.0 * f64::from(random.unit()));
        let transform = DAffine3::from_translation(0.3 * point(random))
            * DAffine3::from_quat(turn)
            * DAffine3::from_scale(DVec3::splat(10f64.powi(i % 4)))
            * DAffine3::from_translation(DVec3::new(-0.5, 0.0, -0.3));
        scene.instances.push(Instance {
            transform,
            ..Instance::new(0, 0)
        });
    }
    scene
}

/// A region whose unit frame is one metre to a unit, about the origin.
fn region() -> UnitFrame {
    let corner = DVec3::splat(0.577);
    UnitFrame::new(&SceneBounds::new(-corner, corner).unwrap(), 1.0).unwrap()
}

fn place(gpu: &Gpu, scene: &Scene, frame: &UnitFrame) -> BvhGeometry {
    let mut geometry = BvhGeometry::new(&gpu.device, &gpu.queue, scene, &BvhGeometryConfig::default()).unwrap();
    geometry.prepare(&gpu.queue, frame).unwrap();
    geometry
}

/// Rays from all over at points about the middle of instances.
fn rays_at(scene: &Scene, frame: &UnitFrame, count: usize, random: &mut Random) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let instance = &scene.instances[i % scene.instances.len()];
            let positions = &scene.meshes[instance.mesh].positions;
            let corner = |random: &mut Random| {
                let p = positions[random.bits() as usize % positions.len()];
                instance.transform.transform_point3(Vec3::from(p).as_dvec3())
            };
            let (a, b) = (corner(random), corner(random));
            let inside = a.lerp(b, f64::from(random.unit()));
            // Of a vast mesh, what is in the region.
            let target = if inside.length() > 2.0 {
                0.4 * point(random)
            } else {
                inside
            };
            let origin = frame.point(2.0 * point(random));
            Ray {
                origin: origin.to_array(),
                furthest: Ray::FURTHEST,
                direction: (frame.point(target) - origin).to_array(),
                mask: random.bits(),
            }
        })
        .collect()
}

/// Leaves the surface that a ray hits, `furthest` units in the last place off it, at a cosine of 10^-3 to 1. Returns
/// whether it hits the same instance again; −1 where nothing was hit, or a mesh from within.
const LEAVE_AND_COME_BACK: &str = "
    let hit = bvh_closest(ray.origin, ray.direction, BVH_FURTHEST, BVH_ALL);
    if hit.instance == BVH_NONE {
        return vec4f(-1.0);
    }
    let surface = bvh_surface(hit);
    let normal = surface.geometric_normal;
    if dot(normal, ray.direction) > 0.0 {
        return vec4f(-1.0);
    }
    let random = vec2f(f32(ray.mask & 0xffffu), f32(ray.mask >> 16u)) / 65536.0;
    let cosine = pow(10.0, -3.0 * random.x);
    let across = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(normal.x) > 0.7);
    let side = normalize(cross(normal, across));
    let angle = 6.2831853 * random.y;
    let tangent = cos(angle) * side + sin(angle) * cross(normal, side);
    let direction = cosine * normal + sqrt(1.0 - cosine * cosine) * tangent;
    let part = ray.furthest / BVH_OFFSET_ULPS;
    let origin = mix(surface.position, bvh_leave(surface, normal), part);
    let again = bvh_closest(origin, direction, BVH_FURTHEST, BVH_ALL);
    return vec4f(f32(again.instance == hit.instance), cosine, again.distance, 0.0);
";

#[test]
fn a_ray_that_leaves_a_surface_does_not_hit_it_again() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(3);
    let frame = region();
    for (name, scene) in [("strewn", strewn(&mut random)), ("vast", vast(&mut random))] {
        let geometry = place(&gpu, &scene, &frame);
        let rays = rays_at(&scene, &frame, 200_000, &mut random);
        for ulps in [0.0, 1.0, 2.0, 4.0, 64.0] {
            let limited = rays.iter().map(|ray| Ray { furthest: ulps, ..*ray });
            let left = evaluate(&gpu, &geometry, LEAVE_AND_COME_BACK, &limited.collect::<Vec<_>>());
            let tried = left.iter().filter(|r| r[0] >= 0.0).count();
            let came_back = left.iter().filter(|r| r[0] > 0.0).count();
            println!("{name}: of {tried} rays that start {ulps} ulps off, {came_back} come back");
            assert!(tried > 50_000, "{name}: {tried}");
            match ulps {
                // A sixteenth of what is used suffices.
                4.0.. => assert_eq!(came_back, 0, "{name}: {ulps} ulps"),
                0.0 => assert!(came_back > tried / 10, "{name}: nothing would come back anyhow"),
                _ => {}
            }
        }
    }
}

#[test]
fn normals_are_of_unit_length_and_agree_on_the_side() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(5);
    let frame = region();
    let mut scene = strewn(&mut random);
    for (i, mesh) in scene.meshes.iter_mut().enumerate() {
        let mut normal = || (f64::from(random.unit()) * random.direction()).as_vec3().to_array();
        match i % 3 {
            // Inward, so that each is on the wrong side of its triangles.
            0 => mesh.normals = mesh.positions.iter().map(|p| p.map(|x| -x)).collect(),
            1 => mesh.normals = mesh.positions.iter().map(|_| normal()).collect(),
            _ => {}
        }
        // Triangles along lines: rays meet some of them after rounding.
        let count = mesh.positions.len() as u32;
        let mut corner = || random.bits() % count;
        for _ in 0..200 {
            let (a, b) = (corner(), corner());
            mesh.indices.extend([a, b, a]);
        }
    }
    let geometry = place(&gpu, &scene, &frame);
    let rays = rays_at(&scene, &frame, 100_000, &mut random);
    let body = "
        let hit = bvh_closest(ray.origin, ray.direction, BVH_FURTHEST, BVH_ALL);
        if hit.instance == BVH_NONE {
            return vec4f(1.0, 1.0, 0.0, 0.0);
        }
        let surface = bvh_surface(hit);
        let side = dot(surface.geometric_normal, surface.shading_normal);
        return vec4f(length(surface.geometric_normal), length(surface.shading_normal), side, 1.0);";
    let all = evaluate(&gpu, &geometry, body, &rays);
    assert!(all.iter().filter(|n| n[3] > 0.0).count() > 50_000);
    for (ray, [geometric, shading, side, _]) in rays.iter().zip(all) {
        let is_unit = |length: f32| (length - 1.0).abs() < 1e-6;
        assert!(
            is_unit(geometric) && is_unit(shading) && side >= 0.0,
            "{ray:?}: {geometric} {shading} {side}"
        );
    }
}

#[test]
fn a_triangle_without_area_has_a_normal_all_the_same() {
    let Some(gpu) = gpu() else { return };
    let geometry = place(&gpu, &Scene::default(), &region());
    let pairs: [(Vec3, Vec3); 6] = [
        (Vec3::ZERO, Vec3::ZERO),
        (Vec3::X, Vec3::X),
        (Vec3::new(0.3, 0.2, 0.1), Vec3::new(-0.6, -0.4, -0.2)),
        (Vec3::X, Vec3::Z),
        // Small enough for squares to vanish.
        (1e-20 * Vec3::X, 1e-20 * Vec3::Z),
        (1e-25 * Vec3::X, 1e-25 * Vec3::Z),
    ];
    let rays = pairs.map(|(ab, ac)| Ray {
        origin: ab.to_array(),
        furthest: 0.0,
        direction: ac.to_array(),
        mask: 0,
    });
    let normals = evaluate(
        &gpu,
        &geometry,
        "return vec4f(bvh_across(ray.origin, ray.direction), 0.0);",
        &rays,
    );
    let expected = [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::NEG_Y, Vec3::NEG_Y, Vec3::NEG_Y];
    assert_eq!(normals, expected.map(|n| n.extend(0.0).to_array()));
}

#[test]
fn a_hit_shows_its_texture() {
    const SIDE: u32 = 16;
    let Some(gpu) = gpu() else { return };
    let mut random = Random(7);
    let mut image = |srgb| Texture {
        name: String::new(),
        width: SIDE,
        height: SIDE,
        srgb,
        rgba: (0..4 * SIDE * SIDE).map(|_| (random.bits() >> 24) as u8).collect(),
    };
    let textures = vec![image(true), image(false), image(true)];
    let material = |texture: usize, color: [f32; 3]| Material {
        base_color: color,
        base_color_texture: Some(texture),
        emission: color,
        emission_texture: Some((texture + 1) % 3),
        ..Material::default()
    };
    let mut square = meshes::grid(2, |x, z| 0.1 * x * z);
    square.tex_coords = square
        .positions
        .iter()
        .map(|p| [0.8 * p[0] + 3.0, 0.6 - 0.9 * p[2]])
        .collect();
    let mirrored = DAffine3::from_scale_rotation_translation(
        DVec3::new(-0.4, 0.5, 0.3),
        DQuat::from_rotation_y(0.4),
        DVec3::new(0.3, -0.2, 0.1),
    );
    let scene = Scene {
        meshes: vec![square.clone()],
        materials: vec![
            material(0, [1.0, 0.5, 0.25]),
            material(1, [0.3, 0.7, 1.0]),
            material(2, [0.9; 3]),
        ],
        textures,
        instances: (0..3)
            .map(|i| Instance {
                transform: DAffine3::from_translation(0.2 * i as f64 * DVec3::Y) * mirrored,
                ..Instance::new(0, i)
            })
            .collect(),
        ..Scene::default()
    };
    let frame = region();
    let geometry = place(&gpu, &scene, &frame);
    let points: Vec<(usize, [f64; 2])> = (0..60_000)
        .map(|i| (i % 3, [(); 2].map(|()| 1.98 * f64::from(random.unit()) - 0.99)))
        .collect();
    let rays: Vec<_> = points
        .iter()
        .map(|&(instance, [x, z])| {
            // Close to the surface, so that nothing is in between; its height is linear within each triangle.
            let on_mesh = |x: f64, y: f64, z: f64| {
                frame.point(
                    scene.instances[instance]
                        .transform
                        .transform_point3(DVec3::new(x, y, z)),
                )
            };
            let (from, to) = (on_mesh(x, 0.17, z), on_mesh(x, -0.17, z));
            Ray {
                origin: from.to_array(),
                furthest: 1.0,
                direction: (to - from).to_array(),
                mask: Ray::ALL,
            }
        })
        .collect();
    for (what, function) in [("base colour", "bvh_base_color"), ("emission", "bvh_emission")] {
        let body = format!(
            "let hit = bvh_closest(ray.origin, ray.direction, ray.furthest, ray.mask);
            if hit.instance == BVH_NONE {{ return vec4f(-1.0); }}
            return vec4f({function}(bvh_surface(hit)), f32(hit.instance));"
        );
        let shown = evaluate(&gpu, &geometry, &body, &rays);
        let mut largest = 0f64;
        for (&(instance, [x, z]), shown) in points.iter().zip(shown) {
            assert_eq!(shown[3], instance as f32, "{what} at {x}, {z}");
            let own = &scene.materials[instance];
            let (texture, factor, unit) = if what == "emission" {
                (own.emission_texture, own.emission, frame.radiance_scale())
            } else {
                (own.base_color_texture, own.base_color, 1.0)
            };
            let texture = &scene.textures[texture.unwrap()];
            for c in 0..3 {
                let decode = |texel: [u8; 4]| {
                    if texture.srgb {
                        srgb_to_linear(texel[c])
                    } else {
                        f64::from(texel[c]) / 255.0
                    }
                };
                let expected = bilinear(texture, [0.8 * x + 3.0, 0.6 - 0.9 * z], decode);
                largest = largest.max((f64::from(shown[c]) * unit / f64::from(factor[c]) - expected).abs());
            }
        }
        println!("{what}: off by {largest:.5} at most");
        // Filters weigh texels in steps of 1/256.
        assert!(largest < 2.0 / 256.0, "{what}: {largest}");
    }
}
