//! The path tracer against arithmetic.
#![cfg(all(feature = "bvh", feature = "reference"))]

mod common;

use common::{Gpu, Reference, assert_no_errors, gpu};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::reference::{PathComponent, PathEstimate, PathTracerSettings};
use lightfall::scene::{
    Camera, EnvironmentImage, Instance, Light, LightKind, Material, Mesh, Projection, Scene, samples,
};
use std::f64::consts::{PI, TAU};

/// The mean of `samples` paths a pixel.
fn render(gpu: &Gpu, scene: &Scene, settings: &PathTracerSettings, size: [u32; 2], samples: u32) -> PathEstimate {
    let mut reference = Reference::new(gpu, scene.clone(), settings, 0, size).unwrap();
    let estimate = reference.trace(samples).unwrap();
    assert_no_errors(gpu);
    estimate
}

/// Mean over all pixels and channels.
fn mean(estimate: &PathEstimate) -> f64 {
    let sum: f64 = estimate.mean.iter().flatten().map(|&x| f64::from(x)).sum();
    sum / (3 * estimate.mean.len()) as f64
}

fn unlimited() -> PathTracerSettings {
    PathTracerSettings::default()
}

fn component(component: PathComponent, bounces: u32) -> PathTracerSettings {
    PathTracerSettings {
        component,
        bounces,
        ..Default::default()
    }
}

#[test]
fn a_closed_furnace_is_as_bright_as_the_series_says() {
    let Some(gpu) = gpu() else { return };
    for (reflectance, emission) in [(0.0, 1.0), (0.5, 1.0), (0.8, 0.25)] {
        let mut scene = samples::furnace(reflectance, emission);
        // With interpolated normals a few directions point below the facet that they leave (Veach 1997, section 5.3.4).
        scene.meshes[0].normals.clear();
        let estimate = render(&gpu, &scene, &unlimited(), [32, 32], 512);
        let expected = f64::from(emission) / (1.0 - f64::from(reflectance));
        let error = mean(&estimate) / expected - 1.0;
        println!("furnace, albedo {reflectance}: {:+.4} %", 100.0 * error);
        assert!(error.abs() < 0.002, "albedo {reflectance}: {error}");
    }
}

/// A square of this half size around the origin, facing +Y, seen by a parallel camera from above.
fn floor(half: f32, albedo: f32, half_view: f64) -> Scene {
    let mesh = Mesh {
        name: "floor".into(),
        positions: vec![
            [-half, 0.0, half],
            [half, 0.0, half],
            [half, 0.0, -half],
            [-half, 0.0, -half],
        ],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    };
    Scene {
        meshes: vec![mesh],
        materials: vec![Material::diffuse("grey", [albedo; 3])],
        instances: vec![Instance::new(0, 0)],
        cameras: vec![Camera {
            name: "above".into(),
            transform: DAffine3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y, DVec3::new(0.0, 1.5, 0.0)),
            projection: Projection::Orthographic { half_height: half_view },
        }],
        ..Scene::default()
    }
}

/// Mean over the view of radiance that an irradiance, given at points of the floor, leaves.
fn expected_mean(albedo: f64, half_view: f64, irradiance: impl Fn(DVec3) -> f64) -> f64 {
    const STEPS: u32 = 200;
    let at = |i: u32| half_view * (2.0 * (f64::from(i) + 0.5) / f64::from(STEPS) - 1.0);
    let sum: f64 = (0..STEPS * STEPS)
        .map(|i| irradiance(DVec3::new(at(i % STEPS), 0.0, at(i / STEPS))))
        .sum();
    albedo / PI * sum / f64::from(STEPS * STEPS)
}

/// Irradiance of a polygon of radiance 1 at a point with normal +Y (Lambert).
fn polygon_irradiance(p: DVec3, corners: &[DVec3]) -> f64 {
    let sum: f64 = (0..corners.len())
        .map(|i| {
            let a = (corners[i] - p).normalize();
            let b = (corners[(i + 1) % corners.len()] - p).normalize();
            a.angle_between(b) * a.cross(b).normalize().dot(DVec3::Y)
        })
        .sum();
    0.5 * sum.abs()
}

/// Irradiance of a floor by a lamp of unit intensity.
fn cosine_over_square(lamp: DVec3, p: DVec3) -> f64 {
    let way = lamp - p;
    way.normalize().y / way.length_squared()
}

