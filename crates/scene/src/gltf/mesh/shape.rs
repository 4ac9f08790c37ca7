//! Primitives that skins and morph targets deform, to shapes.

use std::collections::HashMap;

use glam::Vec4;

use super::{
    Accessors, Checked, Job, Semantic, Unpacked, Vertices, check, face_sums, tangent, triangle_list,
};
use crate::{
    Deformation, Influences, JOINTS_PER_SET, JOINTS_PER_VERTEX_MAX, MorphTarget, Scene, SceneError, Shape,
};

/// A shape with what the meshes that are made from it have.
pub(super) struct Built {
    shape: Shape,
    pub(super) vertices: Vertices,
    pub(super) indices: Vec<u32>,
    pub(super) leftover: bool,
    /// The greatest joint in use: its number, the vertex, and the accessor that names it.
    last_joint: Option<(u32, usize, usize)>,
    warnings: Vec<String>,
}

/// Differences of a morph target before packing; lists are empty where there is none.
#[derive(Default)]
struct Target {
    positions_os: Vec<[f32; 3]>,
    normals_os: Vec<[f32; 3]>,
    tangents_os: Vec<[f32; 3]>,
}

/// The elements that `source` names, in its order; none of none.
fn pick<T: Copy>(values: &[T], source: &[u32]) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { source.iter().map(|&i| values[i as usize]).collect() }
}

fn sum(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<[f32; 3]> {
    if b.is_empty() {
        return a.to_vec();
    }
    a.iter().zip(b).map(|(a, b)| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]).collect()
}

impl Target {
    fn gather(&self, source: &[u32]) -> Self {
        Self {
            positions_os: pick(&self.positions_os, source),
            normals_os: pick(&self.normals_os, source),
            tangents_os: pick(&self.tangents_os, source),
        }
    }
}

/// The normals of triangles whose vertices stand one after another.
fn flat_normals(positions_os: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let triangles = positions_os.chunks_exact(3);
    triangles.flat_map(|t| [tangent::face_normal([t[0], t[1], t[2]]).to_array(); 3]).collect()
}

/// Converts the primitive of a job.
pub(super) fn build(accessors: &Accessors, job: &Job) -> Result<Built, SceneError> {
    let vertex_count = accessors.layout(job.streams.positions)?.count;
    let (mut indices, leftover) = triangle_list(accessors, job.primitive, vertex_count)?;
    let mut v = Unpacked::read(accessors, &job.streams)?;
    let mut targets = read_targets(accessors, job)?;
    let mut joints = match job.variant.skin {
        Some(_) => read_joints(accessors, job, vertex_count)?,
        None => Joints::default(),
    };
    let is_flat = v.normals_os.is_empty();
    if is_flat {
        v = v.gather(&indices);
        joints.gather(&indices);
        for target in &mut targets {
            // Without normals of the mesh, normals and tangents of its targets mean nothing (glTF 2.0, 3.7.2.2).
            *target = Target { positions_os: pick(&target.positions_os, &indices), ..Target::default() };
        }
        v.normals_os = flat_normals(&v.positions_os);
        indices = (0..indices.len() as u32).collect();
    } else if v.normals_os.contains(&[0.0; 3]) {
        let sums = face_sums(&v.positions_os, &indices);
        for (normal, sum) in v.normals_os.iter_mut().zip(sums).filter(|(normal, _)| **normal == [0.0; 3]) {
            *normal = if sum.is_finite() { sum.to_array() } else { *normal };
        }
        joints.warnings.push(format!("{}: normals of length 0 are made from the faces", job.at));
    }
    if let Some(set) = job.tangents_from {
        make_tangents(set, is_flat, &mut v, &mut targets, &mut joints, &mut indices);
    }
    let mut vertices = v.pack();
    // They have been made from the faces, or stay as they are.
    vertices.zero_normals = Vec::new();
    let targets = targets.into_iter().map(|t| MorphTarget::new(t.positions_os, t.normals_os, t.tangents_os));
    let mut shape = Shape {
        positions_os: vertices.positions_os.clone(),
        frames_os: vertices.attributes.iter().map(|a| [a.normal_os_oct, a.tangent_os_oct]).collect(),
        is_flat,
        set_count: joints.set_count as u32,
        influences: joints.influences,
        targets: targets.collect(),
        ..Shape::default()
    };
    shape.find_bounds();
    Ok(Built { shape, vertices, indices, leftover, last_joint: joints.last, warnings: joints.warnings })
}

