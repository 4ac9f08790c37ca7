//! OBJ with MTL, parsed by `tobj`.

use std::{
    io::{BufReader, Cursor},
    path::Path,
};

use glam::{Affine3A, Vec2, Vec3, Vec4};

use crate::{
    Aabb, AlphaMode, Image, ImageData, Instance, Material, Mesh, Node, Sampler, Scene, SceneError,
    TextureRef, VertexAttributes, load::read_file, tangent, texture,
};

/// Loads an `.obj` from its bytes; `file` names it and gives the folder of materials and textures.
pub(crate) fn load(file: &Path, bytes: &[u8]) -> Result<Scene, SceneError> {
    let mut scene = Scene::default();
    let options =
        tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    let parsed =
        tobj::load_obj_buf(&mut BufReader::new(Cursor::new(bytes)), &options, |name| load_mtl(file, name));
    let (models, materials) =
        parsed.map_err(|e| SceneError::invalid(file, "OBJ", e.to_string(), "Wavefront OBJ"))?;
    let mut images = Images { file, images: Vec::new() };
    match materials {
        Ok(materials) => {
            for m in &materials {
                scene.materials.push(convert_material(&mut images, m, &mut scene.warnings)?);
            }
        }
        Err(e) => scene.warnings.push(format!("materials cannot be read ({e}); the default one is used")),
    }
    scene.images = images.images;
    let mut default_material = None;
    for model in &models {
        let count = scene.materials.len();
        let material = match model.mesh.material_id.filter(|&m| m < count) {
            Some(m) => m as u32,
            None => *default_material.get_or_insert_with(|| {
                scene.materials.push(Material {
                    name: "default".to_owned(),
                    metallic_factor: 0.0,
                    ..Material::default()
                });
                scene.materials.len() as u32 - 1
            }),
        };
        add_mesh(file, model, material, &mut scene)?;
    }
    Ok(scene)
}

/// Reads a material library beside the scene; a missing one is not an error of the scene.
fn load_mtl(file: &Path, name: &Path) -> tobj::MTLLoadResult {
    let path = file.parent().unwrap_or(Path::new("")).join(name);
    let bytes = read_file(&path).map_err(|_| tobj::LoadError::OpenFileFailed)?;
    tobj::load_mtl_buf(&mut BufReader::new(Cursor::new(bytes)))
}

struct Images<'a> {
    file: &'a Path,
    images: Vec<Image>,
}

impl Images<'_> {
    /// The texture that an option list and file name of MTL name (`-bm 1 name.png`).
    fn texture(&mut self, text: &str) -> Result<Option<TextureRef>, SceneError> {
        let Some(name) = texture_name(text) else { return Ok(None) };
        let path = self.file.parent().unwrap_or(Path::new("")).join(name.replace('\\', "/"));
        let shown = path.display().to_string();
        let place = match self.images.iter().position(|i| i.name == shown) {
            Some(place) => place,
            None => {
                self.images.push(texture::open(self.file, shown, ImageData::File(path))?);
                self.images.len() - 1
            }
        };
        Ok(Some(TextureRef {
            image: place as u32,
            sampler: Sampler::default(),
            uv_set: 0,
            uv_transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        }))
    }
}

/// The file name at the end of an MTL map statement, after its options.
fn texture_name(text: &str) -> Option<&str> {
    let mut rest = text.trim();
    while let Some(option) = rest.strip_prefix('-') {
        let (name, mut tail) = option.split_once(char::is_whitespace)?;
        let numeric = |w: &str| w.parse::<f32>().is_ok();
        // -o, -s, -t take up to three numbers, -mm two, the others one word
        let most = match name {
            "o" | "s" | "t" => 3,
            "mm" => 2,
            _ => 1,
        };
        for k in 0..most {
            match tail.trim_start().split_once(char::is_whitespace) {
                Some((word, next)) if k == 0 || numeric(word) => tail = next,
                None if k == 0 => return None,
                _ => break,
            }
        }
        rest = tail.trim_start();
    }
    (!rest.is_empty()).then_some(rest)
}

