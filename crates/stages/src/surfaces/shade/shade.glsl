// Shades the surfaces of a pixel and averages them by their weights, whatever holds them. A technique names the header that is included
// as "source" in its variants.txt.
//
// A source has three parts: source_begin(pixel); source_next(surface, weight), called until it is false; and source_background, the
// number of samples without a surface. Weights are numbers of samples; they and the background sum to SAMPLES.
#include "shading.glsl"
#include "heat.glsl"
#include "sample_depth.glsl"

#include "source"

// 0 the image, 1 sample-usage, 2 invocations, 3 edges, 4 weights (views::number in crates/frame).
layout(constant_id = 9) const uint VIEW = 0u;

uint shaded_count;  // surfaces shaded
uint weight_sum;

// What the surfaces of a pixel give it, from the sum over them; there must be one.
vec3 of_surfaces(vec3 weighted_radiance) {
    // Samples that a list dropped take the colour of the others; else the factor is exactly 1.
    float share = float(SAMPLES - source_background) / float(weight_sum);
    return weighted_radiance * share / float(SAMPLES);
}

// Radiance of a pixel from the sum over its surfaces, or what a view shows of it.
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
