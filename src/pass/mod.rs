//! Layer 3: the passes, one technique per file, all of one silhouette.
//!
//! A pass holds pipelines and is made once per device; its `…Resources` hold what lives across frames; its `…Inputs` are
//! borrowed for one frame; `record` writes commands into the host's encoder and neither submits nor waits. A pass knows
//! the resources at its seams and no other pass.

pub(crate) mod accumulator;
#[cfg(feature = "bvh")]
pub(crate) mod bvh_tracer;
mod capture;
pub(crate) mod caustic_filter;
pub(crate) mod composite;
pub(crate) mod depth_hierarchy_build;
pub(crate) mod direct_light;
mod env_map_capture;
pub(crate) mod env_map_lighting;
pub(crate) mod env_map_selector;
pub(crate) mod final_gather;
mod full_screen;
pub(crate) mod fused_composite;
mod g_buffer_capture;
pub(crate) mod glossy_light;
pub(crate) mod hemisphere_gather;
pub(crate) mod image_space_tracer;
pub(crate) mod irradiance_filter;
pub(crate) mod nearest_occluder;
pub(crate) mod photon_emitter;
pub(crate) mod photon_grid;
pub(crate) mod photon_guiding;
pub(crate) mod photon_splatter;
pub(crate) mod photon_stream;
pub(crate) mod photon_walk;
pub(crate) mod selective_emitter;
mod shadow_map_capture;
pub(crate) mod soft_shadow;
pub(crate) mod specular_paths;
pub(crate) mod stable_sort;
pub(crate) mod surface_light_shading;
pub(crate) mod texel_gather;
pub(crate) mod texel_shading;
pub(crate) mod tone_map;
pub(crate) mod trace_statistics;
pub(crate) mod upsampler;

pub use accumulator::{Accumulator, AccumulatorInputs, AccumulatorResources};
#[cfg(feature = "bvh")]
pub use bvh_tracer::{
    BvhTracer, BvhTracerInputs, BvhTracerRayInputs, BvhTracerResources, BvhTracerSurfaceRayInputs, RayQuery,
};
pub use caustic_filter::{CausticFilter, CausticFilterInputs, CausticFilterResources, CausticFilterSettings};
pub use composite::{Composite, CompositeInputs, CompositeResources, CompositeSettings};
pub use depth_hierarchy_build::{DepthHierarchyBuild, DepthHierarchyBuildInputs, DepthHierarchyBuildResources};
pub use direct_light::{DirectLight, DirectLightInputs, DirectLightResources};
pub use env_map_capture::{EnvMapCapture, EnvMapCaptureInputs, EnvMapCaptureResources};
pub use env_map_lighting::{EnvMapLighting, EnvMapLightingInputs, EnvMapLightingResources, EnvMapLightingSettings};
pub use env_map_selector::{
    CoverageMeasure, EnvMapSelector, EnvMapSelectorInputs, EnvMapSelectorResources, EnvMapSelectorSettings,
    MAX_SELECTED, SelectBlockingInputs, Selection, SelectionStep, Sight,
};
pub use final_gather::{FinalGather, FinalGatherInputs, FinalGatherResources};
pub use fused_composite::{FusedComposite, FusedCompositeInputs, FusedCompositeResources};
pub use g_buffer_capture::{GBufferCapture, GBufferCaptureInputs};
pub use glossy_light::{GlossyLight, GlossyLightInputs, GlossyLightResources};
pub use hemisphere_gather::{HemisphereGather, HemisphereGatherInputs, HemisphereGatherResources};
pub use image_space_tracer::{
    ImageSpaceTracer, ImageSpaceTracerInputs, ImageSpaceTracerRayInputs, ImageSpaceTracerResources,
    ImageSpaceTracerSettings, TraceMethod,
};
pub(crate) use irradiance_filter::MOST_RADIUS as MOST_FILTER_RADIUS;
pub use irradiance_filter::{
    IrradianceFilter, IrradianceFilterInputs, IrradianceFilterResources, IrradianceFilterSettings,
};
pub use nearest_occluder::{NearestOccluder, NearestOccluderInputs, NearestOccluderResources};
pub use photon_emitter::{FirstHits, PhotonEmitter, PhotonEmitterInputs, PhotonEmitterResources, PhotonSpread};
pub use photon_grid::{PhotonGrid, PhotonGridInputs, PhotonGridResources, SortedPhotons};
pub use photon_guiding::{
    Guiding, GuidingUpdateInputs, GuidingUpdateResources, PhotonGuiding, PhotonGuidingInputs, PhotonGuidingResources,
};
pub(crate) use photon_splatter::LARGEST_RADIUS;
pub use photon_splatter::{
    Bandwidth, BoundaryCorrection, Kernel, MarkedSplatInputs, PhotonSplatter, PhotonSplatterConfig,
    PhotonSplatterInputs, PhotonSplatterResources, PhotonSplatterSettings, SplatShape, progressive_scale,
};
pub use photon_stream::{ImpactLightInputs, PhotonStream, PhotonStreamInputs, PhotonStreamResources};
pub use photon_walk::SharedHop;
pub use selective_emitter::{
    SelectiveEmitter, SelectiveEmitterInputs, SelectiveEmitterResources, SelectiveEmitterSettings,
};
pub use shadow_map_capture::{ShadowMapCapture, ShadowMapCaptureInputs, ShadowMapCaptureResources};
pub(crate) use soft_shadow::{MAX_POINTS, MAX_TAPS};
pub use soft_shadow::{
    OccluderTest, PenumbraSearch, ShadowMethod, ShadowTarget, SoftShadow, SoftShadowInputs, SoftShadowResources,
    SoftShadowSettings,
};
pub use specular_paths::{PathShape, SpecularPaths, SpecularPathsInputs, SpecularPathsResources};
pub use surface_light_shading::{
    IndirectShadows, LightForm, LightShape, SurfaceLightRays, SurfaceLightShading, SurfaceLightShadingInputs,
    SurfaceLightShadingResources, SurfaceLightShadingSettings,
};
pub use texel_gather::{TexelGather, TexelGatherInputs, TexelGatherResources, TexelGatherSettings};
pub use texel_shading::{TexelShading, TexelShadingInputs, TexelShadingResources};
pub use tone_map::{ToneCurve, ToneMap, ToneMapInputs, ToneMapResources, ToneMapSettings};
pub use trace_statistics::{HopStatistics, TraceStatistics, TraceStatisticsInputs, TraceStatisticsResources};
pub use upsampler::{Upsampler, UpsamplerInputs, UpsamplerResources, UpsamplerSettings};

/// Workgroups for `count` invocations of 64, and the invocations in a row of the dispatch.
fn dispatch_64(count: u32) -> ([u32; 2], u32) {
    let groups = crate::gpu::dispatch_size(count.div_ceil(64));
    (groups, groups[0] * 64)
}

#[cfg(test)]
mod tests {
    #[test]
    fn dispatches_cover_every_invocation_within_the_limit() {
        for count in [0, 1, 64, 65, 4_194_240, 4_194_241, 100_000_000] {
            let ([x, y], row) = super::dispatch_64(count);
            assert!(x <= 65_535 && y <= 65_535);
            assert!(u64::from(row) * u64::from(y) >= u64::from(count));
        }
    }
}
