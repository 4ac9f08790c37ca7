//! Loads arbitrary bytes: `cargo +nightly fuzz run load` in `crates/scene`. The first byte is the
//! format (0 glTF, 1 GLB, 2 OBJ; modulo 3), the rest the file.
#![no_main]

use std::path::Path;

use afterlight_scene::{
    LoadOptions, load_bytes,
    texture::{TextureRole, decode},
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((format, bytes)) = data.split_first() else { return };
    let name = ["fuzz.gltf", "fuzz.glb", "fuzz.obj"][usize::from(*format) % 3];
    match load_bytes(Path::new(name), bytes, &LoadOptions { time_s: Some(0.25) }) {
        Ok(scene) => {
            for mesh in &scene.meshes {
                let end = (mesh.first_index + mesh.index_count) as usize;
                assert!(scene.indices[mesh.first_index as usize..end].iter().all(|&i| i < mesh.vertex_count));
            }
            assert!(scene.positions_os.iter().flatten().all(|v| v.is_finite()));
            for image in scene.images.iter().filter(|i| u64::from(i.width) * u64::from(i.height) <= 1 << 16) {
                let _ = decode(image, TextureRole::BaseColor, Some((5, 3)));
            }
        }
        Err(e) => assert!(!e.to_string().contains('\n')),
    }
});
