#version 460
// A triangle that covers the image; its depth is a push constant.
layout(push_constant) uniform Push { float depth_ndc; } push;
void main() {
    vec2 corner = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2);
    gl_Position = vec4(corner * 2.0 - 1.0, push.depth_ndc, 1.0);
}
