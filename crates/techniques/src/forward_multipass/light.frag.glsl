// One light of the multi-pass forward renderer, added to what the passes before left (Petrescu et al. 2016, section
// 4.1: o x l draws). AMBIENT_PASS is the first pass: what needs no light.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"

layout(push_constant, scalar) uniform Push {
    uint light_index;
};

layout(location = 0) out vec4 radiance_out;

void main() {
    Surface s = visible_surface();
#ifdef AMBIENT_PASS
    radiance_out = vec4(unlit_radiance(s), 1.0);
#else
    radiance_out = vec4(s.unlit ? vec3(0.0) : light_radiance(shading_point_for(s, light_index), light_index), 0.0);
#endif
}
