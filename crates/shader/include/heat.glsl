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

// Black 0, blue 1, green 2, yellow 4, red 8, white 16 and more.
vec3 invocations_color(uint count) {
    const vec3 STOPS[6] = vec3[](vec3(0.0), vec3(0.0, 0.0, 0.6), vec3(0.0, 0.6, 0.1), vec3(0.9, 0.8, 0.0),
                                 vec3(0.8, 0.0, 0.0), vec3(1.0));
    if (count == 0u) {
        return STOPS[0];
    }
    float t = 1.0 + min(log2(float(count)), 4.0);
    uint i = min(uint(t), 4u);
    return mix(STOPS[i], STOPS[i + 1u], t - float(i));
}

#endif
