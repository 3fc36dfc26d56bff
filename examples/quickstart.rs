//! The quick start: the sample Cornell box with global illumination, to a PNG.
//!
//! `cargo run --release --example quickstart [FILE.png]` (default `quickstart.png`)

mod common;

use common::{adapter::Gpu, picture};
use lightfall::frame::{GiRenderer, SceneInputs, Settings, ViewInputs};
use lightfall::pass::CompositeSettings;
use lightfall::resource::{CameraView, MeshGeometry};
use lightfall::scene::{SceneSummary, samples};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).unwrap_or("quickstart.png".into());
    // The host's own: device, queue, and a scene. Default limits and no features are enough.
    let gpu = Gpu::open(None, Default::default())?;
    let (device, queue) = (&gpu.device, &gpu.queue);
    let scene = samples::cornell(0.0);

    // Once: the host's geometry (here the ready-made one), all passes, one view.
    let mut geometry = MeshGeometry::new(device, queue, &scene)?;
    let mut renderer = GiRenderer::new(device, &Settings::balanced())?;
    let frame = renderer.set_scene(queue, &SceneSummary::of(&scene)?, &scene.lights)?;
    renderer.place_env_maps_blocking(queue, &mut geometry)?;
    let mut view = renderer.new_view([512, 512])?;

    // Each frame: say what there is and from where it is seen, record, submit.
    let mut cameras = [CameraView::new(&frame, &scene.cameras[0], [512, 512], [0.0; 2])];
    renderer.prepare(queue, &mut geometry, &mut cameras)?;
    let mut encoder = device.create_command_encoder(&Default::default());
    let scene_inputs = SceneInputs {
        queue,
        geometry: &geometry,
        bvh: None,
        sample_offset: 0,
        timestamps: None,
    };
    renderer.record_scene(&mut encoder, &scene_inputs)?;
    let composite = CompositeSettings {
        output_scale: frame.output_scale(1.0)?,
        ..Default::default()
    };
    let view_inputs = ViewInputs {
        queue,
        geometry: &geometry,
        bvh: None,
        view: &cameras[0],
        accumulated: 0,
        composite: &composite,
        timestamps: None,
    };
    renderer.record_view(&mut encoder, &mut view, &view_inputs)?;
    queue.submit([encoder.finish()]);

    if let Some(error) = gpu.take_errors().first() {
        return Err(error.clone().into());
    }

    // The image is in `view.radiance()`, linear, in world units.
    picture::write_png((device, queue), path.as_ref(), view.radiance(), 1.0)?;
    println!("{path}: rendered on {} ({})", gpu.info.name, gpu.info.backend);
    Ok(())
}
