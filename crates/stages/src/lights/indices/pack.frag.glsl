// Leaves a light's index in the pixels whose surface lies within its range: blending shifts the four that are kept (Petrescu et
// al. 2016, section 4.7). Lights come from far to near.
//
// In: surface_depth. Out: IMAGES images of four parts, RGBA16F, blended as new + old / 4.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lights/indices/parts.glsl"
#include "lights/volumes/reach.glsl"

layout(location = 0) flat in uint light_index;
layout(location = 0) out vec4 parts_out[IMAGES];

void main() {
    if (!is_within_range(light_index, ivec2(gl_FragCoord.xy))) {
        discard;
    }
    // 0 is no light.
    uint code = light_index - frame.unbounded_light_count + 1u;
    for (int image = 0; image < IMAGES; ++image) {
        parts_out[image] = take_parts(code);
    }
}
