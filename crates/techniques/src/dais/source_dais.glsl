// Surfaces of a pixel from a visibility buffer and the triangle buffer: each triangle once, weighted by its samples (Schied
// and Dachsbacher 2015, Listing 1).
//
// REFERENCES: samples hold 24 bits of reference and 8 bits of coverage, as in the paper. WIDE_REFERENCES: 32 bits of reference. Else
// a triangle's name. Where there is no coverage, which samples share a triangle is found by comparing them.
#include "surfaces/triangles/interpolate.glsl"
#if !defined(REFERENCES) && !defined(WIDE_REFERENCES)
#include "surfaces/triangles/index.glsl"
#endif
#define IDS_BINDING 9
#include "surfaces/visible/triangles.glsl"

ivec2 source_pixel;
uint source_mask;           // samples that need to be shaded
uint source_background;     // samples without a surface

void source_begin(ivec2 pixel) {
    source_pixel = pixel;
    source_mask = all_samples();
    source_background = 0u;
}

// Finds the next triangle of the pixel, as the number that identifies it, and its samples.
bool source_next_triangle(out uint name, out uint weight) {
    weight = 0u;
    name = NO_TRIANGLE;
    while (weight == 0u && source_mask != 0u) {
#ifdef REFERENCES
        uint first = 1u << uint(findLSB(source_mask));
        name = sample_triangle(source_pixel, uint(findLSB(source_mask)));
        // Of the samples that the triangle covers, those that no earlier triangle has taken.
        uint same = name == NO_TRIANGLE ? first : (name >> 24 | first) & source_mask;
        source_mask &= ~same;
#else
        Visible v = take_triangle(source_pixel, source_mask);
        name = v.id;
        uint same = v.samples;
#endif
        if (name == NO_TRIANGLE) {
            source_background += uint(bitCount(same));
        } else {
            weight = uint(bitCount(same));
        }
    }
#ifdef REFERENCES
    name &= 0xffffffu;
#endif
    return weight != 0u;
}

// A triangle's place in the triangle buffer.
uint source_place(uint name) {
#if defined(REFERENCES) || defined(WIDE_REFERENCES)
    return name;
#else
    return triangle_index(name);
#endif
}

#include "surfaces/triangles/surface.glsl"
