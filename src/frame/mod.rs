//! Layer 4: everything composed. [`Settings`] say how much to spend, [`Plan`] which stages a scene needs and why,
//! [`GiRenderer`] records them in order. It uses public passes only: whatever it does, a host can do by hand.

mod budget;
mod caustic_view;
mod direct_scene;
mod direct_view;
mod env_map_placement;
mod error_estimate;
mod gi_renderer;
mod guiding_schedule;
mod hemisphere_scene;
mod illumination_scene;
mod indirect_scene;
mod indirect_view;
#[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
mod photon_feeder;
mod photon_rounds;
mod plan;
mod ray_tracers;
mod recapture;
mod selection_schedule;
mod selective_photons;
mod settings;
mod specular_view;
mod stand_ins;
mod surface_light_scene;
mod surface_light_view;
mod traced_photons;

pub use budget::{Budget, BudgetController, Rung};
pub use error_estimate::ErrorEstimate;
pub use gi_renderer::{GiRenderer, SceneInputs, ViewInputs, ViewResources};
#[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
pub use photon_feeder::PhotonFeeder;
pub use plan::{Plan, PlannedStage, Stage};
pub use settings::{
    CausticMethod, CausticSettings, FinalGatherSettings, GlossyMethod, IlluminationMapSettings, IndirectMethod,
    LightPlacement, SelectiveSettings, Settings, SurfaceLightSettings, TexelGatherMethod, TracerKind, Upsampling,
};