/// Makes tangents of the mesh and of each target with its whole weight, whose differences become the target's (glTF 2.0, 3.7.2.2).
/// Vertices whose corners differ are split.
fn make_tangents(
    uv_set: usize,
    is_flat: bool,
    v: &mut Unpacked,
    targets: &mut [Target],
    joints: &mut Joints,
    indices: &mut Vec<u32>,
) {
    let corner_tangents = |positions_os: &[[f32; 3]], normals_os: &[[f32; 3]]| {
        let uvs = &v.uv[uv_set];
        tangent::corner_tangents(&tangent::Surface { positions_os, normals_os, uvs, indices })
    };
    let corners = corner_tangents(&v.positions_os, &v.normals_os);
    let split = tangent::split_by_tangent(v.positions_os.len(), indices, &corners);
    for target in targets.iter_mut() {
        if target.positions_os.is_empty() && target.normals_os.is_empty() {
            continue;
        }
        let positions_os = sum(&v.positions_os, &target.positions_os);
        let normals_os =
            if is_flat { flat_normals(&positions_os) } else { sum(&v.normals_os, &target.normals_os) };
        let moved = corner_tangents(&positions_os, &normals_os);
        *target = target.gather(&split.source);
        target.tangents_os = vec![[0.0; 3]; split.source.len()];
        for ((&vertex, base), moved) in split.indices.iter().zip(&corners).zip(moved) {
            target.tangents_os[vertex as usize] = (moved - *base).truncate().to_array();
        }
    }
    *v = v.gather(&split.source);
    joints.gather(&split.source);
    v.tangents_os = split.tangents_os.iter().map(Vec4::to_array).collect();
    *indices = split.indices;
}

fn read_targets(accessors: &Accessors, job: &Job) -> Result<Vec<Target>, SceneError> {
    let read = |accessor: Option<usize>, is_used: bool| match accessor.filter(|_| is_used) {
        Some(accessor) => accessors.floats::<3>(accessor, 3, 0.0),
        None => Ok(Vec::new()),
    };
    let targets = job.primitive.targets.iter().flatten();
    let read_one = |target: &gltf::json::mesh::MorphTarget| {
        Ok(Target {
            positions_os: read(target.positions.map(|a| a.value()), true)?,
            normals_os: read(target.normals.map(|a| a.value()), job.streams.normals.is_some())?,
            tangents_os: read(target.tangents.map(|a| a.value()), job.streams.tangents.is_some())?,
        })
    };
    targets.map(read_one).collect()
}

/// The joints of vertices.
#[derive(Default)]
struct Joints {
    set_count: usize,
    influences: Vec<Influences>,
    last: Option<(u32, usize, usize)>,
    warnings: Vec<String>,
}

impl Joints {
    fn gather(&mut self, source: &[u32]) {
        let sets = self.set_count;
        let of = |&vertex: &u32| {
            let first = vertex as usize * sets;
            self.influences[first..first + sets].iter().copied()
        };
        self.influences = source.iter().flat_map(of).collect();
    }
}

