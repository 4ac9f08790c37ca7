//! Measures loading: `cargo run --release -p afterlight-scene --example load_time -- SCENE…`
//! prints, for each scene, what it holds, the time to load it, and the time to decode its textures
//! with all mip levels.

use std::{collections::BTreeSet, time::Instant};

use afterlight_scene::{
    LoadOptions, load_source,
    texture::{TextureRole, decode},
};
use rayon::prelude::*;

fn main() {
    for source in std::env::args().skip(1) {
        let start = Instant::now();
        let scene = match load_source(&source, &LoadOptions::default()) {
            Ok(scene) => scene,
            Err(e) => {
                println!("{e}");
                continue;
            }
        };
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        println!(
            "{source}: {} triangles drawn, {} vertices, {} meshes, {} draws, {} images, loaded in {load_ms:.0} ms",
            scene.triangle_count(),
            scene.positions_os.len(),
            scene.meshes.len(),
            scene.instances.len(),
            scene.images.len(),
        );
        for warning in scene.warnings.iter().take(5) {
            println!("  warning: {warning}");
        }
        let mut uses = BTreeSet::new();
        for m in &scene.materials {
            let mut add =
                |t: &Option<afterlight_scene::TextureRef>, role| uses.extend(t.map(|t| (t.image, role)));
            add(&m.base_color_texture, TextureRole::BaseColor);
            add(&m.normal_texture, TextureRole::Normal);
            add(&m.metallic_roughness_texture, TextureRole::Data);
            add(&m.occlusion_texture, TextureRole::Data);
            add(&m.emissive_texture, TextureRole::Emissive);
        }
        let start = Instant::now();
        let bytes: usize = uses
            .par_iter()
            .map(|&(image, role)| match decode(&scene.images[image as usize], role, None) {
                Ok(chain) => chain.levels.iter().map(Vec::len).sum(),
                Err(e) => {
                    println!("  {e}");
                    0
                }
            })
            .sum();
        let decode_ms = start.elapsed().as_secs_f64() * 1e3;
        println!("  {} textures decoded to {} MiB in {decode_ms:.0} ms", uses.len(), bytes >> 20);
    }
}
