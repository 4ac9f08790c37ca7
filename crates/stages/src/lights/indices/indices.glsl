// The at most four lights whose indices a pixel holds (Petrescu et al. 2016, section 4.7).
#ifndef AFTERLIGHT_LIGHT_INDICES
#define AFTERLIGHT_LIGHT_INDICES
#include "lights/indices/parts.glsl"
#include "shading.glsl"

layout(set = 0, binding = 14) uniform texture2D light_parts_0;
layout(set = 0, binding = 15) uniform texture2D light_parts_1;
layout(set = 0, binding = 16) uniform texture2D light_parts_2;
// Number of images in use, 1, 2 or 3; each holds four parts.
layout(constant_id = 14) const uint PART_IMAGES = 1u;

// Numbers of lights, counted from one among those with an end, the nearest first; 0: none.
uvec4 nearest_lights(ivec2 pixel) {
    uvec4 codes = uvec4(0u);
    uint weight = 1u;
    add_parts(texelFetch(light_parts_0, pixel, 0), weight, codes);
    if (PART_IMAGES > 1u) {
        add_parts(texelFetch(light_parts_1, pixel, 0), weight, codes);
    }
    if (PART_IMAGES > 2u) {
        add_parts(texelFetch(light_parts_2, pixel, 0), weight, codes);
    }
    return codes;
}

uvec4 ascending(uvec4 v) {
    v = uvec4(min(v.xz, v.yw), max(v.xz, v.yw)).xzyw;
    v = uvec4(min(v.xy, v.zw), max(v.xy, v.zw));
    return uvec4(v.x, min(v.y, v.z), max(v.y, v.z), v.w);
}

// Radiance of the lights without an end and of those whose indices the pixel holds, in the order of the lights: where no more than
// four reach it, the sum is that of a loop over all.
vec3 indexed_radiance(ShadingPoint p, uvec2 pixel) {
    vec3 radiance = vec3(0.0);
    for (uint i = 0u; i < frame.unbounded_light_count; ++i) {
        radiance += light_radiance(p, i);
    }
    uvec4 lights = ascending(nearest_lights(ivec2(pixel)));
    for (int i = 0; i < 4; ++i) {
        if (lights[i] > 0u) {
            radiance += light_radiance(p, frame.unbounded_light_count + lights[i] - 1u);
        }
    }
    return radiance;
}

#endif
