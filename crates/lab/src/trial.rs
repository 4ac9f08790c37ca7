//! Measures frames of techniques, one after another or in turn.

use std::collections::BTreeMap;
use std::time::Instant;

use afterlight_graph::gpu::{GpuError, Statistics};
use afterlight_graph::{FrameReport, GraphError, Plan, PlannedPass, Traffic};
use afterlight_image::{Rgba8Image, RgbaF32Image};
use afterlight_measure::{Buffer, CostRecord, Memory, Pass, RunResult, Spread, Status};
use afterlight_renderer::{Prepared, Renderer};
use afterlight_techniques::cost::Workload;
use afterlight_techniques::{Counter, TechniqueError};
use serde_json::Value;

use crate::Chosen;
use crate::session::ms_since;

/// A technique's figures and its image.
pub struct Measured {
    /// The figures, or why there are none.
    pub result: RunResult,
    /// Tone-mapped sRGB; none where it did not run.
    pub image: Option<Rgba8Image>,
    /// Linear radiance; none unless the session keeps it.
    pub radiance: Option<RgbaF32Image>,
}

/// Runs a technique: a warm-up frame, then `frames` measured ones; `step` is called after each.
///
/// What the device or the technique cannot do gives a result that says so.
///
/// # Errors
/// What every technique would meet: the scene, an image that is too large.
pub fn measure(
    renderer: &Renderer,
    chosen: &Chosen,
    workload: &Workload,
    frames: u32,
    step: impl FnMut(),
) -> Result<Measured, TechniqueError> {
    measure_and(renderer, chosen, workload, frames, |_| Ok(()), step)
}

/// As [`measure`]; `read` sees the technique after its last frame, for what it has kept.
///
/// # Errors
/// As [`measure`].
pub fn measure_and(
    renderer: &Renderer,
    chosen: &Chosen,
    workload: &Workload,
    frames: u32,
    read: impl FnOnce(&mut Prepared) -> Result<(), TechniqueError>,
    mut step: impl FnMut(),
) -> Result<Measured, TechniqueError> {
    let run = || {
        let mut trial = Trial::start(renderer, chosen)?;
        step();
        for _ in 0..frames {
            trial.frame()?;
            step();
        }
        read(&mut trial.prepared)?;
        trial.finish(chosen, workload)
    };
    match run() {
        Err(error @ (TechniqueError::Scene(_) | TechniqueError::TooLarge { .. })) => Err(error),
        Err(error) => Ok(without_figures(chosen, &error)),
        measured => measured,
    }
}

/// A technique with the renderer that prepares it: settings may differ between entrants.
pub struct Entrant<'a> {
    /// Prepares it.
    pub renderer: &'a Renderer,
    /// The technique and its parameters.
    pub chosen: &'a Chosen,
}

/// What [`measure_in_turn`] found.
pub struct InTurn {
    /// One an entrant, in their order.
    pub measured: Vec<Measured>,
    /// Groups of entrants that were in memory at once; frames took turns within each.
    pub groups: usize,
}

/// Runs techniques with frames in turn (the first of each, the second of each, …), so that a device that grows hot or is
/// shared slows all alike. Those that fit into `budget_bytes` at once, at least one, take turns.
///
/// What the device or a technique cannot do gives a result that says so, also what is too large for the device.
///
/// # Errors
/// The scene.
pub fn measure_in_turn(
    entrants: &[Entrant<'_>],
    workload: &Workload,
    frames: u32,
    budget_bytes: u64,
    mut step: impl FnMut(),
) -> Result<InTurn, TechniqueError> {
    let mut measured = Vec::new();
    let mut groups = 0;
    while measured.len() < entrants.len() {
        let group = start_group(&entrants[measured.len()..], budget_bytes, &mut step)?;
        measured.extend(run_group(group, workload, frames, &mut step)?);
        groups += 1;
    }
    Ok(InTurn { measured, groups })
}

/// An entrant that runs, or why it does not.
type Started<'a> = (&'a Chosen, Result<Trial, TechniqueError>);

