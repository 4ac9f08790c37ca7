//! Where the time of a frame goes: every pass beside the time that the bytes which it must move would take alone, at the
//! bandwidth of a fill or a copy on the same device.
//!
//! Bytes are those of buffers and images that a pass touches in full, by the plan of the frame: what it clears, attachments that
//! it writes, what it reads once a sample. Vertices, textures, surfaces that are read where a sample shows them, and queues are not in
//! them, so that the floor is one of some bytes, not of all. Every sample is taken to show a surface. A device that
//! compresses attachments can stay below the floor.

use afterlight_graph::gpu::Device;
use afterlight_graph::{BufferRole, Executor, Graph, PassRole};
use afterlight_lab::LabError;
use afterlight_measure::{Buffer, Pass, RunResult, Spread};
use serde::Serialize;

use super::share_needed;
use crate::kit::{Phase, owner_and_stage, part, phase};

/// Fills and copies that a bandwidth is measured by.
const COPIES: usize = 8;
/// Least and greatest bytes of a copy: beyond the caches of a device, and within its memory.
const COPY_BYTES: (u64, u64) = (16 << 20, 512 << 20);

/// The memory bandwidth of a device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Bandwidth {
    /// Bytes filled, and copied from there to another buffer.
    bytes: u64,
    /// None on a CPU, whose driver may put fills off to the first read.
    fill_ms: Option<Spread>,
    copy_ms: Spread,
    /// Bytes written in the fastest fill or read and written in the fastest copy, whichever is more, 10^9 a second: a driver may
    /// give copies to an engine of their own (406 on an NVIDIA H200, where fills reach 1,218).
    pub(crate) gb_per_s: f64,
}

impl Bandwidth {
    /// Measures copies of about as many bytes as a frame has; none where the device has no timestamps.
    pub fn measure(device: &Device, frame_bytes: u64) -> Result<Option<Bandwidth>, LabError> {
        let limit = device.features().max_storage_buffer_range.min(COPY_BYTES.1);
        let bytes = frame_bytes.clamp(COPY_BYTES.0.min(limit), limit) / 4 * 4;
        let mut graph = Graph::new();
        let source = graph.buffer("bench/source", BufferRole::Counters, bytes);
        let source = graph.clear_buffer("bench/fill", PassRole::Upkeep, source, 1);
        let copy = graph.buffer("bench/copy", BufferRole::Counters, bytes);
        let copy = graph.copy_buffer("bench/copy", PassRole::Upkeep, &source, copy);
        graph.keep(&copy);
        let mut executor = Executor::new(device, graph.plan(device)?)?;
        let mut times_ms = [Vec::new(), Vec::new()];
        for _ in 0..COPIES {
            let report = executor.run()?;
            for (times_ms, name) in times_ms.iter_mut().zip(["bench/fill", "bench/copy"]) {
                times_ms.extend(report.pass(name).and_then(|pass| pass.time_ns).map(|ns| ns / 1e6));
            }
        }
        let [mut fill_ms, copy_ms] = times_ms;
        if device.info().kind == "cpu" {
            fill_ms.clear();
        }
        Ok(Bandwidth::of(bytes, &fill_ms, &copy_ms))
    }

    fn of(bytes: u64, fill_ms: &[f64], copy_ms: &[f64]) -> Option<Bandwidth> {
        let fill_ms = Spread::of(fill_ms).filter(|ms| ms.min > 0.0);
        let copy_ms = Spread::of(copy_ms).filter(|ms| ms.min > 0.0)?;
        let least_ms = fill_ms.map_or(f64::INFINITY, |ms| ms.min).min(copy_ms.min / 2.0);
        Some(Bandwidth { bytes, fill_ms, copy_ms, gb_per_s: bytes as f64 / least_ms / 1e6 })
    }

    /// Milliseconds that so many bytes take.
    fn ms(&self, bytes: f64) -> f64 {
        bytes / self.gb_per_s / 1e6
    }
}

