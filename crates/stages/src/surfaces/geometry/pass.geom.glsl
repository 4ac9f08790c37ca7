// Passes triangles on as they are: for a depth pass before one whose geometry shader numbers triangles, since passes with a
// geometry shader and without need not find equal depths.
//
// In and out: what surface.tese.glsl hands to fragment shaders, by the same variants POSITION_ONLY (no fragment shader) and
// WITH_UV (an alpha test).
#version 460

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

#ifdef WITH_UV
layout(location = 0) flat in uvec2 in_draw_material[];
layout(location = 1) in vec4 in_uv0_uv1[];
layout(location = 2) in vec4 in_color[];

layout(location = 0) flat out uvec2 draw_material;
layout(location = 1) out vec4 uv0_uv1;
layout(location = 2) out vec4 color;
#endif

void main() {
    for (int i = 0; i < 3; ++i) {
        gl_Position = gl_in[i].gl_Position;
#ifdef WITH_UV
        draw_material = in_draw_material[i];
        uv0_uv1 = in_uv0_uv1[i];
        color = in_color[i];
#endif
        EmitVertex();
    }
    EndPrimitive();
}
