// What records of the triangle buffer give at pixel centres against what the rasteriser interpolates there (Schied and
// Dachsbacher 2015, Figure 6). A thread a pixel: the record of the triangle that the reference shows, where the pixel refers to it.
//
// In: the source of records, RecordIds, reference_position (world position, m, as the bits of floats, and triangle ID),
// reference_color (base colour, linear). Out: hdr, RGBA16F, display-linear; AttributeErrors, two floats a pixel: distance of the
// positions, the scene's longest side being 2; largest difference of a channel of the base colours; -1 where nothing is
// compared. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "views/records.glsl"
#include "heat.glsl"

layout(set = 0, binding = 11) uniform utexture2D reference_position;
layout(set = 0, binding = 12) uniform texture2D reference_color;
layout(set = 0, binding = 14, rgba16f) writeonly uniform image2D hdr;
layout(set = 0, binding = 15, scalar) readonly buffer RecordIds {
    uint record_ids[];
};
layout(set = 0, binding = 16, scalar) writeonly buffer AttributeErrors {
    vec2 attribute_errors[];
};
// 0 shows positions, 1 texture look-ups.
layout(constant_id = 10) const uint TEXTURE_ERROR = 0u;
layout(push_constant, scalar) uniform Push {
    float unit_from_m;
};

// Figure 6 amplifies differences of texture look-ups by it.
const float AMPLIFICATION = 1000.0;

bool record_of(uint id, ivec2 pixel, out uint place) {
    uint name, weight;
    source_begin(pixel);
    while (source_next_triangle(name, weight)) {
        place = source_place(name);
        if (place < uint(record_ids.length()) && record_ids[place] == id) {
            return true;
        }
    }
    return false;
}

void main() {
    if (!in_image()) {
        return;
    }
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    uvec4 reference = texelFetch(reference_position, pixel, 0);
    uint place;
    vec2 errors = vec2(-1.0);
    vec3 color = vec3(0.0);
    if (reference.w != NO_TRIANGLE && record_of(reference.w, pixel, place)) {
        uint material;
        SurfacePoint p = interpolated_point(place, vec2(pixel), material);
        vec3 base_color = base_color_at(load_material(material), p).rgb;
        vec3 difference = abs(base_color - texelFetch(reference_color, pixel, 0).rgb);
        errors.x = distance(p.position_ws, uintBitsToFloat(reference.xyz)) * unit_from_m;
        errors.y = max(difference.r, max(difference.g, difference.b));
        color = TEXTURE_ERROR != 0u ? min(difference * AMPLIFICATION, 1.0) : error_color(errors.x);
    }
    attribute_errors[uint(pixel.y) * frame.size_px.x + uint(pixel.x)] = errors;
    imageStore(hdr, pixel, vec4(color, 1.0));
}
