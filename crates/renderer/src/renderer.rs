//! From a scene and a technique to an image.

use std::sync::Arc;

use afterlight_graph::{
    BufferRole, Executor, FrameReport, Graph, ImageHandle, ResourceId,
    gpu::{self, vk},
};
use afterlight_scene::Scene;
use afterlight_shader::{Shader, structs::FrameConstants};

use afterlight_frame::{
    Board, CameraView, Cull, DrawParams, Frame, LightPairs, MAX_DISPLACEMENT_MM, MIN_TESSELLATE_PX,
    OpaqueDepth, Params, SceneBuffers, SceneLights, Settings, Technique, TechniqueError, TessellationEffect,
    camera_view::{background_radiance, coarse_depth_warning},
    capacity::{self, Capacities, Counter, Demand},
    completed,
    scene::{SceneGpu, draw_list::DrawList},
    upload::upload_slice,
    views,
};
use afterlight_stages::{
    compose::{
        post,
        transparent::{self, BlendedList},
    },
    lights::volumes,
    shared::{indirect, shadow},
    views::{light_pair_colors, of as technique_views},
};

/// Times that a view is recorded at most until everything that can overflow has room.
const RECORDINGS_MAX: u32 = 8;

/// Layout in which uploads leave images.
const UPLOADED: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

