// Fills the visibility buffer with references into the triangle buffer (Schied and Dachsbacher 2015, section 3.1, Figure 3, and
// section 4.1), after a depth pre-pass, with an equal test.
//
// Out: reference, 24 bits, and coverage, 8 bits, as RGBA8 (Figure 4), or with WIDE a reference of 32 bits; what memoize.glsl writes;
// with ALPHA_MASK and not WIDE SampleClaims.
// Departures: a triangle's ID stands for its vertices where they can be fetched by it; the coverage is what passed the equal
// test and a bit of stencil, or, of masked surfaces, what they claim, so that of several surfaces of one depth one has the sample.
#version 460
#extension GL_GOOGLE_include_directive : require
#ifndef WIDE
#extension GL_EXT_post_depth_coverage : require
#endif
#ifdef ALPHA_MASK
#define WITH_UV
#include "surface_in.glsl"
#else
layout(location = 0) flat in uvec2 draw_material;
#endif
#include "dais/memoize.glsl"
#ifndef WIDE
#include "surfaces/claims/claims.glsl"
#endif

layout(early_fragment_tests) in;
#ifndef WIDE
layout(post_depth_coverage) in;
#endif

layout(location = 0) out vec4 visibility_sample;

void main() {
#ifdef ALPHA_MASK
    visible_base_color(load_material(draw_material.y), surface_point());
#endif
    visibility_sample = vec4(1.0);
#ifdef WIDE
    if (!gl_HelperInvocation) {
        visibility_sample = unpackUnorm4x8(memoized(fragment_triangle()));
    }
#else
    uint coverage = uint(gl_SampleMaskIn[0]);
#ifdef ALPHA_MASK
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    coverage = claim(pixel.y * frame.size_px.x + pixel.x, coverage);
    gl_SampleMask[0] = int(coverage);
#endif
    if (!gl_HelperInvocation && coverage != 0u) {
        uint place = memoized(fragment_triangle());
        visibility_sample = unpackUnorm4x8(min(place, 0xfffffeu) | coverage << 24);
    }
#endif
}
