//! What the tests of the loaders share.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

use afterlight_scene::Scene;

/// The folder of reference scenes, or `None` with a line that says that a test is skipped.
pub fn scenes_dir() -> Option<PathBuf> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if dir.is_dir() {
        return Some(dir);
    }
    println!("skipped: no reference scenes at {}", dir.display());
    None
}

/// All files below a folder with one of the extensions, sorted.
pub fn files_under(dir: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut out = Vec::new();
    let mut stack = vec![dir.to_owned()];
    while let Some(dir) = stack.pop() {
        for entry in std::fs::read_dir(&dir).unwrap().map(Result::unwrap) {
            let path = entry.path();
            if path.is_dir() {
                stack.push(path);
            } else if path.extension().is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x))) {
                out.push(path);
            }
        }
    }
    out.sort();
    out
}

/// Whether what a renderer relies on holds: ranges, references, finite numbers.
pub fn check_scene(scene: &Scene) -> Result<(), String> {
    let fail = |ok: bool, text: &str| if ok { Ok(()) } else { Err(text.to_owned()) };
    fail(scene.positions_os.len() == scene.attributes.len(), "as many attributes as positions")?;
    fail(scene.positions_os.iter().flatten().all(|v| v.is_finite()), "finite positions")?;
    fail(!scene.cameras.is_empty(), "a camera")?;
    for mesh in &scene.meshes {
        let end = mesh.first_index as usize + mesh.index_count as usize;
        fail(mesh.index_count % 3 == 0 && end <= scene.indices.len(), "indices in range")?;
        let vertices_end = mesh.first_vertex as usize + mesh.vertex_count as usize;
        fail(vertices_end <= scene.positions_os.len(), "vertices in range")?;
        let indices = &scene.indices[mesh.first_index as usize..end];
        fail(indices.iter().all(|&i| i < mesh.vertex_count), "indices below the vertices")?;
        fail((mesh.material as usize) < scene.materials.len(), "a material")?;
    }
    for (i, node) in scene.nodes.iter().enumerate() {
        fail(node.parent.is_none_or(|p| (p as usize) < i), "parents first")?;
    }
    for instance in &scene.instances {
        fail((instance.mesh as usize) < scene.meshes.len(), "an instance's mesh")?;
        fail((instance.node as usize) < scene.nodes.len(), "an instance's node")?;
        fail(instance.world_from_object.is_finite(), "a finite place")?;
    }
    for m in &scene.materials {
        let textures = [
            m.base_color_texture,
            m.metallic_roughness_texture,
            m.normal_texture,
            m.occlusion_texture,
            m.emissive_texture,
        ];
        for t in textures.into_iter().flatten() {
            fail((t.image as usize) < scene.images.len() && t.uv_set < 2, "a texture's image")?;
        }
    }
    Ok(())
}
