// Fills a reflective shadow map: what a light sees, and how much of its light leaves there again (Dachsbacher and Stamminger
// 2005, section 3). The frame's view is the light's.
//
// Out: 0 position in world space, m, as bits of floats, and normal, octahedral, 2 x 16 bits, RGBA32UI; 1 reflected flux of a
// square metre of the view's plane (under perspective of the plane at distance 1) over pi, RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"

layout(push_constant, scalar) uniform Push {
    uint light_index;
};

layout(location = 0) out uvec4 surface;
layout(location = 1) out vec4 flux;

// Flux of the light through a square metre of the view's plane around the way to a point.
vec3 flux_through_plane(vec3 position_ws) {
    uvec4 packed = texelFetch(light_data, ivec2((light_index & 255u) * 4u + 1u, light_index >> 8), 0);
    vec3 intensity = uintBitsToFloat(packed.xyz);
    if (packed.w == LIGHT_DIRECTIONAL) {
        return intensity;
    }
    vec4 place = light_texel(light_index, 0u);
    vec3 from_light = position_ws - place.xyz;
    float distance_sq = max(dot(from_light, from_light), 1e-8);
    vec3 direction = from_light * inversesqrt(distance_sq);
    float t = distance_sq * place.w;
    // The solid angle of an area of the plane falls with the cube of the cosine to the plane's normal.
    float cosine = max(dot(direction, frame.distance_from_world.xyz), 0.0);
    float factor = max(1.0 - t * t, 0.0) * cosine * cosine * cosine;
    if (packed.w == LIGHT_SPOT) {
        vec4 spot = light_texel(light_index, 3u);
        float angular = clamp(dot(direction, light_texel(light_index, 2u).xyz) * spot.x + spot.y, 0.0, 1.0);
        factor *= angular * angular;
    }
    return intensity * (t < 1.0 ? factor : 0.0);
}

void main() {
    Surface s = visible_surface();
    surface = uvec4(floatBitsToUint(s.position_ws), packSnorm2x16(octahedral_encode(s.normal_ws)));
    vec3 diffuse = s.unlit ? vec3(0.0) : s.base_color * (1.0 - s.metallic) / PI;
    flux = vec4(diffuse * flux_through_plane(s.position_ws), 1.0);
}
