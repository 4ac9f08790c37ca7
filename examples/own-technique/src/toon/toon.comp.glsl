// Light in steps: tiled deferred shading whose radiance is rounded to a few levels.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tiled_shading.glsl"
#include "gbuffer.glsl"

layout(set = 0, binding = 12, rgba16f) uniform image2D hdr;
layout(constant_id = 20) const uint LEVELS = 4u;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(gl_GlobalInvocationID.xy, frame.size_px));
    float depth = inside ? texelFetch(gbuffer_depth, pixel, 0).r : 0.0;
    if (!tile_reduce_depth(depth > 0.0, distance_from_depth(depth))) {
        return;
    }
    Surface s;
    bool lit = inside && gbuffer_load(pixel, depth, s);
    ShadingPoint p;
    if (lit) {
        p = shading_point(s);
    }
    vec3 radiance = tiled_radiance(p, lit);
    if (lit) {
        vec3 sum = imageLoad(hdr, pixel).rgb + radiance;
        float peak = max(max(sum.r, sum.g), max(sum.b, 1e-6));
        float level = ceil(peak / (1.0 + peak) * float(LEVELS)) / float(LEVELS);
        imageStore(hdr, pixel, vec4(sum / peak * level, 1.0));
    }
}
