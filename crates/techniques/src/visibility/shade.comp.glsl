// Shades the visibility buffer: a group of 16x16 threads fetches the triangles of its pixels, interpolates their
// attributes, evaluates materials and lights them by the tile's lights (Burns and Hunt 2013; Petrescu et al. 2016,
// section 4.11).
//
// Departure: no sort of tiles by shader, since all materials share one.
// In: ids, R32_UINT, or the keys of compute_raster. Out: hdr, RGBA16F, radiance. Dispatch: one group a tile.
#version 460
#extension GL_GOOGLE_include_directive : require
#define EXPLICIT_GRADIENTS
#include "tiled_shading.glsl"
#include "triangle.glsl"

#ifdef SAMPLES_IN_KEYS
#include "compute_raster/key_ids.glsl"

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
layout(set = 0, binding = 12, rgba16f) writeonly uniform image2D hdr;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(gl_GlobalInvocationID.xy, frame.size_px));
    uint id = inside ? visible_triangle(pixel) : NO_TRIANGLE;
    bool covered = id != NO_TRIANGLE;

    Surface s;
    s.unlit = true;
    ShadingPoint p;
    float distance_m = 0.0;
    vec3 radiance = frame.background_radiance;
    if (covered) {
        uint material;
        SurfacePoint point = triangle_point(id, ndc_from_pixel(uvec2(pixel)), material);
        MaterialData m = load_material(material);
        s = surface_at(m, point, base_color_at(m, point).rgb);
        p = shading_point(s);
        distance_m = max(dot(frame.distance_from_world, vec4(s.position_ws, 1.0)), 0.0);
        radiance = unlit_radiance(s);
    }
    if (tile_reduce_depth(covered, distance_m)) {
        radiance += tiled_radiance(p, covered && !s.unlit);
    }
    if (inside) {
        imageStore(hdr, pixel, vec4(radiance, 1.0));
    }
}
