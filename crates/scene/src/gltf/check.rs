//! References between the objects of a file: every index resolves, nodes form trees, accessors
//! have a form that their use allows.

use std::path::Path;

use gltf::json::{
    Index, Root,
    accessor::{ComponentType, Type},
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};

use super::accessor::Layout;
use crate::SceneError;

/// The error for an index past its array.
pub(super) fn unresolved(file: &Path, at: String, found: usize, count: usize) -> SceneError {
    let expected = match count {
        0 => "none: the file has no such object".to_owned(),
        n => format!("0 to {}", n - 1),
    };
    SceneError::invalid(file, at, found.to_string(), expected)
}

/// Checks that an index lies within an array.
fn resolve<T>(
    file: &Path,
    at: impl FnOnce() -> String,
    index: &Index<T>,
    count: usize,
) -> Result<(), SceneError> {
    if index.value() < count { Ok(()) } else { Err(unresolved(file, at(), index.value(), count)) }
}

/// Checks every reference of the file, also those of objects that nothing uses.
pub(super) fn references(file: &Path, root: &Root, layouts: &[Layout]) -> Result<(), SceneError> {
    check_scenes_and_nodes(file, root)?;
    check_meshes(file, root, layouts)?;
    check_materials(file, root)?;
    check_skins(file, root, layouts)?;
    check_animations(file, root)
}

fn check_scenes_and_nodes(file: &Path, root: &Root) -> Result<(), SceneError> {
    if let Some(scene) = &root.scene {
        resolve(file, || "scene".into(), scene, root.scenes.len())?;
    }
    for (i, scene) in root.scenes.iter().enumerate() {
        for (k, node) in scene.nodes.iter().enumerate() {
            resolve(file, || format!("scenes[{i}].nodes[{k}]"), node, root.nodes.len())?;
        }
    }
    let light_count =
        root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()).map_or(0, |l| l.lights.len());
    for (i, node) in root.nodes.iter().enumerate() {
        let at = |property: &str| format!("nodes[{i}].{property}");
        let has_trs = node.translation.is_some() || node.rotation.is_some() || node.scale.is_some();
        if node.matrix.is_some() && has_trs {
            let (found, expected) =
                ("a matrix beside translation, rotation or scale", "one form of transform");
            return Err(SceneError::invalid(file, at("matrix"), found, expected));
        }
        if let Some(mesh) = &node.mesh {
            resolve(file, || at("mesh"), mesh, root.meshes.len())?;
        }
        if let Some(camera) = &node.camera {
            resolve(file, || at("camera"), camera, root.cameras.len())?;
        }
        if let Some(skin) = &node.skin {
            resolve(file, || at("skin"), skin, root.skins.len())?;
        }
        if let Some(light) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) {
            resolve(file, || at("extensions.KHR_lights_punctual.light"), &light.light, light_count)?;
        }
    }
    check_trees(file, root)
}

/// Checks that no node has two parents, is its own ancestor, or is a scene's root and a child.
fn check_trees(file: &Path, root: &Root) -> Result<(), SceneError> {
    let mut parent: Vec<Option<usize>> = vec![None; root.nodes.len()];
    for (i, node) in root.nodes.iter().enumerate() {
        for (k, child) in node.children.iter().flatten().enumerate() {
            let at = || format!("nodes[{i}].children[{k}]");
            resolve(file, at, child, root.nodes.len())?;
            let slot = &mut parent[child.value()];
            if let Some(other) = slot {
                let found = format!("node {}, a child of node {other} already", child.value());
                return Err(SceneError::invalid(file, at(), found, "at most one parent a node"));
            }
            *slot = Some(i);
        }
    }
    // with at most one parent a node, a walk up that does not end is a cycle
    let mut done = vec![false; root.nodes.len()];
    for start in 0..root.nodes.len() {
        let mut path = Vec::new();
        let mut at = Some(start);
        while let Some(node) = at.filter(|&n| !done[n]) {
            done[node] = true;
            path.push(node);
            at = parent[node];
        }
        if let Some(node) = at.filter(|n| path.contains(n)) {
            let found = format!("node {node} among its own descendants");
            return Err(SceneError::invalid(file, format!("nodes[{node}]"), found, "no cycle"));
        }
    }
    for (i, scene) in root.scenes.iter().enumerate() {
        let mut seen = vec![false; root.nodes.len()];
        for (k, node) in scene.nodes.iter().map(Index::value).enumerate() {
            let at = format!("scenes[{i}].nodes[{k}]");
            if let Some(p) = parent[node] {
                return Err(SceneError::invalid(
                    file,
                    at,
                    format!("node {node}, a child of node {p}"),
                    "a root node",
                ));
            }
            if std::mem::replace(&mut seen[node], true) {
                return Err(SceneError::invalid(
                    file,
                    at,
                    format!("node {node} a second time"),
                    "each node once",
                ));
            }
        }
    }
    Ok(())
}

