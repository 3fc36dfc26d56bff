//! The `render` example as a user meets it: what it writes, and how it refuses.

use std::path::PathBuf;
use std::process::{Command, Output};

/// Examples are built beside the tests' own folder.
fn render() -> Command {
    let tests = std::env::current_exe().unwrap();
    let profile = tests.parent().and_then(|p| p.parent()).unwrap();
    Command::new(
        profile
            .join("examples")
            .join(format!("render{}", std::env::consts::EXE_SUFFIX)),
    )
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
        .filter(|l| l.starts_with("render: "))
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
        (&["sample:cornell", "--preset", "best"], "fast, balanced or accurate"),
        (&["sample:cornell", "--set", "tracer.speed=1"], "tracer.iterations"),
        (&["sample:cornell", "--set", "photons=-1"], "photons"),
        (&["sample:cornell", "--set", "photons"], "KEY=VALUE"),
        (&["sample:cornell", "--bounces", "65"], "0 to 64"),
        (&["sample:cornell", "--frames", "0"], "1 or more"),
        (&["sample:cornell", "--time", "NaN"], "--time"),
        (&["sample:cornell", "--animate", "0:1"], "FROM:TO:FRAMES"),
        (&["sample:cornell", "--adapter", "no-such-adapter"], "setup-adapter"),
        (&["sample:cornell", "--preset", "reference"], "not available yet"),
        (&["sample:cornell", "--component", "caustic"], "not available yet"),
        (&["sample:cornell", "--component", "specular"], "not available yet"),
        (&["sample:cornell", "--tracer", "bvh"], "not available yet"),
        (&["sample:cornell", "--tracer", "hybrid"], "not available yet"),
        (&["sample:cornell", "--method", "surface-lights"], "not available yet"),
        (
            &["sample:cornell", "--method", "illumination-maps"],
            "not available yet",
        ),
        (&["sample:cornell", "--budget-ms", "4"], "not available yet"),
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
    for word in ["ImageSpaceTracer", "off", "no light", "simplified", "wall"] {
        assert!(text.contains(word), "{word} in\n{text}");
    }
}

#[test]
fn help_lists_what_is_not_available_yet() {
    let output = render().arg("--help").output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    for option in ["Not available yet", "bvh", "caustic", "surface-lights", "--budget-ms"] {
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
    assert_eq!(stats["energy"].as_array().unwrap().len(), 3);
    assert!(stats["time"]["frame_ms"]["median"].as_f64().unwrap() > 0.0);
    let bytes = &stats["bytes"];
    let sum: u64 = bytes["by_resource"]
        .as_object()
        .unwrap()
        .values()
        .map(|v| v.as_u64().unwrap())
        .sum();
    assert_eq!(bytes["total"].as_u64().unwrap(), sum);
    assert_eq!(stats["plan"].as_array().unwrap().len(), 13);
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
            "PhotonSplatter",
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
