// Surfaces of a pixel from its list of references to triangles (Schied and Dachsbacher 2015, section 4.3).
//
// PLACES: references are places in the triangle buffer, else triangle IDs.
#include "dais_list/pixel_lists.glsl"
#include "surfaces/triangles/interpolate.glsl"
#ifndef PLACES
#include "surfaces/triangles/index.glsl"
#endif

layout(set = 0, binding = 9, scalar) readonly buffer Heads {
    uint heads[];
};
layout(set = 0, binding = 10, scalar) readonly buffer Nodes {
    uvec2 nodes[];
};
// Samples of a pixel that found no node, 8 bits.
layout(set = 0, binding = 26, scalar) readonly buffer SampleDrops {
    uint sample_drops[];
};
layout(constant_id = 15) const uint BOUNDED = 0u;

ivec2 source_pixel;
uint source_link;           // the rest of the list, in the format of a head
uint source_background;     // samples without a surface: those that no entry so far has

uint pixel_number(ivec2 pixel) {
    return uint(pixel.y) * frame.size_px.x + uint(pixel.x);
}

// Samples that were dropped because no node was left must not count as background.
uint dropped_samples(uint pixel) {
    return BOUNDED != 0u ? sample_drops[pixel / 4u] >> pixel % 4u * 8u & 0xffu : 0u;
}

void source_begin(ivec2 pixel) {
    source_pixel = pixel;
    source_link = heads[pixel_number(pixel)];
    source_background = SAMPLES - min(dropped_samples(pixel_number(pixel)), SAMPLES);
}

// The next triangle of the pixel, by its reference, and its samples.
bool source_next_triangle(out uint name, out uint weight) {
    weight = 0u;
    name = NO_TRIANGLE;
    if (source_link == 0u) {
        return false;
    }
    uint entry = source_link;
    source_link = 0u;
    if ((entry & ENTRY) == 0u) {
        uvec2 node = nodes[entry - 1u];
        entry = node.x;
        source_link = node.y;
    }
    name = entry_reference(entry);
    weight = entry_samples(entry);
    source_background -= min(weight, source_background);
    return true;
}

// A triangle's place in the triangle buffer.
uint source_place(uint name) {
#ifdef PLACES
    return name;
#else
    return triangle_index(name);
#endif
}

#include "surfaces/triangles/surface.glsl"
