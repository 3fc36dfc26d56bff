//! What Rust and WGSL must agree on, checked without a GPU: shaders are valid, PODs lie in memory as their twins do,
//! bindings match bind group layouts, and nothing needs more than the default limits.

use crate::gpu::Slot;
use crate::pass::photon_splatter::{raster, tiled};
use crate::pass::{
    accumulator, caustic_filter, composite, depth_hierarchy_build, direct_light, env_map_lighting, env_map_selector,
    final_gather, fused_composite, glossy_light, hemisphere_gather, image_space_tracer, irradiance_filter,
    nearest_occluder, photon_emitter, photon_grid, photon_guiding, photon_splatter, photon_stream, photon_walk,
    selective_emitter, soft_shadow, specular_paths, stable_sort, surface_light_shading, texel_gather, texel_shading,
    tone_map, trace_statistics, upsampler,
};
#[cfg(all(feature = "bvh", feature = "reference"))]
use crate::reference::{emitters, path_tracer};
use crate::resource::{
    MAX_LIGHTS, Photon, PhotonMap, PhotonState, SurfaceHit, SurfaceHitKind, SurfaceRay, environment, g_buffer,
    guiding_tables, hemispheres, lights, marked_pixels, mesh_geometry, path_list, pending_penumbrae, photon_groups,
    photon_pool, photon_targets, surface_lights, view,
};
use crate::scene::Material;
use crate::wgsl;
#[cfg(feature = "bvh")]
use crate::{
    pass::bvh_tracer,
    resource::{Ray, RayHit, bvh_geometry, bvh_mesh},
};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Handle, ImageClass, ImageDimension, Literal, ScalarKind, StorageAccess, Type, TypeInner};
use std::collections::BTreeMap;
use std::mem::offset_of;

/// What a shader may use. Core WebGPU is three bits more: cube arrays (`CUBE_ARRAY_TEXTURES`), per-sample shading
/// (`MULTISAMPLED_SHADING`) and f16 packing (`SHADER_FLOAT16_IN_FLOAT32`). wgpu takes them from downlevel flags, so an
/// adapter may lack them, and no shader of this crate wants them; every other bit stands for an optional feature.
const CAPABILITIES: Capabilities = Capabilities::empty();

/// A parsed and validated module.
struct Shader {
    module: naga::Module,
    info: ModuleInfo,
}

impl Shader {
    fn new(name: &str, source: &str) -> Self {
        let module = naga::front::wgsl::parse_str(source)
            .unwrap_or_else(|e| panic!("{name} does not parse: {}", e.emit_to_string(source)));
        let info = Validator::new(ValidationFlags::all(), CAPABILITIES)
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name} is not valid: {}", e.emit_to_string(source)));
        Self { module, info }
    }

    fn size(&self, ty: Handle<Type>) -> u32 {
        self.module.types[ty].inner.size(self.module.to_ctx())
    }

    /// What the numbers of a type are; `None` for a struct. Atomics are plain numbers to Rust.
    fn scalar(&self, ty: Handle<Type>) -> Option<ScalarKind> {
        match self.module.types[ty].inner {
            TypeInner::Atomic(scalar) => Some(scalar.kind),
            TypeInner::Array { base, .. } => self.scalar(base),
            ref inner => inner.scalar_kind(),
        }
    }

    /// The struct that a buffer variable holds: its type, or the element of its array.
    fn buffer_struct(&self, ty: Handle<Type>) -> Option<&str> {
        match self.module.types[ty].inner {
            TypeInner::Struct { .. } => self.module.types[ty].name.as_deref(),
            TypeInner::Array { base, .. } => self.buffer_struct(base),
            _ => None,
        }
    }

    fn struct_named(&self, name: &str) -> (Handle<Type>, &[naga::StructMember]) {
        self.module
            .types
            .iter()
            .find_map(|(handle, ty)| match &ty.inner {
                TypeInner::Struct { members, .. } if ty.name.as_deref() == Some(name) => Some((handle, &members[..])),
                _ => None,
            })
            .unwrap_or_else(|| panic!("no struct {name}"))
    }

    fn members(&self, name: &str) -> Vec<Member> {
        let member = |m: &naga::StructMember| Member {
            name: m.name.clone().unwrap_or_default(),
            offset: m.offset as usize,
            size: self.size(m.ty) as usize,
            scalar: self.scalar(m.ty),
        };
        self.struct_named(name).1.iter().map(member).collect()
    }

    fn constant(&self, name: &str) -> Literal {
        let (_, constant) = self
            .module
            .constants
            .iter()
            .find(|(_, c)| c.name.as_deref() == Some(name))
            .unwrap_or_else(|| panic!("no constant {name}"));
        match self.module.global_expressions[constant.init] {
            naga::Expression::Literal(value) => value,
            ref other => panic!("{name} is {other:?}"),
        }
    }

    /// Group and binding of every resource, and what it is, as WGSL writes it.
    fn bindings(&self) -> BTreeMap<[u32; 2], String> {
        let mut bindings = BTreeMap::new();
        for (_, variable) in self.module.global_variables.iter() {
            if let Some(at) = variable.binding {
                let kind = kind_of_variable(variable.space, &self.module.types[variable.ty].inner);
                let taken = bindings.insert([at.group, at.binding], kind);
                assert_eq!(taken, None, "two variables at {at:?}");
            }
        }
        bindings
    }
}

/// Every composed module, by name.
fn shaders() -> impl Iterator<Item = (&'static str, Shader)> {
    wgsl::MODULES
        .iter()
        .map(|&(name, source)| (name, Shader::new(name, source)))
}

#[test]
fn every_module_is_valid_core_wgsl() {
    for (name, shader) in shaders() {
        assert!(!shader.module.entry_points.is_empty(), "{name} has no entry point");
    }
}

#[test]
fn the_capture_functions_are_valid_in_a_host_shader_and_bind_nothing() {
    let host = "
        @fragment
        fn fragment(
            @location(0) position: vec3f, @location(1) eye: vec4f, @builtin(front_facing) front_facing: bool,
        ) -> @location(0) vec4u {
            let normal = surface_capture_normal(position);
            return surface_texel_pack(surface_texel_at(position, normal, vec3f(0.5), eye, front_facing));
        }";
    let shader = Shader::new("CAPTURE", &(wgsl::CAPTURE.to_owned() + host));
    assert!(shader.module.global_variables.is_empty());
}

