#version 460
// Splits a triangle into as many parts along each edge as the constant says.
layout(vertices = 3) out;
layout(constant_id = 3) const uint SEGMENTS = 1u;
layout(location = 0) in vec2 vertex_ndc[];
layout(location = 0) out vec2 patch_ndc[3];
void main() {
    patch_ndc[gl_InvocationID] = vertex_ndc[gl_InvocationID];
    gl_TessLevelOuter[0] = float(SEGMENTS);
    gl_TessLevelOuter[1] = float(SEGMENTS);
    gl_TessLevelOuter[2] = float(SEGMENTS);
    gl_TessLevelInner[0] = float(SEGMENTS);
}
