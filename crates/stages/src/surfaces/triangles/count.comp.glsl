// Counts the visible triangles before each word of 32, within a block of words, and those of each block. A group a block, four words a
// thread.
//
// In: VisibleBits. Out: VisibleBeforeOut, VisibleOfBlock. Dispatch: blocks, in rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "group_rows.glsl"
#include "group_sum.glsl"
#include "surfaces/triangles/blocks.glsl"

layout(set = 0, binding = 8, scalar) readonly buffer VisibleBits {
    uint visible_bits[];
};
layout(set = 0, binding = 9, scalar) writeonly buffer VisibleBeforeOut {
    uint visible_before_out[];
};
layout(set = 0, binding = 10, scalar) writeonly buffer VisibleOfBlock {
    uint visible_of_block[];
};
layout(constant_id = 10) const uint DRAWS = 0u;

const uint WORDS_A_THREAD = 4u;

void main() {
    uint block = group_number();
    uint first = block * BLOCK_WORDS + gl_LocalInvocationID.x * WORDS_A_THREAD;
    uint end = min(first + WORDS_A_THREAD, DRAWS * WORDS_A_DRAW);
    uint own = 0u;
    for (uint word = first; word < end; ++word) {
        own += uint(bitCount(visible_bits[word]));
    }
    uint total;
    uint before = sum_before(own, total);
    for (uint word = first; word < end; ++word) {
        visible_before_out[word] = before;
        before += uint(bitCount(visible_bits[word]));
    }
    if (gl_LocalInvocationID.x == 0u && first < DRAWS * WORDS_A_DRAW) {
        visible_of_block[block] = total;
    }
}
