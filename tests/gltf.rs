//! The glTF loader of the examples: conventions, and what broken files get.

#[path = "../examples/common/mod.rs"]
mod common;

use common::gltf_scene::{load, load_slice};
use lightfall::glam::{DVec3, Vec3};
use lightfall::scene::{LightKind, Projection, Scene};
use serde_json::{Value, json};
use std::f64::consts::FRAC_PI_2;
use std::io::Cursor;
use std::path::Path;

/// A binary glTF file of two chunks.
fn glb(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |x: usize| (x as u32).to_le_bytes();
    let mut file = b"glTF".to_vec();
    file.extend([word(2), word(12 + 8 + text.len() + 8 + bin.len()), word(text.len())].concat());
    file.extend(b"JSON");
    file.extend(&text);
    file.extend(word(bin.len()));
    file.extend(b"BIN\0");
    file.extend(&bin);
    file
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A file under construction: what a test adds goes into the one buffer.
struct Asset {
    json: Value,
    bin: Vec<u8>,
}

impl Asset {
    fn new() -> Self {
        Self {
            json: json!({
                "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0,
                "nodes": [], "meshes": [], "materials": [], "cameras": [], "images": [], "textures": [],
                "animations": [], "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}],
            }),
            bin: Vec::new(),
        }
    }

    /// A triangle in the plane z = 0 on node 0, with 16-bit indices in accessor 1.
    fn triangle() -> Self {
        let mut asset = Self::new();
        asset.accessor(&floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]), "VEC3", 5126, 3);
        asset.accessor(&[0, 0, 1, 0, 2, 0], "SCALAR", 5123, 3);
        asset.json["meshes"] = json!([{"name": "leaf", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}]);
        asset.json["nodes"] = json!([{"name": "branch", "mesh": 0}]);
        asset
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend(bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.bin.len());
        self.push("bufferViews", view)
    }

    fn accessor(&mut self, bytes: &[u8], kind: &str, component: u32, count: usize) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "type": kind, "componentType": component, "count": count});
        self.push("accessors", accessor)
    }

    fn push(&mut self, list: &str, item: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(item);
        list.len() - 1
    }

    /// One animation of node 0: `path` by `interpolation` over keyframes.
    fn animate(&mut self, path: &str, interpolation: &str, times: &[f32], values: &[f32]) {
        let width = if path == "rotation" { 4 } else { 3 };
        let kind = format!("VEC{width}");
        let input = self.accessor(&floats(times), "SCALAR", 5126, times.len());
        let output = self.accessor(&floats(values), &kind, 5126, values.len() / width);
        let animation = json!({
            "samplers": [{"input": input, "output": output, "interpolation": interpolation}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}],
        });
        self.push("animations", animation);
    }

    /// A 2×1 image, red and green, as texture 0.
    fn texture(&mut self) {
        let view = self.view(&png());
        self.push(
            "images",
            json!({"bufferView": view, "mimeType": "image/png", "name": "flag"}),
        );
        self.push("textures", json!({"source": 0}));
    }

    fn bytes(&self) -> Vec<u8> {
        glb(&self.json, &self.bin)
    }

    fn load_at(&self, time: f64) -> Scene {
        load_slice(&self.bytes(), None, "test", time).unwrap()
    }

    fn load(&self) -> Scene {
        self.load_at(0.0)
    }

    /// The error that this file gives; it begins with the file's name.
    #[track_caller]
    fn error(&self) -> String {
        error_of(&self.bytes())
    }

    /// Everything that the loader reads, in one file.
    fn rich() -> Self {
        let mut asset = Self::triangle();
        asset.texture();
        asset.animate("rotation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 1., 0., 0., 1., 0.]);
        asset.animate("translation", "CUBICSPLINE", &[0.0, 1.0], &[0.5; 18]);
        asset.json["materials"] = json!([{
            "alphaMode": "MASK", "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0},
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0}},
        }]);
        asset.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        asset.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]);
        asset.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}});
        asset.json["nodes"] = json!([
            {"mesh": 0, "children": [1, 2]}, {"camera": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}},
        ]);
        asset
    }
}

#[track_caller]
fn error_of(bytes: &[u8]) -> String {
    let error = load_slice(bytes, None, "broken.glb", 0.0).expect_err("a broken file loads");
    assert!(error.starts_with("broken.glb: ") && !error.contains('\n'), "{error}");
    assert!(!error.contains("panic"), "{error}");
    error
}

#[track_caller]
fn assert_says(error: &str, parts: &[&str]) {
    for part in parts {
        assert!(error.contains(part), "{error:?} does not say {part:?}");
    }
}

