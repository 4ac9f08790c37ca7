//! Filters after shading: against an 8×8 supersampled image, where they must change nothing, and on every technique.

mod common;

use afterlight_image::{Rgba8Image, flip, max_abs};
use afterlight_renderer::{Renderer, supersample};
use afterlight_techniques::{
    Frame, Info, Params, Post, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{
        BufferRole, Graph, ImageHandle,
        gpu::{self, vk},
    },
    registry,
    scene::{Instance, LoadOptions, Material, Scene, load_source},
    shader::Shader,
};
use common::{Stage, compiled, image_of, psnr, source};
use glam::{Affine3A, Vec3};

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

/// Two triangles' planes side by side in one plane, white and grey; grey's material has the number `grey`, and those between are unused.
fn two_materials(grey: usize) -> Scene {
    let mut scene = load_source("builtin:edge", &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    // The white triangles, turned about the middle of the image: the line between the two crosses it.
    let mut mesh = scene.meshes[0].clone();
    mesh.material = grey as u32;
    scene.meshes.push(mesh);
    let white = scene.instances[0].clone();
    let turned = Affine3A::from_scale(Vec3::new(-1.0, -1.0, 1.0));
    // Both meet at the line, which crosses the axis at 1/16 m.
    let moved = Affine3A::from_translation(Vec3::new(2.0 / 16.0, 0.0, 0.0));
    scene.instances.push(Instance {
        mesh: 1,
        world_from_object: moved * turned * white.world_from_object,
        ..white
    });
    let grey_material = Material { base_color_factor: [0.2, 0.2, 0.2, 1.0], ..scene.materials[0].clone() };
    scene.materials.resize(grey + 1, Material::default());
    scene.materials[grey] = grey_material;
    scene
}

/// SRAA tells surfaces of one plane apart by their materials, however many a scene has: the image does not depend on their numbers.
#[test]
fn sraa_tells_all_materials_apart() {
    let gpu = afterlight_testkit::gpu();
    let image = |grey: usize| {
        let stage = Stage::of(&gpu, two_materials(grey));
        let settings = stage.settings((101, 57), 0);
        let plain = filtered(&stage, &settings, Post::None);
        (filtered(&stage, &settings, Post::Sraa), plain)
    };
    let (expected, plain) = image(1);
    assert!(expected.pixels != plain.pixels, "there is nothing to filter");
    for grey in [254, 255, 256, 257, 512, 65_535, 65_536, 65_537] {
        let (found, _) = image(grey);
        let off = max_abs(&expected, &found).unwrap();
        // Normals of 16 bits instead of 12 weigh the neighbours a little differently.
        assert!(off <= 1, "material {grey}: {off} of 255 from the image of material 1");
    }
    // The mutant: eight bits of a material's number, by which 256 is 0.
    let stage = Stage::of(&gpu, two_materials(256));
    let settings = stage.settings((101, 57), 0).with_effects(|effects| effects.post.filter = Post::Sraa);
    let path = source("compose/post/sraa.frag.glsl");
    let cut = compiled("compose/post/sraa.frag", &path, &[], &[("material & 0xffffu", "material & 0xffu")]);
    let forward = find("forward").unwrap();
    let mut mutant = stage.prepare_shaders(forward, &settings, &Params::default(), [cut]);
    let off = max_abs(&expected, &image_of(&mut mutant)).unwrap();
    assert!(off > 1, "eight bits of a material's number go unseen");
}

/// A technique whose image of radiance is given, RGBA16F.
struct Given(gpu::Image);

impl Given {
    fn new(device: &gpu::Device, settings: &Settings, radiance: &[u8]) -> Self {
        let image = device.create_image(&gpu::ImageDesc {
            name: "given radiance",
            format: vk::Format::R16G16B16A16_SFLOAT,
            width: settings.width_px,
            height: settings.height_px,
            layers: 1,
            mips: 1,
            samples: 1,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        });
        let image = image.unwrap_or_else(|e| panic!("{e}"));
        let mut uploader = device.uploader().unwrap_or_else(|e| panic!("{e}"));
        uploader.image(&image, 0, 0, radiance).unwrap_or_else(|e| panic!("{e}"));
        uploader.finish().unwrap_or_else(|e| panic!("{e}"));
        Self(image)
    }
}

impl Technique for Given {
    fn info(&self) -> &Info {
        find("forward").unwrap().info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, _: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        Ok(graph.import_image("given/radiance", BufferRole::Targets, &self.0, layout))
    }
}

fn passes(post: Post) -> &'static [&'static str] {
    match post {
        Post::None => &[],
        Post::Fxaa => &["post/fxaa"],
        Post::Smaa => &["post/smaa-edges", "post/smaa-weights", "post/smaa-blend"],
        Post::Sraa => &["post/sraa-visibility", "post/sraa-centers", "post/sraa"],
    }
}

