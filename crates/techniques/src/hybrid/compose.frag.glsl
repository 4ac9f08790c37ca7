// Applies the colours that the G-buffer holds to the light that a pixel has gathered: the pixels of draws that took the deferred
// path. Out: radiance, added to the accumulation.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "light_prepass/sums.glsl"

layout(set = 0, binding = 11) uniform texture2D gbuffer_base_color;

layout(location = 0) out vec4 radiance_out;

void main() {
    vec4 base = texelFetch(gbuffer_base_color, ivec2(gl_FragCoord.xy), 0);
    // The sums lack nothing but the surface's colours. Surfaces that take no light have black ones.
    Surface s;
    s.position_ws = vec3(0.0);
    s.normal_ws = vec3(0.0, 0.0, 1.0);
    s.base_color = base.rgb;
    s.metallic = base.a;
    s.roughness = 1.0;
    s.occlusion = 1.0;
    s.emission = vec3(0.0);
    s.unlit = false;
    radiance_out = vec4(gathered_radiance(s), 0.0);
}
