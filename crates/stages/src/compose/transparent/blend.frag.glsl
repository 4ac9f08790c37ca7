// Forward shading of a surface with alpha blending; the pass's blend state does the blending.
// Out: linear radiance, not multiplied by alpha; alpha. RGBA16F.
//
// Draws of every state come in one call, so that their order is that of the sorted list: the winding of mirrored draws and the
// culling of back faces are here.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lights/step/radiance.glsl"
#include "surface_in.glsl"

layout(set = 0, binding = 1) uniform utexture2D draw_data;

// Nothing is written to depth: what opaque surfaces hide is not shaded.
layout(early_fragment_tests) in;

layout(location = 0) out vec4 radiance_alpha;

void main() {
    MaterialData m = load_material(draw_material.y);
    SurfacePoint p = surface_point();
    bool mirrored = (load_draw(draw_data, draw_material.x).flags & DRAW_MIRRORED) != 0u;
    p.front_facing = gl_FrontFacing != mirrored;
    if (!p.front_facing && (m.flags & MATERIAL_DOUBLE_SIDED) == 0u) {
        discard;
    }
    vec4 base = base_color_at(m, p);
    Surface s = surface_at(m, p, base.rgb);
    radiance_alpha = vec4(0.0, 0.0, 0.0, base.a);
    if (base.a > 0.0) {
        radiance_alpha.rgb = stepped_radiance(s, uvec2(gl_FragCoord.xy));
    }
}
