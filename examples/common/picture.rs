//! Display pictures: tone mapping on the GPU, PNG on disk.

use super::exr_file::replace_file;
use lightfall::pass::{ToneMap, ToneMapInputs, ToneMapResources, ToneMapSettings};
use lightfall::resource::Radiance;
use lightfall::wgpu;
use std::path::Path;

/// Display value that the mean of a picture is exposed to, before the curve.
const MEAN_AFTER_EXPOSURE: f32 = 0.3;

/// Exposure that brings the mean of an image to a middle grey; 1 for a black one.
pub(crate) fn exposure_for(pixels: &[[f32; 3]]) -> f32 {
    let sum: f64 = pixels
        .iter()
        .flatten()
        .filter(|v| v.is_finite())
        .map(|&v| f64::from(v))
        .sum();
    let mean = (sum / (3 * pixels.len().max(1)) as f64) as f32;
    if mean > 0.0 { MEAN_AFTER_EXPOSURE / mean } else { 1.0 }
}

/// Tone-maps radiance and writes an 8-bit PNG, whole or not at all.
pub(crate) fn write_png(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    path: &Path,
    radiance: &Radiance,
    exposure: f32,
) -> Result<(), String> {
    let texture = radiance.view().texture();
    let (width, height) = (texture.width(), texture.height());
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: texture.size(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let pass = ToneMap::new(device, wgpu::TextureFormat::Rgba32Float);
    let mut resources = ToneMapResources::new(device).map_err(|e| e.to_string())?;
    let settings = ToneMapSettings {
        exposure,
        ..Default::default()
    };
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let inputs = ToneMapInputs {
        queue,
        radiance,
        target: &target.create_view(&wgpu::TextureViewDescriptor::default()),
        settings: &settings,
        timestamps: None,
    };
    pass.record(&mut encoder, &mut resources, &inputs);
    queue.submit([encoder.finish()]);
    let display = lightfall::read_rgba32float_blocking(device, queue, &target).map_err(|e| e.to_string())?;
    let bytes: Vec<u8> = display
        .iter()
        .flat_map(|p| [p[0], p[1], p[2]].map(|v| (v * 255.0 + 0.5) as u8))
        .collect();
    let image = image::RgbImage::from_raw(width, height, bytes).expect("three bytes a pixel");
    let mut encoded = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut encoded, image::ImageFormat::Png)
        .map_err(|e| format!("{}: {e}", path.display()))?;
    replace_file(path, encoded.get_ref())
}
