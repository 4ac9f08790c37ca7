// The illumination model, once for every technique: glTF 2.0's metal-rough BRDF (appendix B of its specification) under
// point, spot and directional lights (KHR_lights_punctual), a constant ambient term, emission, indirect light, the shadows
// of one light.
//
// CPU twin: crates/oracle/src/brdf.rs.
#ifndef AFTERLIGHT_SHADING
#define AFTERLIGHT_SHADING
#include "frame.glsl"
#include "material.glsl"
#include "indirect.glsl"
#include "light_data.glsl"
#include "light_pairs.glsl"
#include "shadow.glsl"

// Lowest perceptual roughness. Below it highlights are smaller than pixels, and 32-bit floats lose their peak.
const float MIN_ROUGHNESS = 0.045;

// A surface, and the terms of its BRDF that are the same for every light.
struct ShadingPoint {
    vec3 position_ws;
    vec3 normal_ws;
    vec3 view_ws;
    vec3 diffuse;       // base colour x (1 - metallic) / pi
    vec3 f0;
    float alpha_sq;
    float n_dot_v;
    float v_term;       // sqrt of the view half of the Smith term
    float lit;          // fraction that arrives of the one light that casts shadows
};

// The shading point without shadows: every light arrives in full.
ShadingPoint unshadowed_point(Surface s) {
    ShadingPoint p;
    p.position_ws = s.position_ws;
    p.normal_ws = s.normal_ws;
    p.view_ws = view_direction(s.position_ws);
    p.diffuse = s.base_color * (1.0 - s.metallic) / PI;
    p.f0 = mix(vec3(0.04), s.base_color, s.metallic);
    float roughness = clamp(s.roughness, MIN_ROUGHNESS, 1.0);
    float alpha = roughness * roughness;
    p.alpha_sq = alpha * alpha;
    p.n_dot_v = max(dot(p.normal_ws, p.view_ws), 1e-4);
    p.v_term = sqrt(p.n_dot_v * p.n_dot_v * (1.0 - p.alpha_sq) + p.alpha_sq);
    p.lit = 1.0;
    return p;
}

// The shading point for all lights. The shadow map is sampled once here and not in the loop over lights: a device that runs both sides of
// a branch would sample it for every light.
ShadingPoint shading_point(Surface s) {
    ShadingPoint p = unshadowed_point(s);
    if (SHADOWS > 0u) {
        p.lit = lit_share(p.position_ws);
    }
    return p;
}

// The shading point for light number `index` only.
ShadingPoint shading_point_for(Surface s, uint index) {
    ShadingPoint p = unshadowed_point(s);
    if (SHADOWS > 0u && index == shadow.light_index) {
        p.lit = lit_share(p.position_ws);
    }
    return p;
}

// The three factors of the BRDF that do not depend on the surface's colours, for light from the unit direction l. With Schlick's
// F = f0 + (1 - f0) c^5, c = 1 - v.h, the BRDF times cosine is (1 - f0) diffuse x + f0 y + z, where x = (1 - c^5) n.l,
// y = (1 - c^5) D V n.l and z = c^5 D V n.l.
vec3 lobes(ShadingPoint p, vec3 l) {
    float n_dot_l = dot(p.normal_ws, l);
    if (n_dot_l <= 0.0) {
        return vec3(0.0);
    }
    vec3 h = normalize(l + p.view_ws);
    float n_dot_h = clamp(dot(p.normal_ws, h), 0.0, 1.0);
    float v_dot_h = clamp(dot(p.view_ws, h), 0.0, 1.0);
    // Trowbridge-Reitz (GGX)
    float d = n_dot_h * n_dot_h * (p.alpha_sq - 1.0) + 1.0;
    float distribution = p.alpha_sq / (PI * d * d);
    // Smith, height-correlated, divided by 4 (n.l) (n.v)
    float l_term = sqrt(n_dot_l * n_dot_l * (1.0 - p.alpha_sq) + p.alpha_sq);
    float visibility = 0.5 / (n_dot_l * p.v_term + p.n_dot_v * l_term);
    float c = 1.0 - v_dot_h;
    float c2 = c * c;
    float grazing = c2 * c2 * c;
    // A normal map may turn the normal away from the eye, and so from h: no microfacet faces h then (glTF 2.0, B.3.2).
    float specular = n_dot_h > 0.0 ? distribution * visibility : 0.0;
    return vec3(1.0 - grazing, (1.0 - grazing) * specular, grazing * specular) * n_dot_l;
}

