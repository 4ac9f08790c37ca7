//! Scenes of flat, unlit shapes whose corners are given.

use afterlight_techniques::scene::{
    Aabb, AlphaMode, Camera, Instance, Material, Mesh, Scene, VertexAttributes,
};
use glam::{Affine3A, Vec3};

/// Triangles that are one draw: three corners and a colour each.
pub type Draw = Vec<([Vec3; 3], [u8; 3])>;

/// An unlit material, seen from both sides, whose colour is that of the vertices.
pub fn unlit(alpha_mode: AlphaMode) -> Material {
    Material { alpha_mode, unlit: true, double_sided: true, ..Material::default() }
}

/// A scene of draws of a material each, seen from `eye_ws` towards the origin.
pub fn scene_of(draws: &[(Material, Draw)], eye_ws: Vec3) -> Scene {
    let camera = Camera::look_at("view", eye_ws, Vec3::ZERO, 0.9, 0.1);
    let mut scene = Scene { cameras: vec![camera], ..Scene::default() };
    scene.environment.background_radiance = Vec3::ZERO;
    scene.environment.ambient_radiance = Vec3::ZERO;
    for (number, (material, triangles)) in (0..).zip(draws) {
        let [first_index, first_vertex] = [scene.indices.len() as u32, scene.positions_os.len() as u32];
        let mut bounds_os = Aabb::EMPTY;
        for (corners, [r, g, b]) in triangles {
            corners.iter().for_each(|corner| bounds_os.extend(*corner));
            let color_rgba8 = u32::from_le_bytes([*r, *g, *b, 255]);
            scene.positions_os.extend(corners.map(|corner| corner.to_array()));
            scene.attributes.extend([VertexAttributes { color_rgba8, ..VertexAttributes::default() }; 3]);
        }
        let vertex_count = 3 * triangles.len() as u32;
        scene.indices.extend(0..vertex_count);
        scene.meshes.push(Mesh {
            name: format!("draw {number}"),
            first_index,
            index_count: vertex_count,
            first_vertex,
            vertex_count,
            material: number,
            bounds_os,
        });
        scene.materials.push(material.clone());
        scene.instances.push(Instance { mesh: number, node: 0, world_from_object: Affine3A::IDENTITY });
    }
    scene
}
