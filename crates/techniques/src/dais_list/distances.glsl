// View distances of the surfaces of a pixel from its list of triangles: a source for templates that ask where surfaces stand.
#ifndef AFTERLIGHT_DISTANCES
#define AFTERLIGHT_DISTANCES
#include "shading.glsl"
#include "dais_list/source_dais_list.glsl"

void visit_distance(float distance_m);

void visit_pixel(ivec2 pixel) {
    uint name, weight;
    source_begin(pixel);
    while (source_next_triangle(name, weight)) {
        visit_distance(record_distance(source_place(name), vec2(pixel)));
    }
}

#endif
