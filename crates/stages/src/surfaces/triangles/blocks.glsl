// The bits of visible triangles in blocks, each counted by a group: 1,024 words, 32 draws.
#ifndef AFTERLIGHT_BLOCKS
#define AFTERLIGHT_BLOCKS
#include "scene.glsl"

const uint WORDS_A_DRAW = (1u << TRIANGLE_BITS) / 32u;
const uint BLOCK_WORDS = 1024u;     // BLOCK_DRAWS of mod.rs; four words for each thread of group_sum.glsl

#endif
