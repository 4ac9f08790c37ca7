//! OBJ, parsed by `tobj`, with materials of MTL.

use std::{
    cell::RefCell,
    io::{BufReader, Cursor},
    path::Path,
};

use glam::{Affine3A, DAffine3, DVec3, Vec2, Vec3, Vec4};

use crate::{
    Aabb, AlphaMode, Image, ImageData, Instance, Material, Mesh, Node, Sampler, Scene, SceneError,
    TextureRef, VertexAttributes,
    load::read_file,
    mtl::{self, MtlMaterial},
    origin, tangent, texture,
};

/// Loads an `.obj` from its bytes; `file` names it and gives the folder of materials and textures.
pub(crate) fn load(file: &Path, bytes: &[u8]) -> Result<Scene, SceneError> {
    load_with(file, bytes, &read_file)
}

/// The same with libraries read by `read_library`, which is given their paths.
fn load_with(
    file: &Path,
    bytes: &[u8],
    read_library: &dyn Fn(&Path) -> Result<Vec<u8>, SceneError>,
) -> Result<Scene, SceneError> {
    check_indices(file, bytes)?;
    let options =
        tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    let libraries = RefCell::new(Libraries { file, read: read_library, materials: vec![], warnings: vec![] });
    let parsed = tobj::load_obj_buf(&mut BufReader::new(Cursor::new(bytes)), &options, |name| {
        libraries.borrow_mut().add(name)
    });
    let (models, _) = parsed.map_err(|e| SceneError::invalid(file, "OBJ", e.to_string(), "Wavefront OBJ"))?;
    let libraries = libraries.into_inner();
    let mut scene =
        Scene { origin_file: origin_of(&models), warnings: libraries.warnings, ..Scene::default() };
    let mut images = Images { file, images: Vec::new() };
    for m in &libraries.materials {
        scene.materials.push(convert_material(&mut images, m, &mut scene.warnings)?);
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

/// The origin for what a file's shapes show, in the file's coordinates.
fn origin_of(models: &[tobj::Model]) -> DVec3 {
    let positions = models.iter().flat_map(|model| model.mesh.positions.as_chunks::<3>().0);
    let (min, max) = positions
        .map(|position| DVec3::from_array(*position))
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
    origin::origin_of(min, max)
}

/// The material libraries that a file names.
struct Libraries<'a> {
    file: &'a Path,
    read: &'a dyn Fn(&Path) -> Result<Vec<u8>, SceneError>,
    /// Of all libraries, in order: `tobj` counts materials through them.
    materials: Vec<MtlMaterial>,
    warnings: Vec<String>,
}

impl Libraries<'_> {
    /// Reads a library beside the scene; a missing one is not an error of the scene. To `tobj` materials are names.
    fn add(&mut self, name: &Path) -> tobj::MTLLoadResult {
        let path = self.file.parent().unwrap_or(Path::new("")).join(name);
        let bytes = (self.read)(&path).map_err(|e| {
            let reason = crate::error::one_line(&e.to_string());
            self.warnings.push(format!("materials cannot be read ({reason}); the default one is used"));
            tobj::LoadError::OpenFileFailed
        })?;
        let (materials, skipped) = mtl::parse(&path, &bytes);
        self.warnings.extend(skipped);
        let named = |m: &MtlMaterial| tobj::Material { name: m.name.clone(), ..tobj::Material::default() };
        let names = materials.iter().map(named).collect();
        let places = materials.iter().zip(0..).map(|(m, place)| (m.name.clone(), place)).collect();
        self.materials.extend(materials);
        Ok((names, places))
    }
}

