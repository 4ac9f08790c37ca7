// A count a pixel as a colour. In: invocation_count, R32_UINT. Out: hdr, RGBA16F, display-linear. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "heat.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform utexture2D invocation_count;
layout(set = 0, binding = 9, rgba16f) writeonly uniform image2D hdr;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    imageStore(hdr, ivec2(pixel), vec4(invocations_color(texelFetch(invocation_count, ivec2(pixel), 0).r), 1.0));
}
