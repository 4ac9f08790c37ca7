// How far surfaces have moved on screen since the frame before, as colours: the hue says where to, the brightness how far.
// In: velocity, pixels, RG16F. Out: hdr, RGBA16F, display-linear. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "heat.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform texture2D velocity;
layout(set = 0, binding = 9, rgba16f) writeonly uniform image2D hdr;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    vec2 velocity_px = texelFetch(velocity, ivec2(pixel), 0).rg;
    imageStore(hdr, ivec2(pixel), vec4(velocity_color(velocity_px), 1.0));
}
