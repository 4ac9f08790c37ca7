// Writes the lights that touch each kept cluster, in ascending order. A group a kept cluster.
//
// In: KeptClusters, KeptCount, ClusterSlices, ListBegins. Out: ListsOut. Dispatch: ClusterGroups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "clusters/cull.glsl"

layout(set = 0, binding = 10, scalar) readonly buffer ListBegins {
    uint list_begins[];
};
layout(set = 0, binding = 11, scalar) writeonly buffer ListsOut {
    uint lists_out[];
};
layout(constant_id = 12) const uint LIST_CAPACITY = 0u;

// Writes the lights of one word of a batch, `first` that of its lowest bit.
void write_word(uint bits, uint first, uint at) {
    for (; bits != 0u; bits &= bits - 1u) {
        if (at < LIST_CAPACITY) {
            lists_out[at] = first + uint(findLSB(bits));
        }
        ++at;
    }
}

void main() {
    uint place;
    if (!kept_place(place)) {
        return;
    }
    Cluster c = cluster_at(kept_clusters[place]);
    uint begin = list_begins[place];
    for (uint first = frame.unbounded_light_count; first < frame.light_count; first += BATCH_LIGHTS) {
        cull_batch(c, first);
        uint before = 0u, all = 0u;
        for (uint w = 0u; w < BATCH_WORDS; ++w) {
            uint count = uint(bitCount(touching[w]));
            before += w < gl_LocalInvocationIndex ? count : 0u;
            all += count;
        }
        if (gl_LocalInvocationIndex < BATCH_WORDS) {
            write_word(touching[gl_LocalInvocationIndex], first + 32u * gl_LocalInvocationIndex, begin + before);
        }
        begin += all;
    }
}
