// Indirect light of one bounce from a reflective shadow map (Dachsbacher and Stamminger 2005): every texel of a light's view
// is a small light, and a point gathers INDIRECT_SAMPLES of them around its own place in that view.
//
// CPU twin: crates/oracle/src/rsm.rs. Filled by crates/stages/src/shared/indirect.
#ifndef AFTERLIGHT_INDIRECT
#define AFTERLIGHT_INDIRECT
#include "frame.glsl"
#include "material.glsl"

// 0 where there is no indirect light: the compiler then removes all of this code.
layout(constant_id = 7) const uint INDIRECT_SAMPLES = 0u;

struct RsmConstants {
    mat4 clip_from_world;   // of the light's view
    vec4 samples[64];       // offset (shares of the map); area of the view's plane that it stands for, m^2 (under perspective of
                            // the plane at distance 1); unused
};

layout(set = 0, binding = 21, scalar) uniform RsmBlock {
    RsmConstants rsm;
};

// Position in world space, m, as bits of floats; normal, octahedral, 2 x 16 bits.
layout(set = 0, binding = 22) uniform utexture2D rsm_surface;
// Reflected flux of a square metre of the view's plane over pi: radiance times the cosine at the light, rgb.
layout(set = 0, binding = 23) uniform texture2D rsm_flux;

// Irradiance of a point by one texel: the paper's equation 1, its flux the texel's times the area that the sample stands for.
// The distance is at least the radius of a disc of that area: a pixel of the light cannot give more than a surface that fills the
// half space.
vec3 texel_irradiance(Surface s, ivec2 texel, float area, float least_distance_sq) {
    vec3 flux = texelFetch(rsm_flux, texel, 0).rgb;
    uvec4 packed = texelFetch(rsm_surface, texel, 0);
    vec3 to_texel = uintBitsToFloat(packed.xyz) - s.position_ws;
    float emitted = max(-dot(unpack_normal(packed.w), to_texel), 0.0);
    float received = max(dot(s.normal_ws, to_texel), 0.0);
    float distance_sq = max(dot(to_texel, to_texel), least_distance_sq);
    return flux * (area * emitted * received / (distance_sq * distance_sq));
}

// Irradiance of a point by the samples from `first` to `end`.
vec3 gathered_irradiance(Surface s, uint first, uint end) {
    vec4 clip = rsm.clip_from_world * vec4(s.position_ws, 1.0);
    if (clip.w <= 0.0) {
        return vec3(0.0);   // behind the light: it has no place in the map
    }
    vec2 place = clip.xy / clip.w * 0.5 + 0.5;
    vec2 size = vec2(textureSize(rsm_flux, 0));
    vec3 irradiance = vec3(0.0);
    for (uint i = first; i < end; ++i) {
        vec4 pattern = rsm.samples[i];
        vec2 at = place + pattern.xy;
        // Outside of the map nothing is lit.
        if (all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)))) {
            float least_distance_sq = max(pattern.z / PI * clip.w * clip.w, 1e-8);
            irradiance += texel_irradiance(s, ivec2(at * size), pattern.z, least_distance_sq);
        }
    }
    return irradiance;
}

#ifdef LOW_RATE
// Irradiance of the surface that is shaded, which the shader has found before (dais_multirate/low_rate.glsl).
vec3 low_rate_irradiance;

vec3 indirect_irradiance(Surface s) {
    return low_rate_irradiance;
}
#else
vec3 indirect_irradiance(Surface s) {
    return gathered_irradiance(s, 0u, INDIRECT_SAMPLES);
}
#endif

// Radiance towards the eye from light that another surface has reflected once; the diffuse lobe only.
vec3 indirect_radiance(Surface s) {
    return s.base_color * ((1.0 - s.metallic) * s.occlusion / PI) * indirect_irradiance(s);
}

#endif
