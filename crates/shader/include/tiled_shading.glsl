// Shades one pixel in each thread by the lights of its tile. Needs tiles.glsl and shading.glsl.
#ifndef AFTERLIGHT_TILED_SHADING
#define AFTERLIGHT_TILED_SHADING
#include "shading.glsl"
#include "tiles.glsl"

#ifdef EMIT_TILE_LIGHTS
// For tests: the bits of every tile, ceil(lights / 32) words each.
layout(set = 0, binding = 15, scalar) writeonly buffer TileLights {
    uint tile_light_bits[];
};

void emit_tile_lights(uint first) {
    uint words = (frame.light_count + 31u) / 32u;
    uint word = first / 32u + gl_LocalInvocationIndex;
    if (gl_LocalInvocationIndex < BATCH_WORDS && word < words) {
        uint tile = gl_WorkGroupID.y * frame.tile_count.x + gl_WorkGroupID.x;
        tile_light_bits[tile * words + word] = tile_lights[gl_LocalInvocationIndex];
    }
}
#else
void emit_tile_lights(uint first) {}
#endif

// Radiance of the lights of the batch from `first` on that touch the tile (after tile_cull).
vec3 tile_batch_radiance(ShadingPoint p, uint first) {
    vec3 radiance = vec3(0.0);
    uint words = (min(frame.light_count - first, BATCH_LIGHTS) + 31u) / 32u;
    for (uint w = 0u; w < words; ++w) {
        for (uint bits = tile_lights[w]; bits != 0u; bits &= bits - 1u) {
            radiance += light_radiance(p, first + w * 32u + uint(findLSB(bits)));
        }
    }
    return radiance;
}

// Radiance of all lights that touch the tile. The whole group calls it; `lit` is false for pixels without a surface or
// with an unlit one.
vec3 tiled_radiance(ShadingPoint p, bool lit) {
    TileFrustum t = tile_frustum();
    vec3 radiance = vec3(0.0);
    for (uint first = 0u; first < frame.light_count; first += BATCH_LIGHTS) {
        tile_cull(t, first);
        emit_tile_lights(first);
        if (lit) {
            radiance += tile_batch_radiance(p, first);
        }
    }
    return radiance;
}

#endif
