// Where a visible triangle stands in the triangle buffer: a bit a triangle of the scene, counts before each word of 32, counts before each
// block of words.
#ifndef AFTERLIGHT_TRIANGLE_INDEX
#define AFTERLIGHT_TRIANGLE_INDEX
#include "surfaces/triangles/blocks.glsl"

layout(set = 0, binding = 17, scalar) readonly buffer VisibleBits {
    uint visible_bits[];
};
// Visible triangles before the word, within its block.
layout(set = 0, binding = 18, scalar) readonly buffer VisibleBefore {
    uint visible_before[];
};
// Visible triangles before the block.
layout(set = 0, binding = 19, scalar) readonly buffer BlockBase {
    uint block_base[];
};

uint triangle_index(uint id) {
    uint word = id >> 5;
    uint below = visible_bits[word] & ((1u << (id & 31u)) - 1u);
    return block_base[word / BLOCK_WORDS] + visible_before[word] + uint(bitCount(below));
}

#endif
