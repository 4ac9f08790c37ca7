// Appends a light to the lists of the pixels whose surfaces lie within its range (Petrescu et al. 2016, section 4.7, Figure 4).
//
// Drawn by the back faces of light volumes, so that a pixel meets each light once. A pixel's surfaces lie between two points of the ray
// through its centre; the light is appended if that part of the ray comes within its range.
// In and out: LightHeads. Out: LightNodes, LightNodeCount. With ONE_DEPTH the surface is taken from light_lists_depth, because reading a
// buffer that the same pass writes is slow (23.5 ms instead of 16, NVIDIA H200, Sponza, 10,000 lights).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "culling.glsl"
#include "lights/pixel_lists/head.glsl"

layout(early_fragment_tests) in;

layout(set = 0, binding = 14, scalar) buffer LightHeads {
    LightHead light_heads[];
};
layout(set = 0, binding = 15, scalar) writeonly buffer LightNodes {
    uvec2 light_nodes[];
};
layout(set = 0, binding = 16, scalar) buffer LightNodeCount {
    uint nodes_needed;
    uint nodes_dropped;
};
layout(constant_id = 14) const uint NODE_CAPACITY = 0u;
// 1 where surfaces may stand off the pixel's centre, at its samples.
layout(constant_id = 15) const uint SAMPLED = 0u;
#ifdef ONE_DEPTH
layout(set = 0, binding = 8) uniform texture2D light_lists_depth;
#endif

// Counters are held about this value once they reach it: above every capacity, and so far below 2^32 that the threads that run at once
// cannot make them wrap around. Who finds a counter beyond it takes back what it added, so that nobody reads a counter before.
const uint MOST_NEEDED = 0xf0000000u;

layout(location = 0) flat in uint light_index;

bool reaches_point(vec4 sphere, vec3 point, float slack_m) {
    float reach_m = sphere.w + slack_m;
    vec3 to_light = sphere.xyz - point;
    return dot(to_light, to_light) <= reach_m * reach_m;
}

#ifdef ONE_DEPTH
bool is_within_range(uint pixel) {
    float depth = texelFetch(light_lists_depth, ivec2(gl_FragCoord.xy), 0).r;
    vec2 ndc = ndc_from_pixel(uvec2(gl_FragCoord.xy));
    return depth > 0.0 && reaches_point(light_sphere(light_index), position_from_depth(ndc, depth), 0.0);
}
#else
// Surfaces at the samples lie off the ray through the pixel's centre, by at most half a pixel's width at the farther end.
bool reaches_ray(vec4 sphere, vec2 ndc, float nearest_m, float farthest_m) {
    float farthest_depth = depth_from_distance(farthest_m);
    vec3 far = position_from_depth(ndc, farthest_depth);
    vec3 between = far - position_from_depth(ndc, depth_from_distance(nearest_m));
    float along = clamp(dot(far - sphere.xyz, between) / max(dot(between, between), 1e-20), 0.0, 1.0);
    vec3 corner = position_from_depth(ndc + 1.0 / vec2(frame.size_px), farthest_depth);
    return reaches_point(sphere, far - along * between, distance(far, corner));
}

bool is_within_range(uint pixel) {
    float nearest_m = light_heads[pixel].nearest_m, farthest_m = light_heads[pixel].farthest_m;
    if (farthest_m < nearest_m) {
        return false;
    }
    vec4 sphere = light_sphere(light_index);
    vec2 ndc = ndc_from_pixel(uvec2(gl_FragCoord.xy));
    if (SAMPLED != 0u) {
        return reaches_ray(sphere, ndc, nearest_m, farthest_m);
    }
    // A single surface is a point: the two ends in the head differ by rounding only.
    vec3 point = position_from_depth(ndc, depth_from_distance(0.5 * (nearest_m + farthest_m)));
    return reaches_point(sphere, point, farthest_m - nearest_m);
}
#endif

void append(uint pixel) {
    uint node = atomicAdd(nodes_needed, 1u);
    if (node < NODE_CAPACITY) {
        light_nodes[node] = uvec2(light_index, atomicExchange(light_heads[pixel].link, node + 1u));
        return;
    }
    if (node >= MOST_NEEDED) {
        atomicAdd(nodes_needed, 0xffffffffu);
    }
    if (atomicAdd(nodes_dropped, 1u) >= MOST_NEEDED) {
        atomicAdd(nodes_dropped, 0xffffffffu);
    }
}

void main() {
    uvec2 place = uvec2(gl_FragCoord.xy);
    uint pixel = place.y * frame.size_px.x + place.x;
    if (!gl_HelperInvocation && is_within_range(pixel)) {
        append(pixel);
    }
}
