//! Filters after shading against an 8×8 supersampled image, and where they must change nothing.

mod common;

use afterlight_image::{Rgba8Image, flip};
use afterlight_techniques::{Post, Settings, find, supersample};
use common::Stage;

const SIZE_PX: (u32, u32) = (160, 90);
const SCENES: [&str; 4] =
    ["builtin:colonnade?triangles=30000", "builtin:spheres?segments=48", "builtin:edge", "builtin:intersect"];
const FILTERS: [Post; 3] = [Post::Fxaa, Post::Smaa, Post::Sraa];

fn mean_flip(reference: &Rgba8Image, image: &Rgba8Image) -> f64 {
    flip(reference, image).unwrap_or_else(|e| panic!("{e}")).mean.into()
}

fn reference(stage: &Stage, settings: &Settings) -> Rgba8Image {
    let forward = find("forward").unwrap();
    let pixels = supersample::reference_rgba8(&stage.device, &stage.uploaded, settings, forward, 8)
        .unwrap_or_else(|e| panic!("{e}"));
    Rgba8Image::new(settings.width_px, settings.height_px, pixels).unwrap_or_else(|e| panic!("{e}"))
}

/// Writes an image for the eye where `AFTERLIGHT_POST_IMAGES` names a folder.
fn show(scene: &str, name: &str, image: &Rgba8Image) {
    let Ok(folder) = std::env::var("AFTERLIGHT_POST_IMAGES") else { return };
    let scene = scene.trim_start_matches("builtin:").split('?').next().unwrap_or_default();
    let file = std::path::Path::new(&folder).join(format!("{scene}-{name}.png"));
    afterlight_image::write_png(&file, image).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn filters_bring_images_nearer_to_the_supersampled_one() {
    let gpu = afterlight_testkit::gpu();
    let forward = find("forward").unwrap();
    let mut worse = Vec::new();
    for scene in SCENES {
        let stage = Stage::new(&gpu, scene);
        let settings = stage.settings(SIZE_PX, 0);
        let reference = reference(&stage, &settings);
        let plain = stage.image(forward, &settings);
        show(scene, "reference", &reference);
        show(scene, "none", &plain);
        let unfiltered = mean_flip(&reference, &plain);
        assert!(unfiltered > 0.0, "{scene}: nothing to filter");
        for post in FILTERS {
            let image = stage.image(forward, &Settings { post, ..settings.clone() });
            show(scene, post.name(), &image);
            let filtered = mean_flip(&reference, &image);
            println!("{scene}: {} {unfiltered:.5} -> {filtered:.5}", post.name());
            if filtered >= unfiltered {
                worse.push(format!("{scene}: {}: {unfiltered:.5} -> {filtered:.5}", post.name()));
            }
        }
    }
    assert!(worse.is_empty(), "filters that do not help:\n{}", worse.join("\n"));
}
