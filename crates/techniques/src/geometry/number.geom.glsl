// Numbers the triangles that tessellation makes, by an atomic counter (Schied and Dachsbacher 2015, section 5): without a
// geometry shader gl_PrimitiveID is the number of the patch.
//
// In and out: what surface.tese.glsl hands to fragment shaders. The number is in gl_PrimitiveID; it tells triangles apart,
// and which one a triangle gets differs from frame to frame. For single passes: a pass with this shader and one without
// need not find equal depths.
#version 460

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

layout(set = 0, binding = 15, std430) buffer TriangleCount {
    uint triangle_count;    // 0 before the pass
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
layout(location = 3) out vec3 position_ws;
layout(location = 4) out vec3 normal_ws;
layout(location = 5) out vec4 tangent_ws;

void main() {
    uint id = atomicAdd(triangle_count, 1u);
    for (int i = 0; i < 3; ++i) {
        gl_Position = gl_in[i].gl_Position;
        gl_PrimitiveID = int(id);
        draw_material = in_draw_material[i];
        uv0_uv1 = in_uv0_uv1[i];
        color = in_color[i];
        position_ws = in_position_ws[i];
        normal_ws = in_normal_ws[i];
        tangent_ws = in_tangent_ws[i];
        EmitVertex();
    }
    EndPrimitive();
}
