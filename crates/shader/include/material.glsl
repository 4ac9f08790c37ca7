// From interpolated attributes to a Surface: textures, alpha, normal map (glTF 2.0, section 3.9).
//
// A shader that samples in uniform quads (fragment shaders) uses implicit derivatives; with EXPLICIT_GRADIENTS the
// derivatives come with the coordinates. Textures stand in arrays ("buckets") of one size, format and sampler,
// because lavapipe has no descriptor indexing. The bucket is picked by comparisons; the compiler removes those for buckets
// that the scene does not have.
#ifndef AFTERLIGHT_MATERIAL
#define AFTERLIGHT_MATERIAL
#include "scene.glsl"

layout(constant_id = 0) const uint SRGB_BUCKETS = 12u;
layout(constant_id = 1) const uint NORMAL_BUCKETS = 8u;
layout(constant_id = 2) const uint DATA_BUCKETS = 8u;
layout(constant_id = 3) const uint HAS_UV1 = 1u;
layout(constant_id = 4) const uint HAS_VERTEX_COLOR = 1u;
layout(constant_id = 5) const uint HAS_UV_TRANSFORM = 1u;

layout(set = 1, binding = 0) uniform sampler2DArray srgb_textures[12];
layout(set = 1, binding = 1) uniform sampler2DArray normal_textures[8];
layout(set = 1, binding = 2) uniform sampler2DArray data_textures[8];

layout(set = 0, binding = 2) uniform utexture2D material_data;

MaterialData load_material(uint index) {
    return load_material_from(material_data, index);
}

layout(set = 0, binding = 3, scalar) readonly buffer UvTransforms {
    vec4 uv_transforms[];   // two rows (xyz) a transform
};

// Texture coordinates and their changes (used with EXPLICIT_GRADIENTS alone): the differences that a quad of fragments has, between its upper
// left pixel and the pixels beside and below it. By these forward shading chooses its mip level; analytic changes at the pixel's own centre
// choose others where a surface is seen at a flat angle.
struct TextureCoordinates {
    vec2 uv;
    vec2 ddx;
    vec2 ddy;
};

// Where a triangle's plane ends at one of the quad's pixels, at its horizon, no difference is finite. It counts as larger than any: the
// smallest mip level, as a raster pass has it, whose interpolation is off by a rounding and so finite.
vec2 finite_change(vec2 change) {
    const float MOST = 1e10;
    return vec2(abs(change.x) < MOST ? change.x : MOST, abs(change.y) < MOST ? change.y : MOST);
}

// Attributes interpolated at a point of a triangle.
struct SurfacePoint {
    vec3 position_ws;
    vec3 normal_ws;     // interpolated, not unit
    vec4 tangent_ws;    // interpolated, not unit; w: the bitangent's sign
    TextureCoordinates uv0;
    TextureCoordinates uv1;
    vec4 color;         // linear vertex colour
    bool front_facing;
};

// What shading needs to know of a point.
struct Surface {
    vec3 position_ws;
    vec3 normal_ws;     // unit
    vec3 base_color;    // linear
    float metallic;
    float roughness;    // perceptual
    float occlusion;
    vec3 emission;      // radiance
    bool unlit;
};

#ifdef EXPLICIT_GRADIENTS
#define TAP(array, uvw) textureGrad(array, uvw, at.ddx, at.ddy)
#else
#define TAP(array, uvw) texture(array, uvw)
#endif
#define BUCKET(count, array, k) if (count > k && (count == k + 1u || bucket == k)) return TAP(array[k], uvw)

vec4 sample_srgb(uint slot, TextureCoordinates at) {
    vec3 uvw = vec3(at.uv, float((slot >> 8) & 0xffffu));
    uint bucket = slot & 0xffu;
    BUCKET(SRGB_BUCKETS, srgb_textures, 0u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 1u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 2u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 3u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 4u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 5u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 6u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 7u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 8u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 9u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 10u);
    BUCKET(SRGB_BUCKETS, srgb_textures, 11u);
    return vec4(1.0);
}

vec2 sample_normal(uint slot, TextureCoordinates at) {
    vec3 uvw = vec3(at.uv, float((slot >> 8) & 0xffffu));
    uint bucket = slot & 0xffu;
#undef BUCKET
#define BUCKET(count, array, k) if (count > k && (count == k + 1u || bucket == k)) return TAP(array[k], uvw).xy
    BUCKET(NORMAL_BUCKETS, normal_textures, 0u);
    BUCKET(NORMAL_BUCKETS, normal_textures, 1u);
    BUCKET(NORMAL_BUCKETS, normal_textures, 2u);
    BUCKET(NORMAL_BUCKETS, normal_textures, 3u);
    BUCKET(NORMAL_BUCKETS, normal_textures, 4u);
    BUCKET(NORMAL_BUCKETS, normal_textures, 5u);
    BUCKET(NORMAL_BUCKETS, normal_textures, 6u);
    BUCKET(NORMAL_BUCKETS, normal_textures, 7u);
    return vec2(0.5);
}

