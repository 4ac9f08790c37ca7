//! A technique that is ready to run, and what can be read after it ran.

use std::sync::Arc;

use crate::pose::ScenePose;
use afterlight_graph::{Executor, FrameInput, FrameReport, ResourceId, gpu};
use afterlight_scene::{Camera, Light, ShapePose};

use afterlight_frame::{
    CameraView, DrawParams, FrameTime, LightPairs, SceneLights, Settings, TechniqueError, View, ViewBefore,
    ViewChoice, ViewInput, ViewInputs, ViewScript,
    capacity::{Capacities, Counter, Demand},
    scene::{
        SceneGpu,
        placed::{Placed, TurnedOver},
    },
    views,
};

/// Depth as the device has stored it.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredDepth {
    /// One a pixel, rows from the top; reversed, 0 where there is no surface.
    pub values: Vec<f32>,
    /// `[a, b, c, d]`: a depth z is at the view distance `(a z + b) / (c z + d)`, metres.
    pub to_distance: [f32; 4],
}

/// Images of a frame that are kept for reading.
#[derive(Clone, Copy)]
pub(crate) struct Kept {
    pub hdr: Option<ResourceId>,
    /// Depth of opaque surfaces.
    pub depth: Option<ResourceId>,
    /// Counts of pairs in the place of radiance.
    pub light_pairs: Option<ResourceId>,
    pub final_color: ResourceId,
}

/// Where surfaces and lights of a scene have moved to; nothing stands where it was uploaded.
#[derive(Default)]
pub(crate) struct Moved {
    pub placed: Option<Box<Placed>>,
    pub lights: Option<Box<SceneLights>>,
}

/// What a frame shows: all from which its inputs are computed.
pub(crate) struct Viewed {
    pub settings: Settings,
    pub scene: Arc<SceneGpu>,
    lights: Arc<SceneLights>,
    pub camera: CameraView,
    pub choice: ViewChoice,
    pub moved: Moved,
    /// Counts the poses so far.
    pub pose: u64,
    /// When it is.
    pub time: FrameTime,
}

impl Viewed {
    /// A view of a scene with its lights, whose surfaces and lights may have moved.
    pub fn new(
        settings: &Settings,
        scene: Arc<SceneGpu>,
        lights: Arc<SceneLights>,
        moved: Moved,
        options: DrawParams,
    ) -> Self {
        let camera = CameraView::fitted(settings, moved.placed.as_deref().unwrap_or(&scene.rest));
        let (choice, time) = (ViewChoice::new(options), FrameTime::default());
        Self { settings: settings.clone(), camera, choice, moved, pose: 0, time, scene, lights }
    }

    /// Looks through another camera.
    pub fn look_through(&mut self, camera: &Camera) {
        self.settings.camera.clone_from(camera);
        self.camera = CameraView::fitted(&self.settings, self.placed());
        self.choice.begin_view();
    }

    /// Where surfaces stand.
    fn placed(&self) -> &Placed {
        self.moved.placed.as_deref().unwrap_or(&self.scene.rest)
    }

    /// Moves surfaces and lights to a pose, or to where they were uploaded, of which `rest_lights` are the lights. The camera must be looked
    /// through again.
    pub fn place(&mut self, pose: Option<&ScenePose>, rest_lights: &[Light]) -> Result<(), TechniqueError> {
        let is_at_rest = self.moved.placed.is_none() && self.moved.lights.is_none();
        if pose.is_none() && is_at_rest {
            return Ok(());
        }
        self.pose += 1;
        let lights = pose.and_then(|pose| pose.lights.as_deref());
        match lights {
            None => self.moved.lights = None,
            Some(lights) => {
                let moved = self.moved.lights.get_or_insert_with(|| Box::new((*self.lights).clone()));
                if !moved.set(lights) {
                    return Err(TechniqueError::OtherLights { expected: self.lights.count });
                }
            }
        }
        let lights = lights.unwrap_or(rest_lights);
        self.settings.lights.clear();
        self.settings.lights.extend_from_slice(lights);
        let Some(pose) = pose else {
            self.moved.placed = None;
            return Ok(());
        };
        let placed = self.moved.placed.get_or_insert_with(|| Box::new(self.scene.rest.clone()));
        let deformed = match &pose.shapes {
            Some(shapes) => {
                check_shapes(&self.scene, &shapes.pose)?;
                placed.shapes.set(&shapes.pose);
                &shapes.bounds_os[..]
            }
            None => match &self.scene.deformed {
                Some(deformed) => {
                    placed.shapes.clone_from(&self.scene.rest.shapes);
                    &deformed.rest_bounds_os[..]
                }
                None => &[],
            },
        };
        let moved = placed.place(&self.scene.draw_sources, &pose.world_from_objects, deformed);
        moved.map_err(|TurnedOver { instance }| TechniqueError::TurnedOver { instance })
    }

    pub fn view(&self) -> View<'_> {
        View {
            camera: &self.camera,
            settings: &self.settings,
            scene: &self.scene,
            lights: self.moved.lights.as_deref().unwrap_or(&self.lights),
            choice: &self.choice,
            placed: self.placed(),
            time: &self.time,
        }
    }

    /// Writes what it shows, for the frame after it; with where draws stand if that frame asks.
    pub fn write_as_before(&self, with_records: bool, before: &mut ViewBefore) {
        before.clip_from_world = self.camera.clip_from_world;
        if with_records {
            before.records.get_or_insert_default().clone_from(&self.placed().records);
        } else {
            before.records = None;
        }
    }
}

