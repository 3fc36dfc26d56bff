//! Time of rays through environment maps by method: 20 000 rays of diffuse light in the living room, 8 maps of 256².
//!
//! ```text
//! cargo bench --bench image_space_tracer
//! ```
//!
//! `examples/trace_study/` says what the time buys.

#[path = "../examples/common/mod.rs"]
mod common;

#[allow(dead_code, reason = "the study uses all of it")]
#[path = "../examples/trace_study/bench.rs"]
mod bench;
#[allow(dead_code, reason = "the study uses all of it")]
#[path = "../examples/trace_study/judge.rs"]
mod judge;

use bench::Bench;
use common::adapter::{Gpu, Wishes};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lightfall::frame::{GiRenderer, Settings};
use lightfall::pass::{
    ImageSpaceTracer, ImageSpaceTracerRayInputs, ImageSpaceTracerResources, ImageSpaceTracerSettings, TraceMethod,
};
use lightfall::resource::SurfaceRays;
use lightfall::scene::{SceneSummary, samples};
use std::hint::black_box;

const RAYS: u32 = 20_000;
const MAPS: u32 = 8;
const SIZE: u32 = 256;

fn methods(criterion: &mut Criterion) {
    let gpu = match Gpu::open(None, Wishes::default()) {
        Ok(gpu) => gpu,
        Err(reason) => {
            println!("skipped: {reason}");
            return;
        }
    };
    let Gpu { device, queue, .. } = &gpu;
    let mut scene = Bench::new(&gpu, samples::living_room(0.0)).expect("a sample fits any device");
    let settings = Settings {
        env_map_count: MAPS,
        ..Settings::balanced()
    };
    let mut renderer = GiRenderer::new(device, &settings).expect("presets are valid");
    let summary = SceneSummary::of(&scene.scene).expect("a sample is valid");
    renderer
        .set_scene(queue, &summary, &scene.scene.lights)
        .expect("a sample is valid");
    renderer
        .place_env_maps_blocking(queue, &mut scene.geometry)
        .expect("the device is there");
    let centers = renderer.env_maps().expect("there is indirect light").centers().to_vec();
    let maps = scene.capture(&centers, SIZE).expect("maps fit any device");
    let rays = scene.rays(RAYS as usize).expect("the device is there");
    let list = SurfaceRays::new(device, rays.len() as u32).expect("rays fit any device");
    list.write(queue, &rays)
        .expect("there are as many as there is room for");
    let mut group = criterion.benchmark_group("image_space_tracer");
    group
        .throughput(Throughput::Elements(rays.len() as u64))
        .sample_size(10);
    for method in TraceMethod::ALL {
        let tracer = ImageSpaceTracer::new(device, method);
        let mut resources = ImageSpaceTracerResources::new(device).expect("uniforms fit any device");
        let inputs = ImageSpaceTracerRayInputs {
            queue,
            env_maps: &maps.maps,
            hierarchy: Some(&maps.hierarchy),
            rays: &list,
            settings: &ImageSpaceTracerSettings::default(),
            timestamps: None,
        };
        group.bench_function(BenchmarkId::from_parameter(format!("{method:?}")), |bencher| {
            bencher.iter(|| {
                let mut encoder = device.create_command_encoder(&Default::default());
                tracer
                    .record_rays(&mut encoder, &mut resources, black_box(&inputs))
                    .expect("the hierarchy is there");
                queue.submit([encoder.finish()]);
                common::offline::wait(device).expect("the device is there");
            });
        });
    }
    group.finish();
}

criterion_group!(benches, methods);
criterion_main!(benches);
