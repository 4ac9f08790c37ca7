//! A scene on a device with a view of it: what `render`, `compare` and `bench` begin with.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use afterlight_graph::gpu::{Device, DeviceOptions};
use afterlight_measure::{DeviceRecord, SceneRecord, SettingsRecord};
use afterlight_scene::camera::CameraPath;
use afterlight_scene::{Camera, LightKind, LoadOptions, Projection, Scene, camera, lights, load_source};
use afterlight_techniques::cost::Workload;
use afterlight_techniques::{
    Indirect, Params, Post, Renderer, SceneGpu, Settings, Shadows, Technique, registry,
};

use crate::args::{self, CommonArgs};
use crate::failure::Failure;
use crate::progress::Progress;

/// A technique with the parameters that were asked for.
pub struct Chosen {
    pub technique: &'static dyn Technique,
    pub params: Params,
}

impl Chosen {
    pub fn id(&self) -> &'static str {
        self.technique.info().id
    }
}

/// Finds a technique; the error lists what there is.
pub fn technique(option: &str, id: &str) -> Result<&'static dyn Technique, Failure> {
    afterlight_techniques::find(id).ok_or_else(|| {
        let known: Vec<&str> = registry().iter().map(|technique| technique.info().id).collect();
        Failure::option(option, format!("{id:?}"), format!("one of: {}", known.join(", ")))
    })
}

/// Finds techniques, `all` for all, each once, and gives them their parameters.
pub fn choose(option: &str, ids: &[String], sets: &[String]) -> Result<Vec<Chosen>, Failure> {
    let mut techniques: Vec<&'static dyn Technique> = Vec::new();
    for id in ids.iter().map(|id| id.trim()) {
        let more = if id == "all" { registry().to_vec() } else { vec![technique(option, id)?] };
        for one in more {
            if techniques.iter().all(|known| known.info().id != one.info().id) {
                techniques.push(one);
            }
        }
    }
    let mut chosen: Vec<Chosen> =
        techniques.into_iter().map(|technique| Chosen { technique, params: Params::default() }).collect();
    for set in sets {
        apply(&mut chosen, set)?;
    }
    Ok(chosen)
}

/// Applies one `--set`: `KEY=VALUE` to every technique that has the key, `ID.KEY=VALUE` to one.
fn apply(chosen: &mut [Chosen], set: &str) -> Result<(), Failure> {
    let Some((name, value)) = set.split_once('=') else {
        return Err(Failure::option("--set", format!("{set:?}"), "KEY=VALUE or ID.KEY=VALUE"));
    };
    if let Some((id, key)) = name.split_once('.') {
        let known: Vec<&str> = chosen.iter().map(Chosen::id).collect();
        let Some(one) = chosen.iter_mut().find(|one| one.id() == id) else {
            let expected = format!("one of the techniques that run: {}", known.join(", "));
            return Err(Failure::option("--set", format!("technique {id:?}"), expected));
        };
        one.params.set(one.technique.info(), key, value)?;
        return Ok(());
    }
    let mut taken = false;
    for one in chosen.iter_mut() {
        let info = one.technique.info();
        if Params::known(info).any(|param| param.key == name) {
            one.params.set(info, name, value)?;
            taken = true;
        }
    }
    if taken {
        return Ok(());
    }
    let mut known: Vec<&str> =
        chosen.iter().flat_map(|one| Params::known(one.technique.info())).map(|param| param.key).collect();
    known.sort_unstable();
    known.dedup();
    Err(Failure::option("--set", format!("parameter {name:?}"), format!("one of: {}", known.join(", "))))
}

/// Milliseconds that the steps before the first frame took.
#[derive(Clone, Copy, Debug, Default)]
pub struct StartUp {
    /// Reading the scene, beside opening the device.
    pub load_ms: f64,
    /// Decoding textures and copying the scene to the device.
    pub upload_ms: f64,
}

/// A scene on a device with a view of it.
pub struct Session {
    pub renderer: Renderer,
    pub device: DeviceRecord,
    pub scene: SceneRecord,
    pub workload: Workload,
    pub warnings: Vec<String>,
    pub start_up: StartUp,
    camera: String,
}

