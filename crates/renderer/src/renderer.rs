//! From a scene and a technique to an image.

use std::sync::Arc;

use afterlight_graph::{
    BufferRole, Executor, Graph, ImageHandle, KeptHistory, ResourceId,
    gpu::{self, vk},
};
use afterlight_scene::{Camera, Scene};
use afterlight_shader::{Shader, structs::FrameConstants};

use crate::prepared::{Kept, Moved, Prepared, Viewed};
use afterlight_frame::{
    Board, CameraView, ChangesWith, CullOn, DrawParams, Frame, MAX_DISPLACEMENT_MM, MIN_TESSELLATE_PX,
    OpaqueDepth, Params, SceneBuffers, SceneLights, Settings, Technique, TechniqueError, TessellationEffect,
    ViewInputs,
    camera_view::{background_radiance, coarse_depth_warning},
    capacity::{self, Capacities},
    completed, put,
    scene::{SceneGpu, draw_list},
    upload::upload_slice,
    views,
};
use afterlight_stages::{
    compose::{
        post,
        transparent::{self, BlendedList},
    },
    lights::volumes,
    shared::{cull::SceneOfDraws, deform, indirect, shadow},
    views::{light_pair_colors, of as technique_views, velocity_colors},
};

/// Times that a view is recorded at most until everything that can overflow has room.
const RECORDINGS_MAX: u32 = 8;

/// Layout in which uploads leave images.
const UPLOADED: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

/// What is recorded.
#[derive(Clone, Copy)]
pub(crate) struct Recipe<'a> {
    pub technique: &'a dyn Technique,
    /// All of the technique's.
    pub params: &'a Params,
    /// Whether the frame is to be run from other views too.
    pub moves: bool,
    /// Whether surfaces and lights may move then.
    pub scene_moves: bool,
    /// Whose history the frame goes on with, where it has the same.
    pub earlier: Option<&'a KeptHistory>,
}

/// A scene on a device with a view of it: prepares techniques to run. Clones share what is on the device.
#[derive(Clone)]
pub struct Renderer {
    device: gpu::Device,
    scene: Arc<SceneGpu>,
    lights: Arc<SceneLights>,
    settings: Settings,
    volume: gpu::Buffer,
    volume_indices: gpu::Buffer,
    extra_shaders: Vec<Shader>,
}

impl Renderer {
    /// Uploads a scene and its lights.
    ///
    /// # Errors
    /// An image that does not decode, something larger than the device takes, the device itself.
    pub fn new(device: &gpu::Device, scene: &Scene, settings: &Settings) -> Result<Self, TechniqueError> {
        Self::with_scene(device, SceneGpu::upload(device, scene, &|_, _| {})?, settings)
    }

