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

// Blue 1e-8 and less, green 1e-7, yellow 1e-6, red 1e-5, white 1e-4 and more.
vec3 error_color(float error) {
    return heat(1.0 + log2(max(error, 1e-8) / 1e-8) / log2(10.0));
}

#endif
