//! Reading results back for headless use. Every function here blocks, and none is called on the frame path.

use crate::{Error, gpu};

/// Waits until `buffer` (MAP_READ) can be mapped and copies its contents out.
pub(crate) fn map_blocking<T: bytemuck::Pod>(
    device: &wgpu::Device,
    buffer: &wgpu::Buffer,
    what: &'static str,
) -> Result<Vec<T>, Error> {
    let error = |reason: String| Error::ReadBack { what, reason };
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
        // The receiver lives until this function returns.
        let _ = sender.send(result);
    });
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|e| error(e.to_string()))?;
    receiver
        .recv()
        .map_err(|e| error(e.to_string()))?
        .map_err(|e| error(e.to_string()))?;
    let mapped = buffer.slice(..).get_mapped_range().map_err(|e| error(e.to_string()))?;
    let values = bytemuck::pod_collect_to_vec(&mapped);
    drop(mapped);
    buffer.unmap();
    Ok(values)
}

/// Copies a buffer (usage `COPY_SRC`) to the CPU: submits, waits.
///
/// # Errors
/// [`Error::ReadBack`] if the device is lost, [`Error::LimitExceeded`] if the staging buffer cannot be made.
pub fn read_buffer_blocking<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
) -> Result<Vec<T>, Error> {
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let staging = gpu::buffer(device, "lightfall::read_back", buffer.size(), usage)?;
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    queue.submit([encoder.finish()]);
    map_blocking(device, &staging, "a buffer")
}

/// Copies an `rgba32float` texture (usage `COPY_SRC`) to the CPU, row-major from the top: submits, waits.
///
/// # Errors
/// [`Error::IncompatibleView`] for another format, else as [`read_buffer_blocking`].
pub fn read_rgba32float_blocking(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
) -> Result<Vec<[f32; 4]>, Error> {
    read_texels_blocking(device, queue, texture, wgpu::TextureFormat::Rgba32Float)
}

/// Copies one layer after the other of a texture whose texel is `T`.
pub(crate) fn read_texels_blocking<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    format: wgpu::TextureFormat,
) -> Result<Vec<T>, Error> {
    if texture.format() != format {
        return Err(Error::IncompatibleView {
            resource: "read-back texture",
            property: "format",
            expected: format!("{format:?}"),
            found: format!("{:?}", texture.format()),
        });
    }
    let (width, height, layers) = (texture.width(), texture.height(), texture.depth_or_array_layers());
    let row = width * size_of::<T>() as u32;
    let padded_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let size = u64::from(padded_row) * u64::from(height) * u64::from(layers);
    let staging = gpu::buffer(device, "lightfall::read_back", size, usage)?;
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded_row),
                rows_per_image: Some(height),
            },
        },
        texture.size(),
    );
    queue.submit([encoder.finish()]);
    let bytes: Vec<u8> = map_blocking(device, &staging, "a texture")?;
    Ok(bytes
        .chunks_exact(padded_row as usize)
        .flat_map(|r| bytemuck::pod_collect_to_vec::<u8, T>(&r[..row as usize]))
        .collect())
}
