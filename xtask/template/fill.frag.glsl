// Packs the nearest surface of a pixel into four words (source.glsl).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "technique_folder/source.glsl"
#include "surface_in.glsl"

layout(location = 0) out uvec4 words;

void main() {
    words = packed_surface(visible_surface());
}
