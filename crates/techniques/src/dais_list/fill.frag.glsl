// Fills per-pixel lists of references into the triangle buffer (Schied and Dachsbacher 2015, section 4.1, "Per Pixel Visibility
// Sample Linked Lists"), after a depth pre-pass, with an equal test.
//
// A pixel's head holds a reference itself where one triangle covers every sample (bit 31), else the first node: 64 bits, the
// reference (28 bits), samples covered less one (4 bits), and the next node plus one.
//
// Out: Heads, Nodes, NodeCount; what memoize.glsl writes; with ALPHA_MASK SampleClaims. Departure: ties of depth are settled by
// a bit of stencil and by claims, as in gbuffer_list, so that weights sum to the samples.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_post_depth_coverage : require
#include "frame.glsl"
#include "gbuffer_list/claims.glsl"
#ifdef ALPHA_MASK
#define WITH_UV
#include "surface_in.glsl"
#else
layout(location = 0) flat in uvec2 draw_material;
#endif
#include "dais/memoize.glsl"

layout(early_fragment_tests) in;
layout(post_depth_coverage) in;

layout(set = 0, binding = 8, scalar) buffer Heads {
    uint heads[];
};
layout(set = 0, binding = 9, scalar) writeonly buffer Nodes {
    uvec2 nodes[];
};
layout(set = 0, binding = 15, scalar) buffer NodeCount {
    uint nodes_needed;
    uint samples_dropped;
};
layout(constant_id = 14) const uint NODE_CAPACITY = 0u;

const uint DIRECT = 0x80000000u;

void main() {
#ifdef ALPHA_MASK
    visible_base_color(load_material(draw_material.y), surface_point());
#endif
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint head = uint(pixel.y) * frame.size_px.x + uint(pixel.x);
    uint mask = uint(gl_SampleMaskIn[0]);
#ifdef ALPHA_MASK
    mask = claim(head, mask);
#endif
    if (gl_HelperInvocation || mask == 0u) {
        return;
    }
    uint place = memoized(fragment_triangle());
    uint count = uint(bitCount(mask));
    if (count == SAMPLES) {
        heads[head] = DIRECT | place;
        return;
    }
    uint node = atomicAdd(nodes_needed, 1u);
    if (node < NODE_CAPACITY) {
        uint next = atomicExchange(heads[head], node + 1u);
        nodes[node] = uvec2(place | (count - 1u) << 28, next);
    } else {
        atomicAdd(samples_dropped, count);
    }
}
