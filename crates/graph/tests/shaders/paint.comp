#version 460
// Turns values into an image.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) readonly buffer Values { uint values[]; };
layout(set = 0, binding = 1, rgba8) writeonly uniform image2D painted;
void main() {
    ivec2 size_px = imageSize(painted);
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, size_px))) { return; }
    uint value = values[pixel.y * size_px.x + pixel.x];
    imageStore(painted, pixel, vec4(float(value) / 255.0, float(pixel.x) / 255.0, float(pixel.y) / 255.0, 1.0));
}