/// The same by a spot that looks straight down, of these half angles.
fn spot_irradiance(lamp: DVec3, [inner, outer]: [f64; 2], p: DVec3) -> f64 {
    let cosine = (p - lamp).normalize().dot(DVec3::NEG_Y);
    let falloff = (cosine - outer.cos()) / (inner.cos() - outer.cos());
    falloff.clamp(0.0, 1.0).powi(2) * cosine_over_square(lamp, p)
}

/// Mean, over a level disc, of a function of the way from its middle: an even spread of points by rings of equal area.
fn mean_over_disc(radius: f64, value: impl Fn(DVec3) -> f64) -> f64 {
    let (rings, spokes) = (8, 16);
    let points = (0..rings).flat_map(|ring| (0..spokes).map(move |spoke| (ring, spoke)));
    let sum: f64 = points
        .map(|(ring, spoke)| {
            let r = radius * ((f64::from(ring) + 0.5) / f64::from(rings)).sqrt();
            let angle = TAU * (f64::from(spoke) + 0.5 * f64::from(ring % 2)) / f64::from(spokes);
            value(DVec3::new(r * angle.cos(), 0.0, r * angle.sin()))
        })
        .sum();
    sum / f64::from(rings * spokes)
}

#[test]
fn paths_through_the_middle_of_a_pixel_see_that_point_alone() {
    let Some(gpu) = gpu() else { return };
    let (albedo, half_view, lamp) = (0.6, 0.8, DVec3::new(0.3, 1.0, -0.2));
    let mut scene = floor(1.0, albedo as f32, half_view);
    scene.lights.push(Light::point(lamp, 3.0, [1.0; 3]));
    let settings = PathTracerSettings {
        spans_pixel: false,
        ..unlimited()
    };
    let size = 8;
    let estimate = render(&gpu, &scene, &settings, [size; 2], 4);
    for (pixel, (mean, error)) in (0..).zip(estimate.mean.iter().zip(&estimate.standard_error)) {
        let at = |i: u32| half_view * (2.0 * (f64::from(i) + 0.5) / f64::from(size) - 1.0);
        let point = DVec3::new(at(pixel % size), 0.0, at(pixel / size));
        let exact = albedo / PI * 3.0 * cosine_over_square(lamp, point);
        let off = f64::from(mean[0]) / exact - 1.0;
        assert!(off.abs() < 1e-5 && error[0] == 0.0, "pixel {pixel}: {mean:?}, {exact}");
    }
}

#[test]
fn a_plane_is_lit_by_each_kind_of_light_as_the_formula_says() {
    let Some(gpu) = gpu() else { return };
    let (albedo, half_view) = (0.6, 0.8);
    let lamp = DVec3::new(0.3, 1.0, -0.2);
    let light = |kind| Light {
        name: String::new(),
        kind,
        color: [1.0; 3],
        intensity: 3.0,
    };
    let (inner, outer) = (0.3f64, 0.6f64);
    let sun = DVec3::new(0.5, -1.0, 0.25);
    let (u, v) = (DVec3::new(0.3, 0.0, 0.0), DVec3::new(0.0, 0.1, 0.25));
    let corners = [u + v, u - v, -u - v, v - u].map(|c| lamp + c);
    let spot_radius = 0.2;
    type Irradiance<'a> = Box<dyn Fn(DVec3) -> f64 + 'a>;
    let cases: Vec<(&str, LightKind, Irradiance)> = vec![
        (
            "point",
            LightKind::Point {
                position: lamp,
                radius: 0.0,
            },
            Box::new(|p| 3.0 * cosine_over_square(lamp, p)),
        ),
        (
            // A sphere of uniform radiance is as bright as a point of its intensity, wherever it stands above the horizon.
            "sphere",
            LightKind::Point {
                position: lamp,
                radius: 0.5,
            },
            Box::new(|p| 3.0 * cosine_over_square(lamp, p)),
        ),
        (
            "spot",
            LightKind::Spot {
                position: lamp,
                direction: DVec3::NEG_Y,
                inner_angle: inner,
                outer_angle: outer,
                radius: 0.0,
            },
            Box::new(|p| 3.0 * spot_irradiance(lamp, [inner, outer], p)),
        ),
        (
            "wide spot",
            LightKind::Spot {
                position: lamp,
                direction: DVec3::NEG_Y,
                inner_angle: inner,
                outer_angle: outer,
                radius: spot_radius,
            },
            Box::new(|p| 3.0 * mean_over_disc(spot_radius, |offset| spot_irradiance(lamp + offset, [inner, outer], p))),
        ),
        (
            "sun",
            LightKind::Directional {
                direction: sun,
                angle: 0.0,
            },
            Box::new(|_| 3.0 * -sun.normalize().y),
        ),
        (
            // So is a disc of uniform radiance, and the same irradiance on a plane across its axis.
            "wide sun",
            LightKind::Directional {
                direction: sun,
                angle: 0.2,
            },
            Box::new(|_| 3.0 * -sun.normalize().y),
        ),
        (
            "rectangle",
            LightKind::Rectangle {
                center: lamp,
                half_u: u,
                half_v: v,
            },
            Box::new(|p| 3.0 * polygon_irradiance(p, &corners)),
        ),
    ];
    for (name, kind, irradiance) in cases {
        let scene = Scene {
            lights: vec![light(kind)],
            ..floor(2.0, albedo, half_view)
        };
        let expected = expected_mean(f64::from(albedo), half_view, irradiance);
        let estimate = render(&gpu, &scene, &unlimited(), [64, 64], 64);
        let error = mean(&estimate) / expected - 1.0;
        println!("plane under {name}: {:+.4} %", 100.0 * error);
        assert!(error.abs() < 0.002, "{name}: {error}");
    }
}

