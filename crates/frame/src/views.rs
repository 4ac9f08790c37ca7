//! Debug views: their names, their numbers in shaders, and the pairs of lights and surfaces that two of them count.
//!
//! A view is an image of display colours in place of radiance; it is shown without tone mapping.

use half::f16;

/// The image itself.
pub const FINAL: &str = "final";

/// Shading runs a pixel.
pub const INVOCATIONS: &str = "invocations";

/// Shading samples that a pixel keeps: black 1, red as many as it has visibility samples (Fridvalszky and Tóth 2020,
/// Figure 5).
pub const SAMPLE_USAGE: &str = "sample-usage";

/// Pixels that are shaded at more than pixel rate.
pub const EDGES: &str = "edges";

/// Pixels whose weights sum to more than the number of samples: red; to less: blue; others are black.
pub const WEIGHTS: &str = "weights";

/// Visibility samples of the image that refer to the same triangle's record (Schied and Dachsbacher 2015, Figure 1, right).
pub const TRIANGLE_SHARING: &str = "triangle-sharing";

/// Distance of positions from triangle records to those that the rasteriser interpolates (Schied and Dachsbacher 2015,
/// Figure 6, left).
pub const ATTRIBUTE_ERROR: &str = "attribute-error";

/// Difference of base colours that are looked up by texture coordinates from triangle records and by the rasteriser's
/// (Schied and Dachsbacher 2015, Figure 6, right).
pub const TEXTURE_ERROR: &str = "texture-error";

/// Views of techniques whose samples refer to records of a triangle buffer.
pub const TRIANGLES: &[&str] =
    &[SAMPLE_USAGE, INVOCATIONS, EDGES, WEIGHTS, TRIANGLE_SHARING, ATTRIBUTE_ERROR, TEXTURE_ERROR];

/// Whether a view shows the triangle records that the samples of a pixel refer to.
pub fn is_of_triangles(view: &str) -> bool {
    view == TRIANGLE_SHARING || compares_triangles(view)
}

/// Whether a view compares triangle records to what the rasteriser shows.
pub fn compares_triangles(view: &str) -> bool {
    [ATTRIBUTE_ERROR, TEXTURE_ERROR].contains(&view)
}

/// Number of a view in `surfaces/shade/shade.glsl`.
pub fn number(view: &str) -> u32 {
    match view {
        SAMPLE_USAGE => 1,
        INVOCATIONS => 2,
        EDGES => 3,
        WEIGHTS => 4,
        _ => 0,
    }
}

/// Pairs of a light and a surface that the illumination model was asked for.
pub const LIGHT_COUNT: &str = "light-count";

/// Pairs of a light and a surface that were tested and are not lit.
pub const LIGHT_ERROR: &str = "light-error";

/// Views of any technique whose image is a sum of `light_radiance`.
pub const LIGHT_PAIRS: &[&str] = &[LIGHT_COUNT, LIGHT_ERROR];

/// The cells, tiles or clusters, that surfaces find their lights by: a colour each; white is a surface that none holds.
pub const CLUSTERS: &str = "clusters";

/// How far the surface of each pixel has moved on screen since the frame before, in frames of a flight; of any technique.
pub const VELOCITY: &str = "velocity";

/// What one pair adds to the image; twin: `include/light_pairs.glsl`.
pub const LIGHT_PAIR: f64 = 1.0 / 1024.0;

/// Counts that 16-bit floats hold in full: 11 bits.
const EXACT_COUNTS: f64 = 2048.0;

/// Whether a view counts pairs of lights and surfaces.
pub fn counts_light_pairs(view: &str) -> bool {
    LIGHT_PAIRS.contains(&view)
}

/// Whether a view shows sums over lights that are not radiance, of surfaces alone.
pub fn replaces_light(view: &str) -> bool {
    light_pairs_constant(view) > 0
}

/// Specialization constant of `include/light_pairs.glsl`.
pub fn light_pairs_constant(view: &str) -> u32 {
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
    pub fn of(rgba16f: &[u8], samples: u32) -> Self {
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
