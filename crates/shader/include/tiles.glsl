// Tiled light culling in a compute group of 16x16 threads, one thread a pixel (Olsson and Assarsson 2011; Petrescu et al.
// 2016, section 4.8).
//
// The group reduces its pixels to a range of view distances, then tests lights against the tile's frustum, 1,024 at a
// time: a bit a light in shared memory. There is no list that could overflow, and the lights are visited in their order,
// so that sums do not depend on the schedule. Departure from the paper: no list of indices in memory; the bits are used
// in the group that made them.
//
// CPU twin: crates/oracle/src/tiles.rs.
#ifndef AFTERLIGHT_TILES
#define AFTERLIGHT_TILES
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "culling.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

const uint TILE_SIZE = 16u;
const uint TILE_THREADS = TILE_SIZE * TILE_SIZE;
const uint BATCH_LIGHTS = 1024u;
const uint BATCH_WORDS = BATCH_LIGHTS / 32u;

shared uint tile_nearest;   // bits of non-negative floats order as unsigned integers
shared uint tile_farthest;
shared uint tile_lights[BATCH_WORDS];

// Reduces the ranges of view distances of a tile's pixels. Every thread of the group calls it once; `covered` is false
// where the pixel shows no surface. False where no pixel of the tile does.
bool tile_reduce_range(bool covered, float nearest_m, float farthest_m) {
    if (gl_LocalInvocationIndex == 0u) {
        tile_nearest = 0x7f7fffffu;
        tile_farthest = 0u;
    }
    barrier();
    float nearest = subgroupMin(covered ? nearest_m : 3.402823e38);
    float farthest = subgroupMax(covered ? farthest_m : 0.0);
    if (subgroupElect() && nearest < 3.402823e38) {
        atomicMin(tile_nearest, floatBitsToUint(nearest));
        atomicMax(tile_farthest, floatBitsToUint(farthest));
    }
    barrier();
    return tile_nearest <= tile_farthest;
}

// The same for pixels of one sample.
bool tile_reduce_depth(bool covered, float distance_m) {
    return tile_reduce_range(covered, distance_m, distance_m);
}

struct TileFrustum {
    vec4 left, right, top, bottom;  // half-spaces, inside >= 0
    float nearest_m, farthest_m;
};

TileFrustum tile_frustum() {
    vec2 pixels_to_ndc = 2.0 * float(TILE_SIZE) / vec2(frame.size_px);
    vec2 low = vec2(gl_WorkGroupID.xy) * pixels_to_ndc - 1.0;
    vec2 high = vec2(gl_WorkGroupID.xy + 1u) * pixels_to_ndc - 1.0;
    vec4 x = clip_row(0), y = clip_row(1), w = clip_row(3);
    return TileFrustum(unit_plane(x - low.x * w), unit_plane(high.x * w - x), unit_plane(y - low.y * w),
                       unit_plane(high.y * w - y), uintBitsToFloat(tile_nearest), uintBitsToFloat(tile_farthest));
}

bool tile_touches(TileFrustum t, vec4 sphere) {
    vec4 centre = vec4(sphere.xyz, 1.0);
    float range_m = sphere.w;
    float distance_m = dot(frame.distance_from_world, centre);
    float inside = min(min(dot(t.left, centre), dot(t.right, centre)), min(dot(t.top, centre), dot(t.bottom, centre)));
    return inside >= -range_m && distance_m + range_m >= t.nearest_m && distance_m - range_m <= t.farthest_m;
}

// Leaves the lights first..first + 1,023 that touch the tile as bits in `tile_lights`.
void tile_cull(TileFrustum t, uint first) {
    barrier();  // the batch before has been read
    if (gl_LocalInvocationIndex < BATCH_WORDS) {
        tile_lights[gl_LocalInvocationIndex] = 0u;
    }
    barrier();
    uint end = min(first + BATCH_LIGHTS, frame.light_count);
    for (uint i = first + gl_LocalInvocationIndex; i < end; i += TILE_THREADS) {
        if (tile_touches(t, light_sphere(i))) {
            atomicOr(tile_lights[(i - first) >> 5], 1u << ((i - first) & 31u));
        }
    }
    barrier();
}

#endif
