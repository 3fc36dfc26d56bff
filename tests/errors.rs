//! Bad input: every variant of `Error` is provoked, says what and where, and leaves no validation error behind. On a
//! device that does nothing, so they run anywhere.

use lightfall::frame::{GiRenderer, Settings};
use lightfall::glam::{DAffine3, DVec3, Vec3};
use lightfall::pass::{PhotonSplatter, PhotonSplatterConfig, SplatShape};
use lightfall::resource::{
    EnvMaps, GBuffer, GBufferViews, Irradiance, Lights, MAX_LIGHTS, MeshGeometry, NormalEncoding, Photons, Radiance,
    Visibility,
};
use lightfall::scene::{
    EmissiveTriangle, EnvironmentImage, Light, LightKind, LightSources, Scene, SceneBounds, SceneSummary, UnitFrame,
    samples,
};
use lightfall::{Error, Timestamps, creation_count, wgpu};
use proptest::prelude::*;
use proptest::test_runner::{FileFailurePersistence, RngSeed};

/// Runs on a fresh device and fails on any validation error.
fn on_device<T>(body: impl FnOnce(&wgpu::Device, &wgpu::Queue) -> T) -> T {
    let (device, queue) = wgpu::Device::noop(&wgpu::DeviceDescriptor::default());
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let result = body(&device, &queue);
    let error = pollster::block_on(scope.pop());
    assert!(error.is_none(), "{error:?}");
    result
}

fn refusal(change: impl FnOnce(&mut Scene)) -> String {
    let mut scene = samples::cornell(0.0);
    change(&mut scene);
    let error = scene.validate().unwrap_err();
    assert!(matches!(error, Error::InvalidScene { .. }), "{error:?}");
    // The GPU side refuses the same before it makes anything of it.
    let by_geometry = on_device(|device, queue| MeshGeometry::new(device, queue, &scene)).unwrap_err();
    assert_eq!(by_geometry, error);
    error.to_string()
}

/// Of a rectangle with these half sides.
fn lamp(half_u: DVec3, half_v: DVec3) -> String {
    refusal(|scene| {
        scene.lights[0].kind = LightKind::Rectangle {
            center: DVec3::ONE,
            half_u,
            half_v,
        }
    })
}

/// Of environment lights with these images and rotations, in a scene with one image.
fn surroundings(lights: &[(Option<usize>, f64)]) -> String {
    refusal(|scene| {
        scene.environments.push(EnvironmentImage {
            name: String::new(),
            width: 1,
            height: 1,
            rgb: vec![[1.0; 3]],
        });
        for (index, &(image, rotation)) in lights.iter().enumerate() {
            scene.lights.push(Light {
                name: format!("sky light {index}"),
                kind: LightKind::Environment { image, rotation },
                color: [1.0; 3],
                intensity: 1.0,
            });
        }
    })
}

/// Of a scene with an image of its surroundings.
fn sky(change: impl FnOnce(&mut EnvironmentImage)) -> String {
    refusal(|scene| {
        let mut sky = EnvironmentImage {
            name: "sky".into(),
            width: 3,
            height: 2,
            rgb: vec![[1.0; 3]; 6],
        };
        change(&mut sky);
        scene.environments.push(sky);
    })
}

