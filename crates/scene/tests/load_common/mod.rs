//! What the tests of the loaders share.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

use afterlight_scene::{LoadOptions, Scene, SceneError, load_bytes};
use serde_json::{Value, json};

/// The folder of reference scenes, or `None`, told and counted.
pub fn scenes_dir() -> Option<PathBuf> {
    afterlight_testkit::shared_scenes()
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
    for d in &scene.deformations {
        let (Some(mesh), Some(shape)) =
            (scene.meshes.get(d.mesh as usize), scene.shapes.get(d.shape as usize))
        else {
            return fail(false, "a deformation's mesh and shape");
        };
        let count = mesh.vertex_count as usize;
        fail(shape.positions_os.len() == count && shape.frames_os.len() == count, "as many vertices")?;
        fail(shape.influences.len() == count * shape.set_count as usize, "joints of every vertex")?;
        let list = |list: &[[f32; 3]]| list.is_empty() || list.len() == count;
        let whole = |t: &afterlight_scene::MorphTarget| {
            list(&t.positions_os) && list(&t.normals_os) && list(&t.tangents_os)
        };
        fail(shape.targets.iter().all(whole), "a target's difference of every vertex")?;
        fail(!shape.is_flat || count.is_multiple_of(3), "three vertices a flat triangle")?;
        fail((d.object_node.max(d.weights_node) as usize) < scene.nodes.len(), "a deformation's nodes")?;
        fail(d.weights(scene).end <= scene.rest_weights.len(), "weights in range")?;
        fail(d.skin.is_none_or(|skin| (skin as usize) < scene.skins.len()), "a deformation's skin")?;
        let joints = d.joints(scene);
        let used = shape.joint_bounds.iter().all(|b| d.skin.is_none() || (b.joint as usize) < joints.len());
        fail(used, "joints in range")?;
    }
    fail(scene.deformations.is_sorted_by(|a, b| a.mesh < b.mesh), "deformations by rising mesh")?;
    fail(scene.deformations.is_sorted_by_key(|d| d.weights_node), "deformations by rising node")?;
    for skin in &scene.skins {
        fail(skin.joints.len() == skin.joint_from_bind.len() && !skin.joints.is_empty(), "a matrix a joint")?;
        fail(skin.joints.iter().all(|&j| (j as usize) < scene.nodes.len()), "joints among the nodes")?;
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

/// A glTF made by a test: JSON beside one binary buffer.
pub struct Document {
    /// The JSON, without buffers, buffer views and accessors.
    pub json: Value,
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Document {
    /// A document with one node that shows mesh 0.
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
        });
        Self { json, bytes: Vec::new(), views: Vec::new(), accessors: Vec::new() }
    }

    /// Adds bytes as a buffer view and returns its index.
    pub fn view(&mut self, bytes: &[u8], stride_bytes: Option<usize>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(stride) = stride_bytes {
            view["byteStride"] = json!(stride);
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// The last buffer view, to be changed.
    pub fn view_json(&mut self, index: usize) -> &mut Value {
        &mut self.views[index]
    }

    /// Adds an accessor and returns its index.
    pub fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds an accessor of floats.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let view = self.view(bytemuck::cast_slice(values.as_flattened()), None);
        let shape = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        self.accessor(
            json!({"bufferView": view, "componentType": 5126, "count": values.len(), "type": shape}),
        )
    }

    /// Adds an accessor of indices, 1, 2 or 4 bytes wide.
    pub fn indices(&mut self, values: &[u32], width_bytes: usize) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()[..width_bytes].to_vec()).collect();
        let view = self.view(&bytes, None);
        let component = [5121, 5123, 0, 5125][width_bytes - 1];
        self.accessor(
            json!({"bufferView": view, "componentType": component, "count": values.len(), "type": "SCALAR"}),
        )
    }

    /// The document as a GLB.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let mut bin = self.bytes.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        if !bin.is_empty() {
            json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        }
        for (name, values) in [("bufferViews", &self.views), ("accessors", &self.accessors)] {
            if !values.is_empty() {
                json[name] = json!(values);
            }
        }
        let mut text = serde_json::to_vec(&json).unwrap();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut out = b"glTF\x02\0\0\0".to_vec();
        let length = 12 + 8 + text.len() + if bin.is_empty() { 0 } else { 8 + bin.len() };
        out.extend((length as u32).to_le_bytes());
        out.extend((text.len() as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(&text);
        if !bin.is_empty() {
            out.extend((bin.len() as u32).to_le_bytes());
            out.extend(b"BIN\0");
            out.extend(&bin);
        }
        out
    }

    /// Loads the document.
    pub fn load(&self) -> Result<Scene, SceneError> {
        self.load_at(None)
    }

    /// Loads the document, posed at a time.
    pub fn load_at(&self, time_s: Option<f64>) -> Result<Scene, SceneError> {
        let scene = load_bytes(Path::new("test.glb"), &self.glb(), &LoadOptions { time_s })?;
        check_scene(&scene).unwrap_or_else(|e| panic!("{e}"));
        Ok(scene)
    }
}
