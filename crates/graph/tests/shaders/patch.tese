#version 460
// Points of a flat triangle, at the depth of the push constant.
layout(triangles, equal_spacing, ccw) in;
layout(push_constant) uniform Push { float depth_ndc; } push;
layout(location = 0) in vec2 patch_ndc[];
void main() {
    vec2 ndc = gl_TessCoord.x * patch_ndc[0] + gl_TessCoord.y * patch_ndc[1] + gl_TessCoord.z * patch_ndc[2];
    gl_Position = vec4(ndc, push.depth_ndc, 1.0);
}
