// The triangle buffer: visible triangles by a sample point and screen-space derivatives (Schied and Dachsbacher 2015, section
// 3.2, equation 2; section 4.1).
//
// An attribute a over its clip w, and 1/w, are affine on the screen. A record holds their values at an anchor and their
// changes a pixel, 80 bytes:
//
//   words 0-2    1/w; view distance instead under an orthographic camera, whose w is 1
//   words 3-11   normal, world space, over w: x, y, z, three words each
//   words 12-17  texture coordinates over w
//   word 18      material; bit 31: the front faces the eye
//   word 19      anchor, pixels, 2 x 16 bits
//
// then, where the scene has them, six words of the second texture coordinates and twelve of the vertex colour.
//
// Where tangents are kept (TANGENTS), the normals and tangents of the three vertices are stored as they are, packed, and what is affine
// on the screen are the weights of the second and the third vertex:
//
//   words 3-8    weight of the second and of the third vertex over w, three words each
//   words 9-11   normals of the vertices, octahedral, 2 x 16 bits each
//   words 20-22  TANGENTS_OF_VERTICES: tangents of the vertices, octahedral, the bitangent's sign in the lowest bit of y
//   words 20-26  TANGENTS_WEIGHTED, of tessellated surfaces: tangents as packed_normals.glsl packs them, two words each; then
//                the lengths of the normals
//
// and second texture coordinates and vertex colour come after that: 92 bytes, or 108, instead of 80 + 36 for tangents over w.
//
// Departures: the paper extrapolates to the screen's centre, which needs no anchor, and leaves four bytes unused. They hold an
// anchor on the triangle here: far and narrow triangles then keep the precision of floats. The paper keeps no tangents; that is
// TANGENTS_BY_DERIVATIVES.
#ifndef AFTERLIGHT_TRIANGLE_RECORD
#define AFTERLIGHT_TRIANGLE_RECORD
#include "frame.glsl"
#include "material.glsl"

layout(constant_id = 24) const uint TANGENTS = 0u;
const uint TANGENTS_BY_DERIVATIVES = 0u;    // found from changes of position and texture coordinates; also where nothing needs tangents
const uint TANGENTS_OF_VERTICES = 1u;
const uint TANGENTS_WEIGHTED = 2u;      // normals and tangents of the vertices are not of unit length

const uint TANGENT_WORD = 20u;
const uint NORMAL_LENGTHS_WORD = 26u;
const uint UV1_WORD = 20u + (TANGENTS == TANGENTS_OF_VERTICES ? 3u : 0u) + (TANGENTS == TANGENTS_WEIGHTED ? 7u : 0u);
const uint COLOR_WORD = UV1_WORD + (HAS_UV1 != 0u ? 6u : 0u);
const uint RECORD_WORDS = COLOR_WORD + (HAS_VERTEX_COLOR != 0u ? 12u : 0u);
const uint RECORD_FRONT = 0x80000000u;

// Records that a buffer of so many words has room for. What its memory is rounded up by holds none. Pipelines do not depend on it, so that a
// buffer that grows makes none anew.
uint record_room(int words) {
    return uint(words) / RECORD_WORDS;
}

#endif
