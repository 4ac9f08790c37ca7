//! What of a frame its view decides: small buffers that are written anew for each frame, so that a camera that moves needs no new plan.

use std::{
    borrow::Cow,
    cell::{Cell, RefCell},
    mem,
    ops::Range,
    sync::{Mutex, OnceLock, PoisonError},
};

use afterlight_graph::{
    BufferHandle, BufferRole, FrameInput, Graph, ImageHandle, RasterPass, ScriptId, Step,
    gpu::{self, vk},
};

use afterlight_scene::Aabb;

use crate::{
    CameraView, DrawCommands, DrawParams, Frame, FrameTime, SceneGpu, SceneLights, Settings, TechniqueError,
    scene::{
        BUCKETS,
        draw_list::{COMMAND_BYTES, DrawQuery, DrawsInOrder, write_commands, write_counts},
        placed::Placed,
    },
    upload::put,
};

/// A view of the scene, from which the inputs of a frame are computed.
pub struct View<'a> {
    /// Matrices of the camera.
    pub camera: &'a CameraView,
    /// What the frame looks like; its camera is the view's.
    pub settings: &'a Settings,
    /// The scene.
    pub scene: &'a SceneGpu,
    /// The lights.
    pub lights: &'a SceneLights,
    /// How the eye chooses draws.
    pub choice: &'a ViewChoice,
    /// Where surfaces stand.
    pub placed: &'a Placed,
    /// When it is, and what the frame before showed.
    pub time: &'a FrameTime,
}

/// How the draws of a view are chosen, and what the host has chosen so far: nothing unless something asks for it.
#[derive(Debug, Default)]
pub struct ViewChoice {
    /// How draws are chosen and ordered.
    pub options: DrawParams,
    draws: OnceLock<Chosen>,
    /// What was chosen before, kept for its memory.
    unused: Mutex<Chosen>,
}

/// Draws that were chosen, and the words that they were sorted by.
#[derive(Debug, Default)]
struct Chosen {
    draws: DrawsInOrder,
    words: Vec<u64>,
}

impl ViewChoice {
    /// Draws that are to be chosen in this way.
    pub fn new(options: DrawParams) -> Self {
        Self { options, ..Self::default() }
    }

    /// Forgets what was chosen: the view has changed.
    pub fn begin_view(&mut self) {
        if let Some(chosen) = self.draws.take() {
            *self.unused.get_mut().unwrap_or_else(PoisonError::into_inner) = chosen;
        }
    }

    /// What the host has chosen, or chooses now.
    fn chosen(&self, choose: impl FnOnce(&mut Chosen)) -> &DrawsInOrder {
        let first = || {
            let mut chosen = mem::take(&mut *self.unused.lock().unwrap_or_else(PoisonError::into_inner));
            choose(&mut chosen);
            chosen
        };
        &self.draws.get_or_init(first).draws
    }
}

impl View<'_> {
    /// Draws that the eye has in view, by bucket, in drawing order. The host finds them when a view asks for the first time, which takes time
    /// by the number of draws.
    pub fn visible(&self) -> &DrawsInOrder {
        self.choice.chosen(|Chosen { draws, words }| {
            self.query(None).choose_into(&self.scene.bucket_first, &self.placed.infos, (draws, words));
        })
    }

    /// What decides which draws the eye needs, of which only those that may reach some rows of the image where there are any.
    pub fn query(&self, rows: Option<Range<u32>>) -> DrawQuery {
        self.query_of(&self.choice.options, self.camera, rows)
    }

    /// The same of another camera.
    pub fn query_of(&self, options: &DrawParams, camera: &CameraView, rows: Option<Range<u32>>) -> DrawQuery {
        DrawQuery::new(options, &camera.query(rows, self.bounds_ws(), self.displacement_m()))
    }

    /// How far displacement moves surfaces along each axis at most, m.
    pub fn displacement_m(&self) -> f32 {
        self.settings.effects.tessellation.displacement_m()
    }

    /// Box of all surfaces without alpha blending, displaced ones where they may be, world space.
    pub fn bounds_ws(&self) -> Aabb {
        self.placed.bounds_ws(self.displacement_m())
    }
}

/// Fills a buffer, as long as it was declared, for a view. What it leaves is undefined, and nobody may read it.
type Fill = dyn Fn(&View<'_>, &mut [u8]) + Send + Sync;

/// What an input changes with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangesWith {
    /// The camera, where surfaces stand, and what the frame before showed.
    Camera,
    /// Where surfaces stand, alone.
    Pose,
}

/// A buffer or an image that is written for every view.
pub struct ViewInput {
    /// Where it is written to, in the device's memory.
    pub target: FrameInput,
    /// What it changes with.
    pub changes_with: ChangesWith,
    fill: Box<Fill>,
}

impl ViewInput {
    /// Fills the buffer's bytes for a view.
    pub fn fill(&self, view: &View<'_>, bytes: &mut [u8]) {
        (self.fill)(view, bytes);
    }
}

