// Applies a surface's colours to the light that its pixel has gathered, and adds what needs no light (Petrescu et al. 2016,
// section 4.5, third pass). With ALIKE_PIXELS, at several samples, the pixel is the one whose surface is most alike. Out: linear radiance,
// RGBA16F.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "light_prepass/sums.glsl"
#include "surface_in.glsl"
#ifdef ALIKE_PIXELS
#include "light_prepass/alike.glsl"
#endif

layout(location = 0) out vec4 radiance_out;

void main() {
#ifdef ALIKE_PIXELS
    // Derivatives come before an alpha test may end neighbours of the fragment.
    FragmentPlane plane = fragment_plane(position_ws);
#endif
    Surface s = visible_surface();
    radiance_out = vec4(unlit_radiance(s), 1.0);
    if (!s.unlit) {
#ifdef ALIKE_PIXELS
        sums_pixel = alike_pixel(plane, s, ivec2(gl_FragCoord.xy));
#endif
        radiance_out.rgb += gathered_radiance(s);
    }
}
