// What every test of lights against a part of the view starts from: their spheres, and planes of the view.
#ifndef AFTERLIGHT_CULLING
#define AFTERLIGHT_CULLING
#include "frame.glsl"

// Centre and range of every light, one texel of RGBA32F each, 1,024 a row: what culling reads, a quarter of a light.
// Range infinite: never culled.
layout(set = 0, binding = 5) uniform texture2D light_spheres;

vec4 light_sphere(uint index) {
    return texelFetch(light_spheres, ivec2(index & 1023u, index >> 10), 0);
}

// World-space half-space dot(n, p) + d >= 0 from a row combination of clip_from_world.
vec4 unit_plane(vec4 plane) {
    return plane / length(plane.xyz);
}

#endif
