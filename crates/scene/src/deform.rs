//! Skins and morph targets: what changes the shape of a mesh (glTF 2.0, 3.7.2.2 and 3.7.3).
//!
//! A mesh that is drawn has its vertices in [`Scene::positions_os`] and [`Scene::attributes`], as every other. Where a
//! [`Deformation`] writes it, those hold the pose that the scene was loaded or last posed in; the [`Shape`] keeps the vertices as
//! the file has them, from which any pose is made:
//!
//! 1. positions, normals and tangents plus the targets' differences times their weights;
//! 2. the weighted sum of the joints' matrices ([`Pose::object_from_bind`](crate::Pose::object_from_bind)) moves the position; its inverse
//!    transpose turns the normal, the matrix itself the tangent, and where it mirrors the bitangent changes its sign.
//!
//! The result is in the object space of the mesh, so that its instances are drawn by their matrices as others are. Texture
//! coordinates, colours and triangles stay. `afterlight_oracle::deform` is the twin in f64 that others are compared with.

use std::sync::Arc;

use glam::{Affine3A, DMat3, DVec3, Vec3};

use crate::{Aabb, Scene, VertexAttributes};

/// Joints that a vertex may have. Of more the ones with the greatest weights are kept, with a warning.
pub const JOINTS_PER_VERTEX_MAX: usize = 8;

/// Joints that one [`Influences`] has.
pub const JOINTS_PER_SET: usize = 4;

/// A skin: joints that move vertices, and where those stood when they were bound to them.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Name for messages.
    pub name: String,
    /// Index into [`Scene::nodes`] of each joint's node; at least one.
    pub joints: Vec<u32>,
    /// glTF's inverse bind matrices: the joint's space from the space in which the vertices are given. As many as joints.
    pub joint_from_bind: Vec<Affine3A>,
}

/// Four joints of a vertex with their weights (24 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Influences {
    /// Indices into [`Skin::joints`]; 0 where the weight is 0.
    pub joints: [u16; JOINTS_PER_SET],
    /// Weights, 0 or more, falling; those of all sets of a vertex add up to 1.
    pub weights: [f32; JOINTS_PER_SET],
}

/// Differences of one morph target to the shape, a vertex each. A list is empty where the target leaves that attribute alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphTarget {
    /// Differences of positions, metres.
    pub positions_os: Vec<[f32; 3]>,
    /// Differences of normals.
    pub normals_os: Vec<[f32; 3]>,
    /// Differences of tangents.
    pub tangents_os: Vec<[f32; 3]>,
    /// Least and greatest difference of positions along each axis, metres; zero or empty where there is none.
    pub reach_os: Aabb,
}

/// The box of the vertices that a joint moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointBounds {
    /// Index into [`Skin::joints`].
    pub joint: u32,
    /// Box of the vertices with a weight of this joint, as the file has them, before morphing.
    pub bounds_os: Aabb,
}

/// The vertices of a mesh before any deformation: in the space that glTF gives them in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Positions, as many as the meshes have that are made from it.
    pub positions_os: Vec<[f32; 3]>,
    /// Normal and tangent of each vertex, packed as [`VertexAttributes::normal_os_oct`] and [`VertexAttributes::tangent_os_oct`].
    pub frames_os: Vec<[u32; 2]>,
    /// Whether the file gives no normals: each triangle has three vertices of its own, one after another, and their normal is
    /// that of the triangle, also when it is deformed.
    pub is_flat: bool,
    /// Sets of influences a vertex: 0 without joints, 1 for up to four joints, 2 for up to eight.
    pub set_count: u32,
    /// Influences, [`Self::set_count`] a vertex, one vertex after another.
    pub influences: Vec<Influences>,
    /// Morph targets. Shapes of one mesh of the file share them.
    pub targets: Arc<[MorphTarget]>,
    /// What each joint moves, by rising joint.
    pub joint_bounds: Vec<JointBounds>,
    /// Box of the positions.
    pub bounds_os: Aabb,
}

