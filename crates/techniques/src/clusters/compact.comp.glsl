// Lists the marked clusters in ascending order and counts those before each word of marks. One group.
//
// In: ClusterBits. Out: KeptBeforeOut; KeptOut: cluster of each place; ClusterCount: clusters in all, and those without room;
// ClusterGroups: groups for a group a kept cluster.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "group_sum.glsl"
#include "clusters/groups.glsl"

layout(set = 0, binding = 8, scalar) readonly buffer ClusterBits {
    uint cluster_bits[];
};
layout(set = 0, binding = 9, scalar) writeonly buffer KeptBeforeOut {
    uint kept_before_out[];
};
layout(set = 0, binding = 10, scalar) writeonly buffer KeptOut {
    uint kept_out[];
};
layout(set = 0, binding = 11, scalar) writeonly buffer ClusterCount {
    uint clusters_needed;
    uint clusters_dropped;
};
layout(set = 0, binding = 12, scalar) writeonly buffer ClusterGroups {
    uint cluster_groups[3];
};
layout(constant_id = 10) const uint WORDS = 0u;
layout(constant_id = 11) const uint CLUSTER_CAPACITY = 0u;

void main() {
    uvec2 words = elements_of_thread(WORDS);
    uint own = 0u;
    for (uint w = words.x; w < words.y; ++w) {
        own += uint(bitCount(cluster_bits[w]));
    }
    uint total;
    uint place = sum_before(own, total);
    for (uint w = words.x; w < words.y; ++w) {
        kept_before_out[w] = place;
        for (uint bits = cluster_bits[w]; bits != 0u; bits &= bits - 1u) {
            if (place < CLUSTER_CAPACITY) {
                kept_out[place] = w * 32u + uint(findLSB(bits));
            }
            ++place;
        }
    }
    if (gl_LocalInvocationID.x == 0u) {
        clusters_needed = total;
        clusters_dropped = max(total, CLUSTER_CAPACITY) - CLUSTER_CAPACITY;
        uint groups = min(total, CLUSTER_CAPACITY);
        cluster_groups[0] = min(groups, GROUPS_A_ROW);
        cluster_groups[1] = (groups + GROUPS_A_ROW - 1u) / GROUPS_A_ROW;
        cluster_groups[2] = 1u;
    }
}
