// A triangle as fragments store it where no index leads back to its vertices, which tessellation made (Schied and Dachsbacher
// 2015, section 3.1). It takes the words of its record until the derivative pass overwrites them:
//
//   words 0-8    positions, world space, three words a vertex
//   words 9-11   directions of the normals, octahedral, 2 x 16 bits
//   words 12-17  texture coordinates, two words a vertex
//   word 18      material; bit 31: the front faces the eye
//   word 19      lengths of the normals over that of the longest, 3 x 10 bits
//
// where tangents are kept
//
//   words 20-25  tangents, two words a vertex; packed_normals.glsl has the formats of normals and tangents
//
// then, where the scene has them, second texture coordinates, two words a vertex, and vertex colours, four.
#ifndef AFTERLIGHT_TRIANGLE_VERTICES
#define AFTERLIGHT_TRIANGLE_VERTICES
#include "surfaces/geometry/packed_normals.glsl"
#endif