#[test]
fn a_lamp_that_is_a_mesh_shines_like_the_same_lamp_as_a_light() {
    let Some(gpu) = gpu() else { return };
    let half_view = 0.8;
    let (center, u, v) = (
        DVec3::new(0.2, 0.9, 0.1),
        DVec3::new(0.3, 0.0, 0.0),
        DVec3::new(0.0, 0.0, 0.2),
    );
    let mut scene = floor(2.0, 0.6, half_view);
    scene.meshes.push(Mesh {
        name: "lamp".into(),
        positions: [-u - v, u - v, u + v, v - u].map(|p| (p).as_vec3().to_array()).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    });
    scene.materials.push(Material {
        emission: [4.0; 3],
        ..Material::diffuse("lamp", [0.0; 3])
    });
    // Mirrored, so that its front goes with it.
    scene.instances.push(Instance {
        transform: DAffine3::from_scale_rotation_translation(
            DVec3::new(-1.0, 1.0, 1.0),
            lightfall::glam::DQuat::IDENTITY,
            center,
        ),
        ..Instance::new(1, 1)
    });
    scene.cameras[0].transform.translation.y = 0.5;
    let corners = [-u - v, u - v, u + v, v - u].map(|c| center + c);
    let expected = expected_mean(0.6, half_view, |p| 4.0 * polygon_irradiance(p, &corners));
    let estimate = render(&gpu, &scene, &component(PathComponent::All, 0), [64, 64], 256);
    let error = mean(&estimate) / expected - 1.0;
    println!("plane under an emissive mesh: {:+.4} %", 100.0 * error);
    assert!(error.abs() < 0.002, "{error}");
}

/// A unit sphere of this material at the origin, with smooth normals.
fn sphere(material: Material) -> Scene {
    let mut furnace = samples::furnace(0.0, 0.0);
    let mesh = &mut furnace.meshes[0];
    for triangle in mesh.indices.chunks_exact_mut(3) {
        triangle.swap(1, 2);
    }
    mesh.normals = mesh.positions.clone();
    furnace.materials = vec![material];
    furnace.cameras[0].transform = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.0));
    furnace.cameras[0].projection = Projection::Perspective { fov_y: 0.8 };
    furnace
}

fn environment(image: Option<usize>, rotation: f64) -> Light {
    Light {
        name: "sky".into(),
        kind: LightKind::Environment { image, rotation },
        color: [1.0, 0.8, 0.6],
        intensity: 2.0,
    }
}

