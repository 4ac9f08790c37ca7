// Light from the lists of clusters. Lights without an end, the first of all, are on no list: every surface visits them. Lights are
// visited in their order, so that sums do not depend on the schedule.
#ifndef AFTERLIGHT_CLUSTER_LISTS
#define AFTERLIGHT_CLUSTER_LISTS
#include "clusters/grid.glsl"
#include "shading.glsl"

// A bit a cluster that holds a surface.
layout(set = 0, binding = 15, scalar) readonly buffer ClusterBits {
    uint cluster_bits[];
};
// Kept clusters before each word of bits.
layout(set = 0, binding = 16, scalar) readonly buffer KeptBefore {
    uint kept_before[];
};
// Where the list of each kept cluster begins; that of the next is where it ends.
layout(set = 0, binding = 17, scalar) readonly buffer ListBegins {
    uint list_begins[];
};
layout(set = 0, binding = 18, scalar) readonly buffer ClusterLists {
    uint cluster_lists[];
};
layout(constant_id = 11) const uint CLUSTER_CAPACITY = 0u;
layout(constant_id = 12) const uint LIST_CAPACITY = 0u;

// First and end of the list of a cluster; nothing where the frame had no room for it, which is then recorded again.
uvec2 list_of(uint cluster) {
    uint below = cluster_bits[cluster >> 5] & ((1u << (cluster & 31u)) - 1u);
    uint place = kept_before[cluster >> 5] + uint(bitCount(below));
    if (place >= CLUSTER_CAPACITY) {
        return uvec2(0u);
    }
    return min(uvec2(list_begins[place], list_begins[place + 1u]), LIST_CAPACITY);
}

// Radiance of all lights that reach a surface of a pixel at a view distance.
vec3 clustered_radiance(ShadingPoint p, uvec2 pixel, float distance_m) {
    vec3 radiance = vec3(0.0);
    for (uint i = 0u; i < frame.unbounded_light_count; ++i) {
        radiance += light_radiance(p, i);
    }
    uvec2 list = list_of(cluster_of(pixel, distance_m));
    for (uint i = list.x; i < list.y; ++i) {
        radiance += light_radiance(p, cluster_lists[i]);
    }
    return radiance;
}

#endif
