// Surfaces of the visibility buffer: triangle IDs, or with SAMPLES_IN_KEYS the keys of compute_raster.
#ifndef AFTERLIGHT_VISIBLE_SURFACE
#define AFTERLIGHT_VISIBLE_SURFACE
#include "triangle.glsl"

#ifdef SAMPLES_IN_KEYS
#include "surfaces/compute_raster/key_ids.glsl"

uint visible_triangle(ivec2 pixel) {
    uint order = sample_order(pixel, 0u);
    return order == NO_TRIANGLE ? NO_TRIANGLE : triangle_id_from_order(order);
}
#else
layout(set = 0, binding = 8) uniform utexture2D ids;

uint visible_triangle(ivec2 pixel) {
    return texelFetch(ids, pixel, 0).r;
}
#endif

// The surface that a pixel shows; false where there is none.
bool visible_surface(uvec2 pixel, out Surface s) {
    uint id = visible_triangle(ivec2(pixel));
    if (id == NO_TRIANGLE) {
        return false;
    }
    uint material;
    SurfacePoint point = triangle_point(id, ndc_from_pixel(pixel), material);
    MaterialData m = load_material(material);
    s = surface_at(m, point, base_color_at(m, point).rgb);
    return true;
}

#endif
