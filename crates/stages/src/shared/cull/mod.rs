//! The stage that chooses the draws of a view on the device and orders them near to far: indirect commands and their counts, a range a bucket.
//! See the README of this folder.

use std::{borrow::Cow, ops::Range};

use afterlight_frame::{
    ChangesWith, CullOn, DrawCommands, DrawParams, Frame, SceneGpu, TechniqueError, View, ViewInputs,
    find_shader, put,
    scene::{
        BUCKETS,
        draw_list::{BINS, COMMAND_BYTES, DrawQuery, DrawsInOrder},
    },
};
use afterlight_graph::{
    BufferHandle, BufferRole, Graph, ImageHandle, PassRole,
    gpu::{self, vk},
};
use afterlight_shader::{Shader, structs::DrawChoiceConstants};

/// Threads of a group: `THREADS` in `batches.glsl`.
const THREADS: u32 = 256;
/// Draws of a thread at least.
const ROUNDS_MIN: u32 = 4;
/// Batches of a bucket at most: each group of `order` reads the counts of all of them.
const BATCHES_MAX: u32 = 256;

/// What draws are chosen from.
#[derive(Clone, Copy)]
pub struct SceneOfDraws<'a> {
    /// The device that the frame will run on.
    pub device: &'a gpu::Device,
    /// What is written anew for each view.
    pub inputs: &'a ViewInputs,
    /// Compiled shaders.
    pub shaders: &'a [&'a [Shader]],
    /// The scene.
    pub scene: &'a SceneGpu,
    /// Records of its draws.
    pub draw_data: &'a ImageHandle,
    /// Their bounds in object space and their number of indices.
    pub draw_bounds: &'a ImageHandle,
    /// Who chooses.
    pub cull_on: CullOn,
}

impl<'a> SceneOfDraws<'a> {
    /// The scene of a frame.
    pub fn of(frame: &'a Frame<'_>) -> Self {
        Self {
            device: frame.device,
            inputs: frame.inputs,
            shaders: frame.shaders,
            scene: frame.scene,
            draw_data: &frame.buffers.draw_data,
            draw_bounds: &frame.buffers.draw_bounds,
            cull_on: frame.params.typed::<DrawParams>().cull_on,
        }
    }

    /// Declares what chooses the draws that the eye has in view.
    ///
    /// # Errors
    /// A shader that is not compiled in, the device, a buffer that one binding does not reach.
    pub fn in_view(&self, graph: &mut Graph) -> Result<DrawCommands, TechniqueError> {
        let named = ("shared/draw", ChangesWith::Camera);
        match self.is_on_device() {
            true => self.on_device(graph, named, |view| view.query(None)),
            false => self.on_host(graph, named, |view| Cow::Borrowed(view.visible())),
        }
    }

