//! Images in memory and in files, and how far two of them are apart.
//!
//! PNG holds sRGB, 8 bits a channel; EXR holds linear light, 16-bit floats. A file is written beside
//! its place and then renamed, so it is either complete or absent.

mod compare;
mod error;
mod exr_file;
mod file;
mod png_file;
mod sheet;

pub use compare::{Flip, flip, max_abs, pixels_off, psnr_db};
pub use error::ImageError;
pub use exr_file::{read_exr, write_exr};
pub use file::write_atomically;
pub use png_file::{decode_png, encode_png, read_png, write_png};
pub use sheet::{difference_sheet, heat_color, heat_sheet, marked_sheet};

/// An image of 8 bits a channel, RGBA, sRGB, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgba8Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height * 4` bytes.
    pub pixels: Vec<u8>,
}

/// An image of 32-bit floats, RGBA, linear Rec. 709, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbaF32Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height * 4` numbers.
    pub pixels: Vec<f32>,
}

/// How many numbers an image of a size has.
fn channel_count(width: u32, height: u32) -> Option<usize> {
    (width as usize).checked_mul(height as usize)?.checked_mul(4)
}

fn check_length(width: u32, height: u32, found: usize) -> Result<(), ImageError> {
    match channel_count(width, height) {
        Some(expected) if expected == found && expected > 0 => Ok(()),
        expected => Err(ImageError::Length { width, height, found, expected: expected.unwrap_or(0) }),
    }
}

impl Rgba8Image {
    /// An image of given pixels.
    ///
    /// # Errors
    /// [`ImageError::Length`] where there are not `width * height * 4` bytes, or none.
    pub fn new(width: u32, height: u32, pixels: Vec<u8>) -> Result<Self, ImageError> {
        check_length(width, height, pixels.len())?;
        Ok(Self { width, height, pixels })
    }

    /// The red, green and blue bytes.
    pub fn to_rgb8(&self) -> Vec<u8> {
        self.pixels.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
    }
}

impl RgbaF32Image {
    /// An image of given pixels.
    ///
    /// # Errors
    /// [`ImageError::Length`] where there are not `width * height * 4` numbers, or none.
    pub fn new(width: u32, height: u32, pixels: Vec<f32>) -> Result<Self, ImageError> {
        check_length(width, height, pixels.len())?;
        Ok(Self { width, height, pixels })
    }
}
