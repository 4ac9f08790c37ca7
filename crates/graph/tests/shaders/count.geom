#version 460
// Passes triangles on, each with a number of its own.
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;
layout(set = 0, binding = 0, std430) buffer Count { uint count; };
layout(constant_id = 7) const uint STEP = 0u;
void main() {
    uint id = atomicAdd(count, STEP);
    for (int i = 0; i < 3; ++i) {
        gl_Position = gl_in[i].gl_Position;
        gl_PrimitiveID = int(id);
        EmitVertex();
    }
    EndPrimitive();
}
