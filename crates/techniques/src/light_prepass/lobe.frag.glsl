// Stores of the nearest surface only what the BRDF's lobes need, normal and roughness (Petrescu et al. 2016, section 4.5, first pass).
//
// Out: 0 normal, world space, octahedral, RG16 unsigned normalised; 1 roughness, R8, 0 where the surface takes no light; or at
// FIRST_OUTPUT and after it.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"

#ifndef FIRST_OUTPUT
#define FIRST_OUTPUT 0
#endif
layout(location = FIRST_OUTPUT) out vec2 normal_oct;
layout(location = FIRST_OUTPUT + 1) out float roughness;

void main() {
    MaterialData m = load_material(draw_material.y);
    SurfacePoint p = surface_point();
#ifdef ALPHA_MASK
    visible_base_color(m, p);
#endif
    // The base colour is not read, so the compiler removes its texture fetches.
    Surface s = surface_at(m, p, vec3(0.0));
    normal_oct = octahedral_encode(s.normal_ws) * 0.5 + 0.5;
    roughness = s.unlit ? 0.0 : max(s.roughness, MIN_ROUGHNESS);
}
