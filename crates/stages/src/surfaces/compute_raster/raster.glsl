// Rasterisation in compute: coverage of every sample by Vulkan's rules, the nearest surface kept by a 64-bit maximum.
//
// Vertices are snapped to 1/256 pixel, edge functions are exact integers, ties follow the top-left rule: triangles that share
// an edge neither overlap nor leave a gap. A sample's key is its depth (reversed, so the greatest is nearest) above the
// complement of the triangle's place in the order of draws: of equal depths the first drawn wins, as in a raster pass.
#ifndef AFTERLIGHT_RASTER
#define AFTERLIGHT_RASTER
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#define EXPLICIT_GRADIENTS
#include "frame.glsl"
#include "triangle.glsl"
#include "samples.glsl"

// One key for each sample; the keys of a pixel are neighbours.
layout(set = 0, binding = 8, scalar) buffer SampleKeys {
    uint64_t sample_keys[];
};
// VkDrawIndexedIndirectCommand: index count, 1, first index, vertex offset, draw.
layout(set = 0, binding = 9, scalar) readonly buffer DrawCommands {
    uint draw_commands[];
};

const int SUBPIXELS = 256;
// Snapped coordinates are clamped to this many pixels, so that products of their differences fit into 64 bits.
const float GUARD_BAND_PX = 2.0e6;

// A triangle on the screen, its front towards the viewer, vertices so ordered that the inside is at positive edge functions.
struct ScreenTriangle {
    ivec2 p0, p1, p2;   // 1/256 pixel
    vec3 depth;
};

struct RasterDraw {
    DrawData data;
    uint draw;
    bool double_sided;
    float alpha_cutoff;     // 0: no alpha test
};

RasterDraw load_raster_draw(uint command) {
    uint draw = draw_commands[command * 5u + 4u];
    DrawData d = load_draw(draw_data, draw);
    MaterialData m = load_material(d.material);
    return RasterDraw(d, draw, (m.flags & MATERIAL_DOUBLE_SIDED) != 0u, m.alpha_cutoff);
}

ivec2 snapped(vec4 clip) {
    vec2 px = (clip.xy / clip.w * 0.5 + 0.5) * vec2(frame.size_px);
    return ivec2(round(clamp(px, -GUARD_BAND_PX, GUARD_BAND_PX) * float(SUBPIXELS)));
}

bool before_near_plane(vec4 clip) {
    return clip.z > clip.w;
}

// Where an edge meets the near plane, the same from both of its ends.
vec4 at_near_plane(vec4 inside, vec4 outside) {
    float a = inside.w - inside.z, b = outside.z - outside.w;
    return mix(inside, outside, a / (a + b));
}

// Part `part` (0 or 1) of a triangle clipped at the near plane; false where there is none or it faces away.
bool screen_triangle(RasterDraw d, vec4 c0, vec4 c1, vec4 c2, uint part, out ScreenTriangle t) {
    uint outside = uint(before_near_plane(c0)) | uint(before_near_plane(c1)) << 1 | uint(before_near_plane(c2)) << 2;
    if (outside == 7u || part == 1u && bitCount(outside) != 1u) {
        return false;
    }
    if (outside != 0u) {
        // Rotated so that the vertex that lies on the other side of the plane than the two others comes first.
        uint odd = bitCount(outside) == 1u ? outside : 7u - outside;
        if (odd == 2u) {
            vec4 c = c0;
            c0 = c1;
            c1 = c2;
            c2 = c;
        } else if (odd == 4u) {
            vec4 c = c0;
            c0 = c2;
            c2 = c1;
            c1 = c;
        }
        if (bitCount(outside) == 2u) {
            c1 = at_near_plane(c0, c1);
            c2 = at_near_plane(c0, c2);
        } else if (part == 0u) {
            c0 = at_near_plane(c1, c0);
        } else {
            vec4 first = at_near_plane(c1, c0);
            c1 = c2;
            c2 = at_near_plane(c2, c0);
            c0 = first;
        }
    }
    t.p0 = snapped(c0);
    t.p1 = snapped(c1);
    t.p2 = snapped(c2);
    t.depth = vec3(c0.z / c0.w, c1.z / c1.w, c2.z / c2.w);
    ivec2 a = t.p1 - t.p0, b = t.p2 - t.p0;
    int64_t area = int64_t(a.x) * int64_t(b.y) - int64_t(a.y) * int64_t(b.x);
    bool mirrored = (d.data.flags & DRAW_MIRRORED) != 0u;
    bool front = (area < 0L) != mirrored;
    if (area == 0L || !front && !d.double_sided) {
        return false;
    }
    if (area < 0L) {
        ivec2 p = t.p1;
        t.p1 = t.p2;
        t.p2 = p;
        t.depth = t.depth.xzy;
    }
    return true;
}

