// Numbers the triangles that tessellation makes, by an atomic counter (Schied and Dachsbacher 2015, section 5): without a
// geometry shader gl_PrimitiveID is the number of the patch.
//
// In: what surface.tese.glsl hands to fragment shaders. Out: the same; with WHOLE_TRIANGLE what an alpha test takes, and all
// vertices of the triangle (section 3.1). The number is in gl_PrimitiveID; it tells triangles apart, and which one a triangle
// gets differs from frame to frame. A pass with this shader and one without a geometry shader need not find equal
// depths: a depth pass before it has pass.geom.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef WHOLE_TRIANGLE
#include "surfaces/geometry/packed_normals.glsl"
#define THROUGH out
#include "surfaces/geometry/whole_triangle.glsl"
#endif

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

layout(set = 0, binding = 17, std430) buffer TriangleNumbers {
    uint triangle_number;   // of the next; 0 before the pass
};

layout(location = 0) flat in uvec2 in_draw_material[];
layout(location = 1) in vec4 in_uv0_uv1[];
layout(location = 2) in vec4 in_color[];
layout(location = 3) in vec3 in_position_ws[];
layout(location = 4) in vec3 in_normal_ws[];
layout(location = 5) in vec4 in_tangent_ws[];

layout(location = 0) flat out uvec2 draw_material;
layout(location = 1) out vec4 uv0_uv1;
layout(location = 2) out vec4 color;
#ifndef WHOLE_TRIANGLE
layout(location = 3) out vec3 position_ws;
layout(location = 4) out vec3 normal_ws;
layout(location = 5) out vec4 tangent_ws;
#endif

void main() {
    uint id = atomicAdd(triangle_number, 1u);
#ifdef WHOLE_TRIANGLE
    uvec4 normals = packed_normals(in_normal_ws[0], in_normal_ws[1], in_normal_ws[2]);
    float longest = longest_normal(in_normal_ws[0], in_normal_ws[1], in_normal_ws[2]);
#endif
    for (int i = 0; i < 3; ++i) {
        gl_Position = gl_in[i].gl_Position;
        gl_PrimitiveID = int(id);
        draw_material = in_draw_material[i];
        uv0_uv1 = in_uv0_uv1[i];
        color = in_color[i];
#ifdef WHOLE_TRIANGLE
        // Flat outputs are taken from the first vertex.
        if (i == 0) {
            vertex_normals = normals;
            for (int k = 0; k < 3; ++k) {
                vertex_position_ws[k] = in_position_ws[k];
                vertex_uv0_uv1[k] = in_uv0_uv1[k];
                vertex_color[k] = in_color[k];
                vertex_tangents[k] = packed_tangent(in_tangent_ws[k], longest);
            }
        }
#else
        position_ws = in_position_ws[i];
        normal_ws = in_normal_ws[i];
        tangent_ws = in_tangent_ws[i];
#endif
        EmitVertex();
    }
    EndPrimitive();
}
