// Forward shading where every surface visits the lights that lights/step/ finds for it (Petrescu et al. 2016, sections 4.7 to 4.10).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lights/step/radiance.glsl"
#include "surfaces/depth_first/shade_visible.glsl"