/// Milliseconds since then.
pub fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Folder of the pipeline cache; none where the system names no place for it.
fn cache_folder() -> Option<PathBuf> {
    let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
    Some(cache.join("afterlight"))
}

/// Opens the device that the options ask for.
pub fn open_device(common: &CommonArgs) -> Result<Device, Failure> {
    let device = Device::open(&DeviceOptions {
        select: common.device.clone(),
        validate: common.validate,
        pipeline_cache_dir: cache_folder(),
    })?;
    check_samples(&device, common.samples)?;
    Ok(device)
}

fn check_samples(device: &Device, samples: u32) -> Result<(), Failure> {
    let features = device.features();
    if samples == 1 || features.supports_samples(samples, false) {
        return Ok(());
    }
    let there: Vec<String> = [1, 2, 4, 8, 16]
        .into_iter()
        .filter(|count| *count == 1 || features.supports_samples(*count, false))
        .map(|count: u32| count.to_string())
        .collect();
    Err(Failure::option(
        "--samples",
        samples,
        format!("one of: {} (what {} has)", there.join(", "), device.info().name),
    ))
}

/// Loads a scene while the device opens; also returns the milliseconds that it took.
fn load(source: &str, common: &CommonArgs, progress: &Progress) -> Result<(Device, Scene, f64), Failure> {
    let start = Instant::now();
    let spinner = progress.spinner(&format!("loading {source}"));
    let (device, scene) = std::thread::scope(|scope| {
        let device = scope.spawn(|| open_device(common));
        let scene = load_source(source, &LoadOptions { time_s: common.time });
        let device = device.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (device, scene)
    });
    spinner.finish_and_clear();
    // A scene that does not load is told before a device that is not there: the scene is what was named.
    let scene = scene?;
    Ok((device?, scene, ms_since(start)))
}

impl Session {
    /// Loads a scene while the device opens, and uploads it.
    pub fn open(
        source: &str,
        common: &CommonArgs,
        keep_hdr: bool,
        progress: &Progress,
    ) -> Result<Session, Failure> {
        let (device, scene, load_ms) = load(source, common, progress)?;
        Session::with_device(&device, source, scene, common, keep_hdr, progress, load_ms)
    }

    /// As [`Session::open`], with a camera path: the file's, else a fly-through of the scene. The view is that of its start unless
    /// `--camera` names another. Where indirect light is asked for and there is no light, neither the scene's nor seeded ones,
    /// one seeded light is put in, and `common` says so.
    pub fn open_along(
        source: &str,
        common: &mut CommonArgs,
        file: Option<&Path>,
        progress: &Progress,
    ) -> Result<(Session, CameraPath), Failure> {
        // A path that does not read is told before a scene is loaded for it.
        let from_file = file.map(CameraPath::load).transpose()?;
        let (device, scene, load_ms) = load(source, common, progress)?;
        let path = from_file.unwrap_or_else(|| CameraPath::fly_through(&scene));
        if common.indirect != args::Indirect::None && common.lights == 0 && scene.lights.is_empty() {
            common.lights = 1;
        }
        let session = Session::with_device(&device, source, scene, common, false, progress, load_ms)?;
        match common.camera {
            Some(_) => Ok((session, path)),
            None => Ok((session.look(path.at(0.0))?, path)),
        }
    }

    /// The same scene seen by another camera.
    fn look(self, camera: Camera) -> Result<Session, Failure> {
        let name = camera.name.clone();
        let (renderer, workload) = self.with_settings(|settings| settings.camera = camera)?;
        Ok(Session { renderer, workload, camera: name, ..self })
    }

    /// A renderer of the same scene with other settings, and the cost model's symbols for its view.
    pub fn with_settings(&self, change: impl FnOnce(&mut Settings)) -> Result<(Renderer, Workload), Failure> {
        let mut settings = self.renderer.settings().clone();
        change(&mut settings);
        let renderer =
            Renderer::with_scene(self.renderer.device(), Arc::clone(self.renderer.scene()), &settings)?;
        Ok((renderer, workload(self.workload.objects, self.workload.object_vertices, &settings)))
    }

