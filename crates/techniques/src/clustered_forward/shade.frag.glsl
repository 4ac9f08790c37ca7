// Clustered forward shading (Petrescu et al. 2016, section 4.10; Olsson et al. 2012): each fragment visits the lights of its
// cluster.
// Out: linear radiance, RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "clusters/lists.glsl"
#include "surface_in.glsl"

layout(location = 0) out vec4 radiance_out;

void main() {
    Surface s = visible_surface();
    vec3 radiance = unlit_radiance(s);
    if (!s.unlit) {
        float distance_m = distance_from_depth(gl_FragCoord.z);
        radiance += clustered_radiance(shading_point(s), uvec2(gl_FragCoord.xy), distance_m);
    }
    radiance_out = vec4(radiance, 1.0);
}
