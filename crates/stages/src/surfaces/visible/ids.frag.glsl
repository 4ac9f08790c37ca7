// Writes the visibility buffer (Burns and Hunt 2013; Petrescu et al. 2016, section 4.11): a draw and a triangle of it.
// Out: R32_UINT, draw << 10 | triangle; with ID_RGBA8 its four bytes as RGBA8, since some devices have no multisampled integer
// formats.
#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef ALPHA_MASK
#define WITH_UV
#include "surface_in.glsl"
#else
#include "scene.glsl"
layout(location = 0) flat in uvec2 draw_material;
#endif

#ifdef ID_RGBA8
layout(location = 0) out vec4 triangle_id;
#else
layout(location = 0) out uint triangle_id;
#endif

void main() {
#ifdef ALPHA_MASK
    visible_base_color(load_material(draw_material.y), surface_point());
#endif
    uint id = draw_material.x << TRIANGLE_BITS | uint(gl_PrimitiveID);
#ifdef ID_RGBA8
    triangle_id = unpackUnorm4x8(id);
#else
    triangle_id = id;
#endif
}
