// Colours of debug views, display-linear, [0, 1].
#ifndef AFTERLIGHT_HEAT
#define AFTERLIGHT_HEAT

// Black 1, red `all` (Fridvalszky and Toth 2020, Figure 5); a pixel without a sample is dark blue.
vec3 sample_usage_color(uint used, uint all) {
    if (used == 0u) {
        return vec3(0.0, 0.0, 0.05);
    }
    return vec3(float(used - 1u) / float(max(all, 2u) - 1u), 0.0, 0.0);
}

// Black at 0, blue at 1, green at 2, yellow at 3, red at 4, white at 5; interpolated linearly in between.
vec3 heat(float t) {
    const vec3 STOPS[6] = vec3[](vec3(0.0), vec3(0.0, 0.0, 0.6), vec3(0.0, 0.6, 0.1), vec3(0.9, 0.8, 0.0),
                                 vec3(0.8, 0.0, 0.0), vec3(1.0));
    t = clamp(t, 0.0, 5.0);
    uint i = min(uint(t), 4u);
    return mix(STOPS[i], STOPS[i + 1u], t - float(i));
}

// Black 0, blue 1, green 2, yellow 4, red 8, white 16 and more.
vec3 invocations_color(uint count) {
    return count == 0u ? vec3(0.0) : heat(1.0 + log2(float(count)));
}

// Blue 1, green 2^4, yellow 2^8, red 2^12, white 2^16 and more.
vec3 sharing_color(float log2_count) {
    return heat(1.0 + log2_count / 4.0);
}

// Black 0, blue 1, green 8 (as many as seeded lights reach a surface), yellow 64, red 512, white 4,096 and more; means over
// samples can be below 1: these are interpolated linearly from black.
vec3 pairs_color(float count) {
    return heat(count < 1.0 ? count : 1.0 + log2(count) / 3.0);
}

// Hue: red to the right, then yellow, green down-left and so on, clockwise round to magenta up-right. Brightness: black 1/16 of a pixel and
// less, full 64 pixels and more, logarithmic.
vec3 velocity_color(vec2 velocity_px) {
    float moved_px = length(velocity_px);
    if (moved_px == 0.0) {
        return vec3(0.0);
    }
    float turn = atan(velocity_px.y, velocity_px.x) / 6.283185307;
    vec3 hue = clamp(abs(fract(turn + vec3(0.0, 2.0, 1.0) / 3.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
    return hue * clamp((log2(moved_px) + 4.0) / 10.0, 0.0, 1.0);
}

// Blue 1e-8 and less, green 1e-7, yellow 1e-6, red 1e-5, white 1e-4 and more.
vec3 error_color(float error) {
    return heat(1.0 + log2(max(error, 1e-8) / 1e-8) / log2(10.0));
}

#endif
