// What number.geom.glsl#whole hands to every fragment of a triangle, flat: its vertices. THROUGH is `out` there, `in` in fragment
// shaders.
layout(location = 3) flat THROUGH vec3 vertex_position_ws[3];
layout(location = 6) flat THROUGH uvec4 vertex_normals;     // see packed_normals.glsl
layout(location = 7) flat THROUGH vec4 vertex_uv0_uv1[3];
layout(location = 10) flat THROUGH vec4 vertex_color[3];
layout(location = 13) flat THROUGH uvec2 vertex_tangents[3];
