// Sums the draws' counts: the place of each draw's first visible triangle. One group.
//
// In: VisibleOfDraw. Out: DrawBaseOut; TriangleCount: triangles in all, and those without room.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 256) in;
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

shared uint sums[256];

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint a_lane = (DRAWS + 255u) / 256u;
    uint first = min(lane * a_lane, DRAWS), end = min(first + a_lane, DRAWS);
    uint sum = 0u;
    for (uint draw = first; draw < end; ++draw) {
        sum += visible_of_draw[draw];
    }
    sums[lane] = sum;
    barrier();
    // Hillis and Steele's inclusive scan.
    for (uint step = 1u; step < 256u; step *= 2u) {
        uint other = lane >= step ? sums[lane - step] : 0u;
        barrier();
        sums[lane] += other;
        barrier();
    }
    uint base = sums[lane] - sum;
    for (uint draw = first; draw < end; ++draw) {
        draw_base_out[draw] = base;
        base += visible_of_draw[draw];
    }
    if (lane == 255u) {
        triangles_needed = sums[255];
        triangles_dropped = max(sums[255], TRIANGLE_CAPACITY) - TRIANGLE_CAPACITY;
    }
}