    fn with_device(
        device: &Device,
        source: &str,
        scene: Scene,
        common: &CommonArgs,
        keep_hdr: bool,
        progress: &Progress,
        load_ms: f64,
    ) -> Result<Session, Failure> {
        let start = Instant::now();
        let camera = camera::select(&scene, common.camera.as_deref())?;
        let lights = match common.lights {
            0 => scene.lights.clone(),
            count => lights::seeded_lights(&scene.bounds_ws(), count, common.light_seed),
        };
        let settings = Settings {
            samples: common.samples,
            camera,
            lights,
            environment: scene.environment,
            keep_hdr,
            post: common.post.into(),
            tessellate_px: common.tessellate,
            displacement_m: common.displacement * 1e-3,
            view: common.view.clone(),
            indirect: common.indirect.into(),
            shadows: common.shadows.setting().unwrap_or_default(),
            transparency: common.transparency.into(),
            ..Settings::for_scene(&scene, common.width, common.height)
        };
        let settings = Settings {
            rsm_size_px: common.shadow_map_size.unwrap_or(settings.rsm_size_px),
            shadow_map_size_px: common.shadow_map_size.unwrap_or(settings.shadow_map_size_px),
            ..settings
        };
        let bar = progress.bar("textures", scene.images.len() as u64);
        let on_device = SceneGpu::upload(device, &scene, &|done, steps| {
            bar.set_length(steps as u64);
            bar.set_position(done as u64);
        });
        bar.finish_and_clear();
        let on_device = on_device?;
        let record = SceneRecord {
            name: source.to_owned(),
            triangles: scene.triangle_count(),
            draws: scene.instances.len() as u64,
            lights: settings.lights.len() as u64,
        };
        let workload = workload(scene.instances.len() as f64, vertices(&scene), &settings);
        let mut warnings = scene.warnings.clone();
        warnings.extend(on_device.warnings.iter().cloned());
        drop(scene);
        let camera = settings.camera.name.clone();
        let renderer = Renderer::with_scene(device, Arc::clone(&on_device), &settings)?;
        warnings.extend(renderer.warnings());
        let info = device.info();
        Ok(Session {
            renderer,
            device: DeviceRecord {
                name: info.name.clone(),
                driver: info.driver.clone(),
                api: info.api.clone(),
                kind: info.kind.to_owned(),
            },
            scene: record,
            workload,
            warnings,
            start_up: StartUp { load_ms, upload_ms: ms_since(start) },
            camera,
        })
    }

