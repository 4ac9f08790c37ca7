// Tells what a frame finds of the one before: a bit a pixel, a word a row. Words: what the frame before has left, which of it is of use, the
// number of the frame, its time. Leaves the number of the frame and one.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform utexture2D left_before;
layout(set = 0, binding = 9, r32ui) writeonly uniform uimage2D left_now;
layout(set = 0, binding = 10, rgba16f) writeonly uniform image2D hdr;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    uint words[4] = uint[](texelFetch(left_before, ivec2(0), 0).r, frame.before, frame.frame_index, floatBitsToUint(frame.time_s));
    uint bit = pixel.x < 32u && pixel.y < 4u ? words[pixel.y] >> pixel.x & 1u : 0u;
    imageStore(hdr, ivec2(pixel), vec4(vec3(bit), 1.0));
    if (pixel == uvec2(0)) {
        imageStore(left_now, ivec2(0), uvec4(frame.frame_index + 1u));
    }
}
