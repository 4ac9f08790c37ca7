// SMAA, first pass: edges between pixels by luma, with local contrast adaptation (Jimenez et al. 2012, section 3.1).
//
// In: color, RGBA8, sRGB-encoded. Out: edges, RG8: an edge at the left side (red), at the upper side (green), 0 or 1.
// One thread a pixel, groups of 8x8.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform texture2D color;
layout(set = 0, binding = 9, rg8) writeonly uniform image2D edges;

// Least difference of luma that is an edge.
const float THRESHOLD = 0.1;
// An edge is dropped where a neighbouring one is more than this many times as strong.
const float ADAPTATION = 2.0;

float luma_at(ivec2 pixel) {
    ivec2 inside = clamp(pixel, ivec2(0), ivec2(frame.size_px) - 1);
    return dot(texelFetch(color, inside, 0).rgb, vec3(0.2126, 0.7152, 0.0722));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    float center = luma_at(pixel), left = luma_at(pixel + ivec2(-1, 0)), top = luma_at(pixel + ivec2(0, -1));
    vec2 contrast = abs(center - vec2(left, top));
    bvec2 found = greaterThanEqual(contrast, vec2(THRESHOLD));
    if (any(found)) {
        float right = luma_at(pixel + ivec2(1, 0)), bottom = luma_at(pixel + ivec2(0, 1));
        float left_left = luma_at(pixel + ivec2(-2, 0)), top_top = luma_at(pixel + ivec2(0, -2));
        float strongest = max(max(max(contrast.x, contrast.y), max(abs(center - right), abs(center - bottom))),
                              max(abs(left - left_left), abs(top - top_top)));
        found.x = found.x && contrast.x * ADAPTATION >= strongest;
        found.y = found.y && contrast.y * ADAPTATION >= strongest;
    }
    imageStore(edges, pixel, vec4(vec2(found), 0.0, 0.0));
}
