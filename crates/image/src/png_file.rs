use std::{io::Cursor, path::Path};

use image::{
    ExtendedColorType, ImageEncoder, ImageReader,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};

use crate::{ImageError, Rgba8Image, file};

/// Encodes an image as PNG: RGBA, 8 bits a channel, sRGB.
///
/// # Errors
/// [`ImageError::Length`] where the pixels do not fit the size.
pub fn encode_png(image: &Rgba8Image) -> Result<Vec<u8>, ImageError> {
    crate::check_length(image.width, image.height, image.pixels.len())?;
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(&image.pixels, image.width, image.height, ExtendedColorType::Rgba8)
        .map_err(|e| ImageError::invalid(Path::new("PNG"), e, "an image that PNG can hold"))?;
    Ok(bytes)
}

/// Decodes a PNG; other than 8-bit RGBA is converted. `file` is named in errors.
///
/// # Errors
/// [`ImageError::Invalid`] where the bytes are no PNG.
pub fn decode_png(bytes: &[u8], file: &Path) -> Result<Rgba8Image, ImageError> {
    let decoded = ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Png)
        .decode()
        .map_err(|e| ImageError::invalid(file, e, "a PNG image"))?
        .into_rgba8();
    Rgba8Image::new(decoded.width(), decoded.height(), decoded.into_raw())
}

/// Reads a PNG file.
///
/// # Errors
/// [`ImageError::Io`] and [`ImageError::Invalid`] name the file.
pub fn read_png(file: &Path) -> Result<Rgba8Image, ImageError> {
    decode_png(&file::read(file)?, file)
}

/// Writes a PNG file, complete or not at all.
///
/// # Errors
/// [`ImageError::Io`] names the file; [`ImageError::Length`] where the pixels do not fit the size.
pub fn write_png(file: &Path, image: &Rgba8Image) -> Result<(), ImageError> {
    file::write_atomically(file, &encode_png(image)?)
}
