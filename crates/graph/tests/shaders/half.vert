#version 460
// A triangle strip over the left half of the image, nearer than the covering triangle.
layout(push_constant) uniform Push { float depth_ndc; } push;
void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    gl_Position = vec4(corner.x - 1.0, corner.y * 2.0 - 1.0, push.depth_ndc, 1.0);
}
