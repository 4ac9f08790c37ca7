// Counts the lights that touch each kept cluster, those without an end left out. A group a kept cluster.
//
// In: KeptClusters, KeptCount, ClusterSlices. Out: ListLengths. Dispatch: ClusterGroups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "clusters/cull.glsl"

layout(set = 0, binding = 10, scalar) writeonly buffer ListLengths {
    uint list_lengths[];
};

shared uint length_of_list;

void main() {
    uint place;
    if (!kept_place(place)) {
        return;
    }
    Cluster c = cluster_at(kept_clusters[place]);
    if (gl_LocalInvocationIndex == 0u) {
        length_of_list = 0u;
    }
    uint own = 0u;
    for (uint first = frame.unbounded_light_count; first < frame.light_count; first += BATCH_LIGHTS) {
        cull_batch(c, first);
        if (gl_LocalInvocationIndex < BATCH_WORDS) {
            own += uint(bitCount(touching[gl_LocalInvocationIndex]));
        }
    }
    barrier();
    atomicAdd(length_of_list, own);
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        list_lengths[place] = length_of_list;
    }
}
