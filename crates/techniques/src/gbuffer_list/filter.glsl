// Which pixels and surfaces keep only one sample (Fridvalszky and Toth 2020, section 5).
#ifndef AFTERLIGHT_FILTER
#define AFTERLIGHT_FILTER
#include "samples.glsl"

// Bits of FILTERS: techniques/src/gbuffer_list/filter.rs.
layout(constant_id = 14) const uint FILTERS = 0u;
const uint FILTER_ELLIPSE = 1u;
const uint FILTER_RECTANGLE = 2u;
const uint FILTER_DEPTH = 4u;
const uint FILTER_OBJECTS = 8u;
const uint FILTER_DEPTH_EDGES = 16u;
const uint FILTER_EDGES = 32u;
layout(constant_id = 15) const uint SMOOTH_INSIDE = 1u;     // the region is anti-aliased inside; else outside
layout(constant_id = 16) const float REGION_LEFT = 0.0;     // shares of the image
layout(constant_id = 17) const float REGION_TOP = 0.0;
layout(constant_id = 18) const float REGION_RIGHT = 1.0;
layout(constant_id = 19) const float REGION_BOTTOM = 1.0;
layout(constant_id = 20) const float DEPTH_THRESHOLD_M = 0.0;
layout(constant_id = 21) const float EDGE_THRESHOLD = 0.0;  // see depth_edge and surfaces_differ
layout(constant_id = 24) const uint DEPTH_RANGE = 0u;       // depth edges by the range of depths; else by a share of a distance

#ifndef SAMPLES_IN_KEYS
layout(set = 0, binding = 9) uniform SAMPLED_IMAGE gbuffer_depth;
#endif
layout(set = 0, binding = 12, scalar) readonly buffer SingleSampleDraws {
    uint single_sample_draws[];     // a bit a draw
};

// Section 5.1: outside of a region of the screen.
bool filtered_by_region(ivec2 pixel) {
    vec2 at = (vec2(pixel) + 0.5) / vec2(frame.size_px);
    vec2 low = vec2(REGION_LEFT, REGION_TOP), high = vec2(REGION_RIGHT, REGION_BOTTOM);
    if ((FILTERS & FILTER_ELLIPSE) != 0u) {
        vec2 e = (2.0 * at - low - high) / max(high - low, vec2(1e-6));
        if ((dot(e, e) <= 1.0) != (SMOOTH_INSIDE != 0u)) {
            return true;
        }
    }
    bool inside = all(greaterThanEqual(at, low)) && all(lessThan(at, high));
    return (FILTERS & FILTER_RECTANGLE) != 0u && inside != (SMOOTH_INSIDE != 0u);
}

// Section 5.4: least and greatest depth of the samples, of which the background is one, differ by more than a threshold. A departure is to
// measure it as a share of the least view distance, so that edges far away are told as those nearby are.
bool depth_edge(ivec2 pixel) {
    float near = 0.0, far = 1.0;    // depth is reversed
    for (uint i = 0u; i < SAMPLES; ++i) {
        float depth = SAMPLE_DEPTH(pixel, i);
        near = max(near, depth);
        far = min(far, depth);
    }
    if (DEPTH_RANGE != 0u) {
        return near - far > EDGE_THRESHOLD;
    }
    if (far <= 0.0) {
        return near > 0.0;
    }
    float nearest_m = distance_from_depth(near);
    return distance_from_depth(far) - nearest_m > EDGE_THRESHOLD * nearest_m;
}

// Whether a pixel keeps one sample whatever shows in it.
bool single_sample_pixel(ivec2 pixel) {
    return filtered_by_region(pixel) || (FILTERS & FILTER_DEPTH_EDGES) != 0u && !depth_edge(pixel);
}

// Whether a surface is kept only where it holds the pixel's own block: by section 5.2 beyond a distance, by section 5.3 where
// its object is flagged.
bool single_sample_surface(uint draw, float distance_m) {
    return (FILTERS & FILTER_DEPTH) != 0u && distance_m > DEPTH_THRESHOLD_M
        || (FILTERS & FILTER_OBJECTS) != 0u && (single_sample_draws[draw >> 5] >> (draw & 31u) & 1u) != 0u;
}

#endif
