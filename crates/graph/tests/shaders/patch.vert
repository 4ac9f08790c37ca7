#version 460
// A triangle that covers the image, for tessellation to place.
layout(location = 0) out vec2 vertex_ndc;
void main() {
    vertex_ndc = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2) * 2.0 - 1.0;
}
