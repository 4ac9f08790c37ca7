//! glTF 2.0. The `gltf` crate gives the types of the JSON; container, references, ranges and
//! values are checked here, since that crate panics on some broken files and passes others on.
//!
//! The steps: split the container, read buffers and decompress views, check every reference,
//! convert materials, nodes, animations and meshes.

mod accessor;
mod buffers;
mod check;
mod container;
mod material;
mod mesh;
mod motion;
mod node;

pub(crate) use mesh::{INDEX_COUNT_MAX, Unpacked, VERTEX_COUNT_MAX, add_mesh};

use std::path::Path;

use crate::{LoadOptions, Scene, SceneError};

/// Loads a `.gltf` or `.glb` from its bytes; `file` names it and gives the folder of its resources.
pub(crate) fn load(file: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Scene, SceneError> {
    let container = container::parse(file, bytes)?;
    let root = &container.root;
    let layouts = accessor::layouts(file, root)?;
    check::references(file, root, &layouts)?;
    let buffers = buffers::load_buffers(file, &container)?;
    let views = buffers::load_views(file, root, &buffers)?;
    let accessors = accessor::Accessors { file, layouts, views };

    let mut scene = Scene { warnings: container.warnings, ..Scene::default() };
    let materials = material::convert(&accessors, root, &mut scene.warnings)?;
    scene.materials = materials.materials;
    scene.images = materials.images;
    let placement = node::place(file, root, container.places, &mut scene)?;
    scene.animations = motion::convert(&accessors, root, &placement, &mut scene.warnings)?;
    let draws = node::find_draws(&accessors, root, &placement, &mut scene)?;
    let meshes = mesh::convert(&accessors, root, &draws.variants, &mut scene)?;
    mesh::check_unused(&accessors, root, &draws.variants)?;
    node::make_instances(file, &draws, &meshes, options.time_s, &mut scene)?;
    let worlds = scene.world_from_nodes(options.time_s);
    node::make_lights_and_cameras(file, root, &placement, &worlds, &mut scene)?;
    Ok(scene)
}
