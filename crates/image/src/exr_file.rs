use std::{io::Cursor, path::Path};

use exr::prelude::*;
use half::f16;

use crate::{ImageError, RgbaF32Image, file};

/// Writes an OpenEXR file of linear RGBA, 16-bit floats, ZIP compressed; complete or not at all.
/// Numbers beyond what a half can hold (65,504) become infinite.
///
/// # Errors
/// [`ImageError::Io`] names the file; [`ImageError::Length`] where the pixels do not fit the size.
pub fn write_exr(file: &Path, image: &RgbaF32Image) -> std::result::Result<(), ImageError> {
    crate::check_length(image.width, image.height, image.pixels.len())?;
    let (width, height) = (image.width as usize, image.height as usize);
    let channels = SpecificChannels::rgba(|at: Vec2<usize>| {
        let i = 4 * (at.y() * width + at.x());
        let [r, g, b, a] = [0, 1, 2, 3].map(|c| f16::from_f32(image.pixels[i + c]));
        (r, g, b, a)
    });
    let layer = Layer::new((width, height), LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|e| ImageError::invalid(file, e, "an image that OpenEXR can hold"))?;
    file::write_atomically(file, bytes.get_ref())
}

/// Reads the first layer with red, green and blue of an OpenEXR file; alpha is 1 where it is missing.
///
/// # Errors
/// [`ImageError::Io`] and [`ImageError::Invalid`] name the file.
pub fn read_exr(file: &Path) -> std::result::Result<RgbaF32Image, ImageError> {
    struct Rows {
        width: usize,
        pixels: Vec<f32>,
    }
    let bytes = file::read(file)?;
    let read = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size: Vec2<usize>, _: &RgbaChannels| Rows {
                width: size.x(),
                pixels: vec![0.0; 4 * size.area()],
            },
            |rows: &mut Rows, at: Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
                let i = 4 * (at.y() * rows.width + at.x());
                rows.pixels[i..i + 4].copy_from_slice(&[r, g, b, a]);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| ImageError::invalid(file, e, "an OpenEXR image with the channels R, G and B"))?;
    let size = read.layer_data.size;
    RgbaF32Image::new(size.x() as u32, size.y() as u32, read.layer_data.channel_data.pixels.pixels)
}
