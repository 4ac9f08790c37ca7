// Shades the G-buffer by the lights that its surfaces visit (lights/step/).
// In: what lights/step/radiance.glsl reads, and as below.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lights/step/radiance.glsl"
#include "surfaces/gbuffer/shade_pixels.glsl"