#[test]
fn the_common_functions_are_valid_by_themselves() {
    let host = "@compute @workgroup_size(1) fn main() {}";
    let shader = Shader::new("COMMON", &(wgsl::COMMON.to_owned() + host));
    assert!(shader.module.global_variables.is_empty());
}

/// One member of a struct, on either side.
#[derive(Debug, Clone, PartialEq)]
struct Member {
    name: String,
    offset: usize,
    size: usize,
    /// What its numbers are; `None` for a struct.
    scalar: Option<ScalarKind>,
}

/// What PODs are made of, and what WGSL calls its numbers.
trait Field {
    const SCALAR: Option<ScalarKind>;
}

impl Field for f32 {
    const SCALAR: Option<ScalarKind> = Some(ScalarKind::Float);
}

impl Field for u32 {
    const SCALAR: Option<ScalarKind> = Some(ScalarKind::Uint);
}

impl<T: Field, const N: usize> Field for [T; N] {
    const SCALAR: Option<ScalarKind> = T::SCALAR;
}

impl Field for photon_splatter::gpu::Bandwidth {
    const SCALAR: Option<ScalarKind> = None;
}

/// A member of `P`; the accessor is there for its type.
fn member<P, T: Field>(name: &str, offset: usize, _accessor: fn(&P) -> &T) -> Member {
    Member {
        name: name.to_owned(),
        offset,
        size: size_of::<T>(),
        scalar: T::SCALAR,
    }
}

/// A POD and the WGSL struct it must equal.
struct Twin {
    source: &'static str,
    name: &'static str,
    size: usize,
    /// In memory order, without padding.
    members: Vec<Member>,
}

/// Lists a POD's members; leaving one out does not compile. Those called `_pad…` are padding.
macro_rules! twin {
    ($source:expr, $name:literal, $pod:path { $($field:ident),+ $(,)? }) => {{
        let _every_member_is_listed = |$pod { $($field: _),+ }: $pod| {};
        let mut members = vec![
            $(member(stringify!($field), offset_of!($pod, $field), |pod: &$pod| &pod.$field)),+
        ];
        members.retain(|m| !m.name.starts_with("_pad"));
        members.sort_by_key(|m| m.offset);
        Twin { source: $source, name: $name, size: size_of::<$pod>(), members }
    }};
}