/// What gives the vertices of a drawn mesh their places.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformation {
    /// Index into [`Scene::meshes`] of the mesh that is written. No two deformations write one mesh.
    pub mesh: u32,
    /// Index into [`Scene::shapes`]: what it is made from.
    pub shape: u32,
    /// Index into [`Scene::nodes`] of the node of the mesh's instances, whose space the vertices are written in.
    pub object_node: u32,
    /// Index into [`Scene::nodes`] of the node that has the weights of the morph targets.
    pub weights_node: u32,
    /// Index into [`Scene::skins`]; `None` where it is morphed alone.
    pub skin: Option<u32>,
    /// Its first matrix in [`Pose::object_from_bind`](crate::Pose::object_from_bind), one a joint of the skin. Meshes of one node have the same.
    pub first_joint: u32,
    /// Its first weight in [`Pose::weights`](crate::Pose::weights), one a target of the shape. Meshes of one node have the same.
    pub first_weight: u32,
}

/// What gives the deformed meshes of a scene their shapes at a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShapePose {
    /// As [`Pose::object_from_bind`](crate::Pose::object_from_bind).
    pub object_from_bind: Vec<Affine3A>,
    /// As [`Pose::weights`](crate::Pose::weights).
    pub weights: Vec<f32>,
}

/// A vertex of a shape in a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PosedVertex {
    pub(crate) position_os: DVec3,
    pub(crate) normal_os: DVec3,
    pub(crate) tangent_os: DVec3,
    pub(crate) handedness: f32,
}

impl MorphTarget {
    /// A target with its reach.
    pub fn new(positions_os: Vec<[f32; 3]>, normals_os: Vec<[f32; 3]>, tangents_os: Vec<[f32; 3]>) -> Self {
        let mut reach_os =
            if positions_os.is_empty() { Aabb { min: Vec3::ZERO, max: Vec3::ZERO } } else { Aabb::EMPTY };
        positions_os.iter().for_each(|&d| reach_os.extend(d.into()));
        Self { positions_os, normals_os, tangents_os, reach_os }
    }
}

impl Shape {
    /// Finds the boxes of the shape and of what its joints move: for whoever puts a shape together or changes one.
    pub fn find_bounds(&mut self) {
        self.bounds_os = Aabb::EMPTY;
        self.positions_os.iter().for_each(|&p| self.bounds_os.extend(p.into()));
        let mut boxes: Vec<Aabb> = Vec::new();
        let sets = self.set_count.max(1) as usize;
        for (position, sets) in self.positions_os.iter().zip(self.influences.chunks(sets)) {
            for (joint, weight) in sets.iter().flat_map(Influences::iter) {
                if weight > 0.0 {
                    if boxes.len() <= joint {
                        boxes.resize(joint + 1, Aabb::EMPTY);
                    }
                    boxes[joint].extend((*position).into());
                }
            }
        }
        let used = boxes.into_iter().zip(0..).filter(|(bounds, _)| !bounds.is_empty());
        self.joint_bounds = used.map(|(bounds_os, joint)| JointBounds { joint, bounds_os }).collect();
    }

    /// The influences of a vertex, one set after another.
    pub fn influences_of(&self, vertex: usize) -> &[Influences] {
        let sets = self.set_count as usize;
        self.influences.get(vertex * sets..(vertex + 1) * sets).unwrap_or(&[])
    }

    /// Moves the shape, so that its vertices are relative to another place.
    pub(crate) fn shift(&mut self, shift: DVec3) {
        for p in &mut self.positions_os {
            *p = (DVec3::from_array(p.map(f64::from)) - shift).as_vec3().to_array();
        }
        self.find_bounds();
    }

