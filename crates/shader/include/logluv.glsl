// Colour of high dynamic range in 32 bits: LogLuv (Larson 1998). 15 bits of logarithmic luminance from 2^-64 to 2^64 in steps of
// 0.27%, 8 bits each of CIE 1976 u' and v' in steps of 1/410. Linear Rec. 709, nothing negative; black is zero.
#ifndef AFTERLIGHT_LOGLUV
#define AFTERLIGHT_LOGLUV

const mat3 XYZ_FROM_REC709 = mat3(0.4123908, 0.2126390, 0.0193308, 0.3575843, 0.7151687, 0.1191948, 0.1804808, 0.0721923, 0.9505322);
const mat3 REC709_FROM_XYZ = mat3(3.2409699, -0.9692436, 0.0556301, -1.5373832, 1.8759675, -0.2039770, -0.4986108, 0.0415551, 1.0569715);

uint logluv_encode(vec3 rgb) {
    vec3 xyz = XYZ_FROM_REC709 * rgb;
    if (!(xyz.y > 5.5e-20)) {
        return 0u;      // below 2^-64, or not a number
    }
    uint luminance = uint(clamp(256.0 * (log2(xyz.y) + 64.0), 1.0, 32767.0));
    vec2 uv = vec2(4.0, 9.0) * xyz.xy / (xyz.x + 15.0 * xyz.y + 3.0 * xyz.z);
    uvec2 chroma = uvec2(clamp(410.0 * uv, vec2(0.0), vec2(255.0)));
    return luminance << 16 | chroma.x << 8 | chroma.y;
}

vec3 logluv_decode(uint bits) {
    if (bits == 0u) {
        return vec3(0.0);
    }
    float y = exp2((float(bits >> 16) + 0.5) / 256.0 - 64.0);
    vec2 uv = (vec2(bits >> 8 & 0xffu, bits & 0xffu) + 0.5) / 410.0;
    vec3 xyz = vec3(9.0 * uv.x, 4.0 * uv.y, 12.0 - 3.0 * uv.x - 20.0 * uv.y) * (y / (4.0 * uv.y));
    return max(REC709_FROM_XYZ * xyz, vec3(0.0));
}

#endif