#[test]
fn a_bad_scene_is_refused_with_item_and_field_named() {
    let cases: Vec<(String, &[&str])> = vec![
        (
            refusal(|s| s.meshes[5].positions[7][1] = f32::NAN),
            &["mesh", "short block", "position of vertex 7"],
        ),
        (
            refusal(|s| s.meshes[0].normals[2] = [f32::INFINITY; 3]),
            &["floor", "normal of vertex 2"],
        ),
        (
            refusal(|s| s.meshes[0].tex_coords[1][0] = f32::NAN),
            &["floor", "tex_coord of vertex 1"],
        ),
        (refusal(|s| s.meshes[1].indices[4] = 99), &["ceiling", "index 4", "99"]),
        (
            refusal(|s| s.meshes[1].indices.truncate(5)),
            &["ceiling", "multiple of three"],
        ),
        (
            refusal(|s| s.meshes[1].normals.truncate(3)),
            &["ceiling", "normals", "4 vertices"],
        ),
        (
            refusal(|s| s.instances[3].mesh = 70),
            &["instance", "green wall", "mesh"],
        ),
        (
            refusal(|s| s.instances[3].material = 70),
            &["instance", "green wall", "material"],
        ),
        (
            refusal(|s| s.instances[3].transform.translation.x = f64::NAN),
            &["green wall", "transform"],
        ),
        (
            refusal(|s| s.materials[1].base_color[0] = 1.5),
            &["material", "red", "base_color red", "1.5"],
        ),
        (refusal(|s| s.materials[1].roughness = f32::NAN), &["red", "roughness"]),
        (refusal(|s| s.materials[1].emission = [-1.0; 3]), &["red", "emission"]),
        (
            refusal(|s| s.materials[1].index_of_refraction = 0.5),
            &["red", "index_of_refraction"],
        ),
        (
            refusal(|s| s.materials[1].base_color_texture = Some(0)),
            &["red", "base_color_texture"],
        ),
        (
            refusal(|s| s.lights[0].intensity = f32::INFINITY),
            &["light", "bulb", "intensity"],
        ),
        (refusal(|s| s.lights[0].color[2] = -0.1), &["bulb", "color"]),
        (
            refusal(|s| s.cameras[0].transform.translation.y = f64::NAN),
            &["camera", "transform"],
        ),
        (
            refusal(|s| {
                s.lights[0].kind = LightKind::Spot {
                    position: DVec3::ZERO,
                    direction: DVec3::X,
                    inner_angle: 1.0,
                    outer_angle: 0.5,
                    radius: 0.0,
                }
            }),
            &["bulb", "cone"],
        ),
        (
            refusal(|s| {
                s.lights[0].kind = LightKind::Directional {
                    direction: DVec3::ZERO,
                    angle: 0.0,
                }
            }),
            &["bulb", "direction"],
        ),
        (
            refusal(|s| {
                s.textures.push(lightfall::scene::Texture {
                    name: "wood".into(),
                    width: 2,
                    height: 2,
                    srgb: true,
                    rgba: vec![0; 15],
                })
            }),
            &["texture", "wood", "15", "16"],
        ),
        (lamp(DVec3::X, 2.0 * DVec3::X), &["light", "bulb", "half_u and half_v"]),
        // Parallel but for rounding.
        (
            lamp(DVec3::new(0.1, 0.2, 0.7), 3.1 * DVec3::new(0.1, 0.2, 0.7)),
            &["bulb", "half_u and half_v", "not parallel"],
        ),
        (lamp(DVec3::ZERO, DVec3::X), &["bulb", "half_u and half_v", "not zero"]),
        (
            lamp(DVec3::X, DVec3::new(0.0, f64::NAN, 0.0)),
            &["bulb", "half_u and half_v", "NaN"],
        ),
        (
            lamp(DVec3::X, f64::INFINITY * DVec3::Y),
            &["bulb", "half_u and half_v", "inf"],
        ),
        (
            lamp(1e200 * DVec3::X, 1e200 * DVec3::Y),
            &["bulb", "half_u and half_v", "finite"],
        ),
        (
            refusal(|s| {
                s.lights[0].kind = LightKind::Rectangle {
                    center: DVec3::new(0.0, f64::NEG_INFINITY, 0.0),
                    half_u: DVec3::X,
                    half_v: DVec3::Z,
                }
            }),
            &["bulb", "center", "-inf"],
        ),
        (
            surroundings(&[(None, f64::NAN)]),
            &["light", "sky light 0", "rotation", "NaN"],
        ),
        (
            surroundings(&[(Some(1), 0.0)]),
            &["sky light 0", "image", "is 1", "1 environment images"],
        ),
        (
            surroundings(&[(None, 0.0), (Some(0), 0.0)]),
            &["sky light 1", "second environment", "one at most"],
        ),
        (sky(|sky| sky.width = 0), &["environment", "sky", "size", "0×2"]),
        (sky(|sky| sky.height = 0), &["sky", "size", "3×0"]),
        (sky(|sky| sky.rgb.truncate(5)), &["sky", "rgb", "5", "6"]),
        (sky(|sky| sky.rgb[4][2] = f32::NAN), &["sky", "texel (1, 1)", "NaN"]),
        (sky(|sky| sky.rgb[2][0] = -1.0), &["sky", "texel (2, 0)", "-1"]),
        (
            sky(|sky| sky.rgb[0][1] = f32::INFINITY),
            &["sky", "texel (0, 0)", "inf"],
        ),
    ];
    for (message, words) in cases {
        for word in words {
            assert!(message.contains(word), "{word:?} is not in {message:?}");
        }
    }
}

