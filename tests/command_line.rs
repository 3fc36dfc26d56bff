//! The examples `render` and `accuracy` as a user meets them: what they write, and how they refuse.

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Examples are built beside the tests' own folder.
fn example(name: &str) -> Command {
    let tests = std::env::current_exe().unwrap();
    let profile = tests.parent().and_then(|p| p.parent()).unwrap();
    Command::new(
        profile
            .join("examples")
            .join(format!("{name}{}", std::env::consts::EXE_SUFFIX)),
    )
}

fn render() -> Command {
    example("render")
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("lightfall-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Whether the machine can render at all; prints the reason if not.
fn can_render() -> bool {
    let output = render()
        .args(["sample:plane", "--width", "4", "--height", "4", "--preset", "fast"])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() && message.contains("setup-adapter") {
        assert_ne!(std::env::var("LIGHTFALL_REQUIRE_GPU").as_deref(), Ok("1"), "{message}");
        println!("skipped: {message}");
        return false;
    }
    true
}

/// Lines that the program itself wrote; drivers may have written others.
fn own_lines(output: &Output) -> Vec<String> {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    text.lines()
        .filter(|l| l.starts_with("render: ") || l.starts_with("accuracy: "))
        .map(str::to_owned)
        .collect()
}

#[test]
fn bad_input_gets_one_line_status_two_and_no_file() {
    let folder = folder("refusals");
    let broken = folder.join("broken.glb");
    std::fs::write(&broken, b"glTF\x02\0\0\0garbage").unwrap();
    let broken = broken.to_str().unwrap();
    let out = folder.join("image.exr");
    let out = out.to_str().unwrap();
    let cases: &[(&[&str], &str)] = &[
        (&[], "SCENE"),
        (&["no-such-file.glb"], "no-such-file.glb"),
        (&[broken], "broken.glb"),
        (&["sample:teapot"], "cornell"),
        (&["sample:cornell", "--camera", "1"], "camera"),
        (&["sample:cornell", "--width", "0"], "width"),
        (&["sample:cornell", "--width", "1000000"], "limit"),
        (&["sample:cornell", "--width", "wide"], "--width"),
        (
            &["sample:cornell", "--preset", "best"],
            "fast, balanced, accurate or reference",
        ),
        (&["sample:cornell", "--set", "tracer.speed=1"], "tracer.iterations"),
        (&["sample:cornell", "--set", "photons=-1"], "photons"),
        (&["sample:cornell", "--set", "photons"], "KEY=VALUE"),
        (&["sample:cornell", "--bounces", "65"], "0 to 64"),
        (&["sample:cornell", "--frames", "0"], "1 or more"),
        (&["sample:cornell", "--time", "NaN"], "--time"),
        (&["sample:cornell", "--animate", "0:1"], "FROM:TO:FRAMES"),
        (&["sample:cornell", "--adapter", "no-such-adapter"], "setup-adapter"),
        (
            &["sample:cornell", "--preset", "reference", "--set", "photons=1"],
            "--set",
        ),
        (
            &["sample:cornell", "--preset", "reference", "--frames", "0"],
            "1 or more",
        ),
        (&["sample:cornell", "--component", "glossy"], "--component"),
        (&["sample:cornell", "--tracer", "fastest"], "--tracer"),
        (
            &["sample:cornell", "--set", "tracer.kind=none"],
            "image-space, bvh or hybrid",
        ),
        (
            &["sample:cornell", "--set", "illumination_maps.blend=0"],
            "above 0, at most 1",
        ),
        (&["sample:cornell", "--budget-ms", "0"], "above 0"),
        (&["sample:cornell", "--budget-ms", "4", "--set", "photons=9"], "chooses"),
        (
            &["sample:cornell", "--budget-ms", "4", "--preset", "fast"],
            "cannot be used with",
        ),
    ];
    for (arguments, word) in cases {
        // On a machine without an adapter these two end at the adapter instead.
        if arguments.contains(&"1000000") && !can_render() {
            continue;
        }
        let output = render().args(*arguments).args(["--out", out]).output().unwrap();
        let lines = own_lines(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {lines:?}");
        assert_eq!(
            lines.len(),
            1,
            "{arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        assert!(lines[0].contains(word), "{arguments:?}: {}", lines[0]);
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
    let output = render()
        .args(["sample:cornell", "--out", "image.jpeg"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(own_lines(&output)[0].contains(".exr or .png"));
    let left: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    assert_eq!(left, ["broken.glb"], "nothing else was written");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_plan_explains_every_stage() {
    let output = render().args(["sample:furnace", "--explain"]).output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    for word in [
        "BvhTracer",
        "off",
        "emissive triangle(s)",
        "no specular surface",
        "simplified",
    ] {
        assert!(text.contains(word), "{word} in\n{text}");
    }
}

#[test]
fn help_lists_what_is_not_available_yet() {
    let output = render().arg("--help").output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    for option in ["Not available yet", "caustic", "surface-lights", "--budget-ms"] {
        assert!(text.contains(option), "{option}");
    }
}

#[test]
fn images_and_statistics_are_written_whole() {
    if !can_render() {
        return;
    }
    let folder = folder("outputs");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let small = [
        "--width",
        "24",
        "--height",
        "16",
        "--preset",
        "fast",
        "--set",
        "photons=2000",
    ];
    let render_to = |extra: &[&str]| {
        let output = render().arg("sample:cornell").args(small).args(extra).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(own_lines(&output).is_empty());
    };
    let render_to_penumbra = |stats: &str| {
        let scene = ["sample:penumbra", "--stats", stats];
        let output = render().args(scene).args(small).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    render_to(&["--out", &path("a.exr"), "--stats", &path("a.json")]);
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path("a.exr"),
        |size, _| (size.width(), size.height()),
        |_, _, _: (f32, f32, f32, f32)| {},
    )
    .unwrap();
    assert_eq!(image.layer_data.channel_data.pixels, (24, 16));
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(path("a.json")).unwrap()).unwrap();
    assert_eq!(stats["size"], serde_json::json!([24, 16]));
    assert_eq!(stats["photons"]["emitted"], 2000);
    assert_eq!(stats["energy"].as_array().unwrap().len(), 4);
    assert!(stats["time"]["frame_ms"]["median"].as_f64().unwrap() > 0.0);
    let bytes = &stats["bytes"];
    let sum: u64 = bytes["by_resource"]
        .as_object()
        .unwrap()
        .values()
        .map(|v| v.as_u64().unwrap())
        .sum();
    assert_eq!(bytes["total"].as_u64().unwrap(), sum);
    assert_eq!(stats["plan"].as_array().unwrap().len(), 28);
    // Of a scene in motion, with a lamp that casts penumbrae.
    render_to_penumbra(&path("p.json"));
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(path("p.json")).unwrap()).unwrap();
    let stages = stats["time"]["stages"].as_array().unwrap();
    if stats["time"]["clock"] == "gpu" {
        for name in [
            "EnvMapSelector::capture",
            "EnvMapSelector::select",
            "NearestOccluder",
            "SoftShadow::test",
            "SoftShadow::search",
            "SoftShadow::blur",
            "PhotonSplatter::sort",
            "PhotonSplatter::finish",
            "Upsampler",
        ] {
            let stage = stages.iter().find(|s| s["name"] == name);
            assert!(
                stage.unwrap_or_else(|| panic!("no {name} in {stages:?}"))["ms"]
                    .as_f64()
                    .unwrap()
                    > 0.0,
                "{name}"
            );
        }
    }
    assert!(stats["env_maps"]["coverage"].as_f64().unwrap() > 0.9);

    render_to(&[
        "--out",
        &path("b.png"),
        "--frames",
        "2",
        "--component",
        "indirect",
        "--bounces",
        "1",
    ]);
    let image = image::open(path("b.png")).unwrap().to_rgb8();
    assert_eq!(image.dimensions(), (24, 16));
    assert!(image.pixels().any(|p| p.0[0] > 20));

    render_to(&["--out", &path("c.png"), "--animate", "0:2:2"]);
    let (first, second) = (
        image::open(path("c.0000.png")).unwrap(),
        image::open(path("c.0001.png")).unwrap(),
    );
    assert!(first.to_rgb8() != second.to_rgb8(), "the block moved");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A plane of 4 × 4 of rough chrome under a lamp of some extent, seen from above.
fn write_plane(folder: &Path) {
    let corners: [f32; 12] = [-2., -2., 0., 2., -2., 0., 2., 2., 0., -2., 2., 0.];
    let triangles: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let mut bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(triangles.iter().flat_map(|x| x.to_le_bytes()));
    std::fs::write(folder.join("plane.bin"), &bytes).unwrap();
    let file = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 5.0, "extras": {"radius": 0.1}}]}},
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"mesh": 0},
            {"camera": 0, "translation": [0, 0, 3]},
            {"translation": [0.5, 0, 1], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}],
        "materials": [{"name": "chrome", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.6, 0.7, 1.0]}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4, "min": [-2, -2, 0], "max": [2, 2, 0]},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 6},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12},
        ],
        "buffers": [{"uri": "plane.bin", "byteLength": 60}],
    });
    std::fs::write(folder.join("plane.gltf"), file.to_string()).unwrap();
}