// Depth over the screen, pixels.
struct DepthPlane {
    float at_p0;
    vec2 slope;
    float least, greatest;
};

DepthPlane depth_plane(ScreenTriangle t) {
    vec2 a = vec2(t.p1 - t.p0) / float(SUBPIXELS), b = vec2(t.p2 - t.p0) / float(SUBPIXELS);
    float u = t.depth.y - t.depth.x, v = t.depth.z - t.depth.x;
    vec2 slope = vec2(u * b.y - v * a.y, v * a.x - u * b.x) / (a.x * b.y - a.y * b.x);
    return DepthPlane(t.depth.x, slope, min(t.depth.x, min(t.depth.y, t.depth.z)),
                      max(t.depth.x, max(t.depth.y, t.depth.z)));
}

float depth_at(DepthPlane plane, vec2 from_p0_px) {
    return clamp(plane.at_p0 + dot(plane.slope, from_p0_px), plane.least, plane.greatest);
}

// 0 where a sample exactly on the edge from a to b belongs to the triangle (top-left rule), else -1.
int edge_bias(ivec2 a, ivec2 b) {
    ivec2 d = b - a;
    return d.y < 0 || d.y == 0 && d.x > 0 ? 0 : -1;
}

// First and last pixel that a triangle's box touches, within the image; empty where first > last.
void pixel_box(ScreenTriangle t, out ivec2 first, out ivec2 last) {
    first = max(min(t.p0, min(t.p1, t.p2)) >> 8, ivec2(0));
    last = min(max(t.p0, max(t.p1, t.p2)) >> 8, ivec2(frame.size_px) - 1);
}

uint key_index(ivec2 pixel, uint i) {
    return (uint(pixel.y) * frame.size_px.x + uint(pixel.x)) * SAMPLES + i;
}

void vertices_clip(DrawData d, uvec3 v, out vec4 c0, out vec4 c1, out vec4 c2) {
    c0 = frame.clip_from_world * vec4(load_position(d, v.x), 1.0);
    c1 = frame.clip_from_world * vec4(load_position(d, v.y), 1.0);
    c2 = frame.clip_from_world * vec4(load_position(d, v.z), 1.0);
}

// Alpha test at the pixel's centre, as a fragment shader has it.
bool passes_alpha(RasterDraw d, uint triangle, ivec2 pixel) {
#ifdef ALPHA_MASK
    if (d.alpha_cutoff <= 0.0) {
        return true;
    }
    uint material;
    uint id = d.draw << TRIANGLE_BITS | triangle;
    SurfacePoint p = triangle_point(id, ndc_from_pixel(uvec2(pixel)), material);
    take_quad_gradients(id, uvec2(pixel), p);
    return base_color_at(load_material(material), p).a >= d.alpha_cutoff;
#else
    return true;
#endif
}

// Writes the triangle's key to every sample of the mask where it is the nearest so far. `order` is the triangle's place in the order of draws.
void keep_nearest(ivec2 pixel, uint covered, ScreenTriangle t, DepthPlane plane, uint order, RasterDraw d) {
    vec2 corner = vec2(pixel) - vec2(t.p0) / float(SUBPIXELS);
    uint wins = 0u;
    for (uint i = 0u; i < SAMPLES; ++i) {
        if ((covered >> i & 1u) != 0u) {
            float depth = depth_at(plane, corner + sample_location(i));
            uint64_t key = packUint2x32(uvec2(~order, floatBitsToUint(depth)));
            // If this plain read is out of date, the key was smaller: an atomic is done that was not needed, and no sample is lost.
            wins |= depth > 0.0 && key > sample_keys[key_index(pixel, i)] ? 1u << i : 0u;
        }
    }
    if (wins == 0u || !passes_alpha(d, order & ((1u << TRIANGLE_BITS) - 1u), pixel)) {
        return;
    }
    for (uint i = 0u; i < SAMPLES; ++i) {
        if ((wins >> i & 1u) != 0u) {
            float depth = depth_at(plane, corner + sample_location(i));
            atomicMax(sample_keys[key_index(pixel, i)], packUint2x32(uvec2(~order, floatBitsToUint(depth))));
        }
    }
}

#endif
