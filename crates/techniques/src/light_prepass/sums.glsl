// The light that a pixel has gathered, in the three sums that light.frag.glsl adds to. With ALIKE_PIXELS the fragment shader says first which
// pixel's that is, in sums_pixel; otherwise it is the fragment's.
#ifndef AFTERLIGHT_LIGHT_SUMS
#define AFTERLIGHT_LIGHT_SUMS
#include "shading.glsl"

layout(set = 0, binding = 8) uniform texture2D diffuse_light;
layout(set = 0, binding = 9) uniform texture2D specular_light;
layout(set = 0, binding = 10) uniform texture2D grazing_light;

#ifdef ALIKE_PIXELS
ivec2 sums_pixel;
#else
#define sums_pixel ivec2(gl_FragCoord.xy)
#endif

// A sum above the largest 16-bit float is infinite; multiplied by an f0 of 0 it would become NaN, so it is clamped.
vec3 gathered(texture2D light) {
    return min(texelFetch(light, sums_pixel, 0).rgb, vec3(65504.0));
}

// Applies the colours of the pixel's surface to the gathered light.
vec3 gathered_radiance(Surface s) {
    return reflected(
        unshadowed_point(s), gathered(diffuse_light), gathered(specular_light), gathered(grazing_light));
}

#endif
