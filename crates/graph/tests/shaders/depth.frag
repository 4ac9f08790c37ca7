#version 460
// Shows depth as red, and adds one step of green for each time it runs.
layout(set = 0, binding = 0) uniform sampler2D depth_map;
layout(location = 0) out vec4 color;
void main() { color = vec4(texelFetch(depth_map, ivec2(gl_FragCoord.xy), 0).r, 1.0 / 255.0, 0.0, 0.0); }
