// What TECHNIQUE_ID keeps of a surface. Needs shading.glsl.
//
// Four words a pixel (RGBA32UI):
//   x: base colour, square root, 3 x 8 bits; metalness, 8 bits
//   y: normal in world space, octahedral, 2 x 12 bits; roughness, 8 bits, 0 where the surface takes no light
//   z: emission, red and green, 16-bit floats
//   w: emission, blue; occlusion, 16-bit floats
#ifndef AFTERLIGHT_technique_folder_LAYOUT
#define AFTERLIGHT_technique_folder_LAYOUT

uvec4 packed_surface(Surface s) {
    // A square root spends the bits on dark colours, where the eye tells steps apart.
    uint color = packUnorm4x8(vec4(sqrt(s.base_color), s.metallic));
    uvec2 normal = uvec2(round((octahedral_encode(s.normal_ws) * 0.5 + 0.5) * 4095.0));
    uint roughness = s.unlit ? 0u : uint(round(clamp(s.roughness, MIN_ROUGHNESS, 1.0) * 255.0));
    vec3 emission = s.unlit ? vec3(0.0) : s.emission;
    return uvec4(color, normal.x | normal.y << 12 | roughness << 24, packHalf2x16(emission.rg),
                 packHalf2x16(vec2(emission.b, s.occlusion)));
}

Surface unpacked_surface(uvec4 words, vec3 position_ws) {
    Surface s;
    vec4 color = unpackUnorm4x8(words.x);
    s.position_ws = position_ws;
    s.base_color = color.rgb * color.rgb;
    s.metallic = color.a;
    s.normal_ws = octahedral_decode(vec2(words.y & 0xfffu, words.y >> 12 & 0xfffu) / 4095.0 * 2.0 - 1.0);
    s.roughness = float(words.y >> 24) / 255.0;
    s.unlit = s.roughness == 0.0;
    vec2 blue_occlusion = unpackHalf2x16(words.w);
    s.emission = vec3(unpackHalf2x16(words.z), blue_occlusion.x);
    s.occlusion = blue_occlusion.y;
    return s;
}

#endif