#[test]
fn glass_in_a_uniform_environment_is_invisible() {
    let Some(gpu) = gpu() else { return };
    for index_of_refraction in [1.0, 1.5, 2.4] {
        let mut scene = sphere(Material {
            transmission: 1.0,
            roughness: 0.0,
            index_of_refraction,
            ..Material::default()
        });
        scene.lights.push(environment(None, 0.0));
        let estimate = render(&gpu, &scene, &unlimited(), [48, 48], 64);
        // The sphere fills the middle of the image.
        let on_sphere = |pixel: &usize| {
            let [x, y] = [pixel % 48, pixel / 48].map(|i| i as f64 - 23.5);
            x.hypot(y) < 18.0
        };
        let pixels: Vec<usize> = (0..48 * 48).filter(on_sphere).collect();
        for (c, color) in [1.0, 0.8, 0.6].into_iter().enumerate() {
            let sum: f64 = pixels.iter().map(|&p| f64::from(estimate.mean[p][c])).sum();
            let error = sum / pixels.len() as f64 / (2.0 * color) - 1.0;
            println!(
                "glass of index {index_of_refraction}, channel {c}: {:+.4} %",
                100.0 * error
            );
            assert!(error.abs() < 0.005, "index {index_of_refraction}, channel {c}: {error}");
        }
    }
}

#[test]
fn what_a_white_surface_loses_in_a_white_furnace_is_what_its_facets_shadow() {
    let Some(gpu) = gpu() else { return };
    // Smooth mirrors and diffuse surfaces lose nothing; rough ones lose light that would bounce between facets.
    let cases = [
        ("diffuse", 0.0, 1.0, 0.0, 0.999, 1.001),
        ("mirror", 1.0, 0.0, 0.0, 0.999, 1.001),
        ("metal, roughness 0.1", 1.0, 0.1, 0.0, 0.985, 1.001),
        ("metal, roughness 0.5", 1.0, 0.5, 0.0, 0.9, 0.999),
        ("metal of multiple scattering, roughness 0.5", 1.0, 0.5, 0.0, 0.99, 1.01),
        ("metal of multiple scattering, roughness 1", 1.0, 1.0, 0.0, 0.99, 1.01),
        ("glass, roughness 0.1", 0.0, 0.1, 1.0, 0.985, 1.001),
    ];
    // Glass that hardly bends light is where facets are hardest to tell from directions.
    for index_of_refraction in [1.0, 1.0005, 1.001, 1.01] {
        let mut scene = sphere(Material {
            transmission: 1.0,
            roughness: 0.3,
            index_of_refraction,
            ..Material::default()
        });
        scene.lights.push(environment(None, 0.0));
        let estimate = render(&gpu, &scene, &unlimited(), [32, 32], 64);
        let ratio = mean(&estimate) / (2.0 * 0.8);
        println!("white furnace, rough glass of index {index_of_refraction}: {ratio:.4}");
        assert!((0.98..=1.002).contains(&ratio), "index {index_of_refraction}: {ratio}");
    }
    for (name, metallic, roughness, transmission, least, most) in cases {
        let mut scene = sphere(Material {
            metallic,
            roughness,
            transmission,
            multiple_scattering: name.contains("multiple"),
            ..Material::default()
        });
        scene.lights.push(environment(None, 0.0));
        let estimate = render(&gpu, &scene, &unlimited(), [32, 32], 256);
        let ratio = mean(&estimate) / (2.0 * 0.8);
        println!("white furnace, {name}: {ratio:.4}");
        assert!((least..=most).contains(&ratio), "{name}: {ratio}");
    }
}

#[test]
fn an_environment_image_lights_a_plane_from_where_it_shines() {
    let Some(gpu) = gpu() else { return };
    let (width, height) = (16, 8);
    let mut rgb = vec![[0.05f32, 0.05, 0.05]; width * height];
    // One bright texel, 45 to 67.5 degrees from the zenith.
    rgb[2 * width + 11] = [30.0, 10.0, 20.0];
    let image = EnvironmentImage {
        name: "sky".into(),
        width: width as u32,
        height: height as u32,
        rgb,
    };
    for rotation in [0.0, 2.1] {
        let mut scene = floor(2.0, 0.5, 0.8);
        scene.environments.push(image.clone());
        scene.lights.push(environment(Some(0), rotation));
        // Irradiance: the sum over texels of radiance × ∫ cosθ dω = (φ₁ − φ₀) (sin²θ₁ − sin²θ₀) / 2, upper half only.
        let mut irradiance = [0.0f64; 3];
        for row in 0..height / 2 {
            let edge = |row: usize| (PI * row as f64 / height as f64).sin().powi(2);
            let weight = 2.0 * PI / width as f64 * 0.5 * (edge(row + 1) - edge(row));
            for column in 0..width {
                for (sum, texel) in irradiance.iter_mut().zip(image.rgb[row * width + column]) {
                    *sum += weight * f64::from(texel);
                }
            }
        }
        let estimate = render(&gpu, &scene, &unlimited(), [48, 48], 256);
        for (c, color) in [1.0, 0.8, 0.6].into_iter().enumerate() {
            let expected = 0.5 / PI * irradiance[c] * 2.0 * color;
            let found: f64 = estimate.mean.iter().map(|p| f64::from(p[c])).sum::<f64>() / estimate.mean.len() as f64;
            let error = found / expected - 1.0;
            println!("environment turned by {rotation}, channel {c}: {:+.3} %", 100.0 * error);
            assert!(error.abs() < 0.005, "channel {c}: {error}");
        }
    }
}

