use crate::{
    Flip, ImageError, Rgba8Image,
    compare::{check_sizes, is_off},
};

/// A difference image: each channel's absolute difference times `amplification`, clamped; opaque.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn difference_sheet(
    reference: &Rgba8Image,
    test: &Rgba8Image,
    amplification: f32,
) -> Result<Rgba8Image, ImageError> {
    let (found, expected) = ((test.width, test.height), (reference.width, reference.height));
    if found != expected {
        return Err(ImageError::SizeMismatch { what: "difference sheet", found, expected });
    }
    let pairs = reference.pixels.chunks_exact(4).zip(test.pixels.chunks_exact(4));
    let amplified = |a: u8, b: u8| (f32::from(a.abs_diff(b)) * amplification).clamp(0.0, 255.0).round() as u8;
    let pixels = pairs
        .flat_map(|(a, b)| [amplified(a[0], b[0]), amplified(a[1], b[1]), amplified(a[2], b[2]), 255])
        .collect();
    Rgba8Image::new(reference.width, reference.height, pixels)
}

/// Three pictures side by side, a line of white between them: the reference, the test, and the reference in dark grey with the pixels in bright red of
/// which a channel differs by `least` or more.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn marked_sheet(reference: &Rgba8Image, test: &Rgba8Image, least: u8) -> Result<Rgba8Image, ImageError> {
    check_sizes("marked sheet", reference, test)?;
    let row_bytes = reference.width as usize * 4;
    let marked = |(a, b): (&[u8], &[u8])| {
        // Rec. 709 luma, of 256, at a third.
        let grey = ((54 * u32::from(a[0]) + 183 * u32::from(a[1]) + 19 * u32::from(a[2])) / 768) as u8;
        if is_off(a, b, least) { [255, 40, 40, 255] } else { [grey, grey, grey, 255] }
    };
    let mut pixels = Vec::with_capacity(reference.pixels.len() * 3);
    for (a, b) in reference.pixels.chunks_exact(row_bytes).zip(test.pixels.chunks_exact(row_bytes)) {
        pixels.extend_from_slice(a);
        pixels.extend([255; 4]);
        pixels.extend_from_slice(b);
        pixels.extend([255; 4]);
        pixels.extend(a.chunks_exact(4).zip(b.chunks_exact(4)).flat_map(marked));
    }
    Rgba8Image::new(reference.width * 3 + 2, reference.height, pixels)
}

/// A heat image of a FLIP map: an error of `full_scale` (0 to 1, positive) and more is the brightest colour.
///
/// # Errors
/// [`ImageError::Length`] where the map does not fit its size.
pub fn heat_sheet(flip: &Flip, full_scale: f32) -> Result<Rgba8Image, ImageError> {
    let color = |e: &f32| {
        let [r, g, b] = heat_color(e / full_scale);
        [r, g, b, 255]
    };
    Rgba8Image::new(flip.width, flip.height, flip.map.iter().flat_map(color).collect())
}

/// Nine colours of Viridis (van der Walt and Smith 2015) at even distances, sRGB.
const VIRIDIS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// The false colour of a value from 0 to 1, clamped; sRGB. Not a number counts as 0. Between the table's nine
/// colours it is linear: within 6 of 255 of the published map.
pub fn heat_color(value: f32) -> [u8; 3] {
    let place = if value > 0.0 { value.min(1.0) } else { 0.0 } * (VIRIDIS.len() - 1) as f32;
    let i = (place as usize).min(VIRIDIS.len() - 2);
    let t = place - i as f32;
    [0, 1, 2].map(|c| {
        let (a, b) = (f32::from(VIRIDIS[i][c]), f32::from(VIRIDIS[i + 1][c]));
        (a + (b - a) * t).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_amplified_and_clamped() {
        let a = Rgba8Image { width: 1, height: 1, pixels: vec![10, 10, 10, 255] };
        let b = Rgba8Image { width: 1, height: 1, pixels: vec![12, 10, 200, 0] };
        assert_eq!(difference_sheet(&a, &b, 8.0).expect("sizes").pixels, [16, 0, 255, 255]);
    }

    #[test]
    fn pixels_that_differ_are_marked() {
        let image =
            |red: u8| Rgba8Image { width: 1, height: 2, pixels: vec![red, 10, 10, 255, 90, 90, 90, 255] };
        let sheet = marked_sheet(&image(10), &image(14), 4).expect("sizes");
        assert_eq!((sheet.width, sheet.height), (5, 2));
        let pixel = |x: usize, y: usize| &sheet.pixels[4 * (5 * y + x)..][..4];
        assert_eq!((pixel(0, 0), pixel(2, 0)), (&[10, 10, 10, 255][..], &[14, 10, 10, 255][..]));
        assert_eq!((pixel(4, 0), pixel(4, 1)), (&[255, 40, 40, 255][..], &[30, 30, 30, 255][..]));
        let off = |least| crate::pixels_off(&image(10), &image(14), least).expect("sizes");
        assert_eq!((off(4), off(5)), (1, 0));
        assert!(marked_sheet(&image(1), &Rgba8Image { width: 2, height: 1, ..image(1) }, 4).is_err());
    }

    #[test]
    fn heat_grows_from_dark_to_bright() {
        let brightness = |v: f32| heat_color(v).iter().map(|c| u32::from(*c)).sum::<u32>();
        assert_eq!(heat_color(0.0), VIRIDIS[0]);
        assert_eq!(heat_color(7.0), VIRIDIS[8]);
        assert_eq!(heat_color(f32::NAN), VIRIDIS[0]);
        assert!((0..20).all(|i| brightness(i as f32 / 20.0) < brightness((i + 1) as f32 / 20.0)));
    }
}
