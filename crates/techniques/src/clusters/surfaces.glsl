// View distances of the surfaces of a pixel, whatever holds them: depth at the samples (multisample/sample_depth.glsl) or, with
// SURFACES_DAIS_LIST, lists of triangles. The including shader defines visit_distance(distance_m).
#ifndef AFTERLIGHT_SURFACES
#define AFTERLIGHT_SURFACES
#ifdef SURFACES_DAIS_LIST
#include "shading.glsl"
#include "dais_list/source_dais_list.glsl"
#else
#include "multisample/sample_depth.glsl"
#endif

void visit_distance(float distance_m);

void visit_pixel(ivec2 pixel) {
#ifdef SURFACES_DAIS_LIST
    uint name, weight;
    source_begin(pixel);
    while (source_next_triangle(name, weight)) {
        float distance_m = record_distance(source_place(name), vec2(pixel));
        // Next to a triangle that is seen edge-on, its plane may lie behind the eye.
        if (distance_m > 0.0) {
            visit_distance(distance_m);
        }
    }
#else
    for (uint i = 0u; i < SAMPLES; ++i) {
        float depth = SAMPLE_DEPTH(pixel, i);
        if (depth > 0.0) {
            visit_distance(distance_from_depth(depth));
        }
    }
#endif
}

#endif
