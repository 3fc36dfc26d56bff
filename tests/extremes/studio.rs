//! Pictures of scenes at their extremes, by every way there is, with pipelines that are made once.

use crate::common::{Component, Gpu, Offline, Reference, assert_no_errors, gpu};
use lightfall::Error;
use lightfall::frame::Settings;
use lightfall::glam::DVec3;
use lightfall::reference::metrics::{self, Image, Truth};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{Light, LightKind, Scene, samples};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

pub(crate) const SIZE: [u32; 2] = [32, 32];

/// Frames of a picture, each of which may change.
pub(crate) const FRAMES: u32 = 3;

/// Paths of each pixel of a truth.
const SAMPLES: u32 = 512;

type Overrides = &'static [(&'static str, &'static str)];

/// A way from a scene to a picture.
#[derive(Clone, Copy)]
pub(crate) struct Way {
    pub(crate) name: &'static str,
    /// Sample that needs it.
    pub(crate) sample: &'static str,
    pub(crate) overrides: Overrides,
}

const fn way(name: &'static str, sample: &'static str, overrides: Overrides) -> Way {
    Way {
        name,
        sample,
        overrides,
    }
}

pub(crate) const WAYS: [Way; 17] = [
    way("environment maps", "cornell", &[]),
    way("a march through them", "cornell", &[("tracer.method", "ordered-march")]),
    way("the paper's search in them", "cornell", &[("tracer.method", "paper")]),
    way("hybrid", "cornell", &[("tracer.kind", "hybrid")]),
    way("triangles", "cornell", &[("tracer.kind", "bvh")]),
    way("quads", "cornell", &[("splatter.shape", "quads")]),
    way("volumes", "cornell", &[("splatter.shape", "volumes")]),
    way("densities on the screen", "cornell", &[("splatter.density", "screen")]),
    way(
        "guided photons",
        "two-rooms",
        &[("tracer.kind", "bvh"), ("photons.guided", "0.5")],
    ),
    way(
        "selective photons",
        "cornell",
        &[("tracer.kind", "bvh"), ("selective", "on")],
    ),
    way(
        "final gathering",
        "cornell",
        &[
            ("tracer.kind", "bvh"),
            ("indirect.method", "final-gather"),
            ("final_gather.rays", "16"),
        ],
    ),
    way(
        "surface lights",
        "cornell",
        &[
            ("tracer.kind", "bvh"),
            ("indirect.method", "surface-lights"),
            ("surface_lights.pool", "5000"),
        ],
    ),
    way(
        "illumination maps",
        "cornell",
        &[
            ("tracer.kind", "bvh"),
            ("indirect.method", "illumination-maps"),
            ("illumination_maps.texels", "100"),
        ],
    ),
    way("a lamp's penumbra", "penumbra", &[]),
    way(
        "a lamp's penumbra by rays",
        "penumbra",
        &[("tracer.kind", "bvh"), ("soft_shadow.method", "rays")],
    ),
    way(
        "caustics",
        "glass-sphere",
        &[("tracer.kind", "bvh"), ("caustic.photons", "5000")],
    ),
    way("one pass at last", "cornell", &[("composite.fused", "on")]),
];

/// One of each tracer and of each method of indirect light.
pub(crate) const METHODS: [&str; 6] = [
    "environment maps",
    "hybrid",
    "triangles",
    "final gathering",
    "surface lights",
    "illumination maps",
];

pub(crate) fn by_name(name: &str) -> Way {
    let way = WAYS.iter().find(|way| way.name == name);
    *way.unwrap_or_else(|| panic!("no way {name:?}"))
}

pub(crate) fn settings(overrides: &[(&str, &str)]) -> Settings {
    let mut settings = Settings {
        photons: 5_000,
        env_map_count: 3,
        env_map_size: 32,
        shadow_map_size: 64,
        ..Settings::balanced()
    };
    for (key, value) in overrides {
        settings.set(key, value).unwrap();
    }
    settings
}

/// A device and what was made on it so far.
pub(crate) struct Studio {
    pub(crate) gpu: &'static Gpu,
    /// By way: a renderer whose pipelines others take over.
    made: Vec<(&'static str, Offline<'static>)>,
    tracer: Option<Reference<'static>>,
    /// Of scenes as they are, by way: relMSE.
    nominal: Vec<(&'static str, f64)>,
}

/// The one studio of all tests, or `None` where there is no adapter.
pub(crate) fn studio() -> Option<MutexGuard<'static, Option<Studio>>> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    static STUDIO: Mutex<Option<Studio>> = Mutex::new(None);
    let gpu = GPU.get_or_init(gpu).as_ref()?;
    let mut studio = STUDIO.lock().unwrap_or_else(PoisonError::into_inner);
    studio.get_or_insert_with(|| Studio {
        gpu,
        made: Vec::new(),
        tracer: None,
        nominal: Vec::new(),
    });
    Some(studio)
}