fn check_meshes(file: &Path, root: &Root, layouts: &[Layout]) -> Result<(), SceneError> {
    let quantized =
        root.extensions_used.iter().chain(&root.extensions_required).any(|e| e == "KHR_mesh_quantization");
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let at = format!("meshes[{i}].primitives[{k}]");
            check_primitive(file, root, layouts, &at, primitive, quantized)?;
        }
        let targets = |p: &Primitive| p.targets.as_ref().map_or(0, Vec::len);
        let counts = mesh.primitives.iter().map(targets);
        let first = mesh.primitives.first().map_or(0, targets);
        if let Some(other) = counts.clone().find(|&c| c != first) {
            let found = format!("{first} and {other} morph targets");
            return Err(SceneError::invalid(
                file,
                format!("meshes[{i}]"),
                found,
                "as many in each primitive",
            ));
        }
        if let Some(weights) = mesh.weights.as_ref().filter(|w| w.len() != first) {
            let at = format!("meshes[{i}].weights");
            return Err(SceneError::invalid(
                file,
                at,
                weights.len().to_string(),
                format!("{first}, one a target"),
            ));
        }
    }
    for (i, node) in root.nodes.iter().enumerate() {
        let Some(weights) = &node.weights else { continue };
        let first = node.mesh.and_then(|m| root.meshes[m.value()].primitives.first());
        let count = first.and_then(|p| p.targets.as_ref()).map_or(0, Vec::len);
        if weights.len() != count {
            let at = format!("nodes[{i}].weights");
            return Err(SceneError::invalid(
                file,
                at,
                weights.len().to_string(),
                format!("{count}, one a target"),
            ));
        }
    }
    Ok(())
}

