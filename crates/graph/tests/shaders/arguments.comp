#version 460
// Writes the arguments of an indirect indexed draw, of an indirect dispatch, and a draw count.
layout(local_size_x = 1) in;
layout(set = 0, binding = 0) writeonly buffer Arguments { uint arguments[]; };
layout(set = 0, binding = 1) writeonly buffer Indices { uint indices[]; };
void main() {
    uint words[9] = uint[](3u, 1u, 0u, 0u, 0u, 2u, 3u, 1u, 1u);
    for (uint i = 0; i < 9; ++i) { arguments[i] = words[i]; }
    for (uint i = 0; i < 3; ++i) { indices[i] = i; }
}