#[rustfmt::skip] // One POD a paragraph.
fn twins() -> Vec<Twin> {
    vec![
        twin!(wgsl::COMPOSITE, "View", g_buffer::gpu::ViewUniform {
            view_projection, inverse_view_projection, eye, size, origin, normal_encoding, _pad,
        }),
        twin!(wgsl::DIRECT_LIGHT, "Light", lights::gpu::LightRecord {
            position, kind, direction, inner, intensity, outer, right, first_layer, up, layer_count, photon_flux,
            half_extent, first_photon, photon_count, density, disc_radius, extent, first_polygon,
            direct_polygons, polygon_count,
        }),
        twin!(wgsl::COMPOSITE, "Environment", environment::gpu::Environment { radiance, rotation, size, _pad }),
        twin!(wgsl::DIRECT_LIGHT, "Polygon", lights::gpu::Polygon { corner, corners, u, until, v, area, radiance, _pad }),
        twin!(wgsl::PHOTON_EMITTER, "Photon", Photon {
            position, state, flux, density, normal, direction, reflectance, light_and_surface,
        }),
        twin!(wgsl::MESH_GEOMETRY, "View", mesh_geometry::gpu::MeshView { view_projection, eye }),
        twin!(wgsl::MESH_GEOMETRY, "Instance", mesh_geometry::gpu::MeshInstance {
            transform, normal_transform, material, mirrored, surface, _pad,
        }),
        twin!(wgsl::MESH_GEOMETRY, "Material", mesh_geometry::gpu::MeshMaterial {
            base_color, alpha_cutoff, emission, metallic, roughness, transmission, index_of_refraction, _pad,
        }),
        twin!(wgsl::PHOTON_EMITTER, "Params", photon_emitter::gpu::Params {
            photon_count, light_count, sample_offset, shadow_map_size, row, traces_first, guided,
        }),
        twin!(wgsl::IMAGE_SPACE_TRACER, "Params", image_space_tracer::gpu::Params {
            map_count, map_size, iterations, epsilon, most_fetches, doubts_normals,
        }),
        twin!(wgsl::IMAGE_SPACE_TRACER_RAYS, "ListParams", image_space_tracer::gpu::ListParams { ray_count, row }),
        twin!(wgsl::IMAGE_SPACE_TRACER_RAYS, "SurfaceRay", SurfaceRay { position, normal, direction, tag }),
        twin!(wgsl::IMAGE_SPACE_TRACER_RAYS, "SurfaceHit", SurfaceHit {
            distance, kind, normal, reflectance, fetches, maps, steps, lobe,
        }),
        twin!(wgsl::IMAGE_SPACE_TRACER, "WalkParams", photon_walk::gpu::WalkParams {
            photon_count, first_hop, last_hop, roulette_from, sample_offset, row, is_shared, map, guided,
        }),
        twin!(wgsl::IMAGE_SPACE_TRACER_LIST, "PathList", path_list::gpu::PathList { workgroups, count, paths }),
        #[cfg(feature = "bvh")]
        twin!(wgsl::BVH_TRACER_RAYS, "Params", bvh_tracer::gpu::Params { ray_count, row }),
        #[cfg(feature = "bvh")]
        twin!(wgsl::BVH_TRACER_RAYS, "Ray", Ray { origin, furthest, direction, mask }),
        #[cfg(feature = "bvh")]
        twin!(wgsl::BVH_TRACER_RAYS, "RayHit", RayHit {
            distance, instance, triangle, is_front, barycentric, nodes_visited, triangles_visited,
        }),
        #[cfg(feature = "bvh")]
        twin!(wgsl::BVH_TRACER, "BvhInstance", bvh_geometry::gpu::BvhInstance {
            to_mesh, to_unit, center, root, first_triangle, material, mask, leaf,
        }),
        #[cfg(feature = "bvh")]
        twin!(wgsl::BVH_TRACER, "BvhMaterial", bvh_geometry::gpu::BvhMaterial {
            base_color, alpha_cutoff, emission, index_of_refraction, metallic, roughness, transmission,
            base_color_texture, metallic_roughness_texture, emission_texture, _pad,
        }),
        #[cfg(feature = "bvh")]
        twin!(wgsl::BVH_TRACER, "BvhAttributes", bvh_mesh::gpu::BvhAttributes { tex_coords, triangle, order }),
        #[cfg(all(feature = "bvh", feature = "reference"))]
        twin!(wgsl::PATH_TRACER, "Params", path_tracer::gpu::Params {
            eye, is_parallel, forward, bounces, right, roulette_from, up, component, size, emitter_count, crossed_count,
            pick_per_area, environment_pick, environment_norm, environment_rotation, environment_size, spans_pixel,
            _pad,
        }),
        #[cfg(all(feature = "bvh", feature = "reference"))]
        twin!(wgsl::PATH_TRACER, "Emitter", emitters::gpu::Emitter {
            position, kind, u, pick_until, v, pick, strength, extent, inner, outer, material, _pad, tex_coords, _pad_end,
        }),
        #[cfg(all(feature = "bvh", feature = "reference"))]
        twin!(wgsl::PATH_TRACER_RESOLVE, "Params", path_tracer::gpu::ResolveParams { width, output_scale }),
        twin!(wgsl::PHOTON_SPLATTER_TILED, "Bandwidth", photon_splatter::gpu::Bandwidth {
            scale, lowest, highest, uniform, rule, min_radius, max_radius, factor,
        }),
        twin!(wgsl::PHOTON_SPLATTER_RECEIVERS, "ReceiverParams", photon_splatter::gpu::ReceiverParams { factor }),
        twin!(wgsl::PHOTON_SPLATTER_TILED, "TiledParams", tiled::gpu::TiledParams {
            bandwidth, first_slot, slot_count, row,
        }),
        twin!(wgsl::PHOTON_SPLATTER_TILED, "Splat", tiled::gpu::Splat {
            position, inverse_radius_squared, strength, normal,
        }),
        twin!(wgsl::ENV_MAP_LIGHTING, "Params", env_map_lighting::gpu::Params {
            map_size, size, light_count, shadow_map_size, is_corrected, sample_offset,
        }),
        twin!(wgsl::SPECULAR_PATHS_BEGIN, "Params", specular_paths::gpu::Params {
            width, first_row, row_count, step, steps, round, rounds, sample_offset, light_count, shadow_map_size,
            direct_weight, indirect_weight, skips_glossy,
        }),
        twin!(wgsl::GLOSSY_LIGHT, "Params", glossy_light::gpu::Params {
            light_count, shadow_map_size, direct_weight, indirect_weight,
        }),
        twin!(wgsl::SPECULAR_PATHS_BEGIN, "SpecularPath", specular_paths::gpu::SpecularPath {
            throughput, state, radiance, _pad,
        }),
        twin!(wgsl::PHOTON_GRID, "GridParams", photon_grid::gpu::GridParams {
            bandwidth, first_slot, slot_count, row, cells,
        }),
        twin!(wgsl::FINAL_GATHER_SUM, "Params", final_gather::gpu::Params {
            factor, ray_count, first_row, row_count, sample_offset, map_count, map_size,
        }),
        twin!(wgsl::IRRADIANCE_FILTER, "Params", irradiance_filter::gpu::Params {
            factor, radius, normal_agreement, plane_distance, plus_factor,
        }),
        twin!(wgsl::STABLE_SORT, "SortParams", stable_sort::gpu::SortParams { count, blocks, shift, row }),
        twin!(wgsl::PHOTON_SPLATTER_QUADS, "RasterParams", raster::gpu::RasterParams {
            bandwidth, clip_scale, clip_shift, first_slot, slot_count, row, _pad,
        }),
        twin!(wgsl::PHOTON_SPLATTER_FINISH, "FinishParams", photon_splatter::gpu::FinishParams {
            factor, is_corrected, sample_offset,
        }),
        twin!(wgsl::UPSAMPLER, "Marking", marked_pixels::gpu::MarkedPixels { workgroups, count, pixels }),
        twin!(wgsl::UPSAMPLER, "Interpolation", upsampler::gpu::Interpolation {
            factor, target_factor, normal_agreement, plane_distance, disagreement, is_marking
        }),
        twin!(wgsl::PHOTON_SPLATTER_MARKED, "MarkedPixels", marked_pixels::gpu::MarkedPixels {
            workgroups, count, pixels
        }),
        twin!(wgsl::PHOTON_SPLATTER_MARKED, "MarkedParams", tiled::gpu::MarkedParams {
            bandwidth, factor, is_corrected, sample_offset
        }),
        twin!(wgsl::DIRECT_LIGHT, "Params", direct_light::gpu::Params { light_count, shadow_map_size }),
        twin!(wgsl::NEAREST_OCCLUDER, "Params", nearest_occluder::gpu::Params {
            light_count, shadow_map_size, layer_count,
        }),
        twin!(wgsl::SOFT_SHADOW_BLUR, "Params", pending_penumbrae::gpu::PenumbraParams {
            light, shadow_map_size, layer_count, search, search_taps, blur_taps, disc_taps, rays, sample_offset, gathered,
            max_radius, range_scale,
        }),
        twin!(wgsl::SOFT_SHADOW_LIST, "Listing", soft_shadow::gather::gpu::TileList { workgroups, count, tiles }),
        twin!(wgsl::SOFT_SHADOW_BLUR, "TileList", soft_shadow::gather::gpu::TileList { workgroups, count, tiles }),
        twin!(wgsl::COMPOSITE, "Parts", composite::gpu::Parts {
            output_scale, direct_weight, indirect_weight, caustic_weight, emission_weight, diffuse_weight, has_specular,
        }),
        twin!(wgsl::FUSED_COMPOSITE, "Counts", fused_composite::gpu::Counts { lights, layers, shadow_map_size }),
        twin!(wgsl::ACCUMULATOR, "Params", accumulator::gpu::Params { history_weight, mean_weight }),
        twin!(wgsl::TONE_MAP, "Params", tone_map::gpu::Params { exposure, curve, inverse_gamma }),
        twin!(wgsl::ENV_MAP_SELECTOR, "Params", env_map_selector::gpu::Params {
            candidate_count, columns, limit, tag, back_face_limit, clearance, tolerance, coverage_target,
            sample_count, least_gain, slot_count,
        }),
        twin!(wgsl::ENV_MAP_SELECTOR_SAMPLES, "SurfaceSample", env_map_selector::gpu::SurfaceSample { position, normal }),
        twin!(wgsl::ENV_MAP_SELECTOR, "Sight", env_map_selector::gpu::SightRecord {
            surfaces, back_faces, nearest, is_valid, area, unseen, own, exchange,
        }),
        twin!(wgsl::ENV_MAP_SELECTOR, "Selection", env_map_selector::gpu::SelectionRecord {
            tag, selected, newest, is_done, is_stable, swaps, coverage, total, chosen,
        }),
        twin!(wgsl::PHOTON_GUIDING_COUNT, "CountParams", photon_guiding::gpu::CountParams {
            path_count, slot_count, light_count, row,
        }),
        twin!(wgsl::PHOTON_GUIDING_EMISSION, "UpdateParams", photon_guiding::gpu::UpdateParams { kept }),
        twin!(wgsl::PHOTON_EMITTER_AT_TARGETS, "PhotonTargets", photon_targets::gpu::PhotonTargets {
            balls, ranges, ball_count, _pad,
        }),
        twin!(wgsl::PHOTON_EMITTER, "EmissionTable", guiding_tables::gpu::EmissionTable { columns, rows }),
        twin!(wgsl::IMAGE_SPACE_TRACER, "ReflectionTable", guiding_tables::gpu::ReflectionTable { columns, rows }),
        twin!(wgsl::CAUSTIC_FILTER, "Params", caustic_filter::gpu::Params {
            first_slot, slot_count, row, steps, share, radius, least_pixels, most_pixels,
        }),
        twin!(wgsl::CAUSTIC_FILTER, "TileList", caustic_filter::gpu::TileList { workgroups, count, tiles }),
        twin!(wgsl::TEXEL_GATHER_SUM, "Params", texel_gather::gpu::Params {
            texel_count, budget, ray_count, round, threshold, change_scale, flux_of_step, blend, row, sample_offset,
            least_photons, guided, keeps_due, slot_count, slot_row,
        }),
        twin!(wgsl::HEMISPHERE_GATHER, "Params", hemisphere_gather::gpu::Params { size, pixel_count, half_side }),
        twin!(wgsl::HEMISPHERE_GATHER, "Hemisphere", hemispheres::gpu::Hemisphere {
            eye, texel, right, column, up, row, normal, _pad,
        }),
        twin!(wgsl::TEXEL_SHADING, "Params", texel_shading::gpu::Params { factor, reach }),
        twin!(wgsl::SELECTIVE_EMITTER_PROBE, "Params", selective_emitter::gpu::Params {
            path_count, hop_count, light_count, group_count, interval, first_group, round, budget, kept_count,
            position_tolerance, flux_tolerance, moved_low, moved_high,
        }),
        twin!(wgsl::SELECTIVE_EMITTER_PROBE, "GroupedLight", photon_groups::gpu::GroupedLight {
            first_path, path_count, first_group, group_count,
        }),
        twin!(wgsl::PHOTON_STREAM, "Params", photon_stream::gpu::Params {
            path_count, hop_count, first_path, pool_count, row, share, keeps_changes,
        }),
        twin!(wgsl::PHOTON_STREAM_PLACES, "Params", photon_stream::gpu::PlaceParams { slot_count, light_count, row }),
        twin!(wgsl::PHOTON_STREAM_PLACES, "Nearest", surface_lights::gpu::Nearest { distance, slot }),
        twin!(wgsl::PHOTON_STREAM, "Impact", photon_pool::gpu::Impact { light, red, green, blue, offset, pad }),
        twin!(wgsl::PHOTON_STREAM, "SurfaceLight", surface_lights::gpu::SurfaceLight { position, area, normal, surface }),
        twin!(wgsl::PHOTON_STREAM, "SurfaceLightGrid", surface_lights::gpu::SurfaceLightGrid {
            origin, cell, cells, count, steps, _pad,
        }),
        twin!(wgsl::SURFACE_LIGHT_LOOP, "Params", surface_light_shading::gpu::Params {
            factor, light_count, flux_of_step, shape, least, ray_count, first_row, row_count, shadows, reach, sample_offset,
        }),
        twin!(wgsl::TRACE_STATISTICS, "Params", trace_statistics::gpu::Params { photon_count }),
        twin!(wgsl::TRACE_STATISTICS, "Sums", trace_statistics::gpu::Sums { stored, tentative, absorbed, escaped, lost }),
    ]
}

