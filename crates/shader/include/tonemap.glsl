// Linear radiance to display: Khronos PBR Neutral, then the sRGB transfer function.
//
// CPU twin: crates/oracle/src/tonemap.rs. Source: Khronos PBR Neutral Tone Mapper specification.
#ifndef AFTERLIGHT_TONEMAP
#define AFTERLIGHT_TONEMAP

vec3 pbr_neutral(vec3 color) {
    const float START_COMPRESSION = 0.8 - 0.04;
    const float DESATURATION = 0.15;
    float least = min(color.r, min(color.g, color.b));
    float offset = least < 0.08 ? least - 6.25 * least * least : 0.04;
    color -= offset;
    float peak = max(color.r, max(color.g, color.b));
    if (peak < START_COMPRESSION) {
        return color;
    }
    const float D = 1.0 - START_COMPRESSION;
    float new_peak = 1.0 - D * D / (peak + D - START_COMPRESSION);
    color *= new_peak / peak;
    float g = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    return mix(color, vec3(new_peak), g);
}

vec3 srgb_from_linear(vec3 c) {
    vec3 low = c * 12.92;
    vec3 high = 1.055 * pow(max(c, vec3(0.0)), vec3(1.0 / 2.4)) - 0.055;
    return mix(high, low, lessThanEqual(c, vec3(0.0031308)));
}

vec3 linear_from_srgb(vec3 c) {
    vec3 low = c / 12.92;
    vec3 high = pow((max(c, vec3(0.0)) + 0.055) / 1.055, vec3(2.4));
    return mix(high, low, lessThanEqual(c, vec3(0.04045)));
}

#endif