/// Starts entrants until what they hold reaches the budget.
fn start_group<'a>(
    entrants: &[Entrant<'a>],
    budget_bytes: u64,
    step: &mut impl FnMut(),
) -> Result<Vec<Started<'a>>, TechniqueError> {
    let mut group: Vec<Started<'a>> = Vec::new();
    let mut held_bytes = 0;
    for entrant in entrants {
        if held_bytes >= budget_bytes {
            break;
        }
        let trial = match Trial::start(entrant.renderer, entrant.chosen) {
            Err(error @ TechniqueError::Scene(_)) => return Err(error),
            trial => trial,
        };
        match &trial {
            Ok(trial) => held_bytes += trial.warm_up.peak_bytes,
            // What found no memory beside others may find it alone.
            Err(TechniqueError::Gpu(GpuError::OutOfMemory { .. })) if held_bytes > 0 => break,
            Err(_) => {}
        }
        group.push((entrant.chosen, trial));
        step();
    }
    Ok(group)
}

/// Runs the frames of a group in turn.
fn run_group(
    mut group: Vec<Started<'_>>,
    workload: &Workload,
    frames: u32,
    step: &mut impl FnMut(),
) -> Result<Vec<Measured>, TechniqueError> {
    for _ in 0..frames {
        for (_, started) in &mut group {
            if let Ok(trial) = started
                && let Err(error) = trial.frame()
            {
                *started = Err(error);
            }
            step();
        }
    }
    let finish =
        |(chosen, started): Started<'_>| match started.and_then(|trial| trial.finish(chosen, workload)) {
            Err(error @ TechniqueError::Scene(_)) => Err(error),
            Err(error) => Ok(without_figures(chosen, &error)),
            measured => measured,
        };
    group.into_iter().map(finish).collect()
}

/// Whether an error says that the device or the technique cannot do what is asked for, or that it broke off.
pub(crate) fn status_of(error: &TechniqueError) -> Status {
    match error {
        TechniqueError::Unavailable { .. }
        | TechniqueError::Untessellated { .. }
        | TechniqueError::Samples { .. }
        | TechniqueError::TooLarge { .. }
        | TechniqueError::Graph(GraphError::Groups { .. })
        | TechniqueError::UnknownView { .. }
        | TechniqueError::Gpu(GpuError::UnsupportedSamples { .. } | GpuError::UnsupportedFormat { .. }) => {
            Status::Unavailable
        }
        _ => Status::Failed,
    }
}

/// A result that says why there are no figures.
fn without_figures(chosen: &Chosen, error: &TechniqueError) -> Measured {
    let mut result = RunResult::without_figures(chosen.id(), status_of(error), error.to_string());
    result.params = params_record(chosen);
    Measured { result, image: None, radiance: None }
}

/// A technique that is ready, with the frames that it has drawn.
struct Trial {
    prepared: Prepared,
    prepare_ms: f64,
    warm_up: FrameReport,
    /// Of measured frames.
    reports: Vec<FrameReport>,
}

impl Trial {
    /// Prepares a technique and draws a warm-up frame, which counts what passes do: measured frames do not, since that takes time.
    fn start(renderer: &Renderer, chosen: &Chosen) -> Result<Trial, TechniqueError> {
        let start = Instant::now();
        let mut prepared = renderer.prepare(chosen.technique, &chosen.params)?;
        let prepare_ms = ms_since(start);
        let warm_up = prepared.run_counted()?;
        Ok(Trial { prepared, prepare_ms, warm_up, reports: Vec::new() })
    }

    /// Draws a measured frame.
    fn frame(&mut self) -> Result<(), TechniqueError> {
        self.reports.push(self.prepared.run()?);
        Ok(())
    }