fn png() -> Vec<u8> {
    let image = image::RgbaImage::from_raw(2, 1, vec![255, 0, 0, 255, 0, 255, 0, 128]).unwrap();
    let mut bytes = Vec::new();
    image
        .write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png)
        .unwrap();
    bytes
}

/// Where a vertex of the first instance is in the world.
fn vertex(scene: &Scene, index: usize) -> DVec3 {
    let instance = &scene.instances[0];
    let position = scene.meshes[instance.mesh].positions[index];
    instance.transform.transform_point3(Vec3::from(position).as_dvec3())
}

#[track_caller]
fn assert_close(found: DVec3, expected: [f64; 3]) {
    assert!(
        (found - DVec3::from(expected)).length() < 1e-6,
        "{found} is not {expected:?}"
    );
}

// ---- Geometry -----------------------------------------------------------------------------------------------------

#[test]
fn nested_transforms_compose_in_64_bits() {
    let mut asset = Asset::triangle();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    asset.json["nodes"] = json!([
        {"translation": [100_000_000.25, 0, 0], "children": [1]},
        {"rotation": [0, 0, half, half], "children": [2]},
        {"matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 5, 1], "mesh": 0},
    ]);
    let scene = asset.load();
    assert_eq!(vertex(&scene, 0), DVec3::new(100_000_000.25, 0.0, 5.0));
    assert_close(vertex(&scene, 1) - vertex(&scene, 0), [0.0, 2.0, 0.0]);
    assert_close(vertex(&scene, 2) - vertex(&scene, 0), [-2.0, 0.0, 0.0]);
}

#[test]
fn a_mesh_used_twice_is_stored_once() {
    let mut asset = Asset::triangle();
    asset.json["nodes"] = json!([{"children": [1, 2]}, {"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}]);
    let scene = asset.load();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    assert_eq!((&*scene.instances[0].name, &*scene.instances[1].name), ("a", "b"));
    assert_eq!(scene.meshes[0].name, "leaf");
}

#[test]
fn strips_and_fans_become_lists_and_lines_nothing() {
    let indices = |mode: u32| {
        let mut asset = Asset::triangle();
        let square = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.]);
        asset.accessor(&square, "VEC3", 5126, 4);
        asset.json["meshes"][0]["primitives"] = json!([{"attributes": {"POSITION": 2}, "mode": mode}]);
        asset.load().meshes.first().map(|mesh| mesh.indices.clone())
    };
    assert_eq!(indices(5).unwrap(), [0, 1, 2, 1, 3, 2]);
    assert_eq!(indices(6).unwrap(), [1, 2, 0, 2, 3, 0]);
    assert_eq!(indices(1), None);
    assert_eq!(indices(0), None);
}

#[test]
fn interleaved_and_quantised_attributes_are_read() {
    let mut asset = Asset::triangle();
    // Per vertex: position as 8-bit integers, a byte of padding, texture coordinate as normalised 16-bit integers.
    let vertices = [
        [0u8, 0, 0, 0, 0, 0, 255, 255],
        [1, 0, 0, 0, 255, 255, 0, 0],
        [0, 255, 0, 0, 0, 0, 0, 0],
    ];
    let view = asset.view(vertices.as_flattened());
    asset.json["bufferViews"][view]["byteStride"] = json!(8);
    asset.push(
        "accessors",
        json!({"bufferView": view, "type": "VEC3", "componentType": 5120, "count": 3}),
    );
    asset.push(
        "accessors",
        json!({
            "bufferView": view, "byteOffset": 4, "type": "VEC2", "componentType": 5123, "count": 3, "normalized": true,
        }),
    );
    asset.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    asset.json["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 2, "TEXCOORD_0": 3});
    let mesh = &asset.load().meshes[0];
    assert_eq!(mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
    assert_eq!(mesh.tex_coords, [[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
}

#[test]
fn a_file_without_scenes_shows_its_root_nodes() {
    let mut asset = Asset::triangle();
    asset.json["nodes"] = json!([{"mesh": 0}, {"translation": [0, 7, 0], "children": [0]}]);
    asset.json["scenes"] = json!([]);
    asset.json["scene"] = Value::Null;
    let scene = asset.load();
    assert_eq!(scene.instances.len(), 1);
    assert_close(vertex(&scene, 0), [0.0, 7.0, 0.0]);
}

#[test]
fn an_empty_scene_is_no_error() {
    let scene = load_slice(br#"{"asset": {"version": "2.0"}}"#, None, "empty.gltf", 0.0).unwrap();
    assert!(scene.instances.is_empty() && scene.cameras.is_empty() && scene.lights.is_empty());
}

// ---- Lights and cameras -------------------------------------------------------------------------------------------

#[test]
fn extras_give_lights_an_extent() {
    let mut asset = Asset::new();
    let with = |lights: Value| json!({"KHR_lights_punctual": {"lights": lights}});
    asset.json["extensions"] = with(json!([
        {"type": "point", "extras": {"radius": 0.25, "angle": 9}},
        {"type": "spot", "extras": {"radius": 0.5, "note": "a shade"}},
        {"type": "directional", "extras": {"angle": 0.125}},
        {"type": "point", "extras": [1, 2]},
    ]));
    let node = |light: usize| json!({"extensions": {"KHR_lights_punctual": {"light": light}}});
    asset.json["nodes"] = json!([node(0), node(1), node(2), node(3)]);
    asset.json["scenes"] = json!([{"nodes": [0, 1, 2, 3]}]);
    let extents: Vec<f64> = asset
        .load()
        .lights
        .iter()
        .map(|light| match light.kind {
            LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => radius,
            LightKind::Directional { angle, .. } => angle,
            other => panic!("not of the extension: {other:?}"),
        })
        .collect();
    assert_eq!(extents, [0.25, 0.5, 0.125, 0.0]);
    for bad in [json!("wide"), json!(-1)] {
        asset.json["extensions"] = with(json!([{"type": "point", "extras": {"radius": bad}}]));
        asset.json["nodes"] = json!([node(0)]);
        asset.json["scenes"] = json!([{"nodes": [0]}]);
        let error = asset.error();
        assert!(error.contains("radius"), "{error}");
    }
}

#[test]
fn lights_shine_along_minus_z_of_their_node_and_ignore_its_scale() {
    let mut asset = Asset::new();
    asset.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "name": "bulb", "intensity": 7, "color": [1, 0.5, 0.25], "range": 3},
        {"type": "spot", "intensity": 2, "spot": {"innerConeAngle": 0.1, "outerConeAngle": FRAC_PI_2 as f32}},
        {"type": "directional"},
    ]}});
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let with = |light: usize| json!({"KHR_lights_punctual": {"light": light}});
    asset.json["nodes"] = json!([
        {"translation": [1, 2, 3], "rotation": [-half, 0, 0, half], "scale": [4, 4, 4], "children": [1, 2, 3]},
        {"name": "unused", "extensions": with(0)},
        {"name": "torch", "extensions": with(1)},
        {"name": "sun", "extensions": with(2)},
    ]);
    let lights = asset.load().lights;
    let names: Vec<&str> = lights.iter().map(|light| &*light.name).collect();
    assert_eq!(names, ["bulb", "torch", "sun"]);
    let position = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(lights[0].kind, LightKind::Point { position, radius: 0.0 });
    assert_eq!((lights[0].intensity, lights[0].color), (7.0, [1.0, 0.5, 0.25]));
    let LightKind::Spot {
        direction,
        inner_angle,
        outer_angle,
        ..
    } = lights[1].kind
    else {
        panic!("{:?}", lights[1]);
    };
    assert_close(direction, [0.0, -1.0, 0.0]);
    assert_eq!((inner_angle, outer_angle), (f64::from(0.1f32), FRAC_PI_2));
    let LightKind::Directional { direction, angle } = lights[2].kind else {
        panic!("{:?}", lights[2]);
    };
    assert_close(direction, [0.0, -1.0, 0.0]);
    assert_eq!((angle, lights[2].intensity), (0.0, 1.0));
}

#[test]
fn cameras_keep_rotation_and_translation_and_lose_scale() {
    let mut asset = Asset::new();
    asset.json["cameras"] = json!([
        {"name": "eye", "type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}},
        {"name": "plan", "type": "orthographic", "orthographic": {"xmag": 4, "ymag": 3, "znear": 0, "zfar": 9}},
    ]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    asset.json["nodes"] = json!([
        {"scale": [2, 3, 5], "children": [1, 2]},
        {"translation": [1, 1, 1], "rotation": [0, half, 0, half], "camera": 0, "name": "left"},
        {"camera": 1},
    ]);
    let cameras = asset.load().cameras;
    assert_eq!((&*cameras[0].name, &*cameras[1].name), ("left", "plan"));
    assert_eq!(cameras[0].projection, Projection::Perspective { fov_y: 0.5 });
    assert_eq!(cameras[1].projection, Projection::Orthographic { half_height: 3.0 });
    let transform = cameras[0].transform;
    assert_close(transform.translation, [2.0, 3.0, 5.0]);
    assert_close(transform.transform_vector3(DVec3::NEG_Z), [-1.0, 0.0, 0.0]);
    assert_close(transform.transform_vector3(DVec3::Y), [0.0, 1.0, 0.0]);
    assert!((transform.matrix3.determinant() - 1.0).abs() < 1e-12);
}

// ---- Materials ----------------------------------------------------------------------------------------------------

#[test]
fn emission_is_factor_times_strength() {
    let mut asset = Asset::triangle();
    asset.json["materials"] = json!([{
        "name": "lamp", "emissiveFactor": [1, 0.5, 0],
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 12},
            "KHR_materials_ior": {"ior": 1.25},
            "KHR_materials_transmission": {"transmissionFactor": 1},
        },
        "pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 0.75, 1], "roughnessFactor": 0.125},
    }]);
    let material = &asset.load().materials[0];
    assert_eq!((&*material.name, material.emission), ("lamp", [12.0, 6.0, 0.0]));
    assert_eq!((material.index_of_refraction, material.transmission), (1.25, 1.0));
    assert_eq!(material.base_color, [0.25, 0.5, 0.75]);
    assert_eq!((material.metallic, material.roughness), (1.0, 0.125));
}

#[test]
fn a_primitive_without_a_material_is_white_and_diffuse() {
    let scene = Asset::triangle().load();
    let material = &scene.materials[scene.instances[0].material];
    assert_eq!(
        (material.base_color, material.metallic, material.roughness),
        ([1.0; 3], 0.0, 1.0)
    );
}

#[test]
fn masks_have_a_cutoff_and_blending_has_none() {
    let mut asset = Asset::triangle();
    asset.json["materials"] = json!([
        {"alphaMode": "MASK"},
        {"alphaMode": "MASK", "alphaCutoff": 0.25, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}},
        {"alphaMode": "BLEND"},
    ]);
    let cutoffs: Vec<_> = asset
        .load()
        .materials
        .iter()
        .map(|material| material.alpha_cutoff)
        .collect();
    assert_eq!(cutoffs[..3], [Some(0.5), Some(0.5), None]);
    asset.json["materials"][1]["alphaCutoff"] = json!(0.75);
    assert_says(&asset.error(), &["material \"#1\"", "opacity 0.5", "alphaCutoff 0.75"]);
}

#[test]
fn an_image_used_as_colour_and_as_data_becomes_two_textures() {
    let scene = Asset::rich().load();
    let material = &scene.materials[0];
    assert_eq!(material.base_color_texture, Some(0));
    assert_eq!(material.metallic_roughness_texture, Some(1));
    assert_eq!(material.emission_texture, Some(0));
    let srgb: Vec<bool> = scene.textures.iter().map(|texture| texture.srgb).collect();
    assert_eq!(srgb, [true, false]);
    for texture in &scene.textures {
        assert_eq!((texture.width, texture.height, &*texture.name), (2, 1, "flag"));
        assert_eq!(texture.rgba, [255, 0, 0, 255, 0, 255, 0, 128]);
    }
}

#[test]
fn jpeg_images_are_opaque() {
    let mut jpeg = Vec::new();
    let image = image::RgbImage::from_pixel(3, 5, image::Rgb([200; 3]));
    image
        .write_to(&mut Cursor::new(&mut jpeg), image::ImageFormat::Jpeg)
        .unwrap();
    let mut asset = Asset::rich();
    asset.json["images"][0]["bufferView"] = json!(asset.view(&jpeg));
    let texture = &asset.load().textures[0];
    assert_eq!((texture.width, texture.height), (3, 5));
    assert!(
        texture
            .rgba
            .chunks(4)
            .all(|texel| texel[0].abs_diff(200) < 3 && texel[3] == 255)
    );
}

#[test]
fn buffers_and_images_may_be_data_uris_or_files() {
    let folder = std::env::temp_dir().join(format!("lightfall-gltf-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut asset = Asset::rich();
    std::fs::write(folder.join("all data.bin"), &asset.bin).unwrap();
    std::fs::write(folder.join("flag.png"), png()).unwrap();
    asset.json["buffers"][0]["uri"] = json!("all%20data.bin");
    asset.json["images"] = json!([{"uri": "flag.png", "name": "flag"}]);
    let path = folder.join("scene.gltf");
    std::fs::write(&path, asset.json.to_string()).unwrap();
    let external = load(&path, 0.0);

    asset.json["buffers"][0]["uri"] = json!("nothing.bin");
    std::fs::write(&path, asset.json.to_string()).unwrap();
    let missing = load(&path, 0.0);
    std::fs::remove_dir_all(&folder).unwrap();

    asset.json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{}", base64(&asset.bin)));
    asset.json["images"] = json!([{"uri": format!("data:image/png;base64,{}", base64(&png())), "name": "flag"}]);
    let embedded = load_slice(asset.json.to_string().as_bytes(), None, "embedded.gltf", 0.0).unwrap();

    let external = external.unwrap();
    let expected = Asset::rich().load();
    for scene in [external, embedded] {
        assert_eq!(scene.meshes, expected.meshes);
        assert_eq!(scene.textures, expected.textures);
    }
    assert_says(&missing.unwrap_err(), &["scene.gltf", "buffer #0", "nothing.bin"]);
}

fn base64(bytes: &[u8]) -> String {
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let encode = |chunk: &[u8]| {
        let bits = chunk.iter().fold(0u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - chunk.len()));
        let symbol = |i: usize| {
            if i > chunk.len() {
                '='
            } else {
                char::from(alphabet[(bits >> (18 - 6 * i)) as usize & 63])
            }
        };
        (0..4).map(symbol).collect::<String>()
    };
    bytes.chunks(3).map(encode).collect()
}

// ---- Animation ----------------------------------------------------------------------------------------------------

#[test]
fn linear_keyframes_move_a_node_and_repeat() {
    let mut asset = Asset::triangle();
    asset.animate(
        "translation",
        "LINEAR",
        &[1.0, 2.0, 4.0],
        &[0., 0., 0., 8., 0., 0., 8., 4., 0.],
    );
    // Before its first keyframe a channel stands still; the animation as a whole repeats after four seconds.
    for (time, expected) in [
        (0.5, [0.0, 0.0, 0.0]),
        (1.25, [2.0, 0.0, 0.0]),
        (3.0, [8.0, 2.0, 0.0]),
        (5.25, [2.0, 0.0, 0.0]),
        (-1.0, [8.0, 2.0, 0.0]),
    ] {
        assert_close(vertex(&asset.load_at(time), 0), expected);
    }
}

#[test]
fn a_short_channel_holds_while_a_longer_one_goes_on() {
    let mut asset = Asset::triangle();
    asset.animate("translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 1., 0., 0.]);
    asset.animate("scale", "LINEAR", &[0.0, 4.0], &[1., 1., 1., 3., 3., 3.]);
    let scale = asset.json["animations"].as_array_mut().unwrap().pop().unwrap();
    let animation = &mut asset.json["animations"][0];
    animation["samplers"]
        .as_array_mut()
        .unwrap()
        .push(scale["samplers"][0].clone());
    let channel = json!({"sampler": 1, "target": {"node": 0, "path": "scale"}});
    animation["channels"].as_array_mut().unwrap().push(channel);
    let scene = asset.load_at(2.0);
    assert_close(vertex(&scene, 0), [1.0, 0.0, 0.0]);
    assert_close(vertex(&scene, 1), [3.0, 0.0, 0.0]);
}

#[test]
fn steps_hold_the_last_keyframe() {
    let mut asset = Asset::triangle();
    asset.animate("scale", "STEP", &[0.0, 1.0, 2.0], &[1., 1., 1., 2., 2., 2., 3., 3., 3.]);
    assert_close(vertex(&asset.load_at(0.99), 1), [1.0, 0.0, 0.0]);
    assert_close(vertex(&asset.load_at(1.0), 1), [2.0, 0.0, 0.0]);
}

#[test]
fn rotations_turn_at_constant_speed_along_the_shorter_arc() {
    let mut asset = Asset::triangle();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The second keyframe is a quarter turn about Z, with its sign reversed.
    asset.animate(
        "rotation",
        "LINEAR",
        &[0.0, 3.0],
        &[0., 0., 0., 1., 0., 0., -half, -half],
    );
    let angle = std::f64::consts::PI / 6.0;
    assert_close(vertex(&asset.load_at(1.0), 1), [angle.cos(), angle.sin(), 0.0]);
}

#[test]
fn cubic_splines_follow_their_tangents() {
    let mut asset = Asset::triangle();
    // x = t³ over two seconds: values 0 and 8, slopes 0 and 12.
    let keys = [0., 0., 0., 0., 0., 0., 0., 0., 0., 12., 0., 0., 8., 0., 0., 0., 0., 0.];
    asset.animate("translation", "CUBICSPLINE", &[0.0, 2.0], &keys);
    for time in [0.0, 0.5, 1.0, 1.5] {
        assert_close(vertex(&asset.load_at(time), 0), [time * time * time, 0.0, 0.0]);
    }
}

// ---- Broken files -------------------------------------------------------------------------------------------------

#[test]
fn files_that_are_not_gltf_are_refused() {
    assert_says(&error_of(b""), &["empty"]);
    assert_says(&error_of(b"To whom it may concern"), &["not glTF"]);
    assert_says(&error_of(b"{}"), &["asset"]);
    assert_says(&error_of(br#"{"asset": {"version": "1.0"}}"#), &["version", "1.0"]);
    assert_says(&error_of(b"glTF\x02\0\0\0\x05\0\0\0"), &["header"]);
    let missing = load(Path::new("no/such/file.glb"), 0.0).unwrap_err();
    assert_says(&missing, &["no/such/file.glb"]);
}

#[test]
fn truncated_files_are_refused_wherever_they_end() {
    let bytes = Asset::rich().bytes();
    for length in (0..bytes.len()).step_by(7).chain([11, 12, 19, 20, bytes.len() - 1]) {
        error_of(&bytes[..length]);
    }
}

#[test]
fn a_truncated_file_says_so() {
    let bytes = Asset::triangle().bytes();
    assert_says(&error_of(&bytes[..100]), &["ends after 100", &bytes.len().to_string()]);
}

#[test]
fn accessors_must_fit_their_view() {
    for count in [json!(4), json!(1_000_000_000), json!(u64::MAX)] {
        let mut asset = Asset::triangle();
        asset.json["accessors"][0]["count"] = count;
        assert_says(
            &asset.error(),
            &["mesh \"leaf\"", "accessor #0", "bufferView #0", "36 bytes"],
        );
    }
    let mut asset = Asset::triangle();
    asset.json["accessors"][0]["byteOffset"] = json!(u64::MAX);
    assert_says(&asset.error(), &["accessor #0"]);
    let mut asset = Asset::triangle();
    asset.json["bufferViews"][0]["byteStride"] = json!(4);
    assert_says(&asset.error(), &["accessor #0", "every 4 bytes"]);
}

#[test]
fn views_must_fit_their_buffer() {
    for (field, value) in [
        ("byteLength", json!(5000)),
        ("byteOffset", json!(5000)),
        ("byteLength", json!(u64::MAX)),
    ] {
        let mut asset = Asset::triangle();
        asset.json["bufferViews"][0][field] = value;
        assert_says(&asset.error(), &["bufferView #0", "buffer #0", "which holds 44"]);
    }
}

#[test]
fn buffers_must_be_there() {
    let asset = Asset::triangle();
    let text = asset.json.to_string();
    assert_says(&error_of(text.as_bytes()), &["buffer #0", "missing"]);
    let mut asset = Asset::triangle();
    asset.json["buffers"] = json!([]);
    assert_says(&asset.error(), &["buffer #0 does not exist"]);
    let mut asset = Asset::triangle();
    asset.json["buffers"][0]["byteLength"] = json!(5000);
    assert_says(&asset.error(), &["buffer #0", "holds 44", "expected 5000"]);
    for uri in [
        "data:application/octet-stream;base64,!!!!",
        "data:,plain",
        "other.bin",
        "https://example.com/a.bin",
    ] {
        let mut asset = Asset::triangle();
        asset.json["buffers"][0]["uri"] = json!(uri);
        assert_says(&asset.error(), &["buffer #0"]);
    }
}

#[test]
fn references_must_lead_somewhere() {
    let break_one = |pointer: &str| {
        let mut asset = Asset::rich();
        *asset.json.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}")) = json!(99);
        asset.error()
    };
    for (pointer, message) in [
        ("/scene", "scene #99"),
        ("/scenes/0/nodes/0", "node #99"),
        ("/nodes/0/mesh", "mesh #99"),
        ("/nodes/0/children/0", "node #99"),
        ("/nodes/1/camera", "camera #99"),
        ("/nodes/2/extensions/KHR_lights_punctual/light", "light #99"),
        ("/meshes/0/primitives/0/indices", "accessor #99"),
        ("/meshes/0/primitives/0/attributes/POSITION", "accessor #99"),
        ("/meshes/0/primitives/0/material", "material is 99"),
        ("/materials/0/emissiveTexture/index", "texture #99"),
        ("/textures/0/source", "image #99"),
        ("/images/0/bufferView", "bufferView #99"),
        ("/accessors/0/bufferView", "bufferView #99"),
        ("/accessors/0/componentType", "componentType"),
        ("/bufferViews/0/buffer", "buffer #99"),
        ("/animations/0/channels/0/sampler", "sampler #99"),
        ("/animations/0/channels/0/target/node", "node #99"),
        ("/animations/0/samplers/0/input", "accessor #99"),
        ("/animations/0/samplers/0/output", "accessor #99"),
    ] {
        assert_says(&break_one(pointer), &[message]);
    }
}

#[test]
fn vertex_indices_must_name_vertices() {
    let mut asset = Asset::triangle();
    asset.bin[40] = 3;
    assert_says(&asset.error(), &["mesh", "leaf", "index 2", "is 3"]);
}

#[test]
fn vertex_indices_must_be_unsigned_integers() {
    let mut asset = Asset::triangle();
    asset.json["accessors"][1]["componentType"] = json!(5122);
    assert_says(&asset.error(), &["mesh \"leaf\"", "accessor #1", "I16"]);
    let mut asset = Asset::triangle();
    asset.json["meshes"][0]["primitives"][0]["indices"] = json!(0);
    assert_says(&asset.error(), &["mesh \"leaf\"", "accessor #0", "Vec3", "Scalar"]);
}

#[test]
fn a_vertex_that_is_not_a_number_is_named() {
    let mut asset = Asset::triangle();
    asset.bin[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_says(&asset.error(), &["mesh", "leaf", "position of vertex 1", "not finite"]);
}

#[test]
fn nodes_must_form_trees() {
    let cycles = [
        json!([{"name": "ring", "children": [0]}]),
        json!([{"name": "ring", "children": [1]}, {"children": [0]}]),
        json!([{"children": [1, 2]}, {"children": [2]}, {"name": "ring", "mesh": 0}]),
    ];
    for nodes in cycles {
        let mut asset = Asset::triangle();
        asset.json["nodes"] = nodes;
        assert_says(&asset.error(), &["ring", "ancestor"]);
    }
    let mut asset = Asset::triangle();
    asset.json["nodes"] = json!([{"children": [1]}, {"children": [0]}]);
    asset.json["scenes"] = json!([]);
    asset.json["scene"] = Value::Null;
    assert_says(&asset.error(), &["child"]);
}

#[test]
fn nodes_may_nest_deeply() {
    let mut asset = Asset::triangle();
    let depth = 100_000;
    let mut nodes: Vec<Value> = (1..depth).map(|next| json!({"children": [next]})).collect();
    nodes.push(json!({"mesh": 0}));
    asset.json["nodes"] = Value::Array(nodes);
    assert_eq!(asset.load().instances.len(), 1);
}

#[test]
fn what_is_not_available_is_named() {
    let mut asset = Asset::triangle();
    asset.json["extensionsRequired"] = json!(["KHR_lights_punctual", "KHR_draco_mesh_compression"]);
    assert_says(&asset.error(), &["KHR_draco_mesh_compression"]);
    asset.json["extensionsRequired"] = json!(["KHR_texture_transform"]);
    assert_says(&asset.error(), &["KHR_texture_transform"]);

    let mut asset = Asset::triangle();
    asset.json["skins"] = json!([{"joints": [0]}]);
    asset.json["nodes"][0]["skin"] = json!(0);
    assert_says(&asset.error(), &["branch", "not available yet: skinned meshes"]);

    let mut asset = Asset::triangle();
    asset.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 0}]);
    assert_says(&asset.error(), &["leaf", "not available yet: morph targets"]);

    let mut asset = Asset::rich();
    asset.json["materials"][0]["name"] = json!("poster");
    asset.json["materials"][0]["emissiveTexture"]["texCoord"] = json!(1);
    assert_says(&asset.error(), &["material \"poster\"", "TEXCOORD_1"]);

    let mut asset = Asset::triangle();
    let part = json!({"bufferView": 1, "componentType": 5123});
    asset.json["accessors"][0]["sparse"] = json!({"count": 1, "indices": part, "values": {"bufferView": 0}});
    assert_says(&asset.error(), &["leaf", "accessor #0", "sparse"]);
}

#[test]
fn materials_out_of_range_are_named() {
    let mut asset = Asset::triangle();
    asset.json["materials"] = json!([{"name": "neon", "pbrMetallicRoughness": {"baseColorFactor": [1, 1.5, 1, 1]}}]);
    assert_says(&asset.error(), &["material", "neon", "green", "1.5"]);
}

#[test]
fn broken_images_are_named() {
    let mut asset = Asset::rich();
    let start = asset.json["bufferViews"][2]["byteOffset"].as_u64().unwrap() as usize;
    asset.bin[start] ^= 255;
    assert_says(&asset.error(), &["material", "image #0"]);
}

#[test]
fn broken_animations_are_named() {
    let with = |times: &[f32], values: &[f32]| {
        let mut asset = Asset::triangle();
        asset.animate("translation", "LINEAR", times, values);
        asset
    };
    assert_says(
        &with(&[1.0, 0.0], &[0.0; 6]).error(),
        &["animation \"#0\"", "increasing"],
    );
    assert_says(&with(&[0.0, f32::NAN], &[0.0; 6]).error(), &["increasing"]);
    assert_says(&with(&[0.0, 1.0], &[0.0; 3]).error(), &["1 values for 2 keyframes"]);
    assert_says(&with(&[], &[]).error(), &["increasing"]);
    let mut asset = with(&[0.0], &[0.0; 3]);
    asset.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    assert_says(&asset.error(), &["node #0", "matrix"]);
    let mut asset = Asset::triangle();
    asset.animate("rotation", "LINEAR", &[0.0], &[0.0; 4]);
    assert_says(&asset.error(), &["rotation"]);
}

/// A multiplicative congruential generator: its only purpose is to be the same everywhere.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        // Knuth's MMIX constants; the upper bits are the good ones.
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % limit
    }
}

#[test]
fn flipped_bytes_never_panic() {
    let good = Asset::rich().bytes();
    let mut random = Random(1);
    for _ in 0..600 {
        let mut bytes = good.clone();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len());
            bytes[at] ^= 1 << random.below(8);
        }
        assert_no_panic(&bytes);
    }
}

