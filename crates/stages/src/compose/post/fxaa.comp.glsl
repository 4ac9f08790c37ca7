// Fast approximate anti-aliasing (Lottes 2009, version 3.11, quality): one pass over the image that is shown.
//
// A pixel whose neighbourhood has contrast in luma gets the direction of its edge, walks along the edge to both ends, and
// takes its colour a fraction of a pixel across the edge: the more, the nearer it is to the nearer end, if that end turns
// away from the pixel's side. Details smaller than a pixel shift it as well.
//
// Departures: pixels mix in radiance, and the constants below. The original lets the sampler mix what is shown, which darkens
// edges: on builtin:edge at 160x90 its mean FLIP error against 8x8 samples is 0.0071, without a filter 0.0031, here 0.0025.
//
// In: color, RGBA8, sRGB-encoded, linear filter; hdr, RGBA16F, radiance. Out: final_color, RGBA8, sRGB-encoded.
// One thread a pixel, groups of 8x8.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "compose/post/blend.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform sampler2D color;
layout(set = 0, binding = 9) uniform texture2D hdr;
layout(set = 0, binding = 10, rgba8) writeonly uniform image2D final_color;

// Least contrast of a neighbourhood, as a share of its brightest luma: lower finds more edges, and blurs more texture. With
// 0.25 the colonnade at 640x360 comes off worse than without a filter (FLIP 0.0601, 0.0599); with this better (0.0597).
const float CONTRAST_RELATIVE = 0.333;
// Least absolute contrast: in darker places no staircase is visible.
const float CONTRAST_ABSOLUTE = 0.0625;
// Most that a detail smaller than a pixel shifts it, as a share of a pixel: 1 is softest, 0 leaves such details. The
// original's 0.75 blurs texture: colonnade at 320x180, FLIP 0.0802 instead of 0.0785.
const float SUBPIXEL = 0.25;
// Steps of the walk along the edge, pixels; they grow, since far ends matter less. Sum: 29.5.
const int STEP_COUNT = 12;
const float STEPS_PX[STEP_COUNT] = float[](1.0, 1.0, 1.0, 1.0, 1.0, 1.5, 2.0, 2.0, 2.0, 2.0, 4.0, 8.0);

float luma_of(vec3 rgb) {
    return dot(rgb, vec3(0.299, 0.587, 0.114));
}

float luma_at(vec2 position_px) {
    return luma_of(textureLod(color, position_px / vec2(frame.size_px), 0.0).rgb);
}

// Walks from a point between two rows (or columns) of pixels until the mean luma of the two leaves the edge's own.
// Returns the distance in pixels; `difference` is the luma at the end minus the edge's.
float walk(vec2 start_px, vec2 direction, float luma_edge, float luma_threshold, out float difference) {
    float distance_px = 0.0;
    for (int i = 0; i < STEP_COUNT; ++i) {
        distance_px += STEPS_PX[i];
        difference = luma_at(start_px + direction * distance_px) - luma_edge;
        if (abs(difference) >= luma_threshold) {
            break;
        }
    }
    return distance_px;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    vec2 center_px = vec2(pixel) + 0.5;
    vec4 rgba = texelFetch(color, ivec2(pixel), 0);
    float m = luma_of(rgba.rgb);
    float n = luma_at(center_px + vec2(0, -1)), s = luma_at(center_px + vec2(0, 1));
    float w = luma_at(center_px + vec2(-1, 0)), e = luma_at(center_px + vec2(1, 0));
    float most = max(max(max(n, s), max(w, e)), m);
    float contrast = most - min(min(min(n, s), min(w, e)), m);
    if (contrast < max(CONTRAST_ABSOLUTE, most * CONTRAST_RELATIVE)) {
        imageStore(final_color, ivec2(pixel), rgba);
        return;
    }
    float nw = luma_at(center_px + vec2(-1, -1)), ne = luma_at(center_px + vec2(1, -1));
    float sw = luma_at(center_px + vec2(-1, 1)), se = luma_at(center_px + vec2(1, 1));

    // Shift for details: how far the pixel lies off the mean of its neighbours, as a share of the contrast, smoothed.
    float mean = (2.0 * (n + s + w + e) + nw + ne + sw + se) / 12.0;
    float detail = smoothstep(0.0, 1.0, clamp(abs(mean - m) / contrast, 0.0, 1.0));
    float detail_shift_px = detail * detail * SUBPIXEL;

    // Direction: second differences down the columns are large at a horizontal edge.
    float horizontal = abs(nw - 2.0 * w + sw) + 2.0 * abs(n - 2.0 * m + s) + abs(ne - 2.0 * e + se);
    float vertical = abs(nw - 2.0 * n + ne) + 2.0 * abs(w - 2.0 * m + e) + abs(sw - 2.0 * s + se);
    bool is_horizontal = horizontal >= vertical;

    // Which of the two sides across the edge is steeper: the edge lies there.
    float before = is_horizontal ? n : w, after = is_horizontal ? s : e;
    bool is_before = abs(before - m) >= abs(after - m);
    float other = is_before ? before : after;
    vec2 across = (is_horizontal ? vec2(0, 1) : vec2(1, 0)) * (is_before ? -1.0 : 1.0);
    vec2 along = is_horizontal ? vec2(1, 0) : vec2(0, 1);

    float luma_edge = 0.5 * (m + other);
    float threshold = 0.25 * abs(other - m);
    vec2 start_px = center_px + 0.5 * across;
    float end_before, end_after;
    float distance_before_px = walk(start_px, -along, luma_edge, threshold, end_before);
    float distance_after_px = walk(start_px, along, luma_edge, threshold, end_after);

    // At the nearer end the edge turns to one side; a pixel on that side keeps its colour.
    bool nearer_is_before = distance_before_px < distance_after_px;
    float end = nearer_is_before ? end_before : end_after;
    float nearer_px = min(distance_before_px, distance_after_px);
    bool turns_away = (end < 0.0) != (m < luma_edge);
    float edge_shift_px = turns_away ? 0.5 - nearer_px / (distance_before_px + distance_after_px) : 0.0;

    ivec2 neighbour = clamp(ivec2(pixel) + ivec2(across), ivec2(0), ivec2(frame.size_px) - 1);
    vec3 radiance = mix(texelFetch(hdr, ivec2(pixel), 0).rgb, texelFetch(hdr, neighbour, 0).rgb,
                        max(edge_shift_px, detail_shift_px));
    imageStore(final_color, ivec2(pixel), vec4(display_color(radiance), rgba.a));
}
