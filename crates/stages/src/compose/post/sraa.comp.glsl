// Subpixel reconstruction anti-aliasing (Chajdas et al. 2011, section 3): shading at pixel centres, visibility at samples.
//
// Each sample takes its radiance from the pixels around whose centre shows the same surface: near in the image, at the plane
// of the sample's triangle, with a similar normal. The pixel is the mean of its samples.
//
// Departures: the techniques shade at pixel centres, where no sample lies, so the surface there is rasterised as well. A
// sample of the surface at its own pixel's centre takes that radiance alone, so that textures stay sharp. Materials must be
// equal, so that two on one plane do not mix.
// In: color, RGBA8, sRGB-encoded; hdr, RGBA16F, radiance; sample_surfaces, sample_depths, SAMPLES samples a pixel, and
// center_surfaces, center_depths, one, RGBA8 or RGBA16 (sraa.frag.glsl) and D32F. Out: final_color, RGBA8, sRGB-encoded.
// One thread a pixel, groups of 8x8.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "packing.glsl"
#include "compose/post/blend.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 8) uniform texture2D color;
layout(set = 0, binding = 9) uniform texture2D hdr;
layout(set = 0, binding = 10) uniform texture2DMS sample_surfaces;
layout(set = 0, binding = 11) uniform texture2DMS sample_depths;
layout(set = 0, binding = 12) uniform texture2D center_surfaces;
layout(set = 0, binding = 14) uniform texture2D center_depths;
layout(set = 0, binding = 15, rgba8) writeonly uniform image2D final_color;

// 2, 4 or 8.
layout(constant_id = 8) const uint SAMPLES = 4u;

// 1 where surfaces have numbers of materials above 255: RGBA16.
layout(constant_id = 9) const uint WIDE_MATERIALS = 0u;
// The number of no material.
const uint NO_MATERIAL = 0xffffffffu;

// Vulkan's standard sample locations in a pixel, by count.
const vec2 SAMPLES_2[2] = vec2[](vec2(0.75, 0.75), vec2(0.25, 0.25));
const vec2 SAMPLES_4[4] = vec2[](vec2(0.375, 0.125), vec2(0.875, 0.375), vec2(0.125, 0.625), vec2(0.625, 0.875));
const vec2 SAMPLES_8[8] = vec2[](vec2(0.5625, 0.3125), vec2(0.4375, 0.6875), vec2(0.8125, 0.5625), vec2(0.3125, 0.1875),
                                 vec2(0.1875, 0.8125), vec2(0.0625, 0.4375), vec2(0.6875, 0.9375), vec2(0.9375, 0.0625));

// A sample is of the surface at its pixel's centre up to this distance off the plane, pixels, ...
const float SAME_PLANE_PX = 0.5;
// ... and this cosine between normals.
const float SAME_COSINE = 0.7;
// Falloffs of weights: by squared distance in the image, by squared distance off the plane (1/px^2), by the cosine's power.
const float FALLOFF_IMAGE = 1.0, FALLOFF_PLANE = 2.0, POWER_COSINE = 4.0;

struct Plane {
    vec3 position_ws;
    vec3 normal_ws;
    uint material;
    bool covered;
};

Plane plane_at(vec2 at_px, vec4 packed_surface, float depth) {
    Plane p;
    p.covered = depth > 0.0;
    vec2 octahedral;
    if (WIDE_MATERIALS != 0u) {
        uvec2 halves = uvec2(round(packed_surface.zw * 65535.0));
        p.material = halves.x | halves.y << 16;
        octahedral = packed_surface.xy;
    } else {
        uint bits = packUnorm4x8(packed_surface);
        p.material = bits >> 24;
        octahedral = vec2(bits & 0xfffu, bits >> 12 & 0xfffu) / 4095.0;
    }
    p.material = p.covered ? p.material : NO_MATERIAL;
    p.normal_ws = octahedral_decode(octahedral * 2.0 - 1.0);
    p.position_ws = p.covered ? position_from_depth(at_px * 2.0 / vec2(frame.size_px) - 1.0, depth) : vec3(0.0);
    return p;
}

Plane center_plane(ivec2 pixel) {
    return plane_at(vec2(pixel) + 0.5, texelFetch(center_surfaces, pixel, 0), texelFetch(center_depths, pixel, 0).r);
}

vec2 sample_location(uint s) {
    return SAMPLES == 2u ? SAMPLES_2[s & 1u] : SAMPLES == 4u ? SAMPLES_4[s & 3u] : SAMPLES_8[s & 7u];
}

// Metres that a pixel covers at a point, across the view.
float pixel_size_m(vec2 at_px, float depth) {
    vec2 a = at_px * 2.0 / vec2(frame.size_px) - 1.0, b = a + vec2(2.0 / float(frame.size_px.x), 0.0);
    return distance(position_from_depth(a, depth), position_from_depth(b, depth));
}

// (distance off the nearer of the two planes in pixels, cosine of normals).
vec2 off_plane(Plane a, Plane b, float pixel_m) {
    vec3 offset = b.position_ws - a.position_ws;
    return vec2(min(abs(dot(offset, a.normal_ws)), abs(dot(offset, b.normal_ws))) / pixel_m, dot(a.normal_ws, b.normal_ws));
}

// Radiance of a sample from the pixels around it.
vec3 reconstruct(ivec2 pixel, vec2 at_px, Plane surface, float pixel_m) {
    vec4 sum = vec4(0.0);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 other = pixel + ivec2(x, y);
            if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, ivec2(frame.size_px)))) {
                continue;
            }
            Plane center = center_plane(other);
            if (center.material != surface.material) {
                continue;
            }
            vec2 offset_px = vec2(other) + 0.5 - at_px;
            float weight = exp(-FALLOFF_IMAGE * dot(offset_px, offset_px));
            if (surface.covered) {
                vec2 off = off_plane(surface, center, pixel_m);
                weight *= exp(-FALLOFF_PLANE * off.x * off.x) * pow(max(off.y, 0.0), POWER_COSINE);
            }
            sum += weight * vec4(texelFetch(hdr, other, 0).rgb, 1.0);
        }
    }
    // No pixel around shows the sample's surface: take the pixel's own radiance.
    return sum.a > 1e-6 ? sum.rgb / sum.a : texelFetch(hdr, pixel, 0).rgb;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    Plane center = center_plane(pixel);
    vec3 sum = vec3(0.0);
    uint like_center = 0u;
    for (uint s = 0u; s < SAMPLES; ++s) {
        vec2 at_px = vec2(pixel) + sample_location(s);
        float depth = texelFetch(sample_depths, pixel, int(s)).r;
        Plane surface = plane_at(at_px, texelFetch(sample_surfaces, pixel, int(s)), depth);
        float pixel_m = surface.covered ? pixel_size_m(at_px, depth) : 1.0;
        bool same = surface.material == center.material;
        if (same && surface.covered) {
            vec2 off = off_plane(surface, center, pixel_m);
            same = off.x < SAME_PLANE_PX && off.y > SAME_COSINE;
        }
        if (same) {
            ++like_center;
        } else {
            sum += reconstruct(pixel, at_px, surface, pixel_m);
        }
    }
    if (like_center == SAMPLES) {
        imageStore(final_color, pixel, texelFetch(color, pixel, 0));
        return;
    }
    vec3 radiance = (sum + float(like_center) * texelFetch(hdr, pixel, 0).rgb) / float(SAMPLES);
    imageStore(final_color, pixel, vec4(display_color(radiance), 1.0));
}
