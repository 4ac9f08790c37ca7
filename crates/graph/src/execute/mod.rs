//! The executor: makes what a plan needs once, then records and runs the frame any number of times.
//!
//! Everything that recording needs is resolved ahead into flat lists (pipelines, descriptor writes, barriers, views), so
//! that a frame of twenty passes is recorded in a fraction of a millisecond.

mod barriers;
mod builder;
mod commands;
mod descriptors;
mod pipelines;
mod raster;
mod read_back;
mod record;
mod resources;
mod slot;
mod turn;

use std::{sync::Arc, time::Instant};

use afterlight_gpu::{self as gpu, Device, vk};

use crate::declare::{ScriptId, Step};
use crate::error::GraphError;
use crate::plan::Plan;
use crate::report::{FrameReport, PassReport, ResourceReport};
use builder::Builder;
use commands::{BarrierList, BoundPass};
use resources::{Physical, make_resources};
use turn::{clear_history, taken_over, taking_turns};

pub use read_back::ResourceKey;
pub use slot::{FrameInput, FrameSlot, FrameTimes};
pub use turn::Turn;

/// A plan with everything that it needs on a device.
pub struct Executor {
    device: Device,
    plan: Arc<Plan>,
    /// One a turn: two where the plan has history, else one.
    bound: Vec<Bound>,
    /// The turn of the last run.
    last: Option<Turn>,
    takes_over: bool,
    memory: Vec<ResourceReport>,
    /// Steps of the plan's scripts.
    scripts: Vec<Vec<Step>>,
}

/// Resources with history of a plan ([`Executor::history`]).
pub struct KeptHistory {
    plan: Arc<Plan>,
    /// Those of the first turn, by the numbers of the plan's resources.
    physical: Vec<Physical>,
    last: Option<Turn>,
}

/// What frames of one turn record.
struct Bound {
    physical: Vec<Physical>,
    passes: Vec<BoundPass>,
    final_barriers: BarrierList,
}

impl Executor {
    /// Allocates the plan's memory, makes its images, buffers, pipelines (in parallel) and descriptor writes.
    ///
    /// # Errors
    /// No memory, a limit of the device, a shader that the driver refuses; an imported resource without the usage that
    /// the passes need.
    pub fn new(device: &Device, plan: Plan) -> Result<Self, GraphError> {
        Self::after(device, plan, None)
    }

    /// The same for a plan that takes the place of an earlier one, of which it takes the resources with history where it has the same: then
    /// its frames read what frames of the earlier plan wrote ([`Executor::takes_over`]).
    ///
    /// # Errors
    /// As [`Executor::new`].
    pub fn after(device: &Device, plan: Plan, earlier: Option<&KeptHistory>) -> Result<Self, GraphError> {
        let plan = Arc::new(plan);
        let taken = earlier.and_then(|one| taken_over(&plan, &one.plan, &one.physical));
        let physical = make_resources(device, &plan, taken.as_deref())?;
        let takes_over = taken.is_some();
        if !takes_over {
            clear_history(device, &plan, &physical)?;
        }
        let mut bound = Vec::new();
        let mut pipelines = None;
        for physical in taking_turns(&plan, physical) {
            let builder = Builder { device, plan: &plan, physical: &physical };
            let (jobs, pipeline_of) = builder.jobs();
            let pipelines = match &pipelines {
                Some(pipelines) => pipelines,
                None => pipelines.insert(builder.make_pipelines(&jobs)?),
            };
            let passes = builder.passes((&jobs, &pipeline_of), pipelines)?;
            let final_barriers = builder.barriers(&plan.final_barriers);
            bound.push(Bound { physical, passes, final_barriers });
        }
        let memory = plan
            .resources
            .iter()
            .filter(|resource| resource.placement.is_some())
            .map(|resource| ResourceReport {
                name: resource.name.clone(),
                role: resource.role,
                bytes: resource.need.bytes,
                shared: resource.shared(),
                output: resource.output,
                is_history: resource.version.is_some(),
            })
            .collect();
        let scripts = vec![Vec::new(); plan.scripts as usize];
        let last = earlier.filter(|_| takes_over).and_then(|earlier| earlier.last);
        Ok(Self { device: device.clone(), bound, last, takes_over, memory, plan, scripts })
    }

    /// The resources with history, for a plan that takes the place of this one, on any thread; `None` where there are none.
    pub fn history(&self) -> Option<KeptHistory> {
        self.plan.has_history().then(|| KeptHistory {
            plan: Arc::clone(&self.plan),
            physical: self.bound[0].physical.clone(),
            last: self.last,
        })
    }