/// Members that the other side has not, or has elsewhere.
fn only_in(members: &[Member], others: &[Member]) -> Vec<Member> {
    members.iter().filter(|m| !others.contains(m)).cloned().collect()
}

#[test]
fn every_pod_lies_in_memory_as_its_wgsl_twin() {
    for twin in twins() {
        let what = format!("{} of\n{}", twin.name, twin.source.lines().next().unwrap_or_default());
        let shader = Shader::new(twin.name, twin.source);
        let wgsl = shader.members(twin.name);
        assert_eq!(only_in(&twin.members, &wgsl), only_in(&wgsl, &twin.members), "{what}");
        let (ty, _) = shader.struct_named(twin.name);
        let span = shader.size(ty) as usize;
        // A binding must hold at least the WGSL struct; a uniform may be padded to the 16 bytes that the uniform address
        // space aligns structs to. An array in a storage buffer leaves no such choice: size is stride.
        let is_uniform = |v: &naga::GlobalVariable| v.ty == ty && v.space == AddressSpace::Uniform;
        let longest = if shader.module.global_variables.iter().any(|(_, v)| is_uniform(v)) {
            span.next_multiple_of(16)
        } else {
            span
        };
        assert!(
            (span..=longest).contains(&twin.size),
            "{what}\n{} bytes, not {span}",
            twin.size
        );
    }
}

#[test]
fn every_struct_that_a_shader_binds_has_a_twin() {
    let twins = twins();
    for (name, shader) in shaders() {
        let bound = shader
            .module
            .global_variables
            .iter()
            .filter(|(_, v)| v.binding.is_some());
        for (_, variable) in bound {
            if let Some(bound) = shader.buffer_struct(variable.ty) {
                let members = shader.members(bound);
                let has_twin = twins.iter().any(|t| t.name == bound && t.members == members);
                assert!(has_twin, "{bound} of {name} is not among the twins");
            }
        }
    }
}

