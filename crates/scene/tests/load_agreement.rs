//! Both forms of San Miguel are the same scene up to quantisation, and the reference scenes have
//! the counts that their notes state.

mod load_common;

use afterlight_scene::{LoadOptions, Mesh, Scene, load};
use glam::Vec3;
use load_common::{check_scene, scenes_dir};

fn load_scene(name: &str) -> Option<Scene> {
    let scene = load(&scenes_dir()?.join(name), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    check_scene(&scene).unwrap_or_else(|e| panic!("{name}: {e}"));
    Some(scene)
}

#[test]
fn sponza_is_whole() {
    let Some(scene) = load_scene("sponza/sponza.gltf") else { return };
    assert_eq!(scene.triangle_count(), 262_267);
    assert_eq!((scene.instances.len(), scene.materials.len(), scene.images.len()), (25, 25, 64));
    let masked =
        |m: &&afterlight_scene::Material| matches!(m.alpha_mode, afterlight_scene::AlphaMode::Mask { .. });
    assert_eq!(scene.materials.iter().filter(masked).count(), 3);
    // given tangents are kept: at right angles to the normals, with both handednesses
    let signs: Vec<f32> = scene.attributes.iter().map(|a| a.tangent_os().1).collect();
    assert!(signs.contains(&1.0) && signs.contains(&-1.0));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn both_forms_of_san_miguel_agree() {
    let (Some(plain), Some(packed)) =
        (load_scene("san_miguel/san_miguel.gltf"), load_scene("san_miguel/san_miguel_meshopt.gltf"))
    else {
        return;
    };
    assert_eq!(plain.triangle_count(), 9_407_481);
    // gltfpack leaves out triangles without area
    let lost = plain.triangle_count() - packed.triangle_count();
    assert!(lost <= 100, "{lost} triangles lost");
    assert_eq!((plain.instances.len(), packed.instances.len()), (8392, 8392));
    assert_eq!(plain.materials.len(), packed.materials.len());
    assert_eq!(plain.images.len(), packed.images.len());
    let mirrored =
        |s: &Scene| s.instances.iter().filter(|i| i.world_from_object.matrix3.determinant() < 0.0).count();
    assert_eq!((mirrored(&plain), mirrored(&packed)), (661, 661));
    // 12 bits of mantissa on coordinates of up to 33 m
    let (a, b) = (plain.bounds_ws(), packed.bounds_ws());
    assert!(
        (a.min - b.min).abs().max_element() < 0.02 && (a.max - b.max).abs().max_element() < 0.02,
        "{a:?} {b:?}"
    );
    for (i, (p, q)) in plain.materials.iter().zip(&packed.materials).enumerate() {
        assert_eq!(p.name, q.name);
        assert_eq!((p.alpha_mode, p.double_sided), (q.alpha_mode, q.double_sided), "material {i}");
        assert_eq!(p.normal_texture.map(|t| t.image), q.normal_texture.map(|t| t.image), "material {i}");
    }
    let areas = |s: &Scene| s.meshes.iter().map(|m| surface_area(s, m)).collect::<Vec<_>>();
    let (plain_areas, packed_areas) = (areas(&plain), areas(&packed));
    for (p, q) in plain.instances.iter().zip(&packed.instances) {
        let moved = p.world_from_object.translation - q.world_from_object.translation;
        assert!(Vec3::from(moved).length() < 1e-3, "node {} moved by {moved}", p.node);
        // each draw has the same surface: positions keep 12 bits, which moves small parts by 4 mm
        let (x, y) = (plain_areas[p.mesh as usize], packed_areas[q.mesh as usize]);
        assert!((x - y).abs() <= 0.15 * x + 2e-3, "node {}: area {x} and {y}", p.node);
    }
    let (x, y): (f64, f64) = (plain_areas.iter().sum(), packed_areas.iter().sum());
    assert!((x - y).abs() < 0.01 * x, "area of all meshes {x} and {y}");
}

/// Area of a mesh in object space, m².
fn surface_area(scene: &Scene, mesh: &Mesh) -> f64 {
    let vertex = |i: u32| Vec3::from(scene.positions_os[(mesh.first_vertex + i) as usize]).as_dvec3();
    let indices = &scene.indices[mesh.first_index as usize..(mesh.first_index + mesh.index_count) as usize];
    let area = |t: &[u32]| 0.5 * (vertex(t[1]) - vertex(t[0])).cross(vertex(t[2]) - vertex(t[0])).length();
    indices.chunks_exact(3).map(area).sum()
}
