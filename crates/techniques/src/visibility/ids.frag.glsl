// Writes the visibility buffer (Burns and Hunt 2013; Petrescu et al. 2016, section 4.11): a draw and a triangle of it.
// Out: R32_UINT, draw << 10 | triangle.
#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef ALPHA_MASK
#define WITH_UV
#include "surface_in.glsl"
#else
#include "scene.glsl"
layout(location = 0) flat in uvec2 draw_material;
#endif

layout(location = 0) out uint triangle_id;

void main() {
#ifdef ALPHA_MASK
    visible_base_color(load_material(draw_material.y), surface_point());
#endif
    triangle_id = draw_material.x << TRIANGLE_BITS | uint(gl_PrimitiveID);
}
