// SMAA, second pass: what share of each pixel lies beyond its edges (Jimenez et al. 2012, sections 3.2 to 3.4).
//
// Every edge belongs to a run along a row or column, or to a staircase of 45 degrees. What the boundary does at the two ends
// of the run tells the line that was rasterised; areas.rs has integrated the share that this line cuts off the two pixels
// beside the edge. Horizontal and vertical runs share one path: coordinates are (along, across) the run.
//
// In: edges, RG8, linear filter; area, RG8, and search, R8UI, as areas.rs lays them out.
// Out: weights, RGBA8: what this pixel takes from the one above, what that one takes from this; the same to the left.
// One thread a pixel, groups of 8x8.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform sampler2D edges;
layout(set = 0, binding = 9) uniform sampler2D area;
layout(set = 0, binding = 10) uniform utexture2D search;
layout(set = 0, binding = 11, rgba8) writeonly uniform image2D weights;

// Layout of the area texture, as areas.rs.
const float ORTHOGONAL_TEXELS = 16.0;
const int DIAGONAL_TEXELS = 20, DIAGONAL_FIRST = 64;
// Size of each half of the search texture, as areas.rs.
const int SEARCH_CODES = 33;

// Steps of two pixels to each side of a run. The area texture reaches 225 pixels.
const int SEARCH_STEPS = 32;
// Steps of one pixel and one row to each side of a staircase: less than DIAGONAL_TEXELS.
const int DIAGONAL_STEPS = 19;
// Fewest steps of a staircase, besides the pixel's own.
const int DIAGONAL_MIN = 2;
// What is left of a corner's rounding: 1 rounds it as if it were a step of a line.
const float CORNER_ROUNDING = 0.25;

// Edge at the left side of a pixel; none outside the image.
bool left_edge(ivec2 pixel) {
    return texelFetch(edges, clamp(pixel, ivec2(0), ivec2(frame.size_px) - 1), 0).r > 0.5
        && all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(frame.size_px)));
}

bool top_edge(ivec2 pixel) {
    return texelFetch(edges, clamp(pixel, ivec2(0), ivec2(frame.size_px) - 1), 0).g > 0.5
        && all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(frame.size_px)));
}

// Edge that crosses the run, at the beginning of a pixel: coordinates (along, across).
bool crossing(ivec2 at, bool is_vertical) {
    return is_vertical ? top_edge(at.yx) : left_edge(at);
}

// Four pixels' edges at once, (crossing, along): the sampler weighs them so that their sum tells them apart.
vec2 four_edges(vec2 at_px, bool is_vertical) {
    vec2 size_px = vec2(frame.size_px);
    return is_vertical ? textureLod(edges, at_px.yx / size_px, 0.0).gr : textureLod(edges, at_px / size_px, 0.0).rg;
}

// Pixels of the run before or after this one.
int run_length(ivec2 at, bool is_vertical, bool is_after) {
    // Three quarters of the nearer pixel, seven eighths of this side of the run (areas.rs).
    vec2 at_px = vec2(at) + 0.5 + vec2(is_after ? 1.25 : -0.25, -0.125);
    int side = is_after ? SEARCH_CODES : 0;
    for (int k = 0; k < SEARCH_STEPS; ++k) {
        vec2 four = four_edges(at_px, is_vertical);
        uvec2 code = uvec2(round(four * 32.0));
        // Both pixels along the run, nothing across it: go on. 28/32 is both on this side.
        if (code.y < 28u || code.x > 0u) {
            int pixels = int(texelFetch(search, ivec2(side + int(code.x), int(code.y)), 0).r);
            return 2 * k + pixels - (is_after ? 0 : 1);
        }
        at_px.x += is_after ? 2.0 : -2.0;
    }
    return 2 * SEARCH_STEPS - 1;
}