/// Refuses indices of faces that no file can have: `tobj` multiplies them without a look at how far they reach, and panics.
///
/// Others that point beyond their list are found by `tobj`. Lines that are no UTF-8 end its reading, and so do they here.
fn check_indices(file: &Path, bytes: &[u8]) -> Result<(), SceneError> {
    let text = std::str::from_utf8(bytes)
        .unwrap_or_else(|e| std::str::from_utf8(&bytes[..e.valid_up_to()]).unwrap_or_default());
    let mut counts = [0i64; 3];
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => counts[0] += 1,
            Some("vt") => counts[1] += 1,
            Some("vn") => counts[2] += 1,
            Some("f" | "l") => {
                for (index, count) in words.flat_map(|word| word.split('/').zip(counts)) {
                    // What is short and has no sign reaches nowhere that `tobj` could not.
                    if index.len() < 10 && !index.starts_with('-') {
                        continue;
                    }
                    let Ok(value) = index.parse::<i64>() else { continue };
                    if value < -count || value > i64::from(u32::MAX) {
                        return Err(SceneError::invalid(
                            file,
                            format!("line {number}"),
                            format!("the index {value}"),
                            format!("{} to {}", -count, u32::MAX),
                        ));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
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
    m: &MtlMaterial,
    warnings: &mut Vec<String>,
) -> Result<Material, SceneError> {
    let unit = |v: f32| v.clamp(0.0, 1.0);
    let mut map = |text: Option<&String>| text.map_or(Ok(None), |t| images.texture(t));
    let alpha = m.dissolve.or(m.transparency.map(|t| 1.0 - t)).map_or(1.0, unit);
    let base_color_texture = map(m.diffuse_map.as_ref())?;
    let opacity_texture = m.dissolve_map.as_deref().and_then(texture_name);
    let alpha_mode = match opacity_texture {
        // a coverage map: nearly always a cut-out, and glTF's alpha comes with the colour
        Some(name) => {
            if m.diffuse_map.as_deref().and_then(texture_name) != Some(name) {
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
    let ke = m.emissive.unwrap_or([0.0; 3]).map(|v| v.max(0.0));
    let emissive_texture = map(m.emissive_map.as_ref())?;
    Ok(Material {
        name: m.name.clone(),
        base_color_factor: [kd[0], kd[1], kd[2], alpha],
        base_color_texture,
        metallic_factor: m.metalness.map_or(0.0, unit),
        roughness_factor: m.roughness.or(m.exponent.map(from_exponent)).map_or(1.0, unit),
        normal_texture: map(m.normal_map.as_ref().or(m.bump_map.as_ref()))?,
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
    let origin = scene.origin_file;
    let relative = |p: &[f64; 3]| (DVec3::from_array(*p) - origin).as_vec3().to_array();
    let mut positions_os: Vec<[f32; 3]> = mesh.positions.as_chunks::<3>().0.iter().map(relative).collect();
    if let Some(&worst) = indices.iter().max().filter(|m| **m as usize >= positions_os.len()) {
        return Err(invalid(format!("the index {worst}"), &format!("an index below {}", positions_os.len())));
    }
    let numbers = [&mesh.normals, &mesh.texcoords, &mesh.vertex_color].into_iter().flatten();
    let numbers = numbers.map(|number| *number as f32).chain(positions_os.as_flattened().iter().copied());
    if let Some(bad) = numbers.into_iter().find(|number| !number.is_finite()) {
        return Err(invalid(bad.to_string(), "finite numbers"));
    }
    // OBJ has v upwards, the scene model downwards
    let mut uvs: Vec<[f32; 2]> =
        mesh.texcoords.as_chunks::<2>().0.iter().map(|&[u, v]| [u as f32, 1.0 - v as f32]).collect();
    uvs.resize(positions_os.len(), [0.0; 2]);
    let three = |v: &[f64; 3]| v.map(|number| number as f32);
    let mut colors: Vec<[f32; 3]> = mesh.vertex_color.as_chunks::<3>().0.iter().map(three).collect();
    colors.resize(positions_os.len(), [1.0; 3]);
    let mut normals_os: Vec<[f32; 3]> = mesh.normals.as_chunks::<3>().0.iter().map(three).collect();
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
    let local = DAffine3::from_translation(scene.origin_file);
    scene.nodes.push(Node { name: name.clone(), parent: None, local });
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
    use std::path::Path;

    use proptest::prelude::*;

    use super::{load_with, texture_name};
    use crate::{Scene, SceneError};

    /// A file and the one library that it names.
    fn load_texts(obj: &[u8], mtl: &[u8]) -> Result<Scene, SceneError> {
        load_with(Path::new("scenes/a.obj"), obj, &|_| Ok(mtl.to_vec()))
    }

    const TRIANGLE: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl m\nf 1 2 3\n";

    /// Coordinates are divided by their fourth number, wherever the shape stands.
    #[test]
    fn positions_far_away_are_divided_by_their_weight() {
        let of = |vertices: &str| {
            let scene = load_texts(format!("{vertices}f 1 2 3\n").as_bytes(), b"").expect("a triangle");
            let place = |p: &[f32; 3]| scene.file_from_world((*p).into());
            scene.positions_os.iter().map(place).collect::<Vec<_>>()
        };
        let plain = of("v 1400000 1 2\nv 1400001 1 2\nv 1400000 2 2.5\n");
        let weighted = of("v 2800000 2 4 2\nv 1400001 1 2 1\nv 5600000 8 10 4\n");
        assert_eq!(plain, weighted);
        assert_eq!(plain[1] - plain[0], glam::DVec3::X);
    }

    #[test]
    fn a_library_with_rare_statements_keeps_its_materials() {
        let mtl = b"newmtl m\nKd 1\nKe spectral a.rfl\nd -halo 0.5\n";
        let scene = load_texts(TRIANGLE.as_bytes(), mtl).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            scene.materials[scene.meshes[0].material as usize].base_color_factor,
            [1.0, 1.0, 1.0, 0.5]
        );
        assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
        assert!(scene.warnings[0].contains("a.mtl: line 3") && scene.warnings[0].contains("spectral"));
    }

    #[test]
    fn indices_that_no_file_can_have_are_named() {
        for face in [
            "f 1/-2 2 3",
            "f 1//-2 2 3",
            "f -4 2 3",
            "f 1/9223372036854775807 2 3",
            "f 1//-9223372036854775808 2 3",
            "f 1//6148914691236517206 2 3",
            "l 1/4294967296 2",
        ] {
            let text = TRIANGLE.replace("f 1 2 3", face);
            let error = load_texts(text.as_bytes(), b"").expect_err(face).to_string();
            assert!(
                error.starts_with("scenes/a.obj: line 8: found the index ") && error.contains("expected"),
                "{error}"
            );
        }
    }

    /// Words of both formats, right ones and wrong ones.
    const WORDS: &[&str] = &[
        "v",
        "vt",
        "vn",
        "vp",
        "f",
        "l",
        "p",
        "o",
        "g",
        "s",
        "usemtl",
        "mtllib",
        "newmtl",
        "Ka",
        "Kd",
        "Ks",
        "Ke",
        "Tf",
        "Ns",
        "Ni",
        "d",
        "Tr",
        "Pm",
        "Pr",
        "illum",
        "sharpness",
        "map_d",
        "decal",
        "disp",
        "refl",
        "-halo",
        "spectral",
        "xyz",
        "m",
        "a.mtl",
        "b.mtl c.mtl",
        "\\",
        "\t",
        "#",
        "",
        "0",
        "1",
        "2",
        "3",
        "-1",
        "-2",
        "-3",
        "-9",
        "0.5",
        "nan",
        "inf",
        "-inf",
        "1e39",
        "1e-45",
        "1/1/1",
        "2//1",
        "3/1",
        "1/",
        "/1",
        "//",
        "-1/-1/-1",
        "1/-2/1",
        "1/1/1/1",
        "4294967295",
        "4294967296",
        "9223372036854775807",
        "-9223372036854775808",
        "6148914691236517206",
        "caf\u{e9}",
    ];

    /// Lines of both formats that say something.
    const LINES: &[&str] = &[
        "v 0 0 1",
        "v 1 1 0 0.5",
        "v 0 1 1 1 0 0",
        "vt 0.5 0.5",
        "vt 0.5 0.5 0.5",
        "vn 0 1 0",
        "o a",
        "g a b",
        "s off",
        "usemtl m",
        "usemtl n",
        "f 1 2 3",
        "f 1/1 2/1 3/1 1/1",
        "f -1 -2 -3",
        "f 1//1 2//1 3//1",
        "f 1/1/1 2 3",
        "l 1 2",
        "p 1",
        "f 1 1 1",
        "mtllib b.mtl",
        "newmtl m",
        "newmtl n",
        "Kd 0.5",
        "Kd 1 0 0",
        "Ke 2",
        "d 0.5",
        "d -halo 0.1",
        "Tr 1",
        "Ns 10",
        "Ns -1",
        "Pm 0.5",
        "Pr 2",
        "illum 2",
        "Kd xyz 1 1 1",
        "Kd 1e38 1e38 1e38",
        "map_Kd",
        "norm",
    ];

    fn line() -> impl Strategy<Value = String> {
        let words =
            prop::collection::vec(prop::sample::select(WORDS), 0..7).prop_map(|words| words.join(" "));
        prop_oneof![3 => prop::sample::select(LINES).prop_map(str::to_owned), 1 => words]
    }

    /// Lines right and wrong, bytes of any kind between them.
    fn text(start: &'static str) -> impl Strategy<Value = Vec<u8>> {
        let damage = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..3);
        (prop::collection::vec(line(), 0..10), damage).prop_map(move |(lines, damage)| {
            let mut bytes = format!("{start}{}\n", lines.join("\n")).into_bytes();
            for (at, byte) in damage {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            bytes
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn any_lines_of_a_library_end_in_a_scene_or_an_error(mtl in text("newmtl m\n")) {
            match load_texts(TRIANGLE.as_bytes(), &mtl) {
                Ok(scene) => {
                    let m = &scene.materials[scene.meshes[0].material as usize];
                    let factors = m.base_color_factor.iter().chain(&m.emissive_factor);
                    prop_assert!(factors.chain([&m.metallic_factor, &m.roughness_factor]).all(|v| v.is_finite()));
                    prop_assert!(scene.warnings.iter().all(|w| !w.contains('\n')), "{:?}", scene.warnings);
                }
                Err(e) => prop_assert!(!e.to_string().contains('\n'), "{e}"),
            }
        }

        #[test]
        fn any_lines_of_a_file_end_in_a_scene_or_an_error(obj in text(&TRIANGLE[..TRIANGLE.len() - 8])) {
            match load_texts(&obj, b"newmtl m\nKd 1\nmap_Kd\n") {
                Ok(scene) => prop_assert!(scene.positions_os.iter().flatten().all(|v| v.is_finite())),
                Err(e) => prop_assert!(!e.to_string().contains('\n'), "{e}"),
            }
        }
    }

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
