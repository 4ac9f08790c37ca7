// Depth at the samples of a pixel. Needs frame.glsl.
#ifndef AFTERLIGHT_SAMPLE_DEPTH
#define AFTERLIGHT_SAMPLE_DEPTH
#include "samples.glsl"

#ifndef SAMPLES_IN_KEYS
layout(set = 0, binding = 8) uniform SAMPLED_IMAGE gbuffer_depth;
#endif

uint samples_without_surface(ivec2 pixel) {
    uint count = 0u;
    for (uint i = 0u; i < SAMPLES; ++i) {
        count += SAMPLE_DEPTH(pixel, i) == 0.0 ? 1u : 0u;
    }
    return count;
}

#endif
