// Linear HDR to the final image: Khronos PBR Neutral, sRGB, 8 bits. One thread a pixel, groups of 8x8.
// With DISPLAY_COLORS (debug views) without the tone map. In: hdr, RGBA16F, radiance. Out: final_color, RGBA8, sRGB-encoded. Twin: crates/oracle/src/tonemap.rs.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "tonemap.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform texture2D hdr;
layout(set = 0, binding = 9, rgba8) writeonly uniform image2D final_color;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    vec3 color = texelFetch(hdr, ivec2(pixel), 0).rgb;
#ifndef DISPLAY_COLORS
    color = pbr_neutral(color);
#endif
    imageStore(final_color, ivec2(pixel), vec4(srgb_from_linear(clamp(color, 0.0, 1.0)), 1.0));
}
