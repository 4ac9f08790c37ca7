// Packed numbers, as crates/scene/src/model.rs packs them.
#ifndef AFTERLIGHT_PACKING
#define AFTERLIGHT_PACKING

// Unit vector from octahedral coordinates in [-1, 1]^2 (Cigolle et al. 2014).
vec3 octahedral_decode(vec2 e) {
    vec3 v = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float t = max(-v.z, 0.0);
    v.xy -= vec2(v.x >= 0.0 ? t : -t, v.y >= 0.0 ? t : -t);
    return normalize(v);
}

// Octahedral coordinates in [-1, 1]^2 of a unit vector.
vec2 octahedral_encode(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    return n.z < 0.0 ? folded : p;
}

vec3 unpack_normal(uint bits) {
    return octahedral_decode(unpackSnorm2x16(bits));
}

// The tangent, zero where there is none, and in w the sign of the bitangent, which is stored in the lowest bit of y.
vec4 unpack_tangent(uint bits) {
    vec3 tangent = octahedral_decode(unpackSnorm2x16(bits & ~0x10000u));
    bool none = (bits & 0xffffu) == 0x8000u;
    return vec4(none ? vec3(0.0) : tangent, (bits & 0x10000u) != 0u ? -1.0 : 1.0);
}

// What unpack_tangent unpacks, of a unit tangent.
uint pack_tangent(vec4 tangent) {
    return packSnorm2x16(octahedral_encode(tangent.xyz)) & ~0x10000u | (tangent.w < 0.0 ? 0x10000u : 0u);
}

#endif
