//! Normals and tangents that a file leaves out.
//!
//! Tangents are those of MikkTSpace (Mikkelsen 2008, "Simulation of wrinkled surfaces revisited",
//! and its reference code), which glTF asks for: vertices equal in position, normal and texture
//! coordinates are welded; the corners around a welded vertex that are joined by edges and have
//! texture coordinates of one handedness form a group; a group's tangent is the mean of its faces'
//! tangents in the plane of the normal, weighted by the corners' angles.
//!
//! Departures from the reference code: faces are triangles (no quads), groups are not split by angle (its default of 180° splits none), and every step takes time and memory in
//! proportion to the mesh. The reference takes the square of the faces around one vertex and of
//! degenerate faces, and recurses once a face: a file of 1 MB could stop the program. Its port
//! `bevy_mikktspace` is the twin in the tests.

use glam::{Vec2, Vec3, Vec4};

/// One mesh whose tangents are wanted: a triangle list.
pub(crate) struct Surface<'a> {
    /// Positions, object space.
    pub(crate) positions_os: &'a [[f32; 3]],
    /// Unit normals, object space.
    pub(crate) normals_os: &'a [[f32; 3]],
    /// Texture coordinates that the normal map is seen through, v downwards.
    pub(crate) uvs: &'a [[f32; 2]],
    /// Three a triangle, below the number of vertices.
    pub(crate) indices: &'a [u32],
}

/// No vertex, face or corner.
const NONE: u32 = u32::MAX;

/// What a triangle's texture coordinates say about it.
#[derive(Clone, Copy, Default)]
struct Face {
    /// Unit direction of growing u in the triangle's plane.
    tangent_os: Vec3,
    /// Whether u and v are right-handed seen from the front (v upwards).
    right_handed: bool,
    /// Texture coordinates without area: takes on what its neighbours have.
    is_vague: bool,
    /// Two corners in one place: takes no part.
    is_degenerate: bool,
}

/// MikkTSpace tangents, one a corner: three a triangle. w is the bitangent's sign as glTF has it
/// (bitangent = w · cross(normal, tangent), along the image's upward direction).
pub(crate) fn corner_tangents(surface: &Surface) -> Vec<Vec4> {
    let welded = weld(surface);
    let corners: Vec<u32> = surface.indices.iter().map(|&i| welded[i as usize]).collect();
    let (triangles, _) = corners.as_chunks::<3>();
    let mut faces: Vec<Face> = triangles.iter().map(|t| face(surface, *t)).collect();
    let neighbors = neighbors(surface.positions_os.len(), triangles, &faces);
    let mut out = vec![Vec4::ZERO; corners.len()];
    let mut members = Vec::new();
    for first in 0..corners.len() as u32 {
        let f = faces[first as usize / 3];
        if f.is_degenerate || f.is_vague || out[first as usize].w != 0.0 {
            continue;
        }
        let sign = if f.right_handed { 1.0 } else { -1.0 };
        flood(first, sign, triangles, &neighbors, &mut faces, &mut out, &mut members);
        let tangent_os = mean_tangent(surface, triangles, &faces, &members);
        members.iter().for_each(|&c| out[c as usize] = tangent_os.extend(sign));
    }
    fill_rest(surface, &corners, &faces, &mut out);
    out
}

/// For each vertex the first one that is equal to it in position, normal and texture coordinates.
fn weld(surface: &Surface) -> Vec<u32> {
    let count = surface.positions_os.len();
    // adding 0 makes -0 and 0, which are equal, the same bits
    let key = |i: usize| -> [u32; 8] {
        let ([px, py, pz], [nx, ny, nz], [u, v]) =
            (surface.positions_os[i], surface.normals_os[i], surface.uvs[i]);
        [px, py, pz, nx, ny, nz, u, v].map(|f| (f + 0.0).to_bits())
    };
    let slots_bits = (2 * count.max(1)).next_power_of_two().trailing_zeros();
    let mask = (1usize << slots_bits) - 1;
    let mut slots = vec![NONE; 1 << slots_bits];
    (0..count)
        .map(|i| {
            let k = key(i);
            let mut at = (hash(&k) >> (64 - slots_bits)) as usize & mask;
            loop {
                match slots[at] {
                    NONE => {
                        slots[at] = i as u32;
                        return i as u32;
                    }
                    other if key(other as usize) == k => return other,
                    _ => at = (at + 1) & mask,
                }
            }
        })
        .collect()
}

