// The program's own triangle: three vertices without buffers.
#version 460

layout(location = 0) out vec3 color;

void main() {
    int i = gl_VertexIndex;
    color = vec3(i == 0, i == 1, i == 2);
    gl_Position = vec4(i == 0 ? 0.0 : (i == 1 ? 0.8 : -0.8), i == 0 ? -0.8 : 0.8, 0.0, 1.0);
}
