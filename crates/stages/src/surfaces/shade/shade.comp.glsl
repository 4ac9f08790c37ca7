// Shades and resolves one pixel in each thread: every surface of the source once, by the lights that lights/step/ finds for it. With
// LOW_RATE neighbouring pixels share the irradiance of indirect light.
//
// In: the source's images or buffers, gbuffer_depth. Out: hdr, RGBA16F, radiance. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 8, local_size_y = 8) in;
#include "surfaces/shade/shade.glsl"
#include "lights/step/radiance.glsl"

layout(set = 0, binding = 14, rgba16f) writeonly uniform image2D hdr;

void add_surface(Surface s, uint weight, ivec2 pixel, inout vec3 radiance) {
    radiance += float(weight) * stepped_radiance(s, uvec2(pixel));
    ++shaded_count;
    weight_sum += weight;
}

void main() {
#ifdef LOW_RATE
    ivec2 pixel = invocation_pixel();
#else
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
#endif
    bool inside = all(lessThan(uvec2(pixel), frame.size_px));
#ifdef LOW_RATE
    low_rate_fill(pixel, inside);
#endif
    vec3 radiance = vec3(0.0);
    Surface s;
    uint weight;
    shaded_count = 0u;
    weight_sum = 0u;
#ifdef LOW_RATE_QUADS
    if (inside) {
        source_begin(pixel);
    }
    // Threads of a quad ask each other: every thread of the subgroup stays until the last has no surface left.
    bool found = inside;
    do {
        found = found && source_next(s, weight);
        low_rate_share(found, s);
        if (found) {
            add_surface(s, weight, pixel, radiance);
        }
    } while (subgroupAny(found));
#else
    if (inside) {
        source_begin(pixel);
        while (source_next(s, weight)) {
            add_surface(s, weight, pixel, radiance);
        }
    }
#endif
    if (inside) {
        imageStore(hdr, pixel, vec4(resolved(radiance), 1.0));
    }
}