    /// Declares what chooses draws by a query of each view; buffers and passes are named after `name`.
    ///
    /// # Errors
    /// As [`Self::in_view`].
    pub fn by_query(
        &self,
        graph: &mut Graph,
        named: (&str, ChangesWith),
        query: impl Fn(&View<'_>) -> DrawQuery + Clone + Send + Sync + 'static,
    ) -> Result<DrawCommands, TechniqueError> {
        match self.is_on_device() {
            true => self.on_device(graph, named, query),
            false => self.on_host(graph, named, move |view| {
                Cow::Owned(query(view).choose(&view.scene.bucket_first, &view.placed.infos))
            }),
        }
    }

    fn is_on_device(&self) -> bool {
        self.cull_on.chooses_on_device(self.scene.draw_count())
    }

    fn on_host(
        &self,
        graph: &mut Graph,
        named: (&str, ChangesWith),
        of_view: impl for<'v> Fn(&'v View<'_>) -> Cow<'v, DrawsInOrder> + Clone + Send + Sync + 'static,
    ) -> Result<DrawCommands, TechniqueError> {
        self.inputs.declare_draws(self.device, graph, named, self.scene, of_view)
    }

    fn on_device(
        &self,
        graph: &mut Graph,
        (name, changes_with): (&str, ChangesWith),
        query: impl Fn(&View<'_>) -> DrawQuery + Send + Sync + 'static,
    ) -> Result<DrawCommands, TechniqueError> {
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
        let how = (size_of::<DrawChoiceConstants>() as u64, usage, changes_with);
        let named = (&*format!("{name} choice"), BufferRole::Constants);
        let choice = self
            .inputs
            .declare(self.device, graph, named, how, move |view, bytes| put(bytes, 0, &[query(view).0]))?;
        let bins = self.choose(graph, name, &choice)?;
        self.order(graph, name, bins)
    }

    /// Declares the pass that finds the bin of every draw.
    fn choose(&self, graph: &mut Graph, name: &str, choice: &BufferHandle) -> Result<Bins, TechniqueError> {
        let (draws, batches) = (self.scene.draw_count().max(1) as u64, Batches::of(self.scene.bucket_first));
        let of_draws = graph.buffer(&format!("{name} bins"), BufferRole::Shared, 4 * draws);
        let bytes = 4 * u64::from(BINS) * u64::from(batches.count());
        let counts = graph.buffer(&format!("{name} bin counts"), BufferRole::Shared, bytes);
        let shader = find_shader(self.shaders, "shared/cull/choose.comp")?;
        let mut pass = graph.compute(&format!("{name} choose"), PassRole::Culling, &shader);
        pass.push(&batches.push());
        pass.read("CullBlock", choice)
            .read("draw_bounds", self.draw_bounds)
            .read("draw_data", self.draw_data);
        let of_draws = pass.write("DrawBins", of_draws);
        let counts = pass.write("BinCounts", counts);
        pass.dispatch([batches.count(), 1, 1]);
        pass.finish();
        Ok(Bins { of_draws, counts })
    }

    /// Declares the pass that writes the commands of draws in the order of their bins.
    fn order(&self, graph: &mut Graph, name: &str, bins: Bins) -> Result<DrawCommands, TechniqueError> {
        let (draws, first) = (self.scene.draw_count().max(1) as u64, self.scene.bucket_first);
        let commands = graph.buffer(&format!("{name} commands"), BufferRole::Scene, COMMAND_BYTES * draws);
        let counts = graph.buffer(&format!("{name} counts"), BufferRole::Scene, 4 * BUCKETS as u64);
        let shader = find_shader(self.shaders, "shared/cull/order.comp")?;
        let mut pass = graph.compute(&format!("{name} order"), PassRole::Culling, &shader);
        let batches = Batches::of(first);
        pass.push(&batches.push());
        pass.read("DrawBins", &bins.of_draws).read("BinCounts", &bins.counts);
        pass.read("draw_bounds", self.draw_bounds).read("draw_data", self.draw_data);
        let commands = pass.write("DrawCommands", commands);
        let counts = pass.write("DrawCounts", counts);
        pass.dispatch([batches.count(), 1, 1]);
        pass.finish();
        Ok(DrawCommands { commands, counts, first })
    }
}

/// Declares what chooses the draws in view that may reach some rows of the image.
///
/// # Errors
/// As [`SceneOfDraws::in_view`].
pub fn in_rows(
    graph: &mut Graph,
    frame: &Frame<'_>,
    name: &str,
    rows: Range<u32>,
) -> Result<DrawCommands, TechniqueError> {
    let named = (name, ChangesWith::Camera);
    let (scene, query) = (SceneOfDraws::of(frame), move |view: &View<'_>| view.query(Some(rows.clone())));
    match scene.is_on_device() {
        true => scene.on_device(graph, named, query),
        // The host has found what the eye has in view.
        false => scene.on_host(graph, named, move |view| {
            Cow::Owned(query(view).keep(view.visible(), &view.placed.infos))
        }),
    }
}

/// Bins of draws as the graph knows them.
struct Bins {
    /// A word a draw.
    of_draws: BufferHandle,
    /// A word for each bin of each batch.
    counts: BufferHandle,
}

/// How draws are cut into batches, the work of a group each: neighbouring draws of one bucket.
#[derive(Clone, Copy)]
struct Batches {
    bucket_first: [u32; BUCKETS + 1],
    /// Draws of a thread.
    rounds: u32,
}

impl Batches {
    fn of(bucket_first: [u32; BUCKETS + 1]) -> Self {
        let rounds = bucket_first[BUCKETS].div_ceil(THREADS * BATCHES_MAX).max(ROUNDS_MIN);
        Self { bucket_first, rounds }
    }

    /// Number of batches; a bucket has one at least.
    fn count(&self) -> u32 {
        let in_bucket = |ends: &[u32]| (ends[1] - ends[0]).div_ceil(THREADS * self.rounds).max(1);
        self.bucket_first.windows(2).map(in_bucket).sum()
    }

    /// What the shaders are told.
    fn push(&self) -> [u32; BUCKETS + 2] {
        std::array::from_fn(|i| if i <= BUCKETS { self.bucket_first[i] } else { self.rounds })
    }
}
