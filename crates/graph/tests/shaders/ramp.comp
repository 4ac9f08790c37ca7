#version 460
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, r32f) writeonly uniform image2D ramp;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(ramp)))) { return; }
    imageStore(ramp, pixel, vec4(float(pixel.x * 100 + pixel.y)));
}
