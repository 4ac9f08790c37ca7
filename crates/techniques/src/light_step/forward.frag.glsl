// Forward shading where every surface visits the lights that light_step/ finds for it (Petrescu et al. 2016, sections 4.7 to 4.10).
// Out: linear radiance, RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "light_step/radiance.glsl"
#include "surface_in.glsl"

layout(location = 0) out vec4 radiance_out;

void main() {
    Surface s = visible_surface();
    vec3 radiance = unlit_radiance(s);
    // Off its triangle a helper may stand where no cell is: it would walk the tree for nothing.
    if (!s.unlit && !gl_HelperInvocation) {
        radiance += lights_radiance(shading_point(s), uvec2(gl_FragCoord.xy), distance_from_depth(gl_FragCoord.z));
    }
    radiance_out = vec4(radiance, 1.0);
}
