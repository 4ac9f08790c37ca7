// Counts pairs of a light and a surface in the place of radiance, for debug views. x: pairs that were tested; y: those of them that are
// lit, where the surface lies within the light's range. Every sum over lights, in a loop or by blending, then becomes a count.
#ifndef AFTERLIGHT_LIGHT_PAIRS
#define AFTERLIGHT_LIGHT_PAIRS

// 1 where pairs are counted; CELL_COLORS where the cells of lights/cells/ are shown instead.
layout(constant_id = 23) const uint LIGHT_PAIRS = 0u;
const uint CELL_COLORS = 2u;

// The value of one pair. It is small so that RGBA16F holds up to 67 million pairs a pixel instead of 65,504. Twin: LIGHT_PAIR in crates/frame/src/views.rs.
const float LIGHT_PAIR = 1.0 / 1024.0;

vec3 light_pair(bool lit) {
    return vec3(LIGHT_PAIR, lit ? LIGHT_PAIR : 0.0, 0.0);
}

#endif
