// Where a visible triangle stands in the triangle buffer: a bit a triangle of the scene, counts before each word of 32.
#ifndef AFTERLIGHT_TRIANGLE_INDEX
#define AFTERLIGHT_TRIANGLE_INDEX
#include "scene.glsl"

const uint WORDS_A_DRAW = (1u << TRIANGLE_BITS) / 32u;

layout(set = 0, binding = 17, scalar) readonly buffer VisibleBits {
    uint visible_bits[];
};
// Visible triangles before the word, within its draw.
layout(set = 0, binding = 18, scalar) readonly buffer VisibleBefore {
    uint visible_before[];
};
// Visible triangles before the draw.
layout(set = 0, binding = 19, scalar) readonly buffer DrawBase {
    uint draw_base[];
};

bool is_visible(uint id) {
    return (visible_bits[id >> 5] >> (id & 31u) & 1u) != 0u;
}

uint triangle_index(uint id) {
    uint below = visible_bits[id >> 5] & ((1u << (id & 31u)) - 1u);
    return draw_base[id >> TRIANGLE_BITS] + visible_before[id >> 5] + uint(bitCount(below));
}

#endif
