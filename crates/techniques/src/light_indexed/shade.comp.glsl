// Shades the G-buffer by the at most four lights whose indices a pixel holds (Petrescu et al. 2016, section 4.7, LiD).
// In: the packed indices, and as below.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lights/indices/indices.glsl"

vec3 lights_radiance(ShadingPoint p, uvec2 pixel, float distance_m) {
    return indexed_radiance(p, pixel);
}

#include "surfaces/gbuffer/shade_pixels.glsl"
