//! Filters after shading: against an 8×8 supersampled image, where they must change nothing, and on every technique.

mod common;

use afterlight_image::{Rgba8Image, flip, max_abs};
use afterlight_renderer::{Renderer, supersample};
use afterlight_techniques::{Exactness, Params, Post, Settings, find, registry, shader::Shader};
use common::{Stage, image_of, psnr};

const FILTERS: [Post; 3] = [Post::Fxaa, Post::Smaa, Post::Sraa];

fn mean_flip(reference: &Rgba8Image, image: &Rgba8Image) -> f64 {
    flip(reference, image).unwrap_or_else(|e| panic!("{e}")).mean.into()
}

fn supersampled(stage: &Stage, settings: &Settings) -> Rgba8Image {
    let forward = find("forward").unwrap();
    let pixels = supersample::reference_rgba8(&stage.device, &stage.uploaded, settings, forward, 8)
        .unwrap_or_else(|e| panic!("{e}"));
    Rgba8Image::new(settings.width_px, settings.height_px, pixels).unwrap_or_else(|e| panic!("{e}"))
}

fn filtered(stage: &Stage, settings: &Settings, post: Post) -> Rgba8Image {
    stage
        .image(find("forward").unwrap(), &settings.clone().with_effects(|effects| effects.post.filter = post))
}

/// Writes an image for the eye where `AFTERLIGHT_POST_IMAGES` names a folder.
fn show(scene: &str, name: &str, image: &Rgba8Image) {
    let Ok(folder) = std::env::var("AFTERLIGHT_POST_IMAGES") else { return };
    let scene = scene.trim_start_matches("builtin:").split('?').next().unwrap_or_default();
    let file = std::path::Path::new(&folder).join(format!("{scene}-{name}.png"));
    afterlight_image::write_png(&file, image).unwrap_or_else(|e| panic!("{e}"));
}

/// The mean FLIP error of each filter is below that of the unfiltered image. The colonnade is larger than the others: at
/// 160×90 its textures are all edges, and FXAA and SMAA, which know the image alone, blur them.
#[test]
fn filters_bring_images_nearer_to_the_supersampled_one() {
    let gpu = afterlight_testkit::gpu();
    let mut worse = Vec::new();
    for (scene, size_px) in [
        ("builtin:colonnade?triangles=30000", (640, 360)),
        ("builtin:spheres?segments=48", (320, 180)),
        ("builtin:edge", (160, 90)),
        ("builtin:intersect", (160, 90)),
    ] {
        let stage = Stage::new(&gpu, scene);
        let settings = stage.settings(size_px, 0);
        let reference = supersampled(&stage, &settings);
        let plain = filtered(&stage, &settings, Post::None);
        show(scene, "reference", &reference);
        show(scene, "none", &plain);
        let before = mean_flip(&reference, &plain);
        assert!(before > 0.0, "{scene}: nothing to filter");
        for post in FILTERS {
            let image = filtered(&stage, &settings, post);
            show(scene, post.name(), &image);
            let after = mean_flip(&reference, &image);
            let [db_before, db_after] = [&plain, &image].map(|image| psnr(&reference, image));
            let line = format!(
                "{scene} {size_px:?}: {}: FLIP {before:.5} -> {after:.5}, PSNR {db_before:.2} -> {db_after:.2} dB",
                post.name()
            );
            println!("{line}");
            if after >= before || db_after <= db_before {
                worse.push(line);
            }
        }
    }
    assert!(worse.is_empty(), "filters that do not help:\n{}", worse.join("\n"));
}

/// The mutant: each pixel takes what it should give.
#[test]
fn exchanged_weights_are_caught() {
    let gpu = afterlight_testkit::gpu();
    for scene in ["builtin:edge", "builtin:intersect", "builtin:spheres?segments=48"] {
        let stage = Stage::new(&gpu, scene);
        let settings = stage.settings((160, 90), 0).with_effects(|effects| effects.post.filter = Post::Smaa);
        let reference = supersampled(&stage, &settings);
        let mut renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings).unwrap();
        let swapped = afterlight_stages::shader("compose/post/smaa_blend.comp#swapped").expect("a variant");
        renderer.add_shaders([Shader { name: "compose/post/smaa_blend.comp".into(), ..swapped.clone() }]);
        let mut prepared = renderer.prepare(find("forward").unwrap(), &Params::default()).unwrap();
        let mutant = mean_flip(&reference, &image_of(&mut prepared));
        let before = mean_flip(&reference, &filtered(&stage, &settings, Post::None));
        assert!(mutant > before, "{scene}: exchanged weights go unseen: {before} -> {mutant}");
    }
}