/// MTL to metal-rough: diffuse colour becomes base colour; `Pm` and `Pr` are taken as they are,
/// else metalness is 0 and roughness follows from the Blinn-Phong exponent: α² = 2 / (Ns + 2)
/// (Walter et al. 2007, their fit of Beckmann's α), perceptual roughness √α.
fn convert_material(
    images: &mut Images,
    m: &tobj::Material,
    warnings: &mut Vec<String>,
) -> Result<Material, SceneError> {
    let extra = |keys: &[&str]| keys.iter().find_map(|k| m.unknown_param.get(*k));
    let number =
        |keys: &[&str]| extra(keys).and_then(|v| v.trim().parse::<f32>().ok()).filter(|v| v.is_finite());
    let unit = |v: f32| if v.is_finite() { v.clamp(0.0, 1.0) } else { 0.0 };
    let mut map = |text: Option<&String>| text.map_or(Ok(None), |t| images.texture(t));
    let alpha = m.dissolve.or(number(&["Tr"]).map(|t| 1.0 - t)).map_or(1.0, unit);
    let base_color_texture = map(m.diffuse_texture.as_ref())?;
    let opacity_texture = m.dissolve_texture.as_deref().and_then(texture_name);
    let alpha_mode = match opacity_texture {
        // a coverage map: nearly always a cut-out, and glTF's alpha comes with the colour
        Some(name) => {
            if m.diffuse_texture.as_deref().and_then(texture_name) != Some(name) {
                warnings.push(format!(
                    "material {:?}: the opacity map is not joined with the colour map, whose own alpha is used",
                    crate::error::one_line(&m.name)
                ));
            }
            AlphaMode::Mask { cutoff: 0.5 }
        }
        None if alpha < 1.0 => AlphaMode::Blend,
        None => AlphaMode::Opaque,
    };
    let kd = m.diffuse.unwrap_or([if base_color_texture.is_some() { 1.0 } else { 0.8 }; 3]).map(unit);
    // exporters write Kd 0 beside a colour map that they mean to be seen
    let kd = if base_color_texture.is_some() && kd == [0.0; 3] { [1.0; 3] } else { kd };
    let from_exponent = |ns: f32| (2.0 / (ns.max(0.0) + 2.0)).powf(0.25);
    let roughness =
        number(&["Pr"]).or(m.shininess.filter(|n| n.is_finite()).map(from_exponent)).map_or(1.0, unit);
    let ke = m.emissive.unwrap_or([0.0; 3]).map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 });
    let emissive_texture = map(extra(&["map_Ke"]))?;
    let normal = extra(&["norm", "map_Kn"]).or(m.normal_texture.as_ref());
    let normal = normal.or(extra(&["map_Bump", "map_bump", "bump"]));
    Ok(Material {
        name: m.name.clone(),
        base_color_factor: [kd[0], kd[1], kd[2], alpha],
        base_color_texture,
        metallic_factor: number(&["Pm"]).map_or(0.0, unit),
        roughness_factor: roughness,
        normal_texture: map(normal)?,
        emissive_factor: if emissive_texture.is_some() && ke == [0.0; 3] { [1.0; 3] } else { ke },
        emissive_texture,
        alpha_mode,
        ..Material::default()
    })
}

