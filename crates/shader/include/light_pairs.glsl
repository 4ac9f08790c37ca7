// Counts of pairs of a light and a surface in the place of radiance, for views of them: x, pairs that were tested; y, those of them
// that are lit, the light within its range of the surface. Every sum over lights, in a loop or by blending, is then a count.
#ifndef AFTERLIGHT_LIGHT_PAIRS
#define AFTERLIGHT_LIGHT_PAIRS

// 1 where pairs are counted; CELL_COLORS where the cells of clusters/ are shown instead.
layout(constant_id = 23) const uint LIGHT_PAIRS = 0u;
const uint CELL_COLORS = 2u;

// What one pair is: RGBA16F then ends at 67 million pairs a pixel, not at 65,504. Twin: LIGHT_PAIR in techniques/src/view/light_pairs.rs.
const float LIGHT_PAIR = 1.0 / 1024.0;

vec3 light_pair(bool lit) {
    return vec3(LIGHT_PAIR, lit ? LIGHT_PAIR : 0.0, 0.0);
}

#endif