fn check_primitive(
    file: &Path,
    root: &Root,
    layouts: &[Layout],
    at: &str,
    primitive: &Primitive,
    quantized: bool,
) -> Result<(), SceneError> {
    if let Some(material) = &primitive.material {
        resolve(file, || format!("{at}.material"), material, root.materials.len())?;
    }
    if primitive.mode == Checked::Invalid {
        return Err(SceneError::invalid(file, format!("{at}.mode"), "an unknown number", "0 to 6"));
    }
    if let Some(indices) = &primitive.indices {
        let at = format!("{at}.indices");
        resolve(file, || at.clone(), indices, layouts.len())?;
        let l = &layouts[indices.value()];
        let unsigned = matches!(l.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if l.shape != Type::Scalar || !unsigned || l.normalized {
            return Err(SceneError::invalid(file, at, form(l), "SCALAR of unsigned integers"));
        }
    }
    for semantic in primitive.attributes.keys() {
        let partner = match semantic {
            Checked::Valid(Semantic::Joints(set)) => Semantic::Weights(*set),
            Checked::Valid(Semantic::Weights(set)) => Semantic::Joints(*set),
            _ => continue,
        };
        let name = partner.to_string();
        if !primitive.attributes.contains_key(&Checked::Valid(partner)) {
            let expected = "JOINTS_n and WEIGHTS_n together";
            return Err(SceneError::invalid(
                file,
                format!("{at}.attributes"),
                format!("no {name}"),
                expected,
            ));
        }
    }
    let mut vertices: Option<usize> = None;
    for (semantic, accessor) in &primitive.attributes {
        let name = match semantic {
            Checked::Valid(s) => s.to_string(),
            // an application's own (_NAME) or an unknown attribute: ignored, but it must resolve
            Checked::Invalid => "(other)".to_owned(),
        };
        let at = format!("{at}.attributes.{name}");
        resolve(file, || at.clone(), accessor, layouts.len())?;
        let l = &layouts[accessor.value()];
        if let Checked::Valid(semantic) = semantic
            && let Some(expected) = wrong_form(semantic, l, quantized)
        {
            return Err(SceneError::invalid(file, at, form(l), expected));
        }
        match vertices {
            Some(count) if count != l.count => {
                let found = format!("{} elements", l.count);
                return Err(SceneError::invalid(file, at, found, format!("{count} as the other attributes")));
            }
            _ => vertices = Some(l.count),
        }
    }
    for (t, target) in primitive.targets.iter().flatten().enumerate() {
        for (name, semantic, accessor) in [
            ("POSITION", Semantic::Positions, &target.positions),
            ("NORMAL", Semantic::Normals, &target.normals),
            ("TANGENT", Semantic::Tangents, &target.tangents),
        ] {
            let Some(accessor) = accessor else { continue };
            let at = format!("{at}.targets[{t}].{name}");
            resolve(file, || at.clone(), accessor, layouts.len())?;
            let l = &layouts[accessor.value()];
            let base = primitive.attributes.get(&Checked::Valid(semantic));
            let base_count = base.map_or(0, |a| layouts[a.value()].count);
            if base_count != l.count {
                let expected = format!("{base_count} as the attribute it changes");
                return Err(SceneError::invalid(file, at, format!("{} elements", l.count), expected));
            }
            if l.shape != Type::Vec3 {
                return Err(SceneError::invalid(file, at, form(l), "VEC3"));
            }
        }
    }
    Ok(())
}

/// An accessor's form in words.
fn form(l: &Layout) -> String {
    format!("{:?} of {:?}{}", l.shape, l.component, if l.normalized { ", normalized" } else { "" })
}

/// What an attribute's accessor should be (glTF 2.0, 3.7.2.1, and KHR_mesh_quantization); `None`
/// where it is.
fn wrong_form(semantic: &Semantic, l: &Layout, quantized: bool) -> Option<&'static str> {
    use ComponentType::{F32, I8, I16, U8, U16};
    let c = l.component;
    let float = c == F32;
    let small = matches!(c, I8 | U8 | I16 | U16);
    let unit = l.normalized && matches!(c, U8 | U16);
    let signed_unit = l.normalized && matches!(c, I8 | I16);
    let (fits, expected) = match semantic {
        Semantic::Positions => (
            l.shape == Type::Vec3 && (float || quantized && small),
            "VEC3 of F32 (integers with KHR_mesh_quantization)",
        ),
        Semantic::Normals => (
            l.shape == Type::Vec3 && (float || quantized && signed_unit),
            "VEC3 of F32 (normalized I8, I16 with KHR_mesh_quantization)",
        ),
        Semantic::Tangents => (
            l.shape == Type::Vec4 && (float || quantized && signed_unit),
            "VEC4 of F32 (normalized I8, I16 with KHR_mesh_quantization)",
        ),
        Semantic::TexCoords(_) => (
            l.shape == Type::Vec2 && (float || unit || quantized && small),
            "VEC2 of F32 or normalized U8, U16 (other integers with KHR_mesh_quantization)",
        ),
        Semantic::Colors(_) => (
            matches!(l.shape, Type::Vec3 | Type::Vec4) && (float || unit),
            "VEC3 or VEC4 of F32 or normalized U8, U16",
        ),
        Semantic::Joints(_) => {
            (l.shape == Type::Vec4 && !l.normalized && matches!(c, U8 | U16), "VEC4 of U8 or U16")
        }
        Semantic::Weights(_) => {
            (l.shape == Type::Vec4 && (float || unit), "VEC4 of F32 or normalized U8, U16")
        }
    };
    (!fits).then_some(expected)
}

