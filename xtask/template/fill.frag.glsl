// Packs the nearest surface of a pixel into four words (layout.glsl). Out: RGBA32UI.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"
#include "technique_folder/layout.glsl"

layout(location = 0) out uvec4 words;

void main() {
    words = packed_surface(visible_surface());
}