/// A hash of words, mixed so that its upper bits are good: multiply and fold, seeded at random
/// once a process, since files could be made to collide otherwise.
fn hash(words: &[u32; 8]) -> u64 {
    use std::hash::{BuildHasher, RandomState};
    static SEED: std::sync::LazyLock<u64> = std::sync::LazyLock::new(|| RandomState::new().hash_one(0u8) | 1);
    words.iter().fold(*SEED, |h, &w| {
        let product = u128::from(h ^ u64::from(w)) * u128::from(*SEED ^ 0x9E37_79B9_7F4A_7C15);
        (product as u64) ^ (product >> 64) as u64
    })
}

fn face(surface: &Surface, triangle: [u32; 3]) -> Face {
    let positions_os = triangle.map(|v| Vec3::from(surface.positions_os[v as usize]));
    // MikkTSpace has v upwards, glTF downwards
    let uv = triangle.map(|v| Vec2::new(surface.uvs[v as usize][0], 1.0 - surface.uvs[v as usize][1]));
    let [p, q, r] = positions_os;
    if p == q || q == r || r == p {
        return Face { is_degenerate: true, ..Face::default() };
    }
    let (edge1, edge2, uv1, uv2) = (q - p, r - p, uv[1] - uv[0], uv[2] - uv[0]);
    let area = uv1.perp_dot(uv2);
    let along_u = uv2.y * edge1 - uv1.y * edge2;
    let along_v = uv1.x * edge2 - uv2.x * edge1;
    let is_vague = !(area.abs() > f32::MIN_POSITIVE
        && along_u.length() / area.abs() > f32::MIN_POSITIVE
        && along_v.length() / area.abs() > f32::MIN_POSITIVE);
    let right_handed = area > 0.0;
    let sign = if right_handed { 1.0 } else { -1.0 };
    Face { tangent_os: sign * along_u.normalize_or_zero(), right_handed, is_vague, is_degenerate: false }
}

/// For each edge (of corner c to the next) the face on its other side. An edge of several faces
/// joins them in pairs of opposite direction, in the order of faces.
fn neighbors(vertex_count: usize, triangles: &[[u32; 3]], faces: &[Face]) -> Vec<u32> {
    /// An edge in the list of its lower vertex.
    #[derive(Clone, Copy, Default)]
    struct Edge {
        upper: u32,
        corner: u32,
        ascends: bool,
    }
    let each = |f: &mut dyn FnMut(u32, Edge)| {
        for (face, t) in triangles.iter().enumerate().filter(|(face, _)| !faces[*face].is_degenerate) {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                f(a.min(b), Edge { upper: a.max(b), corner: (3 * face + k) as u32, ascends: a < b });
            }
        }
    };
    // counting sort by the lower vertex
    let mut starts = vec![0u32; vertex_count + 1];
    each(&mut |lower, _| starts[lower as usize + 1] += 1);
    for v in 0..vertex_count {
        starts[v + 1] += starts[v];
    }
    let mut edges = vec![Edge::default(); starts[vertex_count] as usize];
    let mut next = starts.clone();
    each(&mut |lower, edge| {
        edges[next[lower as usize] as usize] = edge;
        next[lower as usize] += 1;
    });
    let mut out = vec![NONE; 3 * triangles.len()];
    // edges that wait for a partner, of the one direction or the other
    let mut waiting = std::collections::VecDeque::new();
    for bounds in starts.windows(2) {
        let list = &mut edges[bounds[0] as usize..bounds[1] as usize];
        list.sort_unstable_by_key(|e| (e.upper, e.corner));
        for run in list.chunk_by(|a, b| a.upper == b.upper) {
            waiting.clear();
            for &edge in run {
                match waiting.front() {
                    Some(&Edge { corner, ascends, .. }) if ascends != edge.ascends => {
                        waiting.pop_front();
                        out[corner as usize] = edge.corner / 3;
                        out[edge.corner as usize] = corner / 3;
                    }
                    _ => waiting.push_back(edge),
                }
            }
        }
    }
    out
}