/// A folder with `plane.gltf`, the reference `plane.direct.exr` that `render --preset fast` makes of it, and an
/// `accuracy.md`.
fn accuracy_folder(name: &str) -> PathBuf {
    let folder = folder(name);
    write_plane(&folder);
    std::fs::write(
        folder.join("accuracy.md"),
        "# Page\n\n<!-- accuracy table: begin -->\nold\n<!-- accuracy table: end -->\n\nEnd.\n",
    )
    .unwrap();
    let output = render()
        .arg(folder.join("plane.gltf"))
        .args([
            "--preset",
            "fast",
            "--component",
            "direct",
            "--width",
            "40",
            "--height",
            "24",
        ])
        .args(["--out".as_ref(), folder.join("plane.direct.exr").as_os_str()])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    folder
}

/// `accuracy` with scenes, references, pages and results all in one folder.
fn accuracy(folder: &Path, options: &[&str]) -> Output {
    example("accuracy")
        .args([folder, folder])
        .args(["--out".as_ref(), folder.join("out").as_os_str()])
        .args(["--docs".as_ref(), folder.as_os_str()])
        .args(options)
        .output()
        .unwrap()
}

fn rows(folder: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(folder.join("out/rows.jsonl")).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn accuracy_measures_an_image_against_itself_as_exact() {
    if !can_render() {
        return;
    }
    let folder = accuracy_folder("accuracy");
    let output = accuracy(&folder, &["--presets", "fast,balanced"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let rows = rows(&folder);
    assert_eq!(rows.len(), 2);
    let fast = rows.iter().find(|row| row["preset"] == "fast").unwrap();
    assert_eq!((&fast["size"], &fast["frames"]), (&json!([40, 24]), &json!(1)));
    assert_eq!(fast["figures"]["finite"], true);
    assert_eq!(fast["figures"]["pixels"], 40 * 24);
    for figure in ["relmse", "bias", "rmse"] {
        assert_eq!(fast["figures"][figure], 0.0, "{figure}");
    }
    assert!(fast["frame_ms"].as_f64().unwrap() > 0.0);

    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("| plane | fast | 1 | direct | 0 |"), "{table}");
    assert!(
        table.contains("1 light(s) with an extent: photons start at the centre"),
        "{table}"
    );
    assert!(
        table.contains("SCENES TRUTH --presets fast,balanced --bounces 3"),
        "{table}"
    );
    let page = std::fs::read_to_string(folder.join("accuracy.md")).unwrap();
    assert_eq!(
        page,
        format!("# Page\n\n<!-- accuracy table: begin -->\n\n{table}\n<!-- accuracy table: end -->\n\nEnd.\n")
    );
    // Reference, and twice image and error, all of 40 pixels, 6 apart.
    let sheet = image::open(folder.join("accuracy.png")).unwrap().to_rgb8();
    assert_eq!(sheet.width(), 5 * 46);
    let black = |x: u32, y: u32| sheet.get_pixel(x, y).0.iter().all(|&value| value < 12);
    assert!((0..24).all(|y| black(2 * 46 + 20, 32 + y)), "no error is black");
    assert!(!black(20, 32 + 12) && !black(46 + 20, 32 + 12), "the images are not");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn accuracy_renders_a_row_once_unless_told_otherwise() {
    if !can_render() {
        return;
    }
    let folder = accuracy_folder("resume");
    let run = |options: &[&str]| {
        let output = accuracy(&folder, options);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let image = folder.join("out/plane.direct.fast.bounces3.exr");
        (rows(&folder), std::fs::metadata(image).unwrap().modified().unwrap())
    };
    let first = run(&["--presets", "fast"]);
    assert_eq!(run(&["--presets", "fast"]), first);
    // Other rows leave it alone.
    let (both, image_time) = run(&["--presets", "fast,balanced"]);
    assert_eq!(both.len(), 2);
    assert!(both.contains(&first.0[0]) && image_time == first.1);
    let (three, image_time) = run(&["--presets", "fast", "--frames", "2"]);
    let frames: Vec<_> = three.iter().map(|row| row["frames"].as_u64().unwrap()).collect();
    assert_eq!((frames, image_time), (vec![1, 1, 2], first.1));

    let (fresh, image_time) = run(&["--presets", "fast", "--fresh"]);
    assert!(fresh.len() == 3 && image_time > first.1);
    // A scene that may not be shown is measured, and on the sheet there is but the legend.
    assert_eq!(run(&["--presets", "fast", "--unpictured", "plane"]).0, fresh);
    assert_eq!(image::image_dimensions(folder.join("accuracy.png")).unwrap().1, 16);
    // An image that is lost is rendered again.
    std::fs::remove_file(folder.join("out/plane.direct.fast.bounces3.exr")).unwrap();
    assert!(run(&["--presets", "fast"]).1 > image_time);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn accuracy_measures_the_path_tracer_too() {
    if !can_render() {
        return;
    }
    let folder = accuracy_folder("path-traced");
    let output = accuracy(&folder, &["--presets", "reference", "--frames", "2"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let row = &rows(&folder)[0];
    assert_eq!((&row["preset"], &row["frames"]), (&json!("reference"), &json!(2)));
    assert_eq!(row["figures"]["finite"], true);
    // Two paths a pixel are not what `fast` makes of it.
    assert!(row["figures"]["relmse"].as_f64().unwrap() > 0.0, "{row}");
    assert!(row["simplifications"].to_string().contains("caustics"), "{row}");
    assert!(row["frame_ms"].as_f64().unwrap() > 0.0, "{row}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn accuracy_goes_on_after_a_scene_that_fails() {
    if !can_render() {
        return;
    }
    let folder = accuracy_folder("failing");
    std::fs::write(folder.join("broken.gltf"), "garbage").unwrap();
    let reference = |name: &str| std::fs::copy(folder.join("plane.direct.exr"), folder.join(name)).unwrap();
    reference("broken.direct.exr");
    reference("absent.direct.exr");
    let output = accuracy(&folder, &["--presets", "fast"]);
    assert_eq!(output.status.code(), Some(1));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("| broken | fast |  | direct | failed: "), "{table}");
    assert!(table.contains("| plane | fast | 1 | direct | 0 |"), "{table}");
    assert!(!table.contains("absent"), "{table}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("absent.glb"));
    assert_eq!(rows(&folder).len(), 1, "what failed is tried again");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn accuracy_refuses_bad_input_before_it_renders() {
    if !can_render() {
        return;
    }
    let folder = accuracy_folder("accuracy-refusals");
    let refused = |options: &[&str], word: &str| {
        let output = accuracy(&folder, options);
        let lines = own_lines(&output);
        assert_eq!(output.status.code(), Some(2), "{options:?}: {lines:?}");
        assert!(output.stdout.is_empty(), "{options:?}");
        assert_eq!(lines.len(), 1, "{options:?}: {lines:?}");
        assert!(lines[0].contains(word), "{options:?}: {}", lines[0]);
    };
    refused(&["--presets", "best"], "fast, balanced, accurate, reference");
    refused(&["--components", "shiny"], "indirect");
    refused(&["--scenes", "plane,teapot"], "teapot");
    refused(&["--components", "indirect"], "no reference");
    refused(&["--bounces", "65"], "0..=64");
    refused(&["--frames", "0"], "--frames");
    refused(&["--adapter", "no-such-adapter"], "setup-adapter");
    refused(&["--docs", "no-such-folder"], "no-such-folder");
    std::fs::write(folder.join("accuracy.md"), "<!-- accuracy table: end -->\n").unwrap();
    refused(&[], "begin");
    std::fs::write(folder.join("plane.indirect.exr"), "garbage").unwrap();
    refused(&[], "plane.indirect.exr");
    assert!(!folder.join("out/rows.jsonl").exists());
    std::fs::remove_dir_all(&folder).unwrap();
}
