// Bounding geometry of lights, one instance a light: an icosphere around the unit sphere, scaled to the light's range.
// With FULL_SCREEN one triangle over the image, for lights without an end.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

layout(set = 0, binding = 5, scalar) readonly buffer LightSpheres {
    vec4 light_spheres[];
};

layout(location = 0) flat out uint light_index;
#ifndef FULL_SCREEN
layout(location = 0) in vec3 corner;
#endif

void main() {
    light_index = gl_InstanceIndex;
#ifdef FULL_SCREEN
    vec2 corner = vec2(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 0.0, 1.0);
#else
    vec4 sphere = light_spheres[gl_InstanceIndex];
    gl_Position = frame.clip_from_world * vec4(sphere.xyz + corner * sphere.w, 1.0);
#endif
}