/// Collects the corners of the group of corner `first`: those around its vertex that edges and one
/// handedness join. Marks them in `out` by `sign`.
fn flood(
    first: u32,
    sign: f32,
    triangles: &[[u32; 3]],
    neighbors: &[u32],
    faces: &mut [Face],
    out: &mut [Vec4],
    members: &mut Vec<u32>,
) {
    let vertex = triangles[first as usize / 3][first as usize % 3];
    members.clear();
    members.push(first);
    out[first as usize].w = sign;
    let mut done = 0;
    while let Some(&corner) = members.get(done) {
        done += 1;
        let (face, k) = (corner as usize / 3, corner as usize % 3);
        // the two edges that meet at the corner
        for edge in [3 * face + (k + 2) % 3, 3 * face + k] {
            let other = neighbors[edge];
            if other == NONE {
                continue;
            }
            let other = other as usize;
            let Some(k) = triangles[other].iter().position(|&v| v == vertex) else { continue };
            let corner = 3 * other + k;
            if out[corner].w != 0.0 {
                continue;
            }
            if faces[other].is_vague && out[3 * other..3 * other + 3].iter().all(|t| t.w == 0.0) {
                faces[other].right_handed = sign > 0.0;
            }
            if faces[other].right_handed == (sign > 0.0) {
                out[corner].w = sign;
                members.push(corner as u32);
            }
        }
    }
}

/// The mean tangent of a group's faces in the plane of the vertex' normal, weighted by the angle of
/// each at the vertex.
fn mean_tangent(surface: &Surface, triangles: &[[u32; 3]], faces: &[Face], members: &[u32]) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for &corner in members {
        let (face, k) = (corner as usize / 3, corner as usize % 3);
        if faces[face].is_vague {
            continue;
        }
        let t = triangles[face];
        let position = |k: usize| Vec3::from(surface.positions_os[t[k % 3] as usize]);
        let normal_os = Vec3::from(surface.normals_os[t[k] as usize]);
        let in_plane = |v: Vec3| (v - normal_os.dot(v) * normal_os).normalize_or_zero();
        let (to_next, to_last) =
            (in_plane(position(k + 1) - position(k)), in_plane(position(k + 2) - position(k)));
        let angle_rad = to_next.dot(to_last).clamp(-1.0, 1.0).acos();
        sum += angle_rad * in_plane(faces[face].tangent_os);
    }
    sum.normalize_or_zero()
}

/// Gives corners without a group the tangent that another corner has at the vertex (those of
/// degenerate faces), else none.
fn fill_rest(surface: &Surface, corners: &[u32], faces: &[Face], out: &mut [Vec4]) {
    let is_degenerate = |corner: usize| faces[corner / 3].is_degenerate;
    let mut known = Vec::new();
    if faces.iter().any(|f| f.is_degenerate) {
        known.resize(surface.positions_os.len(), Vec4::ZERO);
        for (corner, &vertex) in corners.iter().enumerate().rev().filter(|(c, _)| !is_degenerate(*c)) {
            known[vertex as usize] = out[corner];
        }
    }
    for (corner, &vertex) in corners.iter().enumerate() {
        if is_degenerate(corner) {
            out[corner] = known[vertex as usize];
        }
        if out[corner].w == 0.0 {
            out[corner] = Vec4::W;
        }
    }
}

/// Vertices that corners of a triangle list become once each has its own tangent.
pub(crate) struct Split {
    /// For each new vertex, the old one that it copies. The first ones are the old vertices in order.
    pub(crate) source: Vec<u32>,
    /// Tangent of each new vertex.
    pub(crate) tangents_os: Vec<Vec4>,
    /// The triangle list over the new vertices.
    pub(crate) indices: Vec<u32>,
}

/// Tangents this close in each component are one: the packed form cannot tell them apart.
const SAME_TANGENT: f32 = 1.0 / 16384.0;

/// Copies of a vertex that are searched for an equal tangent: more than real meshes have; without a
/// limit, a vertex of very many lone faces would take the square of them.
const COPIES_SEARCHED: usize = 32;

