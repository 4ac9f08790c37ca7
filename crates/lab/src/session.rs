//! A scene on a device with a view of it: what everything that draws frames begins with.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use afterlight_graph::gpu::{Device, DeviceOptions};
use afterlight_measure::{DeviceRecord, SceneRecord, SettingsRecord};
use afterlight_renderer::Renderer;
use afterlight_scene::camera::CameraPath;
use afterlight_scene::{Camera, LoadOptions, Scene, camera, lights, load_source};
use afterlight_techniques::cost::Workload;
use afterlight_techniques::{Effects, Indirect, SceneGpu, Settings, Shadows};

use crate::spec::SAMPLES;
use crate::{FrameSpec, LabError, Listener};

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
    /// Prepares techniques to draw it.
    pub renderer: Renderer,
    /// The device, as run records have it.
    pub device: DeviceRecord,
    /// The scene, as run records have it.
    pub scene: SceneRecord,
    /// The cost model's symbols for the view.
    pub workload: Workload,
    /// What of the scene or the settings is not as it was asked for, a line each.
    pub warnings: Vec<String>,
    /// What the start took.
    pub start_up: StartUp,
    /// The camera's name.
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

/// Opens the device that a specification asks for.
///
/// # Errors
/// No such device, or one that has not as many samples a pixel.
pub fn open_device(spec: &FrameSpec) -> Result<Device, LabError> {
    let device = Device::open(&DeviceOptions {
        select: spec.device.clone(),
        validate: spec.validate,
        pipeline_cache_dir: cache_folder(),
        ..DeviceOptions::default()
    })?;
    check_samples(&device, spec.samples)?;
    Ok(device)
}

fn check_samples(device: &Device, samples: u32) -> Result<(), LabError> {
    let features = device.features();
    if samples == 1 || features.supports_samples(samples, false) {
        return Ok(());
    }
    let there: Vec<String> = SAMPLES
        .into_iter()
        .filter(|count| *count == 1 || features.supports_samples(*count, false))
        .map(|count| count.to_string())
        .collect();
    Err(LabError::setting(
        "samples",
        samples,
        format!("one of: {} (what {} has)", there.join(", "), device.info().name),
    ))
}

/// Loads a scene while the device opens; also returns the milliseconds that it took.
fn load(source: &str, spec: &FrameSpec, listener: &dyn Listener) -> Result<(Device, Scene, f64), LabError> {
    let start = Instant::now();
    let task = listener.task(&format!("loading {source}"), 0);
    let (device, scene) = std::thread::scope(|scope| {
        let device = scope.spawn(|| open_device(spec));
        let scene = load_source(source, &LoadOptions { time_s: spec.time_s });
        let device = device.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (device, scene)
    });
    drop(task);
    // A scene that does not load is told before a device that is not there: the scene is what was named.
    let scene = scene?;
    Ok((device?, scene, ms_since(start)))
}

/// What frames of a scene look like by a specification.
///
/// # Errors
/// A camera that the scene has not.
pub(crate) fn settings_of(scene: &Scene, spec: &FrameSpec) -> Result<Settings, LabError> {
    let lights = match spec.lights {
        0 => scene.lights.clone(),
        count => lights::seeded_lights(&scene.bounds_ws(), count, spec.light_seed),
    };
    Ok(Settings {
        samples: spec.samples,
        camera: camera::select(scene, spec.camera.as_deref())?,
        lights,
        environment: scene.environment,
        effects: spec.effects,
        view: spec.view.clone(),
        ..Settings::for_scene(scene, spec.width, spec.height)
    })
}

impl Session {
    /// Loads a scene while the device opens, and uploads it. Linear radiance is kept where `keep_hdr` says so.
    ///
    /// # Errors
    /// The scene, its camera, the device.
    pub fn open(
        source: &str,
        spec: &FrameSpec,
        keep_hdr: bool,
        listener: &dyn Listener,
    ) -> Result<Session, LabError> {
        let (device, scene, load_ms) = load(source, spec, listener)?;
        Session::with_device(&device, source, &scene, spec, keep_hdr, listener, load_ms)
    }

    /// As [`Session::open`], with the scene, for who looks at it without a device as well.
    ///
    /// # Errors
    /// As [`Session::open`].
    pub fn open_with_scene(
        source: &str,
        spec: &FrameSpec,
        listener: &dyn Listener,
    ) -> Result<(Session, Scene), LabError> {
        let (device, scene, load_ms) = load(source, spec, listener)?;
        let session = Session::with_device(&device, source, &scene, spec, false, listener, load_ms)?;
        Ok((session, scene))
    }