#[test]
fn uniform_images_stay_as_they_are() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:furnace?segments=32");
    let settings = stage.settings((128, 72), 0);
    let plain = filtered(&stage, &settings, Post::None);
    for post in FILTERS {
        let off = max_abs(&plain, &filtered(&stage, &settings, post)).unwrap();
        assert_eq!(off, 0, "{} changes a uniform image", post.name());
    }
}

/// Pixels whose neighbourhood is uniform keep their bytes, in every filter; those at the edge change.
#[test]
fn only_pixels_at_edges_change() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:edge");
    let settings = stage.settings((101, 57), 0);
    let plain = filtered(&stage, &settings, Post::None);
    let (width, height) = (plain.width as i32, plain.height as i32);
    let at = |image: &Rgba8Image, x: i32, y: i32| {
        let i = 4 * (y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize;
        [image.pixels[i], image.pixels[i + 1], image.pixels[i + 2], image.pixels[i + 3]]
    };
    for post in FILTERS {
        let image = filtered(&stage, &settings, post);
        let mut changed = 0;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
            let uniform = around
                .map(|(dx, dy)| at(&plain, x + dx, y + dy))
                .all(|neighbour| neighbour == at(&plain, x, y));
            let same = at(&image, x, y) == at(&plain, x, y);
            assert!(same || !uniform, "{}: ({x}, {y}) has no edge beside it", post.name());
            changed += u32::from(!same);
        }
        // The edge crosses 57 rows; in some of them it lies between samples.
        assert!(changed > 30, "{} changes {changed} pixels", post.name());
    }
}

/// Every technique takes every filter, in the passes that the reports name; at odd sizes as well.
#[test]
fn every_technique_takes_every_filter() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:spheres?segments=24");
    let passes = |post: Post| match post {
        Post::None => vec![],
        Post::Fxaa => vec!["post/fxaa"],
        Post::Smaa => vec!["post/smaa-edges", "post/smaa-weights", "post/smaa-blend"],
        Post::Sraa => vec!["post/sraa-visibility", "post/sraa-centers", "post/sraa"],
    };
    for post in FILTERS {
        for size_px in [(80, 45), (1, 1), (17, 3)] {
            let [one, four] = [1, 4].map(|samples| {
                Settings { samples, ..stage.settings(size_px, 10) }
                    .with_effects(|effects| effects.post.filter = post)
            });
            let references = [&one, &four].map(|settings| filtered(&stage, settings, post));
            for technique in registry() {
                let id = technique.info().id;
                let is_multisampled = !technique.info().samples.contains(&1);
                let settings = if is_multisampled { &four } else { &one };
                let reference = &references[usize::from(is_multisampled)];
                let mut prepared = stage.prepare(*technique, settings);
                let image = image_of(&mut prepared);
                let report = prepared.run().unwrap();
                let found: Vec<&str> = report
                    .passes
                    .iter()
                    .map(|pass| pass.name.as_str())
                    .filter(|name| name.starts_with("post/"))
                    .collect();
                assert_eq!(found, passes(post), "{id}");
                let (Exactness::Exact { min_psnr_db } | Exactness::Approximate { min_psnr_db, .. }) =
                    technique.info().exactness;
                // `forward` shades once a pixel, so that others differ from it at several samples as it is; a filter may
                // tell more edges apart, by a few decibels.
                let bound_db = match is_multisampled {
                    false => min_psnr_db,
                    true => {
                        let plain = settings.clone().with_effects(|effects| effects.post.filter = Post::None);
                        let forward = filtered(&stage, &plain, Post::None);
                        psnr(&forward, &stage.image(*technique, &plain)).min(min_psnr_db) - 6.0
                    }
                };
                let db = psnr(reference, &image);
                assert!(db >= bound_db, "{id} with {} at {size_px:?}: {db:.2} dB", post.name());
            }
        }
    }
}
