//! Normals and tangents that a file leaves out.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec3, Vec4};

/// One mesh whose tangents are wanted: a triangle list.
pub(crate) struct Surface<'a> {
    /// Positions, object space.
    pub(crate) positions_os: &'a [[f32; 3]],
    /// Unit normals, object space.
    pub(crate) normals_os: &'a [[f32; 3]],
    /// Texture coordinates that the normal map is seen through.
    pub(crate) uvs: &'a [[f32; 2]],
    /// Three a triangle, below the number of vertices.
    pub(crate) indices: &'a [u32],
}

struct Mikk<'a> {
    surface: &'a Surface<'a>,
    tangents_os: Vec<Vec4>,
}

impl Mikk<'_> {
    fn vertex(&self, face: usize, vert: usize) -> usize {
        self.surface.indices[3 * face + vert] as usize
    }
}

impl Geometry for Mikk<'_> {
    fn num_faces(&self) -> usize {
        self.surface.indices.len() / 3
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.surface.positions_os[self.vertex(face, vert)]
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.surface.normals_os[self.vertex(face, vert)]
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        // MikkTSpace has v upwards, glTF downwards (glTF 2.0, 3.7.2.1: its default tangents)
        let [u, v] = self.surface.uvs[self.vertex(face, vert)];
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, tangent_space: Option<TangentSpace>, face: usize, vert: usize) {
        self.tangents_os[3 * face + vert] = match tangent_space {
            Some(t) => Vec4::from(t.tangent_encoded()),
            None => any_tangent(Vec3::from(self.normal(face, vert))).extend(1.0),
        };
    }
}

/// MikkTSpace tangents, one a corner: three a triangle. w is the bitangent's sign.
pub(crate) fn corner_tangents(surface: &Surface) -> Vec<Vec4> {
    let mut mikk = Mikk { surface, tangents_os: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); surface.indices.len()] };
    // the error type has no value: the call cannot fail
    let _ = generate_tangents(&mut mikk);
    mikk.tangents_os
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

/// Gives each vertex the tangent of its corners; a vertex whose corners differ is split.
pub(crate) fn split_by_tangent(vertex_count: usize, indices: &[u32], corners: &[Vec4]) -> Split {
    const NONE: u32 = u32::MAX;
    let mut tangents_os = vec![Vec4::ZERO; vertex_count];
    let mut source: Vec<u32> = (0..vertex_count as u32).collect();
    // chain of the copies of each vertex
    let mut next_copy = vec![NONE; vertex_count];
    let mut out = Vec::with_capacity(indices.len());
    for (&index, &tangent) in indices.iter().zip(corners) {
        let mut at = index;
        let vertex = loop {
            let slot = &mut tangents_os[at as usize];
            if slot.w == 0.0 {
                *slot = tangent;
                break at;
            }
            if (*slot - tangent).abs().max_element() <= SAME_TANGENT {
                break at;
            }
            let next = next_copy[at as usize];
            if next != NONE {
                at = next;
                continue;
            }
            let new = source.len() as u32;
            source.push(index);
            tangents_os.push(tangent);
            next_copy.push(NONE);
            next_copy[at as usize] = new;
            break new;
        };
        out.push(vertex);
    }
    for tangent in &mut tangents_os {
        if tangent.w == 0.0 {
            *tangent = Vec4::new(1.0, 0.0, 0.0, 1.0);
        }
    }
    Split { source, tangents_os, indices: out }
}

/// A unit vector at right angles to a normal.
pub(crate) fn any_tangent(normal_os: Vec3) -> Vec3 {
    normal_os.try_normalize().map_or(Vec3::X, Vec3::any_orthonormal_vector)
}

/// The unit normal of a triangle, or +Z where it has no area.
pub(crate) fn face_normal(corners_os: [[f32; 3]; 3]) -> Vec3 {
    // f64: the products of small edges underflow otherwise
    let [a, b, c] = corners_os.map(|p| Vec3::from(p).as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Z, |n| n.as_vec3())
}
