// Surfaces of a pixel from the G-buffer that dedup.frag.glsl fills: each triangle once, weighted by its samples (Schied and
// Dachsbacher 2015, section 5 and Listing 1).
layout(set = 0, binding = 9) uniform texture2DMS gbuffer_base_color;
layout(set = 0, binding = 10) uniform texture2DMS gbuffer_normal;
#define IDS_BINDING 11
#include "surfaces/visible/triangles.glsl"
#include "deferred_dedup/distance.glsl"
layout(set = 0, binding = 12) uniform texture2DMS gbuffer_distance;
#ifdef EMISSION
layout(set = 0, binding = 16) uniform texture2DMS gbuffer_emission;
#endif

ivec2 source_pixel;
uint source_mask;           // samples that need to be shaded
uint source_background;     // samples without a surface

void source_begin(ivec2 pixel) {
    source_pixel = pixel;
    source_mask = all_samples();
    source_background = 0u;
}

// Searches the next sample that is not shaded yet. The search comes before shading so that the threads of a group do both together.
bool source_next(out Surface s, out uint weight) {
    weight = 0u;
    uint first = 0u;
    while (weight == 0u && source_mask != 0u) {
        Visible v = take_triangle(source_pixel, source_mask);
        first = uint(findLSB(v.samples));
        if (v.id == NO_TRIANGLE) {
            source_background = uint(bitCount(v.samples));
        } else {
            weight = uint(bitCount(v.samples));
        }
    }
    if (weight == 0u) {
        return false;
    }
    vec4 base = texelFetch(gbuffer_base_color, source_pixel, int(first));
    uint normal_roughness = packUnorm4x8(texelFetch(gbuffer_normal, source_pixel, int(first)));
    uint distance_occlusion = packUnorm4x8(texelFetch(gbuffer_distance, source_pixel, int(first)));
    float distance_m = distance_from_word(distance_occlusion & 0xffffffu);
    s.position_ws = position_from_depth(ndc_from_pixel(uvec2(source_pixel)), depth_from_distance(distance_m));
    vec2 oct = vec2(normal_roughness & 0xfffu, normal_roughness >> 12 & 0xfffu) / 4095.0;
    s.normal_ws = octahedral_decode(oct * 2.0 - 1.0);
    s.base_color = base.rgb;
    s.metallic = base.a;
    s.roughness = float(normal_roughness >> 24) / 255.0;
    s.occlusion = float(distance_occlusion >> 24) / 255.0;
    s.unlit = normal_roughness >> 24 == 0u;
    s.emission = vec3(0.0);
#ifdef EMISSION
    s.emission = texelFetch(gbuffer_emission, source_pixel, int(first)).rgb;
#endif
    return true;
}