/// Gives each vertex the tangent of its corners; a vertex whose corners differ is split.
pub(crate) fn split_by_tangent(vertex_count: usize, indices: &[u32], corners: &[Vec4]) -> Split {
    let mut tangents_os = vec![Vec4::ZERO; vertex_count];
    let mut source: Vec<u32> = (0..vertex_count as u32).collect();
    // chain of the copies of each vertex
    let mut next_copy = vec![NONE; vertex_count];
    let mut out = Vec::with_capacity(indices.len());
    for (&index, &tangent) in indices.iter().zip(corners) {
        let mut at = index;
        let mut found = None;
        for _ in 0..COPIES_SEARCHED {
            let slot = &mut tangents_os[at as usize];
            if slot.w == 0.0 {
                *slot = tangent;
            }
            if (*slot - tangent).abs().max_element() <= SAME_TANGENT {
                found = Some(at);
                break;
            }
            at = next_copy[at as usize];
            if at == NONE {
                break;
            }
        }
        let vertex = found.unwrap_or_else(|| {
            let new = source.len() as u32;
            source.push(index);
            tangents_os.push(tangent);
            let rest = std::mem::replace(&mut next_copy[index as usize], new);
            next_copy.push(rest);
            new
        });
        out.push(vertex);
    }
    for tangent in &mut tangents_os {
        if tangent.w == 0.0 {
            *tangent = Vec4::W;
        }
    }
    Split { source, tangents_os, indices: out }
}

/// Sine of the angle to its normal below which a tangent gives no frame. Twice what shaders take for parallel after the transform to world
/// space, so that what packing turns a little is not taken for parallel there.
const PARALLEL_SINE: f32 = 2e-3;

/// The direction of a vertex's tangent; `None` where it has no length or lies along the normal.
pub(crate) fn tangent_beside(normal_os: Vec3, tangent_os: Vec3) -> Option<Vec3> {
    let (normal_os, tangent_os) = (direction(normal_os), direction(tangent_os));
    (normal_os.cross(tangent_os).length() > PARALLEL_SINE).then_some(tangent_os)
}

/// A vector made unit, however short; zero where it has no direction.
fn direction(v: Vec3) -> Vec3 {
    let longest = v.abs().max_element();
    if longest > 0.0 && longest.is_finite() { (v / longest).normalize() } else { Vec3::ZERO }
}

/// The unit normal of a triangle, or +Z where it has no area.
pub(crate) fn face_normal(corners_os: [[f32; 3]; 3]) -> Vec3 {
    // f64: the products of small edges underflow otherwise
    let [a, b, c] = corners_os.map(|p| Vec3::from(p).as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Z, |n| n.as_vec3())
}

#[cfg(test)]
mod tests {
    use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
    use proptest::prelude::*;

    use super::*;

