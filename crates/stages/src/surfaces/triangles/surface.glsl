// Surfaces of a pixel for surfaces/shade/shade.glsl from a source of triangles: source_next_triangle(name, weight), source_place(name).
#ifndef AFTERLIGHT_TRIANGLE_SURFACE
#define AFTERLIGHT_TRIANGLE_SURFACE
#include "surfaces/triangles/interpolate.glsl"

Surface surface_of_triangle(uint place, vec2 pixel) {
    uint material;
    SurfacePoint p = interpolated_point(place, pixel, material);
    MaterialData m = load_material(material);
    return surface_at(m, p, base_color_at(m, p).rgb);
}

#ifdef LOW_RATE
#include "surfaces/low_rate/low_rate.glsl"
#endif

// Passes over triangles that found no room: what stands in their place is another triangle, which must not show. The pixel's other
// surfaces take their samples.
bool source_next_record(out uint name, out uint place, out uint weight) {
    bool found;
    do {
        found = source_next_triangle(name, weight);
        place = found ? source_place(name) : 0u;
    } while (found && !has_record(place));
    return found;
}

bool source_next(out Surface s, out uint weight) {
    uint name, place;
    if (!source_next_record(name, place, weight)) {
        return false;
    }
    s = surface_of_triangle(place, vec2(source_pixel));
#ifdef LOW_RATE
    low_rate_next(source_pixel, name, weight);
#endif
    return true;
}

#endif
