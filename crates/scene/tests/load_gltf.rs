//! glTF made by the tests themselves: what goes in comes out.

mod load_common;

use afterlight_scene::{AlphaMode, LightKind, LoadOptions, MipMode, Projection, Scene, Wrap, load_bytes};
use glam::{Mat4, Quat, Vec3, Vec4};
use load_common::Document;
use proptest::prelude::*;
use serde_json::json;
use std::path::Path;

const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn triangle() -> Document {
    let mut d = Document::new();
    let positions = d.floats(&TRIANGLE);
    d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": positions}}]}]);
    d
}

/// Component types of unsigned integers by their bytes less one.
const INDEX_TYPES: [u32; 4] = [5121, 5123, 0, 5125];

/// Positions of the corners of mesh 0, in order.
fn corners(scene: &Scene) -> Vec<[f32; 3]> {
    let mesh = &scene.meshes[0];
    let indices = &scene.indices[mesh.first_index as usize..(mesh.first_index + mesh.index_count) as usize];
    indices.iter().map(|&i| scene.positions_os[(mesh.first_vertex + i) as usize]).collect()
}

/// The same in the coordinates of the file, where the instance has them.
fn corners_in_file(scene: &Scene) -> Vec<[f32; 3]> {
    let world_from_object = scene.instances[0].world_from_object;
    let place = |p: [f32; 3]| scene.file_from_world(world_from_object.transform_point3(p.into()));
    corners(scene).into_iter().map(|p| place(p).as_vec3().to_array()).collect()
}