#[test]
fn a_region_without_extent_is_refused() {
    let at = DVec3::new(1.0, 2.0, 3.0);
    for (min, max) in [(at, at), (at, -at), (at, DVec3::splat(f64::NAN)), (at, DVec3::INFINITY)] {
        assert!(matches!(SceneBounds::new(min, max), Err(Error::InvalidBounds { .. })));
    }
    assert!(matches!(
        SceneSummary::of(&Scene::default()),
        Err(Error::InvalidBounds { .. })
    ));
    let mut point = samples::plane();
    point.instances[0].transform = DAffine3::from_scale(DVec3::ZERO);
    assert!(matches!(point.validate(), Err(Error::InvalidBounds { .. })));
}

#[test]
fn radiance_beyond_f32_asks_for_a_pre_exposure() {
    let bounds = SceneBounds::new(DVec3::splat(-1e25), DVec3::splat(1e25)).unwrap();
    let frame = UnitFrame::new(&bounds, 1.0).unwrap();
    assert!(matches!(
        frame.output_scale(1.0),
        Err(Error::UnrepresentableRadiance { .. })
    ));
    assert!(frame.output_scale(1e50).is_ok());
}

#[test]
fn settings_out_of_range_are_refused_before_anything_is_made() {
    let settings = Settings {
        bounces: 65,
        ..Settings::fast()
    };
    let error = on_device(|device, _| GiRenderer::new(device, &settings)).unwrap_err();
    assert!(
        matches!(&error, Error::InvalidSetting { key, .. } if key == "bounces"),
        "{error}"
    );
    let error = Settings::fast().set("bounce", "1").unwrap_err();
    assert!(
        matches!(&error, Error::UnknownSetting { known, .. } if known.contains("bounces")),
        "{error}"
    );
}

/// A value as somebody might write it: of another key, a number of any size, or no sense at all.
fn setting_text() -> impl Strategy<Value = String> {
    let of_others = Settings::balanced().entries().into_iter().map(|entry| entry.1);
    prop_oneof![
        prop::sample::select(of_others.collect::<Vec<_>>()),
        any::<f32>().prop_map(|number| number.to_string()),
        any::<i64>().prop_map(|number| number.to_string()),
        ".*",
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 4000,
        rng_seed: RngSeed::Fixed(7),
        failure_persistence: Some(Box::new(FileFailurePersistence::WithSource("regressions"))),
        ..ProptestConfig::default()
    })]

    #[test]
    fn settings_of_any_text_are_taken_whole_or_refused_by_name(key in 0..200usize, text in setting_text()) {
        let before = Settings::balanced();
        let entries = before.entries();
        let key = entries[key % entries.len()].0;
        let mut settings = before.clone();
        match settings.set(key, &text) {
            Ok(()) => {
                settings.validate().unwrap();
                // What it says of itself makes the same again.
                let mut again = Settings::fast();
                for (key, value) in settings.entries() {
                    again.set(key, &value).unwrap();
                }
                prop_assert_eq!(again, settings);
            }
            Err(Error::InvalidSetting { key: named, .. }) => {
                prop_assert_eq!(&named, key);
                prop_assert_eq!(settings, before);
            }
            Err(error) => panic!("{error}"),
        }
    }
}

