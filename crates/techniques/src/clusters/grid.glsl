// The grid of clusters: tiles of CLUSTER_PX pixels, divided at SLICES + 1 view distances. A cluster's number is
// tile x SLICES + slice, tiles by rows.
//
// CPU twin: crates/oracle/src/clusters.rs.
#ifndef AFTERLIGHT_CLUSTER_GRID
#define AFTERLIGHT_CLUSTER_GRID
#include "frame.glsl"

layout(constant_id = 8) const uint CLUSTER_PX = 32u;
layout(constant_id = 9) const uint SLICES = 32u;

// View distances at which slices begin, m, and that at which the last ends. Whoever asks for a slice and whoever asks for its
// ends read the same numbers: no rounding puts a surface outside of its cluster.
layout(set = 0, binding = 14, scalar) readonly buffer ClusterSlices {
    float slice_begins_m[];
};

// The slice of a view distance within the grid: the last that begins at it or before.
uint slice_of(float distance_m) {
    uint low = 0u, high = SLICES;
    while (high - low > 1u) {
        uint middle = (low + high) / 2u;
        if (slice_begins_m[middle] <= distance_m) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

uint tiles_across() {
    return (frame.size_px.x + CLUSTER_PX - 1u) / CLUSTER_PX;
}

uint cluster_of(uvec2 pixel, float distance_m) {
    uvec2 tile = pixel / CLUSTER_PX;
    return (tile.y * tiles_across() + tile.x) * SLICES + slice_of(distance_m);
}

#endif
