//! Pictures of reports.

use afterlight_lab::{Compared, LabError};
use afterlight_report::Picture;

/// What a report shows of a comparison: every image that was drawn beside its difference to the reference's.
///
/// # Errors
/// Images that cannot be encoded.
pub fn pictures_of(compared: &Compared) -> Result<Vec<Picture>, LabError> {
    let Some(truth) = &compared.truth else { return Ok(Vec::new()) };
    let mut pictures = Vec::new();
    for (result, image) in compared.run.results.iter().zip(&compared.images) {
        if let (Some(image), Some(difference)) = (image, &result.difference) {
            pictures.push(Picture::compared(&result.technique, image, truth, difference)?);
        }
    }
    Ok(pictures)
}
