// Shade and resolve, one thread a pixel: every surface that the source holds once, by all lights or, with LIGHTS_TILED, by
// those of the pixel's tile; LOW_RATE: with irradiance that pixels share.
//
// In: the source's images or buffers, gbuffer_depth. Out: hdr, RGBA16F, radiance. Dispatch: 8x8 groups; tiled 16x16.
#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef LIGHTS_TILED
#include "tiled_shading.glsl"
#else
layout(local_size_x = 8, local_size_y = 8) in;
#endif
#include "multisample/shade.glsl"

layout(set = 0, binding = 14, rgba16f) writeonly uniform image2D hdr;

#if defined(LIGHTS_TILED) && !defined(SOURCE_DAIS_LIST)
// View distances of a pixel's surfaces; false where it shows none.
bool distance_range(ivec2 pixel, out float nearest_m, out float farthest_m) {
    nearest_m = 3.402823e38;
    farthest_m = -1.0;
    for (uint i = 0u; i < SAMPLES; ++i) {
        float distance_m = source_distance(pixel, i);
        nearest_m = distance_m >= 0.0 ? min(nearest_m, distance_m) : nearest_m;
        farthest_m = max(farthest_m, distance_m);
    }
    return farthest_m >= 0.0;
}
#endif

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
#ifdef LIGHTS_TILED
    float nearest_m = 0.0, farthest_m = 0.0;
    bool covered = inside && distance_range(pixel, nearest_m, farthest_m);
    tile_reduce_range(covered, nearest_m, farthest_m);
    TileFrustum t = tile_frustum();
    uint first = 0u;
    do {
        tile_cull(t, first);
        if (inside) {
            source_begin(pixel);
            while (source_next(s, weight)) {
                if (first == 0u) {
                    radiance += float(weight) * unlit_radiance(s);
                    ++shaded_count;
                    weight_sum += weight;
                }
                if (!s.unlit) {
                    radiance += float(weight) * tile_batch_radiance(shading_point(s), first);
                }
            }
        }
        first += BATCH_LIGHTS;
    } while (first < frame.light_count);
#else
    if (inside) {
        source_begin(pixel);
        while (source_next(s, weight)) {
            radiance += float(weight) * surface_radiance(s);
            ++shaded_count;
            weight_sum += weight;
        }
    }
#endif
    if (inside) {
        imageStore(hdr, pixel, vec4(resolved(radiance), 1.0));
    }
}
