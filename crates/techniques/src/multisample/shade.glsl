// Shades the surfaces of a pixel and averages them by their weights. Where the surfaces come from is up to the source, which a SOURCE_*
// macro names.
//
// A source defines source_begin(pixel), source_next(surface, weight), which is called until it returns false, and source_background, the
// number of samples without a surface. A weight is a number of samples; the weights and the background sum to SAMPLES.
#include "shading.glsl"
#include "heat.glsl"
#include "multisample/sample_depth.glsl"

#if defined(SOURCE_DEDUP)
#include "multisample/source_dedup.glsl"
#elif defined(SOURCE_DAIS)
#include "dais/source_dais.glsl"
#elif defined(SOURCE_DAIS_LIST)
#include "dais_list/source_dais_list.glsl"
#elif defined(SOURCE_LIST)
#include "gbuffer_list/source_list.glsl"
#else
#include "multisample/source_samples.glsl"
#endif

// 0 the image, 1 sample-usage, 2 invocations, 3 edges, 4 weights (techniques/src/view/mod.rs).
layout(constant_id = 9) const uint VIEW = 0u;

uint shaded_count;  // surfaces shaded
uint weight_sum;

// The radiance that a pixel gets from its surfaces, given their weighted sum. The pixel must show at least one.
vec3 of_surfaces(vec3 weighted_radiance) {
    // Samples that a list has dropped take the mean colour of the others. Without dropped samples the factor is exactly 1.
    float share = float(SAMPLES - source_background) / float(weight_sum);
    return weighted_radiance * share / float(SAMPLES);
}

// Radiance of a pixel from the weighted sum over its surfaces; or, in a debug view, the colour that the view shows.
vec3 resolved(vec3 weighted_radiance) {
    if (VIEW == 1u) {
        return sample_usage_color(shaded_count, SAMPLES);
    }
    if (VIEW == 2u) {
        return invocations_color(shaded_count);
    }
    if (VIEW == 3u) {
        return vec3(shaded_count > 1u ? 1.0 : 0.0);
    }
    if (VIEW == 4u) {
        uint sum = weight_sum + source_background;
        return vec3(sum > SAMPLES ? 1.0 : 0.0, 0.0, sum < SAMPLES ? 1.0 : 0.0);
    }
    if (weight_sum == 0u) {
        return frame.background_radiance;
    }
    return of_surfaces(weighted_radiance) + float(source_background) * frame.background_radiance / float(SAMPLES);
}
