// Depth of alpha-masked surfaces: ends fragments below the cutoff, writes no colour.
#version 460
#extension GL_GOOGLE_include_directive : require
#define WITH_UV
#define ALPHA_MASK
#include "surface_in.glsl"

void main() {
    visible_base_color(load_material(draw_material.y), surface_point());
}
