// Inputs of every test of lights against a part of the view: the lights' bounding spheres, and planes of the view frustum.
#ifndef AFTERLIGHT_CULLING
#define AFTERLIGHT_CULLING
#include "frame.glsl"

// Centre and range of every light, one RGBA32F texel each, 1,024 texels a row. Culling reads only these, a quarter of a light's data.
// An infinite range marks a light that is never culled.
layout(set = 0, binding = 5) uniform texture2D light_spheres;

vec4 light_sphere(uint index) {
    return texelFetch(light_spheres, ivec2(index & 1023u, index >> 10), 0);
}

// The world-space half-space dot(n, p) + d >= 0 that a combination of the rows of clip_from_world describes.
vec4 unit_plane(vec4 plane) {
    return plane / length(plane.xyz);
}

#endif
