//! Measures frames of a technique.

use std::collections::BTreeMap;
use std::time::Instant;

use afterlight_graph::FrameReport;
use afterlight_graph::gpu::{GpuError, Statistics};
use afterlight_image::{Rgba8Image, RgbaF32Image};
use afterlight_measure::{Buffer, CostRecord, Memory, Pass, RunResult, Spread, Status};
use afterlight_techniques::cost::Workload;
use afterlight_techniques::{Counter, Params, Prepared, Renderer, TechniqueError};
use serde_json::Value;

use crate::session::{Chosen, ms_since};

/// A technique's figures and its image.
pub struct Measured {
    pub result: RunResult,
    /// Tone-mapped sRGB; none where it did not run.
    pub image: Option<Rgba8Image>,
    /// Linear radiance; none unless the session keeps it.
    pub radiance: Option<RgbaF32Image>,
}

/// Runs a technique: a warm-up frame, then `frames` measured ones; `step` is called after each.
///
/// What the device or the technique cannot do gives a result that says so. Errors that every technique would meet are
/// returned.
pub fn measure(
    renderer: &Renderer,
    chosen: &Chosen,
    workload: &Workload,
    frames: u32,
    mut step: impl FnMut(),
) -> Result<Measured, TechniqueError> {
    match run(renderer, chosen, workload, frames, &mut step) {
        Ok(measured) => Ok(measured),
        Err(error @ (TechniqueError::Scene(_) | TechniqueError::TooLarge { .. })) => Err(error),
        Err(error) => {
            let status = match error {
                TechniqueError::Unavailable { .. }
                | TechniqueError::Samples { .. }
                | TechniqueError::UnknownView { .. }
                | TechniqueError::Gpu(
                    GpuError::UnsupportedSamples { .. } | GpuError::UnsupportedFormat { .. },
                ) => Status::Unavailable,
                _ => Status::Failed,
            };
            let mut result = RunResult::without_figures(chosen.id(), status, error.to_string());
            result.params = params_record(chosen);
            Ok(Measured { result, image: None, radiance: None })
        }
    }
}

fn run(
    renderer: &Renderer,
    chosen: &Chosen,
    workload: &Workload,
    frames: u32,
    step: &mut impl FnMut(),
) -> Result<Measured, TechniqueError> {
    let start = Instant::now();
    let mut prepared: Prepared = renderer.prepare(chosen.technique, &chosen.params)?;
    let prepare_ms = ms_since(start);
    let warm_up = prepared.run()?;
    step();
    let mut reports = Vec::new();
    for _ in 0..frames {
        reports.push(prepared.run()?);
        step();
    }
    if reports.is_empty() {
        reports.push(warm_up);
    }
    let mut result = RunResult::without_figures(chosen.id(), Status::Ok, "");
    result.reason = None;
    result.params = params_record(chosen);
    result.frame_ms = spread_ns(&reports, |report| report.frame_ns);
    result.record_ms = spread_ns(&reports, |report| Some(report.cpu_record_ns as f64));
    result.passes = passes(&reports);
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
    result.reason = counters.iter().find(|counter| counter.dropped > 0).map(|counter| {
        let Counter { name, needed, capacity, dropped, .. } = counter;
        format!("{name}: found {needed} needed, {capacity} there; {dropped} samples dropped")
    });
    let cost = chosen.technique.predict(workload, &chosen.params);
    result.cost = Some(CostRecord { cmd: cost.cmd, proc: cost.proc, mem: cost.mem, band: cost.band });
    let (width, height) = prepared.size_px();
    let image = Rgba8Image { width, height, pixels: prepared.final_rgba8()? };
    let radiance = prepared.hdr_rgba()?.map(|pixels| RgbaF32Image { width, height, pixels });
    Ok(Measured { result, image: Some(image), radiance })
}

/// Every parameter with its value, numbers as numbers.
fn params_record(chosen: &Chosen) -> BTreeMap<String, Value> {
    let resolved = Params::resolved(&chosen.params, chosen.technique.info());
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

fn passes(reports: &[FrameReport]) -> Vec<Pass> {
    let Some(last) = reports.last() else { return Vec::new() };
    last.passes
        .iter()
        .enumerate()
        .map(|(index, pass)| Pass {
            name: pass.name.clone(),
            ms: spread_ns(reports, |report| report.passes.get(index)?.time_ns),
            statistics: pass.statistics.as_ref().map(statistics).unwrap_or_default(),
        })
        .collect()
}

fn statistics(statistics: &Statistics) -> BTreeMap<String, u64> {
    [
        ("input_vertices", statistics.input_vertices),
        ("input_primitives", statistics.input_primitives),
        ("vertex_invocations", statistics.vertex_invocations),
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
            .map(|one| Buffer { name: one.name.clone(), bytes: one.bytes })
            .collect(),
    }
}
