// Reads from the G-buffer what the BRDF's lobes need (position, normal, roughness), without the colours.
#ifndef AFTERLIGHT_GBUFFER_LOBE
#define AFTERLIGHT_GBUFFER_LOBE
#include "shading.glsl"

layout(set = 0, binding = 8) uniform texture2D gbuffer_depth;
layout(set = 0, binding = 10) uniform texture2D gbuffer_normal;
layout(set = 0, binding = 11) uniform texture2D gbuffer_roughness;

// Fills position, normal and roughness of a black surface; false where there is no surface or it takes no light.
bool gbuffer_load_lobe(ivec2 pixel, float depth, out Surface s) {
    s.roughness = texelFetch(gbuffer_roughness, pixel, 0).r;
    if (depth == 0.0 || s.roughness == 0.0) {
        return false;
    }
    s.position_ws = position_from_depth(ndc_from_pixel(uvec2(pixel)), depth);
    s.normal_ws = octahedral_decode(texelFetch(gbuffer_normal, pixel, 0).rg * 2.0 - 1.0);
    s.base_color = vec3(0.0);
    s.metallic = 0.0;
    s.occlusion = 1.0;
    s.emission = vec3(0.0);
    s.unlit = false;
    return true;
}

#endif