#[test]
fn wrong_numbers_never_panic() {
    let good = Asset::rich().bytes();
    // Most flips break the JSON at once; other digits leave it readable and wrong.
    let digits: Vec<usize> = (20..good.len()).filter(|&at| good[at].is_ascii_digit()).collect();
    let mut random = Random(2);
    for _ in 0..600 {
        let mut bytes = good.clone();
        for _ in 0..=random.below(3) {
            bytes[digits[random.below(digits.len())]] = b'0' + random.below(10) as u8;
        }
        assert_no_panic(&bytes);
    }
}

/// Every place of a JSON value, as pointers.
fn pointers(value: &Value, from: &str, found: &mut Vec<String>) {
    found.push(from.to_owned());
    match value {
        Value::Object(map) => map.iter().for_each(|(k, v)| pointers(v, &format!("{from}/{k}"), found)),
        Value::Array(list) => (0..)
            .zip(list)
            .for_each(|(i, v): (usize, _)| pointers(v, &format!("{from}/{i}"), found)),
        _ => {}
    }
}

/// Something else in a place: taken out, doubled, or a value of whatever kind.
fn mutate(json: &mut Value, place: usize, kind: u8, number: f64) {
    let mut all = Vec::new();
    pointers(json, "", &mut all);
    let pointer = &all[1 + place % (all.len() - 1)];
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    let at = json.pointer(pointer).unwrap().clone();
    let other = match kind {
        0 | 1 => {
            match (kind, json.pointer_mut(parent).unwrap()) {
                (0, Value::Object(map)) => drop(map.remove(key)),
                (0, Value::Array(list)) => drop(list.remove(key.parse().unwrap())),
                (_, Value::Array(list)) => list.push(at),
                (_, Value::Object(map)) => drop(map.insert(format!("{key}2"), at)),
                _ => {}
            }
            return;
        }
        2 => Value::Null,
        3 => json!(number),
        4 => json!(number as i64),
        5 => json!([at]),
        6 => json!({ "a": at }),
        7 => json!("\u{0}text"),
        8 => json!(u64::MAX),
        _ => json!(true),
    };
    *json.pointer_mut(pointer).unwrap() = other;
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config {
        cases: 6000,
        rng_seed: proptest::test_runner::RngSeed::Fixed(7),
        failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))),
        ..Default::default()
    })]

    #[test]
    fn files_of_another_structure_never_panic(
        changes in proptest::collection::vec(
            (proptest::prelude::any::<usize>(), 0..10u8, -1e10..1e10f64), 1..4
        ),
    ) {
        let mut asset = Asset::rich();
        for (place, kind, number) in changes {
            mutate(&mut asset.json, place, kind, number);
        }
        match load_slice(&asset.bytes(), None, "changed.glb", 0.3) {
            Ok(scene) => scene.validate().unwrap(),
            Err(error) => assert!(error.contains("changed.glb") && !error.contains("panic"), "{error}"),
        }
    }
}

fn assert_no_panic(bytes: &[u8]) {
    if let Err(error) = load_slice(bytes, None, "flipped.glb", 0.3) {
        assert!(!error.contains("panic"), "{error}");
    }
}

// ---- Real files ---------------------------------------------------------------------------------------------------

#[test]
fn the_shared_scenes_load_and_have_a_camera() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: no ../shared/scenes");
        return;
    };
    for path in entries.map(|entry| entry.unwrap().path()) {
        if path.extension().is_none_or(|extension| extension != "glb") {
            continue;
        }
        let scene = load(&path, 0.0).unwrap();
        scene.validate().unwrap();
        assert!(!scene.cameras.is_empty(), "{} has no camera", path.display());
        assert!(scene.triangle_count() > 0, "{} has no triangles", path.display());
        println!("{}: {} triangles", path.display(), scene.triangle_count());
    }
}
