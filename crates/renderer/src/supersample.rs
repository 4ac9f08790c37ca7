//! The image that anti-aliasing aims at: a technique at many times the width and height, averaged.

use std::sync::Arc;

use afterlight_graph::gpu;
use half::f16;

use crate::Renderer;
use afterlight_frame::{Params, Post, Settings, Technique, TechniqueError, scene::SceneGpu, views};
use afterlight_stages::compose::present;

/// Renders a technique at `factor` times the settings' width and height, one sample a pixel, averages the linear radiance
/// of `factor`×`factor` pixels, and tone-maps the mean: RGBA with 8 bits a channel, sRGB-encoded, rows from the top.
///
/// The whole large image is held at once, 8 bytes a pixel on the device besides what the technique takes, and 8 in memory.
///
/// # Errors
/// A factor of 0; an image larger than the device takes (the error names the limit); those of [`Renderer::prepare`].
pub fn reference_rgba8(
    device: &gpu::Device,
    scene: &Arc<SceneGpu>,
    settings: &Settings,
    technique: &dyn Technique,
    factor: u32,
) -> Result<Vec<u8>, TechniqueError> {
    let limit = device.features().max_image_dimension_2d;
    let width_px = scaled("width", settings.width_px, factor, limit)?;
    let height_px = scaled("height", settings.height_px, factor, limit)?;
    let large = Settings {
        width_px,
        height_px,
        samples: 1,
        keep_hdr: true,
        view: views::FINAL.to_owned(),
        ..settings.clone()
    }
    .with_effects(|effects| {
        effects.post.filter = Post::None;
        // The same triangles: edges of the large image are as much longer.
        effects.tessellation.edge_px = effects.tessellation.edge_px.map(|px| px * factor as f32);
    });
    let renderer = Renderer::with_scene(device, Arc::clone(scene), &large)?;
    let mut prepared = renderer.prepare(technique, &Params::default())?;
    prepared.run()?;
    // `keep_hdr` is set, so there are bytes.
    let rgba16f = prepared.hdr_bytes()?.unwrap_or_default();
    Ok(averaged_rgba8(&rgba16f, width_px as usize, factor as usize))
}

/// A side of the large image, checked against the device.
fn scaled(side: &str, size_px: u32, factor: u32, limit: u32) -> Result<u32, TechniqueError> {
    let found = u64::from(size_px) * u64::from(factor);
    match u32::try_from(found) {
        Ok(scaled_px) if scaled_px > 0 && scaled_px <= limit => Ok(scaled_px),
        _ => Err(TechniqueError::TooLarge {
            what: format!("image {side} in pixels, {factor} times supersampled"),
            found,
            limit: limit.into(),
        }),
    }
}

/// Averages squares of `factor`×`factor` RGBA16F pixels and tone-maps the means.
fn averaged_rgba8(rgba16f: &[u8], width_px: usize, factor: usize) -> Vec<u8> {
    /// Red, green, blue and alpha of 2 bytes.
    const PIXEL_BYTES: usize = 8;
    let row_bytes = width_px * PIXEL_BYTES;
    let scale = 1.0 / (factor * factor) as f64;
    let mut rgba8 = Vec::new();
    for rows in rgba16f.chunks_exact(row_bytes * factor) {
        let mut sums = vec![[0f64; 3]; width_px / factor];
        for row in rows.chunks_exact(row_bytes) {
            for (sum, square_row) in sums.iter_mut().zip(row.chunks_exact(PIXEL_BYTES * factor)) {
                for pixel in square_row.chunks_exact(PIXEL_BYTES) {
                    for (channel, half) in sum.iter_mut().zip(pixel.chunks_exact(2)) {
                        *channel += f16::from_le_bytes([half[0], half[1]]).to_f64();
                    }
                }
            }
        }
        for sum in sums {
            let [r, g, b] = present::display_rgb8(sum.map(|channel| (channel * scale) as f32));
            rgba8.extend([r, g, b, u8::MAX]);
        }
    }
    rgba8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_averaged_before_the_tone_map() {
        // Two squares of 2x2: one half lit, one uniform.
        let pixel =
            |value: f32| [value, value, value, 1.0].into_iter().flat_map(|c| f16::from_f32(c).to_le_bytes());
        let bytes: Vec<u8> =
            [1.0, 0.0, 0.25, 0.25, 1.0, 0.0, 0.25, 0.25].into_iter().flat_map(pixel).collect();
        let [half, _, _] = present::display_rgb8([0.5; 3]);
        let [quarter, _, _] = present::display_rgb8([0.25; 3]);
        let expected = [[half, half, half, 255], [quarter, quarter, quarter, 255]].concat();
        assert_eq!(averaged_rgba8(&bytes, 4, 2), expected);
    }

    #[test]
    fn too_large_names_the_limit() {
        let error = scaled("width", 4096, 8, 16384).expect_err("too large").to_string();
        assert!(error.contains("32768") && error.contains("16384"), "{error}");
        assert!(scaled("width", 4096, 0, 16384).is_err());
        assert_eq!(scaled("width", 2048, 8, 16384).expect("fits"), 16384);
    }
}
