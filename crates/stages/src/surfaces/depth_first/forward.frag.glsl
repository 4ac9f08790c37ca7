// Forward shading: every fragment visits every light (Petrescu et al. 2016, section 4.1).
// Out: linear radiance, RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"
#include "invocations.glsl"

layout(location = 0) out vec4 radiance_out;

void main() {
    Surface s = visible_surface();
    count_invocation();
    radiance_out = vec4(surface_radiance(s), 1.0);
}
