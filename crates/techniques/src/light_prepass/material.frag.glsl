// Applies a surface's colours to the light that its pixel has gathered, and adds what needs no light (Petrescu et al. 2016,
// section 4.5, third pass). Out: linear radiance, RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"

layout(set = 0, binding = 8) uniform texture2D diffuse_light;
layout(set = 0, binding = 9) uniform texture2D specular_light;
layout(set = 0, binding = 10) uniform texture2D grazing_light;

layout(location = 0) out vec4 radiance_out;

// A sum beyond the largest 16-bit float is infinite; times a black f0 it would be no number.
vec3 gathered(texture2D light) {
    return min(texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb, vec3(65504.0));
}

void main() {
    Surface s = visible_surface();
    radiance_out = vec4(unlit_radiance(s), 1.0);
    if (!s.unlit) {
        radiance_out.rgb += reflected(
            unshadowed_point(s), gathered(diffuse_light), gathered(specular_light), gathered(grazing_light));
    }
}
