// What the rasteriser interpolates at pixel centres: the reference of attribute errors.
//
// Out: 0 world position, m, as the bits of floats, and the triangle ID, RGBA32_UINT; 1 base colour and alpha, linear, RGBA32F, by
// implicit derivatives.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "surface_in.glsl"

layout(location = 0) out uvec4 position_id;
layout(location = 1) out vec4 base_color;

void main() {
    SurfacePoint p = surface_point();
    base_color = visible_base_color(load_material(draw_material.y), p);
    position_id = uvec4(floatBitsToUint(p.position_ws), draw_material.x << TRIANGLE_BITS | uint(gl_PrimitiveID));
}
