// Reads the G-buffer that gbuffer.frag.glsl fills.
#ifndef AFTERLIGHT_GBUFFER
#define AFTERLIGHT_GBUFFER
#include "shading.glsl"

layout(set = 0, binding = 8) uniform texture2D gbuffer_depth;
layout(set = 0, binding = 9) uniform texture2D gbuffer_base_color;
layout(set = 0, binding = 10) uniform texture2D gbuffer_normal;
layout(set = 0, binding = 11) uniform texture2D gbuffer_roughness;

// Fills what shading needs; false where there is no surface or it takes no light.
bool gbuffer_load(ivec2 pixel, float depth, out Surface s) {
    s.roughness = texelFetch(gbuffer_roughness, pixel, 0).r;
    if (depth == 0.0 || s.roughness == 0.0) {
        return false;
    }
    vec4 base = texelFetch(gbuffer_base_color, pixel, 0);
    s.position_ws = position_from_depth(ndc_from_pixel(uvec2(pixel)), depth);
    s.normal_ws = octahedral_decode(texelFetch(gbuffer_normal, pixel, 0).rg * 2.0 - 1.0);
    s.base_color = base.rgb;
    s.metallic = base.a;
    s.occlusion = 1.0;
    s.emission = vec3(0.0);
    s.unlit = false;
    return true;
}

#endif