fn texture(device: &wgpu::Device, format: wgpu::TextureFormat, size: [u32; 2], samples: u32) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: size[0],
            height: size[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: samples,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

#[test]
fn views_of_a_host_that_do_not_fit_are_refused_by_name() {
    use wgpu::TextureFormat as F;
    on_device(|device, _| {
        let good = || GBufferViews {
            depth: texture(device, F::Depth32Float, [8, 8], 1),
            normal: texture(device, F::Rgba16Float, [8, 8], 1),
            normal_encoding: NormalEncoding::Octahedral,
            base_color: texture(device, F::Rgba8UnormSrgb, [8, 8], 1),
            emission: texture(device, F::Rgba16Float, [8, 8], 1),
            surfaces: Some(texture(device, F::R16Uint, [8, 8], 1)),
            rectangle: Some([2, 2, 6, 6]),
        };
        let g_buffer = GBuffer::from_views(device, good()).unwrap();
        assert_eq!(g_buffer.size(), [6, 6]);
        // A host without emission has one texel of it.
        let emission = texture(device, F::Rgba8Unorm, [1, 1], 1);
        GBuffer::from_views(device, GBufferViews { emission, ..good() }).unwrap();
        let refused = |change: fn(&wgpu::Device, &mut GBufferViews), what: &str, property_wanted: &str| {
            let mut views = good();
            change(device, &mut views);
            match GBuffer::from_views(device, views).unwrap_err() {
                Error::IncompatibleView { resource, property, .. } => {
                    assert!(
                        resource.contains(what) && property == property_wanted,
                        "{resource} {property}"
                    );
                }
                other => panic!("{other:?}"),
            }
        };
        refused(|d, v| v.depth = texture(d, F::Rgba8Unorm, [8, 8], 1), "depth", "format");
        refused(
            |d, v| v.normal = texture(d, F::Rgba16Float, [8, 8], 4),
            "normal",
            "sample count",
        );
        refused(
            |d, v| v.base_color = texture(d, F::Rgba16Float, [8, 4], 1),
            "base colour",
            "size",
        );
        refused(
            |d, v| v.emission = texture(d, F::Rgba16Float, [1, 8], 1),
            "emission",
            "size",
        );
        refused(
            |d, v| v.surfaces = Some(texture(d, F::R32Float, [8, 8], 1)),
            "surfaces",
            "format",
        );
        refused(
            |d, v| v.surfaces = Some(texture(d, F::R16Uint, [1, 1], 1)),
            "surfaces",
            "size",
        );
        refused(|_, v| v.rectangle = Some([4, 4, 5, 1]), "rectangle", "size");
        refused(|_, v| v.rectangle = Some([0, 0, 0, 1]), "rectangle", "size");
        refused(|_, v| v.rectangle = Some([u32::MAX, 0, 2, 1]), "rectangle", "size");

        let rgba8 = texture(device, F::Rgba8Unorm, [8, 8], 1);
        assert!(matches!(
            EnvMaps::from_view(device, &rgba8),
            Err(Error::IncompatibleView { property: "format", .. })
        ));
        let one_layer = texture(device, F::Rgba32Uint, [8, 8], 1);
        let error = EnvMaps::from_view(device, &one_layer).unwrap_err();
        assert!(
            matches!(
                error,
                Error::IncompatibleView {
                    property: "layer count",
                    ..
                }
            ),
            "{error}"
        );
        assert!(matches!(
            Visibility::from_view(&rgba8),
            Err(Error::IncompatibleView { property: "format", .. })
        ));
        let no_spare = texture(device, F::R32Float, [8, 8], 1);
        assert!(matches!(
            Visibility::from_view(&no_spare),
            Err(Error::IncompatibleView {
                property: "layer count",
                ..
            })
        ));
        assert!(matches!(
            Irradiance::from_view(&rgba8),
            Err(Error::IncompatibleView { .. })
        ));
        assert!(matches!(
            Irradiance::new(device, [8, 8], F::R32Float),
            Err(Error::IncompatibleView { .. })
        ));
        let multisampled = texture(device, F::Rgba16Float, [8, 8], 4);
        assert!(matches!(
            Radiance::from_view(&multisampled),
            Err(Error::IncompatibleView { .. })
        ));

        let small = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 480,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        assert!(Photons::from_buffer(&small, 5, 1).is_ok());
        assert!(matches!(
            Photons::from_buffer(&small, 6, 1),
            Err(Error::CountMismatch { .. })
        ));
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 480,
            usage: wgpu::BufferUsages::UNIFORM,
            mapped_at_creation: false,
        });
        assert!(matches!(
            Photons::from_buffer(&uniform, 5, 1),
            Err(Error::IncompatibleView { .. })
        ));
    });
}

