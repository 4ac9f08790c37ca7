#version 460
#extension GL_EXT_samplerless_texture_functions : require
// Tells what the frame before has left, and leaves this frame's number; counts frames.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) readonly buffer Number { uint number; };
layout(set = 0, binding = 1) uniform utexture2D image_before;
layout(set = 0, binding = 2, r32ui) writeonly uniform uimage2D image_now;
layout(set = 0, binding = 3) readonly buffer CountBefore { uint count_before; };
layout(set = 0, binding = 4) writeonly buffer CountNow { uint count_now; };
layout(set = 0, binding = 5) writeonly buffer Seen { uint seen[]; };     // the count, then a pixel each
void main() {
    ivec2 size_px = imageSize(image_now);
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, size_px))) { return; }
    uint place = uint(pixel.y * size_px.x + pixel.x);
    seen[1 + place] = texelFetch(image_before, pixel, 0).r;
    imageStore(image_now, pixel, uvec4(number + place, 0, 0, 0));
    if (place == 0u) {
        seen[0] = count_before;
        count_now = count_before + 1u;
    }
}
