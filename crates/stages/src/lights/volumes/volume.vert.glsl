// Bounding geometry of lights, one instance a light: an icosphere around the unit sphere, scaled to the light's range.
// With ORDERED instances are lights in the order of a table.
// With FULL_SCREEN one triangle over the image, for lights without an end.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

// Centre and range of every light, 1,024 a row.
layout(set = 0, binding = 5) uniform texture2D light_spheres;

#ifdef ORDERED
layout(set = 0, binding = 17, scalar) readonly buffer LightOrder {
    uint light_order[];
};
#endif

layout(location = 0) flat out uint light_index;
#ifndef FULL_SCREEN
layout(location = 0) in vec3 corner;
#endif

void main() {
#ifdef ORDERED
    light_index = light_order[gl_InstanceIndex];
#else
    light_index = gl_InstanceIndex;
#endif
#ifdef FULL_SCREEN
    vec2 corner = vec2(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 0.0, 1.0);
#else
    vec4 sphere = texelFetch(light_spheres, ivec2(light_index & 1023u, light_index >> 10), 0);
    gl_Position = frame.clip_from_world * vec4(sphere.xyz + corner * sphere.w, 1.0);
#endif
}
