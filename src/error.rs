//! The one error type of the crate. Every variant says what was wrong, where, and what to do about it.

/// Anything that a constructor or a validation can refuse.
///
/// Recording a pass does not fail: what could go wrong is refused when the pass, its resources or its inputs are made. A
/// renderer that composes passes refuses a frame before it records any.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A mesh, instance, material, texture, environment, light or camera holds something that cannot be rendered.
    #[error("{item} {name:?}: {field} {problem}")]
    InvalidScene {
        /// What kind of thing it is: "mesh", "instance", "material", "texture", "environment", "light", "camera",
        /// "summary".
        item: &'static str,
        /// Its name, or its index where it has none.
        name: String,
        /// The offending field, with the index of the element ("position of vertex 17").
        field: String,
        /// What is wrong with it, and what it should be.
        problem: String,
    },
    /// The scene or region has no extent, so there is no unit of length to normalise by.
    #[error("the region {min:?} .. {max:?} has no finite, non-zero extent; give the region that light should fill")]
    InvalidBounds {
        /// Lower corner, world space.
        min: [f64; 3],
        /// Upper corner, world space.
        max: [f64; 3],
    },
    /// Radiance of this scene, at this exposure, does not fit a 32-bit float.
    #[error(
        "radiance in this scene is near 2^{exponent}, outside what a 32-bit float holds; give a pre-exposure near 2^{}",
        -exponent
    )]
    UnrepresentableRadiance {
        /// Binary exponent of the radiance that one unit of the unit frame stands for.
        exponent: i32,
    },
    /// A setting is outside its range.
    #[error("setting {key} = {value}: expected {expected}")]
    InvalidSetting {
        /// Dotted path of the setting, as in `splatter.bandwidth`.
        key: String,
        /// The value given.
        value: String,
        /// What would be accepted.
        expected: String,
    },
    /// There is no such setting.
    #[error("no setting is called {key:?}; known settings: {known}")]
    UnknownSetting {
        /// The key given.
        key: String,
        /// All keys, comma-separated.
        known: String,
    },
    /// A host-made texture view does not fit where it was handed in.
    #[error("{resource}: {property} is {found}, expected {expected}")]
    IncompatibleView {
        /// Which resource and which of its views.
        resource: &'static str,
        /// Which property: "format", "size", "usage", "sample count", "mip level count", "layer count", "dimension".
        property: &'static str,
        /// What it should be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// Something needs more than the device grants.
    #[error("{what} needs {needed}, the device's limit is {limit}; {remedy}")]
    LimitExceeded {
        /// What was asked for.
        what: String,
        /// How much it needs, in the limit's own unit.
        needed: u64,
        /// What the device grants.
        limit: u64,
        /// What to change.
        remedy: &'static str,
    },
    /// A configuration needs device features that were not enabled.
    #[error("{what} needs the device features {missing:?}; request them, or choose {instead}")]
    MissingFeatures {
        /// The pass or configuration.
        what: &'static str,
        /// The features that the device lacks.
        missing: wgpu::Features,
        /// The configuration that does without.
        instead: &'static str,
    },
    /// A count that must agree between two things does not.
    #[error("{what}: {found} given, {expected} expected")]
    CountMismatch {
        /// What was counted, and against what.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A stage that runs was not given what it works on.
    #[error("{stage} needs {input}; {remedy}")]
    MissingInput {
        /// The stage.
        stage: &'static str,
        /// What it needs, by the name of the field.
        input: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A reference image is of no use to compare with.
    #[error("the reference image {problem}")]
    InvalidReference {
        /// What is wrong with it.
        problem: String,
    },
    /// A read-back failed: the device was lost, or the buffer could not be mapped.
    #[error("reading {what} back from the device failed: {reason}")]
    ReadBack {
        /// What was being read.
        what: &'static str,
        /// The device's own words.
        reason: String,
    },
}

impl Error {
    pub(crate) fn scene(
        item: &'static str,
        name: impl Into<String>,
        field: impl Into<String>,
        problem: impl Into<String>,
    ) -> Self {
        Self::InvalidScene {
            item,
            name: name.into(),
            field: field.into(),
            problem: problem.into(),
        }
    }
}
