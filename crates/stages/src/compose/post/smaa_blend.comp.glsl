// SMAA, third pass: every pixel takes its shares from its neighbours (Jimenez et al. 2012, section 3).
//
// The four shares are those of its upper and left edges, and those of the upper edge of the pixel below and the left edge of
// the pixel to the right. Only the axis with the greatest share counts, since the two describe one line at corners.
// In: color, RGBA8, sRGB-encoded; hdr, RGBA16F, radiance; weights, RGBA8. Out: final_color, RGBA8, sRGB-encoded.
// Variant SWAP_SHARES exchanges what a pixel takes and what it gives: a mutant that a test must catch.
// One thread a pixel, groups of 8x8.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "compose/post/blend.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform texture2D color;
layout(set = 0, binding = 9) uniform texture2D hdr;
layout(set = 0, binding = 10) uniform texture2D weights;
layout(set = 0, binding = 11, rgba8) writeonly uniform image2D final_color;

vec4 weights_at(ivec2 pixel) {
    if (any(greaterThanEqual(pixel, ivec2(frame.size_px)))) {
        return vec4(0.0);
    }
    vec4 share = texelFetch(weights, pixel, 0);
#ifdef SWAP_SHARES
    return share.grab;
#else
    return share;
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    vec4 here = weights_at(pixel);
    float top = here.r, left = here.b;
    float bottom = weights_at(pixel + ivec2(0, 1)).g, right = weights_at(pixel + ivec2(1, 0)).a;
    if (max(max(top, bottom), max(left, right)) == 0.0) {
        imageStore(final_color, pixel, texelFetch(color, pixel, 0));
        return;
    }
    bool is_horizontal = max(left, right) > max(top, bottom);
    vec2 share = is_horizontal ? vec2(left, right) : vec2(top, bottom);
    ivec2 across = is_horizontal ? ivec2(1, 0) : ivec2(0, 1);
    ivec2 last = ivec2(frame.size_px) - 1;
    vec3 radiance = (1.0 - share.x - share.y) * texelFetch(hdr, pixel, 0).rgb
                  + share.x * texelFetch(hdr, max(pixel - across, ivec2(0)), 0).rgb
                  + share.y * texelFetch(hdr, min(pixel + across, last), 0).rgb;
    imageStore(final_color, pixel, vec4(display_color(radiance), 1.0));
}