/// A box with a bulb, and in it a ball of brass and one of glass.
fn box_with_balls() -> Scene {
    let mut scene = samples::cornell(0.0);
    scene.lights[0].kind = LightKind::Rectangle {
        center: DVec3::new(2.78, 5.4, 2.795),
        half_u: DVec3::new(0.7, 0.0, 0.0),
        half_v: DVec3::new(0.0, 0.0, 0.7),
    };
    let ball = sphere(Material::default()).meshes.remove(0);
    scene.meshes.push(ball);
    for (name, material, at) in [
        (
            "brass",
            Material {
                base_color: [0.9, 0.7, 0.3],
                metallic: 1.0,
                roughness: 0.3,
                ..Material::default()
            },
            DVec3::new(4.2, 0.8, 1.2),
        ),
        (
            "glass",
            Material {
                transmission: 1.0,
                roughness: 0.0,
                ..Material::default()
            },
            DVec3::new(1.9, 2.35, 1.7),
        ),
    ] {
        scene.materials.push(Material {
            name: name.into(),
            ..material
        });
        scene.instances.push(Instance {
            transform: DAffine3::from_scale_rotation_translation(
                DVec3::splat(0.7),
                lightfall::glam::DQuat::IDENTITY,
                at,
            ),
            ..Instance::new(scene.meshes.len() - 1, scene.materials.len() - 1)
        });
    }
    scene
}

#[test]
fn components_add_up_pixel_by_pixel() {
    let Some(gpu) = gpu() else { return };
    let scene = box_with_balls();
    let part = |c| render(&gpu, &scene, &component(c, 5), [48, 48], 16).mean;
    let all = part(PathComponent::All);
    let (direct, indirect) = (part(PathComponent::Direct), part(PathComponent::Indirect));
    let (caustic, specular) = (part(PathComponent::Caustic), part(PathComponent::Specular));
    let sum = |image: &[[f32; 3]]| image.iter().flatten().map(|&x| f64::from(x)).sum::<f64>();
    for pixel in 0..all.len() {
        for c in 0..3 {
            let (whole, parts) = (all[pixel][c], direct[pixel][c] + indirect[pixel][c]);
            assert!((whole - parts).abs() <= 1e-5 * whole, "pixel {pixel}: {whole} {parts}");
            assert!(caustic[pixel][c] <= indirect[pixel][c] * 1.00001, "pixel {pixel}");
            assert!(specular[pixel][c] <= whole * 1.00001, "pixel {pixel}");
            assert!(caustic[pixel][c] == 0.0 || specular[pixel][c] < whole, "pixel {pixel}");
        }
    }
    println!(
        "of all light: direct {:.3}, indirect {:.3}, caustic {:.3}, specular {:.3}",
        sum(&direct) / sum(&all),
        sum(&indirect) / sum(&all),
        sum(&caustic) / sum(&all),
        sum(&specular) / sum(&all)
    );
    assert!(sum(&caustic) > 0.0 && sum(&specular) > 0.0);
}

