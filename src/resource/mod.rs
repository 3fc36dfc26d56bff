//! Layer 2: what crosses a seam between passes, as plain wgpu textures and buffers of documented format.
//!
//! A host may make, or take, any of these at any seam. Everything is in the unit frame
//! ([`UnitFrame`](crate::scene::UnitFrame)) unless its documentation says otherwise.

#[cfg(feature = "bvh")]
pub(crate) mod bvh_geometry;
#[cfg(feature = "bvh")]
pub(crate) mod bvh_mesh;
pub mod cube_face;
mod depth_hierarchy;
mod env_map_irradiance;
mod env_maps;
pub(crate) mod environment;
pub(crate) mod g_buffer;
mod geometry;
pub(crate) mod guiding_tables;
pub(crate) mod hemispheres;
mod illumination_map;
mod irradiance;
pub(crate) mod lights;
pub(crate) mod marked_pixels;
pub(crate) mod mesh_geometry;
pub(crate) mod nearest_occluders;
pub(crate) mod path_list;
mod path_rounds;
pub(crate) mod pending_penumbrae;
pub(crate) mod photon_groups;
pub(crate) mod photon_pool;
pub(crate) mod photon_targets;
mod photons;
mod radiance;
mod rays;
mod shadow_maps;
pub(crate) mod surface_lights;
mod surface_rays;
#[cfg(feature = "bvh")]
pub(crate) mod texture_arrays;
pub(crate) mod view;
mod visibility;

#[cfg(feature = "bvh")]
#[doc(hidden)]
pub use bvh_geometry::MeshTree;
#[cfg(feature = "bvh")]
pub use bvh_geometry::{BvhGeometry, BvhGeometryConfig};
pub use depth_hierarchy::DepthHierarchy;
pub(crate) use depth_hierarchy::RANGE_FORMAT;
pub use env_map_irradiance::EnvMapIrradiance;
pub use env_maps::EnvMaps;
pub(crate) use env_maps::SURFACE_FORMAT;
pub use environment::Environment;
pub use g_buffer::{GBuffer, GBufferViews, NormalEncoding};
pub use geometry::{CaptureTargets, Geometry, PrepareContext};
pub use guiding_tables::GuidingTables;
pub use hemispheres::{GatherShape, HemispherePlace, Hemispheres};
pub use illumination_map::IlluminationMap;
pub use irradiance::{Irradiance, Subsampling};
pub use lights::{Lights, MAX_DIRECT_POLYGONS, MAX_LIGHTS};
pub use marked_pixels::MarkedPixels;
pub use mesh_geometry::MeshGeometry;
pub use nearest_occluders::NearestOccluders;
pub use path_list::PathList;
pub(crate) use path_rounds::PathRounds;
pub use pending_penumbrae::PendingPenumbrae;
pub use photon_groups::PhotonGroups;
pub use photon_pool::PhotonPool;
pub use photon_targets::PhotonTargets;
pub use photons::{PHOTON_BYTES, Photon, PhotonMap, PhotonState, Photons};
pub(crate) use radiance::BLACK_GUARD;
pub use radiance::Radiance;
pub use rays::{Ray, RayHit, RayList, Rays};
pub use shadow_maps::ShadowMaps;
pub use surface_lights::SurfaceLights;
pub use surface_rays::{SurfaceHit, SurfaceHitKind, SurfaceRay, SurfaceRays};
pub use view::{CameraView, CaptureMask, CapturePurpose, CaptureView};
pub use visibility::Visibility;

use crate::Error;
use crate::scene::Instance;
use glam::DAffine3;

/// Moves one of a list of instances.
fn move_instance(
    instances: &mut [Instance],
    index: usize,
    transform: DAffine3,
    (mesh_count, material_count): (usize, usize),
) -> Result<(), Error> {
    let Some(current) = instances.get_mut(index) else {
        let name = format!("#{index}");
        return Err(Error::scene("instance", name, "index", "is beyond the last instance"));
    };
    let moved = Instance {
        transform,
        ..current.clone()
    };
    moved.validate(index, mesh_count, material_count)?;
    *current = moved;
    Ok(())
}

/// Checks one property of a host-made view.
fn expect<T: PartialEq + std::fmt::Debug>(
    resource: &'static str,
    property: &'static str,
    found: T,
    accepted: &[T],
) -> Result<(), Error> {
    if accepted.contains(&found) {
        return Ok(());
    }
    let expected = accepted
        .iter()
        .map(|a| format!("{a:?}"))
        .collect::<Vec<_>>()
        .join(" or ");
    Err(Error::IncompatibleView {
        resource,
        property,
        expected,
        found: format!("{found:?}"),
    })
}

/// Checks that a host-made view has the usages that a pass needs.
fn expect_usage(resource: &'static str, texture: &wgpu::Texture, needed: wgpu::TextureUsages) -> Result<(), Error> {
    if texture.usage().contains(needed) {
        return Ok(());
    }
    Err(Error::IncompatibleView {
        resource,
        property: "usage",
        expected: format!("at least {needed:?}"),
        found: format!("{:?}", texture.usage()),
    })
}

/// Checks format, sample count and usage of a host-made two-dimensional view.
fn expect_view(
    resource: &'static str,
    view: &wgpu::TextureView,
    formats: &[wgpu::TextureFormat],
    usage: wgpu::TextureUsages,
) -> Result<(), Error> {
    let texture = view.texture();
    expect(resource, "format", texture.format(), formats)?;
    expect(resource, "sample count", texture.sample_count(), &[1])?;
    expect(resource, "mip level count", texture.mip_level_count(), &[1])?;
    expect(
        resource,
        "dimension",
        texture.dimension(),
        &[wgpu::TextureDimension::D2],
    )?;
    expect_usage(resource, texture, usage)
}
