//! Shader sources, composed from plain WGSL files: the pass's own file first, so that diagnostics keep its line numbers.

macro_rules! compose {
    ($($path:literal),+ $(,)?) => {
        concat!($(include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/", $path)), "\n"),+)
    };
}

/// For a host's own capture shader: write `surface_texel_pack(surface_texel_at(position, normal, reflectance, eye,
/// front_facing))` to an `rgba32uint` target.
///
/// `position` is in the unit frame, `normal` the geometric one (of either sign; `surface_capture_normal(position)` takes
/// it from derivatives), of metal and glass the interpolated one, `reflectance` linear RGB in [0, 1], `eye` is
/// [`CaptureView::eye`](crate::resource::CaptureView::eye). Declares no bindings; its functions begin with
/// `surface_texel_`, `surface_capture_`, `lobe_`, `octahedral_` and `reflectance_`.
pub const CAPTURE: &str = compose![
    "common/surface_texel.wgsl",
    "common/lobe.wgsl",
    "common/surface_capture.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
];

pub(crate) const MESH_GEOMETRY: &str = compose![
    "resource/mesh_geometry.wgsl",
    "common/surface_texel.wgsl",
    "common/surface_capture.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/lobe.wgsl",
    "common/hit.wgsl",
];

pub(crate) const PHOTON_EMITTER: &str = compose![
    "pass/photon_emitter/emit_photons.wgsl",
    "pass/photon_emitter/emit_photon.wgsl",
    "pass/photon_emitter/first_hit.wgsl",
    "common/emission_tables.wgsl",
    "common/emission_grid.wgsl",
    "common/light.wgsl",
    "common/polygon.wgsl",
    "common/photon.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "common/lobe.wgsl",
    "common/hit.wgsl",
];

pub(crate) const PHOTON_EMITTER_LISTED: &str = compose![
    "pass/photon_emitter/emit_listed.wgsl",
    "pass/photon_emitter/emit_photon.wgsl",
    "pass/photon_emitter/first_hit.wgsl",
    "common/path_list.wgsl",
    "common/light.wgsl",
    "common/polygon.wgsl",
    "common/photon.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "common/lobe.wgsl",
    "common/hit.wgsl",
];

pub(crate) const PHOTON_EMITTER_AT_TARGETS: &str = compose![
    "pass/photon_emitter/emit_at_targets.wgsl",
    "pass/photon_emitter/emit_listed_at_targets.wgsl",
    "pass/photon_emitter/first_hit.wgsl",
    "common/path_list.wgsl",
    "common/photon_targets.wgsl",
    "common/light.wgsl",
    "common/polygon.wgsl",
    "common/photon.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "common/lobe.wgsl",
    "common/hit.wgsl",
];

pub(crate) const PHOTON_GUIDING_COUNT: &str = compose![
    "pass/photon_guiding/count_visible.wgsl",
    "pass/photon_guiding/count_params.wgsl",
    "common/emission_grid.wgsl",
    "common/reflection_grid.wgsl",
    "common/sampling.wgsl",
    "common/hash.wgsl",
    "common/photon.wgsl",
    "common/lobe.wgsl",
    "common/g_buffer.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const PHOTON_GUIDING_EMISSION: &str = compose![
    "pass/photon_guiding/update_emission.wgsl",
    "pass/photon_guiding/update_params.wgsl",
    "common/emission_tables.wgsl",
    "common/emission_grid.wgsl",
];

pub(crate) const PHOTON_GUIDING_REFLECTIONS: &str = compose![
    "pass/photon_guiding/update_reflections.wgsl",
    "pass/photon_guiding/update_params.wgsl",
    "common/reflection_tables.wgsl",
    "common/reflection_grid.wgsl",
    "common/sampling.wgsl",
];

pub(crate) const DEPTH_HIERARCHY_BUILD_MEASURE: &str = compose![
    "pass/depth_hierarchy_build/measure_texels.wgsl",
    "common/depth_range.wgsl",
    "common/env_map.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
];

pub(crate) const DEPTH_HIERARCHY_BUILD_JOIN: &str =
    compose!["pass/depth_hierarchy_build/join_cells.wgsl", "common/depth_range.wgsl"];

pub(crate) const IMAGE_SPACE_TRACER_RAYS: &str = compose![
    "pass/image_space_tracer/trace_rays.wgsl",
    "common/surface_rays.wgsl",
    "pass/image_space_tracer/trace_ray.wgsl",
    "pass/image_space_tracer/false_position.wgsl",
    "pass/image_space_tracer/march.wgsl",
    "pass/image_space_tracer/hierarchy.wgsl",
    "pass/image_space_tracer/nearest.wgsl",
    "pass/image_space_tracer/ordered.wgsl",
    "common/depth_range.wgsl",
    "common/env_map.wgsl",
    "common/hit.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
];

pub(crate) const IMAGE_SPACE_TRACER: &str = compose![
    "pass/image_space_tracer/trace_ray.wgsl",
    "pass/image_space_tracer/false_position.wgsl",
    "pass/image_space_tracer/march.wgsl",
    "pass/image_space_tracer/hierarchy.wgsl",
    "pass/image_space_tracer/nearest.wgsl",
    "pass/image_space_tracer/ordered.wgsl",
    "pass/photon_walk/walk_listed.wgsl",
    "pass/photon_walk/walk_photons.wgsl",
    "pass/photon_walk/params.wgsl",
    "common/reflection_tables.wgsl",
    "common/reflection_grid.wgsl",
    "common/depth_range.wgsl",
    "common/env_map.wgsl",
    "common/hit.wgsl",
    "common/path_list.wgsl",
    "common/photon.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "common/lobe.wgsl",
    "common/scatter.wgsl",
    "common/ggx.wgsl",
    "common/fresnel.wgsl",
];

pub(crate) const IMAGE_SPACE_TRACER_LIST: &str = compose![
    "pass/image_space_tracer/list_lost.wgsl",
    "pass/photon_walk/params.wgsl",
    "common/path_list.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
];

#[cfg(feature = "bvh")]
pub(crate) const BVH_TRACER: &str = compose![
    "pass/bvh_tracer/trace_ray.wgsl",
    "pass/bvh_tracer/bindings.wgsl",
    "pass/photon_walk/walk_listed.wgsl",
    "pass/photon_walk/walk_photons.wgsl",
    "pass/photon_walk/params.wgsl",
    "common/reflection_tables.wgsl",
    "common/reflection_grid.wgsl",
    "common/bvh.wgsl",
    "common/bvh_surface.wgsl",
    "common/hit.wgsl",
    "common/path_list.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "common/lobe.wgsl",
    "common/scatter.wgsl",
    "common/ggx.wgsl",
    "common/fresnel.wgsl",
];

#[cfg(feature = "bvh")]
pub(crate) const BVH_TRACER_RAYS: &str = compose![
    "pass/bvh_tracer/trace_rays.wgsl",
    "pass/bvh_tracer/bindings.wgsl",
    "common/bvh.wgsl",
    "common/bvh_surface.wgsl",
    "common/octahedral.wgsl",
    "common/lobe.wgsl",
];

#[cfg(feature = "bvh")]
pub(crate) const BVH_TRACER_SURFACE_RAYS: &str = compose![
    "pass/bvh_tracer/trace_surface_rays.wgsl",
    "pass/bvh_tracer/trace_ray.wgsl",
    "pass/bvh_tracer/bindings.wgsl",
    "common/surface_rays.wgsl",
    "common/bvh.wgsl",
    "common/bvh_surface.wgsl",
    "common/hit.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/lobe.wgsl",
];

pub(crate) const PHOTON_SPLATTER_RECEIVERS: &str = compose![
    "pass/photon_splatter/find_receivers.wgsl",
    "common/receiver_at.wgsl",
    "pass/photon_splatter/receiver_texel.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const PHOTON_SPLATTER_TILED: &str = compose![
    "pass/photon_splatter/tiled.wgsl",
    "common/first_of_key.wgsl",
    "pass/photon_splatter/tiled_params.wgsl",
    "pass/photon_splatter/bandwidth.wgsl",
    "common/splat_record.wgsl",
    "common/splat_surfaces.wgsl",
    "pass/photon_splatter/bins.wgsl",
    "common/bandwidth.wgsl",
    "common/photon.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const STABLE_SORT: &str = compose!["pass/stable_sort.wgsl"];

pub(crate) const PHOTON_SPLATTER_GATHER: &str = compose![
    "pass/photon_splatter/gather_tiled.wgsl",
    "pass/photon_splatter/gather_bins.wgsl",
    "pass/photon_splatter/tiled_params.wgsl",
    "common/gather.wgsl",
    "common/splat_record.wgsl",
    "common/photon.wgsl",
    "pass/photon_splatter/bins.wgsl",
    "common/bandwidth.wgsl",
    "common/splat.wgsl",
    "common/splat_surfaces.wgsl",
    "pass/photon_splatter/receiver_texel.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const PHOTON_SPLATTER_MARKED: &str = compose![
    "pass/photon_splatter/gather_marked.wgsl",
    "pass/photon_splatter/gather_bins.wgsl",
    "pass/photon_splatter/tiled_params.wgsl",
    "common/gather_one.wgsl",
    "common/gather.wgsl",
    "common/splat_record.wgsl",
    "common/photon.wgsl",
    "pass/photon_splatter/bins.wgsl",
    "common/bandwidth.wgsl",
    "pass/photon_splatter/boundary.wgsl",
    "common/boundary.wgsl",
    "common/splat.wgsl",
    "common/splat_surfaces.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/marked_pixels.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
];

pub(crate) const PHOTON_SPLATTER_BINS: &str = compose![
    "pass/photon_splatter/count_bins.wgsl",
    "pass/photon_splatter/raster_params.wgsl",
    "pass/photon_splatter/bins.wgsl",
    "common/bandwidth.wgsl",
    "common/photon.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const PHOTON_SPLATTER_QUADS: &str = compose![
    "pass/photon_splatter/quads.wgsl",
    "pass/photon_splatter/raster.wgsl",
    "pass/photon_splatter/raster_params.wgsl",
    "common/splat.wgsl",
    "common/splat_surfaces.wgsl",
    "pass/photon_splatter/bandwidth.wgsl",
    "pass/photon_splatter/bins.wgsl",
    "common/bandwidth.wgsl",
    "pass/photon_splatter/receiver_texel.wgsl",
    "common/receiver.wgsl",
    "common/photon.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
    "common/sampling.wgsl",
];

pub(crate) const PHOTON_SPLATTER_VOLUMES: &str = compose![
    "pass/photon_splatter/volumes.wgsl",
    "pass/photon_splatter/raster.wgsl",
    "pass/photon_splatter/raster_params.wgsl",
    "common/splat.wgsl",
    "common/splat_surfaces.wgsl",
    "pass/photon_splatter/bandwidth.wgsl",
    "pass/photon_splatter/bins.wgsl",
    "common/bandwidth.wgsl",
    "pass/photon_splatter/receiver_texel.wgsl",
    "common/receiver.wgsl",
    "common/photon.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
    "common/sampling.wgsl",
];

pub(crate) const PHOTON_SPLATTER_FINISH: &str = compose![
    "pass/photon_splatter/finish.wgsl",
    "pass/photon_splatter/boundary.wgsl",
    "common/boundary.wgsl",
    "common/splat.wgsl",
    "common/splat_surfaces.wgsl",
    "pass/photon_splatter/receiver_texel.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
];

pub(crate) const PHOTON_GRID: &str = compose![
    "pass/photon_grid/sort_photons.wgsl",
    "common/lobe.wgsl",
    "common/photon_grid.wgsl",
    "common/bandwidth.wgsl",
    "common/first_of_key.wgsl",
    "common/splat_record.wgsl",
    "common/splat_surfaces.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const ENV_MAP_LIGHTING: &str = compose![
    "pass/env_map_lighting/light_texels.wgsl",
    "common/photon_grid.wgsl",
    "common/grid_light.wgsl",
    "common/bandwidth.wgsl",
    "common/boundary.wgsl",
    "common/gather_one.wgsl",
    "common/gather.wgsl",
    "common/splat.wgsl",
    "common/splat_record.wgsl",
    "common/splat_surfaces.wgsl",
    "common/receiver.wgsl",
    "common/photon.wgsl",
    "common/direct_irradiance.wgsl",
    "common/light_irradiance.wgsl",
    "common/polygon.wgsl",
    "common/is_lit.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/env_map.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
];

pub(crate) const PHOTON_STREAM: &str = compose![
    "pass/photon_stream/stream_impacts.wgsl",
    "pass/photon_stream/stream_listed.wgsl",
    "common/impact.wgsl",
    "common/nearest_surface_light.wgsl",
    "pass/photon_stream/exitant_flux.wgsl",
    "pass/photon_stream/params.wgsl",
    "common/surface_light.wgsl",
    "common/path_list.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/hash.wgsl",
];

pub(crate) const PHOTON_STREAM_NEAR: &str = compose![
    "pass/photon_stream/keep_near.wgsl",
    "common/impact.wgsl",
    "pass/photon_stream/params.wgsl",
    "common/surface_light.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
    "common/hash.wgsl",
];

pub(crate) const PHOTON_STREAM_PLACES: &str = compose![
    "pass/photon_stream/place_lights.wgsl",
    "common/impact.wgsl",
    "common/surface_light.wgsl",
];

pub(crate) const PHOTON_STREAM_AT_IMPACTS: &str = compose![
    "pass/photon_stream/lights_at_impacts.wgsl",
    "pass/photon_stream/exitant_flux.wgsl",
    "pass/photon_stream/params.wgsl",
    "common/surface_light.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/hash.wgsl",
];

pub(crate) const SELECTIVE_EMITTER_PROBE: &str = compose![
    "pass/selective_emitter/list_probes.wgsl",
    "pass/selective_emitter/groups.wgsl",
    "pass/selective_emitter/params.wgsl",
    "common/path_list.wgsl",
];

pub(crate) const SELECTIVE_EMITTER_KEEP: &str = compose![
    "pass/selective_emitter/keep_paths.wgsl",
    "pass/selective_emitter/params.wgsl",
    "common/path_list.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const SELECTIVE_EMITTER_COMPARE: &str = compose![
    "pass/selective_emitter/compare_paths.wgsl",
    "pass/selective_emitter/groups.wgsl",
    "pass/selective_emitter/params.wgsl",
    "common/path_list.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const SELECTIVE_EMITTER_CHOOSE: &str = compose![
    "pass/selective_emitter/choose_groups.wgsl",
    "common/choose_most.wgsl",
    "pass/selective_emitter/groups.wgsl",
    "pass/selective_emitter/params.wgsl",
    "common/path_list.wgsl",
];

pub(crate) const SURFACE_LIGHT_LOOP: &str = compose![
    "pass/surface_light_shading/loop_lights.wgsl",
    "pass/surface_light_shading/bindings.wgsl",
    "pass/surface_light_shading/params.wgsl",
    "common/surface_light.wgsl",
    "common/polygon.wgsl",
    "common/sampling.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const SURFACE_LIGHT_TILES: &str = compose![
    "pass/surface_light_shading/tile_lights.wgsl",
    "pass/surface_light_shading/bindings.wgsl",
    "pass/surface_light_shading/params.wgsl",
    "common/surface_light.wgsl",
    "common/polygon.wgsl",
    "common/sampling.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const SURFACE_LIGHT_DRAW: &str = compose![
    "pass/surface_light_shading/draw_lights.wgsl",
    "pass/surface_light_shading/bindings.wgsl",
    "pass/surface_light_shading/params.wgsl",
    "common/surface_light.wgsl",
    "common/polygon.wgsl",
    "common/sampling.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const SURFACE_LIGHT_SPREAD: &str = compose![
    "pass/surface_light_shading/spread_rays.wgsl",
    "pass/surface_light_shading/shadow_rays.wgsl",
    "pass/surface_light_shading/bindings.wgsl",
    "pass/surface_light_shading/params.wgsl",
    "common/surface_light.wgsl",
    "common/polygon.wgsl",
    "common/surface_rays.wgsl",
    "common/cosine_direction.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const SURFACE_LIGHT_SUM: &str = compose![
    "pass/surface_light_shading/sum_rays.wgsl",
    "pass/surface_light_shading/shadow_rays.wgsl",
    "pass/surface_light_shading/bindings.wgsl",
    "pass/surface_light_shading/params.wgsl",
    "common/surface_light.wgsl",
    "common/polygon.wgsl",
    "common/surface_rays.wgsl",
    "common/hit.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const FINAL_GATHER_SPREAD: &str = compose![
    "pass/final_gather/spread_rays.wgsl",
    "pass/final_gather/params.wgsl",
    "common/surface_rays.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
    "common/cosine_direction.wgsl",
    "common/sampling.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
];

pub(crate) const FINAL_GATHER_SUM: &str = compose![
    "pass/final_gather/sum_hits.wgsl",
    "pass/final_gather/params.wgsl",
    "pass/final_gather/map_light.wgsl",
    "common/surface_rays.wgsl",
    "common/hit.wgsl",
    "common/lobe.wgsl",
    "common/env_map.wgsl",
    "common/surface_texel.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
];

pub(crate) const HEMISPHERE_GATHER: &str = compose![
    "pass/hemisphere_gather.wgsl",
    "common/nearest_surface_light.wgsl",
    "common/surface_light.wgsl",
    "common/surface_texel.wgsl",
    "common/lobe.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
];

pub(crate) const TEXEL_GATHER_RADIOSITY: &str = compose![
    "pass/texel_gather/sum_radiosity.wgsl",
    "pass/texel_gather/params.wgsl",
    "common/surface_light.wgsl",
];

pub(crate) const TEXEL_GATHER_INCIDENT: &str = compose![
    "pass/texel_gather/count_incident.wgsl",
    "pass/texel_gather/params.wgsl",
    "pass/texel_gather/incident_cell.wgsl",
    "common/impact.wgsl",
    "common/surface_light.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
    "common/sampling.wgsl",
];

pub(crate) const TEXEL_GATHER_CHANGES: &str = compose![
    "pass/texel_gather/sum_changes.wgsl",
    "pass/texel_gather/params.wgsl",
    "common/surface_light.wgsl",
];

pub(crate) const TEXEL_GATHER_DUE: &str = compose![
    "pass/texel_gather/mark_due.wgsl",
    "pass/texel_gather/params.wgsl",
    "common/surface_light.wgsl",
];

pub(crate) const TEXEL_GATHER_CHOICE: &str = compose![
    "pass/texel_gather/choose_texels.wgsl",
    "pass/texel_gather/params.wgsl",
    "common/surface_light.wgsl",
    "common/choose_most.wgsl",
    "common/path_list.wgsl",
];

pub(crate) const TEXEL_GATHER_SPREAD: &str = compose![
    "pass/texel_gather/spread_rays.wgsl",
    "pass/texel_gather/params.wgsl",
    "pass/texel_gather/incident_cell.wgsl",
    "common/surface_light.wgsl",
    "common/path_list.wgsl",
    "common/surface_rays.wgsl",
    "common/octahedral.wgsl",
    "common/cosine_direction.wgsl",
    "common/sampling.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
];

pub(crate) const TEXEL_GATHER_SUM: &str = compose![
    "pass/texel_gather/sum_hits.wgsl",
    "pass/texel_gather/params.wgsl",
    "common/nearest_surface_light.wgsl",
    "common/surface_light.wgsl",
    "common/path_list.wgsl",
    "common/surface_rays.wgsl",
    "common/hit.wgsl",
    "common/lobe.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const TEXEL_GATHER_BLEND: &str =
    compose!["pass/texel_gather/blend_texels.wgsl", "pass/texel_gather/params.wgsl",];

pub(crate) const TEXEL_SHADING: &str = compose![
    "pass/texel_shading.wgsl",
    "common/surface_light.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/sampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const CAUSTIC_FILTER_PLOT: &str = compose![
    "pass/caustic_filter/plot_photons.wgsl",
    "pass/caustic_filter/params.wgsl",
    "common/bilateral.wgsl",
    "common/g_buffer.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const CAUSTIC_FILTER: &str = compose![
    "pass/caustic_filter/filter_tiles.wgsl",
    "pass/caustic_filter/params.wgsl",
    "common/bilateral.wgsl",
    "common/g_buffer.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const IRRADIANCE_FILTER: &str = compose![
    "pass/irradiance_filter.wgsl",
    "common/bilateral.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const UPSAMPLER: &str = compose![
    "pass/upsampler.wgsl",
    "common/interpolate.wgsl",
    "common/bilateral.wgsl",
    "common/path_list.wgsl",
    "common/g_buffer.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const DIRECT_LIGHT: &str = compose![
    "pass/direct_light.wgsl",
    "common/direct_irradiance.wgsl",
    "common/light_irradiance.wgsl",
    "common/polygon.wgsl",
    "common/is_lit.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
];

pub(crate) const NEAREST_OCCLUDER: &str = compose![
    "pass/nearest_occluder.wgsl",
    "common/light.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
];

pub(crate) const SOFT_SHADOW_TEST: &str = compose![
    "pass/soft_shadow/test_light.wgsl",
    "pass/soft_shadow/test_by_maps.wgsl",
    "pass/soft_shadow/gap_by_maps.wgsl",
    "pass/soft_shadow/reach.wgsl",
    "pass/soft_shadow/tiles.wgsl",
    "pass/soft_shadow/plane.wgsl",
    "pass/soft_shadow/receiver.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
];

#[cfg(feature = "bvh")]
pub(crate) const SOFT_SHADOW_TEST_BY_TRIANGLES: &str = compose![
    "pass/soft_shadow/test_light.wgsl",
    "pass/soft_shadow/test_by_triangles.wgsl",
    "pass/soft_shadow/reach.wgsl",
    "pass/soft_shadow/tiles.wgsl",
    "pass/soft_shadow/plane.wgsl",
    "pass/soft_shadow/receiver.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "pass/bvh_tracer/bindings.wgsl",
    "common/bvh.wgsl",
    "common/bvh_surface.wgsl",
    "common/lobe.wgsl",
];

pub(crate) const SOFT_SHADOW_LIST: &str = compose![
    "pass/soft_shadow/list_tiles.wgsl",
    "pass/soft_shadow/penumbra_tiles.wgsl",
    "pass/soft_shadow/tiles.wgsl",
    "common/g_buffer.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const SOFT_SHADOW_FLAG: &str = compose![
    "pass/soft_shadow/flag_tiles.wgsl",
    "pass/soft_shadow/penumbra_tiles.wgsl",
    "pass/soft_shadow/tiles.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/g_buffer.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const SOFT_SHADOW_SEARCH: &str = compose![
    "pass/soft_shadow/search_occluders.wgsl",
    "pass/soft_shadow/search_cross.wgsl",
    "pass/soft_shadow/test_by_maps.wgsl",
    "pass/soft_shadow/gap_by_maps.wgsl",
    "pass/soft_shadow/reach.wgsl",
    "pass/soft_shadow/tile_list_pixel.wgsl",
    "pass/soft_shadow/tiles.wgsl",
    "pass/soft_shadow/plane.wgsl",
    "pass/soft_shadow/receiver.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/hash.wgsl",
];

pub(crate) const SOFT_SHADOW_BLUR: &str = compose![
    "pass/soft_shadow/blur_axis.wgsl",
    "pass/soft_shadow/blur.wgsl",
    "pass/soft_shadow/disc.wgsl",
    "pass/soft_shadow/test_by_maps.wgsl",
    "pass/soft_shadow/gap_by_maps.wgsl",
    "pass/soft_shadow/tile_list_pixel.wgsl",
    "pass/soft_shadow/tiles.wgsl",
    "pass/soft_shadow/plane.wgsl",
    "pass/soft_shadow/receiver.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
];

pub(crate) const SOFT_SHADOW_DISC: &str = compose![
    "pass/soft_shadow/blur_disc.wgsl",
    "pass/soft_shadow/gather_disc.wgsl",
    "pass/soft_shadow/blur.wgsl",
    "pass/soft_shadow/test_by_maps.wgsl",
    "pass/soft_shadow/gap_by_maps.wgsl",
    "pass/soft_shadow/disc.wgsl",
    "pass/soft_shadow/tile_list_pixel.wgsl",
    "pass/soft_shadow/tiles.wgsl",
    "pass/soft_shadow/plane.wgsl",
    "pass/soft_shadow/receiver.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
];

pub(crate) const SOFT_SHADOW_FILTER: &str = compose![
    "pass/soft_shadow/filter_maps.wgsl",
    "pass/soft_shadow/test_by_maps.wgsl",
    "pass/soft_shadow/gap_by_maps.wgsl",
    "pass/soft_shadow/reach.wgsl",
    "pass/soft_shadow/disc.wgsl",
    "pass/soft_shadow/plane.wgsl",
    "pass/soft_shadow/receiver.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
];

#[cfg(feature = "bvh")]
pub(crate) const SOFT_SHADOW_TRACE: &str = compose![
    "pass/soft_shadow/trace_lamp.wgsl",
    "pass/soft_shadow/receiver.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/polygon.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "pass/bvh_tracer/bindings.wgsl",
    "common/bvh.wgsl",
    "common/bvh_surface.wgsl",
    "common/lobe.wgsl",
];

pub(crate) const SPECULAR_PATHS_BEGIN: &str = compose![
    "pass/specular_paths/begin_paths.wgsl",
    "pass/specular_paths/params.wgsl",
    "common/surface_rays.wgsl",
    "common/eye_scatterer.wgsl",
    "common/punctual_light.wgsl",
    "common/scatter.wgsl",
    "common/ggx.wgsl",
    "common/fresnel.wgsl",
    "common/lobe.wgsl",
    "common/hit.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/light_irradiance.wgsl",
    "common/polygon.wgsl",
    "common/is_lit.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/surface_texel.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/octahedral.wgsl",
    "common/sampling.wgsl",
    "common/hash.wgsl",
];

pub(crate) const SPECULAR_PATHS_ADVANCE: &str = compose![
    "pass/specular_paths/advance_paths.wgsl",
    "common/environment.wgsl",
    "common/environment_texel.wgsl",
    "pass/specular_paths/params.wgsl",
    "common/punctual_light.wgsl",
    "common/surface_rays.wgsl",
    "common/scatter.wgsl",
    "common/ggx.wgsl",
    "common/fresnel.wgsl",
    "common/lobe.wgsl",
    "common/hit.wgsl",
    "common/photon_grid.wgsl",
    "common/grid_light.wgsl",
    "common/bandwidth.wgsl",
    "common/gather_one.wgsl",
    "common/gather.wgsl",
    "common/splat.wgsl",
    "common/splat_record.wgsl",
    "common/splat_surfaces.wgsl",
    "common/receiver.wgsl",
    "common/photon.wgsl",
    "common/direct_irradiance.wgsl",
    "common/light_irradiance.wgsl",
    "common/polygon.wgsl",
    "common/is_lit.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/hash.wgsl",
];

pub(crate) const GLOSSY_LIGHT: &str = compose![
    "pass/glossy_light.wgsl",
    "common/eye_scatterer.wgsl",
    "common/punctual_light.wgsl",
    "common/photon_grid.wgsl",
    "common/bandwidth.wgsl",
    "common/splat.wgsl",
    "common/splat_record.wgsl",
    "common/splat_surfaces.wgsl",
    "common/photon.wgsl",
    "common/scatter.wgsl",
    "common/ggx.wgsl",
    "common/fresnel.wgsl",
    "common/lobe.wgsl",
    "common/hit.wgsl",
    "common/receiver_at.wgsl",
    "common/receiver.wgsl",
    "common/g_buffer.wgsl",
    "common/light_irradiance.wgsl",
    "common/polygon.wgsl",
    "common/is_lit.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/surface_texel.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/octahedral.wgsl",
    "common/sampling.wgsl",
];

pub(crate) const COMPOSITE: &str = compose![
    "pass/composite.wgsl",
    "common/surface_radiance.wgsl",
    "common/environment.wgsl",
    "common/environment_texel.wgsl",
    "common/lobe.wgsl",
    "common/full_screen.wgsl",
    "common/g_buffer.wgsl",
    "common/octahedral.wgsl",
];

pub(crate) const FUSED_COMPOSITE: &str = compose![
    "pass/fused_composite.wgsl",
    "common/surface_radiance.wgsl",
    "common/interpolate.wgsl",
    "common/bilateral.wgsl",
    "common/subsampling.wgsl",
    "pass/soft_shadow/search_cross.wgsl",
    "pass/soft_shadow/gather_disc.wgsl",
    "pass/soft_shadow/blur.wgsl",
    "pass/soft_shadow/disc.wgsl",
    "pass/soft_shadow/gap_by_maps.wgsl",
    "pass/soft_shadow/reach.wgsl",
    "pass/soft_shadow/tiles.wgsl",
    "pass/soft_shadow/plane.wgsl",
    "pass/soft_shadow/receiver.wgsl",
    "pass/soft_shadow/params.wgsl",
    "common/light_irradiance.wgsl",
    "common/polygon.wgsl",
    "common/is_lit.wgsl",
    "common/shadow.wgsl",
    "common/light.wgsl",
    "common/environment.wgsl",
    "common/environment_texel.wgsl",
    "common/lobe.wgsl",
    "common/full_screen.wgsl",
    "common/g_buffer.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/hash.wgsl",
];

pub(crate) const ACCUMULATOR: &str = compose!["pass/accumulator.wgsl", "common/full_screen.wgsl"];

pub(crate) const TONE_MAP: &str = compose!["pass/tone_map.wgsl", "common/full_screen.wgsl"];

pub(crate) const ENV_MAP_SELECTOR: &str = compose![
    "pass/env_map_selector/select_maps.wgsl",
    "pass/env_map_selector/params.wgsl",
    "pass/env_map_selector/samples.wgsl",
    "pass/env_map_selector/candidate.wgsl",
    "common/surface_sample.wgsl",
    "common/surface_texel.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
];

pub(crate) const ENV_MAP_SELECTOR_SAMPLES: &str = compose![
    "pass/env_map_selector/pick_samples.wgsl",
    "pass/env_map_selector/params.wgsl",
    "pass/env_map_selector/candidate.wgsl",
    "common/surface_sample.wgsl",
    "common/surface_texel.wgsl",
    "common/photon.wgsl",
    "common/hash.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
];

pub(crate) const ENV_MAP_SELECTOR_CLEAR: &str =
    compose!["pass/env_map_selector/clear_tile.wgsl", "common/full_screen.wgsl"];

pub(crate) const TRACE_STATISTICS: &str = compose![
    "pass/trace_statistics.wgsl",
    "common/photon.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
];

#[cfg(all(feature = "bvh", feature = "reference"))]
pub(crate) const PATH_TRACER: &str = compose![
    "reference/path_tracer/trace_paths.wgsl",
    "reference/path_tracer/emitters.wgsl",
    "reference/path_tracer/scatterer.wgsl",
    "common/environment_texel.wgsl",
    "common/scatter.wgsl",
    "pass/bvh_tracer/bindings.wgsl",
    "common/bvh.wgsl",
    "common/bvh_surface.wgsl",
    "common/ggx.wgsl",
    "common/fresnel.wgsl",
    "common/octahedral.wgsl",
    "common/sampling.wgsl",
    "common/hash.wgsl",
    "common/lobe.wgsl",
];

#[cfg(all(feature = "bvh", feature = "reference"))]
pub(crate) const PATH_TRACER_RESOLVE: &str = compose!["reference/path_tracer/resolve.wgsl", "common/full_screen.wgsl"];

/// What tests evaluate with a binding group of their own.
#[cfg(all(test, feature = "bvh"))]
pub(crate) const BVH_FUNCTIONS: &str = compose![
    "pass/bvh_tracer/bindings.wgsl",
    "common/bvh.wgsl",
    "common/bvh_surface.wgsl",
    "common/octahedral.wgsl",
    "common/lobe.wgsl",
];

/// Every composed module, by the name of its pass; for validation and for tools.
#[doc(hidden)]
pub const MODULES: &[(&str, &str)] = &[
    ("MeshGeometry", MESH_GEOMETRY),
    ("PhotonEmitter", PHOTON_EMITTER),
    ("PhotonEmitter::listed", PHOTON_EMITTER_LISTED),
    ("PhotonEmitter::at_targets", PHOTON_EMITTER_AT_TARGETS),
    ("PhotonGuiding count", PHOTON_GUIDING_COUNT),
    ("PhotonGuiding emission", PHOTON_GUIDING_EMISSION),
    ("PhotonGuiding reflections", PHOTON_GUIDING_REFLECTIONS),
    ("DepthHierarchyBuild measure", DEPTH_HIERARCHY_BUILD_MEASURE),
    ("DepthHierarchyBuild join", DEPTH_HIERARCHY_BUILD_JOIN),
    ("ImageSpaceTracer", IMAGE_SPACE_TRACER),
    ("ImageSpaceTracer rays", IMAGE_SPACE_TRACER_RAYS),
    ("ImageSpaceTracer list", IMAGE_SPACE_TRACER_LIST),
    #[cfg(feature = "bvh")]
    ("BvhTracer", BVH_TRACER),
    #[cfg(feature = "bvh")]
    ("BvhTracer rays", BVH_TRACER_RAYS),
    #[cfg(feature = "bvh")]
    ("BvhTracer surface rays", BVH_TRACER_SURFACE_RAYS),
    ("PhotonSplatter receivers", PHOTON_SPLATTER_RECEIVERS),
    ("PhotonSplatter tiled", PHOTON_SPLATTER_TILED),
    ("StableSort", STABLE_SORT),
    ("PhotonSplatter gather", PHOTON_SPLATTER_GATHER),
    ("PhotonSplatter marked", PHOTON_SPLATTER_MARKED),
    ("PhotonSplatter bins", PHOTON_SPLATTER_BINS),
    ("PhotonSplatter quads", PHOTON_SPLATTER_QUADS),
    ("PhotonSplatter volumes", PHOTON_SPLATTER_VOLUMES),
    ("PhotonSplatter finish", PHOTON_SPLATTER_FINISH),
    ("PhotonGrid", PHOTON_GRID),
    ("SpecularPaths begin", SPECULAR_PATHS_BEGIN),
    ("SpecularPaths", SPECULAR_PATHS_ADVANCE),
    ("GlossyLight", GLOSSY_LIGHT),
    ("EnvMapLighting", ENV_MAP_LIGHTING),
    ("PhotonStream", PHOTON_STREAM),
    ("PhotonStream near", PHOTON_STREAM_NEAR),
    ("PhotonStream places", PHOTON_STREAM_PLACES),
    ("PhotonStream at impacts", PHOTON_STREAM_AT_IMPACTS),
    ("SelectiveEmitter probe", SELECTIVE_EMITTER_PROBE),
    ("SelectiveEmitter keep", SELECTIVE_EMITTER_KEEP),
    ("SelectiveEmitter compare", SELECTIVE_EMITTER_COMPARE),
    ("SelectiveEmitter choose", SELECTIVE_EMITTER_CHOOSE),
    ("SurfaceLightShading loop", SURFACE_LIGHT_LOOP),
    ("SurfaceLightShading tiles", SURFACE_LIGHT_TILES),
    ("SurfaceLightShading draw", SURFACE_LIGHT_DRAW),
    ("SurfaceLightShading spread", SURFACE_LIGHT_SPREAD),
    ("SurfaceLightShading sum", SURFACE_LIGHT_SUM),
    ("FinalGather spread", FINAL_GATHER_SPREAD),
    ("FinalGather sum", FINAL_GATHER_SUM),
    ("HemisphereGather", HEMISPHERE_GATHER),
    ("TexelGather radiosity", TEXEL_GATHER_RADIOSITY),
    ("TexelGather incident", TEXEL_GATHER_INCIDENT),
    ("TexelGather changes", TEXEL_GATHER_CHANGES),
    ("TexelGather due", TEXEL_GATHER_DUE),
    ("TexelGather choice", TEXEL_GATHER_CHOICE),
    ("TexelGather spread", TEXEL_GATHER_SPREAD),
    ("TexelGather sum", TEXEL_GATHER_SUM),
    ("TexelGather blend", TEXEL_GATHER_BLEND),
    ("TexelShading", TEXEL_SHADING),
    ("CausticFilter plot", CAUSTIC_FILTER_PLOT),
    ("CausticFilter", CAUSTIC_FILTER),
    ("IrradianceFilter", IRRADIANCE_FILTER),
    ("Upsampler", UPSAMPLER),
    ("DirectLight", DIRECT_LIGHT),
    ("NearestOccluder", NEAREST_OCCLUDER),
    ("SoftShadow test", SOFT_SHADOW_TEST),
    #[cfg(feature = "bvh")]
    ("SoftShadow test by triangles", SOFT_SHADOW_TEST_BY_TRIANGLES),
    ("SoftShadow list", SOFT_SHADOW_LIST),
    ("SoftShadow flag", SOFT_SHADOW_FLAG),
    ("SoftShadow search", SOFT_SHADOW_SEARCH),
    ("SoftShadow blur", SOFT_SHADOW_BLUR),
    ("SoftShadow disc", SOFT_SHADOW_DISC),
    ("SoftShadow filter", SOFT_SHADOW_FILTER),
    #[cfg(feature = "bvh")]
    ("SoftShadow trace", SOFT_SHADOW_TRACE),
    ("Composite", COMPOSITE),
    ("FusedComposite", FUSED_COMPOSITE),
    ("Accumulator", ACCUMULATOR),
    ("ToneMap", TONE_MAP),
    ("EnvMapSelector", ENV_MAP_SELECTOR),
    ("EnvMapSelector samples", ENV_MAP_SELECTOR_SAMPLES),
    ("EnvMapSelector clear", ENV_MAP_SELECTOR_CLEAR),
    ("TraceStatistics", TRACE_STATISTICS),
    #[cfg(all(feature = "bvh", feature = "reference"))]
    ("PathTracer", PATH_TRACER),
    #[cfg(all(feature = "bvh", feature = "reference"))]
    ("PathTracer resolve", PATH_TRACER_RESOLVE),
];

/// Functions of `shaders/common/` that tests compare with `f64` twins.
#[doc(hidden)]
pub const COMMON: &str = compose![
    "common/depth_range.wgsl",
    "common/path_list.wgsl",
    "common/photon.wgsl",
    "common/polygon.wgsl",
    "common/hit.wgsl",
    "common/lobe.wgsl",
    "common/surface_texel.wgsl",
    "common/subsampling.wgsl",
    "common/octahedral.wgsl",
    "common/reflectance.wgsl",
    "common/cube_face.wgsl",
    "common/sampling.wgsl",
    "common/random.wgsl",
    "common/halton.wgsl",
    "common/hash.wgsl",
    "common/scatter.wgsl",
    "common/ggx.wgsl",
    "common/fresnel.wgsl",
];