#[test]
fn what_does_not_fit_the_device_is_refused_with_the_limit() {
    on_device(|device, queue| {
        let limits = device.limits();
        let most = Photons::max_count(&limits, 3);
        assert!(Photons::new(device, most, 3).is_ok());
        let too_many = |error: Error| match error {
            Error::LimitExceeded { needed, limit, .. } => assert!(needed > limit),
            other => panic!("{other:?}"),
        };
        too_many(Photons::new(device, most + 1, 3).unwrap_err());
        too_many(EnvMaps::new(device, 43, 16).unwrap_err());
        too_many(GBuffer::new(device, [limits.max_texture_dimension_2d + 1, 1]).unwrap_err());
        assert!(matches!(GBuffer::new(device, [0, 4]), Err(Error::LimitExceeded { .. })));
        let scene = samples::cornell(0.0);
        let settings = Settings {
            photons: most + 1,
            ..Settings::balanced()
        };
        let mut renderer = GiRenderer::new(device, &settings).unwrap();
        too_many(
            renderer
                .set_scene(queue, &SceneSummary::of(&scene).unwrap(), &scene.lights)
                .unwrap_err(),
        );
    });
}

#[test]
fn features_that_the_device_lacks_are_named_with_an_alternative() {
    on_device(|device, _| {
        let config = PhotonSplatterConfig {
            shape: SplatShape::Quads,
            blend_format: Some(wgpu::TextureFormat::Rgba32Float),
            ..Default::default()
        };
        let error = PhotonSplatter::new(device, &config).unwrap_err();
        assert!(matches!(error, Error::MissingFeatures { .. }), "{error}");
        assert!(error.to_string().contains("rgba16float"), "{error}");
        assert!(matches!(Timestamps::new(device), Err(Error::MissingFeatures { .. })));
    });
}

#[test]
fn counts_that_do_not_agree_are_named() {
    on_device(|device, queue| {
        let mut env_maps = EnvMaps::new(device, 2, 8).unwrap();
        let error = env_maps.set_centers(queue, &[Vec3::ZERO; 3]).unwrap_err();
        assert!(
            matches!(
                error,
                Error::CountMismatch {
                    expected: 2,
                    found: 3,
                    ..
                }
            ),
            "{error}"
        );
        let frame = UnitFrame::new(&SceneBounds::new(DVec3::ZERO, DVec3::ONE).unwrap(), 1.0).unwrap();
        let lights = vec![Light::point(DVec3::ZERO, 1.0, [1.0; 3]); MAX_LIGHTS + 1];
        let sources = LightSources {
            lights: &lights,
            ..Default::default()
        };
        let error = Lights::new(device)
            .unwrap()
            .write(queue, &frame, &sources, 10)
            .unwrap_err();
        assert!(matches!(error, Error::CountMismatch { .. }), "{error}");
    });
}

