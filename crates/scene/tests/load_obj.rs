//! OBJ and MTL.

mod load_common;

use std::path::Path;

use afterlight_scene::{AlphaMode, LoadOptions, load, load_bytes};
use glam::Vec3;
use load_common::check_scene;

const QUAD: &str = "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl leaf\nf 1/1 2/2 3/3 4/4\n";

#[test]
fn quad_with_materials() {
    let dir = tempfile::tempdir().unwrap();
    let mtl = "newmtl leaf\nKd 0.5 0.25 1\nKe 0 0 2\nPr 0.375\nPm 0.5\nmap_Kd -s 1 1 1 leaf.png\nnorm leaf.png\nmap_d leaf.png\nnewmtl glass\nd 0.25\nNs 30\n";
    let png: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x08\0\0\0\x04\x08\x02\0\0\0";
    std::fs::write(dir.path().join("quad.mtl"), mtl).unwrap();
    std::fs::write(dir.path().join("leaf.png"), png).unwrap();
    std::fs::write(dir.path().join("quad.obj"), QUAD).unwrap();
    let scene = load(&dir.path().join("quad.obj"), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    check_scene(&scene).unwrap();
    assert_eq!((scene.triangle_count(), scene.images.len()), (2, 1));
    let leaf = &scene.materials[0];
    assert_eq!(
        (leaf.base_color_factor, leaf.metallic_factor, leaf.roughness_factor),
        ([0.5, 0.25, 1.0, 1.0], 0.5, 0.375)
    );
    assert_eq!((leaf.alpha_mode, leaf.emissive_factor), (AlphaMode::Mask { cutoff: 0.5 }, [0.0, 0.0, 2.0]));
    assert!(leaf.base_color_texture.is_some() && leaf.normal_texture.is_some());
    let glass = &scene.materials[1];
    assert_eq!((glass.alpha_mode, glass.base_color_factor[3]), (AlphaMode::Blend, 0.25));
    assert!((glass.roughness_factor - 0.5).abs() < 1e-6, "(2 / 32)^(1/4)");
    for a in &scene.attributes {
        assert!((a.normal_os() - Vec3::Z).length() < 1e-4);
        let (tangent, sign) = a.tangent_os();
        assert!((tangent - Vec3::X).length() < 1e-3 && sign == 1.0, "{tangent} {sign}");
    }
    // v points down
    assert_eq!(scene.attributes[0].uv(0).y, 1.0);
}

#[test]
fn missing_materials_are_a_warning_and_nonsense_an_error() {
    let options = LoadOptions::default();
    let scene = load_bytes(Path::new("alone/quad.OBJ"), QUAD.as_bytes(), &options).unwrap();
    assert_eq!((scene.triangle_count(), scene.materials.len(), scene.warnings.len()), (2, 1, 1));
    for text in [
        "v 0 0\nf 1 2 3\n",
        "v 0 0 0\nf 1 2 3\n",
        "v nan 0 0\nv 0 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 0\nvt 0 0\nf 1/9 1/9 1/9\n",
        "f -1 -2 -3\n",
    ] {
        let error = load_bytes(Path::new("bad.obj"), text.as_bytes(), &options).expect_err(text).to_string();
        assert!(error.starts_with("bad.obj") && !error.contains('\n'), "{error}");
    }
}

#[test]
fn names_without_a_known_format_are_refused() {
    for name in ["scene.fbx", "scene", "scene."] {
        let error = load(Path::new(name), &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.starts_with(name) && error.contains(".gltf"), "{error}");
    }
    let error = load(Path::new("missing.gltf"), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.starts_with("missing.gltf: cannot be read"), "{error}");
}
