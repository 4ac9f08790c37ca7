// Shades the G-buffer by the lights that its surfaces visit (light_step/).
// In: what light_step/radiance.glsl reads, and as below.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lights/step/radiance.glsl"
#include "surfaces/gbuffer/shade_pixels.glsl"
