// The scene's records: draws and materials.
//
// They are stored in RGBA32UI images with rows of 1,024 texels, because lavapipe loads a texel with one vector instruction but a
// buffer word by word and lane by lane. Twins: DrawData and MaterialData in crates/shader/src/structs.rs, whose tests hold the texels.
#ifndef AFTERLIGHT_SCENE
#define AFTERLIGHT_SCENE
#extension GL_EXT_samplerless_texture_functions : require
#include "packing.glsl"

// A draw is at most 1,024 triangles of one instance, so that a triangle's number within its draw takes ten bits.
struct DrawData {
    vec4 object_row0;   // rows of the 3x4 matrix object -> world
    vec4 object_row1;
    vec4 object_row2;
    uint first_index;
    uint first_vertex;
    uint material;
    uint flags;         // DRAW_MIRRORED
};
const uint DRAW_MIRRORED = 1u;  // negative determinant: front faces are clockwise in world space
const uint TRIANGLE_BITS = 10u;
const uint NO_TRIANGLE = 0xffffffffu;

// A texture slot: bits 0-7 bucket (an array of textures of one size, format and sampler), 8-23 layer, 24 the set of
// texture coordinates, 25 a transform; all ones where there is no texture.
const uint NO_TEXTURE = 0xffffffffu;

struct MaterialData {
    vec4 base_color_factor;
    vec3 emissive_factor;
    float alpha_cutoff;
    float metallic_factor;
    float roughness_factor;
    float normal_scale;
    float occlusion_strength;
    uint flags;             // MATERIAL_*
    uint uv_transform;      // first of five transforms, in the order of the slots below
    uint base_color_slot;
    uint metallic_roughness_slot;
    uint normal_slot;
    uint occlusion_slot;
    uint emissive_slot;
    uint _padding;
};
const uint MATERIAL_UNLIT = 1u;
const uint MATERIAL_DOUBLE_SIDED = 2u;

// A degenerate transform may map a direction to zero: return zero then, not NaN.
vec3 unit_or_zero(vec3 v) {
    return v * inversesqrt(max(dot(v, v), 1e-30));
}

// Four texels a draw.
DrawData load_draw(utexture2D image, uint index) {
    ivec2 at = ivec2((index & 255u) * 4u, index >> 8);
    uvec4 tail = texelFetch(image, at + ivec2(3, 0), 0);
    return DrawData(uintBitsToFloat(texelFetch(image, at, 0)), uintBitsToFloat(texelFetch(image, at + ivec2(1, 0), 0)),
                    uintBitsToFloat(texelFetch(image, at + ivec2(2, 0), 0)), tail.x, tail.y, tail.z, tail.w);
}

// Eight texels a material, five of them used.
MaterialData load_material_from(utexture2D image, uint index) {
    ivec2 at = ivec2((index & 127u) * 8u, index >> 7);
    vec4 emission = uintBitsToFloat(texelFetch(image, at + ivec2(1, 0), 0));
    vec4 factors = uintBitsToFloat(texelFetch(image, at + ivec2(2, 0), 0));
    uvec4 a = texelFetch(image, at + ivec2(3, 0), 0);
    uvec4 b = texelFetch(image, at + ivec2(4, 0), 0);
    return MaterialData(uintBitsToFloat(texelFetch(image, at, 0)), emission.xyz, emission.w, factors.x, factors.y, factors.z,
                        factors.w, a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w);
}

// Normal matrix times n. It is the cofactor matrix, negated where the draw is mirrored, so that outward normals stay outward.
vec3 normal_to_world(vec4 r0, vec4 r1, vec4 r2, bool mirrored, vec3 n) {
    vec3 world = vec3(dot(cross(r1.xyz, r2.xyz), n), dot(cross(r2.xyz, r0.xyz), n), dot(cross(r0.xyz, r1.xyz), n));
    return unit_or_zero(mirrored ? -world : world);
}

// Square of the sine of the angle (1e-3 rad) below which a tangent counts as parallel to its normal. Loading a scene leaves such tangents out;
// here they come from transforms that flatten a mesh.
const float PARALLEL_SINE_SQUARED = 1e-6;

// The tangent of a surface that has none, or one along its unit normal, world space: the X axis laid into the surface, or the Z axis where
// the normal is within about 25 degrees of X. Twin: oracle/src/tangent.rs.
vec3 fallback_tangent(vec3 normal) {
    vec3 axis = abs(normal.x) < 0.9 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 0.0, 1.0);
    return unit_or_zero(axis - normal * dot(normal, axis));
}

// The tangent in world space, zero in object space where there is none, and the sign of the bitangent, which mirroring flips. The normal is that
// of normal_to_world.
vec4 tangent_to_world(vec4 r0, vec4 r1, vec4 r2, bool mirrored, vec4 t, vec3 normal_ws) {
    vec3 world = unit_or_zero(vec3(dot(r0.xyz, t.xyz), dot(r1.xyz, t.xyz), dot(r2.xyz, t.xyz)));
    vec3 side = cross(normal_ws, world);
    if (dot(side, side) <= PARALLEL_SINE_SQUARED * dot(normal_ws, normal_ws)) {
        world = fallback_tangent(normal_ws);
    }
    return vec4(world, mirrored ? -t.w : t.w);
}

// An affine transform given by its rows.
vec3 position_to_world(vec4 r0, vec4 r1, vec4 r2, vec3 p) {
    vec4 h = vec4(p, 1.0);
    return vec3(dot(r0, h), dot(r1, h), dot(r2, h));
}

#endif