fn point() -> impl Strategy<Value = [f32; 3]> {
    prop::array::uniform3(-100.0f32..100.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn strides_offsets_and_sparse_values(
        points in prop::collection::vec(point(), 3..40),
        padding_words in 0usize..5,
        offset_words in 0usize..3,
        patches in prop::collection::btree_map(0usize..40, point(), 0..6),
        with_view in any::<bool>(),
        index_width in prop::sample::select(vec![1usize, 2, 4]),
    ) {
        let stride = 12 + 4 * padding_words;
        let mut expected = if with_view { points.clone() } else { vec![[0.0; 3]; points.len()] };
        let mut d = Document::new();
        let mut accessor = json!({"componentType": 5126, "count": points.len(), "type": "VEC3"});
        if with_view {
            let mut bytes = vec![0xEE; 4 * offset_words];
            for p in &points {
                bytes.extend_from_slice(bytemuck::cast_slice(p));
                bytes.extend(vec![0xEE; stride - 12]);
            }
            // the last element needs no padding
            bytes.truncate(bytes.len() - (stride - 12));
            let view = d.view(&bytes, Some(stride));
            accessor["bufferView"] = json!(view);
            accessor["byteOffset"] = json!(4 * offset_words);
        }
        let patches: Vec<(usize, [f32; 3])> = patches.into_iter().filter(|p| p.0 < points.len()).collect();
        if !patches.is_empty() {
            let indices: Vec<u8> = patches.iter().flat_map(|p| (p.0 as u32).to_le_bytes()[..index_width].to_vec()).collect();
            let values: Vec<[f32; 3]> = patches.iter().map(|p| p.1).collect();
            let (iv, vv) = (d.view(&indices, None), d.view(bytemuck::cast_slice(&values), None));
            accessor["sparse"] = json!({
                "count": patches.len(),
                "indices": {"bufferView": iv, "componentType": INDEX_TYPES[index_width - 1]},
                "values": {"bufferView": vv},
            });
            patches.iter().for_each(|&(i, p)| expected[i] = p);
        }
        let positions = d.accessor(accessor);
        d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": positions}}]}]);
        let scene = d.load().unwrap();
        prop_assert_eq!(corners(&scene), &expected[..expected.len() / 3 * 3]);
        prop_assert_eq!(scene.warnings.len(), usize::from(points.len() % 3 != 0));
    }

    #[test]
    fn modes_and_index_widths(
        indices in prop::collection::vec(0u32..50, 3..40),
        width in prop::sample::select(vec![1usize, 2, 4]),
        mode in 4u32..7,
        with_normals in any::<bool>(),
    ) {
        let points: Vec<[f32; 3]> = (0..50).map(|i| [i as f32, (i * i % 7) as f32, 0.5]).collect();
        let mut d = Document::new();
        let mut attributes = json!({"POSITION": d.floats(&points)});
        if with_normals {
            attributes["NORMAL"] = json!(d.floats(&[[0.0, 1.0, 0.0]; 50]));
        }
        let accessor = d.indices(&indices, width);
        d.json["meshes"] = json!([{"primitives": [{"attributes": attributes, "indices": accessor, "mode": mode}]}]);
        let n = indices.len();
        // the rules of the specification, one triangle at a time
        let expected: Vec<u32> = match mode {
            4 => indices[..n / 3 * 3].to_vec(),
            5 => (0..n - 2).flat_map(|i| if i % 2 == 0 { [i, i + 1, i + 2] } else { [i, i + 2, i + 1] }).map(|i| indices[i]).collect(),
            _ => (0..n - 2).flat_map(|i| [i + 1, i + 2, 0]).map(|i| indices[i]).collect(),
        };
        let expected: Vec<[f32; 3]> = expected.iter().map(|&i| points[i as usize]).collect();
        prop_assert_eq!(corners(&d.load().unwrap()), expected);
    }

    #[test]
    fn quantised_positions(
        raw in prop::collection::vec(any::<[u16; 3]>(), 3..20),
        kind in 0usize..4,
        normalized in any::<bool>(),
    ) {
        let mut d = Document::new();
        d.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        d.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let mut bytes = Vec::new();
        let mut expected = Vec::new();
        for v in &raw {
            let mut point = [0.0; 3];
            for (p, &c) in point.iter_mut().zip(v) {
                let (value, limit) = match kind {
                    0 => (f32::from(c as i8), 127.0),
                    1 => (f32::from(c as u8), 255.0),
                    2 => (f32::from(c as i16), 32767.0),
                    _ => (f32::from(c), 65535.0),
                };
                *p = if normalized { (value / limit).max(-1.0) } else { value };
                bytes.extend_from_slice(&c.to_le_bytes()[..if kind < 2 { 1 } else { 2 }]);
            }
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            expected.push(point);
        }
        let view = d.view(&bytes, Some(if kind < 2 { 4 } else { 8 }));
        let positions = d.accessor(json!({
            "bufferView": view, "componentType": 5120 + kind, "normalized": normalized, "count": raw.len(), "type": "VEC3",
        }));
        d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": positions}}]}]);
        prop_assert_eq!(corners_in_file(&d.load().unwrap()), &expected[..raw.len() / 3 * 3]);
        d.json["extensionsUsed"] = json!([]);
        d.json["extensionsRequired"] = json!([]);
        let text = d.load().unwrap_err().to_string();
        prop_assert!(text.contains("KHR_mesh_quantization"), "{}", text);
    }

    #[test]
    fn mirrored_hierarchies(
        chain in prop::collection::vec((point(), prop::array::uniform4(0.1f32..1.0), prop::array::uniform3(prop::sample::select(vec![-2.0f32, -1.0, 0.5, 3.0])), any::<bool>()), 1..6),
    ) {
        let mut d = triangle();
        let mut expected = Mat4::IDENTITY;
        let mut mirrored = false;
        let mut nodes = Vec::new();
        for (i, (t, r, s, as_matrix)) in chain.iter().enumerate() {
            let rotation = Quat::from_array(*r).normalize();
            let local = Mat4::from_scale_rotation_translation((*s).into(), rotation, (*t).into());
            let mut node = if *as_matrix {
                json!({"matrix": local.to_cols_array()})
            } else {
                json!({"translation": t, "rotation": rotation.to_array(), "scale": s})
            };
            if i + 1 < chain.len() { node["children"] = json!([i + 1]) } else { node["mesh"] = json!(0) }
            nodes.push(node);
            expected *= local;
            mirrored ^= s.iter().filter(|v| **v < 0.0).count() % 2 == 1;
        }
        d.json["nodes"] = json!(nodes);
        let scene = d.load().unwrap();
        let world = scene.instances[0].world_from_object;
        prop_assert_eq!(world.matrix3.determinant() < 0.0, mirrored);
        for p in TRIANGLE {
            let a = scene.file_from_world(world.transform_point3(p.into())).as_vec3();
            let b = expected.transform_point3(p.into());
            prop_assert!((a - b).length() <= 1e-4 * (1.0 + b.length()), "{} {}", a, b);
        }
    }

    #[test]
    fn missing_normals_are_flat(points in prop::collection::vec(point(), 3..12)) {
        let mut d = Document::new();
        let positions = d.floats(&points);
        d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": positions}}]}]);
        let scene = d.load().unwrap();
        for (k, t) in points.chunks_exact(3).enumerate() {
            let [a, b, c] = [t[0], t[1], t[2]].map(Vec3::from);
            let normal = (b - a).cross(c - a).normalize();
            for i in 0..3 {
                prop_assert!((scene.attributes[3 * k + i].normal_os() - normal).length() < 1e-3);
            }
        }
    }
}

#[test]
fn colours_of_every_form() {
    for (component, normalized, bytes, expected) in [
        (5121, true, vec![255u8, 128, 0, 51], [255, 128, 0, 51]),
        (5123, true, vec![255, 255, 128, 128, 0, 0, 51, 51], [255, 128, 0, 51]),
        (
            5126,
            false,
            [1.0f32, 0.5, 0.0, 2.0].iter().flat_map(|f| f.to_le_bytes()).collect(),
            [255, 128, 0, 255],
        ),
    ] {
        for width in [3, 4] {
            let mut d = triangle();
            let used = bytes.len() / 4 * width;
            let stride = used.next_multiple_of(4);
            let mut all = Vec::new();
            for _ in 0..3 {
                all.extend_from_slice(&bytes[..used]);
                all.resize(all.len().next_multiple_of(stride), 0);
            }
            let view = d.view(&all, Some(stride));
            let colors = d.accessor(json!({
                "bufferView": view, "componentType": component, "normalized": normalized, "count": 3, "type": format!("VEC{width}"),
            }));
            d.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
            let [r, g, b, a] = expected;
            let a = if width == 3 { 255 } else { a };
            let packed = d.load().unwrap().attributes[1].color_rgba8;
            assert_eq!(packed.to_le_bytes(), [r, g, b, a], "component {component}, {width} wide");
        }
    }
}

#[test]
fn materials_and_textures() {
    let mut d = triangle();
    let png: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x08\0\0\0\x04\x08\x02\0\0\0";
    let view = d.view(png, None);
    let uv = d.floats(&[[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    d.json["images"] =
        json!([{"uri": "unused.png"}, {"bufferView": view, "mimeType": "image/png", "name": "one"}]);
    d.json["samplers"] = json!([{"magFilter": 9728, "minFilter": 9985, "wrapS": 33071, "wrapT": 33648}]);
    d.json["textures"] = json!([{"source": 1, "sampler": 0}, {"source": 1}]);
    d.json["extensionsUsed"] = json!(["KHR_texture_transform", "VENDOR_thing"]);
    let transform = json!({"KHR_texture_transform": {"offset": [0.25, 0.5], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2.0, 3.0], "texCoord": 1}});
    d.json["materials"] = json!([{
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "baseColorTexture": {"index": 0}, "metallicFactor": 0.5, "roughnessFactor": 0.25,
            "metallicRoughnessTexture": {"index": 1, "extensions": transform}},
        "normalTexture": {"index": 1, "scale": 0.5, "extensions": transform},
        "occlusionTexture": {"index": 1, "strength": 0.75},
        "emissiveFactor": [1.0, 0.5, 0.0],
        "alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}, "KHR_materials_unlit": {}},
    }]);
    d.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    d.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    let scene = d.load().unwrap();
    let m = &scene.materials[0];
    assert_eq!(scene.images.len(), 1, "an image that nothing uses is left out");
    assert_eq!((scene.images[0].width, scene.images[0].height), (8, 4));
    assert_eq!(
        (m.base_color_factor, m.metallic_factor, m.roughness_factor),
        ([0.1, 0.2, 0.3, 0.4], 0.5, 0.25)
    );
    assert_eq!((m.alpha_mode, m.double_sided, m.unlit), (AlphaMode::Mask { cutoff: 0.3 }, true, true));
    assert_eq!((m.emissive_factor, m.normal_scale, m.occlusion_strength), ([4.0, 2.0, 0.0], 0.5, 0.75));
    let base = m.base_color_texture.unwrap();
    assert_eq!(
        (base.sampler.mag_nearest, base.sampler.min_nearest, base.sampler.mip),
        (true, false, MipMode::Nearest)
    );
    assert_eq!((base.sampler.wrap_u, base.sampler.wrap_v), (Wrap::Clamp, Wrap::Mirror));
    assert_eq!((base.uv_set, base.uv_transform), (0, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
    // counter-clockwise by a quarter: u' = 3 v + 0.25, v' = -2 u + 0.5
    for t in [m.metallic_roughness_texture.unwrap(), m.normal_texture.unwrap()] {
        assert_eq!(t.uv_set, 1);
        let expected = [[0.0, 3.0, 0.25], [-2.0, 0.0, 0.5]];
        let off = t.uv_transform.iter().flatten().zip(expected.iter().flatten());
        assert!(off.into_iter().all(|(a, b): (&f32, &f32)| (a - b).abs() < 1e-6), "{:?}", t.uv_transform);
    }
    assert!(scene.warnings.iter().any(|w| w.contains("VENDOR_thing")), "{:?}", scene.warnings);

    d.json["extensionsRequired"] = json!(["VENDOR_thing"]);
    assert!(d.load().unwrap_err().to_string().contains("VENDOR_thing"));
}

#[test]
fn lights_and_cameras() {
    let mut d = triangle();
    d.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    d.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "color": [1.0, 0.5, 0.25], "intensity": 8.0, "range": 5.0, "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}},
        {"type": "directional"},
    ]}});
    d.json["cameras"] = json!([
        {"type": "perspective", "name": "eye", "perspective": {"yfov": 0.75, "znear": 0.125}},
        {"type": "orthographic", "orthographic": {"xmag": 2.0, "ymag": 3.0, "znear": 0.0, "zfar": 10.0}},
    ]);
    let turn = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2).to_array();
    d.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    d.json["nodes"] = json!([
        {"mesh": 0},
        {"translation": [1.0, 2.0, 3.0], "rotation": turn, "scale": [2.0, -2.0, 2.0], "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"name": "flat", "camera": 1, "extensions": {"KHR_lights_punctual": {"light": 1}}},
    ]);
    let scene = d.load().unwrap();
    let spot = scene.lights[0];
    assert_eq!(spot.kind, LightKind::Spot { inner_angle_rad: 0.25, outer_angle_rad: 0.5 });
    assert_eq!(
        (spot.position_ws, spot.intensity, spot.range_m),
        (Vec3::new(1.0, 2.0, 3.0), Vec3::new(8.0, 4.0, 2.0), 5.0)
    );
    assert!((spot.direction_ws - Vec3::NEG_X).length() < 1e-6);
    assert_eq!((scene.lights[1].kind, scene.lights[1].range_m), (LightKind::Directional, f32::INFINITY));
    let eye = &scene.cameras[0];
    assert_eq!(
        (&*eye.name, eye.projection),
        ("eye", Projection::Perspective { fov_y_rad: 0.75, near_m: 0.125 })
    );
    let m = eye.world_from_view.matrix3;
    assert!(
        (m.determinant() - 1.0).abs() < 1e-5 && (Vec3::from(m.z_axis) - Vec3::X).length() < 1e-5,
        "{m:?}"
    );
    assert_eq!(
        scene.cameras[1].projection,
        Projection::Orthographic { half_height_m: 3.0, near_m: 0.0, far_m: 10.0 }
    );
}

