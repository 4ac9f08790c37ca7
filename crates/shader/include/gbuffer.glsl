// Reads the G-buffer that gbuffer.frag.glsl fills.
#ifndef AFTERLIGHT_GBUFFER
#define AFTERLIGHT_GBUFFER
#include "gbuffer_lobe.glsl"

layout(set = 0, binding = 9) uniform texture2D gbuffer_base_color;

// Fills what shading needs; false where there is no surface or it takes no light.
bool gbuffer_load(ivec2 pixel, float depth, out Surface s) {
    if (!gbuffer_load_lobe(pixel, depth, s)) {
        return false;
    }
    vec4 base = texelFetch(gbuffer_base_color, pixel, 0);
    s.base_color = base.rgb;
    s.metallic = base.a;
    return true;
}

#endif
