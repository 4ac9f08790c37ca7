// Surfaces of a pixel from a visibility buffer and the triangle buffer: each triangle once, weighted by its samples (Schied
// and Dachsbacher 2015, Listing 1).
//
// REFERENCES: samples hold 24 bits of reference and 8 bits of coverage, as in the paper. Else they hold a triangle's name alone,
// and which samples share it is found by comparing them.
#include "triangle_buffer/interpolate.glsl"
#ifndef REFERENCES
#include "triangle_buffer/index.glsl"
#endif
#ifdef SAMPLES_IN_KEYS
uint sample_triangle(ivec2 pixel, uint i) {
    return ~sample_keys[sample_word(pixel, i)];
}
#else
layout(set = 0, binding = 9) uniform SAMPLED_IMAGE ids;

uint sample_triangle(ivec2 pixel, uint i) {
    return packUnorm4x8(FETCH_SAMPLE(ids, pixel, i));
}
#endif

ivec2 source_pixel;
uint source_mask;           // samples that need to be shaded
uint source_background;     // samples without a surface

// Bounds of what a tile's lights must reach, from the depth buffer.
float source_distance(ivec2 pixel, uint i) {
    float depth = SAMPLE_DEPTH(pixel, i);
    return depth == 0.0 ? -1.0 : distance_from_depth(depth);
}

void source_begin(ivec2 pixel) {
    source_pixel = pixel;
    source_mask = 0xffffffffu >> (32u - SAMPLES);
    source_background = 0u;
}

bool source_next(out Surface s, out uint weight) {
    weight = 0u;
    uint id = NO_TRIANGLE;
    while (weight == 0u && source_mask != 0u) {
        uint first = uint(findLSB(source_mask));
        id = sample_triangle(source_pixel, first);
#ifdef REFERENCES
        // Of what the triangle covers, what no triangle before has had.
        uint same = id == NO_TRIANGLE ? 1u << first : (id >> 24 | 1u << first) & source_mask;
#else
        uint same = 1u << first;
        for (uint i = first + 1u; i < SAMPLES; ++i) {
            same |= (source_mask >> i & 1u) != 0u && sample_triangle(source_pixel, i) == id ? 1u << i : 0u;
        }
#endif
        source_mask &= ~same;
        if (id == NO_TRIANGLE) {
            source_background += uint(bitCount(same));
        } else {
            weight = uint(bitCount(same));
        }
    }
    if (weight == 0u) {
        return false;
    }
    uint material;
#ifdef REFERENCES
    uint place = id & 0xffffffu;
#else
    uint place = triangle_index(id);
#endif
    SurfacePoint p = interpolated_point(place, source_pixel, material);
    MaterialData m = load_material(material);
    s = surface_at(m, p, base_color_at(m, p).rgb);
    return true;
}
