//! Textures of a scene as layers of two arrays, because rays meet any material and core WebGPU binds no lists of textures.

use crate::gpu::{self as device, TextureSpec};
use crate::scene::{Scene, Texture};
use crate::{Error, resource};

/// Twin of `BVH_NO_TEXTURE`.
pub(crate) const NO_TEXTURE: u32 = u32::MAX;
/// Twin of `BVH_LINEAR_TEXTURE`: the layer is one of the array of linear textures.
pub(crate) const LINEAR_TEXTURE: u32 = 1 << 31;

/// One array of sRGB textures, one of linear ones; linear filtering, coordinates repeat.
#[derive(Debug)]
pub(crate) struct TextureArrays {
    pub(crate) srgb: wgpu::TextureView,
    pub(crate) linear: wgpu::TextureView,
    pub(crate) sampler: wgpu::Sampler,
    /// By texture of the scene: layer, with [`LINEAR_TEXTURE`]; [`NO_TEXTURE`] if no material uses it.
    layers: Vec<u32>,
    bytes: u64,
}

impl TextureArrays {
    /// Uploads the textures that materials use. Each is resampled to a square of `largest` texels a side, or of the
    /// longest side of all textures if that is less.
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene, largest: u32) -> Result<Self, Error> {
        let mut is_used = vec![false; scene.textures.len()];
        for material in &scene.materials {
            let own = [
                material.base_color_texture,
                material.metallic_roughness_texture,
                material.emission_texture,
            ];
            for texture in own.into_iter().flatten() {
                is_used[texture] = true;
            }
        }
        let used = || {
            scene
                .textures
                .iter()
                .zip(&is_used)
                .filter(|(_, used)| **used)
                .map(|(t, _)| t)
        };
        let side = used().map(|t| t.width.max(t.height)).max().unwrap_or(1).min(largest);
        let mut counts = [0u32; 2];
        let layers = scene.textures.iter().zip(&is_used).map(|(texture, used)| {
            if !used {
                return NO_TEXTURE;
            }
            let count = &mut counts[usize::from(!texture.srgb)];
            *count += 1;
            (*count - 1) | if texture.srgb { 0 } else { LINEAR_TEXTURE }
        });
        let layers: Vec<_> = layers.collect();
        let mut bytes = 0;
        let mut array = |srgb: bool, format| {
            let own: Vec<_> = used().filter(|t| t.srgb == srgb).collect();
            let spec = TextureSpec {
                label: "lightfall::BvhGeometry::textures",
                size: if own.is_empty() { [1; 2] } else { [side; 2] },
                layers: (own.len() as u32).max(1),
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            };
            bytes += spec.bytes();
            let image = device::texture(device, &spec)?;
            for (layer, texture) in (0..).zip(own) {
                upload_layer(queue, &image, layer, &resample(texture, side));
            }
            Ok::<_, Error>(device::array_view(&image))
        };
        let srgb = array(true, wgpu::TextureFormat::Rgba8UnormSrgb)?;
        let linear = array(false, wgpu::TextureFormat::Rgba8Unorm)?;
        Ok(Self {
            srgb,
            linear,
            sampler: resource::mesh_geometry::material_sampler(device),
            layers,
            bytes,
        })
    }

    /// What a material's texture is called on the GPU.
    pub(crate) fn layer(&self, texture: Option<usize>) -> u32 {
        texture.and_then(|t| self.layers.get(t)).copied().unwrap_or(NO_TEXTURE)
    }

    /// Bytes of both arrays.
    pub(crate) fn memory_use(&self) -> u64 {
        self.bytes
    }
}

fn upload_layer(queue: &wgpu::Queue, image: &wgpu::Texture, layer: u32, rgba: &[u8]) {
    let size = image.size();
    queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture: image,
            mip_level: 0,
            origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
            aspect: wgpu::TextureAspect::All,
        },
        rgba,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * size.width),
            rows_per_image: None,
        },
        wgpu::Extent3d {
            depth_or_array_layers: 1,
            ..size
        },
    );
}

