// View distances of the surfaces of a pixel from the depth at its samples: the stages' own source for templates that ask where surfaces stand.
#ifndef AFTERLIGHT_DISTANCES
#define AFTERLIGHT_DISTANCES
#include "sample_depth.glsl"

void visit_distance(float distance_m);

void visit_pixel(ivec2 pixel) {
    for (uint i = 0u; i < SAMPLES; ++i) {
        float depth = SAMPLE_DEPTH(pixel, i);
        if (depth > 0.0) {
            visit_distance(distance_from_depth(depth));
        }
    }
}

#endif
