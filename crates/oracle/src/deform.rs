//! Vertices of skinned and morphed meshes in a pose (glTF 2.0, 3.7.2.2 and 3.7.3.3).
//!
//! Morph targets first: each attribute plus the targets' differences times their weights. Then the skin: the mean of the joints' matrices,
//! weighted, moves positions and tangents; its inverse transpose turns normals. A matrix that mirrors turns the sign of the bitangent.
//! What has no inverse (a joint scaled to nothing) turns normals by its cofactors. Meshes without normals have those of
//! their triangles where those have come to lie. Normals and tangents are made unit at the end; one without length stays zero.

use afterlight_scene::{Pose, Scene};
use glam::{DMat3, DMat4, DVec3, DVec4};

/// A vertex in a pose, in the object space of its mesh or, from [`posed_vertices_ws`], in world space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PosedVertex {
    /// Position, metres.
    pub position: DVec3,
    /// Unit normal; zero where there is none.
    pub normal: DVec3,
    /// Unit tangent; zero where there is none. It need not be perpendicular to the normal.
    pub tangent: DVec3,
    /// Sign of the bitangent.
    pub handedness: f64,
}

/// The vertices of an instance's mesh in a pose of the scene, in the object space of the mesh and in its order: what a device is to write
/// in the place of the mesh's vertices. For a mesh that nothing deforms those that the scene has.
///
/// # Panics
/// Where the instance does not exist, or the pose is another scene's.
pub fn posed_vertices(scene: &Scene, pose: &Pose, instance: usize) -> Vec<PosedVertex> {
    let drawn = scene.instances[instance].mesh;
    let mesh = &scene.meshes[drawn as usize];
    let Some(deformation) = scene.deformations.iter().find(|d| d.mesh == drawn) else {
        let first = mesh.first_vertex as usize;
        return (first..first + mesh.vertex_count as usize)
            .map(|k| vertex(scene.positions_os[k], &scene.attributes[k]))
            .collect();
    };
    let shape = &scene.shapes[deformation.shape as usize];
    let weights: Vec<f64> = (0..shape.targets.len())
        .map(|k| pose.weights[deformation.first_weight as usize + k].into())
        .collect();
    let joints: Vec<DMat4> = deformation.skin.map_or(Vec::new(), |skin| {
        let count = scene.skins[skin as usize].joints.len();
        let first = deformation.first_joint as usize;
        pose.object_from_bind[first..first + count].iter().map(|m| DMat4::from(m.as_daffine3())).collect()
    });
    let mut out = Vec::with_capacity(shape.positions_os.len());
    for (k, (position, frame)) in shape.positions_os.iter().zip(&shape.frames_os).enumerate() {
        let packed = afterlight_scene::VertexAttributes {
            normal_os_oct: frame[0],
            tangent_os_oct: frame[1],
            ..Default::default()
        };
        let mut v = vertex(*position, &packed);
        for (target, weight) in shape.targets.iter().zip(&weights) {
            let difference = |list: &[[f32; 3]]| list.get(k).map_or(DVec3::ZERO, |d| wide(*d));
            v.position += *weight * difference(&target.positions_os);
            v.normal += *weight * difference(&target.normals_os);
            v.tangent += *weight * difference(&target.tangents_os);
        }
        if !joints.is_empty() {
            let mut blended = DMat4::ZERO;
            for influences in shape.influences_of(k) {
                for (joint, weight) in influences.joints.iter().zip(influences.weights) {
                    blended += f64::from(weight) * joints[usize::from(*joint)];
                }
            }
            // Weights of 32 bits add up to 1 but for their rounding; a mean has a last row of 0, 0, 0, 1.
            v.position = (blended * v.position.extend(1.0)).truncate();
            let turn = DMat3::from_mat4(blended);
            v.normal = inverse_transpose(turn) * v.normal;
            v.tangent = turn * v.tangent;
            v.handedness *= if turn.determinant() < 0.0 { -1.0 } else { 1.0 };
        }
        out.push(v);
    }
    if shape.is_flat {
        for t in out.chunks_exact_mut(3) {
            let normal = (t[1].position - t[0].position).cross(t[2].position - t[0].position);
            t.iter_mut().for_each(|v| v.normal = if normal == DVec3::ZERO { DVec3::Z } else { normal });
        }
    }
    for v in &mut out {
        (v.normal, v.tangent) = (unit(v.normal), unit(v.tangent));
    }
    out
}

/// As [`posed_vertices`], in world space: by the instance's matrix in the pose.
///
/// # Panics
/// As [`posed_vertices`].
pub fn posed_vertices_ws(scene: &Scene, pose: &Pose, instance: usize) -> Vec<PosedVertex> {
    let world_from_object = DMat4::from(pose.world_from_object[instance].as_daffine3());
    let turn = DMat3::from_mat4(world_from_object);
    let sign = if turn.determinant() < 0.0 { -1.0 } else { 1.0 };
    let placed = |v: PosedVertex| PosedVertex {
        position: (world_from_object * DVec4::from((v.position, 1.0))).truncate(),
        normal: unit(inverse_transpose(turn) * v.normal),
        tangent: unit(turn * v.tangent),
        handedness: sign * v.handedness,
    };
    posed_vertices(scene, pose, instance).into_iter().map(placed).collect()
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn vertex(position: [f32; 3], packed: &afterlight_scene::VertexAttributes) -> PosedVertex {
    let (tangent, handedness) = packed.tangent_os();
    PosedVertex {
        position: wide(position),
        normal: packed.normal_os().as_dvec3(),
        tangent: tangent.as_dvec3(),
        handedness: handedness.into(),
    }
}

/// The inverse transpose; without an inverse the cofactors, to which it is in proportion.
fn inverse_transpose(m: DMat3) -> DMat3 {
    if m.determinant().abs() > f64::MIN_POSITIVE {
        return m.inverse().transpose();
    }
    let [a, b, c] = [m.x_axis, m.y_axis, m.z_axis];
    DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b))
}

fn unit(v: DVec3) -> DVec3 {
    v.try_normalize().unwrap_or(DVec3::ZERO)
}
