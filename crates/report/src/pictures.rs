//! What a report shows of images.

use afterlight_image::{ImageError, Rgba8Image, difference_sheet, encode_png};
use afterlight_measure::Difference;

use crate::{Picture, psnr_text};

/// How much larger than measured a picture of a difference shows it.
pub const AMPLIFICATION: u32 = 16;

impl Picture {
    /// An image beside its difference to the reference's, [`AMPLIFICATION`] times as large.
    ///
    /// # Errors
    /// Images of different sizes.
    pub fn compared(
        technique: &str,
        image: &Rgba8Image,
        truth: &Rgba8Image,
        difference: &Difference,
    ) -> Result<Picture, ImageError> {
        let is_same = difference.max_abs == 0;
        let caption = match is_same {
            true => "equal to the reference".to_owned(),
            false => format!(
                "{} dB, at most {} of 255; difference ×{AMPLIFICATION}",
                psnr_text(difference.psnr_or_infinity_db()),
                difference.max_abs,
            ),
        };
        let sheet = || encode_png(&difference_sheet(truth, image, AMPLIFICATION as f32)?);
        Ok(Picture {
            technique: technique.to_owned(),
            image_png: encode_png(image)?,
            difference_png: if is_same { None } else { Some(sheet()?) },
            difference_caption: caption,
        })
    }
}
