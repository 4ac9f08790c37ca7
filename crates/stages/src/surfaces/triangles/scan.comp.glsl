// Sums the blocks' counts: the place of each block's first visible triangle. One group: a block is 32 draws, so that a thread has a block
// or two of a scene of 10,000 draws.
//
// In: VisibleOfBlock. Out: BlockBaseOut; TriangleCount: triangles in all, and those without room; DispatchGroups of the derivative pass.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "group_sum.glsl"
#include "surfaces/triangles/groups.glsl"

layout(set = 0, binding = 8, scalar) readonly buffer VisibleOfBlock {
    uint visible_of_block[];
};
layout(set = 0, binding = 9, scalar) writeonly buffer BlockBaseOut {
    uint block_base_out[];
};
layout(set = 0, binding = 10, scalar) writeonly buffer TriangleCount {
    uint triangles_needed;
    uint triangles_dropped;
};
layout(set = 0, binding = 11, scalar) writeonly buffer DispatchGroups {
    uvec3 dispatch_groups;
};
layout(constant_id = 10) const uint BLOCKS = 0u;
// No specialization constant: a buffer that grows makes no pipeline anew.
layout(push_constant, scalar) uniform Push {
    uint triangle_capacity;
};

void main() {
    uvec2 blocks = elements_of_thread(BLOCKS);
    uint own = 0u;
    for (uint block = blocks.x; block < blocks.y; ++block) {
        own = saturating_add(own, visible_of_block[block]);
    }
    uint total;
    uint base = sum_before(own, total);
    for (uint block = blocks.x; block < blocks.y; ++block) {
        block_base_out[block] = base;
        base += visible_of_block[block];
    }
    if (gl_LocalInvocationID.x == 0u) {
        triangles_needed = total;
        triangles_dropped = max(total, triangle_capacity) - triangle_capacity;
        dispatch_groups = derivative_groups(min(total, triangle_capacity));
    }
}