    /// The reference's port, on the same surface.
    struct Twin<'a> {
        surface: &'a Surface<'a>,
        tangents_os: Vec<Option<Vec4>>,
    }

    impl Twin<'_> {
        fn vertex(&self, face: usize, vert: usize) -> usize {
            self.surface.indices[3 * face + vert] as usize
        }
    }

    impl Geometry for Twin<'_> {
        fn num_faces(&self) -> usize {
            self.surface.indices.len() / 3
        }
        fn num_vertices_of_face(&self, _: usize) -> usize {
            3
        }
        fn position(&self, face: usize, vert: usize) -> [f32; 3] {
            self.surface.positions_os[self.vertex(face, vert)]
        }
        fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
            self.surface.normals_os[self.vertex(face, vert)]
        }
        fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
            let [u, v] = self.surface.uvs[self.vertex(face, vert)];
            [u, 1.0 - v]
        }
        fn set_tangent(&mut self, t: Option<TangentSpace>, face: usize, vert: usize) {
            self.tangents_os[3 * face + vert] = t.map(|t| Vec4::from(t.tangent_encoded()));
        }
    }

    fn twin(surface: &Surface) -> Vec<Option<Vec4>> {
        let mut twin = Twin { surface, tangents_os: vec![None; surface.indices.len()] };
        generate_tangents(&mut twin).unwrap();
        twin.tangents_os
    }

    /// A mesh that owns what a [`Surface`] borrows.
    #[derive(Default)]
    struct Grid {
        positions_os: Vec<[f32; 3]>,
        normals_os: Vec<[f32; 3]>,
        uvs: Vec<[f32; 2]>,
        indices: Vec<u32>,
    }

    impl Grid {
        /// A grid of heights, its texture coordinates mirrored about a column if asked for.
        fn new(heights: &[f32], mirror: bool, broken: bool) -> Self {
            const N: u32 = 6;
            let mut grid = Self::default();
            for i in 0..N * N {
                let (x, y, z) = ((i % N) as f32, (i / N) as f32, heights[i as usize]);
                grid.positions_os.push([x, y, z]);
                grid.normals_os.push(Vec3::new(0.3 * z, 0.2, 1.0).normalize().to_array());
                grid.uvs.push([if mirror { (x - 2.0).abs() } else { x + 0.3 * z }, y]);
            }
            for i in (0..N * (N - 1)).filter(|i| i % N != N - 1) {
                grid.indices.extend([i, i + 1, i + N, i + 1, i + N + 1, i + N]);
            }
            if broken {
                // a degenerate face, one without texture area, and an edge with three faces
                grid.indices.extend([0, 0, 1, 7, 8, 14]);
                grid.uvs[20] = grid.uvs[21];
            }
            grid
        }

        fn surface(&self) -> Surface<'_> {
            let Self { positions_os, normals_os, uvs, indices } = self;
            Surface { positions_os, normals_os, uvs, indices }
        }
    }

    proptest! {
        #[test]
        fn tangents_are_those_of_the_reference(
            heights in prop::collection::vec(-1.0f32..1.0, 36),
            mirror in any::<bool>(),
            broken in any::<bool>(),
        ) {
            let grid = Grid::new(&heights, mirror, broken);
            let surface = grid.surface();
            for (corner, (ours, theirs)) in corner_tangents(&surface).iter().zip(twin(&surface)).enumerate() {
                if let Some(theirs) = theirs {
                    prop_assert!((*ours - theirs).length() < 2e-3, "corner {}: {} and {}", corner, ours, theirs);
                }
            }
        }
    }

    /// A flat fan of `face_count` triangles about one vertex, texture coordinates as positions.
    fn fan(face_count: u32) -> (Vec<[f32; 3]>, Vec<u32>) {
        let rim = (0..=face_count).map(|i| {
            let angle_rad = 6.0 * i as f32 / face_count as f32;
            [angle_rad.cos(), angle_rad.sin(), 0.0]
        });
        let positions_os = std::iter::once([0.0; 3]).chain(rim).collect();
        (positions_os, (1..=face_count).flat_map(|i| [0, i, i + 1]).collect())
    }

    #[test]
    fn a_vertex_or_edge_with_very_many_faces_takes_no_longer() {
        let (positions_os, fan) = fan(200_000);
        let all_on_an_edge = (2..200_000).flat_map(|i| [0, 1, i]).collect();
        let all_degenerate = (2..200_000).flat_map(|i| [0, 0, i]).collect();
        let lone_faces = (1..100_000).flat_map(|i| [0, 2 * i, 2 * i + 1]).collect();
        for indices in [fan, all_on_an_edge, all_degenerate, lone_faces] {
            let normals_os = vec![[0.0, 0.0, 1.0]; positions_os.len()];
            let uvs: Vec<_> = positions_os.iter().map(|p| [p[0], 1.0 - p[1]]).collect();
            let surface = Surface {
                positions_os: &positions_os,
                normals_os: &normals_os,
                uvs: &uvs,
                indices: &indices,
            };
            let corners = corner_tangents(&surface);
            assert!(corners.iter().all(|t| t.is_finite() && t.w.abs() == 1.0));
            let split = split_by_tangent(positions_os.len(), &indices, &corners);
            assert_eq!(split.indices.len(), indices.len());
        }
    }

    #[test]
    fn a_mirrored_seam_splits_its_vertices() {
        // two triangles that share an edge, u running both ways from it
        let positions_os = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
        let uvs = [[0.0, 1.0], [0.0, 0.0], [1.0, 1.0], [1.0, 1.0]];
        let indices = [0, 2, 1, 0, 1, 3];
        let normals_os = [[0.0, 0.0, 1.0]; 4];
        let surface =
            Surface { positions_os: &positions_os, normals_os: &normals_os, uvs: &uvs, indices: &indices };
        let split = split_by_tangent(4, &indices, &corner_tangents(&surface));
        assert_eq!(split.source, [0, 1, 2, 3, 0, 1]);
        let at = |corner: usize| split.tangents_os[split.indices[corner] as usize];
        assert_eq!(at(0), Vec4::new(1.0, 0.0, 0.0, 1.0));
        assert_eq!(at(3), Vec4::new(-1.0, 0.0, 0.0, -1.0));
    }
}
