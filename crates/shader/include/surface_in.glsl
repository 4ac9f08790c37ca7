// What a fragment of surface.vert.glsl receives, as a SurfacePoint.
#ifndef AFTERLIGHT_SURFACE_IN
#define AFTERLIGHT_SURFACE_IN
#include "material.glsl"

layout(location = 0) flat in uvec2 draw_material;
layout(location = 1) in vec4 uv0_uv1;
layout(location = 2) in vec4 color;
#ifndef WITH_UV
layout(location = 3) in vec3 position_ws;
layout(location = 4) in vec3 normal_ws;
layout(location = 5) in vec4 tangent_ws;
#endif

#ifndef WITH_UV
#include "center_distance.glsl"

// World position where the fragment is lit. Derivatives: every fragment of a quad calls it.
vec3 center_position() {
    float inverse = gl_FragCoord.w;
    float lit = center_inverse_distance(inverse, vec2(dFdx(inverse), dFdy(inverse)));
    return lit == inverse ? position_ws
                          : position_from_depth(ndc_from_pixel(uvec2(gl_FragCoord.xy)), depth_from_distance(1.0 / lit));
}
#endif

SurfacePoint surface_point() {
    SurfacePoint p;
    p.uv0 = TextureCoordinates(uv0_uv1.xy, vec2(0.0), vec2(0.0));
    p.uv1 = TextureCoordinates(uv0_uv1.zw, vec2(0.0), vec2(0.0));
    p.color = color;
    p.front_facing = gl_FrontFacing;
#ifndef WITH_UV
    p.position_ws = center_position();
    p.normal_ws = normal_ws;
    p.tangent_ws = tangent_ws;
#endif
    return p;
}

// Base colour of the fragment; with ALPHA_MASK the fragment ends where its alpha is below the cutoff.
vec4 visible_base_color(MaterialData m, SurfacePoint p) {
    vec4 base = base_color_at(m, p);
#ifdef ALPHA_MASK
    if (base.a < m.alpha_cutoff) {
        discard;
    }
#endif
    return base;
}

#ifndef WITH_UV
// Surface of the fragment; with ALPHA_MASK as above.
Surface visible_surface() {
    MaterialData m = load_material(draw_material.y);
    SurfacePoint p = surface_point();
    return surface_at(m, p, visible_base_color(m, p).rgb);
}
#endif

#endif
