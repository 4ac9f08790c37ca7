//! Pairs of a light and a surface that a technique tests, and those of them that are lit.
//!
//! Where they are counted, `light_radiance` and what stands beside it in `include/shading.glsl` give counts in the place of radiance, and
//! nothing else gives any: the image that a technique ends in, whatever way it sums lights, holds two counts a pixel.

use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole, gpu::vk};
use half::f16;

use crate::{error::TechniqueError, frame::Frame};

/// Pairs of a light and a surface that the illumination model was asked for.
pub const LIGHT_COUNT: &str = "light-count";
/// Pairs of a light and a surface that were tested and are not lit.
pub const LIGHT_ERROR: &str = "light-error";
/// Views of any technique whose image is a sum of `light_radiance`.
pub const LIGHT_PAIRS: &[&str] = &[LIGHT_COUNT, LIGHT_ERROR];

/// The cells, tiles or clusters, that surfaces find their lights by: a colour each; white is a surface that none holds.
pub const CLUSTERS: &str = "clusters";

/// What one pair adds to the image; twin: `include/light_pairs.glsl`.
pub(crate) const LIGHT_PAIR: f64 = 1.0 / 1024.0;

/// Counts that 16-bit floats hold in full: 11 bits.
const EXACT_COUNTS: f64 = 2048.0;

/// Whether a view counts pairs of lights and surfaces.
pub fn counts_light_pairs(view: &str) -> bool {
    LIGHT_PAIRS.contains(&view)
}

/// Whether a view shows sums over lights that are not radiance, of surfaces alone.
pub(crate) fn replaces_light(view: &str) -> bool {
    light_pairs_constant(view) > 0
}

/// Specialization constant of `include/light_pairs.glsl`.
pub(crate) fn light_pairs_constant(view: &str) -> u32 {
    match view {
        CLUSTERS => 2,
        view => u32::from(counts_light_pairs(view)),
    }
}

/// Pairs of a light and a surface over a frame. At several samples a pixel counts the mean of its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightPairs {
    /// Pairs that the illumination model was asked for.
    pub tested: f64,
    /// Pairs of them in which the light's range holds the surface, in shadow or not, before its face or behind.
    pub lit: f64,
    /// Pixels of so many pairs that 16-bit floats round their counts, by 2^-10 of them at most where a shader sums; where blending sums,
    /// counts end at 2,048.
    pub rounded_pixels: u64,
}

impl LightPairs {
    /// Sums an image of RGBA16F pixels, `samples` each, in 64 bits.
    pub(crate) fn of(rgba16f: &[u8], samples: u32) -> Self {
        let count = |half: &[u8]| f16::from_le_bytes([half[0], half[1]]).to_f64() / LIGHT_PAIR;
        let mut sum = Self::default();
        for pixel in rgba16f.chunks_exact(8) {
            let tested = count(&pixel[..2]);
            sum.tested += tested;
            sum.lit += count(&pixel[2..4]);
            sum.rounded_pixels += u64::from(tested * f64::from(samples) >= EXACT_COUNTS);
        }
        sum
    }
}

/// Declares the pass that turns the counts into colours.
///
/// # Errors
/// A shader that is not compiled in.
pub(crate) fn light_pair_colors(
    graph: &mut Graph,
    frame: &Frame<'_>,
    counts: &ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let target = graph.image(
        "view/light pairs",
        BufferRole::Targets,
        frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
    );
    let mut pass =
        frame.compute(graph, "view/light-pairs", PassRole::Upkeep, &frame.shader("view/light_pairs.comp")?);
    pass.constant("LIGHT_ERROR", u32::from(frame.shows(LIGHT_ERROR)));
    pass.read("light_pairs", counts);
    let target = pass.write("hdr", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_summed_in_64_bits() {
        let pixel = |tested: f64, lit: f64| {
            [tested * LIGHT_PAIR, lit * LIGHT_PAIR, 0.0, 1.0].map(|c| f16::from_f64(c).to_le_bytes()).concat()
        };
        let image =
            [pixel(2047.0, 3.0), pixel(2048.0, 0.0), pixel(0.0, 0.0), pixel(100_000.0, 0.25)].concat();
        let found = LightPairs::of(&image, 1);
        // Beyond 65,504 and rounded: 11 bits of 100,000 are 99,968 or 100,032.
        assert!((found.tested - 104_095.0).abs() <= 32.0, "{found:?}");
        assert_eq!((found.lit, found.rounded_pixels), (3.25, 2));
        assert_eq!(LightPairs::of(&image, 4).rounded_pixels, 3, "quarters take two bits more");
    }
}
