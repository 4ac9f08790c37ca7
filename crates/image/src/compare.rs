use nv_flip::{FlipImageRgb8, FlipPool};

use crate::{ImageError, Rgba8Image};

pub(crate) fn check_sizes(
    what: &'static str,
    reference: &Rgba8Image,
    test: &Rgba8Image,
) -> Result<(), ImageError> {
    for image in [reference, test] {
        crate::check_length(image.width, image.height, image.pixels.len())?;
    }
    let (found, expected) = ((test.width, test.height), (reference.width, reference.height));
    if found == expected { Ok(()) } else { Err(ImageError::SizeMismatch { what, found, expected }) }
}

/// Absolute differences of the red, green and blue bytes.
fn differences<'a>(reference: &'a Rgba8Image, test: &'a Rgba8Image) -> impl Iterator<Item = u8> + 'a {
    let pairs = reference.pixels.chunks_exact(4).zip(test.pixels.chunks_exact(4));
    pairs.flat_map(|(a, b)| [0, 1, 2].map(|c| a[c].abs_diff(b[c])))
}

/// Peak signal-to-noise ratio over red, green and blue, decibels: `10 log10(255² / mean squared
/// difference)`; infinite where the images are equal. Alpha does not count.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn psnr_db(reference: &Rgba8Image, test: &Rgba8Image) -> Result<f64, ImageError> {
    check_sizes("PSNR", reference, test)?;
    let sum: u64 = differences(reference, test).map(|d| u64::from(d) * u64::from(d)).sum();
    if sum == 0 {
        return Ok(f64::INFINITY);
    }
    let mean = sum as f64 / (3.0 * f64::from(reference.width) * f64::from(reference.height));
    Ok(10.0 * (255.0 * 255.0 / mean).log10())
}

/// Greatest difference of a red, green or blue byte, 0 to 255.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn max_abs(reference: &Rgba8Image, test: &Rgba8Image) -> Result<u8, ImageError> {
    check_sizes("greatest difference", reference, test)?;
    Ok(differences(reference, test).max().unwrap_or(0))
}

/// Pixels of which a red, green or blue byte differs by `least` or more.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn pixels_off(reference: &Rgba8Image, test: &Rgba8Image, least: u8) -> Result<u64, ImageError> {
    check_sizes("pixels off", reference, test)?;
    let pairs = reference.pixels.chunks_exact(4).zip(test.pixels.chunks_exact(4));
    Ok(pairs.filter(|(a, b)| is_off(a, b, least)).count() as u64)
}

/// Whether a red, green or blue byte of two pixels differs by `least` or more.
pub(crate) fn is_off(a: &[u8], b: &[u8], least: u8) -> bool {
    (0..3).any(|c| a[c].abs_diff(b[c]) >= least)
}

/// A FLIP comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Mean over the pixels, 0 (equal) to 1.
    pub mean: f32,
    /// Width of the map in pixels.
    pub width: u32,
    /// Height of the map in pixels.
    pub height: u32,
    /// Error of each pixel, 0 to 1, row by row from the top.
    pub map: Vec<f32>,
}

/// Compares two images as an observer who flips between them would see them (Andersson et al. 2020, LDR-FLIP), at
/// 67 pixels a degree: a 0.7 m wide 3840 pixel screen at 0.7 m.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn flip(reference: &Rgba8Image, test: &Rgba8Image) -> Result<Flip, ImageError> {
    check_sizes("FLIP", reference, test)?;
    let (width, height) = (reference.width, reference.height);
    let [reference, test] =
        [reference, test].map(|image| FlipImageRgb8::with_data(width, height, &image.to_rgb8()));
    let map = nv_flip::flip(reference, test, nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    let mean = FlipPool::from_image(&map).mean();
    Ok(Flip { mean, width, height, map: map.to_vec() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gray(value: u8) -> Rgba8Image {
        Rgba8Image { width: 8, height: 4, pixels: [value, value, value, 255].repeat(32) }
    }

    #[test]
    fn equal_images_are_infinitely_close() {
        let a = gray(90);
        assert_eq!(psnr_db(&a, &a).expect("sizes"), f64::INFINITY);
        assert_eq!(max_abs(&a, &a).expect("sizes"), 0);
        assert_eq!(flip(&a, &a).expect("sizes").mean, 0.0);
    }

    #[test]
    fn one_step_everywhere_is_48_13_db() {
        let found = psnr_db(&gray(90), &gray(91)).expect("sizes");
        assert!((found - 20.0 * 255f64.log10()).abs() < 1e-12, "{found}");
    }

    #[test]
    fn images_of_one_pixel_can_be_compared() {
        let of = |v: u8| Rgba8Image { width: 1, height: 1, pixels: vec![v, v, v, 255] };
        let found = flip(&of(0), &of(255)).expect("sizes");
        assert!(found.map.len() == 1 && found.mean > 0.5, "{found:?}");
    }

    #[test]
    fn alpha_does_not_count() {
        let mut b = gray(90);
        b.pixels[3] = 0;
        assert_eq!(psnr_db(&gray(90), &b).expect("sizes"), f64::INFINITY);
    }

    /// The mutant: one pixel changed is seen by all three.
    #[test]
    fn one_changed_pixel_is_seen() {
        let a = gray(90);
        let mut b = a.clone();
        b.pixels[4 * 13 + 1] ^= 0x40;
        assert_eq!(max_abs(&a, &b).expect("sizes"), 64);
        let expected = 10.0 * (255.0f64 * 255.0 * 96.0 / 4096.0).log10();
        assert!((psnr_db(&a, &b).expect("sizes") - expected).abs() < 1e-9);
        let flip = flip(&a, &b).expect("sizes");
        let greatest = flip.map.iter().copied().fold(0.0, f32::max);
        assert!(flip.mean > 0.0 && (flip.map[13] - greatest).abs() < 1e-6, "{flip:?}");
    }

    #[test]
    fn sizes_must_agree() {
        let other = Rgba8Image { width: 4, height: 8, pixels: vec![0; 128] };
        let error = psnr_db(&gray(1), &other).expect_err("4×8 against 8×4").to_string();
        assert_eq!(error, "PSNR: found an image of 4×8, expected 8×4 as the reference has");
        let broken = Rgba8Image { width: 8, height: 4, pixels: vec![0; 5] };
        assert!(matches!(flip(&gray(1), &broken), Err(ImageError::Length { found: 5, expected: 128, .. })));
    }
}