vec3 sample_data(uint slot, TextureCoordinates at) {
    vec3 uvw = vec3(at.uv, float((slot >> 8) & 0xffffu));
    uint bucket = slot & 0xffu;
#undef BUCKET
#define BUCKET(count, array, k) if (count > k && (count == k + 1u || bucket == k)) return TAP(array[k], uvw).xyz
    BUCKET(DATA_BUCKETS, data_textures, 0u);
    BUCKET(DATA_BUCKETS, data_textures, 1u);
    BUCKET(DATA_BUCKETS, data_textures, 2u);
    BUCKET(DATA_BUCKETS, data_textures, 3u);
    BUCKET(DATA_BUCKETS, data_textures, 4u);
    BUCKET(DATA_BUCKETS, data_textures, 5u);
    BUCKET(DATA_BUCKETS, data_textures, 6u);
    BUCKET(DATA_BUCKETS, data_textures, 7u);
    return vec3(1.0);
}
#undef BUCKET
#undef TAP

// The coordinates that a slot samples at: its set, transformed (KHR_texture_transform). `index` is the slot's place
// in the material.
TextureCoordinates coordinates_for(SurfacePoint p, MaterialData m, uint slot, uint index) {
    TextureCoordinates at = p.uv0;
    if (HAS_UV1 != 0u && (slot & (1u << 24)) != 0u) {
        at = p.uv1;
    }
    if (HAS_UV_TRANSFORM != 0u && (slot & (1u << 25)) != 0u) {
        vec3 row0 = uv_transforms[(m.uv_transform + index) * 2u].xyz;
        vec3 row1 = uv_transforms[(m.uv_transform + index) * 2u + 1u].xyz;
        at.uv = vec2(dot(row0, vec3(at.uv, 1.0)), dot(row1, vec3(at.uv, 1.0)));
        at.ddx = vec2(dot(row0.xy, at.ddx), dot(row1.xy, at.ddx));
        at.ddy = vec2(dot(row0.xy, at.ddy), dot(row1.xy, at.ddy));
    }
    return at;
}

// Base colour and alpha, linear.
vec4 base_color_at(MaterialData m, SurfacePoint p) {
    vec4 color = m.base_color_factor;
    if (SRGB_BUCKETS > 0u && m.base_color_slot != NO_TEXTURE) {
        color *= sample_srgb(m.base_color_slot, coordinates_for(p, m, m.base_color_slot, 0u));
    }
    if (HAS_VERTEX_COLOR != 0u) {
        color *= p.color;
    }
    return color;
}

vec3 mapped_normal(MaterialData m, SurfacePoint p) {
    vec3 n = p.normal_ws;
    if (NORMAL_BUCKETS > 0u && m.normal_slot != NO_TEXTURE) {
        vec2 xy = sample_normal(m.normal_slot, coordinates_for(p, m, m.normal_slot, 2u)) * 2.0 - 1.0;
        float z = sqrt(max(1.0 - dot(xy, xy), 0.0));
        xy *= m.normal_scale;
        // MikkTSpace builds the basis from the interpolated vectors without normalising them first.
        vec3 bitangent = p.tangent_ws.w * cross(p.normal_ws, p.tangent_ws.xyz);
        n = xy.x * p.tangent_ws.xyz + xy.y * bitangent + z * p.normal_ws;
    }
    n = normalize(n);
    return p.front_facing ? n : -n;
}

// The surface at a point. The caller passes the base colour, which an alpha test has needed before.
Surface surface_at(MaterialData m, SurfacePoint p, vec3 base_color) {
    Surface s;
    s.position_ws = p.position_ws;
    s.normal_ws = mapped_normal(m, p);
    s.base_color = base_color;
    s.metallic = m.metallic_factor;
    s.roughness = m.roughness_factor;
    s.occlusion = 1.0;
    s.emission = m.emissive_factor;
    s.unlit = (m.flags & MATERIAL_UNLIT) != 0u;
    if (DATA_BUCKETS > 0u && m.metallic_roughness_slot != NO_TEXTURE) {
        vec3 orm = sample_data(m.metallic_roughness_slot, coordinates_for(p, m, m.metallic_roughness_slot, 1u));
        s.roughness *= orm.y;
        s.metallic *= orm.z;
    }
    if (DATA_BUCKETS > 0u && m.occlusion_slot != NO_TEXTURE) {
        float occlusion = sample_data(m.occlusion_slot, coordinates_for(p, m, m.occlusion_slot, 3u)).x;
        s.occlusion = 1.0 + m.occlusion_strength * (occlusion - 1.0);
    }
    if (SRGB_BUCKETS > 0u && m.emissive_slot != NO_TEXTURE) {
        s.emission *= sample_srgb(m.emissive_slot, coordinates_for(p, m, m.emissive_slot, 4u)).rgb;
    }
    return s;
}

#endif
