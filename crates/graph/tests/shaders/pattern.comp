#version 460
// Writes a value a pixel: its index, as 8-bit colour.
layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 0) const uint SHIFT = 0;
layout(set = 0, binding = 0) writeonly buffer Values { uint values[]; };
layout(push_constant) uniform Push { uvec2 size_px; } push;
void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, push.size_px))) { return; }
    values[pixel.y * push.size_px.x + pixel.x] = (pixel.x + pixel.y * push.size_px.x + SHIFT) & 0xffu;
}