#[test]
fn a_vertex_is_laid_out_as_the_vertex_stage_reads_it() {
    use mesh_geometry::gpu::MeshVertex;
    let shader = Shader::new("MeshGeometry", wgsl::MESH_GEOMETRY);
    let stage = &shader.module.entry_points[0];
    assert_eq!(stage.name, "vertex");
    let read = stage.function.arguments.iter().filter_map(|argument| {
        let Some(naga::Binding::Location { location, .. }) = argument.binding else {
            return None;
        };
        let found = mesh_geometry::VERTEX_ATTRIBUTES
            .iter()
            .find(|a| a.shader_location == location);
        let attribute = found.unwrap_or_else(|| panic!("no attribute at location {location}"));
        Some(Member {
            name: argument.name.clone().unwrap_or_default(),
            offset: attribute.offset as usize,
            size: shader.size(argument.ty) as usize,
            scalar: shader.scalar(argument.ty),
        })
    });
    let pod = twin!(
        wgsl::MESH_GEOMETRY,
        "",
        MeshVertex {
            position,
            normal,
            tex_coord
        }
    );
    assert_eq!(pod.members, read.collect::<Vec<_>>());
    for (attribute, member) in mesh_geometry::VERTEX_ATTRIBUTES.iter().zip(&pod.members) {
        assert_eq!(attribute.format.size() as usize, member.size, "{}", member.name);
    }
    assert_eq!(pod.size, pod.members.iter().map(|m| m.size).sum::<usize>(), "no gaps");
}

/// The bind group layouts of a module, by group.
fn layouts(module: &str) -> Vec<&'static [Slot]> {
    match module {
        "DepthHierarchyBuild measure" | "DepthHierarchyBuild join" => vec![&depth_hierarchy_build::SLOTS],
        "MeshGeometry" => vec![&mesh_geometry::SCENE_SLOTS, &mesh_geometry::MATERIAL_SLOTS],
        "PhotonEmitter" => vec![&photon_emitter::SLOTS, &photon_emitter::SPREAD_SLOTS],
        "PhotonEmitter::listed" => vec![&photon_emitter::SLOTS, &photon_walk::LIST_SLOTS],
        "PhotonEmitter::at_targets" => vec![
            &photon_emitter::SLOTS,
            &photon_emitter::SPREAD_SLOTS,
            &photon_walk::LIST_SLOTS,
        ],
        "ImageSpaceTracer" => vec![
            &photon_walk::SLOTS,
            &image_space_tracer::SLOTS,
            &photon_walk::LIST_SLOTS,
        ],
        "ImageSpaceTracer rays" => vec![&image_space_tracer::RAY_SLOTS, &image_space_tracer::SLOTS],
        "ImageSpaceTracer list" => vec![&image_space_tracer::LIST_SLOTS],
        #[cfg(feature = "bvh")]
        "BvhTracer" => vec![&photon_walk::SLOTS, &bvh_geometry::BVH_SLOTS, &photon_walk::LIST_SLOTS],
        #[cfg(feature = "bvh")]
        "BvhTracer rays" | "BvhTracer surface rays" => vec![&bvh_tracer::RAY_SLOTS, &bvh_geometry::BVH_SLOTS],
        "PhotonGuiding count" => vec![&photon_guiding::COUNT_SLOTS],
        "PhotonGuiding emission" | "PhotonGuiding reflections" => vec![&photon_guiding::UPDATE_SLOTS],
        "PhotonSplatter receivers" => vec![&photon_splatter::RECEIVER_SLOTS],
        "PhotonSplatter tiled" => vec![&tiled::TILED_SLOTS],
        "StableSort" => vec![&stable_sort::SORT_SLOTS],
        "PhotonSplatter gather" => vec![&tiled::GATHER_SLOTS],
        "PhotonSplatter marked" => vec![&tiled::MARKED_SLOTS],
        "PhotonSplatter bins" => vec![&raster::BIN_SLOTS],
        "PhotonSplatter quads" | "PhotonSplatter volumes" => vec![&raster::RASTER_SLOTS],
        "PhotonSplatter finish" => vec![&photon_splatter::FINISH_SLOTS],
        "PhotonGrid" => vec![&photon_grid::SLOTS],
        "SpecularPaths begin" => vec![&specular_paths::BEGIN_SLOTS],
        "SpecularPaths" => vec![&specular_paths::ADVANCE_SLOTS],
        "GlossyLight" => vec![&glossy_light::SLOTS],
        "EnvMapLighting" => vec![&env_map_lighting::SLOTS],
        "PhotonStream" => vec![&photon_stream::STREAM_SLOTS, &photon_walk::LIST_SLOTS],
        "HemisphereGather" => vec![&hemisphere_gather::SLOTS],
        "TexelGather radiosity" => vec![&texel_gather::RADIOSITY_SLOTS],
        "TexelGather incident" => vec![&texel_gather::INCIDENT_SLOTS],
        "TexelGather changes" => vec![&texel_gather::CHANGE_SLOTS],
        "TexelGather due" => vec![&texel_gather::DUE_SLOTS],
        "TexelGather choice" => vec![&texel_gather::CHOICE_SLOTS],
        "TexelGather spread" => vec![&texel_gather::SPREAD_SLOTS],
        "TexelGather sum" => vec![&texel_gather::SUM_SLOTS],
        "TexelGather blend" => vec![&texel_gather::BLEND_SLOTS],
        "TexelShading" => vec![&texel_shading::SLOTS],
        "PhotonStream near" => vec![&photon_stream::NEAR_SLOTS],
        "PhotonStream places" => vec![&photon_stream::PLACE_SLOTS],
        "PhotonStream at impacts" => vec![&photon_stream::IMPACT_SLOTS],
        "CausticFilter plot" => vec![&caustic_filter::PLOT_SLOTS],
        "CausticFilter" => vec![&caustic_filter::FILTER_SLOTS],
        "SelectiveEmitter probe" => vec![&selective_emitter::PROBE_SLOTS],
        "SelectiveEmitter keep" => vec![&selective_emitter::KEEP_SLOTS],
        "SelectiveEmitter compare" => vec![&selective_emitter::COMPARE_SLOTS],
        "SelectiveEmitter choose" => vec![&selective_emitter::CHOICE_SLOTS],
        "SurfaceLightShading loop" | "SurfaceLightShading tiles" => vec![&surface_light_shading::SHADE_SLOTS],
        "SurfaceLightShading draw" => vec![&surface_light_shading::DRAW_SLOTS],
        "SurfaceLightShading spread" => vec![&surface_light_shading::rays::SPREAD_SLOTS],
        "SurfaceLightShading sum" => vec![&surface_light_shading::rays::SUM_SLOTS],
        "FinalGather spread" => vec![&final_gather::SPREAD_SLOTS],
        "FinalGather sum" => vec![&final_gather::SUM_SLOTS],
        "IrradianceFilter" => vec![&irradiance_filter::SLOTS],
        "DirectLight" => vec![&direct_light::SLOTS, &direct_light::VISIBILITY_SLOTS],
        "NearestOccluder" => vec![&nearest_occluder::SLOTS],
        "SoftShadow test" => vec![&soft_shadow::gather::TEST_SLOTS, &soft_shadow::gather::MAP_SLOTS],
        #[cfg(feature = "bvh")]
        "SoftShadow test by triangles" => vec![&soft_shadow::gather::TEST_SLOTS, &bvh_geometry::BVH_SLOTS],
        "SoftShadow flag" => vec![&soft_shadow::gather::FLAG_SLOTS],
        "SoftShadow list" => vec![&soft_shadow::gather::LIST_SLOTS],
        "SoftShadow search" => vec![&soft_shadow::gather::SEARCH_SLOTS, &soft_shadow::gather::MAP_SLOTS],
        "SoftShadow blur" | "SoftShadow disc" => {
            vec![&soft_shadow::gather::BLUR_SLOTS, &soft_shadow::gather::MAP_SLOTS]
        }
        "SoftShadow filter" => vec![&soft_shadow::over_pixels::PIXEL_SLOTS, &soft_shadow::gather::MAP_SLOTS],
        #[cfg(feature = "bvh")]
        "SoftShadow trace" => vec![&soft_shadow::over_pixels::PIXEL_SLOTS, &bvh_geometry::BVH_SLOTS],
        "Upsampler" => vec![&upsampler::SLOTS],
        "Composite" => vec![&composite::SLOTS],
        "FusedComposite" => vec![&fused_composite::SLOTS],
        "Accumulator" => vec![&accumulator::SLOTS],
        "ToneMap" => vec![&tone_map::SLOTS],
        "EnvMapSelector" => vec![&env_map_selector::SLOTS, &env_map_selector::SWITCH_SLOTS],
        "EnvMapSelector samples" => vec![&env_map_selector::SAMPLE_SLOTS],
        "EnvMapSelector clear" => vec![],
        "TraceStatistics" => vec![&trace_statistics::SLOTS],
        #[cfg(all(feature = "bvh", feature = "reference"))]
        "PathTracer" => vec![&path_tracer::SLOTS, &bvh_geometry::BVH_SLOTS],
        #[cfg(all(feature = "bvh", feature = "reference"))]
        "PathTracer resolve" => vec![&path_tracer::RESOLVE_SLOTS],
        _ => panic!("which layouts has {module}?"),
    }
}

