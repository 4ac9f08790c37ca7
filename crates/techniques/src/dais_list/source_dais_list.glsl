// Surfaces of a pixel from its list of references into the triangle buffer (Schied and Dachsbacher 2015, section 4.3).
#include "triangle_buffer/interpolate.glsl"

layout(set = 0, binding = 9, scalar) readonly buffer Heads {
    uint heads[];
};
layout(set = 0, binding = 10, scalar) readonly buffer Nodes {
    uvec2 nodes[];
};

ivec2 source_pixel;
uint source_link;           // head or next node plus one; 0 at the end
uint source_sum;
uint source_background;     // samples without a surface

void source_begin(ivec2 pixel) {
    source_pixel = pixel;
    source_link = heads[uint(pixel.y) * frame.size_px.x + uint(pixel.x)];
    source_sum = 0u;
    source_background = 0u;
}

// The next triangle of the pixel, by its place in the triangle buffer, and its samples.
bool source_next_triangle(out uint name, out uint weight) {
    weight = 0u;
    name = NO_TRIANGLE;
    if (source_link == 0u) {
        // Samples that were dropped for want of nodes are not the background: the depth buffer tells.
        source_background = source_sum < SAMPLES ? samples_without_surface(source_pixel) : 0u;
        return false;
    }
    name = source_link & 0x7fffffffu;
    weight = SAMPLES;
    if ((source_link & 0x80000000u) != 0u) {
        source_link = 0u;
    } else {
        uvec2 node = nodes[source_link - 1u];
        name = node.x & 0xfffffffu;
        weight = (node.x >> 28) + 1u;
        source_link = node.y;
    }
    source_sum += weight;
    return true;
}

uint source_place(uint name) {
    return name;
}

#include "triangle_buffer/surface.glsl"
