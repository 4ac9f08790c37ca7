// Where each kept cluster's list begins, and after the last where it ends. One group.
//
// In: ListLengths, KeptCount. Out: ListBeginsOut; ListCount: entries of all lists, and those without room.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "group_sum.glsl"

layout(set = 0, binding = 8, scalar) readonly buffer ListLengths {
    uint list_lengths[];
};
layout(set = 0, binding = 9, scalar) readonly buffer KeptCount {
    uint kept_needed;
    uint kept_dropped;
};
layout(set = 0, binding = 10, scalar) writeonly buffer ListBeginsOut {
    uint list_begins_out[];
};
layout(set = 0, binding = 11, scalar) writeonly buffer ListCount {
    uint entries_needed;
    uint entries_dropped;
};
layout(constant_id = 11) const uint CLUSTER_CAPACITY = 0u;
layout(constant_id = 12) const uint LIST_CAPACITY = 0u;

void main() {
    uint count = min(kept_needed, CLUSTER_CAPACITY);
    uvec2 lists = elements_of_thread(count);
    uint own = 0u;
    for (uint i = lists.x; i < lists.y; ++i) {
        own = saturating_add(own, list_lengths[i]);
    }
    uint total;
    uint begin = sum_before(own, total);
    for (uint i = lists.x; i < lists.y; ++i) {
        list_begins_out[i] = begin;
        begin = saturating_add(begin, list_lengths[i]);
    }
    if (gl_LocalInvocationID.x == 0u) {
        list_begins_out[count] = total;
        entries_needed = total;
        entries_dropped = max(total, LIST_CAPACITY) - LIST_CAPACITY;
    }
}