/// What a slot takes, as WGSL writes it.
fn kind_of_slot(slot: Slot) -> String {
    match slot {
        Slot::Uniform | Slot::DynamicUniform(_) => "var<uniform>".into(),
        Slot::Storage => "var<storage, read>".into(),
        Slot::StorageMut => "var<storage, read_write>".into(),
        Slot::Texture | Slot::FilteredTexture => "texture_2d<f32>".into(),
        Slot::UintTexture => "texture_2d<u32>".into(),
        Slot::TextureArray => "texture_2d_array<f32>".into(),
        #[cfg(feature = "bvh")]
        Slot::FilteredTextureArray => "texture_2d_array<f32>".into(),
        Slot::UintArray => "texture_2d_array<u32>".into(),
        Slot::StorageTexture(format) => format!("texture_storage_2d<{format:?}, write>"),
        Slot::StorageArray(format) => format!("texture_storage_2d_array<{format:?}, write>"),
        Slot::Sampler => "sampler".into(),
    }
}

/// What a variable is, as WGSL writes it; what no slot takes is written as naga does.
fn kind_of_variable(space: AddressSpace, ty: &TypeInner) -> String {
    let read_write = StorageAccess::LOAD | StorageAccess::STORE;
    match (space, ty) {
        (AddressSpace::Uniform, _) => "var<uniform>".into(),
        (AddressSpace::Storage { access }, _) if access == StorageAccess::LOAD => "var<storage, read>".into(),
        (AddressSpace::Storage { access }, _) if access == read_write => "var<storage, read_write>".into(),
        (AddressSpace::Handle, TypeInner::Sampler { comparison: false }) => "sampler".into(),
        (
            AddressSpace::Handle,
            &TypeInner::Image {
                dim: ImageDimension::D2,
                arrayed,
                class,
            },
        ) => match (arrayed, class) {
            (
                false,
                ImageClass::Sampled {
                    kind: ScalarKind::Float,
                    multi: false,
                },
            ) => "texture_2d<f32>".into(),
            (
                false,
                ImageClass::Sampled {
                    kind: ScalarKind::Uint,
                    multi: false,
                },
            ) => "texture_2d<u32>".into(),
            (
                true,
                ImageClass::Sampled {
                    kind: ScalarKind::Float,
                    multi: false,
                },
            ) => "texture_2d_array<f32>".into(),
            (
                true,
                ImageClass::Sampled {
                    kind: ScalarKind::Uint,
                    multi: false,
                },
            ) => "texture_2d_array<u32>".into(),
            (
                false,
                ImageClass::Storage {
                    format,
                    access: StorageAccess::STORE,
                },
            ) => {
                format!("texture_storage_2d<{format:?}, write>")
            }
            (
                true,
                ImageClass::Storage {
                    format,
                    access: StorageAccess::STORE,
                },
            ) => {
                format!("texture_storage_2d_array<{format:?}, write>")
            }
            other => format!("{other:?}"),
        },
        other => format!("{other:?}"),
    }
}