fn check_materials(file: &Path, root: &Root) -> Result<(), SceneError> {
    for (i, texture) in root.textures.iter().enumerate() {
        // u32::MAX stands for a texture without a source: one of an extension, an error where used
        if texture.source.value() != u32::MAX as usize {
            resolve(file, || format!("textures[{i}].source"), &texture.source, root.images.len())?;
        }
        if let Some(sampler) = &texture.sampler {
            resolve(file, || format!("textures[{i}].sampler"), sampler, root.samplers.len())?;
        }
    }
    for (i, image) in root.images.iter().enumerate() {
        if let Some(view) = &image.buffer_view {
            resolve(file, || format!("images[{i}].bufferView"), view, root.buffer_views.len())?;
        }
    }
    for (i, m) in root.materials.iter().enumerate() {
        let pbr = &m.pbr_metallic_roughness;
        for (name, index) in [
            ("pbrMetallicRoughness.baseColorTexture", pbr.base_color_texture.as_ref().map(|t| t.index)),
            (
                "pbrMetallicRoughness.metallicRoughnessTexture",
                pbr.metallic_roughness_texture.as_ref().map(|t| t.index),
            ),
            ("normalTexture", m.normal_texture.as_ref().map(|t| t.index)),
            ("occlusionTexture", m.occlusion_texture.as_ref().map(|t| t.index)),
            ("emissiveTexture", m.emissive_texture.as_ref().map(|t| t.index)),
        ] {
            if let Some(index) = index {
                resolve(file, || format!("materials[{i}].{name}.index"), &index, root.textures.len())?;
            }
        }
    }
    Ok(())
}

fn check_skins(file: &Path, root: &Root, layouts: &[Layout]) -> Result<(), SceneError> {
    for (i, skin) in root.skins.iter().enumerate() {
        for (k, joint) in skin.joints.iter().enumerate() {
            resolve(file, || format!("skins[{i}].joints[{k}]"), joint, root.nodes.len())?;
        }
        if let Some(skeleton) = &skin.skeleton {
            resolve(file, || format!("skins[{i}].skeleton"), skeleton, root.nodes.len())?;
        }
        if let Some(matrices) = &skin.inverse_bind_matrices {
            let at = format!("skins[{i}].inverseBindMatrices");
            resolve(file, || at.clone(), matrices, layouts.len())?;
            let l = &layouts[matrices.value()];
            if l.shape != Type::Mat4 || l.component != ComponentType::F32 {
                return Err(SceneError::invalid(file, at, form(l), "MAT4 of F32"));
            }
            if l.count < skin.joints.len() {
                let expected = format!("{} or more, one a joint", skin.joints.len());
                return Err(SceneError::invalid(file, at, format!("{} matrices", l.count), expected));
            }
        }
    }
    Ok(())
}

fn check_animations(file: &Path, root: &Root) -> Result<(), SceneError> {
    for (i, animation) in root.animations.iter().enumerate() {
        for (k, sampler) in animation.samplers.iter().enumerate() {
            let at = |p: &str| format!("animations[{i}].samplers[{k}].{p}");
            resolve(file, || at("input"), &sampler.input, root.accessors.len())?;
            resolve(file, || at("output"), &sampler.output, root.accessors.len())?;
            if sampler.interpolation == Checked::Invalid {
                let expected = "LINEAR, STEP or CUBICSPLINE";
                return Err(SceneError::invalid(file, at("interpolation"), "an unknown name", expected));
            }
        }
        for (k, channel) in animation.channels.iter().enumerate() {
            let at = |p: &str| format!("animations[{i}].channels[{k}].{p}");
            resolve(file, || at("sampler"), &channel.sampler, animation.samplers.len())?;
            resolve(file, || at("target.node"), &channel.target.node, root.nodes.len())?;
        }
    }
    Ok(())
}

/// Whether a primitive is made of triangles.
pub(super) fn is_triangles(primitive: &Primitive) -> bool {
    matches!(primitive.mode, Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan))
}