    /// As [`Session::open`], with a camera path: the file's, else a fly-through of the scene. The view is that of its start unless
    /// `--camera` names another. Where indirect light is asked for and there is no light, neither the scene's nor seeded ones,
    /// one seeded light is put in, and `spec` says so.
    ///
    /// # Errors
    /// As [`Session::open`], and a path that does not read.
    pub fn open_along(
        source: &str,
        spec: &mut FrameSpec,
        file: Option<&Path>,
        listener: &dyn Listener,
    ) -> Result<(Session, CameraPath), LabError> {
        // A path that does not read is told before a scene is loaded for it.
        let from_file = file.map(CameraPath::load).transpose()?;
        let (device, scene, load_ms) = load(source, spec, listener)?;
        let path = from_file.map_or_else(|| CameraPath::fly_through(&scene), |path| path.through(&scene));
        if spec.effects.indirect.method != Indirect::None && spec.lights == 0 && scene.lights.is_empty() {
            spec.lights = 1;
        }
        let session = Session::with_device(&device, source, &scene, spec, false, listener, load_ms)?;
        drop(scene);
        match spec.camera {
            Some(_) => Ok((session, path)),
            None => Ok((session.look(path.at(0.0))?, path)),
        }
    }

    /// The same scene seen by another camera.
    fn look(self, camera: Camera) -> Result<Session, LabError> {
        let name = camera.name.to_string();
        let (renderer, workload) = self.with_settings(|settings| settings.camera = camera)?;
        Ok(Session { renderer, workload, camera: name, ..self })
    }

    /// A renderer of the same scene with other settings, and the cost model's symbols for its view.
    ///
    /// # Errors
    /// A size that the device does not take, the device itself.
    pub fn with_settings(
        &self,
        change: impl FnOnce(&mut Settings),
    ) -> Result<(Renderer, Workload), LabError> {
        let mut settings = self.renderer.settings().clone();
        change(&mut settings);
        let renderer =
            Renderer::with_scene(self.renderer.device(), Arc::clone(self.renderer.scene()), &settings)?;
        Ok((
            renderer,
            afterlight_predict::of_view(self.workload.objects, self.workload.object_vertices, &settings),
        ))
    }

    fn with_device(
        device: &Device,
        source: &str,
        scene: &Scene,
        spec: &FrameSpec,
        keep_hdr: bool,
        listener: &dyn Listener,
        load_ms: f64,
    ) -> Result<Session, LabError> {
        let start = Instant::now();
        let settings = Settings { keep_hdr, ..settings_of(scene, spec)? };
        let bar = listener.task("textures", scene.images.len() as u64);
        let on_device = SceneGpu::upload(device, scene, &|done, steps| {
            bar.place(done as u64, steps as u64);
        });
        drop(bar);
        let on_device = on_device?;
        let record = SceneRecord {
            name: source.to_owned(),
            triangles: scene.triangle_count(),
            draws: scene.instances.len() as u64,
            lights: settings.lights.len() as u64,
        };
        let vertices = afterlight_predict::vertices(scene);
        let workload = afterlight_predict::of_view(scene.instances.len() as f64, vertices, &settings);
        let mut warnings = scene.warnings.clone();
        warnings.extend(on_device.warnings.iter().cloned());
        let camera = settings.camera.name.to_string();
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
    pub fn settings_record(&self, spec: &FrameSpec, frames: u32, reference: &str) -> SettingsRecord {
        let Effects { post, tessellation, shadows, indirect, transparency } = spec.effects;
        SettingsRecord {
            width: spec.width,
            height: spec.height,
            samples: spec.samples,
            frames,
            camera: self.camera.clone(),
            reference: reference.to_owned(),
            post: post.filter.name().to_owned(),
            tessellate_px: tessellation.edge_px,
            displacement_mm: tessellation.displacement_mm,
            indirect: indirect.method.name().to_owned(),
            rsm_size: (indirect.method == Indirect::Rsm).then_some(indirect.map_size_px),
            shadows: shadows.method.name().to_owned(),
            shadow_map_size: (shadows.method == Shadows::Map).then_some(shadows.map_size_px),
            transparency: transparency.order.name().to_owned(),
            light_seed: (spec.lights > 0).then_some(spec.light_seed),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    /// Ends the use of the device: keeps compiled pipelines for the next start, and warns where it cannot.
    ///
    /// # Errors
    /// [`LabError::Validation`] where validation is on and said anything.
    pub fn finish(&self, spec: &FrameSpec, listener: &dyn Listener) -> Result<(), LabError> {
        let device = self.renderer.device();
        if let Err(error) = device.save_pipeline_cache() {
            listener.warn(&error.to_string());
        }
        let messages = device.validation_messages();
        if spec.validate && !messages.is_empty() {
            return Err(LabError::Validation(messages));
        }
        Ok(())
    }
}
