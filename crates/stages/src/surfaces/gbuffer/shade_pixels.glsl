// Shades the G-buffer, a thread a pixel, by the lights that lead to each surface. Before it is included, the shader defines
// vec3 lights_radiance(ShadingPoint p, uvec2 pixel, float distance_m): radiance of the lights for a surface at a view distance.
//
// In: the G-buffer; hdr: accumulation, read and written. Dispatch: 8x8 groups.
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
    if (gbuffer_load(pixel, depth, s)) {
        vec3 radiance = lights_radiance(shading_point(s), uvec2(pixel), distance_from_depth(depth));
        imageStore(hdr, pixel, vec4(imageLoad(hdr, pixel).rgb + radiance, 1.0));
    }
}