// Shares of the pixel beyond a run's edge, and of the one across it: (this takes, that takes).
vec2 run_weights(ivec2 pixel, bool is_vertical) {
    ivec2 at = is_vertical ? pixel.yx : pixel;
    ivec2 d = ivec2(run_length(at, is_vertical, false), run_length(at, is_vertical, true));
    ivec2 first = at - ivec2(d.x, 0), past = at + ivec2(d.y + 1, 0);
    // Where the boundary goes at each end: to the other side (1), to this side (2).
    bvec2 other_side = bvec2(crossing(first + ivec2(0, -1), is_vertical), crossing(past + ivec2(0, -1), is_vertical));
    bvec2 this_side = bvec2(crossing(first, is_vertical), crossing(past, is_vertical));
    vec2 ends = vec2(other_side) + 2.0 * vec2(this_side);
    if (ends == vec2(0.0)) {
        return vec2(0.0);
    }
    vec2 texel = ends * ORTHOGONAL_TEXELS + sqrt(vec2(d)) + 0.5;
    vec2 share = textureLod(area, texel / vec2(textureSize(area, 0)), 0.0).rg;

    // A boundary that goes on across is a corner, not a step of a line: it is rounded less. The nearer end decides.
    bvec2 corner_this = bvec2(this_side.x && crossing(first + ivec2(0, 1), is_vertical),
                              this_side.y && crossing(past + ivec2(0, 1), is_vertical));
    bvec2 corner_other = bvec2(other_side.x && crossing(first + ivec2(0, -2), is_vertical),
                               other_side.y && crossing(past + ivec2(0, -2), is_vertical));
    vec2 nearer = vec2(d.x <= d.y, d.y <= d.x);
    nearer /= nearer.x + nearer.y;
    vec2 corner = vec2(dot(nearer, vec2(corner_this)), dot(nearer, vec2(corner_other)));
    return share * (1.0 - (1.0 - CORNER_ROUNDING) * corner);
}

// Steps of a staircase from a pixel's upper edge: `s` is 1 where it rises to the right, -1 to the left.
int steps_up(ivec2 pixel, int s) {
    int column = s > 0 ? 1 : 0;
    int k = 0;
    while (k < DIAGONAL_STEPS && left_edge(pixel + ivec2(s * k + column, -k - 1))
           && top_edge(pixel + ivec2(s * (k + 1), -k - 1))) {
        ++k;
    }
    return k;
}

int steps_down(ivec2 pixel, int s) {
    int column = s > 0 ? 0 : 1;
    int k = 0;
    while (k < DIAGONAL_STEPS && left_edge(pixel + ivec2(column - s * k, k))
           && top_edge(pixel + ivec2(-s * (k + 1), k + 1))) {
        ++k;
    }
    return k;
}

// How a staircase ends: 0 nothing, 1 goes on along the row, 2 goes on along the column.
int end_of_stairs(bool vertical, bool next_vertical, bool next_horizontal) {
    return vertical ? (next_vertical ? 2 : 0) : (next_horizontal ? 1 : 0);
}

// Shares as run_weights; `steps` is the staircase's length besides this pixel.
vec2 diagonal_weights(ivec2 pixel, int s, out int steps) {
    ivec2 d = ivec2(steps_down(pixel, s), steps_up(pixel, s));
    steps = d.x + d.y;
    if (steps < DIAGONAL_MIN) {
        return vec2(0.0);
    }
    ivec2 low = pixel + ivec2(-s * d.x, d.x), high = pixel + ivec2(s * d.y, -d.y);
    int low_column = low.x + (s > 0 ? 0 : 1), high_column = high.x + (s > 0 ? 1 : 0);
    int low_end = end_of_stairs(left_edge(ivec2(low_column, low.y)), left_edge(ivec2(low_column, low.y + 1)),
                                top_edge(low + ivec2(-s, 0)));
    int high_end = end_of_stairs(left_edge(ivec2(high_column, high.y - 1)), left_edge(ivec2(high_column, high.y - 2)),
                                 top_edge(high + ivec2(s, 0)));
    ivec2 texel = ivec2(DIAGONAL_FIRST, 0) + ivec2(low_end, high_end) * DIAGONAL_TEXELS + d;
    return texelFetch(area, texel, 0).rg;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    vec4 share = vec4(0.0);
    bool is_diagonal = false;
    if (top_edge(pixel)) {
        int rising_steps, falling_steps;
        vec2 rising = diagonal_weights(pixel, 1, rising_steps);
        vec2 falling = diagonal_weights(pixel, -1, falling_steps);
        is_diagonal = max(rising_steps, falling_steps) >= DIAGONAL_MIN;
        if (is_diagonal) {
            share.rg = rising_steps >= falling_steps ? rising : falling;
        } else {
            share.rg = run_weights(pixel, false);
        }
    }
    // A staircase's vertical steps belong to the line of its horizontal ones.
    if (left_edge(pixel) && !is_diagonal) {
        share.ba = run_weights(pixel, true);
    }
    imageStore(weights, pixel, share);
}
