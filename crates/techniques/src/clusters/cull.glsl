// Which lights touch a cluster, in a group of 64 threads, 1,024 lights at a time: a bit a light in shared memory. All lights with
// an end are tested against every kept cluster: what visits fewer takes the place of the loop in cull_batch.
//
// CPU twin: crates/oracle/src/clusters.rs.
#ifndef AFTERLIGHT_CLUSTER_CULL
#define AFTERLIGHT_CLUSTER_CULL
#include "clusters/grid.glsl"
#include "clusters/groups.glsl"
#include "culling.glsl"

layout(local_size_x = 64) in;

const uint BATCH_LIGHTS = 1024u;
const uint BATCH_WORDS = BATCH_LIGHTS / 32u;

layout(set = 0, binding = 8, scalar) readonly buffer KeptClusters {
    uint kept_clusters[];
};
layout(set = 0, binding = 9, scalar) readonly buffer KeptCount {
    uint kept_needed;
    uint kept_dropped;
};
layout(constant_id = 11) const uint CLUSTER_CAPACITY = 0u;

shared uint touching[BATCH_WORDS];

// A part of the view: a frustum cut off at two view distances, and the box around it along the camera's axes.
struct Cluster {
    vec4 left, right, top, bottom;  // half-spaces, inside >= 0
    vec3 across, down;              // unit axes; the third coordinate of the box is the view distance
    vec3 low, high;
};

void cluster_include(inout Cluster c, vec2 ndc, float distance_m) {
    vec3 p = position_from_depth(ndc, depth_from_distance(distance_m));
    vec3 at = vec3(dot(c.across, p), dot(c.down, p), distance_m);
    c.low = min(c.low, at);
    c.high = max(c.high, at);
}

Cluster cluster_at(uint number) {
    uint tile = number / SLICES, slice = number % SLICES;
    uvec2 first = uvec2(tile % tiles_across(), tile / tiles_across()) * CLUSTER_PX;
    vec2 low = vec2(first) * 2.0 / vec2(frame.size_px) - 1.0;
    vec2 high = vec2(min(first + CLUSTER_PX, frame.size_px)) * 2.0 / vec2(frame.size_px) - 1.0;
    vec4 x = clip_row(0), y = clip_row(1), w = clip_row(3);
    Cluster c;
    c.left = unit_plane(x - low.x * w);
    c.right = unit_plane(high.x * w - x);
    c.top = unit_plane(y - low.y * w);
    c.bottom = unit_plane(high.y * w - y);
    vec3 forward = frame.distance_from_world.xyz;
    c.across = normalize(x.xyz - dot(x.xyz, forward) * forward);
    c.down = cross(forward, c.across);
    c.low = vec3(3.402823e38);
    c.high = vec3(-3.402823e38);
    for (uint end = 0u; end < 2u; ++end) {
        float distance_m = slice_begins_m[slice + end];
        cluster_include(c, low, distance_m);
        cluster_include(c, vec2(high.x, low.y), distance_m);
        cluster_include(c, vec2(low.x, high.y), distance_m);
        cluster_include(c, high, distance_m);
    }
    return c;
}

// A sphere passes where it touches the box and no side plane of the frustum has it outside: each lets pass some that the other
// does not, at the corners; neither misses one.
bool cluster_touches(Cluster c, vec4 sphere) {
    vec4 centre = vec4(sphere.xyz, 1.0);
    float range_m = sphere.w;
    vec3 at = vec3(dot(c.across, centre.xyz), dot(c.down, centre.xyz), dot(frame.distance_from_world, centre));
    vec3 outside = max(max(c.low - at, at - c.high), 0.0);
    float inside = min(min(dot(c.left, centre), dot(c.right, centre)), min(dot(c.top, centre), dot(c.bottom, centre)));
    return inside >= -range_m && dot(outside, outside) <= range_m * range_m;
}

// Leaves the lights first..first + 1,023 that touch the cluster as bits in `touching`.
void cull_batch(Cluster c, uint first) {
    barrier();  // the batch before has been read
    if (gl_LocalInvocationIndex < BATCH_WORDS) {
        touching[gl_LocalInvocationIndex] = 0u;
    }
    barrier();
    uint end = min(first + BATCH_LIGHTS, frame.light_count);
    for (uint i = first + gl_LocalInvocationIndex; i < end; i += 64u) {
        if (cluster_touches(c, light_sphere(i))) {
            atomicOr(touching[(i - first) >> 5], 1u << ((i - first) & 31u));
        }
    }
    barrier();
}

// Whether this group has a cluster, and its place.
bool kept_place(out uint place) {
    place = group_place();
    return place < min(kept_needed, CLUSTER_CAPACITY);
}

#endif
