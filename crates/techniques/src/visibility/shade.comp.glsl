// Shades the visibility buffer: a thread fetches the triangle of its pixel, interpolates its attributes, evaluates the material and
// lights it (Burns and Hunt 2013; Petrescu et al. 2016, section 4.11).
//
// Departure: no sort of tiles by shader, since all materials share one.
// In: ids, R32_UINT, or the keys of compute_raster. Out: hdr, RGBA16F, radiance. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#define EXPLICIT_GRADIENTS
#include "light_step/radiance.glsl"
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

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    uint id = visible_triangle(pixel);
    vec3 radiance = frame.background_radiance;
    if (id != NO_TRIANGLE) {
        uint material;
        SurfacePoint point = triangle_point(id, ndc_from_pixel(uvec2(pixel)), material);
        MaterialData m = load_material(material);
        radiance = stepped_radiance(surface_at(m, point, base_color_at(m, point).rgb), uvec2(pixel));
    }
    imageStore(hdr, pixel, vec4(radiance, 1.0));
}