/// Checks that a pose has the joints and the weights that the scene was uploaded with.
fn check_shapes(scene: &SceneGpu, pose: &ShapePose) -> Result<(), TechniqueError> {
    let expected =
        scene.deformed.as_ref().map_or([0; 2], |deformed| [deformed.joint_count, deformed.weight_count]);
    let found = [pose.object_from_bind.len(), pose.weights.len()];
    match found == expected.map(|count| count as usize) {
        true => Ok(()),
        false => Err(TechniqueError::OtherShapes { found, expected }),
    }
}

/// A technique ready to run, as often as wanted.
pub struct Prepared {
    device: gpu::Device,
    pub(crate) executor: Executor,
    pub(crate) viewed: Viewed,
    pub(crate) inputs: Vec<ViewInput>,
    pub(crate) scripts: Vec<ViewScript>,
    /// Whether the inputs and scripts are all that depends on the view.
    pub(crate) shows_all_views: bool,
    pub(crate) capacities: Capacities,
    pub(crate) demands: Arc<[Demand]>,
    pub(crate) kept: Kept,
    /// Whether frames ask where draws stood in the frame before.
    pub(crate) asks_for_records_before: bool,
    /// Draws in view.
    pub draw_calls: u32,
}

impl Prepared {
    pub(crate) fn new(
        device: &gpu::Device,
        executor: Executor,
        viewed: Viewed,
        inputs: ViewInputs,
        capacities: Capacities,
        kept: Kept,
        draw_calls: u32,
    ) -> Result<Self, TechniqueError> {
        let asks_for_records_before = inputs.asks_for_records_before();
        let (inputs, scripts, shows_all_views) = inputs.into_parts();
        let demands = capacities.demands().into();
        let device = device.clone();
        let mut prepared = Self {
            device,
            executor,
            viewed,
            inputs,
            scripts,
            shows_all_views,
            capacities,
            demands,
            kept,
            asks_for_records_before,
            draw_calls,
        };
        prepared.fill_inputs()?;
        Ok(prepared)
    }

    /// Chooses the draws of scripts for the view.
    pub(crate) fn choose_draws(&mut self) {
        let view = self.viewed.view();
        for script in &self.scripts {
            self.executor.set_script(script.script, script.steps(&view));
        }
    }

    /// Writes the inputs for the view.
    fn fill_inputs(&mut self) -> Result<(), TechniqueError> {
        self.choose_draws();
        let mut uploader = self.device.uploader()?;
        let mut bytes = Vec::new();
        for input in &self.inputs {
            bytes.clear();
            bytes.resize(input.target.bytes() as usize, 0);
            input.fill(&self.viewed.view(), &mut bytes);
            match &input.target {
                FrameInput::Buffer(buffer) => uploader.buffer(buffer, 0, &bytes)?,
                FrameInput::Image(image) => uploader.image(image, 0, 0, &bytes)?,
            }
        }
        Ok(uploader.finish()?)
    }

    /// Renders a frame and waits for it.
    ///
    /// # Errors
    /// The device.
    pub fn run(&mut self) -> Result<FrameReport, TechniqueError> {
        Ok(self.executor.run()?)
    }

    /// The same, where passes count what the pipeline does in them; that takes time on the device.
    ///
    /// # Errors
    /// The device.
    pub fn run_counted(&mut self) -> Result<FrameReport, TechniqueError> {
        Ok(self.executor.run_counted()?)
    }

    /// The last frame, tone-mapped, sRGB, RGBA with 8 bits a channel, rows from the top.
    ///
    /// # Errors
    /// The device.
    pub fn final_rgba8(&mut self) -> Result<Vec<u8>, TechniqueError> {
        Ok(self.executor.read_image(self.kept.final_color)?)
    }

    /// The last frame's linear radiance, RGBA, rows from the top; `None` unless [`Settings::keep_hdr`] was set. In views of
    /// [`views::LIGHT_PAIRS`] red is the pairs that a pixel tested, green those that are lit.
    ///
    /// # Errors
    /// The device.
    pub fn hdr_rgba(&mut self) -> Result<Option<Vec<f32>>, TechniqueError> {
        let Some(bytes) = self.hdr_bytes()? else { return Ok(None) };
        let scale = if self.kept.light_pairs.is_some() { (1.0 / views::LIGHT_PAIR) as f32 } else { 1.0 };
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
        let Some(counts) = self.kept.light_pairs else { return Ok(None) };
        Ok(Some(LightPairs::of(&self.executor.read_image(counts)?, self.viewed.settings.samples)))
    }

    /// The last frame's linear radiance as it lies on the device, RGBA16F.
    pub fn hdr_bytes(&mut self) -> Result<Option<Vec<u8>>, TechniqueError> {
        Ok(self.kept.hdr.map(|hdr| self.executor.read_image(hdr)).transpose()?)
    }

    /// Depth of the last frame's opaque surfaces. `None` unless [`Settings::keep_depth`] was set and the technique has drawn 32-bit depth at one
    /// sample, in the size of the frame.
    ///
    /// # Errors
    /// The device.
    pub fn depth(&mut self) -> Result<Option<StoredDepth>, TechniqueError> {
        let Some(depth) = self.kept.depth else { return Ok(None) };
        let bytes = self.executor.read_image(depth)?;
        let values: Vec<f32> =
            bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let Settings { width_px, height_px, .. } = self.viewed.settings;
        let pixels = width_px as usize * height_px as usize;
        let view = self.viewed.view();
        let to_distance =
            view.camera.constants(view.settings, view.lights, &view.bounds_ws()).depth_to_distance;
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
        (self.viewed.settings.width_px, self.viewed.settings.height_px)
    }

    /// The executor, for memory figures and buffers that were kept.
    pub fn executor(&mut self) -> &mut Executor {
        &mut self.executor
    }
}
