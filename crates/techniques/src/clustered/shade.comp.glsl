// Clustered deferred shading (Petrescu et al. 2016, section 4.10; Olsson et al. 2012): each pixel visits the lights of its
// cluster.
//
// In: the G-buffer, the lists of clusters; hdr: accumulation, read and written. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "clusters/lists.glsl"
#include "gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 12, rgba16f) uniform image2D hdr;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    float depth = texelFetch(gbuffer_depth, pixel, 0).r;
    Surface s;
    if (!gbuffer_load(pixel, depth, s)) {
        return;
    }
    vec3 radiance = clustered_radiance(shading_point(s), uvec2(pixel), distance_from_depth(depth));
    imageStore(hdr, pixel, vec4(imageLoad(hdr, pixel).rgb + radiance, 1.0));
}