/// Every technique takes every filter, in the passes that the reports name; at odd sizes as well. What is shown is, to the byte, what the
/// filter makes of that frame's own radiance: no technique's image differs from `forward` by more with a filter than its radiance does.
#[test]
fn every_technique_takes_every_filter() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:spheres?segments=24");
    for post in FILTERS {
        for size_px in [(80, 45), (1, 1), (17, 3)] {
            for technique in registry() {
                let info = technique.info();
                let samples = if info.samples.contains(&1) { 1 } else { 4 };
                let settings = Settings { samples, keep_hdr: true, ..stage.settings(size_px, 10) }
                    .with_effects(|effects| effects.post.filter = post);
                let mut prepared = stage.prepare(*technique, &settings);
                let report = prepared.run().unwrap_or_else(|e| panic!("{e}"));
                let names = report.passes.iter().map(|pass| pass.name.as_str());
                let found: Vec<&str> = names.filter(|name| name.starts_with("post/")).collect();
                assert_eq!(found, passes(post), "{}", info.id);

                let shown = prepared.final_rgba8().unwrap_or_else(|e| panic!("{e}"));
                let radiance = prepared.hdr_bytes().unwrap_or_else(|e| panic!("{e}")).expect("kept");
                let given = Given::new(&gpu, &settings, &radiance);
                let of_given = |filter| {
                    let settings = settings.clone().with_effects(|effects| effects.post.filter = filter);
                    stage.image(&given, &Settings { samples: 1, keep_hdr: false, ..settings }).pixels
                };
                let what = format!("{} with {} at {size_px:?}", info.id, post.name());
                assert!(shown == of_given(post), "{what}: not what the filter makes of its radiance");
                if size_px == (80, 45) {
                    assert!(shown != of_given(Post::None), "{what}: the filter changes nothing");
                }
            }
        }
    }
}

/// The mutant: one technique's frame ends in a filter that exchanges what its pixels give and take.
#[test]
fn a_filter_of_its_own_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:spheres?segments=24");
    let settings = Settings { keep_hdr: true, ..stage.settings((80, 45), 10) }
        .with_effects(|effects| effects.post.filter = Post::Smaa);
    let swapped = afterlight_stages::shader("compose/post/smaa_blend.comp#swapped").expect("a variant");
    let own = [Shader { name: "compose/post/smaa_blend.comp".into(), ..swapped.clone() }];
    let mut prepared = stage.prepare_shaders(find("tiled").unwrap(), &settings, &Params::default(), own);
    let shown = image_of(&mut prepared).pixels;
    let radiance = prepared.hdr_bytes().unwrap_or_else(|e| panic!("{e}")).expect("kept");
    let given = Given::new(&gpu, &settings, &radiance);
    let of_given = stage.image(&given, &Settings { keep_hdr: false, ..settings }).pixels;
    assert!(shown != of_given, "another filter goes unseen");
}