    /// Figures of the measured frames, or of the warm-up frame where there are none, and the image.
    fn finish(self, chosen: &Chosen, workload: &Workload) -> Result<Measured, TechniqueError> {
        let Trial { mut prepared, prepare_ms, warm_up, mut reports } = self;
        let counted: Vec<_> = warm_up.passes.iter().map(|pass| pass.statistics).collect();
        if reports.is_empty() {
            reports.push(warm_up);
        }
        let mut result = RunResult::without_figures(chosen.id(), Status::Ok, "");
        result.reason = None;
        result.params = params_record(chosen);
        result.frame_ms = spread_ns(&reports, |report| report.frame_ns);
        result.record_ms = spread_ns(&reports, |report| Some(report.cpu_record_ns as f64));
        result.passes = passes(&reports, &counted, prepared.executor().plan());
        result.memory = reports.last().map(memory);
        result.counters.insert("draws".to_owned(), prepared.draw_calls.into());
        result.counters.insert("prepare_ms".to_owned(), Value::from(prepare_ms));
        let counters = prepared.counters()?;
        for counter in &counters {
            for (what, count) in
                [("needed", counter.needed), ("capacity", counter.capacity), ("dropped", counter.dropped)]
            {
                result.counters.insert(format!("{}_{what}", counter.name), Value::from(count));
            }
        }
        result.reason = counters.iter().find_map(Counter::dropped_text);
        if let Some(pairs) = prepared.light_pairs()? {
            result.counters.insert("light_pairs_tested".to_owned(), pairs.tested.into());
            result.counters.insert("light_pairs_lit".to_owned(), pairs.lit.into());
            result.counters.insert("light_pairs_rounded_pixels".to_owned(), pairs.rounded_pixels.into());
        }
        let cost = chosen.technique.predict(workload, &chosen.params);
        result.cost = Some(CostRecord { cmd: cost.cmd, proc: cost.proc, mem: cost.mem, band: cost.band });
        let (width, height) = prepared.size_px();
        let image = Rgba8Image { width, height, pixels: prepared.final_rgba8()? };
        let radiance = prepared.hdr_rgba()?.map(|pixels| RgbaF32Image { width, height, pixels });
        Ok(Measured { result, image: Some(image), radiance })
    }
}

/// Every parameter with its value, numbers as numbers.
fn params_record(chosen: &Chosen) -> BTreeMap<String, Value> {
    let resolved = chosen.params.resolved();
    resolved
        .into_iter()
        .map(|(key, value)| {
            let value = value.parse::<i64>().map_or_else(|_| Value::from(value), Value::from);
            (key, value)
        })
        .collect()
}

/// The spread of a time in nanoseconds, as milliseconds.
fn spread_ns(reports: &[FrameReport], value: impl Fn(&FrameReport) -> Option<f64>) -> Option<Spread> {
    let samples_ms: Vec<f64> = reports.iter().filter_map(value).map(|ns| ns / 1e6).collect();
    Spread::of(&samples_ms)
}

/// Passes with their times in all frames, and what they counted in one.
fn passes(reports: &[FrameReport], counted: &[Option<Statistics>], plan: &Plan) -> Vec<Pass> {
    let Some(last) = reports.last() else { return Vec::new() };
    last.passes
        .iter()
        .enumerate()
        .map(|(index, pass)| {
            let (reads, writes) = plan.passes.get(index).map(|pass| traffic(plan, pass)).unwrap_or_default();
            Pass {
                name: pass.name.clone(),
                role: Some(pass.role),
                work: Some(pass.work),
                ms: spread_ns(reports, |report| report.passes.get(index)?.time_ns),
                reads,
                writes,
                statistics: counted.get(index).and_then(Option::as_ref).map(statistics).unwrap_or_default(),
            }
        })
        .collect()
}

/// What a pass reads and what it writes.
fn traffic(plan: &Plan, pass: &PlannedPass) -> (Vec<Buffer>, Vec<Buffer>) {
    let traffic = plan.traffic(pass);
    let of = |counts: fn(&Traffic<'_>) -> bool| {
        let counted = traffic.iter().filter(|one| counts(one));
        counted
            .map(|one| Buffer { name: one.name.to_owned(), role: Some(one.role), bytes: one.bytes })
            .collect()
    };
    (of(|one| one.read), of(|one| one.written))
}

fn statistics(statistics: &Statistics) -> BTreeMap<String, u64> {
    [
        ("input_vertices", statistics.input_vertices),
        ("input_primitives", statistics.input_primitives),
        ("vertex_invocations", statistics.vertex_invocations),
        ("clipping_invocations", statistics.clipping_invocations),
        ("clipping_primitives", statistics.clipping_primitives),
        ("fragment_invocations", statistics.fragment_invocations),
        ("compute_invocations", statistics.compute_invocations),
    ]
    .into_iter()
    .map(|(name, count)| (name.to_owned(), count))
    .collect()
}

fn memory(report: &FrameReport) -> Memory {
    Memory {
        technique_bytes: report.technique_bytes,
        peak_bytes: report.peak_bytes,
        buffers: report
            .memory
            .iter()
            .filter(|one| !one.shared && !one.output)
            .map(|one| Buffer { name: one.name.clone(), role: Some(one.role), bytes: one.bytes })
            .collect(),
    }
}
