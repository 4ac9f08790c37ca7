// Shadows of one light by a shadow map (Williams 1978), filtered by comparing before averaging (Reeves et al. 1987).
//
// CPU twin: crates/oracle/src/shadow.rs. Filled by crates/stages/src/shared/shadow.
#ifndef AFTERLIGHT_SHADOW
#define AFTERLIGHT_SHADOW
#include "frame.glsl"

// 0 where there are no shadows: the compiler then removes all of this code.
layout(constant_id = 22) const uint SHADOWS = 0u;

struct ShadowConstants {
    mat4 texel_from_world;  // to texels of the map and depth, homogeneous; the depth of a point half a texel nearer to the light
    uint light_index;       // the light that has shadows
    uint size_px;           // of the map
};

layout(set = 0, binding = 24, scalar) uniform ShadowBlock {
    ShadowConstants shadow;
};

// Depth of what the light sees, 1 near, 0 where it sees nothing.
layout(set = 0, binding = 25) uniform texture2D shadow_map;

// Fraction of the light that reaches a point: the part of a square of 2 x 2 texels around the point in the map whose stored surfaces are
// not nearer to the light. Each of the nine texels that the square touches counts by the area that it has in the square, so that the
// fraction is continuous. Points outside of the map are lit; towards its border shadows fade within two texels, so that there too no rounding
// of the position turns a pixel from dark to bright.
float lit_share(vec3 position_ws) {
    vec4 p = shadow.texel_from_world * vec4(position_ws, 1.0);
    vec2 place = p.xy / p.w;
    bool seen = p.w > 0.0 && all(greaterThanEqual(place, vec2(1.0))) && all(lessThan(place, vec2(shadow.size_px - 1u)));
    if (!seen) {
        return 1.0;
    }
    float depth = p.z / p.w;
    ivec2 texel = ivec2(place);
    vec2 f = place - vec2(texel);
    float sum = 0.0;
    for (int y = -1; y <= 1; ++y) {
        float height = y < 0 ? 1.0 - f.y : y > 0 ? f.y : 1.0;
        for (int x = -1; x <= 1; ++x) {
            float width = x < 0 ? 1.0 - f.x : x > 0 ? f.x : 1.0;
            sum += depth >= texelFetch(shadow_map, texel + ivec2(x, y), 0).r ? width * height : 0.0;
        }
    }
    vec2 to_border = min(place - 1.0, float(shadow.size_px - 1u) - place);
    return mix(1.0, 0.25 * sum, min(0.5 * min(to_border.x, to_border.y), 1.0));
}

#endif