impl Studio {
    /// A scene that is ready to be rendered, by a way of which settings may be others.
    pub(crate) fn stage(
        &mut self,
        way: &Way,
        more: &[(&str, &str)],
        scene: &Scene,
        size: [u32; 2],
        component: Component,
    ) -> Result<Offline<'static>, Error> {
        let mut wanted = settings(way.overrides);
        for (key, value) in more {
            wanted.set(key, value)?;
        }
        let of_way = self.made.iter().find(|(name, _)| *name == way.name);
        match of_way {
            Some((_, first)) => first.another(scene.clone(), &wanted, size, component),
            None => {
                // Of a scene that nothing is wrong with: it is to be there for others.
                let sample = samples::by_name(way.sample, 0.0).unwrap();
                let first = Offline::new(self.gpu, sample, &settings(way.overrides), 0, SIZE, Component::All)?;
                let own = first.another(scene.clone(), &wanted, size, component);
                self.made.push((way.name, first));
                own
            }
        }
    }

    /// A picture after a few frames.
    pub(crate) fn picture(
        &mut self,
        way: &Way,
        more: &[(&str, &str)],
        scene: &Scene,
        size: [u32; 2],
        component: Component,
    ) -> Result<Vec<[f32; 3]>, Error> {
        let mut offline = self.stage(way, more, scene, size, component)?;
        for _ in 0..FRAMES {
            offline.render_frame(None)?;
        }
        offline.read()
    }

    /// What paths of as many bounces bring.
    pub(crate) fn truth(&mut self, scene: &Scene, size: [u32; 2], component: PathComponent) -> Truth {
        let paths = PathTracerSettings {
            component,
            bounces: settings(&[]).bounces,
            spans_pixel: false,
            ..Default::default()
        };
        let first = self.tracer.get_or_insert_with(|| {
            let sample = samples::cornell(0.0);
            Reference::new(self.gpu, sample, &paths, 0, SIZE).unwrap()
        });
        first
            .another(scene.clone(), &paths, size)
            .unwrap()
            .truth(SAMPLES)
            .unwrap()
    }

    /// relMSE of indirect light in the box as it is.
    pub(crate) fn nominal(&mut self, way: &Way) -> f64 {
        if let Some((_, error)) = self.nominal.iter().find(|(name, _)| *name == way.name) {
            return *error;
        }
        let scene = samples::cornell(0.3);
        let truth = self.truth(&scene, SIZE, PathComponent::Indirect);
        for name in WAYS.iter().filter(|w| w.sample == "cornell").map(|w| w.name) {
            let rgb = self
                .picture(&by_name(name), &[], &scene, SIZE, Component::Indirect)
                .unwrap();
            let error = error_of(rgb, SIZE, &truth);
            self.nominal.push((name, error));
        }
        self.nominal(way)
    }

    /// Indirect light of a scene by each of [`METHODS`]: is finite, and not more than twice as far off as that of the box.
    pub(crate) fn methods_keep_to_twice_the_nominal_error(&mut self, row: &str, scene: &Scene) {
        let truth = self.truth(scene, SIZE, PathComponent::Indirect);
        for way in METHODS.map(by_name) {
            let nominal = self.nominal(&way);
            let rgb = self.picture(&way, &[], scene, SIZE, Component::Indirect).unwrap();
            let error = error_of(rgb, SIZE, &truth);
            report(row, way.name, error, nominal);
        }
        assert_no_errors(self.gpu);
    }
}

/// relMSE of a picture, which is finite.
pub(crate) fn error_of(rgb: Vec<[f32; 3]>, [width, height]: [u32; 2], truth: &Truth) -> f64 {
    let comparison = metrics::compare(&Image { width, height, rgb }, truth).unwrap();
    assert!(comparison.finite, "a value is not finite");
    comparison.relmse
}

/// Prints a row, which holds.
pub(crate) fn report(row: &str, way: &str, error: f64, nominal: f64) {
    println!("| {row} | {way} | {error:.4} | {nominal:.4} |");
    assert!(error <= 2.0 * nominal, "{row}, {way}: {error} instead of {nominal}");
}

pub(crate) fn assert_finite(rgb: &[[f32; 3]], what: &str) {
    let is_good = |v: &f32| v.is_finite() && *v >= 0.0;
    assert!(rgb.iter().flatten().all(is_good), "{what}: not finite, or below zero");
}

/// Mean over pixels and channels.
pub(crate) fn mean(rgb: &[[f32; 3]]) -> f64 {
    rgb.as_flattened().iter().map(|&v| f64::from(v)).sum::<f64>() / (3 * rgb.len()) as f64
}

/// The box with its bulb there.
pub(crate) fn box_lit_from(position: DVec3) -> Scene {
    let mut scene = samples::cornell(0.3);
    scene.lights[0].kind = LightKind::Point { position, radius: 0.0 };
    scene
}

/// The box with another light.
pub(crate) fn box_lit_by(kind: LightKind, intensity: f32) -> Scene {
    let mut scene = samples::cornell(0.3);
    scene.lights = vec![Light {
        name: "light".into(),
        kind,
        color: [1.0; 3],
        intensity,
    }];
    scene
}