    /// As [`Renderer::new`] with a scene that is on the device already.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn with_scene(
        device: &gpu::Device,
        scene: Arc<SceneGpu>,
        settings: &Settings,
    ) -> Result<Self, TechniqueError> {
        check_size(device, settings)?;
        let mut uploader = device.uploader()?;
        let lights = Arc::new(SceneLights::new(device, &mut uploader, &settings.lights)?);
        let (vertices, indices) = volumes::icosphere();
        let volume = upload_slice(device, &mut uploader, "light volume vertices", &vertices)?;
        let volume_indices = upload_slice(device, &mut uploader, "light volume indices", &indices)?;
        uploader.finish()?;
        Ok(Self {
            device: device.clone(),
            scene,
            lights,
            settings: settings.clone(),
            volume,
            volume_indices,
            extra_shaders: Vec::new(),
        })
    }

    /// A renderer of the same scene and shaders with other settings. Lights that stay are shared, so that another size costs no upload.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn with_settings(&self, settings: Settings) -> Result<Self, TechniqueError> {
        check_size(&self.device, &settings)?;
        let mut other = self.clone();
        if settings.lights != self.settings.lights {
            let mut uploader = self.device.uploader()?;
            other.lights = Arc::new(SceneLights::new(&self.device, &mut uploader, &settings.lights)?);
            uploader.finish()?;
        }
        other.settings = settings;
        Ok(other)
    }

    /// Adds shaders of techniques from outside this crate; their names come before the built-in ones.
    pub fn add_shaders(&mut self, shaders: impl IntoIterator<Item = Shader>) {
        self.extra_shaders.extend(shaders);
    }

    /// The device.
    pub fn device(&self) -> &gpu::Device {
        &self.device
    }

    /// The scene on the device.
    pub fn scene(&self) -> &Arc<SceneGpu> {
        &self.scene
    }

    /// The lights on the device.
    pub fn lights(&self) -> &SceneLights {
        &self.lights
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Nearest and farthest view distance, m, that a surface of the scene can have in this view: what clusters lie between. From the
    /// eye as the frame has it, see [`CameraView::eye_moved_m`].
    pub fn distance_range_m(&self) -> [f32; 2] {
        let bounds_ws = self.scene.rest.bounds_ws(self.settings.effects.tessellation.displacement_m());
        self.view().constants(&self.settings, &self.lights, &bounds_ws).distance_range_m
    }

    fn view(&self) -> CameraView {
        CameraView::fitted(&self.settings, &self.scene.rest)
    }

    /// What of the settings this scene or this device cannot give, a line each.
    pub fn warnings(&self) -> Vec<String> {
        let coarse = coarse_depth_warning(
            self.device.depth_stencil_format(),
            self.view().projection(),
            self.distance_range_m(),
        );
        [indirect::warning, shadow::warning]
            .into_iter()
            .filter_map(|warning| warning(&self.settings, &self.scene))
            .chain(coarse)
            .collect()
    }

    /// Records a technique, plans its graph, allocates memory and compiles pipelines.
    ///
    /// # Errors
    /// Features or sample counts that technique or device lack, the graph, the device.
    pub fn prepare(&self, technique: &dyn Technique, params: &Params) -> Result<Prepared, TechniqueError> {
        self.prepare_with(technique, params, |_, _| {})
    }

    /// As [`Renderer::prepare`]; `also` may declare more passes on the image of linear radiance, for tests.
    ///
    /// # Errors
    /// As [`Renderer::prepare`].
    pub fn prepare_with(
        &self,
        technique: &dyn Technique,
        params: &Params,
        also: impl Fn(&mut Graph, &ImageHandle),
    ) -> Result<Prepared, TechniqueError> {
        self.check(technique)?;
        self.check_tessellation(technique)?;
        let params = &completed(technique, params);
        let recipe = Recipe { technique, params, moves: false, scene_moves: false, earlier: None };
        self.prepare_recipe(&recipe, &self.settings, also)
    }

    /// As [`Self::prepare`] for views that change: what any view of the scene may need is recorded.
    pub(crate) fn prepare_to_move(
        &self,
        recipe: &Recipe<'_>,
        camera: &Camera,
    ) -> Result<Prepared, TechniqueError> {
        self.check(recipe.technique)?;
        self.check_tessellation(recipe.technique)?;
        let settings = Settings { camera: camera.clone(), ..self.settings.clone() };
        self.prepare_recipe(recipe, &settings, |_, _| {})
    }

    fn prepare_recipe(
        &self,
        recipe: &Recipe<'_>,
        settings: &Settings,
        also: impl Fn(&mut Graph, &ImageHandle),
    ) -> Result<Prepared, TechniqueError> {
        let mut capacities = Capacities::default();
        for _ in 1..RECORDINGS_MAX {
            let mut prepared = self.record(recipe, settings, Moved::default(), capacities, &also)?;
            if !prepared.capacities.is_watched() {
                return Ok(prepared);
            }
            // What the view needs is known after a frame of it.
            let mut counters = Vec::new();
            for _ in 0..prepared.capacities.counting_frames() {
                prepared.run()?;
                counters = capacity::most(counters, prepared.counters()?);
            }
            match prepared.capacities.next(&counters) {
                Some(next) => capacities = next,
                None => return Ok(prepared),
            }
        }
        // What it needs still grows: its counters tell what it drops.
        self.record(recipe, settings, Moved::default(), capacities, &also)
    }

    fn check(&self, technique: &dyn Technique) -> Result<(), TechniqueError> {
        let info = technique.info();
        let features = self.device.features();
        let missing = technique.missing(features);
        if !missing.is_empty() {
            return Err(TechniqueError::Unavailable { technique: info.id, missing: missing.join(", ") });
        }
        let samples = self.settings.samples;
        let there = |count: u32| count == 1 || features.supports_samples(count, false);
        if !info.samples.contains(&samples) || !there(samples) {
            let known: Vec<String> =
                info.samples.iter().filter(|count| there(**count)).map(u32::to_string).collect();
            return Err(TechniqueError::Samples {
                technique: info.id,
                found: samples,
                expected: known.join(", "),
            });
        }
        let view = &self.settings.view;
        let known = [&[views::FINAL], &technique_views(technique)[..]].concat();
        if !known.contains(&view.as_str()) {
            return Err(TechniqueError::UnknownView {
                technique: info.id,
                found: view.clone(),
                known: known.join(", "),
            });
        }
        Ok(())
    }

    /// Checks what is asked of tessellation.
    fn check_tessellation(&self, technique: &dyn Technique) -> Result<(), TechniqueError> {
        let info = technique.info();
        let TessellationEffect { edge_px, displacement_mm } = self.settings.effects.tessellation;
        let conflict = |found: String, expected: String| {
            Err(TechniqueError::Conflict { technique: info.id, found, expected })
        };
        if !(0.0..=MAX_DISPLACEMENT_MM).contains(&displacement_mm) {
            let expected = format!("from 0 to {MAX_DISPLACEMENT_MM} mm");
            return conflict(format!("a displacement of {displacement_mm} mm"), expected);
        }
        let Some(px) = edge_px else {
            return match displacement_mm > 0.0 {
                true => conflict("displacement alone".to_owned(), "tessellation with it".to_owned()),
                false => Ok(()),
            };
        };
        if !info.tessellation {
            return Err(TechniqueError::Untessellated { technique: info.id });
        }
        if !px.is_finite() || px < MIN_TESSELLATE_PX {
            let expected = format!("at least {MIN_TESSELLATE_PX}");
            return conflict(format!("tessellation to edges of {px} pixels"), expected);
        }
        if !self.device.features().tessellation_shader {
            let missing = "tessellation shaders".to_owned();
            return Err(TechniqueError::Unavailable { technique: info.id, missing });
        }
        Ok(())
    }

    /// Records a frame with capacities for what can overflow, and fills its inputs for the view of `settings`, whose all but the camera is
    /// the renderer's.
    pub(crate) fn record(
        &self,
        recipe: &Recipe<'_>,
        settings: &Settings,
        moved: Moved,
        capacities: Capacities,
        also: &impl Fn(&mut Graph, &ImageHandle),
    ) -> Result<Prepared, TechniqueError> {
        let Recipe { technique, params, moves, scene_moves, earlier } = *recipe;
        let options = *params.typed::<DrawParams>();
        let viewed = Viewed::new(settings, self.scene.clone(), self.lights.clone(), moved, options);
        let view = viewed.view();
        let blended = BlendedList::of_view(&view, &options, self.device.features(), moves);

        let inputs = ViewInputs::default();
        let mut graph = Graph::new();
        let shaders: &[&[Shader]] = &[&self.extra_shaders, technique.shaders(), &afterlight_stages::SHADERS];
        let mut frame = Frame {
            width_px: settings.width_px,
            height_px: settings.height_px,
            samples: settings.samples,
            params,
            scene: &self.scene,
            lights: view.lights,
            clip_from_world: view.camera.clip_from_world,
            eye_moved_m: view.camera.eye_moved_m,
            background_radiance: background_radiance(settings).into(),
            view: &settings.view,
            tessellate_px: settings.effects.tessellation.edge_px,
            displacement_m: settings.effects.tessellation.displacement_m(),
            buffers: self.import(&mut graph, &inputs, (shaders, options.cull_on), scene_moves)?,
            shaders,
            device: &self.device,
            capacities: &capacities,
            inputs: &inputs,
            moves,
            scene_moves,
            board: Board::default(),
        };
        indirect::record(&mut graph, &mut frame, settings)?;
        shadow::record(&mut graph, &mut frame, settings)?;
        let mut hdr = technique.record(&mut graph, &frame)?;
        let depth = if settings.keep_depth { keep_depth(&mut graph, &frame) } else { None };
        if let Some(blended) = &blended {
            hdr = transparent::draw(&mut graph, &frame, blended, hdr)?;
        }
        also(&mut graph, &hdr);
        let counts_pairs = views::counts_light_pairs(&settings.view);
        let hdr_id = (settings.keep_hdr || counts_pairs).then(|| graph.keep(&hdr));
        let shown = match counts_pairs {
            true => light_pair_colors(&mut graph, &frame, &hdr)?,
            false if frame.shows(views::VELOCITY) => velocity_colors(&mut graph, &frame)?,
            false => hdr,
        };
        let final_color =
            post::finish(&self.device, &mut graph, &frame, &shown, settings.effects.post.filter)?;
        let final_color = graph.keep(&final_color);
        drop(frame);
        let plan = graph.plan(&self.device)?;
        let executor = Executor::after(&self.device, plan, earlier)?;
        let kept = Kept {
            hdr: hdr_id.filter(|_| settings.keep_hdr),
            depth,
            light_pairs: hdr_id.filter(|_| counts_pairs),
            final_color,
        };
        let draw_calls =
            draw_list::count(view.visible()) + blended.as_ref().map_or(0, |list| list.draw_count);
        Prepared::new(&self.device, executor, viewed, inputs, capacities, kept, draw_calls)
    }

    /// Brings the scene into a graph; where it is `alive`, the records of its draws and lights are inputs.
    fn import(
        &self,
        graph: &mut Graph,
        inputs: &ViewInputs,
        (shaders, cull_on): (&[&[Shader]], CullOn),
        alive: bool,
    ) -> Result<SceneBuffers, TechniqueError> {
        let s = &self.scene;
        let constants = inputs.declare(
            &self.device,
            graph,
            ("frame constants", BufferRole::Constants),
            (size_of::<FrameConstants>() as u64, vk::BufferUsageFlags::UNIFORM_BUFFER, ChangesWith::Camera),
            |view, bytes| {
                let bounds_ws = view.bounds_ws();
                let of_view = view.camera.constants(view.settings, view.lights, &bounds_ws);
                put(bytes, 0, &[view.time.constants(of_view)]);
            },
        )?;
        let (stream, records) = match alive {
            true => inputs.declare_records(&self.device, graph, s)?,
            false => (
                graph.import_buffer("scene draws", BufferRole::Scene, &s.draws),
                graph.import_image("scene draw records", BufferRole::Scene, &s.draw_data, UPLOADED),
            ),
        };
        let (lights, light_spheres) = match alive {
            true => inputs.declare_lights(&self.device, graph, &self.lights)?,
            false => (
                graph.import_image("lights", BufferRole::Lights, &self.lights.data, UPLOADED),
                graph.import_image("light spheres", BufferRole::Lights, &self.lights.spheres, UPLOADED),
            ),
        };
        let (positions, attributes) = (
            graph.import_buffer("scene positions", BufferRole::Scene, &s.positions),
            graph.import_buffer("scene attributes", BufferRole::Scene, &s.attributes),
        );
        let given = deform::Given { device: &self.device, inputs, scene: s, shaders };
        let (positions, attributes) = deform::record(graph, &given, positions, attributes)?;
        let bounds = match alive && s.deformed.is_some() {
            true => inputs.declare_bounds(&self.device, graph, s)?,
            false => graph.import_image("scene draw bounds", BufferRole::Scene, &s.draw_bounds, UPLOADED),
        };
        let scene = SceneOfDraws {
            device: &self.device,
            inputs,
            shaders,
            scene: s,
            draw_data: &records,
            draw_bounds: &bounds,
            cull_on,
        };
        let draws = scene.in_view(graph)?;
        Ok(SceneBuffers {
            frame: constants,
            draws: stream,
            draw_data: records,
            draw_bounds: bounds,
            materials: graph.import_image("scene materials", BufferRole::Scene, &s.materials, UPLOADED),
            uv_transforms: graph.import_buffer(
                "scene texture transforms",
                BufferRole::Scene,
                &s.uv_transforms,
            ),
            lights,
            light_spheres,
            positions,
            attributes,
            indices: graph.import_buffer("scene indices", BufferRole::Scene, &s.indices),
            commands: draws.commands,
            command_counts: draws.counts,
            volume: graph.import_buffer("light volume vertices", BufferRole::Lights, &self.volume),
            volume_indices: graph.import_buffer(
                "light volume indices",
                BufferRole::Lights,
                &self.volume_indices,
            ),
        })
    }
}

/// Keeps the depth of the frame's opaque surfaces, where the technique has drawn it at one sample in the size of the frame.
fn keep_depth(graph: &mut Graph, frame: &Frame<'_>) -> Option<ResourceId> {
    let depth = frame.board.take::<OpaqueDepth>()?;
    let is_readable = frame.samples == 1;
    let id = is_readable.then(|| graph.keep(&depth.0));
    frame.board.put(depth);
    id
}

fn check_size(device: &gpu::Device, settings: &Settings) -> Result<(), TechniqueError> {
    let limit = u64::from(device.features().max_image_dimension_2d);
    for (what, found) in [
        ("image width in pixels", settings.width_px),
        ("image height in pixels", settings.height_px),
        ("reflective shadow map size in pixels", settings.effects.indirect.map_size_px),
        ("shadow map size in pixels", settings.effects.shadows.map_size_px),
    ] {
        if u64::from(found) > limit || found == 0 {
            return Err(TechniqueError::TooLarge { what: what.to_owned(), found: found.into(), limit });
        }
    }
    Ok(())
}
