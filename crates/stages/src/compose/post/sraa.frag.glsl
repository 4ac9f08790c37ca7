// What SRAA keeps of a surface besides its depth: the plane's normal and the material (Chajdas et al. 2011, section 3).
//
// Out: RGBA8: octahedral normal of the triangle, 12 + 12 bits, and the material's number, which is at most 255; or, where WIDE_MATERIALS
// is set, RGBA16: 16 + 16 bits and a number of 32 bits. See sraa.comp.glsl. Four channels, since lavapipe has no multisampled integers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "surface_in.glsl"

layout(location = 0) out vec4 packed_surface;

// 1 where the scene has more than 256 materials.
layout(constant_id = 9) const uint WIDE_MATERIALS = 0u;

void main() {
#ifdef ALPHA_MASK
    visible_base_color(load_material(draw_material.y), surface_point());
#endif
    // The normal of the triangle's own plane; interpolated vertex normals do not describe where the triangle lies.
    vec3 normal = cross(dFdx(position_ws), dFdy(position_ws));
    float square = dot(normal, normal);
    vec2 octahedral = square > 0.0 ? octahedral_encode(normal * inversesqrt(square)) : vec2(0.0);
    uint material = draw_material.y;
    if (WIDE_MATERIALS != 0u) {
        packed_surface = vec4(octahedral * 0.5 + 0.5, vec2(material & 0xffffu, material >> 16) / 65535.0);
        return;
    }
    uvec2 bits = uvec2(round((octahedral * 0.5 + 0.5) * 4095.0));
    packed_surface = unpackUnorm4x8(bits.x | bits.y << 12 | material << 24);
}
