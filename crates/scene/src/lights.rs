//! Seeded point lights: the same for every program that follows the recipe.

use glam::Vec3;

use crate::{Aabb, Light, LightKind, rng::SplitMix64};

/// How many lights of the seeded kind reach a point of the box on average.
const OVERLAP: f32 = 8.0;

/// Thickness that a flat box is given, as a fraction of its longest extent: lights in the very
/// plane of a floor would reach it at grazing angles only.
const FLAT_BOX_THICKNESS: f32 = 0.1;

/// Makes `count` point lights in a box: position uniform in the box, full saturation hue, range
/// `r = (8 V / (count 4/3 π))^(1/3)` so that about 8 overlap at a point, `color r²` candela.
///
/// A SplitMix64 generator from `seed` gives four numbers a light: x, y, z as fractions of the box from its
/// minimum, and the hue. All arithmetic is `f32`.
///
/// The recipe needs a volume. A box that is flat along an axis is taken to be thicker there, by a tenth of
/// its longest extent, about its own plane; an empty, point-like or infinite box is taken to be the
/// cube of 1 m about its centre (the origin where that is not finite).
pub fn seeded_lights(bounds_ws: &Aabb, count: u32, seed: u64) -> Vec<Light> {
    let bounds_ws = with_volume(bounds_ws);
    let size_m = bounds_ws.size();
    let volume_m3 = size_m.x * size_m.y * size_m.z;
    let range_m = (OVERLAP * volume_m3 / (count as f32 * (4.0 / 3.0) * std::f32::consts::PI)).cbrt();
    let mut rng = SplitMix64::new(seed);
    (0..count)
        .map(|_| {
            let fraction = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            Light {
                kind: LightKind::Point,
                position_ws: bounds_ws.min + fraction * size_m,
                direction_ws: Vec3::NEG_Z,
                intensity: hue_color(rng.next_f32()) * (range_m * range_m),
                range_m,
            }
        })
        .collect()
}

/// Linear colour of a hue in [0, 1): each channel in [½, 1].
pub fn hue_color(hue: f32) -> Vec3 {
    Vec3::from_array([5.0, 3.0, 1.0].map(|n: f32| {
        let k = (n + 6.0 * hue) % 6.0;
        1.0 - 0.5 * k.min(4.0 - k).clamp(0.0, 1.0)
    }))
}

/// The box itself where its volume is positive and finite, else the replacement that [`seeded_lights`] describes.
fn with_volume(bounds_ws: &Aabb) -> Aabb {
    let size_m = bounds_ws.size();
    let volume_m3 = size_m.x * size_m.y * size_m.z;
    if volume_m3.is_normal() && bounds_ws.center().is_finite() {
        return *bounds_ws;
    }
    let longest_m = size_m.max_element();
    let center_ws = bounds_ws.center();
    let center_ws = if center_ws.is_finite() { center_ws } else { Vec3::ZERO };
    // the cube of the longest extent must be finite too
    if !(1e-9..1e12).contains(&longest_m) {
        return Aabb { min: center_ws - 0.5, max: center_ws + 0.5 };
    }
    let half_m = 0.5 * size_m.max(Vec3::splat(FLAT_BOX_THICKNESS * longest_m));
    Aabb { min: center_ws - half_m, max: center_ws + half_m }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Aabb = Aabb { min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(3.0, 2.0, 5.0) };

    #[test]
    fn hues_are_the_six_corners() {
        let expect = [
            (0.0, [1.0, 0.5, 0.5]),
            (1.0 / 6.0, [1.0, 1.0, 0.5]),
            (2.0 / 6.0, [0.5, 1.0, 0.5]),
            (0.5, [0.5, 1.0, 1.0]),
            (4.0 / 6.0, [0.5, 0.5, 1.0]),
            (5.0 / 6.0, [1.0, 0.5, 1.0]),
        ];
        for (hue, color) in expect {
            assert!(hue_color(hue).abs_diff_eq(Vec3::from_array(color), 1e-6), "{hue}: {}", hue_color(hue));
        }
    }

    /// Fractions by hand: SplitMix64 of state 1 begins 0x910a2dec89025cc1, 0xbeeb8da1658eec67,
    /// 0xf893a2eefb32555e, 0x71c18690ee42c90b; the upper 24 bits of each over 2^24.
    #[test]
    fn first_light_is_the_one_computed_by_hand() {
        let lights = seeded_lights(&BOX, 10, 1);
        assert_eq!(lights.len(), 10);
        let fraction = |upper: u32| upper as f32 / 16_777_216.0;
        let expected = Vec3::new(
            -1.0 + 4.0 * fraction(0x91_0a2d),
            2.0 * fraction(0xbe_eb8d),
            2.0 + 3.0 * fraction(0xf8_93a2),
        );
        assert_eq!(lights[0].position_ws, expected);
        // V = 24: r = (8·24 / (10·4.18879))^(1/3) = 4.583662^(1/3) = 1.661132
        assert!((lights[0].range_m - 1.661_132).abs() < 2e-6, "{}", lights[0].range_m);
        // hue 0x71c186/2^24 = 0.444359: k = 1.666155 (red), 5.666155 (green), 3.666155 (blue)
        let color = lights[0].intensity / (lights[0].range_m * lights[0].range_m);
        assert!(color.abs_diff_eq(Vec3::new(0.5, 1.0, 0.833_08), 1e-5), "{color}");
    }

    #[test]
    fn boxes_without_volume_give_finite_lights() {
        let flat = Aabb { min: Vec3::new(-5.0, 1.0, -5.0), max: Vec3::new(5.0, 1.0, 5.0) };
        let point = Aabb { min: Vec3::ONE, max: Vec3::ONE };
        let endless = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
        for bounds in [flat, point, endless, Aabb::EMPTY] {
            for light in seeded_lights(&bounds, 16, 3) {
                assert!(light.range_m > 0.0 && light.range_m.is_finite(), "{bounds:?}: {light:?}");
                assert!(
                    light.position_ws.is_finite() && light.intensity.is_finite(),
                    "{bounds:?}: {light:?}"
                );
            }
        }
        assert!(seeded_lights(&flat, 1000, 1).iter().all(|l| (l.position_ws.y - 1.0).abs() <= 0.5));
    }

    #[test]
    fn no_lights_are_no_lights() {
        assert!(seeded_lights(&BOX, 0, 1).is_empty());
    }
}