#[test]
fn every_binding_matches_its_bind_group_layout() {
    for (name, shader) in shaders() {
        let mut slots = BTreeMap::new();
        for (group, layout) in (0..).zip(layouts(name)) {
            slots.extend(
                (0..)
                    .zip(layout)
                    .map(|(binding, &slot)| ([group, binding], kind_of_slot(slot))),
            );
        }
        assert_eq!(slots, shader.bindings(), "{name}: layout, shader");
    }
}

#[test]
fn every_layout_stays_within_default_limits() {
    let limits = wgpu::Limits::default();
    for (name, _) in wgsl::MODULES {
        let groups = layouts(name);
        assert!(groups.len() <= limits.max_bind_groups as usize, "{name}: bind groups");
        // Layouts, not what an entry point uses, are what a device counts, for every stage that may see them.
        let at_most = |limit: u32, what: &str, is_counted: fn(&Slot) -> bool| {
            let count = groups.iter().copied().flatten().filter(|slot| is_counted(slot)).count();
            assert!(count <= limit as usize, "{name}: {count} {what}, not {limit}");
        };
        at_most(limits.max_uniform_buffers_per_shader_stage, "uniform buffers", |slot| {
            matches!(slot, Slot::Uniform | Slot::DynamicUniform(_))
        });
        at_most(limits.max_storage_buffers_per_shader_stage, "storage buffers", |slot| {
            matches!(slot, Slot::Storage | Slot::StorageMut)
        });
        at_most(
            limits.max_sampled_textures_per_shader_stage,
            "sampled textures",
            |slot| {
                matches!(
                    slot,
                    Slot::Texture | Slot::FilteredTexture | Slot::UintTexture | Slot::TextureArray | Slot::UintArray
                )
            },
        );
        at_most(
            limits.max_storage_textures_per_shader_stage,
            "storage textures",
            |slot| matches!(slot, Slot::StorageTexture(_) | Slot::StorageArray(_)),
        );
        at_most(limits.max_samplers_per_shader_stage, "samplers", |slot| {
            matches!(slot, Slot::Sampler)
        });
    }
}

#[test]
fn every_workgroup_stays_within_default_limits() {
    let limits = wgpu::Limits::default();
    for (name, shader) in shaders() {
        for (index, entry) in shader.module.entry_points.iter().enumerate() {
            let what = format!("{name}: {}", entry.name);
            // Vertex and fragment stages say 0.
            let invocations: u32 = entry.workgroup_size.iter().product();
            assert!(
                invocations <= limits.max_compute_invocations_per_workgroup,
                "{what}: {invocations}"
            );
            let longest = [
                limits.max_compute_workgroup_size_x,
                limits.max_compute_workgroup_size_y,
                limits.max_compute_workgroup_size_z,
            ];
            assert!(
                entry
                    .workgroup_size
                    .iter()
                    .zip(longest)
                    .all(|(&side, limit)| side <= limit),
                "{what}"
            );
            let uses = shader.info.get_entry_point(index);
            let bytes: u32 = shader
                .module
                .global_variables
                .iter()
                .filter(|(handle, v)| v.space == AddressSpace::WorkGroup && !uses[*handle].is_empty())
                // WebGPU counts every variable in steps of 16 bytes.
                .map(|(_, v)| shader.size(v.ty).next_multiple_of(16))
                .sum();
            assert!(
                bytes <= limits.max_compute_workgroup_storage_size,
                "{what}: {bytes} bytes"
            );
        }
    }
}

#[test]
fn photon_states_are_the_same_on_both_sides() {
    let shader = Shader::new("PhotonEmitter", wgsl::PHOTON_EMITTER);
    let photon = |state| Photon {
        state,
        ..bytemuck::Zeroable::zeroed()
    };
    for (name, state) in [
        ("PHOTON_EMPTY", PhotonState::Empty),
        ("PHOTON_STORED", PhotonState::Stored),
        ("PHOTON_ESCAPED", PhotonState::Escaped),
        ("PHOTON_LOST", PhotonState::Lost),
    ] {
        assert_eq!(shader.constant(name), Literal::U32(state as u32), "{name}");
        let first_hit = photon(state as u32 | Photon::FIRST_HIT);
        assert_eq!((first_hit.state(), first_hit.is_first_hit()), (state, true), "{name}");
    }
    assert_eq!(shader.constant("PHOTON_FIRST_HIT"), Literal::U32(Photon::FIRST_HIT));
    let walk = Shader::new("ImageSpaceTracer", wgsl::IMAGE_SPACE_TRACER);
    for (name, map) in [
        ("PHOTON_MAP_ALL", PhotonMap::All),
        ("PHOTON_MAP_GLOBAL", PhotonMap::Global),
        ("PHOTON_MAP_CAUSTIC", PhotonMap::Caustic),
    ] {
        assert_eq!(walk.constant(name), Literal::U32(map as u32), "{name}");
    }
    let aimed = Shader::new("PhotonEmitter::at_targets", wgsl::PHOTON_EMITTER_AT_TARGETS);
    assert_eq!(
        aimed.constant("PHOTON_TARGETS_MOST"),
        Literal::U32(photon_targets::MOST_TARGETS as u32)
    );
    assert_eq!(aimed.constant("PHOTON_TARGETS_LIGHTS"), Literal::U32(MAX_LIGHTS as u32));
    assert_eq!(shader.constant("PHOTON_TENTATIVE"), Literal::U32(Photon::TENTATIVE));
    assert_eq!(
        shader.constant("PHOTON_GUIDANCE_ONE"),
        Literal::F32(Photon::GUIDANCE_ONE)
    );
    assert_eq!(
        shader.constant("PHOTON_GUIDANCE_STEPS"),
        Literal::F32(Photon::GUIDANCE_STEPS)
    );
    let counts = Shader::new("PhotonGuiding count", wgsl::PHOTON_GUIDING_COUNT);
    for (name, own) in [
        ("EMISSION_CELLS", guiding_tables::CELLS),
        ("EMISSION_COUNTS", guiding_tables::EMISSION_COUNTS),
        ("REFLECTION_CELLS", guiding_tables::REFLECTIONS),
        ("REFLECTION_COUNTS", guiding_tables::REFLECTION_COUNTS),
        ("REFLECTION_PLACES", guiding_tables::PLACES),
        ("TILES", photon_guiding::TILES as usize),
    ] {
        assert_eq!(counts.constant(name), Literal::U32(own as u32), "{name}");
    }
    let Literal::U32(mask) = shader.constant("PHOTON_STATE_MASK") else {
        panic!("PHOTON_STATE_MASK is not a u32");
    };
    assert_eq!(photon(!mask).state(), PhotonState::Empty);
    assert_eq!(photon(mask).state() as u32, mask);
}

