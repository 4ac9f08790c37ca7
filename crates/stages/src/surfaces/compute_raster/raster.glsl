// Rasterisation in compute: coverage of every sample by Vulkan's rules, the nearest surface kept by a 64-bit maximum.
//
// Vertices are snapped to 1/256 pixel, edge functions are exact integers, ties follow the top-left rule: triangles that share
// an edge neither overlap nor leave a gap. A sample's key is its depth (reversed, so the greatest is nearest) above the
// complement of the triangle's place in the order of draws: of equal depths the first drawn wins, as in a raster pass.
//
// EDGE: the type of the edge functions that the shader has, int64_t if it does not say.
#ifndef AFTERLIGHT_RASTER
#define AFTERLIGHT_RASTER
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#define EXPLICIT_GRADIENTS
#include "frame.glsl"
#include "triangle.glsl"
#include "samples.glsl"
#ifndef EDGE
#define EDGE int64_t
#endif

// One key for each sample; the keys of a pixel are neighbours.
layout(set = 0, binding = 8, scalar) buffer SampleKeys {
    uint64_t sample_keys[];
};
// VkDrawIndexedIndirectCommand: index count, 1, first index, vertex offset, draw.
layout(set = 0, binding = 9, scalar) readonly buffer DrawCommands {
    uint draw_commands[];
};

const int SUBPIXELS = 256;
// Sample locations are multiples of 1/16 pixel.
const int STEP = SUBPIXELS / 16;
// Half the side of the square around the image's centre within which vertices are snapped as they are, pixels. A triangle that leaves it is
// clipped to it first: edges stay straight, and coordinates of 24 bits and images of up to 16,384 pixels keep products of differences within
// 51 bits. A float so far out still resolves 1/256 pixel.
const float GUARD_BAND_PX = 32768.0;

// A triangle on the screen, its front towards the viewer, vertices so ordered that the inside is at positive edge functions and p0 is the
// farthest.
struct ScreenTriangle {
    ivec2 p0, p1, p2;   // 1/256 pixel
    float depth;        // at p0
    vec2 depth_gain;    // of the edge functions of p2 -> p0 and p0 -> p1, not negative
};

struct RasterDraw {
    DrawData data;
    uint draw;
    bool double_sided;
    float alpha_cutoff;     // 0: no alpha test
};

RasterDraw load_raster_draw(uint command) {
    uint draw = draw_commands[command * 5u + 4u];
    DrawData d = load_draw(draw_data, draw);
    MaterialData m = load_material(d.material);
    return RasterDraw(d, draw, (m.flags & MATERIAL_DOUBLE_SIDED) != 0u, m.alpha_cutoff);
}

ivec2 snapped(vec4 clip) {
    vec2 px = (clip.xy / clip.w * 0.5 + 0.5) * vec2(frame.size_px);
    return ivec2(round(px * float(SUBPIXELS)));
}

// Whether a vertex may be snapped as it is: behind the near plane and within the guard band.
bool is_within(vec4 clip) {
    return clip.z <= clip.w && all(lessThanEqual(abs(clip.xy) * vec2(frame.size_px), vec2(2.0 * GUARD_BAND_PX * clip.w)));
}

// An exact integer that is not negative as a float, rounded once or twice. Devices convert 64 bits at a quarter of the speed of 32.
float float_of(int e) {
    return float(e);
}
float float_of(int64_t e) {
    uvec2 halves = unpackUint2x32(uint64_t(e));
    return float(halves.y) * 4294967296.0 + float(halves.x);
}

// Twice the area, positive where the vertices run clockwise on the screen, whose y points down.
int64_t doubled_area(ivec2 p0, ivec2 p1, ivec2 p2) {
    ivec2 a = p1 - p0, b = p2 - p0;
    return int64_t(a.x) * int64_t(b.y) - int64_t(a.y) * int64_t(b.x);
}

// Whether a triangle or a polygon of this area shows.
bool shows(RasterDraw d, int64_t area) {
    bool mirrored = (d.data.flags & DRAW_MIRRORED) != 0u;
    bool front = (area < 0L) != mirrored;
    return area != 0L && (front || d.double_sided);
}

// The triangle of three vertices whose area is not 0.
//
// Depth is interpolated from the farthest vertex by what the two others are nearer, with the exact edge functions as weights: all terms are
// positive, so that no digits cancel, however thin or steep the triangle is. A plane over the screen in floats loses them. The result does
// not depend on the order of the vertices.
ScreenTriangle ordered_triangle(ivec2 p0, ivec2 p1, ivec2 p2, vec3 depth, int64_t area) {
    ScreenTriangle t = ScreenTriangle(p0, p1, p2, depth.x, vec2(0.0));
    if (area < 0L) {
        t.p1 = p2;
        t.p2 = p1;
        depth = depth.xzy;
    }
    if (depth.y < depth.x && depth.y <= depth.z) {
        t = ScreenTriangle(t.p1, t.p2, t.p0, depth.y, vec2(0.0));
        depth = depth.yzx;
    } else if (depth.z < depth.x) {
        t = ScreenTriangle(t.p2, t.p0, t.p1, depth.z, vec2(0.0));
        depth = depth.zxy;
    }
    t.depth_gain = (depth.yz - depth.x) / float_of(abs(area));
    return t;
}

// A triangle whose vertices are all within; false where it does not show.
bool screen_triangle(RasterDraw d, vec4 c0, vec4 c1, vec4 c2, out ScreenTriangle t) {
    ivec2 p0 = snapped(c0), p1 = snapped(c1), p2 = snapped(c2);
    int64_t area = doubled_area(p0, p1, p2);
    if (!shows(d, area)) {
        return false;
    }
    t = ordered_triangle(p0, p1, p2, vec3(c0.z / c0.w, c1.z / c1.w, c2.z / c2.w), area);
    return true;
}

