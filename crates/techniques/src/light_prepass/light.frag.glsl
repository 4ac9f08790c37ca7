// One light over the pixels of its volume, added to three sums that do not depend on the surface's colours (Petrescu et al. 2016,
// section 4.5, second pass). The three factors are those of lobes() in shading.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gbuffer_lobe.glsl"

layout(location = 0) flat in uint light_index;
layout(location = 0) out vec4 diffuse_out;
layout(location = 1) out vec4 specular_out;
layout(location = 2) out vec4 grazing_out;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Surface s;
    vec3 part = vec3(0.0), irradiance = vec3(0.0), l;
    if (gbuffer_load_lobe(pixel, texelFetch(gbuffer_depth, pixel, 0).r, s)) {
        ShadingPoint p = shading_point_for(s, light_index);
        bool lit = light_arrives(p, light_index, l, irradiance);
        if (LIGHT_PAIRS > 0u) {
            irradiance = light_pair(lit);
            part = vec3(1.0, 0.0, 0.0);
        } else if (lit) {
            part = lobes(p, l);
        } else {
            irradiance = vec3(0.0);
        }
    }
    diffuse_out = vec4(irradiance * part.x, 0.0);
    specular_out = vec4(irradiance * part.y, 0.0);
    grazing_out = vec4(irradiance * part.z, 0.0);
}
