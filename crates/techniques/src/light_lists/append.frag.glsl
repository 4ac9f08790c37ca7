// Appends a light to the lists of the pixels whose surface lies within its range (Petrescu et al. 2016, section 4.7, Figure 4).
//
// Drawn by the back faces of volumes that lie behind the surface: a pixel meets one of them a light. Surfaces in front of the
// volume are told by their distance to the light.
// In: light_lists_depth. Out: LightHeads, LightNodes, LightNodeCount.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "culling.glsl"

layout(early_fragment_tests) in;

layout(set = 0, binding = 8) uniform texture2D light_lists_depth;
layout(set = 0, binding = 14, scalar) buffer LightHeads {
    uint light_heads[];
};
layout(set = 0, binding = 15, scalar) writeonly buffer LightNodes {
    uvec2 light_nodes[];
};
layout(set = 0, binding = 16, scalar) coherent buffer LightNodeCount {
    uint nodes_needed;
    uint nodes_dropped;
};
layout(constant_id = 14) const uint NODE_CAPACITY = 0u;

// The count stays here, above every capacity and below its end by more threads than run at once: it does not begin anew.
const uint MOST_NEEDED = 0xf0000000u;

layout(location = 0) flat in uint light_index;

bool is_within_range(ivec2 pixel) {
    vec4 sphere = light_sphere(light_index);
    float depth = texelFetch(light_lists_depth, pixel, 0).r;
    vec3 to_light = sphere.xyz - position_from_depth(ndc_from_pixel(uvec2(pixel)), depth);
    return depth > 0.0 && dot(to_light, to_light) <= sphere.w * sphere.w;
}

void append(uint pixel) {
    uint node = nodes_needed < MOST_NEEDED ? atomicAdd(nodes_needed, 1u) : MOST_NEEDED;
    if (node < NODE_CAPACITY) {
        light_nodes[node] = uvec2(light_index, atomicExchange(light_heads[pixel], node + 1u));
    } else if (nodes_dropped < MOST_NEEDED) {
        atomicAdd(nodes_dropped, 1u);
    }
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (!gl_HelperInvocation && is_within_range(pixel)) {
        append(uint(pixel.y) * frame.size_px.x + uint(pixel.x));
    }
}