/// Reads the joints of all sets, keeps the greatest weights of each vertex and makes them add up to 1.
fn read_joints(accessors: &Accessors, job: &Job, vertex_count: usize) -> Result<Joints, SceneError> {
    let mut out = Joints::default();
    let mut all: Vec<Vec<(u32, f32)>> = vec![Vec::new(); vertex_count];
    let mut negative = 0;
    for set in 0.. {
        let attribute = |s| job.primitive.attributes.get(&Checked::Valid(s)).map(|a| a.value());
        let (Some(ids), Some(weights)) =
            (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set)))
        else {
            break;
        };
        let weights = accessors.floats::<4>(weights, 4, 0.0)?;
        for (vertex, (joints, weights)) in accessors.uvec4(ids)?.into_iter().zip(weights).enumerate() {
            negative += usize::from(weights.iter().any(|&weight| weight < 0.0));
            for (joint, weight) in joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
                if out.last.is_none_or(|(greatest, ..)| joint > greatest) {
                    out.last = Some((joint, vertex, ids));
                }
                all[vertex].push((joint, weight));
            }
        }
    }
    let too_many = all.iter().filter(|list| list.len() > JOINTS_PER_VERTEX_MAX).count();
    let unheld = all.iter().filter(|list| list.is_empty()).count();
    for list in &mut all {
        // A stable order: equal weights stay as the file has them.
        list.sort_by(|a, b| b.1.total_cmp(&a.1));
        list.truncate(JOINTS_PER_VERTEX_MAX);
        if list.is_empty() {
            list.push((0, 1.0));
        }
    }
    let most = all.iter().map(Vec::len).max().unwrap_or(0);
    out.set_count = most.div_ceil(JOINTS_PER_SET).max(1);
    for list in &all {
        let total: f64 = list.iter().map(|&(_, weight)| f64::from(weight)).sum();
        let mut parts = list.chunks(JOINTS_PER_SET);
        for _ in 0..out.set_count {
            let mut set = Influences::default();
            for (k, &(joint, weight)) in parts.next().unwrap_or(&[]).iter().enumerate() {
                // joints have 16 bits in the file
                (set.joints[k], set.weights[k]) = (joint as u16, (f64::from(weight) / total) as f32);
            }
            out.influences.push(set);
        }
    }
    for (count, text) in [
        (negative, "vertices have negative weights of joints, which count as 0"),
        (unheld, "vertices have no weight of any joint and are held by the first"),
        (too_many, "vertices have more than 8 joints, of which those with the greatest weights are kept"),
    ] {
        if count > 0 {
            out.warnings.push(format!("{}: {count} {text}", job.at));
        }
    }
    Ok(out)
}

/// Puts shapes and deformations into the scene, job by job.
#[derive(Default)]
pub(super) struct Deformer {
    /// Shapes in the scene that skins move, by the file's mesh and the place of the primitive.
    shared: HashMap<usize, u32>,
    /// The node of the variant before, and its first joint and weight.
    last: Option<(u32, u32, u32)>,
    joint_count: u32,
}

impl Deformer {
    /// Adds the deformation of the mesh that the scene gets next.
    pub(super) fn add(
        &mut self,
        accessors: &Accessors,
        job: &Job,
        built: &mut Built,
        scene: &mut Scene,
    ) -> Result<(), SceneError> {
        let variant = job.variant;
        let skin = variant.skin.map(|skin| (skin, scene.skins[skin as usize].joints.len()));
        if let (Some((_, count)), Some((joint, vertex, accessor))) = (skin, built.last_joint)
            && joint as usize >= count
        {
            let at = format!("{} element {vertex}", accessors.place(accessor));
            return Err(check::unresolved(accessors.file, at, joint as usize, count));
        }
        scene.warnings.append(&mut built.warnings);
        // Primitives of one node have the same joints and weights.
        let (first_joint, first_weight) = match self.last {
            Some((node, joint, weight)) if node == variant.node => (joint, weight),
            _ => {
                let first = (self.joint_count, scene.rest_weights.len() as u32);
                self.joint_count += skin.map_or(0, |(_, count)| count as u32);
                scene.rest_weights.extend_from_slice(&variant.weights);
                first
            }
        };
        self.last = Some((variant.node, first_joint, first_weight));
        let mut push = |shape: &Shape| {
            scene.shapes.push(shape.clone());
            scene.shapes.len() as u32 - 1
        };
        // A shape that no skin moves may be shifted with its mesh, so each mesh has its own; targets are shared in any case.
        let shape = match (skin, job.shape) {
            (Some(_), Some(key)) => *self.shared.entry(key).or_insert_with(|| push(&built.shape)),
            _ => push(&built.shape),
        };
        scene.deformations.push(Deformation {
            mesh: scene.meshes.len() as u32,
            shape,
            object_node: variant.object_node,
            weights_node: variant.node,
            skin: variant.skin,
            first_joint,
            first_weight,
        });
        Ok(())
    }
}
