//! OpenEXR files: writes linear radiance, reads any flat image by the names of its channels.
//!
//! Files are encoded in memory and put in place by renaming, so that whoever reads one meanwhile, or after an error,
//! finds the old file or the new one, never a part. Every message names the file.

use exr::meta::{MetaData, header::Header};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, ReadChannels, ReadLayers, Vec2,
    WritableImage,
};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::Cursor;
use std::path::Path;

/// Width, height and number of channels come from the file and may be anything; beyond these limits a broken header is
/// likelier than an image. The largest side that a device promises is 8192 (WebGPU default limits), doubled here.
const MAX_SIDE: usize = 16384;
/// Bytes of all samples together, as `f32`.
const MAX_BYTES: usize = 1 << 32;

/// The channels of one image.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ExrChannels {
    /// Pixels in a row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Samples by channel name, row after row from the top. Names are those of the file, dots included: `R`,
    /// `albedo.R`. Integers above 2^24 are rounded to the nearest `f32`.
    pub(crate) channels: BTreeMap<String, Vec<f32>>,
}

impl ExrChannels {
    /// A channel, if the file has it.
    pub(crate) fn get(&self, name: &str) -> Option<&[f32]> {
        self.channels.get(name).map(Vec::as_slice)
    }

    /// Three channels side by side.
    ///
    /// # Errors
    /// Names the channel that is not there.
    pub(crate) fn triple(&self, names: [&str; 3]) -> Result<Vec<[f32; 3]>, String> {
        let find = |name: &str| self.get(name).ok_or_else(|| format!("there is no channel {name:?}"));
        let [a, b, c] = [find(names[0])?, find(names[1])?, find(names[2])?];
        Ok((0..a.len()).map(|i| [a[i], b[i], c[i]]).collect())
    }
}

/// Writes an image as three `f32` channels R, G, B, compressed without loss (ZIP, blocks of 16 rows). `pixels` run row
/// after row from the top.
///
/// # Errors
/// A size that is zero, too large, or not that of the list; an error of the file system. The path then holds what it
/// held before.
pub(crate) fn write_rgb(path: &Path, width: u32, height: u32, pixels: &[[f32; 3]]) -> Result<(), String> {
    write_rgb_and(path, [width, height], pixels, &[])
}

/// As [`write_rgb`], with further channels by name, each as long as the image.
///
/// # Errors
/// As [`write_rgb`].
pub(crate) fn write_rgb_and(
    path: &Path,
    size: [u32; 2],
    pixels: &[[f32; 3]],
    others: &[(&str, Vec<f32>)],
) -> Result<(), String> {
    let size = size.map(|s| s as usize);
    let bytes = encode(size, pixels, others).map_err(|problem| at(path, &problem))?;
    replace_file(path, &bytes)
}

/// Reads the first layer of a file: scan lines or tiles, any lossless or lossy compression, `f16`, `f32` or `u32`.
/// Of an image with resolution levels, the largest.
///
/// # Errors
/// No such file, not an EXR file, truncated or contradicting contents, deep or sub-sampled data, more than 16384 pixels
/// a side or 4 GiB.
pub(crate) fn read(path: &Path) -> Result<ExrChannels, String> {
    let bytes = std::fs::read(path).map_err(|error| at(path, &error))?;
    decode(&bytes).map_err(|problem| at(path, &problem))
}

/// Puts a whole file in place of what is at `path`, if anything, or leaves that alone.
///
/// # Errors
/// An error of the file system.
pub(crate) fn replace_file(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let name = path.file_name().ok_or_else(|| at(path, &"is not the name of a file"))?;
    // In the same folder, because renaming is only atomic within a file system.
    let mut temporary = OsString::from(".");
    temporary.push(name);
    temporary.push(format!(".{}.partial", std::process::id()));
    let temporary = path.with_file_name(temporary);
    std::fs::write(&temporary, bytes)
        .and_then(|()| std::fs::rename(&temporary, path))
        .map_err(|error| {
            // May not exist; the first error is the one to report.
            let _ = std::fs::remove_file(&temporary);
            at(path, &error)
        })
}

