//! From radiance to display: Khronos PBR Neutral and the sRGB transfer function.

use glam::DVec3;

/// Khronos PBR Neutral (Khronos PBR Neutral Tone Mapper specification, 2024): colours below 0.8 − F90 keep their
/// hue and saturation but for an offset of at most 0.04, brighter ones are compressed and desaturated.
pub fn pbr_neutral(color: DVec3) -> DVec3 {
    const F90: f64 = 0.04;
    const START: f64 = 0.8 - F90;
    const DESATURATION: f64 = 0.15;
    let least = color.min_element();
    let offset = if least <= 2.0 * F90 { least - least * least / (4.0 * F90) } else { F90 };
    let color = color - offset;
    let peak = color.max_element();
    if peak <= START {
        return color;
    }
    let room = 1.0 - START;
    let compressed = 1.0 - room * room / (peak + room - START);
    let gray = 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    (color * (compressed / peak)).lerp(DVec3::splat(compressed), 1.0 - gray)
}

/// The sRGB transfer function (IEC 61966-2-1).
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_from_linear`].
pub fn linear_from_srgb(srgb: f64) -> f64 {
    if srgb <= 0.040_45 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// The bytes that a linear radiance is shown as.
pub fn display_rgb8(radiance: DVec3) -> [u8; 3] {
    pbr_neutral(radiance).to_array().map(|c| (srgb_from_linear(c).clamp(0.0, 1.0) * 255.0).round() as u8)
}
