// Counts the visible triangles of each draw, and those before each of its words. A thread a draw.
//
// In: VisibleBits. Out: WordCounts (before each word), DrawCountsOut. Dispatch: draws / 64.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "scene.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 8, scalar) readonly buffer VisibleBits {
    uint visible_bits[];
};
layout(set = 0, binding = 9, scalar) writeonly buffer WordCounts {
    uint word_counts[];
};
layout(set = 0, binding = 10, scalar) writeonly buffer VisibleOfDraw {
    uint visible_of_draw[];
};
layout(constant_id = 10) const uint DRAWS = 0u;

void main() {
    uint draw = gl_GlobalInvocationID.x;
    if (draw >= DRAWS) {
        return;
    }
    const uint WORDS = (1u << TRIANGLE_BITS) / 32u;
    uint count = 0u;
    for (uint w = draw * WORDS; w < (draw + 1u) * WORDS; ++w) {
        word_counts[w] = count;
        count += uint(bitCount(visible_bits[w]));
    }
    visible_of_draw[draw] = count;
}
