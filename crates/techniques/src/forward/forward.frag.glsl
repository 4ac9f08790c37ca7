// Forward shading: every fragment visits every light (Petrescu et al. 2016, section 4.1).
// Out: linear radiance, RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"
#include "invocations.glsl"

layout(location = 0) out vec4 radiance_out;

void main() {
    MaterialData m = load_material(draw_material.y);
    SurfacePoint p = surface_point();
    vec4 base = visible_base_color(m, p);
    count_invocation();
    Surface s = surface_at(m, p, base.rgb);
    radiance_out = vec4(surface_radiance(s), 1.0);
}
