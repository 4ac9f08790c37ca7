// Fills the G-buffer (Petrescu et al. 2016, Figure 1): what a light needs to know of the nearest surface.
//
// Out: 0 accumulation, RGBA16F: radiance that needs no light; 1 base colour and metalness, RGBA8 sRGB (alpha linear);
// 2 normal, world space, octahedral, RG16 unsigned normalised; 3 roughness, R8, 0 where the surface takes no light.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"

layout(location = 0) out vec4 accumulation;
layout(location = 1) out vec4 base_color_metallic;
layout(location = 2) out vec2 normal_oct;
layout(location = 3) out float roughness;

void main() {
    Surface s = visible_surface();
    accumulation = vec4(unlit_radiance(s), 1.0);
    base_color_metallic = vec4(s.base_color, s.metallic);
    normal_oct = octahedral_encode(s.normal_ws) * 0.5 + 0.5;
    roughness = s.unlit ? 0.0 : max(s.roughness, MIN_ROUGHNESS);
}