/// The draws of a pass that are chosen for every view.
pub struct ViewScript {
    /// The pass's script.
    pub script: ScriptId,
    steps: Box<Steps>,
}

/// Chooses the steps of a script for a view.
type Steps = dyn Fn(&View<'_>) -> Vec<Step> + Send + Sync;

impl ViewScript {
    /// The steps for a view.
    pub fn steps(&self, view: &View<'_>) -> Vec<Step> {
        (self.steps)(view)
    }
}

/// The inputs that a frame declares while it is recorded.
#[derive(Default)]
pub struct ViewInputs {
    inputs: RefCell<Vec<ViewInput>>,
    scripts: RefCell<Vec<ViewScript>>,
    holds_for_one_view: Cell<bool>,
    asks_for_records_before: Cell<bool>,
}

impl ViewInputs {
    /// The inputs and scripts in the order of their declaration, and whether they are all that depends on the view: false where what was
    /// recorded holds for that view alone, so that another one must be recorded anew.
    pub fn into_parts(self) -> (Vec<ViewInput>, Vec<ViewScript>, bool) {
        (self.inputs.into_inner(), self.scripts.into_inner(), !self.holds_for_one_view.get())
    }

    /// Brings a buffer of `bytes` bytes into the graph that is filled for each view before the first pass. `fill` computes all that passes
    /// read of it, from the view alone.
    ///
    /// # Errors
    /// The device.
    pub fn declare(
        &self,
        device: &gpu::Device,
        graph: &mut Graph,
        (name, role): (&str, BufferRole),
        (bytes, usage, changes_with): (u64, vk::BufferUsageFlags, ChangesWith),
        fill: impl Fn(&View<'_>, &mut [u8]) + Send + Sync + 'static,
    ) -> Result<BufferHandle, TechniqueError> {
        let memory = gpu::MemoryKind::DeviceLocal;
        let buffer = device.create_buffer(&gpu::BufferDesc { name, bytes, usage, memory })?;
        let handle = graph.import_buffer(name, role, &buffer);
        let target = FrameInput::Buffer(buffer);
        self.inputs.borrow_mut().push(ViewInput { target, changes_with, fill: Box::new(fill) });
        Ok(handle)
    }

    /// Where the draws of a scene stand, as the vertex stream of instances and as an image of records, for each pose.
    ///
    /// # Errors
    /// The device.
    pub fn declare_records(
        &self,
        device: &gpu::Device,
        graph: &mut Graph,
        scene: &SceneGpu,
    ) -> Result<(BufferHandle, ImageHandle), TechniqueError> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::VERTEX_BUFFER;
        let how = (scene.draws.bytes(), usage, ChangesWith::Pose);
        let named = ("scene draws", BufferRole::Scene);
        let stream =
            self.declare(device, graph, named, how, |view, bytes| put(bytes, 0, &view.placed.records))?;
        // A record of four texels is as long as in the stream.
        let named = (("scene draw records", BufferRole::Scene), ChangesWith::Pose);
        let records = self.declare_like(device, graph, named, &scene.draw_data, |view, bytes| {
            put(bytes, 0, &view.placed.records);
        })?;
        Ok((stream, records))
    }

    /// What the device chooses draws by, for each pose.
    ///
    /// # Errors
    /// The device.
    pub fn declare_bounds(
        &self,
        device: &gpu::Device,
        graph: &mut Graph,
        scene: &SceneGpu,
    ) -> Result<ImageHandle, TechniqueError> {
        let named = ("scene draw bounds", BufferRole::Scene);
        self.declare_like(device, graph, (named, ChangesWith::Pose), &scene.draw_bounds, |view, bytes| {
            put(bytes, 0, &view.placed.draw_bounds);
        })
    }

    /// Where the draws of a scene stood in the frame before, as an image of records, for each frame of a scene that moves.
    ///
    /// # Errors
    /// The device.
    pub fn declare_records_before(
        &self,
        device: &gpu::Device,
        graph: &mut Graph,
        scene: &SceneGpu,
    ) -> Result<ImageHandle, TechniqueError> {
        self.asks_for_records_before.set(true);
        let named = ("scene draw records before", BufferRole::Scene);
        let how = (named, ChangesWith::Camera);
        self.declare_like(device, graph, how, &scene.draw_data, |view, bytes| {
            let before = view.time.before.as_ref().and_then(|before| before.records.as_deref());
            put(bytes, 0, before.unwrap_or(&view.placed.records));
        })
    }

    /// Whether some input holds where draws stood in the frame before.
    pub fn asks_for_records_before(&self) -> bool {
        self.asks_for_records_before.get()
    }

    /// Records and spheres of lights, for each pose.
    ///
    /// # Errors
    /// The device.
    pub fn declare_lights(
        &self,
        device: &gpu::Device,
        graph: &mut Graph,
        lights: &SceneLights,
    ) -> Result<(ImageHandle, ImageHandle), TechniqueError> {
        let named = (("lights", BufferRole::Lights), ChangesWith::Pose);
        let data = self
            .declare_like(device, graph, named, &lights.data, |view, bytes| view.lights.fill_data(bytes))?;
        let named = (("light spheres", BufferRole::Lights), ChangesWith::Pose);
        let spheres = self.declare_like(device, graph, named, &lights.spheres, |view, bytes| {
            view.lights.fill_spheres(bytes)
        })?;
        Ok((data, spheres))
    }

    /// An image of records like another one.
    fn declare_like(
        &self,
        device: &gpu::Device,
        graph: &mut Graph,
        ((name, role), changes_with): ((&str, BufferRole), ChangesWith),
        like: &gpu::Image,
        fill: impl Fn(&View<'_>, &mut [u8]) + Send + Sync + 'static,
    ) -> Result<ImageHandle, TechniqueError> {
        let [width, height] = like.extent();
        let image = device.create_image(&gpu::ImageDesc {
            name,
            format: like.format(),
            width,
            height,
            layers: 1,
            mips: 1,
            samples: 1,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        })?;
        let handle = graph.import_image(name, role, &image, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        let target = FrameInput::Image(image);
        self.inputs.borrow_mut().push(ViewInput { target, changes_with, fill: Box::new(fill) });
        Ok(handle)
    }

    /// Brings the commands of the draws that `of_view` chooses on the host into the graph, named after `name`: a range a bucket, with room for
    /// all.
    ///
    /// # Errors
    /// The device.
    pub fn declare_draws(
        &self,
        device: &gpu::Device,
        graph: &mut Graph,
        (name, changes_with): (&str, ChangesWith),
        scene: &SceneGpu,
        of_view: impl for<'v> Fn(&'v View<'_>) -> Cow<'v, DrawsInOrder> + Clone + Send + Sync + 'static,
    ) -> Result<DrawCommands, TechniqueError> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER;
        let bytes = COMMAND_BYTES * scene.draw_count().max(1) as u64;
        let names = [format!("{name} commands"), format!("{name} counts")];
        let counted = of_view.clone();
        let commands = self.declare(
            device,
            graph,
            (&names[0], BufferRole::Scene),
            (bytes, usage, changes_with),
            move |view, bytes| {
                write_commands(view.scene, &of_view(view), bytes);
            },
        )?;
        let bytes = 4 * BUCKETS as u64;
        let counts = self.declare(
            device,
            graph,
            (&names[1], BufferRole::Scene),
            (bytes, usage, changes_with),
            move |view, bytes| {
                write_counts(&counted(view), bytes);
            },
        )?;
        Ok(DrawCommands { commands, counts, first: scene.bucket_first })
    }
}

impl Frame<'_> {
    /// As [`ViewInputs::declare`].
    ///
    /// # Errors
    /// The device.
    pub fn input(
        &self,
        graph: &mut Graph,
        named: (&str, BufferRole),
        how: (u64, vk::BufferUsageFlags, ChangesWith),
        fill: impl Fn(&View<'_>, &mut [u8]) + Send + Sync + 'static,
    ) -> Result<BufferHandle, TechniqueError> {
        self.inputs.declare(self.device, graph, named, how, fill)
    }

    /// As [`Frame::table`], of words that the view decides: at most `most_words`, of which `words` puts the first into an empty list, whose
    /// memory is used again.
    ///
    /// # Errors
    /// The device.
    pub fn table_of_view(
        &self,
        graph: &mut Graph,
        named: (&str, BufferRole),
        most_words: usize,
        words: impl Fn(&View<'_>, &mut Vec<u32>) + Send + Sync + 'static,
    ) -> Result<BufferHandle, TechniqueError> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER;
        let how = (4 * most_words.max(1) as u64, usage, ChangesWith::Camera);
        let kept = Mutex::new(Vec::new());
        self.input(graph, named, how, move |view, bytes| {
            let mut list = kept.lock().unwrap_or_else(PoisonError::into_inner);
            list.clear();
            words(view, &mut list);
            put(bytes, 0, &list);
        })
    }

    /// Lets `steps` choose the draws of a pass for each view, among those that it declares.
    pub fn script_of_view(
        &self,
        pass: &mut RasterPass<'_>,
        steps: impl Fn(&View<'_>) -> Vec<Step> + Send + Sync + 'static,
    ) {
        let script = pass.script();
        self.inputs.scripts.borrow_mut().push(ViewScript { script, steps: Box::new(steps) });
    }

    /// Says that what is recorded holds for this view alone: passes or draws that another view has not. A frame of another view is recorded
    /// anew, which costs the time of a plan.
    pub fn holds_for_this_view(&self) {
        self.inputs.holds_for_one_view.set(true);
    }
}