/// The texture at `side` × `side` texels. Each new texel is the mean of what it covers, taken in linear light.
fn resample(texture: &Texture, side: u32) -> Vec<u8> {
    if texture.width == side && texture.height == side {
        return texture.rgba.clone();
    }
    let decode: Vec<f32> = (0..=255).map(|b| to_linear(b, texture.srgb)).collect();
    let (columns, rows) = (footprints(texture.width, side), footprints(texture.height, side));
    let mut rgba = Vec::with_capacity(4 * (side * side) as usize);
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0; 4];
            for &(y, height) in row {
                for &(x, width) in column {
                    let texel = 4 * (y as usize * texture.width as usize + x as usize);
                    let bytes = &texture.rgba[texel..texel + 4];
                    for c in 0..3 {
                        sum[c] += width * height * decode[usize::from(bytes[c])];
                    }
                    sum[3] += width * height * f32::from(bytes[3]) / 255.0;
                }
            }
            rgba.extend([0, 1, 2].map(|c| from_linear(sum[c], texture.srgb)));
            rgba.push(from_linear(sum[3], false));
        }
    }
    rgba
}

/// For each of `side` new texels along an axis: the old ones that it is made of, and how much each counts. Fewer texels
/// than before are means over what they cover, more are interpolated.
fn footprints(length: u32, side: u32) -> Vec<Vec<(u32, f32)>> {
    let ratio = f64::from(length) / f64::from(side);
    let mean = |i: u32| {
        let (from, to) = (f64::from(i) * ratio, f64::from(i + 1) * ratio);
        let last = (to.ceil() as u32).min(length);
        let share = |x: u32| ((f64::from(x + 1).min(to) - f64::from(x).max(from)) / ratio) as f32;
        (from as u32..last).map(|x| (x, share(x))).collect()
    };
    let interpolated = |i: u32| {
        let at = (f64::from(i) + 0.5) * ratio - 0.5;
        let wrap = |x: f64| x.rem_euclid(f64::from(length)) as u32;
        let part = (at - at.floor()) as f32;
        vec![(wrap(at.floor()), 1.0 - part), (wrap(at.floor() + 1.0), part)]
    };
    (0..side)
        .map(|i| if ratio < 1.0 { interpolated(i) } else { mean(i) })
        .collect()
}

/// Decodes one byte (IEC 61966-2-1 where it is sRGB).
fn to_linear(byte: u8, srgb: bool) -> f32 {
    let x = f32::from(byte) / 255.0;
    match srgb {
        false => x,
        true if x <= 0.04045 => x / 12.92,
        true => ((x + 0.055) / 1.055).powf(2.4),
    }
}

fn from_linear(x: f32, srgb: bool) -> u8 {
    let encoded = match srgb {
        false => x,
        true if x <= 0.003_130_8 => 12.92 * x,
        true => 1.055 * x.powf(1.0 / 2.4) - 0.055,
    };
    (255.0 * encoded).round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_decoding_and_encoding() {
        for srgb in [false, true] {
            for byte in 0..=255 {
                assert_eq!(from_linear(to_linear(byte, srgb), srgb), byte);
            }
        }
    }

    #[test]
    fn resampling_keeps_the_mean_in_linear_light() {
        let rgba: Vec<u8> = (0..6 * 4u32)
            .flat_map(|i| [(i * 10) as u8, 255 - (i * 7) as u8, 128, (i * 9) as u8])
            .collect();
        let texture = Texture {
            name: String::new(),
            width: 6,
            height: 4,
            srgb: true,
            rgba,
        };
        let mean = |rgba: &[u8], c: usize| {
            let texels = rgba.chunks_exact(4).map(|t| to_linear(t[c], c < 3));
            texels.sum::<f32>() / (rgba.len() / 4) as f32
        };
        for side in [1, 3, 4, 16] {
            let resampled = resample(&texture, side);
            assert_eq!(resampled.len(), 4 * (side * side) as usize);
            for c in 0..4 {
                let (before, after) = (mean(&texture.rgba, c), mean(&resampled, c));
                assert!(
                    (before - after).abs() < 0.005,
                    "side {side}, channel {c}: {before} {after}"
                );
            }
        }
    }
}