    /// Returns the plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Says which draws a script's pass makes from now on, in which order. Frames that were recorded before ([`Executor::slot`]) keep their
    /// steps until [`Executor::record_again`].
    ///
    /// # Panics
    /// If the script is of another graph with more of them.
    pub fn set_script(&mut self, script: ScriptId, steps: Vec<Step>) {
        self.scripts[script.0 as usize] = steps;
    }

    /// Whether its resources with history, all of them, are those of the plan before it: what they hold is of use. Without history it is false.
    pub fn takes_over(&self) -> bool {
        self.takes_over
    }

    /// Turns that frames take: one without history.
    fn turns(&self) -> &'static [Turn] {
        &Turn::ALL[..self.bound.len()]
    }

    /// What frames of a turn record; without history all turns are one.
    fn bound(&self, turn: Turn) -> &Bound {
        &self.bound[turn.index() % self.bound.len()]
    }

    /// The turn of the next [`Executor::run`]: the other one than that of the last. The first, and all without history, are
    /// [`Turn::Even`].
    fn next_turn(&self) -> Turn {
        self.last.map_or(Turn::Even, Turn::other)
    }

    /// Records all passes of a turn; `counts` what the pipeline does in each.
    fn record(&self, encoder: &mut gpu::Encoder, turn: Turn, counts: bool) -> Result<Marks, gpu::GpuError> {
        let bound = self.bound(turn);
        let mut times = Vec::with_capacity(bound.passes.len() + 1);
        let mut statistics = Vec::with_capacity(bound.passes.len());
        times.push(encoder.timestamp(vk::PipelineStageFlags2::ALL_COMMANDS)?);
        for pass in &bound.passes {
            encoder.begin_label(&pass.name);
            pass.barriers.record(encoder);
            // A query spans the whole of a rendering scope: it may neither begin nor end within.
            let query = counts.then(|| encoder.begin_statistics()).transpose()?;
            pass.body.record(encoder, &self.scripts)?;
            query.into_iter().for_each(|query| encoder.end_statistics(query));
            encoder.end_label();
            times.push(encoder.timestamp(vk::PipelineStageFlags2::ALL_COMMANDS)?);
            statistics.extend(query);
        }
        bound.final_barriers.record(encoder);
        Ok(Marks { times, statistics })
    }

    /// Records the frame, runs it, waits for it, and reports what it took. It counts nothing, as a frame of a
    /// program does not: queries around every pass are work of the device. Runs take turns: what the one before wrote of resources with
    /// history this one reads; the first finds zeros.
    ///
    /// # Errors
    /// The device was lost, or refuses the recording.
    pub fn run(&mut self) -> Result<FrameReport, GraphError> {
        self.run_with(false)
    }

    /// The same, where every pass counts what the pipeline does in it ([`PassReport::statistics`]), as far as the device counts.
    ///
    /// # Errors
    /// As [`Executor::run`].
    pub fn run_counted(&mut self) -> Result<FrameReport, GraphError> {
        self.run_with(true)
    }

    fn run_with(&mut self, counts: bool) -> Result<FrameReport, GraphError> {
        let start = Instant::now();
        let mut encoder = self.device.encoder()?;
        slot::after_earlier_frames(&mut encoder);
        let turn = self.next_turn();
        let Marks { times, statistics } = self.record(&mut encoder, turn, counts)?;
        let recorded = Instant::now();
        let completed = self.device.submit(encoder)?;
        let done = Instant::now();
        self.last = Some(turn);

        let bound = self.bound(turn);
        let passes = bound
            .passes
            .iter()
            .enumerate()
            .map(|(index, pass)| PassReport {
                name: pass.name.clone(),
                role: pass.role,
                work: pass.work,
                time_ns: completed.elapsed_ns(times[index], times[index + 1]),
                statistics: statistics.get(index).and_then(|query| completed.statistics(*query)),
                shared: pass.role.is_shared(),
            })
            .collect();
        let last = times[bound.passes.len()];
        Ok(FrameReport {
            passes,
            frame_ns: completed.elapsed_ns(times[0], last),
            cpu_record_ns: nanoseconds(recorded - start),
            cpu_wait_ns: nanoseconds(done - recorded),
            memory: self.memory.clone(),
            peak_bytes: self.plan.peak_bytes(),
            technique_bytes: self.plan.technique_bytes(),
            history_bytes: self.plan.history_bytes(),
        })
    }
}

/// Where the passes of a recorded frame begin and end, and what counts them.
struct Marks {
    /// The first pass begins at the first, each pass ends at the next.
    times: Vec<gpu::TimestampId>,
    /// One a pass, or none.
    statistics: Vec<gpu::StatisticsId>,
}

fn nanoseconds(duration: std::time::Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
