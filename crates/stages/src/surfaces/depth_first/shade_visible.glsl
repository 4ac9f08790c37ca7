// Shades what a depth pre-pass left visible by the lights that lead to each surface. Before it is included, the shader defines
// vec3 lights_radiance(ShadingPoint p, uvec2 pixel, float distance_m): radiance of the lights for a surface at a view distance.
//
// Out: linear radiance, RGBA16F.
#include "shading.glsl"
#include "surface_in.glsl"

layout(location = 0) out vec4 radiance_out;

void main() {
    Surface s = visible_surface();
    vec3 radiance = unlit_radiance(s);
    // A helper stands off its triangle, perhaps where no list holds: it would look for lights in vain (152 ms instead of 488 on
    // lavapipe).
    if (!s.unlit && !gl_HelperInvocation) {
        // At one sample, where the lists were made for the depth that is stored. At several the surface may be lit nearer than its plane is at
        // the pixel's centre (center_distance.glsl): the cell there is another's.
        float distance_m = frame.samples > 1u ? distance_from_position(s.position_ws) : distance_from_depth(gl_FragCoord.z);
        radiance += lights_radiance(shading_point(s), uvec2(gl_FragCoord.xy), distance_m);
    }
    radiance_out = vec4(radiance, 1.0);
}
