// Marks the clusters that hold a surface: a thread a pixel.
//
// In: cluster_depth, ClusterSlices. Out: MarkedClusters, a bit a cluster, zero before. Dispatch: 16x16 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "clusters/grid.glsl"

layout(local_size_x = 16, local_size_y = 16) in;
layout(set = 0, binding = 8) uniform texture2D cluster_depth;
layout(set = 0, binding = 9, scalar) buffer MarkedClusters {
    uint marked[];
};

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    float depth = texelFetch(cluster_depth, ivec2(pixel), 0).r;
    if (depth == 0.0) {
        return;
    }
    uint cluster = cluster_of(pixel, distance_from_depth(depth));
    uint bit = 1u << (cluster & 31u);
    // A stale word costs an atomic, never a cluster.
    if ((marked[cluster >> 5] & bit) == 0u) {
        atomicOr(marked[cluster >> 5], bit);
    }
}
