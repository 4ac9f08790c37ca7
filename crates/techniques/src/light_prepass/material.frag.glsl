// Applies a surface's colours to the light that its pixel has gathered, and adds what needs no light (Petrescu et al. 2016,
// section 4.5, third pass). Out: linear radiance, RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "light_prepass/sums.glsl"
#include "surface_in.glsl"

layout(location = 0) out vec4 radiance_out;

void main() {
    Surface s = visible_surface();
    radiance_out = vec4(unlit_radiance(s), 1.0);
    if (!s.unlit) {
        radiance_out.rgb += gathered_radiance(s);
    }
}
