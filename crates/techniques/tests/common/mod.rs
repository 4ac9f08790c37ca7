//! What the tests of whole techniques share: a scene on the validated device, images, comparisons.
#![allow(dead_code)] // each test file uses a part

pub mod quads;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use afterlight_image::{Rgba8Image, psnr_db};
use afterlight_renderer::{Prepared, Renderer};
use afterlight_stages::lights::indices;
use afterlight_techniques::{
    Exactness, Params, SceneGpu, Settings, Technique, TechniqueError, exactness_of, find,
    graph::{BufferRole, PassRole, gpu},
    params_of,
    scene::{self, Camera, Light, LightKind, Scene, lights::seeded_lights, rng::SplitMix64},
    set_param,
    shader::{Shader, compile::Compiler, manifest},
};
use glam::Vec3;

pub mod flat;
pub mod ways;

/// A scene on the device.
pub struct Stage {
    pub device: gpu::Device,
    pub scene: Scene,
    pub uploaded: Arc<SceneGpu>,
}

impl Stage {
    /// Loads and uploads a scene.
    pub fn new(device: &gpu::Device, source: &str) -> Self {
        let scene =
            scene::load_source(source, &scene::LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        Self::of(device, scene)
    }

    /// Uploads a scene.
    pub fn of(device: &gpu::Device, scene: Scene) -> Self {
        let uploaded = SceneGpu::upload(device, &scene, &|_, _| {}).unwrap_or_else(|e| panic!("{e}"));
        Self { device: device.clone(), scene, uploaded }
    }

    /// Settings with seeded lights; none given are the scene's own.
    pub fn settings(&self, size: (u32, u32), lights: u32) -> Settings {
        let mut settings = Settings::for_scene(&self.scene, size.0, size.1);
        if lights > 0 {
            settings.lights = seeded_lights(&self.scene.bounds_ws(), lights, 1);
        }
        settings
    }

    /// The same from another camera.
    pub fn from(&self, camera: Camera, size: (u32, u32), lights: u32) -> Settings {
        Settings { camera, ..self.settings(size, lights) }
    }

    /// A technique made ready.
    pub fn prepare(&self, technique: &dyn Technique, settings: &Settings) -> Prepared {
        self.prepare_with(technique, settings, &Params::default())
    }

    /// A technique made ready with parameters.
    pub fn prepare_with(&self, technique: &dyn Technique, settings: &Settings, params: &Params) -> Prepared {
        let prepared = self.try_prepare(technique, settings, params);
        prepared.unwrap_or_else(|e| panic!("{}: {e}", technique.info().id))
    }

    /// The same, or why not.
    pub fn try_prepare(
        &self,
        technique: &dyn Technique,
        settings: &Settings,
        params: &Params,
    ) -> Result<Prepared, TechniqueError> {
        Renderer::with_scene(&self.device, self.uploaded.clone(), settings)?.prepare(technique, params)
    }

    /// A technique made ready with parameters and with shaders in place of its own.
    pub fn prepare_shaders(
        &self,
        technique: &dyn Technique,
        settings: &Settings,
        params: &Params,
        shaders: impl IntoIterator<Item = Shader>,
    ) -> Prepared {
        let prepared = self.try_prepare_shaders(technique, settings, params, shaders);
        prepared.unwrap_or_else(|e| panic!("{}: {e}", technique.info().id))
    }

    /// The same, or why not.
    pub fn try_prepare_shaders(
        &self,
        technique: &dyn Technique,
        settings: &Settings,
        params: &Params,
        shaders: impl IntoIterator<Item = Shader>,
    ) -> Result<Prepared, TechniqueError> {
        let mut renderer = Renderer::with_scene(&self.device, self.uploaded.clone(), settings)?;
        renderer.add_shaders(shaders);
        renderer.prepare(technique, params)
    }

    /// The same, where a pass runs in subgroups of a size, or the device's own choice.
    pub fn prepare_in_subgroups(
        &self,
        (technique, params): (&dyn Technique, &Params),
        settings: &Settings,
        shaders: &[Shader],
        (pass, size): (&str, Option<u32>),
    ) -> Prepared {
        let renderer = Renderer::with_scene(&self.device, self.uploaded.clone(), settings);
        let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        renderer.add_shaders(shaders.iter().cloned());
        let prepared = renderer.prepare_with(technique, params, |graph, _| {
            if let Some(size) = size {
                assert!(graph.set_subgroup_size(pass, size), "no such pass: {pass}");
            }
        });
        prepared.unwrap_or_else(|e| panic!("{e}"))
    }

    /// A technique's image.
    pub fn image(&self, technique: &dyn Technique, settings: &Settings) -> Rgba8Image {
        let mut prepared = self.prepare(technique, settings);
        image_of(&mut prepared)
    }

    /// A technique's linear radiance, RGBA.
    pub fn radiance(&self, technique: &dyn Technique, settings: &Settings) -> Vec<[f32; 4]> {
        radiance_of(&mut self.prepare(technique, &Settings { keep_hdr: true, ..settings.clone() }))
    }
}

/// Sizes of subgroups that shaders may require; that a device offers one alone is told.
#[track_caller]
pub fn subgroup_sizes(device: &gpu::Device) -> Vec<u32> {
    let sizes = device.features().subgroup_sizes();
    if sizes.len() < 2 {
        let one = format!("{} offers one size, {}", device.info().name, device.features().subgroup_size);
        afterlight_testkit::skip(afterlight_testkit::Need::SubgroupSizes, &one);
    }
    sizes
}

/// A technique's parameters from `key=value` words.
pub fn params(technique: &dyn Technique, sets: &[(&str, &str)]) -> Params {
    let mut params = params_of(technique);
    for (key, value) in sets {
        set_param(technique, &mut params, key, value).unwrap_or_else(|e| panic!("{e}"));
    }
    params
}

/// Runs a frame and reads its linear radiance, RGBA, which it was asked to keep.
pub fn radiance_of(prepared: &mut Prepared) -> Vec<[f32; 4]> {
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    let rgba = prepared.hdr_rgba().unwrap_or_else(|e| panic!("{e}")).expect("kept");
    rgba.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect()
}

/// A directional, a spot and a point light at a place, towards the scene's centre; about as bright there.
pub fn lights_of_each_kind(stage: &Stage, position_ws: Vec3, intensity: f32) -> [Light; 3] {
    let bounds = stage.scene.bounds_ws();
    let light = |kind, intensity: f32| Light {
        kind,
        position_ws,
        direction_ws: (bounds.center() - position_ws).normalize(),
        intensity: Vec3::new(1.0, 0.9, 0.7) * intensity,
        range_m: 10.0 * bounds.size().length(),
    };
    let far = intensity * bounds.size().length_squared();
    [
        Light { range_m: f32::INFINITY, ..light(LightKind::Directional, intensity) },
        light(LightKind::Spot { inner_angle_rad: 0.2, outer_angle_rad: 0.7 }, far),
        light(LightKind::Point, far),
    ]
}

/// Runs a frame and reads its image.
pub fn image_of(prepared: &mut Prepared) -> Rgba8Image {
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    let (width, height) = prepared.size_px();
    Rgba8Image { width, height, pixels: prepared.final_rgba8().unwrap_or_else(|e| panic!("{e}")) }
}

/// Least PSNR to `forward` of an exact technique at several samples, dB (contract).
const MULTISAMPLED_MIN_DB: f64 = 40.0;

/// Least PSNR to `forward` that a technique promises with these parameters at so many samples a pixel, dB.
pub fn least_db(technique: &dyn Technique, params: &Params, samples: u32) -> f64 {
    match exactness_of(technique, params, samples) {
        Exactness::Exact { .. } if samples > 1 => MULTISAMPLED_MIN_DB,
        Exactness::Exact { min_psnr_db } | Exactness::Approximate { min_psnr_db, .. } => min_psnr_db,
    }
}

/// The same of pictures whose surfaces take four lights with an end at most: there techniques that keep four are exact.
pub fn least_db_of_four_lights(technique: &dyn Technique, params: &Params, samples: u32) -> f64 {
    match exactness_of(technique, params, samples) {
        of if of == indices::EXACTNESS && samples == 1 => 50.0,
        of if of == indices::EXACTNESS => MULTISAMPLED_MIN_DB,
        _ => least_db(technique, params, samples),
    }
}

/// A unit vector, uniform over the sphere.
pub fn direction(random: &mut SplitMix64) -> Vec3 {
    loop {
        let v = Vec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        if (1e-3..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// A camera in the scene's bounds or just above their floor, of 20 to 120 degrees.
pub fn random_camera(stage: &Stage, random: &mut SplitMix64) -> Camera {
    let bounds = stage.scene.bounds_ws();
    let place = |random: &mut SplitMix64| {
        bounds.min + bounds.size() * Vec3::new(random.next_f32(), random.next_f32(), random.next_f32())
    };
    let mut eye = place(random);
    if random.next_f32() < 0.4 {
        eye.y = bounds.min.y + 0.02 * bounds.size().y;
    }
    let target = place(random);
    let fov_y_rad = (20.0 + 100.0 * random.next_f32()).to_radians();
    Camera::look_at("random", eye, target, fov_y_rad, 0.01)
}

/// Small views that nobody chose, at four samples: eight of each of three scenes, with 2 to 300 lights. Each is given with `forward`'s image of
/// it and its name.
pub fn random_views(seed: u64, mut each: impl FnMut(&Stage, &Settings, &Rgba8Image, &str)) {
    let gpu = afterlight_testkit::gpu();
    if afterlight_testkit::sample_counts(&gpu, &[4]).is_empty() {
        return;
    }
    let mut random = SplitMix64::new(seed);
    for scene in ["builtin:spheres", "builtin:colonnade?triangles=17000&texture=64", "builtin:intersect"] {
        let stage = Stage::new(&gpu, scene);
        for view in 0..8 {
            let camera = random_camera(&stage, &mut random);
            let lights = [2, 10, 60, 300][(random.next_f32() * 4.0) as usize];
            let settings = Settings { samples: 4, ..stage.from(camera, (97, 53), lights) };
            let reference = stage.image(find("forward").expect("a technique"), &settings);
            each(&stage, &settings, &reference, &format!("{scene} view {view}, {lights} lights"));
        }
    }
}

/// PSNR in dB, infinite where equal.
pub fn psnr(a: &Rgba8Image, b: &Rgba8Image) -> f64 {
    psnr_db(a, b).unwrap_or_else(|e| panic!("{e}"))
}

/// Share of pixels that show something else than the background colour of the first pixel's kind: black.
pub fn covered(image: &Rgba8Image) -> f64 {
    let lit = image.pixels.chunks_exact(4).filter(|p| p[..3] != [0, 0, 0]).count();
    lit as f64 / f64::from(image.width * image.height)
}

/// Lights whose range is larger by a factor: a mutant that comparisons must catch.
pub fn wider(lights: &[Light], factor: f32) -> Vec<Light> {
    lights.iter().map(|l| Light { range_m: l.range_m * factor, ..*l }).collect()
}

/// Folders of shaders: of techniques, of stages, and the headers that all share.
fn folders() -> [PathBuf; 3] {
    ["src", "../stages/src", "../shader/include"]
        .map(|folder| Path::new(env!("CARGO_MANIFEST_DIR")).join(folder))
}

/// Path of a shader or a header by the name that includes give it.
pub fn source(name: &str) -> PathBuf {
    let mut paths = folders().into_iter().map(|folder| folder.join(name));
    paths
        .find(|path| path.is_file())
        .unwrap_or_else(|| panic!("{name}: found no such shader, expected one of techniques or stages"))
}

/// Text of a shader with parts replaced.
fn replaced_text(path: &Path, replaced: &[(&str, &str)]) -> String {
    let mut text = std::fs::read_to_string(path).expect("a shader");
    for (from, to) in replaced {
        assert!(text.contains(from), "{} has changed: found no {from:?}", path.display());
        text = text.replace(from, to);
    }
    text
}

/// Compiles a shader of this crate or of its tests under a name, with parts of its text replaced.
pub fn compiled(name: &str, path: &Path, defines: &[&str], replaced: &[(&str, &str)]) -> Shader {
    let file = path.file_name().expect("a file");
    in_temporary_folder(|folder| {
        let written = folder.join(file);
        std::fs::write(&written, replaced_text(path, replaced)).expect("a file in the temporary folder");
        compile(name, &written, path.parent().expect("a folder"), defines, folder)
    })
}

/// What a compute shader of these tests, such as `logluv.comp`, writes into its buffer `Found`: so many floats, by so many groups. Parts of the
/// text of the header that it tests are replaced.
pub fn found_by(
    stage: &Stage,
    shader: &str,
    (header, replaced): (&str, &[(&str, &str)]),
    (floats, groups): (u64, u32),
) -> Vec<f64> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(format!("{shader}.glsl"));
    let shader = in_temporary_folder(|changed| {
        write_changed(changed, header, replaced);
        compile(&format!("test/{shader}"), &path, path.parent().expect("a folder"), &[], changed)
    });
    let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &stage.settings((8, 8), 1));
    let prepared = renderer.unwrap_or_else(|e| panic!("{e}")).prepare_with(
        find("forward").expect("a technique"),
        &Params::default(),
        |graph, _| {
            let found = graph.buffer("test/found", BufferRole::Counters, 4 * floats);
            let mut pass = graph.compute("test/finding", PassRole::Upkeep, &shader);
            let found = pass.write("Found", found);
            pass.dispatch([groups, 1, 1]);
            pass.finish();
            graph.keep(&found);
        },
    );
    let mut prepared = prepared.unwrap_or_else(|e| panic!("{e}"));
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    let bytes = prepared.executor().read_buffer("test/found").unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(bytes.len() as u64, 4 * floats);
    bytes.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect()
}

/// Writes a header, with parts of its text replaced, to where includes find it before the real one. Returns the written file.
fn write_changed(folder: &Path, header: &str, replaced: &[(&str, &str)]) -> PathBuf {
    let written = folder.join(header);
    std::fs::create_dir_all(written.parent().expect("a folder")).expect("a temporary folder");
    std::fs::write(&written, replaced_text(&source(header), replaced))
        .expect("a file in the temporary folder");
    written
}

/// Compiles a variant by its full name, as its `variants.txt` says, with parts of a header's or a source's text replaced.
pub fn compiled_variant(name: &str, header: &str, replaced: &[(&str, &str)]) -> Shader {
    let mut variant = variant(name);
    in_temporary_folder(|changed| {
        let (path, written) = (source(header), write_changed(changed, header, replaced));
        if variant.path == path {
            variant.path = written;
        } else if variant.source.as_ref() == Some(&path) {
            variant.source = Some(written);
        }
        let [techniques, stages, _] = folders();
        let compiler = Compiler::new().override_dir(changed).include_dir(techniques).include_dir(stages);
        compiler.compile(&variant).unwrap_or_else(|e| panic!("{e}")).shader
    })
}

/// A variant of a technique or a stage by its full name.
fn variant(name: &str) -> manifest::Variant {
    let (prefix, _) = name.rsplit_once('/').expect("a folder");
    let [techniques, stages, _] = folders();
    let folder =
        [&techniques, &stages].map(|root| root.join(prefix)).into_iter().find(|folder| folder.is_dir());
    let folder = folder.unwrap_or_else(|| panic!("{name}: found no folder {prefix}"));
    let variants = manifest::read(prefix, &folder, &[techniques, stages]).unwrap_or_else(|e| panic!("{e}"));
    let variant = variants.into_iter().find(|variant| variant.name == name);
    variant.unwrap_or_else(|| panic!("{name}: found no such variant"))
}

/// A folder for one call: tests of one process compile at the same time.
fn in_temporary_folder<T>(use_it: impl FnOnce(&Path) -> T) -> T {
    let thread = format!("{:?}", std::thread::current().id()).replace(['(', ')'], "");
    let folder = std::env::temp_dir().join(format!("afterlight-{}-{thread}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let result = use_it(&folder);
    std::fs::remove_dir_all(&folder).expect("the folder");
    result
}

/// Compiles a file as if it stood in `folder`; headers in `first` come before others of their names.
fn compile(name: &str, path: &Path, folder: &Path, defines: &[&str], first: &Path) -> Shader {
    let file = path.file_name().expect("a file").to_str().expect("a name");
    let variant = manifest::Variant {
        name: name.to_owned(),
        stage: manifest::stage_of(file).expect("a stage"),
        path: path.to_owned(),
        folder: folder.to_owned(),
        source: None,
        defines: defines.iter().map(|d| ((*d).to_owned(), None)).collect(),
    };
    let [techniques, stages, _] = folders();
    let compiler = Compiler::new().override_dir(first).include_dir(techniques).include_dir(stages);
    compiler.compile(&variant).unwrap_or_else(|e| panic!("{e}")).shader
}