/// Bytes below which a pass is bound by its start, not by memory, so that no floor is told.
const FLOOR_BYTES_MIN: u64 = 1 << 16;

/// Which resources of a pass, by their names without the technique.
enum Parts {
    All,
    Of(&'static [&'static str]),
}

/// A stage with what it touches in full.
struct Known {
    stage: &'static str,
    reads: Parts,
    writes: Parts,
}

const NOTHING: Parts = Parts::Of(&[]);

/// Stages whose bytes are known, besides clears.
const KNOWN: &[Known] = &[
    Known { stage: "rsm", reads: NOTHING, writes: Parts::All },
    Known { stage: "gbuffer", reads: NOTHING, writes: Parts::All },
    Known { stage: "ids", reads: NOTHING, writes: Parts::All },
    Known { stage: "depth", reads: NOTHING, writes: Parts::All },
    Known {
        stage: "fill",
        reads: Parts::Of(&["depth"]),
        writes: Parts::Of(&["references", "wide references"]),
    },
    Known { stage: "mark", reads: Parts::Of(&["ids", "sample keys"]), writes: NOTHING },
    Known { stage: "derivatives", reads: NOTHING, writes: Parts::Of(&["triangle buffer"]) },
    Known {
        stage: "shade",
        reads: Parts::Of(&["ids", "references", "wide references", "heads", "sample keys"]),
        writes: Parts::Of(&["radiance"]),
    },
    Known { stage: "tonemap", reads: Parts::All, writes: Parts::All },
];

/// A pass beside its floor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Accounted {
    pub(crate) pass: String,
    pub(crate) phase: Phase,
    pub(crate) ms: Option<f64>,
    /// Bytes that it reads and writes in full; none where no resource of it is known to be.
    pub(crate) known_bytes: Option<u64>,
    /// What they take alone; none where they are few.
    pub(crate) floor_ms: Option<f64>,
    /// Time over floor.
    pub(crate) over_floor: Option<f64>,
}

/// The passes of a result in order.
pub(crate) fn account(result: &RunResult, bandwidth: Option<Bandwidth>) -> Vec<Accounted> {
    let accounted = |pass: &Pass| {
        let ms = pass.ms.map(|ms| ms.median);
        let known_bytes = known_bytes(pass, share_needed(result));
        let floor_bytes = known_bytes.filter(|bytes| *bytes >= FLOOR_BYTES_MIN);
        let floor_ms = floor_bytes.zip(bandwidth).map(|(bytes, bandwidth)| bandwidth.ms(bytes as f64));
        Accounted {
            pass: pass.name.clone(),
            phase: phase(&pass.name),
            ms,
            known_bytes,
            floor_ms,
            over_floor: ms.zip(floor_ms).map(|(ms, floor)| ms / floor),
        }
    };
    result.passes.iter().map(accounted).collect()
}