#[test]
fn the_same_samples_give_the_same_bits_and_others_differ_by_the_standard_error() {
    let Some(gpu) = gpu() else { return };
    let scene = box_with_balls();
    let settings = component(PathComponent::All, 3);
    let mut reference = Reference::new(&gpu, scene.clone(), &settings, 0, [64, 64]).unwrap();
    let mut estimate_of = |samples: u32| {
        for _ in 0..samples {
            reference.render_sample(None).unwrap();
        }
        reference.read().unwrap()
    };
    let first = estimate_of(64);
    let both = estimate_of(64);
    assert_eq!(first, render(&gpu, &scene, &settings, [64, 64], 64));
    // The second half alone: twice the mean of all, less the first half.
    let (mut squares, mut expected) = (0.0, 0.0);
    for pixel in 0..first.mean.len() {
        for c in 0..3 {
            let (a, all) = (f64::from(first.mean[pixel][c]), f64::from(both.mean[pixel][c]));
            squares += (2.0 * all - 2.0 * a).powi(2);
            expected += 2.0 * f64::from(first.standard_error[pixel][c]).powi(2);
        }
    }
    let ratio = squares / expected;
    println!("squared difference of independent halves over what their standard errors say: {ratio:.3}");
    assert!((0.7..1.4).contains(&ratio), "{ratio}");
}

#[test]
fn a_textured_floor_shows_its_texture_and_its_holes() {
    let Some(gpu) = gpu() else { return };
    // Two by two texels, one of them a hole; seen from above, texels meet in the middle of the floor.
    let texels = [
        [255u8, 0, 0, 255],
        [0, 255, 0, 255],
        [0, 0, 255, 255],
        [255, 255, 255, 0],
    ];
    let mut scene = floor(1.0, 1.0, 1.0);
    scene.textures.push(lightfall::scene::Texture {
        name: "four".into(),
        width: 2,
        height: 2,
        srgb: true,
        rgba: texels.concat(),
    });
    scene.meshes[0].tex_coords = vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    scene.materials[0].base_color_texture = Some(0);
    scene.materials[0].alpha_cutoff = Some(0.5);
    scene.lights.push(Light {
        color: [1.0; 3],
        ..environment(None, 0.0)
    });
    // Under a uniform sky of radiance 2 a Lambertian floor of reflectance ρ shows 2 ρ; a hole shows the sky.
    let size = 32;
    let estimate = render(&gpu, &scene, &component(PathComponent::All, 0), [size, size], 256);
    let at = |x: u32, y: u32| estimate.mean[(y * size + x) as usize];
    for (x, y, expected) in [
        (8, 8, [2.0, 0.0, 0.0]),
        (24, 8, [0.0, 2.0, 0.0]),
        (8, 24, [0.0, 0.0, 2.0]),
        (24, 24, [2.0, 2.0, 2.0]),
    ] {
        for (found, expected) in at(x, y).into_iter().zip(expected) {
            // A pixel away from the texel's middle a sixteenth of its neighbours is mixed in.
            assert!((found - expected).abs() < 0.2, "pixel {x}, {y}: {:?}", at(x, y));
        }
    }
    // The hole begins where alpha, interpolated, falls below a half: half-way between the texels' middles.
    let row: Vec<bool> = (0..size).map(|x| at(x, 24).iter().all(|&v| v > 1.9)).collect();
    let holes = row.iter().filter(|&&h| h).count();
    assert!((14..=17).contains(&holes), "{row:?}");
}

#[test]
fn what_does_not_shine_leaves_the_image_black() {
    let Some(gpu) = gpu() else { return };
    let mut dark = samples::cornell(0.0);
    dark.lights.clear();
    let estimate = render(&gpu, &dark, &unlimited(), [16, 16], 4);
    assert!(estimate.mean.iter().flatten().all(|&v| v == 0.0));
    assert_eq!(estimate.relative_variance(), 0.0);
}

#[test]
fn doubling_all_lengths_and_powers_changes_no_bit_of_the_rescaled_image() {
    let Some(gpu) = gpu() else { return };
    let scene = box_with_balls();
    let settings = component(PathComponent::All, 3);
    let nominal = render(&gpu, &scene, &settings, [32, 32], 4);
    for (length, power) in [(40, 0), (-40, 0), (0, 30), (3, -30)] {
        let (length, power) = (2f64.powi(length), 2f64.powi(power));
        let mut scaled = scene.clone();
        for instance in &mut scaled.instances {
            instance.transform = DAffine3::from_scale(DVec3::splat(length)) * instance.transform;
        }
        for camera in &mut scaled.cameras {
            camera.transform.translation *= length;
        }
        for light in &mut scaled.lights {
            if let LightKind::Rectangle { center, half_u, half_v } = &mut light.kind {
                *center *= length;
                *half_u *= length;
                *half_v *= length;
            }
            light.intensity *= power as f32;
        }
        let estimate = render(&gpu, &scaled, &settings, [32, 32], 4);
        for (a, b) in nominal.mean.iter().flatten().zip(estimate.mean.iter().flatten()) {
            assert_eq!(
                *a,
                (f64::from(*b) / power) as f32,
                "lengths × {length}, powers × {power}"
            );
        }
    }
}