    /// The settings as a run record keeps them.
    pub fn settings_record(&self, common: &CommonArgs, frames: u32, reference: &str) -> SettingsRecord {
        let settings = self.renderer.settings();
        SettingsRecord {
            width: common.width,
            height: common.height,
            samples: common.samples,
            frames,
            camera: self.camera.clone(),
            reference: reference.to_owned(),
            post: Post::from(common.post).name().to_owned(),
            tessellate_px: common.tessellate,
            displacement_mm: common.displacement,
            indirect: settings.indirect.name().to_owned(),
            rsm_size: (settings.indirect == Indirect::Rsm).then_some(settings.rsm_size_px),
            shadows: settings.shadows.name().to_owned(),
            shadow_map_size: (settings.shadows == Shadows::Map).then_some(settings.shadow_map_size_px),
            transparency: settings.transparency.name().to_owned(),
            light_seed: (common.lights > 0).then_some(common.light_seed),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    /// Ends the use of the device: keeps compiled pipelines for the next start, and fails on validation messages.
    pub fn finish(&self, common: &CommonArgs, progress_quiet: bool) -> Result<(), Failure> {
        let device = self.renderer.device();
        if let Err(error) = device.save_pipeline_cache()
            && !progress_quiet
        {
            eprintln!("afterlight: warning: {error}");
        }
        let messages = device.validation_messages();
        if common.validate && !messages.is_empty() {
            return Err(Failure::Validation(messages));
        }
        Ok(())
    }
}

/// Vertices of a light volume (an icosahedron subdivided once).
const LIGHT_VOLUME_VERTICES: f64 = 42.0;

/// Vertices of all instances.
fn vertices(scene: &Scene) -> f64 {
    scene.instances.iter().map(|one| f64::from(scene.meshes[one.mesh as usize].vertex_count)).sum()
}

/// The cost model's symbols for a view of so many objects and vertices. Fragments of objects are not known before a frame is drawn: they begin as the
/// pixels, once covered, and are replaced by what the reference counts.
fn workload(objects: f64, object_vertices: f64, settings: &Settings) -> Workload {
    let pixels = f64::from(settings.width_px) * f64::from(settings.height_px);
    let lights = settings.lights.len() as f64;
    let light_fragments = settings
        .lights
        .iter()
        .map(|light| match light.kind {
            LightKind::Directional => pixels,
            _ => {
                sphere_pixels(&settings.camera, light.position_ws, light.range_m, settings.height_px, pixels)
            }
        })
        .sum();
    Workload {
        objects,
        lights,
        object_vertices,
        light_vertices: lights * LIGHT_VOLUME_VERTICES,
        object_fragments: pixels,
        light_fragments,
        pixels,
        tiles: f64::from(settings.width_px.div_ceil(16)) * f64::from(settings.height_px.div_ceil(16)),
        shading_samples: f64::from(settings.samples),
        light_list_floats: light_fragments / 256.0,
        ..Workload::default()
    }
}

/// Pixels that a light's sphere covers, by the area of its circle, at most the image; 0 behind the eye.
fn sphere_pixels(camera: &Camera, center_ws: glam::Vec3, radius_m: f32, height_px: u32, pixels: f64) -> f64 {
    let center_vs = camera.view_from_world().transform_point3(center_ws);
    let distance_m = f64::from(-center_vs.z);
    let radius_m = f64::from(radius_m);
    if !radius_m.is_finite() || f64::from(center_vs.length()) <= radius_m {
        return pixels;
    }
    if distance_m <= -radius_m {
        return 0.0;
    }
    let half_height_m = match camera.projection {
        Projection::Perspective { fov_y_rad, .. } => {
            distance_m.max(radius_m) * (f64::from(fov_y_rad) / 2.0).tan()
        }
        Projection::Orthographic { half_height_m, .. } => f64::from(half_height_m),
    };
    let radius_px = radius_m / half_height_m * f64::from(height_px) / 2.0;
    (std::f64::consts::PI * radius_px * radius_px).min(pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ids(ids: &[&str]) -> Vec<String> {
        ids.iter().map(|id| (*id).to_owned()).collect()
    }

    #[test]
    fn all_is_the_registry_and_nothing_is_twice() {
        let all = choose("--techniques", &ids(&["all"]), &[]).expect("all");
        assert_eq!(all.len(), registry().len());
        let twice = choose("--techniques", &ids(&["forward", "all", "forward"]), &[]).expect("all");
        assert_eq!(twice.len(), registry().len());
    }

    #[test]
    fn unknown_names_list_what_there_is() {
        let text = |result: Result<Vec<Chosen>, Failure>| {
            let failure = result.err().expect("fails");
            assert_eq!(failure.code(), 2);
            failure.lines().remove(0)
        };
        let line = text(choose("--techniques", &ids(&["backward"]), &[]));
        assert!(line.contains("\"backward\"") && line.contains("forward"), "{line}");
        let line = text(choose("--techniques", &ids(&["forward"]), &ids(&["nokey=1"])));
        assert!(line.contains("nokey") && line.contains("cull"), "{line}");
        let line = text(choose("--techniques", &ids(&["forward"]), &ids(&["tiled.cull=none"])));
        assert!(line.contains("tiled") && line.contains("forward"), "{line}");
        let line = text(choose("--techniques", &ids(&["forward"]), &ids(&["cull=perhaps"])));
        assert!(line.contains("perhaps") && line.contains("frustum"), "{line}");
        let line = text(choose("--techniques", &ids(&["forward"]), &ids(&["cull"])));
        assert!(line.contains("KEY=VALUE"), "{line}");
    }

    #[test]
    fn parameters_reach_all_or_one() {
        let chosen = choose(
            "--techniques",
            &ids(&["forward", "deferred"]),
            &ids(&["cull=none", "deferred.order=scene"]),
        )
        .expect("known");
        let text = |index: usize, key: &str| {
            chosen[index].params.text(chosen[index].technique.info(), key).to_owned()
        };
        assert_eq!((text(0, "cull"), text(1, "cull")), ("none".into(), "none".into()));
        assert_eq!((text(0, "order"), text(1, "order")), ("center".into(), "scene".into()));
    }
}