#[test]
fn animation_poses_nodes() {
    let mut d = triangle();
    let times = d.floats(&[[0.0f32], [1.0], [2.0]]);
    let places = d.floats(&[[0.0f32, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 4.0, 0.0]]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turns = d.floats(&[[0.0f32, 0.0, 0.0, 1.0], [0.0, 0.0, half, half], [0.0, 0.0, 1.0, 0.0]]);
    // in-tangent, value, out-tangent a key: slope 3 at the start of the first piece, 0 elsewhere
    let z = [0.0f32; 3];
    let spline =
        d.floats(&[z, [1.0, 1.0, 1.0], [3.0, 0.0, 0.0], z, [1.0, 1.0, 1.0], z, z, [2.0, 1.0, 1.0], z]);
    d.json["nodes"][0]["translation"] = json!([0.0, 0.0, 7.0]);
    let channel =
        |sampler: usize, path: &str| json!({"sampler": sampler, "target": {"node": 0, "path": path}});
    d.json["animations"] = json!([{
        "samplers": [
            {"input": times, "output": places},
            {"input": times, "output": turns},
            {"input": times, "output": spline, "interpolation": "CUBICSPLINE"},
        ],
        "channels": [channel(0, "translation"), channel(1, "rotation"), channel(2, "scale"), {"sampler": 0, "target": {"path": "scale"}}],
    }]);
    let place = |scene: &Scene| scene.instances[0].world_from_object;
    let rest = d.load().unwrap();
    assert_eq!(place(&rest).translation, Vec3::new(0.0, 0.0, 7.0).into());
    let posed = d.load_at(Some(0.5)).unwrap();
    let (s, r, t) = place(&posed).to_scale_rotation_translation();
    assert!((t - Vec3::new(1.0, 0.0, 0.0)).length() < 1e-6, "{t}");
    assert!(r.angle_between(Quat::from_rotation_z(std::f32::consts::FRAC_PI_4)) < 1e-3, "{r}");
    // Hermite at 0.5 with start slope 3: 1 + 3/8
    assert!((s.x - 1.375).abs() < 1e-5 && (s.y - 1.0).abs() < 1e-5, "{s}");
    // a later time, wrapped around
    let mut again = d.load().unwrap();
    again.pose(2.0 * 2.0 + 1.5);
    let t = Vec3::from(place(&again).translation);
    assert!((t - Vec3::new(2.0, 2.0, 0.0)).length() < 1e-5, "{t}");
    assert_eq!(place(&again), place(&d.load_at(Some(1.5)).unwrap()));
    d.json["animations"][0]["samplers"][0]["interpolation"] = json!("STEP");
    assert_eq!(place(&d.load_at(Some(1.5)).unwrap()).translation.x, 2.0);
}

#[test]
fn compressed_views_decode() {
    let points: Vec<[f32; 3]> = (0..300).map(|i| [(i % 17) as f32, (i / 17) as f32, 0.0]).collect();
    let indices: Vec<u32> = (0..280u32).flat_map(|i| [i, i + 1, i + 17]).collect();
    let vertex_bytes = meshopt::encode_vertex_buffer(&points).unwrap();
    let index_bytes = meshopt::encode_index_buffer(&indices, points.len()).unwrap();
    let mut d = Document::new();
    d.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    let mut compressed = |bytes: &[u8], count: usize, stride: usize, mode: &str| {
        let view = d.view(bytes, None);
        let json = d.view_json(view);
        let offset = json["byteOffset"].clone();
        json["extensions"] = json!({"EXT_meshopt_compression": {"buffer": 0, "byteOffset": offset, "byteLength": bytes.len(), "byteStride": stride, "count": count, "mode": mode}});
        json["byteOffset"] = json!(0);
        json["byteLength"] = json!(count * stride);
        view
    };
    let (pv, iv) =
        (compressed(&vertex_bytes, 300, 12, "ATTRIBUTES"), compressed(&index_bytes, 840, 4, "TRIANGLES"));
    // what decoded views stand for lies in a buffer that need not exist; here the first is long enough
    d.view(&[0; 4096], None);
    let p = d.accessor(json!({"bufferView": pv, "componentType": 5126, "count": 300, "type": "VEC3"}));
    let i = d.accessor(json!({"bufferView": iv, "componentType": 5125, "count": 840, "type": "SCALAR"}));
    d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": p}, "indices": i}]}]);
    let expected: Vec<[f32; 3]> = indices.iter().map(|&i| points[i as usize]).collect();
    // the codec keeps triangles and their winding, and may turn them
    let sorted = |c: Vec<[f32; 3]>| {
        let mut triangles: Vec<Vec<[f32; 3]>> = c.chunks_exact(3).map(<[_]>::to_vec).collect();
        for t in &mut triangles {
            let least = (0..3).min_by(|&a, &b| t[a].partial_cmp(&t[b]).unwrap()).unwrap();
            t.rotate_left(least);
        }
        triangles.sort_by(|a, b| a.partial_cmp(b).unwrap());
        triangles
    };
    assert_eq!(sorted(corners(&d.load().unwrap())), sorted(expected));

    for (property, value, part) in [
        ("byteLength", json!(10), "do not decode"),
        ("byteStride", json!(6), "count 300 of stride 6"),
        ("count", json!(299), "count 299"),
        ("mode", json!("SPLINES"), "SPLINES"),
        ("filter", json!("OCTAHEDRAL"), "OCTAHEDRAL"),
        ("buffer", json!(9), "expected 0 to 0"),
        ("byteOffset", json!(u64::MAX), "range"),
    ] {
        let extension = &mut d.view_json(pv)["extensions"]["EXT_meshopt_compression"];
        let before = extension.clone();
        extension[property] = value;
        let text = d.load().unwrap_err().to_string();
        assert!(text.contains(part), "{property}: {text}");
        d.view_json(pv)["extensions"]["EXT_meshopt_compression"] = before;
    }
}

#[test]
fn filters_decode() {
    let directions: Vec<[f32; 4]> = (0..64)
        .map(|i| Quat::from_rotation_y(i as f32).mul_vec3(Vec3::new(0.6, 0.0, 0.8)).extend(0.0).to_array())
        .collect();
    let encoded = meshopt::encode_filter_oct::<i8>(&directions, 8);
    let bytes = meshopt::encode_vertex_buffer(&encoded).unwrap();
    let mut d = Document::new();
    d.json["extensionsRequired"] = json!(["EXT_meshopt_compression", "KHR_mesh_quantization"]);
    let view = d.view(&bytes, Some(4));
    let json = d.view_json(view);
    let offset = json["byteOffset"].clone();
    json["extensions"] = json!({"EXT_meshopt_compression": {"buffer": 0, "byteOffset": offset, "byteLength": bytes.len(), "byteStride": 4, "count": 64, "mode": "ATTRIBUTES", "filter": "OCTAHEDRAL"}});
    json["byteLength"] = json!(256);
    d.view(&[0; 256], None);
    let p = d.floats(&[[0.0f32; 3]; 64]);
    let n = d.accessor(
        json!({"bufferView": view, "componentType": 5120, "normalized": true, "count": 64, "type": "VEC3"}),
    );
    d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": p, "NORMAL": n}}]}]);
    let scene = d.load().unwrap();
    for (a, b) in scene.attributes.iter().zip(&directions) {
        assert!((a.normal_os() - Vec4::from(*b).truncate()).length() < 0.03);
    }
}

#[test]
fn every_truncation_of_a_glb_is_an_error() {
    let bytes = triangle().glb();
    for end in 0..bytes.len() {
        let result = load_bytes(Path::new("cut.glb"), &bytes[..end], &LoadOptions::default());
        let text = result.err().unwrap_or_else(|| panic!("{end} of {} bytes load", bytes.len())).to_string();
        assert!(text.starts_with("cut.glb") && !text.contains('\n'), "{text}");
    }
}

#[test]
fn bad_values_are_one_line_errors() {
    let change = |f: &dyn Fn(&mut Document)| {
        let mut d = triangle();
        f(&mut d);
        d.load().err().map(|e| e.to_string()).unwrap_or_default()
    };
    type Case<'a> = (&'a str, &'a dyn Fn(&mut Document));
    let cases: &[Case] = &[
        ("NaN", &|d| {
            let p = d.floats(&[[f32::NAN, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
            d.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(p);
        }),
        ("found 3, expected an index below 3", &|d| {
            let i = d.indices(&[0, 1, 3], 2);
            d.json["meshes"][0]["primitives"][0]["indices"] = json!(i);
        }),
        ("own descendants", &|d| d.json["nodes"] = json!([{"children": [1]}, {"children": [0]}])),
        ("a child of node 0 already", &|d| {
            d.json["nodes"] = json!([{"children": [2]}, {"children": [2]}, {"mesh": 0}])
        }),
        ("found 7, expected 0 to 0", &|d| d.json["nodes"][0]["mesh"] = json!(7)),
        ("finite", &|d| d.json["nodes"][0]["translation"] = json!([1e39, 0.0, 0.0])),
        ("a range within", &|d| {
            let a = d.accessor(
                json!({"bufferView": 0, "componentType": 5126, "count": 1u64 << 60, "type": "VEC3"}),
            );
            d.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(a);
        }),
        ("at most 16777216", &|d| {
            let a = d.accessor(json!({"componentType": 5126, "count": 1u64 << 40, "type": "VEC3"}));
            d.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(a);
        }),
        ("vertices: found 480000000, expected at most 4194304", &|d| {
            let a = d.accessor(json!({"componentType": 5126, "count": 16_000_000, "type": "VEC3"}));
            d.json["meshes"] = json!([{"primitives": vec![json!({"attributes": {"POSITION": a}}); 30]}]);
        }),
        ("0 bytes", &|d| {
            d.json["images"] = json!([{"uri": "data:image/png;base64,"}]);
            d.json["textures"] = json!([{"source": 0}]);
            d.json["materials"] = json!([{"normalTexture": {"index": 0}}]);
        }),
        ("nothing.png", &|d| {
            d.json["images"] = json!([{"uri": "nothing.png"}]);
            d.json["textures"] = json!([{"source": 0}]);
            d.json["materials"] = json!([{"normalTexture": {"index": 0}}]);
        }),
        ("recursion limit", &|d| {
            let mut deep = json!(1);
            (0..200).for_each(|_| deep = json!([deep]));
            d.json["extensions"] = json!({"DEEP": deep});
        }),
    ];
    for (part, f) in cases {
        let text = change(f);
        assert!(text.contains(part) && !text.contains('\n'), "{part}: {text:?}");
    }
}

#[test]
fn uris_are_decoded() {
    let dir = tempfile::tempdir().unwrap();
    let bytes: Vec<u8> = TRIANGLE.iter().flatten().flat_map(|f| f.to_le_bytes()).collect();
    std::fs::create_dir(dir.path().join("a b")).unwrap();
    std::fs::write(dir.path().join("a b/größe#1.bin"), &bytes).unwrap();
    let json = |uri: &str| {
        json!({
            "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": uri}],
        })
        .to_string()
    };
    let load =
        |uri: &str| load_bytes(&dir.path().join("s.GLTF"), json(uri).as_bytes(), &LoadOptions::default());
    use base64::Engine;
    let base64 = base64::engine::general_purpose::STANDARD.encode(&bytes);
    for uri in [
        "a%20b/gr%C3%B6%C3%9Fe%231.bin",
        "a b/größe#1.bin",
        &format!("data:application/octet-stream;base64,{base64}"),
    ] {
        assert_eq!(corners(&load(uri).unwrap()), TRIANGLE, "{uri}");
    }
    for uri in [
        "https://example.org/a.bin",
        "a%2",
        "",
        "//host/a.bin",
        "data:text/plain;base64,AAAA",
        "data:",
        "a b",
    ] {
        let text = load(uri).unwrap_err().to_string();
        assert!(!text.contains('\n'), "{uri}: {text}");
    }
}

#[test]
fn morph_targets_and_skins_take_their_rest_pose() {
    let mut d = triangle();
    let lift = d.floats(&[[0.0f32, 0.0, 2.0]; 3]);
    d.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": lift}]);
    d.json["meshes"][0]["weights"] = json!([0.5]);
    let scene = d.load().unwrap();
    assert!(corners(&scene).iter().all(|p| p[2] == 1.0));
    assert_eq!((scene.deformations.len(), &scene.rest_weights[..]), (1, &[0.5f32][..]));

    let mut d = triangle();
    let joints = d.view(&[0u8, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0], None);
    let joints = d.accessor(json!({"bufferView": joints, "componentType": 5121, "count": 3, "type": "VEC4"}));
    let weights = d.floats(&[[0.5f32, 0.5, 0.0, 0.0]; 3]);
    let attributes = &mut d.json["meshes"][0]["primitives"][0]["attributes"];
    (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(joints), json!(weights));
    d.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    // the skinned node's own place does not count
    d.json["nodes"] = json!([{"mesh": 0, "skin": 0, "translation": [99.0, 0.0, 0.0]}, {"translation": [2.0, 0.0, 0.0]}, {"translation": [0.0, 4.0, 0.0]}]);
    d.json["skins"] = json!([{"joints": [1, 2]}]);
    let scene = d.load().unwrap();
    assert_eq!(scene.instances[0].world_from_object, glam::Affine3A::IDENTITY);
    let moved: Vec<[f32; 3]> = TRIANGLE.iter().map(|p| [p[0] + 1.0, p[1] + 2.0, p[2]]).collect();
    assert_eq!(corners(&scene), moved);
}

#[test]
fn a_vertex_stream_is_shared_by_its_primitives() {
    let mut d = Document::new();
    let p = d.floats(&[[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    let n = d.floats(&[[0.0f32, 0.0, 1.0]; 4]);
    let (a, b) = (d.indices(&[0, 1, 2], 1), d.indices(&[2, 1, 3], 1));
    let primitive = |i: usize| json!({"attributes": {"POSITION": p, "NORMAL": n}, "indices": i});
    d.json["meshes"] = json!([{"primitives": [primitive(a), primitive(b)]}]);
    let scene = d.load().unwrap();
    assert_eq!((scene.positions_os.len(), scene.meshes.len(), scene.instances.len()), (4, 2, 2));
    assert_eq!(scene.meshes[0].first_vertex, scene.meshes[1].first_vertex);
}
