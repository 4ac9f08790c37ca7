#version 460
layout(local_size_x = 4) in;
layout(set = 0, binding = 0) buffer Counter { uint counter; };
void main() { atomicAdd(counter, 1u); }
