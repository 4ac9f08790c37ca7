// Tiled deferred shading (Petrescu et al. 2016, section 4.8; Olsson and Assarsson 2011): a group of 16x16 threads culls
// the lights of its tile and shades its pixels from the G-buffer.
//
// In: the G-buffer; hdr: accumulation, read and written. Dispatch: one group a tile. Twin of the culling:
// crates/oracle/src/tiles.rs.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tiled_shading.glsl"
#include "gbuffer.glsl"

layout(set = 0, binding = 12, rgba16f) uniform image2D hdr;

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
        imageStore(hdr, pixel, vec4(imageLoad(hdr, pixel).rgb + radiance, 1.0));
    }
}
