//! What of a frame its view decides: small buffers that are written anew for each frame, so that a camera that moves needs no new plan.

use std::{
    borrow::Cow,
    cell::{Cell, RefCell},
};

use afterlight_graph::{
    BufferHandle, BufferRole, Graph, RasterPass, ScriptId, Step,
    gpu::{self, vk},
};

use crate::{
    CameraView, DrawCommands, Frame, SceneGpu, SceneLights, Settings, TechniqueError,
    scene::{
        BUCKETS,
        draw_list::{COMMAND_BYTES, write_commands, write_counts},
    },
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
    /// Draws in view, by bucket, in drawing order.
    pub visible: &'a [Vec<u32>; BUCKETS],
}

/// Fills a buffer, as long as it was declared, for a view. What it leaves is undefined, and nobody may read it.
type Fill = dyn Fn(&View<'_>, &mut [u8]) + Send + Sync;

/// A buffer that is written for every view.
pub struct ViewInput {
    /// The buffer, in the device's memory.
    pub buffer: gpu::Buffer,
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
}

impl ViewInputs {
    /// The inputs and scripts in the order of their declaration, and whether they are all that depends on the view: false where what was
    /// recorded holds for that view alone, so that another one must be recorded anew.
    pub fn into_parts(self) -> (Vec<ViewInput>, Vec<ViewScript>, bool) {
        (self.inputs.into_inner(), self.scripts.into_inner(), !self.holds_for_one_view.get())
    }
}

impl ViewInputs {
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
        bytes: u64,
        usage: vk::BufferUsageFlags,
        fill: impl Fn(&View<'_>, &mut [u8]) + Send + Sync + 'static,
    ) -> Result<BufferHandle, TechniqueError> {
        let memory = gpu::MemoryKind::DeviceLocal;
        let buffer = device.create_buffer(&gpu::BufferDesc { name, bytes, usage, memory })?;
        let handle = graph.import_buffer(name, role, &buffer);
        self.inputs.borrow_mut().push(ViewInput { buffer, fill: Box::new(fill) });
        Ok(handle)
    }

    /// Brings the commands of the draws that `of_view` chooses into the graph, named after `name`: a range a bucket, with room for all.
    ///
    /// # Errors
    /// The device.
    pub fn declare_draws(
        &self,
        device: &gpu::Device,
        graph: &mut Graph,
        name: &str,
        scene: &SceneGpu,
        of_view: impl for<'v> Fn(&'v View<'_>) -> Cow<'v, [Vec<u32>; BUCKETS]> + Clone + Send + Sync + 'static,
    ) -> Result<DrawCommands, TechniqueError> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER;
        let bytes = COMMAND_BYTES * scene.draw_infos.len().max(1) as u64;
        let names = [format!("{name} commands"), format!("{name} counts")];
        let counted = of_view.clone();
        let commands =
            self.declare(device, graph, (&names[0], BufferRole::Scene), bytes, usage, move |view, bytes| {
                write_commands(view.scene, &of_view(view), bytes);
            })?;
        let bytes = 4 * BUCKETS as u64;
        let counts =
            self.declare(device, graph, (&names[1], BufferRole::Scene), bytes, usage, move |view, bytes| {
                write_counts(&counted(view), bytes);
            })?;
        Ok(DrawCommands { commands, counts, first: scene.bucket_first })
    }
}

impl Frame<'_> {
    /// As [`ViewInputs::declare`].
    ///
    /// # Errors
    /// The device.
    pub fn of_view(
        &self,
        graph: &mut Graph,
        named: (&str, BufferRole),
        bytes: u64,
        usage: vk::BufferUsageFlags,
        fill: impl Fn(&View<'_>, &mut [u8]) + Send + Sync + 'static,
    ) -> Result<BufferHandle, TechniqueError> {
        self.inputs.declare(self.device, graph, named, bytes, usage, fill)
    }

    /// As [`Frame::table`], of words that the view decides: at most `most_words`, of which `words` gives the first.
    ///
    /// # Errors
    /// The device.
    pub fn table_of_view(
        &self,
        graph: &mut Graph,
        (name, role): (&str, BufferRole),
        most_words: usize,
        words: impl Fn(&View<'_>) -> Vec<u32> + Send + Sync + 'static,
    ) -> Result<BufferHandle, TechniqueError> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER;
        self.of_view(graph, (name, role), 4 * most_words.max(1) as u64, usage, move |view, bytes| {
            put(bytes, 0, &words(view));
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

/// Writes values from `offset` bytes on; what finds no room is left out.
pub fn put<T: bytemuck::NoUninit>(bytes: &mut [u8], offset: usize, values: &[T]) {
    let from: &[u8] = bytemuck::cast_slice(values);
    if let Some(to) = bytes.get_mut(offset..) {
        let count = from.len().min(to.len());
        to[..count].copy_from_slice(&from[..count]);
    }
}
