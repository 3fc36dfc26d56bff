//! The engine's draws for lightfall: [`Geometry`], with shaders and bind groups of the engine's own. The library
//! supplies the views, the targets, and the WGSL functions that turn a surface into a texel.

use super::{Engine, FRAME, Layouts, Normals, OBJECT, UNIFORM_STRIDE, Vertex, buffer_group, pipeline, uniform_buffer};
use lightfall::resource::{CapturePurpose, CaptureTargets, CaptureView, Geometry, NormalEncoding, PrepareContext};
use lightfall::{Error, wgpu, wgsl};

/// Frame, object and material are bound as ever; where the camera stands in other passes, a capture has its view.
/// Concatenated with `wgsl::CAPTURE`, which holds the functions whose names begin with `surface_`.
const CAPTURE: &str = r"
struct View {
    clip_from_unit: mat4x4f,
    eye: vec4f,
    // The unit frame's origin, in render space, and its units per metre
    unit_origin: vec3f,
    unit_scale: f32,
}

@group(1) @binding(0) var<uniform> view: View;

struct Fragment {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) @interpolate(flat) color: vec3f,
}

@vertex
fn vertex(@location(0) position: vec3f, @location(1) normal: vec4f, @location(2) color: vec4f) -> Fragment {
    let render = render_from_object * vec4f(position, 1.0);
    let unit = (render.xyz - view.unit_origin) * view.unit_scale;
    return Fragment(view.clip_from_unit * vec4f(unit, 1.0), unit, color.rgb * tint.rgb);
}

@fragment
fn fragment(f: Fragment, @builtin(front_facing) front: bool) -> @location(0) vec4u {
    let normal = surface_capture_normal(f.position);
    return surface_texel_pack(surface_texel_at(f.position, normal, f.color, view.eye, front));
}
";

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct ViewUniform {
    clip_from_unit: [[f32; 4]; 4],
    eye: [f32; 4],
    unit_origin: [f32; 3],
    unit_scale: f32,
}

/// What captures take beside the engine's usual things.
pub(super) struct Capture {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    views: wgpu::Buffer,
    /// Group 1, taken with the view's offset.
    group: wgpu::BindGroup,
}

impl Capture {
    pub(super) fn new(device: &wgpu::Device, layouts: &Layouts) -> Self {
        let targets = CaptureTargets::of(CapturePurpose::EnvMap);
        let layout = layouts.offset_uniform.clone();
        let views = uniform_buffer(device, u64::from(UNIFORM_STRIDE));
        Self {
            pipeline: pipeline(
                device,
                &[&layouts.uniform, &layout, &layouts.offset_uniform, &layouts.uniform],
                &[FRAME, OBJECT, CAPTURE, wgsl::CAPTURE].concat(),
                &[Vertex::layout()],
                targets.colors,
                Some(targets.depth_stencil()),
                &[],
            ),
            group: buffer_group(device, &layout, &views, Some(size_of::<ViewUniform>() as u64)),
            layout,
            views,
        }
    }
}

impl Geometry for Engine {
    /// All views of the frame are known here, so their uniforms go up in one write: `draw` only chooses among them.
    fn prepare(&mut self, context: &PrepareContext<'_>, views: &[CaptureView]) -> Result<(), Error> {
        let capture = &mut self.capture;
        let unit_origin = (context.frame.center() - self.origin).as_vec3().to_array();
        let unit_scale = (1.0 / context.frame.length_scale()) as f32;
        let stride = UNIFORM_STRIDE as usize;
        if capture.views.size() < (views.len() * stride) as u64 {
            capture.views = uniform_buffer(context.device, (views.len() * stride) as u64);
            let slot = Some(size_of::<ViewUniform>() as u64);
            capture.group = buffer_group(context.device, &capture.layout, &capture.views, slot);
        }
        let mut bytes = vec![0; views.len() * stride];
        for (slot, view) in bytes.chunks_exact_mut(stride).zip(views) {
            let uniform = ViewUniform {
                clip_from_unit: view.view_projection,
                eye: view.eye,
                unit_origin,
                unit_scale,
            };
            slot[..size_of::<ViewUniform>()].copy_from_slice(bytemuck::bytes_of(&uniform));
        }
        context.queue.write_buffer(&capture.views, 0, &bytes);
        Ok(())
    }

    /// A larger engine culls by `view.frustum`, picks a level of detail by `view.pixels_per_radian` and leaves out what
    /// `view.mask` does not want. Camera views never come here: this engine fills its own G-buffer.
    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, view: &CaptureView) {
        pass.set_pipeline(&self.capture.pipeline);
        pass.set_bind_group(1, &self.capture.group, &[view.index * UNIFORM_STRIDE]);
        self.draw_objects(pass);
    }
}

impl From<Normals> for NormalEncoding {
    fn from(normals: Normals) -> Self {
        match normals {
            Normals::Signed => Self::Signed,
            Normals::HalfOffset => Self::HalfOffset,
            Normals::Octahedral => Self::Octahedral,
        }
    }
}