/// Bytes that a pass reads and writes in full; `share` is the part of the triangle buffer that is used.
fn known_bytes(pass: &Pass, share: f64) -> Option<u64> {
    let (_, stage) = owner_and_stage(&pass.name);
    let sum = |buffers: &[Buffer], parts: &Parts| {
        let counts = |buffer: &&Buffer| match parts {
            Parts::All => true,
            Parts::Of(parts) => parts.contains(&part(&buffer.name)),
        };
        let bytes = |buffer: &Buffer| match part(&buffer.name) {
            "triangle buffer" => (buffer.bytes as f64 * share) as u64,
            _ => buffer.bytes,
        };
        buffers.iter().filter(counts).map(bytes).sum::<u64>()
    };
    let bytes = if stage.starts_with("clear ") {
        sum(&pass.writes, &Parts::All)
    } else {
        let known = KNOWN.iter().find(|known| known.stage == stage)?;
        sum(&pass.reads, &known.reads) + sum(&pass.writes, &known.writes)
    };
    (bytes > 0).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_measure::Status;

    fn pass(name: &str, reads: &[(&str, u64)], writes: &[(&str, u64)]) -> Pass {
        let buffers = |all: &[(&str, u64)]| {
            all.iter()
                .map(|(name, bytes)| Buffer { name: (*name).into(), role: None, bytes: *bytes })
                .collect()
        };
        Pass {
            name: name.into(),
            role: None,
            work: None,
            ms: Spread::of(&[2.0]),
            reads: buffers(reads),
            writes: buffers(writes),
            statistics: Default::default(),
        }
    }

    #[test]
    fn only_what_is_touched_in_full_counts() {
        let of = |pass: &Pass| known_bytes(pass, 0.25);
        let shade = pass(
            "dais/shade",
            &[("dais/ids", 100), ("dais/depth", 70), ("dais/triangle buffer", 900)],
            &[("dais/radiance", 20)],
        );
        assert_eq!(of(&shade), Some(120));
        assert_eq!(
            of(&pass("dais/derivatives", &[("dais/visible bits", 8)], &[("dais/triangle buffer", 400)])),
            Some(100)
        );
        assert_eq!(of(&pass("dais/clear bits", &[], &[("dais/visible bits", 8)])), Some(8));
        assert_eq!(of(&pass("dais/scan", &[("dais/visible of draw", 8)], &[])), None);
        assert_eq!(of(&pass("dais/large triangles", &[], &[("dais/sample keys", 8)])), None);
        let fill = pass(
            "dais-list/fill",
            &[("dais-list/depth", 40)],
            &[("dais-list/heads", 4), ("dais-list/nodes", 99), ("dais-list/depth", 40)],
        );
        assert_eq!(of(&fill), Some(40));
        assert_eq!(of(&Pass { name: "dais-list/fill 2".to_owned(), ..fill }), Some(40));
    }

    #[test]
    fn floors_are_bytes_over_bandwidth() {
        // 2 × 500 MB in 1 ms, the fastest copy: 1000 GB/s.
        let bandwidth = Bandwidth::of(500_000_000, &[0.6, 0.7], &[2.0, 1.0, 3.0]).expect("there");
        assert!((bandwidth.gb_per_s - 1000.0).abs() < 1e-9);
        // 500 MB in 0.25 ms, the fastest fill.
        let of_fills = Bandwidth::of(500_000_000, &[0.25, 0.7], &[2.0, 1.0]).expect("there");
        assert!((of_fills.gb_per_s - 2000.0).abs() < 1e-9);
        assert!((Bandwidth::of(500_000_000, &[], &[1.0]).expect("there").gb_per_s - 1000.0).abs() < 1e-9);
        assert_eq!(Bandwidth::of(1, &[1.0], &[]), None);
        let mut result = RunResult::without_figures("dais", Status::Ok, "");
        result.passes = vec![pass("dais/ids", &[], &[("dais/ids", 1_000_000_000)])];
        let found = account(&result, Some(bandwidth));
        assert_eq!((found[0].floor_ms, found[0].over_floor), (Some(1.0), Some(2.0)));
        assert_eq!(account(&result, None)[0].over_floor, None);
        result.passes = vec![pass("dais/clear count", &[], &[("dais/triangle count", 16)])];
        let found = account(&result, Some(bandwidth));
        assert_eq!((found[0].known_bytes, found[0].over_floor), (Some(16), None));
    }

    /// A pass whose time is told apart for every kind of column.
    #[test]
    fn phases_are_the_papers() {
        for (name, expected) in [
            ("shared/rsm", Phase::Indirect),
            ("dais/depth", Phase::Prepass),
            ("dais-list/depth 2", Phase::Prepass),
            ("dais-list/fill", Phase::Fill),
            ("dais/large triangles", Phase::Fill),
            ("dais/clear keys", Phase::Fill),
            ("dais/clear bits", Phase::Find),
            ("dais/mark", Phase::Find),
            ("dais-list/derivatives", Phase::Derivatives),
            ("dais-multirate/shade", Phase::Shade),
            ("present/tonemap", Phase::Present),
        ] {
            assert_eq!(phase(name), expected, "{name}");
        }
    }
}
