// One light over the pixels of its volume, for every surface that the source holds of a pixel: shade.comp.glsl, a light at a time.
// In: the source's images or buffers. Out: linear radiance, to be added.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "surfaces/shade/shade.glsl"

layout(location = 0) flat in uint light_index;
layout(location = 0) out vec4 radiance_out;

void main() {
    vec3 radiance = vec3(0.0);
    Surface s;
    uint weight;
    weight_sum = 0u;
    source_begin(ivec2(gl_FragCoord.xy));
    while (source_next(s, weight)) {
        if (!s.unlit) {
            radiance += float(weight) * light_radiance(shading_point_for(s, light_index), light_index);
        }
        weight_sum += weight;
    }
    radiance_out = vec4(weight_sum > 0u ? of_surfaces(radiance) : vec3(0.0), 0.0);
}
