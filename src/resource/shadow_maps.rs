//! Reflective shadow maps: what each light sees. They answer both where direct light falls and where photons first land.

use super::env_maps::SURFACE_FORMAT;
use super::lights::{LightShape, eye_before};
use super::view::axes_along;
use super::{CaptureMask, CapturePurpose, CaptureView};
use crate::scene::{Light, LightKind, UnitFrame};
use crate::{Error, gpu};
use glam::DVec3;

/// Spots wider than this half angle (radians; 60°) use a whole cube: one perspective face would waste its texels.
const WIDEST_SINGLE_FACE: f64 = std::f64::consts::FRAC_PI_3;

/// Texels beyond the edge of a light's cone or region, so that no look-up falls off the map.
const MARGIN: f64 = 1.0 / 64.0;

/// Layers of one `rgba32uint` 2D array in the order of the lights, environments left out: six cube faces for a
/// point light, a wide spot or a rectangle (from just before its middle), one perspective face for a spot, one parallel face over the region for a directional light.
/// Texels as in [`EnvMaps`](super::EnvMaps); distances are from the light (parallel ones from a plane 2 unit-frame lengths
/// before the region's centre).
#[derive(Debug)]
pub struct ShadowMaps {
    view: wgpu::TextureView,
    layer_views: Vec<wgpu::TextureView>,
    size: u32,
    bytes: u64,
}

impl ShadowMaps {
    /// Layers that these lights need.
    pub fn layers(lights: &[Light]) -> u32 {
        lights.iter().map(|l| layers_of(&l.kind)).sum()
    }

    /// Bytes for these lights at `size`² texels a layer.
    pub fn size_in_bytes(lights: &[Light], size: u32) -> u64 {
        gpu::texture_bytes([size; 2], Self::layers(lights) + 1, SURFACE_FORMAT)
    }

    /// Maps of `size`² texels a layer for these lights; a spare layer keeps GL from taking six for a cube.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, lights: &[Light], size: u32) -> Result<Self, Error> {
        use wgpu::TextureUsages as U;
        let layers = Self::layers(lights);
        let spec = gpu::TextureSpec {
            label: "lightfall::ShadowMaps",
            size: [size; 2],
            layers: layers + 1,
            format: SURFACE_FORMAT,
            usage: U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_SRC,
        };
        let texture = gpu::texture(device, &spec)?;
        Ok(Self {
            view: gpu::array_view(&texture),
            layer_views: (0..layers).map(|layer| gpu::layer_view(&texture, layer)).collect(),
            size,
            bytes: spec.bytes(),
        })
    }

    /// The views that fill the maps of these lights, in layer order.
    pub fn views(&self, frame: &UnitFrame, lights: &[Light]) -> Vec<CaptureView> {
        let (purpose, mask) = (CapturePurpose::Light, CaptureMask::CastsShadow);
        let mut views = Vec::with_capacity(self.layer_views.len());
        for light in lights {
            let Some(shape) = Self::light_shape(frame, light) else {
                continue;
            };
            let axes = axes_along(shape.direction);
            match light.kind {
                LightKind::Directional { .. } => {
                    views.push(CaptureView::parallel(purpose, mask, axes, shape.half_extent, self.size));
                }
                LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
                    let eye = frame.point(position);
                    if shape.layers == 1 {
                        let tan_half = shape.half_extent;
                        views.push(CaptureView::perspective(purpose, mask, eye, axes, tan_half, self.size));
                    } else {
                        views.extend((0..6).map(|f| CaptureView::cube_face(purpose, mask, eye, f, self.size)));
                    }
                }
                LightKind::Rectangle { center, .. } => {
                    let eye = frame.point(eye_before(light).unwrap_or(center));
                    views.extend((0..6).map(|f| CaptureView::cube_face(purpose, mask, eye, f, self.size)));
                }
                LightKind::Environment { .. } => {}
            }
        }
        views
    }

    /// How a light looks at the scene; `None` for an environment.
    pub(super) fn light_shape(frame: &UnitFrame, light: &Light) -> Option<LightShape> {
        let (direction, half_extent) = match light.kind {
            LightKind::Point { .. } => (DVec3::NEG_Y, 1.0),
            LightKind::Spot {
                direction, outer_angle, ..
            } if outer_angle <= WIDEST_SINGLE_FACE => (direction, outer_angle.tan() * (1.0 + MARGIN)),
            LightKind::Spot { direction, .. } => (direction, 1.0),
            LightKind::Directional { direction, .. } => (direction, f64::from(frame.radius()) * (1.0 + MARGIN)),
            LightKind::Rectangle { half_u, half_v, .. } => (half_u.cross(half_v), 1.0),
            LightKind::Environment { .. } => return None,
        };
        Some(LightShape {
            direction,
            half_extent: half_extent as f32,
            layers: layers_of(&light.kind),
        })
    }

    /// All layers as a 2D array.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// One layer, to render to.
    pub fn layer_view(&self, layer: usize) -> Option<&wgpu::TextureView> {
        self.layer_views.get(layer)
    }

    /// Texels along a layer's side.
    pub fn size(&self) -> u32 {
        self.size
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}

fn layers_of(kind: &LightKind) -> u32 {
    match kind {
        LightKind::Point { .. } | LightKind::Rectangle { .. } => 6,
        LightKind::Spot { outer_angle, .. } if *outer_angle > WIDEST_SINGLE_FACE => 6,
        LightKind::Spot { .. } | LightKind::Directional { .. } => 1,
        LightKind::Environment { .. } => 0,
    }
}