// Where sample i stands, steps of 1/16 pixel from the pixel's corner: a whole number.
ivec2 sample_steps(uint i) {
    return ivec2(sample_location(i) * float(SUBPIXELS / STEP));
}

// By how many STEPs the edge function of an edge d changes over these steps. 32 bits hold it: an edge spans at most 2^24 subpixels each way.
int edge_change(ivec2 d, ivec2 steps) {
    return d.x * steps.y - d.y * steps.x;
}

// Edge functions of p2 -> p0 and p0 -> p1 at a pixel's corner, and the edges: what depth is interpolated by.
struct DepthEdges {
    EDGE at_p1, at_p2;
    ivec2 d20, d01;
};

// Depth over the samples of a pixel that a triangle covers: how much nearer than its farthest vertex one of them is, and by what it changes
// from there.
struct PixelDepth {
    vec2 gain;          // for each STEP of the edge functions
    vec2 nearer;        // at the sample that stands at `steps`
    ivec2 steps;
};

// Only at one sample are 64 bits converted. That sample must be covered: its edge functions are not negative then, nor are those of any other
// that is, so a change is no greater than the greater of the two, and what floats lose of it no more than what they lose of that.
PixelDepth pixel_depth(ScreenTriangle t, DepthEdges e, uint covered_sample) {
    ivec2 s = sample_steps(covered_sample);
    EDGE at_p1 = e.at_p1 + EDGE(STEP) * EDGE(edge_change(e.d20, s)), at_p2 = e.at_p2 + EDGE(STEP) * EDGE(edge_change(e.d01, s));
    return PixelDepth(t.depth_gain * float(STEP), t.depth_gain * vec2(float_of(at_p1), float_of(at_p2)), s);
}

// Depth at a sample that the triangle covers.
float depth_at(ScreenTriangle t, DepthEdges e, PixelDepth p, uint i) {
    ivec2 steps = sample_steps(i) - p.steps;
    // Sums and products apart: with one of them fused, a triangle and its reverse would differ by a rounding.
    precise vec2 nearer = p.nearer + p.gain * vec2(edge_change(e.d20, steps), edge_change(e.d01, steps));
    precise float sum = nearer.x + nearer.y;
    return min(t.depth + sum, 1.0);
}

// The least value of the edge function from a to b that is inside: 0 where a sample exactly on the edge belongs to the triangle (top-left
// rule), else 1.
int edge_least(ivec2 a, ivec2 b) {
    ivec2 d = b - a;
    return d.y < 0 || d.y == 0 && d.x > 0 ? 0 : 1;
}

// First and last pixel that a triangle's box touches, within the image; empty where first > last.
void pixel_box(ScreenTriangle t, out ivec2 first, out ivec2 last) {
    first = max(min(t.p0, min(t.p1, t.p2)) >> 8, ivec2(0));
    last = min(max(t.p0, max(t.p1, t.p2)) >> 8, ivec2(frame.size_px) - 1);
}

uint key_index(ivec2 pixel, uint i) {
    return (uint(pixel.y) * frame.size_px.x + uint(pixel.x)) * SAMPLES + i;
}

void vertices_clip(DrawData d, uvec3 v, out vec4 c0, out vec4 c1, out vec4 c2) {
    c0 = frame.clip_from_world * vec4(load_position(d, v.x), 1.0);
    c1 = frame.clip_from_world * vec4(load_position(d, v.y), 1.0);
    c2 = frame.clip_from_world * vec4(load_position(d, v.z), 1.0);
}

// Alpha test at the pixel's centre, as a fragment shader has it.
bool passes_alpha(RasterDraw d, uint triangle, ivec2 pixel) {
#ifdef ALPHA_MASK
    if (d.alpha_cutoff <= 0.0) {
        return true;
    }
    uint material;
    uint id = d.draw << TRIANGLE_BITS | triangle;
    SurfacePoint p = triangle_point(id, ndc_from_pixel(uvec2(pixel)), material);
    return base_color_at(load_material(material), p).a >= d.alpha_cutoff;
#else
    return true;
#endif
}

// Writes the triangle's key to every sample of the mask where it is the nearest so far. `order` is the triangle's place in the order of draws.
void keep_nearest(ivec2 pixel, uint covered, ScreenTriangle t, DepthEdges edges, uint order, RasterDraw d) {
    PixelDepth at = pixel_depth(t, edges, uint(findLSB(covered)));
    uint depth_bits[SAMPLES];
    uint wins = 0u;
    for (uint i = 0u; i < SAMPLES; ++i) {
        if ((covered >> i & 1u) != 0u) {
            float depth = depth_at(t, edges, at, i);
            depth_bits[i] = floatBitsToUint(depth);
            uint64_t key = packUint2x32(uvec2(~order, depth_bits[i]));
            // If this plain read is out of date, the key was smaller: an atomic is done that was not needed, and no sample is lost.
            wins |= depth > 0.0 && key > sample_keys[key_index(pixel, i)] ? 1u << i : 0u;
        }
    }
    if (wins == 0u || !passes_alpha(d, order & ((1u << TRIANGLE_BITS) - 1u), pixel)) {
        return;
    }
    for (uint i = 0u; i < SAMPLES; ++i) {
        if ((wins >> i & 1u) != 0u) {
            atomicMax(sample_keys[key_index(pixel, i)], packUint2x32(uvec2(~order, depth_bits[i])));
        }
    }
}

#endif
