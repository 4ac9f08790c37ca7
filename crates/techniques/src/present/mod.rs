//! The last stage of every frame: linear radiance to the image that is shown.

use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole, gpu::vk};

use crate::{error::TechniqueError, frame::Frame, view};

/// Declares the pass `present/tonemap`: Khronos PBR Neutral, sRGB, 8 bits; debug views, which are colours already, keep
/// theirs. Compute, since a full-screen fragment pass
/// would cost more on devices whose raster part is small.
///
/// # Errors
/// A shader that is not compiled in.
pub fn present(
    graph: &mut Graph,
    frame: &Frame<'_>,
    hdr: &ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let target = display(graph, frame, hdr, "final color")?;
    graph.mark_output(&target);
    Ok(target)
}

/// Declares the pass `present/tonemap` into an image of that name that a later pass reads.
///
/// # Errors
/// A shader that is not compiled in.
pub(crate) fn display(
    graph: &mut Graph,
    frame: &Frame<'_>,
    hdr: &ImageHandle,
    name: &str,
) -> Result<ImageHandle, TechniqueError> {
    let target = graph.image(name, BufferRole::Targets, frame.image_info(vk::Format::R8G8B8A8_UNORM));
    let shader = match frame.shows(view::FINAL) {
        true => frame.shader("present/tonemap.comp")?,
        false => frame.shader("present/tonemap.comp#colors")?,
    };
    let mut pass = frame.compute(graph, "present/tonemap", PassRole::Present, &shader);
    pass.read("hdr", hdr);
    let target = pass.write("final_color", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}

/// The bytes that a linear radiance is shown as: the pass's twin on the CPU, in 32 bits; at most one off its bytes.
pub fn display_rgb8(radiance: [f32; 3]) -> [u8; 3] {
    pbr_neutral(radiance).map(|c| (srgb_from_linear(c).clamp(0.0, 1.0) * 255.0).round() as u8)
}

/// Khronos PBR Neutral, as `include/tonemap.glsl`.
fn pbr_neutral(color: [f32; 3]) -> [f32; 3] {
    const START_COMPRESSION: f32 = 0.8 - 0.04;
    const ROOM: f32 = 1.0 - START_COMPRESSION;
    const DESATURATION: f32 = 0.15;
    let least = color.into_iter().fold(f32::INFINITY, f32::min);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = color.map(|c| c - offset);
    let peak = color.into_iter().fold(f32::NEG_INFINITY, f32::max);
    if peak < START_COMPRESSION {
        return color;
    }
    let new_peak = 1.0 - ROOM * ROOM / (peak + ROOM - START_COMPRESSION);
    let gray = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|c| {
        let compressed = c * (new_peak / peak);
        compressed + (new_peak - compressed) * gray
    })
}

fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::display_rgb8;
    use afterlight_oracle::tonemap;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bytes_are_those_of_the_twin_in_f64(radiance in prop::array::uniform3(0.0f32..8.0)) {
            let expected = tonemap::display_rgb8(glam::DVec3::from_array(radiance.map(f64::from)));
            for (found, expected) in display_rgb8(radiance).into_iter().zip(expected) {
                prop_assert!(found.abs_diff(expected) <= 1, "{found} against {expected} of {radiance:?}");
            }
        }
    }

    #[test]
    fn black_and_white_are_exact() {
        assert_eq!(display_rgb8([0.0; 3]), [0; 3]);
        assert_eq!(display_rgb8([0.01; 3]), tonemap::display_rgb8(glam::DVec3::splat(0.01)));
        assert_eq!(display_rgb8([1e6; 3]), [255; 3]);
    }
}
