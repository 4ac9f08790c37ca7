// Forward shading by the pixel's list of lights (Petrescu et al. 2016, section 4.7, LLiF).
// Out: linear radiance, RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "light_lists/lists.glsl"
#include "surface_in.glsl"

layout(location = 0) out vec4 radiance_out;

void main() {
    Surface s = visible_surface();
    vec3 radiance = unlit_radiance(s);
    if (!s.unlit) {
        radiance += listed_radiance(shading_point(s), uvec2(gl_FragCoord.xy));
    }
    radiance_out = vec4(radiance, 1.0);
}
