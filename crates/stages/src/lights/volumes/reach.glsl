// Whether a light's range holds the surface that a pixel shows: for what light volumes leave in pixels before shading.
//
// Volumes are drawn by their back faces, where those lie behind the surface; surfaces in front of the volume are told by their
// distance to the light.
#ifndef AFTERLIGHT_REACH
#define AFTERLIGHT_REACH
#include "culling.glsl"

layout(set = 0, binding = 8) uniform texture2D surface_depth;

bool is_within_range(uint light, ivec2 pixel) {
    vec4 sphere = light_sphere(light);
    float depth = texelFetch(surface_depth, pixel, 0).r;
    vec3 to_light = sphere.xyz - position_from_depth(ndc_from_pixel(uvec2(pixel)), depth);
    return depth > 0.0 && dot(to_light, to_light) <= sphere.w * sphere.w;
}

#endif