fn encode([width, height]: [usize; 2], pixels: &[[f32; 3]], others: &[(&str, Vec<f32>)]) -> Result<Vec<u8>, String> {
    check_size(width, height, 3 + others.len())?;
    let lengths = others.iter().map(|(_, values)| values.len()).chain([pixels.len()]);
    if let Some(length) = lengths.into_iter().find(|&length| length != width * height) {
        return Err(format!("{length} pixels given for {width} × {height}"));
    }
    let channel = |name: &str, values: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(values));
    let colors = ["R", "G", "B"].iter().enumerate();
    let own = colors.map(|(c, name)| channel(name, pixels.iter().map(|p| p[c]).collect()));
    let all = own.chain(others.iter().map(|(name, values)| channel(name, values.clone())));
    let layer = Layer::new(
        (width, height),
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(all.collect()),
    );
    let mut bytes = Cursor::new(Vec::new());
    exr::prelude::Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}

fn decode(bytes: &[u8]) -> Result<ExrChannels, String> {
    // The decoder allocates what the header asks for, so the header is looked at first.
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), true).map_err(unreadable)?;
    meta.headers.iter().try_for_each(check_header)?;
    // Pedantic, as otherwise blocks that are missing from the table of offsets would silently come out black.
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .pedantic()
        .from_buffered(Cursor::new(bytes))
        .map_err(unreadable)?;
    channels_of(image.layer_data)
}

fn check_header(header: &Header) -> Result<(), String> {
    if header.deep {
        return Err("deep data are not supported".into());
    }
    if header
        .channels
        .list
        .iter()
        .any(|channel| channel.sampling != Vec2(1, 1))
    {
        return Err("sub-sampled channels are not supported".into());
    }
    check_size(
        header.layer_size.width(),
        header.layer_size.height(),
        header.channels.list.len(),
    )
}

fn check_size(width: usize, height: usize, channels: usize) -> Result<(), String> {
    if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
        return Err(format!(
            "the size is {width} × {height}, expected 1 to {MAX_SIDE} a side"
        ));
    }
    if channels.saturating_mul(width * height * size_of::<f32>()) > MAX_BYTES {
        return Err(format!(
            "{channels} channels of {width} × {height} pixels take more than {MAX_BYTES} bytes"
        ));
    }
    Ok(())
}

fn channels_of(layer: Layer<AnyChannels<FlatSamples>>) -> Result<ExrChannels, String> {
    let Vec2(width, height) = layer.size;
    let side = |side: usize| u32::try_from(side).map_err(|error| error.to_string());
    let channels = layer
        .channel_data
        .list
        .into_iter()
        .map(|channel| (channel.name.to_string(), to_f32(channel.sample_data)));
    let channels: BTreeMap<String, Vec<f32>> = channels.collect();
    if let Some((name, samples)) = channels.iter().find(|(_, samples)| samples.len() != width * height) {
        return Err(format!(
            "channel {name:?} has {} samples for {width} × {height} pixels",
            samples.len()
        ));
    }
    Ok(ExrChannels {
        width: side(width)?,
        height: side(height)?,
        channels,
    })
}

fn to_f32(samples: FlatSamples) -> Vec<f32> {
    match samples {
        FlatSamples::F16(values) => values.into_iter().map(|value| value.to_f32()).collect(),
        FlatSamples::F32(values) => values,
        FlatSamples::U32(values) => values.into_iter().map(|value| value as f32).collect(),
    }
}

/// The decoder's own words presume that one knows what it was reading.
fn unreadable(error: exr::error::Error) -> String {
    format!("not a whole, valid OpenEXR file ({error})")
}

fn at(path: &Path, problem: &dyn std::fmt::Display) -> String {
    format!("{}: {problem}", path.display())
}
