// Sums the draws' counts: the place of each draw's first visible triangle. One group.
//
// In: VisibleOfDraw. Out: DrawBaseOut; TriangleCount: triangles in all, and those without room.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "group_sum.glsl"

layout(set = 0, binding = 8, scalar) readonly buffer VisibleOfDraw {
    uint visible_of_draw[];
};
layout(set = 0, binding = 9, scalar) writeonly buffer DrawBaseOut {
    uint draw_base_out[];
};
layout(set = 0, binding = 10, scalar) writeonly buffer TriangleCount {
    uint triangles_needed;
    uint triangles_dropped;
};
layout(constant_id = 10) const uint DRAWS = 0u;
layout(constant_id = 11) const uint TRIANGLE_CAPACITY = 0u;

void main() {
    uvec2 draws = elements_of_thread(DRAWS);
    uint own = 0u;
    for (uint draw = draws.x; draw < draws.y; ++draw) {
        own += visible_of_draw[draw];
    }
    uint total;
    uint base = sum_before(own, total);
    for (uint draw = draws.x; draw < draws.y; ++draw) {
        draw_base_out[draw] = base;
        base += visible_of_draw[draw];
    }
    if (gl_LocalInvocationID.x == 0u) {
        triangles_needed = total;
        triangles_dropped = max(total, TRIANGLE_CAPACITY) - TRIANGLE_CAPACITY;
    }
}