fn add_mesh(file: &Path, model: &tobj::Model, material: u32, scene: &mut Scene) -> Result<(), SceneError> {
    let mesh = &model.mesh;
    let name = if model.name.is_empty() { "mesh".to_owned() } else { crate::error::one_line(&model.name) };
    let invalid =
        |found: String, expected: &str| SceneError::invalid(file, format!("object {name}"), found, expected);
    let mut indices = mesh.indices.clone();
    indices.truncate(indices.len() / 3 * 3);
    if indices.is_empty() {
        return Ok(());
    }
    let mut positions_os: Vec<[f32; 3]> = mesh.positions.as_chunks::<3>().0.to_vec();
    if let Some(&worst) = indices.iter().max().filter(|m| **m as usize >= positions_os.len()) {
        return Err(invalid(format!("the index {worst}"), &format!("an index below {}", positions_os.len())));
    }
    let numbers = [&mesh.positions, &mesh.normals, &mesh.texcoords, &mesh.vertex_color];
    if let Some(bad) = numbers.into_iter().flatten().find(|v| !v.is_finite()) {
        return Err(invalid(bad.to_string(), "finite numbers"));
    }
    // OBJ has v upwards, the scene model downwards
    let mut uvs: Vec<[f32; 2]> =
        mesh.texcoords.as_chunks::<2>().0.iter().map(|&[u, v]| [u, 1.0 - v]).collect();
    uvs.resize(positions_os.len(), [0.0; 2]);
    let mut colors: Vec<[f32; 3]> = mesh.vertex_color.as_chunks::<3>().0.to_vec();
    colors.resize(positions_os.len(), [1.0; 3]);
    let mut normals_os: Vec<[f32; 3]> = mesh.normals.as_chunks::<3>().0.to_vec();
    if normals_os.len() != positions_os.len() {
        (positions_os, uvs, colors) =
            (pick(&positions_os, &indices), pick(&uvs, &indices), pick(&colors, &indices));
        normals_os = positions_os
            .as_chunks::<3>()
            .0
            .iter()
            .flat_map(|c| [tangent::face_normal(*c).to_array(); 3])
            .collect();
        indices = (0..indices.len() as u32).collect();
    }
    let mut tangents_os = vec![Vec4::W; positions_os.len()];
    if scene.materials[material as usize].normal_texture.is_some() {
        let surface = tangent::Surface {
            positions_os: &positions_os,
            normals_os: &normals_os,
            uvs: &uvs,
            indices: &indices,
        };
        let corners = tangent::corner_tangents(&surface);
        let split = tangent::split_by_tangent(positions_os.len(), &indices, &corners);
        (positions_os, normals_os) = (pick(&positions_os, &split.source), pick(&normals_os, &split.source));
        (uvs, colors) = (pick(&uvs, &split.source), pick(&colors, &split.source));
        (tangents_os, indices) = (split.tangents_os, split.indices);
    }
    let total = scene.positions_os.len() as u64 + positions_os.len() as u64;
    if total.max(scene.indices.len() as u64 + indices.len() as u64) > u64::from(u32::MAX) {
        let limit = u64::from(u32::MAX);
        return Err(SceneError::TooLarge {
            file: file.to_owned(),
            what: "vertices or indices".to_owned(),
            found: total,
            limit,
        });
    }
    let mut bounds_os = Aabb::EMPTY;
    positions_os.iter().for_each(|&p| bounds_os.extend(p.into()));
    let node = scene.nodes.len() as u32;
    scene.nodes.push(Node { name: name.clone(), parent: None, local: Affine3A::IDENTITY });
    scene.instances.push(Instance {
        mesh: scene.meshes.len() as u32,
        node,
        world_from_object: Affine3A::IDENTITY,
    });
    scene.meshes.push(Mesh {
        name,
        first_index: scene.indices.len() as u32,
        index_count: indices.len() as u32,
        first_vertex: scene.positions_os.len() as u32,
        vertex_count: positions_os.len() as u32,
        material,
        bounds_os,
    });
    scene.attributes.extend((0..positions_os.len()).map(|i| {
        let (uv, [r, g, b], t) = (Vec2::from(uvs[i]), colors[i], tangents_os[i]);
        VertexAttributes::pack(Vec3::from(normals_os[i]), t.truncate(), t.w, uv, Vec2::ZERO, [r, g, b, 1.0])
    }));
    scene.positions_os.extend(positions_os);
    scene.indices.extend(indices);
    Ok(())
}

fn pick<T: Copy>(values: &[T], source: &[u32]) -> Vec<T> {
    source.iter().map(|&i| values[i as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::texture_name;

    #[test]
    fn options_before_a_texture_are_skipped() {
        assert_eq!(texture_name("wood grain.png"), Some("wood grain.png"));
        assert_eq!(texture_name("-bm 0.5 -s 1 2 3 a.png"), Some("a.png"));
        assert_eq!(texture_name("-s 1 a.png"), Some("a.png"));
        assert_eq!(texture_name("-clamp on a.png"), Some("a.png"));
        assert_eq!(texture_name("-bm"), None);
        assert_eq!(texture_name(""), None);
    }
}
