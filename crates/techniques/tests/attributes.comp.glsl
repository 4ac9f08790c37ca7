// Attributes of every triangle from its record, at a pixel each. In: Pixels, 2 x 16 bits; the triangle buffer. Out: Found, sixteen
// floats a triangle: world position, normal, texture coordinates, their changes along x and y, tangent and the bitangent's sign. Dispatch: triangles / 128.
#version 460
#extension GL_GOOGLE_include_directive : require
#define EXPLICIT_GRADIENTS
#include "surfaces/triangles/interpolate.glsl"

layout(local_size_x = 128) in;
layout(set = 0, binding = 8, scalar) readonly buffer Pixels {
    uint pixels[];
};
layout(set = 0, binding = 9, scalar) writeonly buffer Found {
    vec4 found[];
};

void main() {
    uint index = gl_GlobalInvocationID.x;
    uint material;
    SurfacePoint p = interpolated_point(index, vec2(pixels[index] & 0xffffu, pixels[index] >> 16), material);
    found[index * 4u] = vec4(p.position_ws, p.normal_ws.x);
    found[index * 4u + 1u] = vec4(p.normal_ws.yz, p.uv0.uv);
    found[index * 4u + 2u] = vec4(p.uv0.ddx, p.uv0.ddy);
    found[index * 4u + 3u] = p.tangent_ws;
}
