//! Many small pictures on one sheet: references, images, and where they differ.

use super::difference::{self, Display};
use super::lettering;
use color_quant::NeuQuant;
use image::imageops::replace;
use image::{Rgb, RgbImage};
use lightfall::reference::metrics::{Image, Truth};

/// Pixels along a small picture: the first that keeps the file small enough; the last in any case.
const SIDES: [u32; 3] = [128, 96, 64];
/// Bytes that people are asked to load with a page.
const MOST_BYTES: usize = 600_000;
const GAP: u32 = 6;
/// Of a palette, the most that a PNG file can have. Noise in true colours takes three times the bytes.
const COLORS: usize = 256;
/// Every so manieth pixel is looked at to choose the palette; 1 is best, 10 is the library's advice for speed.
const PALETTE_STEP: i32 = 3;

/// A reference and the images that are compared with it.
pub(crate) struct Line<'a> {
    pub(crate) title: String,
    pub(crate) truth: &'a Truth,
    pub(crate) images: Vec<Labelled>,
}

/// An image of the reference's size.
pub(crate) struct Labelled {
    pub(crate) label: String,
    pub(crate) image: Image,
}

/// The sheet as a PNG file. A line is its reference, then each image beside its relative error
/// ([`difference::error_picture`]), the images of a line exposed alike. What the colours mean stands below.
///
/// # Errors
/// None that is known; those of the encoder.
pub(crate) fn png(lines: &[Line<'_>]) -> Result<Vec<u8>, String> {
    let mut sheet = encode(&draw(lines, SIDES[0]))?;
    for &side in &SIDES[1..] {
        if sheet.len() <= MOST_BYTES {
            break;
        }
        sheet = encode(&draw(lines, side))?;
    }
    Ok(sheet)
}

fn encode(picture: &RgbImage) -> Result<Vec<u8>, String> {
    let opaque = |&Rgb([r, g, b]): &Rgb<u8>| [r, g, b, 255];
    let pixels: Vec<u8> = picture.pixels().flat_map(opaque).collect();
    let palette = NeuQuant::new(PALETTE_STEP, COLORS, &pixels);
    let indices: Vec<u8> = pixels
        .chunks_exact(4)
        .map(|pixel| palette.index_of(pixel) as u8)
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width(), picture.height());
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(palette.color_map_rgb());
    encoder.set_compression(png::Compression::High);
    // Neighbouring indices have nothing in common that a difference would show.
    encoder.set_filter(png::Filter::NoFilter);
    let written = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(&indices).and_then(|()| writer.finish()));
    written.map_err(|error| format!("the contact sheet: {error}"))?;
    Ok(bytes)
}

/// How many pixels of an image, along a side, make one of its small picture.
fn block(image: &Image, side: u32) -> u32 {
    image.width.max(image.height).div_ceil(side)
}

/// With pictures that fit a square of `side` pixels.
fn draw(lines: &[Line<'_>], side: u32) -> RgbImage {
    // Pictures shrink by whole numbers and may all be smaller than they might be.
    let shrunk = |image: &Image| image.width.max(image.height).div_ceil(block(image, side));
    let cell = lines.iter().map(|line| shrunk(&line.truth.image)).max().unwrap_or(side) + GAP;
    let columns = 1 + 2 * lines.iter().map(|line| line.images.len() as u32).max().unwrap_or(0);
    let line_height = 2 * lettering::LINE_HEIGHT + cell;
    let (width, height) = (
        cell * columns,
        line_height * lines.len() as u32 + lettering::LINE_HEIGHT,
    );
    let mut sheet = RgbImage::from_pixel(width, height, lettering::BACKGROUND);
    for (top, line) in (0..).step_by(line_height as usize).zip(lines) {
        draw_line(&mut sheet, top, (cell, side), line);
    }
    let legend = difference::legend(width);
    replace(&mut sheet, &legend, 0, (height - lettering::LINE_HEIGHT).into());
    sheet
}

/// Title, labels, pictures.
fn draw_line(sheet: &mut RgbImage, top: u32, (cell, side): (u32, u32), line: &Line<'_>) {
    let truth = &line.truth.image;
    let (display, block) = (Display::of(line.truth), block(truth, side));
    let (labels, pictures) = (top + lettering::LINE_HEIGHT, top + 2 * lettering::LINE_HEIGHT);
    let place = |sheet: &mut RgbImage, column: u32, label: &str, picture: &RgbImage| {
        lettering::write(sheet, (column * cell, labels), label);
        replace(sheet, picture, (column * cell).into(), pictures.into());
    };
    lettering::write(sheet, (0, top), &line.title);
    place(
        sheet,
        0,
        "reference",
        &difference::radiance_picture(truth, &display, block),
    );
    for (column, Labelled { label, image }) in (1..).step_by(2).zip(&line.images) {
        place(
            sheet,
            column,
            label,
            &difference::radiance_picture(image, &display, block),
        );
        place(
            sheet,
            column + 1,
            "",
            &difference::error_picture(image, line.truth, block),
        );
    }
}