// Applies a surface's colours to light that was summed separately for the three factors of lobes(), each in RGB.
vec3 reflected(ShadingPoint p, vec3 diffuse, vec3 specular, vec3 grazing) {
    if (LIGHT_PAIRS > 0u) {
        return diffuse;     // light_prepass/light.frag counts there
    }
    return (1.0 - p.f0) * p.diffuse * diffuse + p.f0 * specular + grazing;
}

// BRDF times cosine for light from the unit direction l.
vec3 reflectance(ShadingPoint p, vec3 l) {
    vec3 part = lobes(p, l);
    return reflected(p, part.xxx, part.yyy, part.zzz);
}

// The unit direction to light number `index` and its irradiance across that direction, W/m^2 or lux. Returns false beyond the light's
// range; where the light casts shadows, the irradiance is scaled by what arrives.
bool light_arrives(ShadingPoint p, uint index, out vec3 l, out vec3 irradiance) {
    vec4 place = light_texel(index, 0u);
    vec3 to_light = place.xyz - p.position_ws;
    float distance_sq = max(dot(to_light, to_light), 1e-8);
    // t = (d / range)^2; a directional light has no end, so t is 0
    float t = distance_sq * place.w;
    if (t >= 1.0) {
        return false;
    }
    uvec4 packed = texelFetch(light_data, ivec2((index & 255u) * 4u + 1u, index >> 8), 0);
    vec3 intensity = uintBitsToFloat(packed.xyz);
    uint kind = packed.w;
    l = to_light * inversesqrt(distance_sq);
    // Inverse square with glTF's window: (1 - (d / range)^4) / d^2
    float attenuation = (1.0 - t * t) / distance_sq;
    if (ONLY_POINT_LIGHTS == 0u && kind != LIGHT_POINT) {
        vec3 direction = light_texel(index, 2u).xyz;
        if (kind == LIGHT_DIRECTIONAL) {
            l = -direction;
            attenuation = 1.0;
        } else {
            vec4 spot = light_texel(index, 3u);
            float angular = clamp(dot(-l, direction) * spot.x + spot.y, 0.0, 1.0);
            attenuation *= angular * angular;
        }
    }
    if (SHADOWS > 0u && index == shadow.light_index) {
        attenuation *= p.lit;
    }
    irradiance = intensity * attenuation;
    return true;
}

// Radiance towards the eye caused by light number `index`; where pairs are counted, the count of this pair instead.
vec3 light_radiance(ShadingPoint p, uint index) {
    vec3 l, irradiance;
    bool lit = light_arrives(p, index, l, irradiance);
    if (LIGHT_PAIRS > 0u) {
        return light_pair(lit);
    }
    return lit ? irradiance * reflectance(p, l) : vec3(0.0);
}

// Radiance of every light, in order.
vec3 all_lights_radiance(ShadingPoint p) {
    vec3 radiance = vec3(0.0);
    for (uint i = 0u; i < frame.light_count; ++i) {
        radiance += light_radiance(p, i);
    }
    return radiance;
}

// Radiance that no light of the list causes: emission, the constant ambient term, and indirect light where it is enabled; of an unlit
// material its base colour. A white surface reflects all the ambient light that reaches it. Zero where pairs are counted.
vec3 unlit_radiance(Surface s) {
    if (LIGHT_PAIRS > 0u) {
        return vec3(0.0);
    }
    if (s.unlit) {
        return s.base_color;
    }
    vec3 radiance = s.emission + s.base_color * s.occlusion * frame.ambient_radiance;
    return INDIRECT_SAMPLES > 0u ? radiance + indirect_radiance(s) : radiance;
}

// Radiance that leaves a surface under every light.
vec3 surface_radiance(Surface s) {
    vec3 radiance = unlit_radiance(s);
    if (!s.unlit) {
        radiance += all_lights_radiance(shading_point(s));
    }
    return radiance;
}

#endif
