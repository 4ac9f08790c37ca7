//! What skins and morph targets deform, on the device: shapes as the file has them, from which a pass writes the drawn vertices of each pose.

use std::ops::Range;

use afterlight_graph::gpu;
use afterlight_scene::{Aabb, Scene, Shape, ShapePose};
use afterlight_shader::structs::{DeformGroup, Deformed};
use glam::Affine3A;

use crate::{scene::placed::object_rows, upload::upload_slice};

/// Vertices of a group of the pass: `GROUP_VERTICES` in `shared/deform/deform.comp.glsl`, whole triangles.
pub const GROUP_VERTICES: u32 = 96;

/// What a target leaves alone has no differences.
const NO_DIFFERENCES: u32 = u32::MAX;

/// Shapes of a scene on the device.
pub struct DeformedGpu {
    /// From the first deformed vertex of the scene to the last.
    pub vertices: Range<u32>,
    /// A [`DeformGroup`] each group of the pass.
    pub groups: gpu::Buffer,
    /// How many groups.
    pub group_count: u32,
    /// A [`Deformed`] each deformation of the scene.
    pub deformations: gpu::Buffer,
    /// Positions as the shapes have them, three floats a vertex, and their frames, two words a vertex.
    pub shapes: gpu::Buffer,
    /// Influences of joints: four joints of 16 bits and four weights, six words.
    pub influences: gpu::Buffer,
    /// First differences of positions, normals and tangents of each target, counted in vertices; three words a target.
    pub targets: gpu::Buffer,
    /// Differences of targets, three floats a vertex.
    pub differences: gpu::Buffer,
    /// Matrices of joints in a pose.
    pub joint_count: u32,
    /// Weights of targets in a pose.
    pub weight_count: u32,
    /// A box of each deformed instance in the pose that was uploaded ([`Scene::deformed_bounds_os`]).
    pub rest_bounds_os: Vec<(u32, Aabb)>,
}

/// Joints and weights of a pose as the device has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosedShapes {
    /// Rows of each joint's matrix, object space from the space of the shape.
    pub joints: Vec<[[f32; 4]; 3]>,
    /// Weights of morph targets.
    pub weights: Vec<f32>,
}

impl PosedShapes {
    /// Of a pose.
    pub fn new(pose: &ShapePose) -> Self {
        let mut shapes = Self::default();
        shapes.set(pose);
        shapes
    }

    /// Takes another pose, in the memory of this one.
    pub fn set(&mut self, pose: &ShapePose) {
        self.joints.clear();
        self.joints.extend(pose.object_from_bind.iter().map(|m: &Affine3A| object_rows(m)));
        self.weights.clear();
        self.weights.extend_from_slice(&pose.weights);
    }
}

/// Lists that grow shape by shape.
#[derive(Default)]
struct Lists {
    groups: Vec<DeformGroup>,
    deformations: Vec<Deformed>,
    shapes: Vec<[u32; 5]>,
    influences: Vec<afterlight_scene::Influences>,
    targets: Vec<[u32; 3]>,
    differences: Vec<[f32; 3]>,
    /// First vertex, influence and target of each shape that is listed.
    known: Vec<Option<[u32; 3]>>,
}

impl DeformedGpu {
    /// Uploads the shapes of a scene, whose deformed instances have these boxes; `None` where nothing deforms.
    ///
    /// # Errors
    /// The device.
    pub(super) fn upload(
        device: &gpu::Device,
        uploader: &mut gpu::Uploader,
        scene: &Scene,
        rest_bounds_os: Vec<(u32, Aabb)>,
    ) -> Result<Option<Self>, gpu::GpuError> {
        if scene.deformations.is_empty() {
            return Ok(None);
        }
        let lists = Lists::of(scene);
        let mut upload = |name: &str, words: &[u32]| upload_slice(device, uploader, name, words);
        Ok(Some(Self {
            rest_bounds_os,
            vertices: lists.vertices(),
            group_count: lists.groups.len() as u32,
            joint_count: scene.shaped.object_from_bind.len() as u32,
            weight_count: scene.shaped.weights.len() as u32,
            groups: upload("scene deform groups", bytemuck::cast_slice(&lists.groups))?,
            deformations: upload("scene deformations", bytemuck::cast_slice(&lists.deformations))?,
            shapes: upload("scene shapes", bytemuck::cast_slice(&lists.shapes))?,
            influences: upload("scene influences", bytemuck::cast_slice(&lists.influences))?,
            targets: upload("scene morph targets", bytemuck::cast_slice(&lists.targets))?,
            differences: upload("scene differences", bytemuck::cast_slice(&lists.differences))?,
        }))
    }

    /// Bytes on the device.
    pub(super) fn bytes(&self) -> u64 {
        let buffers = [
            &self.groups,
            &self.deformations,
            &self.shapes,
            &self.influences,
            &self.targets,
            &self.differences,
        ];
        buffers.iter().map(|buffer| buffer.allocated_bytes()).sum()
    }
}

impl Lists {
    fn of(scene: &Scene) -> Self {
        let mut lists = Self { known: vec![None; scene.shapes.len()], ..Self::default() };
        for (number, d) in (0..).zip(&scene.deformations) {
            let (mesh, shape) = (&scene.meshes[d.mesh as usize], &scene.shapes[d.shape as usize]);
            let [first_shape, first_influence, first_target] = lists.shape(d.shape as usize, shape);
            let joints = d.joints(scene);
            lists.deformations.push(Deformed {
                first_vertex: mesh.first_vertex,
                vertex_count: mesh.vertex_count,
                first_shape,
                is_flat: shape.is_flat.into(),
                set_count: if joints.is_empty() { 0 } else { shape.set_count },
                first_influence,
                first_joint: d.first_joint,
                target_count: shape.targets.len() as u32,
                first_target,
                first_weight: d.first_weight,
            });
            let firsts = (0..mesh.vertex_count).step_by(GROUP_VERTICES as usize);
            lists.groups.extend(firsts.map(|first| DeformGroup { deformation: number, first }));
        }
        lists
    }

    /// From the first vertex to the last.
    fn vertices(&self) -> Range<u32> {
        let ranges = self.deformations.iter().map(|d| (d.first_vertex, d.first_vertex + d.vertex_count));
        let around = |all: (u32, u32), one: (u32, u32)| (all.0.min(one.0), all.1.max(one.1));
        ranges.reduce(around).map_or(0..0, |(first, end)| first..end)
    }

    /// Lists a shape once. Where its vertices, influences and targets begin.
    fn shape(&mut self, number: usize, shape: &Shape) -> [u32; 3] {
        if let Some(known) = self.known[number] {
            return known;
        }
        let firsts = [self.shapes.len(), self.influences.len(), self.targets.len()].map(|n| n as u32);
        self.known[number] = Some(firsts);
        self.shapes.extend(shape.positions_os.iter().zip(&shape.frames_os).map(|(p, frame)| {
            let [x, y, z] = p.map(f32::to_bits);
            [x, y, z, frame[0], frame[1]]
        }));
        self.influences.extend_from_slice(&shape.influences);
        for target in shape.targets.iter() {
            let lists = [&target.positions_os, &target.normals_os, &target.tangents_os];
            let firsts = lists.map(|list| match list.is_empty() {
                true => NO_DIFFERENCES,
                false => {
                    let first = self.differences.len() as u32;
                    self.differences.extend_from_slice(list);
                    first
                }
            });
            self.targets.push(firsts);
        }
        firsts
    }
}