    /// The vertices in a pose. `object_from_bind` is empty where no skin moves it.
    pub(crate) fn posed(&self, weights: &[f32], object_from_bind: &[Affine3A]) -> Vec<PosedVertex> {
        let mut out: Vec<_> = (0..self.positions_os.len())
            .map(|vertex| self.skinned(vertex, self.morphed(vertex, weights), object_from_bind))
            .collect();
        if self.is_flat {
            for corners in out.chunks_exact_mut(3) {
                let [a, b, c] = [0, 1, 2].map(|k| corners[k].position_os);
                let normal_os = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z);
                corners.iter_mut().for_each(|corner| corner.normal_os = normal_os);
            }
        }
        out
    }

    fn morphed(&self, vertex: usize, weights: &[f32]) -> PosedVertex {
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        let [normal_os_oct, tangent_os_oct] = self.frames_os.get(vertex).copied().unwrap_or_default();
        let packed = VertexAttributes { normal_os_oct, tangent_os_oct, ..Default::default() };
        let (tangent_os, handedness) = packed.tangent_os();
        let mut out = PosedVertex {
            position_os: wide(self.positions_os[vertex]),
            normal_os: packed.normal_os().as_dvec3(),
            tangent_os: tangent_os.as_dvec3(),
            handedness,
        };
        for (target, &weight) in self.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            let add = |sum: &mut DVec3, list: &[[f32; 3]]| {
                if let Some(&difference) = list.get(vertex) {
                    *sum += f64::from(weight) * wide(difference);
                }
            };
            add(&mut out.position_os, &target.positions_os);
            add(&mut out.normal_os, &target.normals_os);
            add(&mut out.tangent_os, &target.tangents_os);
        }
        out
    }

    fn skinned(&self, vertex: usize, v: PosedVertex, object_from_bind: &[Affine3A]) -> PosedVertex {
        if object_from_bind.is_empty() {
            return v;
        }
        let (mut matrix, mut translation) = (DMat3::ZERO, DVec3::ZERO);
        for (joint, weight) in self.influences_of(vertex).iter().flat_map(Influences::iter) {
            let Some(joint) = object_from_bind.get(joint) else { continue };
            matrix += joint.matrix3.as_dmat3() * weight;
            translation += joint.translation.as_dvec3() * weight;
        }
        // The cofactors are the inverse transpose times the determinant; they stand also where there is no inverse.
        let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let is_mirrored = x.dot(y.cross(z)) < 0.0;
        let sign = if is_mirrored { -1.0 } else { 1.0 };
        PosedVertex {
            position_os: matrix * v.position_os + translation,
            normal_os: sign * (cofactors * v.normal_os),
            tangent_os: matrix * v.tangent_os,
            handedness: if is_mirrored { -v.handedness } else { v.handedness },
        }
    }

    /// A box that holds the shape's vertices in a pose, in the object space of the mesh; `object_from_bind` is empty where no skin
    /// moves it. A vertex is a mean of what its joints make of it, so it lies within the boxes that those make of what they
    /// move; morph targets widen each box by their reach times their weight.
    pub fn bounds_in(&self, weights: &[f32], object_from_bind: &[Affine3A]) -> Aabb {
        let mut reach_os = Aabb { min: Vec3::ZERO, max: Vec3::ZERO };
        for (target, &weight) in self.targets.iter().zip(weights).filter(|(t, _)| !t.reach_os.is_empty()) {
            let ends = [target.reach_os.min * weight, target.reach_os.max * weight];
            reach_os.min += ends[0].min(ends[1]);
            reach_os.max += ends[0].max(ends[1]);
        }
        let widened = |bounds: &Aabb| Aabb { min: bounds.min + reach_os.min, max: bounds.max + reach_os.max };
        if self.positions_os.is_empty() {
            return Aabb::EMPTY;
        }
        let mut sum = Aabb::EMPTY;
        if object_from_bind.is_empty() {
            sum = widened(&self.bounds_os);
        }
        for moved in &self.joint_bounds {
            if let Some(matrix) = object_from_bind.get(moved.joint as usize) {
                sum = sum.union(&widened(&moved.bounds_os).transformed(matrix));
            }
        }
        // Terms of sums that cancel round by their own size, which that of the box need not tell.
        let matrices = object_from_bind.iter().map(|m| {
            let scale = m.matrix3.x_axis.abs() + m.matrix3.y_axis.abs() + m.matrix3.z_axis.abs();
            (scale.max_element(), m.translation.abs().max_element())
        });
        let (scale, offset) = matrices.fold((1.0f32, 0.0f32), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        let greatest = |b: &Aabb| b.min.abs().max(b.max.abs()).max_element();
        let margin =
            Vec3::splat(ROUNDING * (scale * (greatest(&self.bounds_os) + greatest(&reach_os)) + offset));
        Aabb { min: sum.min - margin, max: sum.max + margin }
    }
}

/// What rounding to 32 bits may move a vertex by, as a fraction of the terms that its place is the sum of: two units in the last place
/// for each of eight joints and their matrices.
const ROUNDING: f32 = 16.0 * f32::EPSILON;

impl Influences {
    /// Joints with their weights in 64 bits.
    fn iter(&self) -> impl Iterator<Item = (usize, f64)> + use<'_> {
        self.joints.iter().zip(&self.weights).map(|(&joint, &weight)| (usize::from(joint), f64::from(weight)))
    }
}

