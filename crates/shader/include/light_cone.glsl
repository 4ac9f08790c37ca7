// Cones of spot lights, for tests of lights against parts of the view.
#ifndef AFTERLIGHT_LIGHT_CONE
#define AFTERLIGHT_LIGHT_CONE
#include "light_data.glsl"

// Place, unit axis and cosine of the angle of light number `index`; false where it is no spot light.
bool light_cone(uint index, out vec3 apex, out vec3 axis, out float cos_angle) {
    apex = axis = vec3(0.0);
    cos_angle = -1.0;
    if (ONLY_POINT_LIGHTS != 0u || light_kind(index) != LIGHT_SPOT) {
        return false;
    }
    // The cone ends where the falloff, cosine x scale + offset, reaches 0.
    vec4 falloff = light_texel(index, 3u);
    apex = light_texel(index, 0u).xyz;
    axis = light_texel(index, 2u).xyz;
    cos_angle = -falloff.y / falloff.x;
    return true;
}

#endif
