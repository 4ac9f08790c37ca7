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
// Departure: the paper extrapolates to the screen's centre, which needs no anchor, and leaves four bytes unused. They hold an
// anchor on the triangle here: far and narrow triangles then keep the precision of floats.
#ifndef AFTERLIGHT_TRIANGLE_RECORD
#define AFTERLIGHT_TRIANGLE_RECORD
#include "frame.glsl"
#include "material.glsl"

const uint UV1_WORD = 20u;
const uint COLOR_WORD = 20u + (HAS_UV1 != 0u ? 6u : 0u);
const uint RECORD_WORDS = COLOR_WORD + (HAS_VERTEX_COLOR != 0u ? 12u : 0u);
const uint RECORD_FRONT = 0x80000000u;

#endif
