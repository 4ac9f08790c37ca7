// Fills per-pixel lists of references to triangles (Schied and Dachsbacher 2015, section 4.1, "Per Pixel Visibility Sample Linked
// Lists"), after a depth pre-pass, with an equal test.
//
// A reference is the triangle's ID, and a bit marks that it shows; with WHOLE_TRIANGLE, whose IDs lead nowhere, it is a place in
// the triangle buffer, by the memoization cache.
//
// Out: Heads, Nodes, NodeCount; MarkedBits, or what memoize.glsl writes; with ALPHA_MASK SampleClaims; where the nodes are bounded
// SampleDrops. Departure: ties of depth are settled by a bit of stencil and by claims, as in gbuffer_list, so that weights sum
// to the samples.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_post_depth_coverage : require
#include "frame.glsl"
#include "surfaces/claims/claims.glsl"
#include "dais_list/pixel_lists.glsl"
#ifdef ALPHA_MASK
#define WITH_UV
#include "surface_in.glsl"
#else
layout(location = 0) flat in uvec2 draw_material;
#endif
#ifdef WHOLE_TRIANGLE
#include "dais/memoize.glsl"
#else
#include "scene.glsl"
#include "surfaces/triangles/marks.glsl"
#endif

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
// Samples of a pixel that found no node, 8 bits.
layout(set = 0, binding = 26, scalar) buffer SampleDrops {
    uint sample_drops[];
};
layout(constant_id = 14) const uint NODE_CAPACITY = 0u;
layout(constant_id = 15) const uint BOUNDED = 0u;
layout(push_constant, scalar) uniform Push {
    uint first_row;     // of the band that is drawn
};

uint triangle_reference() {
#ifdef WHOLE_TRIANGLE
    return memoized(fragment_triangle());
#else
    uint id = draw_material.x << TRIANGLE_BITS | uint(gl_PrimitiveID);
    mark_triangle(id);
    return id;
#endif
}

void add_entry(uint pixel, uint entry) {
    // A triangle that is alone in its pixel is stored in the head itself.
    if (atomicCompSwap(heads[pixel], 0u, entry) == 0u) {
        return;
    }
    uint node = atomicAdd(nodes_needed, 1u);
    if (node < NODE_CAPACITY) {
        nodes[node] = uvec2(entry, atomicExchange(heads[pixel], node + 1u));
        return;
    }
    atomicAdd(samples_dropped, entry_samples(entry));
    if (BOUNDED != 0u) {
        atomicAdd(sample_drops[pixel / 4u], entry_samples(entry) << pixel % 4u * 8u);
    }
}

void main() {
#ifdef ALPHA_MASK
    visible_base_color(load_material(draw_material.y), surface_point());
#endif
    uvec2 place = uvec2(gl_FragCoord.xy) + uvec2(0u, first_row);
    uint pixel = place.y * frame.size_px.x + place.x;
    uint mask = uint(gl_SampleMaskIn[0]);
#ifdef ALPHA_MASK
    mask = claim(pixel, mask);
#endif
    if (!gl_HelperInvocation && mask != 0u) {
        add_entry(pixel, list_entry(triangle_reference(), uint(bitCount(mask))));
    }
}