/// A scene on a device with a view of it: prepares techniques to run.
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
        self.view().constants(&self.settings, &self.lights, &self.scene).distance_range_m
    }

    fn view(&self) -> CameraView {
        CameraView::fitted(&self.settings, &self.scene)
    }

    /// What of the settings this scene or this device cannot give, a line each.
    pub fn warnings(&self) -> Vec<String> {
        let coarse = coarse_depth_warning(
            self.device.depth_stencil_format(),
            self.view().projection(),
            self.distance_range_m(),
        );
        [indirect::warning, shadow::warning, transparent::warning]
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
        let options = *params.typed::<DrawParams>();
        let settings = &self.settings;
        let view = self.view();
        let mut draws = DrawList::new(&self.device, &self.scene, options)?;
        draws.update(
            &self.scene,
            view.clip_from_world,
            view.eye_ws,
            settings.effects.tessellation.displacement_m(),
        )?;
        let blended =
            BlendedList::of_view(&self.device, &self.scene, settings, &view, options.cull == Cull::Frustum)?;
        let draws = (&draws, blended.as_ref());
        let constants = self.device.create_buffer(&gpu::BufferDesc {
            name: "frame constants",
            bytes: size_of::<FrameConstants>() as u64,
            usage: vk::BufferUsageFlags::UNIFORM_BUFFER,
            memory: gpu::MemoryKind::Upload,
        })?;
        constants.write(0, bytemuck::bytes_of(&view.constants(settings, &self.lights, &self.scene)))?;

        let mut capacities = Capacities::default();
        for _ in 1..RECORDINGS_MAX {
            let mut prepared =
                self.record(technique, params, &view, draws, &constants, &capacities, &also)?;
            if !capacities.is_watched() {
                return Ok(prepared);
            }
            // What the view needs is known after a frame of it.
            let mut counters = Vec::new();
            for _ in 0..capacities.counting_frames() {
                prepared.run()?;
                counters = capacity::most(counters, prepared.counters()?);
            }
            match capacities.next(&counters) {
                Some(next) => capacities = next,
                None => return Ok(prepared),
            }
        }
        // What it needs still grows: its counters tell what it drops.
        self.record(technique, params, &view, draws, &constants, &capacities, &also)
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

    /// Records a frame with capacities for what can overflow.
    #[expect(clippy::too_many_arguments, reason = "the parts of one frame")]
    fn record(
        &self,
        technique: &dyn Technique,
        params: &Params,
        view: &CameraView,
        (draws, blended): (&DrawList, Option<&BlendedList>),
        constants: &gpu::Buffer,
        capacities: &Capacities,
        also: &impl Fn(&mut Graph, &ImageHandle),
    ) -> Result<Prepared, TechniqueError> {
        let settings = &self.settings;
        let mut graph = Graph::new();
        let mut frame = Frame {
            width_px: settings.width_px,
            height_px: settings.height_px,
            samples: settings.samples,
            params,
            scene: &self.scene,
            lights: &self.lights,
            clip_from_world: view.clip_from_world,
            eye_moved_m: view.eye_moved_m,
            background_radiance: background_radiance(settings).into(),
            view: &settings.view,
            tessellate_px: settings.effects.tessellation.edge_px,
            displacement_m: settings.effects.tessellation.displacement_m(),
            buffers: self.import(&mut graph, constants, draws),
            shaders: &[&self.extra_shaders, technique.shaders(), &afterlight_stages::SHADERS],
            device: &self.device,
            capacities,
            visible: &draws.visible,
            board: Board::default(),
        };
        indirect::record(&mut graph, &mut frame, settings)?;
        shadow::record(&mut graph, &mut frame, settings)?;
        let mut hdr = technique.record(&mut graph, &frame)?;
        let depth_id = if settings.keep_depth { keep_depth(&mut graph, &frame) } else { None };
        if let Some(blended) = blended {
            hdr = transparent::draw(&mut graph, &frame, blended, hdr)?;
        }
        also(&mut graph, &hdr);
        let counts_pairs = views::counts_light_pairs(&settings.view);
        let hdr_id = (settings.keep_hdr || counts_pairs).then(|| graph.keep(&hdr));
        let shown = match counts_pairs {
            true => light_pair_colors(&mut graph, &frame, &hdr)?,
            false => hdr,
        };
        let final_color =
            post::finish(&self.device, &mut graph, &frame, &shown, settings.effects.post.filter)?;
        let final_id = graph.keep(&final_color);
        let plan = graph.plan(&self.device)?;
        let executor = Executor::new(&self.device, plan)?;
        Ok(Prepared {
            executor,
            demands: capacities.demands(),
            hdr: hdr_id.filter(|_| settings.keep_hdr),
            depth: depth_id
                .map(|depth| (depth, view.constants(settings, &self.lights, &self.scene).depth_to_distance)),
            light_pairs: hdr_id.filter(|_| counts_pairs),
            samples: settings.samples,
            final_color: final_id,
            draw_calls: draws.visible.iter().map(|b| b.len() as u32).sum::<u32>()
                + blended.map_or(0, |list| list.draw_count),
            width_px: settings.width_px,
            height_px: settings.height_px,
        })
    }

    fn import(&self, graph: &mut Graph, constants: &gpu::Buffer, draws: &DrawList) -> SceneBuffers {
        let s = &self.scene;
        SceneBuffers {
            frame: graph.import_buffer("frame constants", BufferRole::Constants, constants),
            draws: graph.import_buffer("scene draws", BufferRole::Scene, &s.draws),
            draw_data: graph.import_image("scene draw records", BufferRole::Scene, &s.draw_data, UPLOADED),
            materials: graph.import_image("scene materials", BufferRole::Scene, &s.materials, UPLOADED),
            uv_transforms: graph.import_buffer(
                "scene texture transforms",
                BufferRole::Scene,
                &s.uv_transforms,
            ),
            lights: graph.import_image("lights", BufferRole::Lights, &self.lights.data, UPLOADED),
            light_spheres: graph.import_image(
                "light spheres",
                BufferRole::Lights,
                &self.lights.spheres,
                UPLOADED,
            ),
            positions: graph.import_buffer("scene positions", BufferRole::Scene, &s.positions),
            attributes: graph.import_buffer("scene attributes", BufferRole::Scene, &s.attributes),
            indices: graph.import_buffer("scene indices", BufferRole::Scene, &s.indices),
            commands: graph.import_buffer("draw commands", BufferRole::Scene, &draws.commands),
            command_counts: graph.import_buffer("draw counts", BufferRole::Scene, &draws.counts),
            volume: graph.import_buffer("light volume vertices", BufferRole::Lights, &self.volume),
            volume_indices: graph.import_buffer(
                "light volume indices",
                BufferRole::Lights,
                &self.volume_indices,
            ),
        }
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

/// Depth as the device has stored it.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredDepth {
    /// One a pixel, rows from the top; reversed, 0 where there is no surface.
    pub values: Vec<f32>,
    /// `[a, b, c, d]`: a depth z is at the view distance `(a z + b) / (c z + d)`, metres.
    pub to_distance: [f32; 4],
}

/// A technique ready to run, as often as wanted.
pub struct Prepared {
    executor: Executor,
    demands: Vec<Demand>,
    hdr: Option<ResourceId>,
    /// Depth of opaque surfaces, and how it becomes a view distance.
    depth: Option<(ResourceId, [f32; 4])>,
    /// Counts of pairs in the place of radiance.
    light_pairs: Option<ResourceId>,
    samples: u32,
    final_color: ResourceId,
    /// Draws in view.
    pub draw_calls: u32,
    width_px: u32,
    height_px: u32,
}

impl Prepared {
    /// Renders a frame and waits for it.
    ///
    /// # Errors
    /// The device.
    pub fn run(&mut self) -> Result<FrameReport, TechniqueError> {
        Ok(self.executor.run()?)
    }

    /// The last frame, tone-mapped, sRGB, RGBA with 8 bits a channel, rows from the top.
    ///
    /// # Errors
    /// The device.
    pub fn final_rgba8(&mut self) -> Result<Vec<u8>, TechniqueError> {
        Ok(self.executor.read_image(self.final_color)?)
    }

    /// The last frame's linear radiance, RGBA, rows from the top; `None` unless [`Settings::keep_hdr`] was set. In views of
    /// [`views::LIGHT_PAIRS`] red is the pairs that a pixel tested, green those that are lit.
    ///
    /// # Errors
    /// The device.
    pub fn hdr_rgba(&mut self) -> Result<Option<Vec<f32>>, TechniqueError> {
        let Some(bytes) = self.hdr_bytes()? else { return Ok(None) };
        let scale = if self.light_pairs.is_some() { (1.0 / views::LIGHT_PAIR) as f32 } else { 1.0 };
        let value = |half: &[u8]| half::f16::from_le_bytes([half[0], half[1]]).to_f32();
        let of_pixel = |p: &[u8]| {
            [scale * value(&p[..2]), scale * value(&p[2..4]), scale * value(&p[4..6]), value(&p[6..8])]
        };
        Ok(Some(bytes.chunks_exact(8).flat_map(of_pixel).collect()))
    }

    /// Pairs of a light and a surface that the last frame tested and lit; `None` unless [`Settings::view`] is one of
    /// [`views::LIGHT_PAIRS`].
    ///
    /// # Errors
    /// The device.
    pub fn light_pairs(&mut self) -> Result<Option<LightPairs>, TechniqueError> {
        let Some(counts) = self.light_pairs else { return Ok(None) };
        Ok(Some(LightPairs::of(&self.executor.read_image(counts)?, self.samples)))
    }

    /// The last frame's linear radiance as it lies on the device, RGBA16F.
    pub fn hdr_bytes(&mut self) -> Result<Option<Vec<u8>>, TechniqueError> {
        Ok(self.hdr.map(|hdr| self.executor.read_image(hdr)).transpose()?)
    }

    /// Depth of the last frame's opaque surfaces. `None` unless [`Settings::keep_depth`] was set and the technique has drawn 32-bit depth at one
    /// sample, in the size of the frame.
    ///
    /// # Errors
    /// The device.
    pub fn depth(&mut self) -> Result<Option<StoredDepth>, TechniqueError> {
        let Some((depth, to_distance)) = self.depth else { return Ok(None) };
        let bytes = self.executor.read_image(depth)?;
        let values: Vec<f32> =
            bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let pixels = self.width_px as usize * self.height_px as usize;
        Ok((bytes.len() == 4 * pixels).then_some(StoredDepth { values, to_distance }))
    }

    /// What the last frame counted of everything that can overflow: what it needed, what there was, what was dropped.
    ///
    /// # Errors
    /// The device.
    pub fn counters(&mut self) -> Result<Vec<Counter>, TechniqueError> {
        self.demands.iter().map(|demand| demand.read(&self.executor)).collect()
    }

    /// Width and height in pixels.
    pub fn size_px(&self) -> (u32, u32) {
        (self.width_px, self.height_px)
    }

    /// The executor, for memory figures and buffers that were kept.
    pub fn executor(&mut self) -> &mut Executor {
        &mut self.executor
    }
}
