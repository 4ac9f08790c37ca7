//! How far images are from a reference.

use afterlight_image::{ImageError, Rgba8Image, flip, max_abs, psnr_db};
use afterlight_measure::{Difference, PSNR_IDENTICAL_DB};

/// Images that are compared at the same time: FLIP holds about 100 bytes a pixel of each.
const COMPARED_AT_ONCE_MAX: usize = 4;

/// Compares images to a reference, several at a time; places without an image stay without a difference.
///
/// # Errors
/// Images of another size than the reference.
pub fn differences(
    reference: &Rgba8Image,
    images: &[Option<&Rgba8Image>],
) -> Result<Vec<Option<Difference>>, ImageError> {
    let at_once = std::thread::available_parallelism().map_or(1, usize::from).min(COMPARED_AT_ONCE_MAX);
    let mut differences = Vec::new();
    for batch in images.chunks(at_once) {
        let results: Vec<_> = std::thread::scope(|scope| {
            let workers: Vec<_> = batch
                .iter()
                .map(|image| scope.spawn(|| image.map(|image| difference(reference, image))))
                .collect();
            workers
                .into_iter()
                .map(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect()
        });
        for result in results {
            differences.push(result.transpose()?);
        }
    }
    Ok(differences)
}

fn difference(reference: &Rgba8Image, image: &Rgba8Image) -> Result<Difference, ImageError> {
    let max_abs = u32::from(max_abs(reference, image)?);
    let psnr_db = psnr_db(reference, image)?;
    let flip = if max_abs == 0 { 0.0 } else { f64::from(flip(reference, image)?.mean) };
    let psnr_db = if psnr_db.is_infinite() { PSNR_IDENTICAL_DB } else { psnr_db };
    Ok(Difference { psnr_db, max_abs, flip: Some(flip) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(red: u8) -> Rgba8Image {
        Rgba8Image { width: 8, height: 4, pixels: [red, 100, 50, 255].repeat(32) }
    }

    #[test]
    fn equal_images_are_equal_and_others_are_not() {
        let (reference, other) = (image(10), image(30));
        let found = differences(&reference, &[Some(&reference), None, Some(&other)]).expect("the same size");
        assert_eq!(found[0], Some(Difference { psnr_db: PSNR_IDENTICAL_DB, max_abs: 0, flip: Some(0.0) }));
        assert_eq!(found[1], None);
        let other = found[2].expect("compared");
        assert_eq!(other.max_abs, 20);
        // One of three channels is off by 20.
        let expected_db = 10.0 * (255.0f64.powi(2) / (400.0 / 3.0)).log10();
        assert!((other.psnr_db - expected_db).abs() < 1e-9 && other.flip > Some(0.0), "{other:?}");
    }
}
