//! Shader functions evaluated on many inputs.

use super::Gpu;
use lightfall::wgpu::{self, util::DeviceExt as _};
use lightfall::{read_buffer_blocking, wgsl};

const WORKGROUP: usize = 64;

/// What a shader function can be evaluated on.
pub(crate) trait Input: bytemuck::Pod {
    const WGSL: &str;
}

impl Input for [f32; 4] {
    const WGSL: &str = "vec4f";
}

impl Input for [u32; 4] {
    const WGSL: &str = "vec4u";
}

/// Evaluates the body of a WGSL function of `input` that returns a `vec4f`, once per input. It may call everything in
/// `shaders/common/` that needs no bindings.
pub(crate) fn run<I: Input>(gpu: &Gpu, body: &str, inputs: &[I]) -> Vec<[f32; 4]> {
    // One bind of an empty buffer would be an error, and one dimension of workgroups is enough for every test.
    assert!((1..=65535 * WORKGROUP).contains(&inputs.len()));
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("shader functions"),
        source: wgpu::ShaderSource::Wgsl(compose::<I>(body).into()),
    });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("shader functions"),
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: Default::default(),
        cache: None,
    });
    let input = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("inputs"),
        contents: bytemuck::cast_slice(inputs),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let output = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("outputs"),
        size: input.size(),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("shader functions"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[(0, &input), (1, &output)].map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        }),
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(inputs.len().div_ceil(WORKGROUP) as u32, 1, 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    let outputs = read_buffer_blocking(&gpu.device, &gpu.queue, &output);
    // First, as they say more about a shader that does not compile.
    let errors = gpu.take_errors();
    assert!(errors.is_empty(), "{}", errors.join("\n"));
    outputs.expect("nothing was reported")
}

/// The body comes first, so that diagnostics count its lines from one.
fn compose<I: Input>(body: &str) -> String {
    let (ty, common) = (I::WGSL, wgsl::COMMON);
    format!(
        "fn evaluate(input: {ty}) -> vec4f {{ {body} }}
        @group(0) @binding(0) var<storage, read> inputs: array<{ty}>;
        @group(0) @binding(1) var<storage, read_write> outputs: array<vec4f>;
        @compute @workgroup_size({WORKGROUP})
        fn evaluate_all(@builtin(global_invocation_id) id: vec3u) {{
            if id.x < arrayLength(&inputs) {{
                outputs[id.x] = evaluate(inputs[id.x]);
            }}
        }}
        {common}"
    )
}
