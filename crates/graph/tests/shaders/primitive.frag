#version 460
// The number of the primitive, its lower sixteen bits.
layout(location = 0) out vec4 color;
void main() { color = vec4(unpackUnorm4x8(uint(gl_PrimitiveID)).xy, 0.0, 1.0); }