/// Adds a mirror of reflectance 0.8, in front of the side from which its corners go around against the clock, to a scene of one
/// mesh and one material.
fn add_mirror(scene: &mut Scene, corners: [DVec3; 4]) {
    scene.meshes.push(Mesh {
        name: "mirror".into(),
        positions: corners.map(|c| c.as_vec3().to_array()).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    });
    scene.materials.push(Material {
        base_color: [0.8; 3],
        metallic: 1.0,
        roughness: 0.0,
        ..Material::default()
    });
    scene.instances.push(Instance::new(1, 1));
}

#[test]
fn what_a_mirror_throws_onto_the_floor_is_the_caustic_and_what_it_hides_is_missing_from_the_direct_light() {
    let Some(gpu) = gpu() else { return };
    let half_view = 0.8;
    let (middle, u, v) = (
        DVec3::new(0.1, 0.6, -0.9),
        DVec3::new(0.7, 0.0, 0.0),
        DVec3::new(0.0, 0.5, 0.0),
    );
    let corners = [-u - v, u - v, u + v, v - u].map(|c| middle + c);
    let mut scene = floor(2.0, 0.6, half_view);
    add_mirror(&mut scene, corners);
    scene.lights.push(Light {
        color: [1.0; 3],
        ..environment(None, 0.0)
    });
    // The mirror shows the sky, whose radiance is 2, from wherever the floor sees it.
    let mirrored = expected_mean(0.6, half_view, |p| 2.0 * polygon_irradiance(p, &corners));
    let unhidden = 0.6 * 2.0 - mirrored;
    for (part, expected, name) in [
        (PathComponent::Caustic, 0.8 * mirrored, "caustic"),
        (PathComponent::Direct, unhidden, "direct"),
        (PathComponent::Indirect, 0.8 * mirrored, "indirect"),
        (PathComponent::All, unhidden + 0.8 * mirrored, "all"),
    ] {
        let estimate = render(&gpu, &scene, &component(part, 1), [64, 64], 256);
        let error = mean(&estimate) / expected - 1.0;
        println!("mirror beside a floor, {name}: {:+.3} %", 100.0 * error);
        assert!(error.abs() < 0.005, "{name}: {error}");
    }
}

#[test]
fn a_mirror_throws_the_light_of_lamps_with_an_extent_as_if_they_stood_behind_it() {
    let Some(gpu) = gpu() else { return };
    let half_view = 0.8;
    let depth = -0.9;
    let lamp = DVec3::new(0.3, 1.0, -0.2);
    let mirrored = lamp.with_z(2.0 * depth - lamp.z);
    let (radius, [inner, outer]) = (0.4, [1.5, 1.55]);
    let sun = DVec3::new(0.3, -1.0, -0.8);
    type Irradiance<'a> = Box<dyn Fn(DVec3) -> f64 + 'a>;
    let cases: Vec<(&str, LightKind, Irradiance)> = vec![
        (
            "sphere",
            LightKind::Point { position: lamp, radius },
            Box::new(|p| cosine_over_square(mirrored, p)),
        ),
        (
            "spot",
            LightKind::Spot {
                position: lamp,
                direction: DVec3::NEG_Y,
                inner_angle: inner,
                outer_angle: outer,
                radius,
            },
            Box::new(|p| mean_over_disc(radius, |offset| spot_irradiance(mirrored + offset, [inner, outer], p))),
        ),
        (
            "sun",
            LightKind::Directional {
                direction: sun,
                angle: 0.4,
            },
            Box::new(|_| -sun.normalize().y),
        ),
    ];
    for (name, kind, irradiance) in cases {
        let mut scene = floor(2.0, 0.6, half_view);
        let (middle, u, v) = (
            DVec3::new(0.0, 20.0, depth),
            DVec3::new(20.0, 0.0, 0.0),
            DVec3::new(0.0, 20.0, 0.0),
        );
        add_mirror(&mut scene, [-u - v, u - v, u + v, v - u].map(|c| middle + c));
        scene.lights.push(Light {
            name: name.into(),
            kind,
            color: [1.0; 3],
            intensity: 1.0,
        });
        let expected = 0.8 * expected_mean(0.6, half_view, irradiance);
        let estimate = render(&gpu, &scene, &component(PathComponent::Caustic, 1), [64, 64], 1024);
        let error = mean(&estimate) / expected - 1.0;
        println!("mirror beside a floor under a {name}: {:+.3} %", 100.0 * error);
        assert!(error.abs() < 0.01, "{name}: {error}");
    }
}

