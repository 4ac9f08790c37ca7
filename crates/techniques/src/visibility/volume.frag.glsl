// One light over the pixels of its volume: fetches the triangle of the pixel, its attributes and its material for every light, as
// shade.comp.glsl does once.
// In: ids, R32_UINT, or the keys of compute_raster. Out: linear radiance, to be added.
#version 460
#extension GL_GOOGLE_include_directive : require
#define EXPLICIT_GRADIENTS
#include "shading.glsl"
#include "visibility/surface.glsl"

layout(location = 0) flat in uint light_index;
layout(location = 0) out vec4 radiance_out;

void main() {
    Surface s;
    radiance_out = vec4(0.0);
    if (visible_surface(uvec2(gl_FragCoord.xy), s) && !s.unlit) {
        radiance_out.rgb = light_radiance(shading_point_for(s, light_index), light_index);
    }
}