#[test]
fn blocks_of_lost_rays_are_the_same_on_both_sides() {
    let shader = Shader::new("ImageSpaceTracer list", wgsl::IMAGE_SPACE_TRACER_LIST);
    assert_eq!(shader.constant("BLOCK"), Literal::U32(path_list::BLOCK));
}

#[test]
fn light_kinds_are_the_same_on_both_sides() {
    let shader = Shader::new("DirectLight", wgsl::DIRECT_LIGHT);
    for (name, kind) in [
        ("LIGHT_POINT", lights::gpu::POINT),
        ("LIGHT_SPOT", lights::gpu::SPOT),
        ("LIGHT_DIRECTIONAL", lights::gpu::DIRECTIONAL),
    ] {
        assert_eq!(shader.constant(name), Literal::U32(kind), "{name}");
    }
}

#[test]
fn multiple_scattering_is_coded_the_same_on_both_sides() {
    let shader = Shader::new("PhotonEmitter", wgsl::PHOTON_EMITTER);
    let Literal::F32(more) = shader.constant("LOBE_MULTIPLE") else {
        panic!("LOBE_MULTIPLE is not an f32");
    };
    let metal = Material {
        metallic: 1.0,
        roughness: 0.25,
        multiple_scattering: true,
        ..Material::default()
    };
    assert_eq!(metal.lobe_roughness(), more + 0.25);
}

#[test]
fn trace_methods_are_the_same_on_both_sides() {
    use image_space_tracer::TraceMethod;
    let shader = Shader::new("ImageSpaceTracer", wgsl::IMAGE_SPACE_TRACER);
    for (name, method) in [
        ("METHOD_PAPER", TraceMethod::Paper),
        ("METHOD_PLANE", TraceMethod::Plane),
        ("METHOD_NEAREST_MARCH", TraceMethod::NearestMarch),
        ("METHOD_NEAREST_WALK", TraceMethod::NearestWalk),
        ("METHOD_ORDERED_MARCH", TraceMethod::OrderedMarch),
        ("METHOD_ORDERED_WALK", TraceMethod::OrderedWalk),
        ("METHOD_VERIFIED_WALK", TraceMethod::VerifiedWalk),
    ] {
        assert_eq!(shader.constant(name), Literal::U32(method as u32), "{name}");
    }
}

#[test]
fn kinds_of_hits_are_the_same_on_both_sides() {
    let shader = Shader::new("ImageSpaceTracer rays", wgsl::IMAGE_SPACE_TRACER_RAYS);
    for (name, kind) in [
        ("HIT_SURFACE", SurfaceHitKind::Surface),
        ("HIT_ESCAPED", SurfaceHitKind::Escaped),
        ("HIT_LOST", SurfaceHitKind::Lost),
        ("HIT_TENTATIVE", SurfaceHitKind::Tentative),
    ] {
        let Literal::U32(number) = shader.constant(name) else {
            panic!("{name} is not a u32");
        };
        let hit = SurfaceHit {
            kind: number,
            ..bytemuck::Zeroable::zeroed()
        };
        assert_eq!(hit.kind(), kind, "{name}");
    }
}

#[test]
fn bins_are_the_same_on_both_sides() {
    use photon_splatter::{BIN, BORDER, tiled::TILE};
    let shader = Shader::new("PhotonSplatter gather", wgsl::PHOTON_SPLATTER_GATHER);
    assert_eq!(shader.constant("TILE"), Literal::U32(TILE));
    assert_eq!(shader.constant("BIN"), Literal::U32(BIN));
    assert_eq!(shader.constant("BORDER"), Literal::U32(BORDER));
}

#[test]
fn ways_to_gather_penumbrae_have_the_same_numbers_on_both_sides() {
    use soft_shadow::Gathered;
    let shader = Shader::new("SoftShadow test", wgsl::SOFT_SHADOW_TEST);
    for (name, gathered) in [
        ("GATHERED_NOT", Gathered::Not),
        ("GATHERED_BY_STEPS", Gathered::BySteps),
        ("GATHERED_LATER", Gathered::Later),
    ] {
        assert_eq!(shader.constant(name), Literal::U32(gathered as u32), "{name}");
    }
}

#[test]
fn indirect_shadows_have_the_same_numbers_on_both_sides() {
    use crate::pass::IndirectShadows;
    let shader = Shader::new("SurfaceLightShading sum", wgsl::SURFACE_LIGHT_SUM);
    for (name, shadows) in [
        ("SHADOWS_AMBIENT", IndirectShadows::AmbientOcclusion),
        ("SHADOWS_SOME", IndirectShadows::Some),
        ("SHADOWS_ALL", IndirectShadows::All),
    ] {
        assert_eq!(shader.constant(name), Literal::U32(shadows as u32), "{name}");
    }
}

#[test]
fn tiles_of_nearest_occluders_are_the_same_on_both_sides() {
    use crate::resource::nearest_occluders;
    for (name, source) in [
        ("NearestOccluder", wgsl::NEAREST_OCCLUDER),
        ("SoftShadow search", wgsl::SOFT_SHADOW_SEARCH),
        ("FusedComposite", wgsl::FUSED_COMPOSITE),
    ] {
        let tiles = Shader::new(name, source).constant("TILES");
        assert_eq!(tiles, Literal::U32(nearest_occluders::TILES), "{name}");
    }
}

#[test]
fn occluders_begin_at_the_near_plane() {
    let shader = Shader::new("DirectLight", wgsl::DIRECT_LIGHT);
    assert_eq!(shader.constant("SHADOW_NEAREST"), Literal::F32(view::NEAR));
}

#[test]
fn parallel_views_start_where_the_shaders_think() {
    let shader = Shader::new("MeshGeometry", wgsl::MESH_GEOMETRY);
    let start = shader.constant("SURFACE_TEXEL_PARALLEL_START");
    assert_eq!(start, Literal::F32(view::PARALLEL_REACH));
}
