//! What the papers say, as data, and what stands in for it.

/// A table of a paper.
pub(crate) struct Table {
    pub(crate) title: &'static str,
    pub(crate) hardware: &'static str,
    pub(crate) rows: Vec<Row>,
    /// What of it has no row here, and why.
    pub(crate) left_out: &'static str,
}

/// A row of it.
pub(crate) struct Row {
    pub(crate) name: String,
    /// Of the paper's scene.
    pub(crate) triangles: &'static str,
    /// The best that is there is taken.
    pub(crate) scenes: &'static [Substitute],
    pub(crate) size: [u32; 2],
    pub(crate) tracer: &'static str,
    /// Settings by name.
    pub(crate) set: Vec<(&'static str, String)>,
    /// Whether lights that are points are given an extent.
    pub(crate) widens_lights: bool,
    /// Milliseconds of a frame.
    pub(crate) paper_ms: f64,
}

#[derive(Clone, Copy)]
pub(crate) enum Substitute {
    Sample(&'static str),
    /// NAME.glb in the folder of scenes.
    File(&'static str),
}

use Substitute::{File, Sample};

pub(crate) const NAMES: [&str; 5] = [
    "yao2010",
    "soft-shadows",
    "splat-shapes",
    "surface-lights",
    "illumination-maps",
];

/// # Errors
/// One line that says which there are.
pub(crate) fn by_name(name: &str) -> Result<Table, String> {
    Ok(match name {
        "yao2010" => yao2010(),
        "soft-shadows" => soft_shadows(),
        "splat-shapes" => splat_shapes(),
        "surface-lights" => surface_lights(),
        "illumination-maps" => illumination_maps(),
        _ => return Err(format!("--tables {name:?}: there are {}", NAMES.join(", "))),
    })
}

fn ms(frames_a_second: f64) -> f64 {
    1e3 / frames_a_second
}

/// Most caustic photons that a storage buffer of the default limit holds with three bounces.
const MOST_CAUSTIC_PHOTONS: u32 = 690_000;

fn yao2010() -> Table {
    // Figure, triangles, photons, of caustics, bounces, maps, frames a second at 512² and 1024², stand-in.
    type Line = (&'static str, &'static str, [u32; 4], [f64; 2], &'static [Substitute]);
    const LINES: [Line; 6] = [
        (
            "1 (a), a box",
            "15k",
            [376_000, 0, 3, 8],
            [22.3, 11.4],
            &[Sample("bumpy-floor")],
        ),
        (
            "1 (b), a dimpled mirror",
            "21k",
            [91_000, 89_000, 1, 8],
            [13.6, 12.8],
            &[Sample("dimpled-mirror")],
        ),
        (
            "1 (c), a living room",
            "84k",
            [403_000, 2_900, 3, 8],
            [7.2, 5.4],
            &[Sample("living-room")],
        ),
        (
            "1 (d), Sibenik",
            "79k",
            [739_000, 0, 2, 12],
            [13.3, 5.5],
            &[Sample("nave")],
        ),
        (
            "11 (e), a caustic",
            "2.1k",
            [0, 164_000, 1, 8],
            [38.9, 28.2],
            &[Sample("glass-sphere")],
        ),
        (
            "10 (a), water",
            "54k",
            [536_000, 822_000, 3, 8],
            [7.4, 6.3],
            &[Sample("water")],
        ),
    ];
    let mut rows = Vec::new();
    for (side, column) in [(512, 0), (1024, 1)] {
        for (name, triangles, [photons, caustic, bounces, maps], rates, scenes) in LINES {
            let caustic = caustic.min(MOST_CAUSTIC_PHOTONS);
            // Without photons of other light nothing is traced.
            let photons = photons.max(1);
            rows.push(Row {
                name: name.into(),
                triangles,
                scenes,
                size: [side; 2],
                tracer: "image-space",
                set: vec![
                    ("photons", photons.to_string()),
                    ("caustic.photons", caustic.to_string()),
                    ("bounces", bounces.to_string()),
                    ("env_maps.count", maps.to_string()),
                ],
                widens_lights: false,
                paper_ms: ms(rates[column]),
            });
        }
    }
    Table {
        title: "Yao et al. 2010, table 1: photons traced through environment maps",
        hardware: "GeForce GTX 260",
        rows,
        left_out: "Of 822 000 caustic photons of figure 10 (a) 690 000 fit a storage buffer of the default limit. Left out: figures \
                   11 (a) and (c), whose scenes the paper does not describe.",
    }
}

const CORNELL: &[Substitute] = &[Sample("cornell")];
const SPONZA: &[Substitute] = &[File("sponza_dabrovic"), Sample("colonnade")];
const SIBENIK: &[Substitute] = &[Sample("nave")];
const DRAGON: &[Substitute] = &[File("cornell_dragon_lo")];
const BUNNY: &[Substitute] = &[File("cornell_bunny")];
const GLASS_BUNNY: &[Substitute] = &[File("cornell_bunny_glass"), Sample("glass-sphere")];

fn soft_shadows() -> Table {
    // Scene, triangles, sub-sampling, bounces, taps of search and blur, frames a second soft and hard, stand-in.
    type Line = (&'static str, &'static str, [u32; 4], [f64; 2], &'static [Substitute]);
    const LINES: [Line; 8] = [
        ("Cornell box", "30", [8, 1, 4, 5], [32.0, 107.0], CORNELL),
        ("Cornell box", "30", [8, 2, 4, 5], [27.0, 85.0], CORNELL),
        ("Happy Buddha", "50k", [4, 1, 4, 5], [20.0, 40.0], BUNNY),
        ("Chinese dragon", "26k", [4, 3, 4, 5], [23.0, 35.0], DRAGON),
        (
            "glass sphere",
            "9k",
            [4, 2, 4, 5],
            [34.0, 70.0],
            &[Sample("glass-sphere")],
        ),
        ("glass bunny", "32k", [4, 2, 4, 5], [32.0, 63.0], GLASS_BUNNY),
        ("Sibenik", "80k", [2, 2, 4, 7], [12.0, 35.0], SIBENIK),
        ("Sponza", "67k", [2, 2, 4, 7], [9.0, 20.0], SPONZA),
    ];
    let rows = LINES
        .into_iter()
        .flat_map(|(name, triangles, [step, bounces, search, blur], rates, scenes)| {
            [("soft", rates[0]), ("hard", rates[1])].map(|(shadows, rate)| {
                let mut row = splatted((name, triangles, scenes), [step, bounces], rate);
                row.name = format!("{name}, {shadows}");
                row.set.extend(match shadows {
                    "hard" => vec![("soft_shadow.method", "hard".into())],
                    _ => vec![
                        ("soft_shadow.search_taps", search.to_string()),
                        ("soft_shadow.blur_taps", blur.to_string()),
                    ],
                });
                row
            })
        });
    Table {
        title: "Yao et al., soft shadows and image-space photon mapping, table 1: soft shadows and photons as quads",
        hardware: "GeForce GTX 480",
        rows: rows.collect(),
        left_out: "Photons of a row are 10 000 that are emitted, which is what it says divided by bounces; kernels are as wide as density \
                   says, not the radius that the paper gives.",
    }
}

fn splat_shapes() -> Table {
    // Scene, triangles, bounces, frames a second with hard shadows of quads and icosahedra, stand-in.
    type Line = (&'static str, &'static str, u32, [f64; 2], &'static [Substitute]);
    const LINES: [Line; 7] = [
        ("Cornell box", "30", 2, [61.0, 60.7], CORNELL),
        ("Cornell box", "30", 3, [61.4, 54.0], CORNELL),
        ("Happy Buddha", "50k", 3, [42.1, 37.2], BUNNY),
        ("Chinese dragon", "26k", 3, [56.3, 50.9], DRAGON),
        ("glass bunny", "32k", 3, [60.3, 51.4], GLASS_BUNNY),
        ("Sibenik", "80k", 3, [43.0, 33.0], SIBENIK),
        ("Sponza", "67k", 3, [46.4, 39.5], SPONZA),
    ];
    let rows = LINES.into_iter().flat_map(|(name, triangles, bounces, rates, scenes)| {
        [("quads", rates[0]), ("volumes", rates[1])].map(|(shape, rate)| {
            let mut row = splatted((name, triangles, scenes), [8, bounces], rate);
            row.set.push(("splatter.shape", shape.into()));
            row.set.push(("soft_shadow.method", "hard".into()));
            row
        })
    });
    Table {
        title: "Yao et al., soft shadows and image-space photon mapping, table 2: quads and volumes, hard shadows",
        hardware: "GeForce GTX 480",
        rows: rows.collect(),
        left_out: "Left out: the same with soft shadows, whose cost table 1 has.",
    }
}

/// A row of these tables: 10 000 photons emitted, traced against triangles.
fn splatted(
    (name, triangles, scenes): (&str, &'static str, &'static [Substitute]),
    [step, bounces]: [u32; 2],
    frames_a_second: f64,
) -> Row {
    Row {
        name: name.into(),
        triangles,
        scenes,
        size: [1024, 768],
        tracer: "bvh",
        set: vec![
            ("photons", "10000".into()),
            ("bounces", bounces.to_string()),
            ("splatter.subsampling", step.to_string()),
        ],
        widens_lights: true,
        paper_ms: ms(frames_a_second),
    }
}

fn surface_lights() -> Table {
    // Scene, triangles, frames a second with 10, 50, 100 and 200 lights at 800 × 600, then at 1280 × 1024, stand-in.
    type Line = (&'static str, &'static str, [[f64; 4]; 2], &'static [Substitute]);
    const LINES: [Line; 4] = [
        (
            "Cornell box",
            "2k",
            [[140.0, 48.0, 36.0, 21.0], [55.0, 19.0, 15.0, 8.0]],
            &[Sample("cornell-spot")],
        ),
        (
            "dragon",
            "100k",
            [[90.0, 43.0, 35.0, 21.0], [45.0, 19.0, 15.0, 8.0]],
            DRAGON,
        ),
        (
            "Sponza",
            "66k",
            [[115.0, 39.0, 32.0, 19.0], [45.0, 16.0, 15.0, 7.0]],
            SPONZA,
        ),
        (
            "Sibenik",
            "80k",
            [[140.0, 83.0, 58.0, 36.0], [62.0, 35.0, 25.0, 15.0]],
            SIBENIK,
        ),
    ];
    let mut rows = Vec::new();
    for (name, triangles, rates, scenes) in LINES {
        for (size, rates) in [[800, 600], [1280, 1024]].into_iter().zip(rates) {
            for (lights, rate) in [10, 50, 100, 200].into_iter().zip(rates) {
                rows.push(Row {
                    name: name.into(),
                    triangles,
                    scenes,
                    size,
                    tracer: "bvh",
                    set: vec![
                        ("indirect.method", "surface-lights".into()),
                        ("surface_lights.places", lights.to_string()),
                        // As in the paper: no shadows, and no photons near by.
                        ("surface_lights.shape", "point".into()),
                        ("surface_lights.shadows", "off".into()),
                        ("surface_lights.near_photons", "off".into()),
                    ],
                    widens_lights: false,
                    paper_ms: ms(rate),
                });
            }
        }
    }
    Table {
        title: "Photon streaming, tables 2 and 3: virtual surface lights, deferred",
        hardware: "GeForce 8600 GT",
        rows,
        left_out: "Left out: the same without deferred shading, which draws the scene once for each light.",
    }
}

fn illumination_maps() -> Table {
    let set = [
        ("indirect.method", "illumination-maps"),
        ("photons", "3080"),
        ("selective.group", "40"),
        ("caustic.photons", "10000"),
        ("caustic.rounds", "8"),
        ("illumination_maps.texels", "140"),
        ("illumination_maps.a_frame", "20"),
    ];
    Table {
        title: "Larsen 2004, chapter 14: illumination maps and a caustic",
        hardware: "GeForce FX 5950, above 35 frames a second",
        rows: vec![Row {
            name: "figure 13.1, cube and sphere".into(),
            triangles: "–",
            scenes: &[Sample("glass-sphere")],
            size: [512; 2],
            tracer: "bvh",
            set: set.map(|(key, value)| (key, value.to_owned())).to_vec(),
            widens_lights: false,
            paper_ms: ms(35.0),
        }],
        left_out: "There cube and sphere move, here nothing does. Table 14.2, gathering at a texel by draws, is `illumination_study --parts triangles --ways cube`. Tables 8.1, 8.2 and 14.1 \
                   are of trees of photons on the processor, of which there are none here.",
    }
}