#[test]
fn a_summary_that_contradicts_itself_is_refused() {
    on_device(|device, queue| {
        let scene = samples::cornell(0.0);
        let summary = SceneSummary::of(&scene).unwrap();
        let mut renderer = GiRenderer::new(device, &Settings::fast()).unwrap();
        let area = |area| SceneSummary {
            area,
            ..summary.clone()
        };
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = renderer.set_scene(queue, &area(bad), &scene.lights).unwrap_err();
            assert!(error.to_string().contains("area"), "{error}");
        }
        let error = renderer.set_scene(queue, &summary, &[]).unwrap_err();
        assert!(matches!(error, Error::CountMismatch { .. }), "{error}");
        let mut other_kind = scene.lights.clone();
        other_kind[0].kind = LightKind::Environment {
            image: None,
            rotation: 0.0,
        };
        let error = renderer.set_scene(queue, &summary, &other_kind).unwrap_err();
        assert!(error.to_string().contains("environment lights"), "{error}");
        let unending = EmissiveTriangle {
            corners: [DVec3::ZERO, DVec3::X, DVec3::splat(f64::NAN)],
            radiance: [1.0; 3],
        };
        let shining = SceneSummary {
            emissive_triangles: vec![unending],
            ..summary.clone()
        };
        let error = renderer.set_scene(queue, &shining, &scene.lights).unwrap_err();
        assert!(error.to_string().contains("emissive_triangles[0]"), "{error}");
        let mut broken = scene;
        broken.instances[0].mesh = 99;
        assert!(matches!(SceneSummary::of(&broken), Err(Error::InvalidScene { .. })));
        broken.instances[0].mesh = 0;
        broken.meshes[0].indices[0] = 99;
        assert!(matches!(SceneSummary::of(&broken), Err(Error::InvalidScene { .. })));
        broken.meshes[0].indices[0] = 0;
        broken.meshes[0].positions[0][0] = f32::NAN;
        assert!(SceneSummary::of(&broken).is_err());
    });
}

#[test]
fn moving_an_instance_that_is_not_there_is_refused() {
    on_device(|device, queue| {
        let mut geometry = MeshGeometry::new(device, queue, &samples::plane()).unwrap();
        assert!(geometry.set_transform(1, DAffine3::IDENTITY).is_err());
        let nowhere = DAffine3::from_translation(DVec3::NAN);
        assert!(geometry.set_transform(0, nowhere).is_err());
        assert_eq!(
            geometry.instances()[0].transform,
            DAffine3::IDENTITY,
            "a refused move moves nothing"
        );
    });
}

#[test]
fn reading_back_from_a_lost_device_is_an_error() {
    let (device, queue) = wgpu::Device::noop(&wgpu::DeviceDescriptor::default());
    device.on_uncaptured_error(std::sync::Arc::new(|_| {}));
    let photons = Photons::new(&device, 10, 1).unwrap();
    device.destroy();
    let error = lightfall::read_buffer_blocking::<u32>(&device, &queue, photons.buffer()).unwrap_err();
    assert!(matches!(error, Error::ReadBack { .. }), "{error}");
}

#[cfg(feature = "bvh")]
#[test]
fn a_frame_that_needs_triangles_and_has_none_is_refused_before_anything_is_recorded() {
    use lightfall::frame::{SceneInputs, TracerKind};
    use lightfall::resource::CameraView;
    for tracer_kind in [TracerKind::Bvh, TracerKind::Hybrid] {
        on_device(|device, queue| {
            let settings = Settings {
                tracer_kind,
                ..Settings::fast()
            };
            let scene = samples::cornell(0.0);
            let mut geometry = MeshGeometry::new(device, queue, &scene).unwrap();
            let mut renderer = GiRenderer::new(device, &settings).unwrap();
            let summary = SceneSummary::of(&scene).unwrap();
            let mut record = |lights: usize| {
                let summary = SceneSummary {
                    lights,
                    ..summary.clone()
                };
                let frame = renderer.set_scene(queue, &summary, &scene.lights[..lights]).unwrap();
                let mut cameras = [CameraView::new(&frame, &scene.cameras[0], [8, 8], [0.0; 2])];
                renderer.prepare(queue, &mut geometry, &mut cameras).unwrap();
                let mut encoder = device.create_command_encoder(&Default::default());
                let inputs = SceneInputs {
                    queue,
                    geometry: &geometry,
                    bvh: None,
                    sample_offset: 0,
                    timestamps: None,
                };
                let before = creation_count();
                let result = renderer.record_scene(&mut encoder, &inputs);
                (result, creation_count() == before)
            };
            let (refused, nothing_recorded) = record(1);
            let error = refused.unwrap_err();
            assert!(matches!(error, Error::MissingInput { .. }), "{error}");
            for word in ["BvhTracer", "SceneInputs::bvh", "tracer.kind"] {
                assert!(error.to_string().contains(word), "{error}");
            }
            assert!(nothing_recorded);
            // In the dark no ray is traced.
            assert_eq!(record(0).0, Ok(()));
        });
    }
}