/// A lamp of radiance 4 over a floor: where it hangs, half of two of its edges, and its corners.
fn lamp_over_floor() -> (DVec3, [DVec3; 2], [DVec3; 4]) {
    let (middle, u, v) = (
        DVec3::new(0.1, 0.9, 0.0),
        DVec3::new(0.4, 0.0, 0.0),
        DVec3::new(0.0, 0.0, 0.4),
    );
    (middle, [u, v], [-u - v, u - v, u + v, v - u].map(|c| middle + c))
}

#[test]
fn a_lamp_set_into_a_ceiling_is_not_shadowed_by_it() {
    let Some(gpu) = gpu() else { return };
    let half_view = 0.8;
    let (middle, [u, v], corners) = lamp_over_floor();
    let mut scene = floor(2.0, 0.6, half_view);
    scene.cameras[0].transform.translation.y = 0.5;
    scene.meshes.push(scene.meshes[0].clone());
    scene.materials.push(Material::diffuse("black", [0.0; 3]));
    scene.instances.push(Instance {
        transform: DAffine3::from_translation(DVec3::new(0.0, middle.y, 0.0)),
        ..Instance::new(1, 1)
    });
    scene.lights.push(Light {
        name: "lamp".into(),
        kind: LightKind::Rectangle {
            center: middle,
            half_u: u,
            half_v: v,
        },
        color: [1.0; 3],
        intensity: 4.0,
    });
    let expected = expected_mean(0.6, half_view, |p| 4.0 * polygon_irradiance(p, &corners));
    let estimate = render(&gpu, &scene, &component(PathComponent::All, 0), [64, 64], 128);
    let error = mean(&estimate) / expected - 1.0;
    println!("lamp flush with a ceiling: {:+.3} %", 100.0 * error);
    assert!(error.abs() < 0.002, "{error}");
}

#[test]
fn a_lamp_does_not_shine_from_its_holes() {
    let Some(gpu) = gpu() else { return };
    let half_view = 0.8;
    let (middle, [u, v], corners) = lamp_over_floor();
    let mut scene = floor(2.0, 0.6, half_view);
    scene.cameras[0].transform.translation.y = 0.5;
    scene.meshes.push(Mesh {
        name: "lamp".into(),
        positions: corners.map(|c| c.as_vec3().to_array()).to_vec(),
        tex_coords: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    });
    // The right half is a hole. Its edges are where alpha, interpolated and repeated, is a half: between two texels.
    let rgba = (0..64u32 * 64).flat_map(|i| [0, 0, 0, if i % 64 < 32 { 255 } else { 0 }]);
    scene.textures.push(lightfall::scene::Texture {
        name: "half".into(),
        width: 64,
        height: 64,
        srgb: true,
        rgba: rgba.collect(),
    });
    scene.materials.push(Material {
        emission: [4.0; 3],
        base_color_texture: Some(0),
        alpha_cutoff: Some(0.5),
        ..Material::diffuse("lamp", [0.0; 3])
    });
    scene.instances.push(Instance::new(1, 1));
    let left = [-u - v, -v, v, v - u].map(|c| middle + c);
    let expected = expected_mean(0.6, half_view, |p| 4.0 * polygon_irradiance(p, &left));
    let estimate = render(&gpu, &scene, &component(PathComponent::All, 0), [64, 64], 128);
    let error = mean(&estimate) / expected - 1.0;
    println!("lamp of which half is a hole: {:+.3} %", 100.0 * error);
    assert!(error.abs() < 0.005, "{error}");
}