impl Deformation {
    /// Its matrices in [`Pose::object_from_bind`](crate::Pose::object_from_bind): none without a skin.
    pub fn joints(&self, scene: &Scene) -> std::ops::Range<usize> {
        let skin = self.skin.and_then(|skin| scene.skins.get(skin as usize));
        let first = self.first_joint as usize;
        first..first + skin.map_or(0, |skin| skin.joints.len())
    }

    /// Its weights in [`Pose::weights`](crate::Pose::weights): none without morph targets.
    pub fn weights(&self, scene: &Scene) -> std::ops::Range<usize> {
        let shape = scene.shapes.get(self.shape as usize);
        let first = self.first_weight as usize;
        first..first + shape.map_or(0, |shape| shape.targets.len())
    }
}

impl Scene {
    /// What deforms the mesh of an instance, an index into [`Scene::deformations`]; `None` for one whose vertices stay. Deformations stand
    /// in a list of their own, by rising mesh, so that scenes without any pay nothing for them.
    pub fn deformation_of(&self, instance: usize) -> Option<usize> {
        let mesh = self.instances.get(instance)?.mesh;
        self.deformations.binary_search_by_key(&mesh, |deformation| deformation.mesh).ok()
    }

    /// Each instance of a deformed mesh, by rising number, with a box in the object space of the mesh that holds whatever a pose makes of it
    /// ([`Shape::bounds_in`]).
    pub fn deformed_bounds_os(&self, pose: &ShapePose) -> Vec<(u32, Aabb)> {
        if self.deformations.is_empty() {
            return Vec::new();
        }
        let bounds_os = |d: &Deformation| {
            let joints = pose.object_from_bind.get(d.joints(self)).unwrap_or(&[]);
            let weights = pose.weights.get(d.weights(self)).unwrap_or(&[]);
            self.shapes.get(d.shape as usize).map_or(Aabb::EMPTY, |shape| shape.bounds_in(weights, joints))
        };
        let of_deformation: Vec<Aabb> = self.deformations.iter().map(bounds_os).collect();
        let deformed = (0..self.instances.len())
            .filter_map(|instance| Some((instance as u32, of_deformation[self.deformation_of(instance)?])));
        deformed.collect()
    }

    /// Writes the drawn vertices of deformed meshes, and the meshes' boxes, for these joints and weights. Returns the first mesh
    /// and vertex whose place overflows.
    pub(crate) fn write_deformed(
        &mut self,
        object_from_bind: &[Affine3A],
        weights: &[f32],
    ) -> Option<(u32, usize)> {
        let mut overflow = None;
        self.shaped = ShapePose { object_from_bind: object_from_bind.to_vec(), weights: weights.to_vec() };
        for k in 0..self.deformations.len() {
            let d = self.deformations[k].clone();
            let joints = object_from_bind.get(d.joints(self)).unwrap_or(&[]);
            let weights = weights.get(d.weights(self)).unwrap_or(&[]);
            let (Some(shape), Some(mesh)) =
                (self.shapes.get(d.shape as usize), self.meshes.get_mut(d.mesh as usize))
            else {
                continue;
            };
            let range = mesh.first_vertex as usize..mesh.first_vertex as usize + mesh.vertex_count as usize;
            let (Some(positions_os), Some(attributes)) =
                (self.positions_os.get_mut(range.clone()), self.attributes.get_mut(range))
            else {
                continue;
            };
            mesh.bounds_os = Aabb::EMPTY;
            let drawn = positions_os.iter_mut().zip(attributes);
            for (vertex, (v, (position, attributes))) in
                shape.posed(weights, joints).into_iter().zip(drawn).enumerate()
            {
                let position_os = v.position_os.as_vec3();
                if !position_os.is_finite() && overflow.is_none() {
                    overflow = Some((d.mesh, vertex));
                }
                mesh.bounds_os.extend(position_os);
                *position = position_os.to_array();
                let (normal_os, tangent_os) = (v.normal_os.as_vec3(), v.tangent_os.as_vec3());
                [attributes.normal_os_oct, attributes.tangent_os_oct] =
                    VertexAttributes::pack_frame(normal_os, tangent_os, v.handedness);
            }
        }
        overflow
    }
}
