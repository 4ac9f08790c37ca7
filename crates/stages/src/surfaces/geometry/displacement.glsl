// Displacement of surfaces that tessellation has made fine enough: a small periodic field of the world position.
//
// glTF has no displacement map. The field moves a point by a vector that depends on where the point is and on nothing else:
// points of one place stay in one place, whatever their normals and whichever mesh they are of, so that no crack opens along
// hard edges, seams of texture coordinates and where meshes touch. (Along the normal, faces at a hard edge would part.)
// On an axis-aligned plane through the origin it is an egg crate along the normal. Steps of `precise` additions and
// multiplications, no sine: each variant of a shader finds the same bits.
#ifndef AFTERLIGHT_DISPLACEMENT
#define AFTERLIGHT_DISPLACEMENT

const float DISPLACEMENT_PERIOD_M = 1.0;

// A sine of period 1 made of parabolas, from -1 to 1, and its derivative: continuous both.
void wave(vec3 t, out vec3 value, out vec3 slope) {
    precise vec3 g = 2.0 * fract(t) - 1.0;
    precise vec3 w = -4.0 * g * (1.0 - abs(g));
    value = w;
    slope = -8.0 * (1.0 - 2.0 * abs(g));
}

// Where a point goes; at most `amplitude_m` along each axis. `columns` are those of the derivative by the point.
vec3 displaced(vec3 p, float amplitude_m, out mat3 columns) {
    vec3 w;
    vec3 s;
    wave(p / DISPLACEMENT_PERIOD_M, w, s);
    float k = amplitude_m / DISPLACEMENT_PERIOD_M;
    columns = mat3(1.0, k * s.x * w.z, k * s.x * w.y,
                   k * s.y * w.z, 1.0, k * s.y * w.x,
                   k * s.z * w.y, k * s.z * w.x, 1.0);
    precise vec3 moved = p + amplitude_m * (w.yxx * w.zzy);
    return moved;
}

// Cofactor matrix times a normal: the normal of the displaced surface, not of unit length.
vec3 displaced_normal(mat3 columns, vec3 n) {
    return n.x * cross(columns[1], columns[2]) + n.y * cross(columns[2], columns[0]) + n.z * cross(columns[0], columns[1]);
}

#endif
