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
use afterlight_measure::{Buffer, Pass, PassWork, RunResult, Spread};
use serde::Serialize;

use super::share_needed;
use crate::kit::{Phase, of_role, phase};

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

/// Which resources of a pass.
#[derive(Clone, Copy)]
enum Parts {
    All,
    /// Those of some roles.
    Of(&'static [BufferRole]),
}

const NOTHING: Parts = Parts::Of(&[]);

/// What a pass touches in full: what it reads, and what it writes. None where nothing is known to be.
fn touched_in_full(role: PassRole, work: PassWork, tests_depth: bool) -> Option<(Parts, Parts)> {
    use BufferRole::{
        Counters, Depth, SampleKeys, SurfaceListHeads, Surfaces, Targets, Triangles, Visibility,
    };
    match work {
        PassWork::Clear => return Some((NOTHING, Parts::All)),
        PassWork::Copy => return Some((Parts::All, Parts::All)),
        PassWork::Raster | PassWork::Compute => {}
    }
    match role {
        PassRole::Shared | PassRole::DepthPrepass => Some((NOTHING, Parts::All)),
        // After a depth pre-pass depth is tested, and surfaces are written once a sample.
        PassRole::Geometry if work == PassWork::Raster && tests_depth => {
            Some((Parts::Of(&[Depth]), Parts::Of(&[Surfaces, Visibility])))
        }
        PassRole::Geometry if work == PassWork::Raster => {
            Some((NOTHING, Parts::Of(&[Surfaces, Visibility, Depth, Counters])))
        }
        // What compute rasterises is bound by its triangles.
        PassRole::Geometry => None,
        PassRole::TriangleSelection => Some((Parts::Of(&[Visibility, SampleKeys]), NOTHING)),
        PassRole::Derivatives => Some((NOTHING, Parts::Of(&[Triangles]))),
        PassRole::Shading => {
            Some((Parts::Of(&[Visibility, SurfaceListHeads, SampleKeys]), Parts::Of(&[Targets])))
        }
        PassRole::Present => Some((Parts::All, Parts::All)),
        PassRole::LightAssignment
        | PassRole::Resolve
        | PassRole::Culling
        | PassRole::Transparency
        | PassRole::Filter
        | PassRole::Upkeep => None,
    }
}

/// A pass beside its floor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Accounted {
    pub(crate) pass: String,
    /// None in a record from before passes had roles.
    pub(crate) phase: Option<Phase>,
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
            phase: phase(pass),
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
    let tests_depth = of_role(&pass.reads, BufferRole::Depth).is_some();
    let (reads, writes) = touched_in_full(pass.role?, pass.work?, tests_depth)?;
    let sum = |buffers: &[Buffer], parts: Parts| {
        let counts = |buffer: &&Buffer| match parts {
            Parts::All => true,
            Parts::Of(roles) => buffer.role.is_some_and(|role| roles.contains(&role)),
        };
        let bytes = |buffer: &Buffer| match buffer.role == Some(BufferRole::Triangles) {
            true => (buffer.bytes as f64 * share) as u64,
            false => buffer.bytes,
        };
        buffers.iter().filter(counts).map(bytes).sum::<u64>()
    };
    let bytes = sum(&pass.reads, reads) + sum(&pass.writes, writes);
    (bytes > 0).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_measure::Status;

    use crate::kit::phases::tests::renamed;
    use BufferRole::{
        Depth, SampleKeys, SurfaceListHeads, SurfaceListNodes, Targets, TriangleSets, Triangles, Visibility,
    };

    type Buffers<'a> = &'a [(BufferRole, u64)];

    fn pass(role: PassRole, work: PassWork, reads: Buffers<'_>, writes: Buffers<'_>) -> Pass {
        let buffers = |all: Buffers<'_>| {
            let buffer = |(role, bytes): &(BufferRole, u64)| Buffer {
                name: role.to_string(),
                role: Some(*role),
                bytes: *bytes,
            };
            all.iter().map(buffer).collect()
        };
        Pass {
            name: format!("dais/{role}"),
            role: Some(role),
            work: Some(work),
            ms: Spread::of(&[2.0]),
            reads: buffers(reads),
            writes: buffers(writes),
            statistics: Default::default(),
        }
    }

    #[test]
    fn only_what_is_touched_in_full_counts() {
        use PassRole::{DepthPrepass, Derivatives, Geometry, Shading, TriangleSelection};
        use PassWork::{Clear, Compute, Raster};
        let of = |role, work, reads: Buffers<'_>, writes: Buffers<'_>| {
            known_bytes(&pass(role, work, reads, writes), 0.25)
        };
        let surfaces = [(Visibility, 100), (Depth, 70), (Triangles, 900)];
        assert_eq!(of(Shading, Compute, &surfaces, &[(Targets, 20)]), Some(120));
        assert_eq!(of(Derivatives, Compute, &[(TriangleSets, 8)], &[(Triangles, 400)]), Some(100));
        assert_eq!(of(TriangleSelection, Clear, &[], &[(TriangleSets, 8)]), Some(8));
        assert_eq!(of(TriangleSelection, Compute, &[(TriangleSets, 8)], &[]), None);
        assert_eq!(of(TriangleSelection, Compute, &[(SampleKeys, 80)], &[(TriangleSets, 8)]), Some(80));
        assert_eq!(of(Geometry, Compute, &[], &[(SampleKeys, 8)]), None);
        assert_eq!(of(Geometry, Raster, &[], &[(Visibility, 40), (Depth, 40)]), Some(80));
        assert_eq!(of(DepthPrepass, Raster, &[], &[(Depth, 40)]), Some(40));
        let lists = [(SurfaceListHeads, 4), (SurfaceListNodes, 99), (Depth, 40)];
        assert_eq!(of(Geometry, Raster, &[(Depth, 40)], &lists), Some(40));
        assert_eq!(of(Geometry, Raster, &[(Depth, 40)], &[(Visibility, 40)]), Some(80));
    }

    #[test]
    fn names_are_for_people() {
        let mut result = RunResult::without_figures("dais", Status::Ok, "");
        result.passes = vec![
            pass(PassRole::Geometry, PassWork::Raster, &[], &[(Visibility, 1 << 20), (Depth, 1 << 20)]),
            pass(PassRole::Shading, PassWork::Compute, &[(Visibility, 1 << 20)], &[(Targets, 1 << 20)]),
        ];
        let bandwidth = Bandwidth::of(500_000_000, &[0.6], &[2.0]);
        let told = |result: &RunResult| {
            account(result, bandwidth)
                .into_iter()
                .map(|one| Accounted { pass: String::new(), ..one })
                .collect::<Vec<_>>()
        };
        assert_eq!(told(&renamed(&result)), told(&result));
        assert_eq!(told(&result)[1].phase, Some(Phase::Shade));
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
        result.passes = vec![pass(PassRole::Geometry, PassWork::Raster, &[], &[(Visibility, 1_000_000_000)])];
        let found = account(&result, Some(bandwidth));
        assert_eq!((found[0].floor_ms, found[0].over_floor), (Some(1.0), Some(2.0)));
        assert_eq!(account(&result, None)[0].over_floor, None);
        result.passes = vec![pass(PassRole::TriangleSelection, PassWork::Clear, &[], &[(TriangleSets, 16)])];
        let found = account(&result, Some(bandwidth));
        assert_eq!((found[0].known_bytes, found[0].over_floor), (Some(16), None));
    }

    /// A pass whose time is told apart for every kind of column.
    #[test]
    fn phases_are_the_papers() {
        for (role, expected) in [
            (PassRole::Shared, Phase::Indirect),
            (PassRole::DepthPrepass, Phase::Prepass),
            (PassRole::Geometry, Phase::Fill),
            (PassRole::TriangleSelection, Phase::Find),
            (PassRole::Derivatives, Phase::Derivatives),
            (PassRole::Shading, Phase::Shade),
            (PassRole::Present, Phase::Present),
        ] {
            assert_eq!(phase(&pass(role, PassWork::Compute, &[], &[])), Some(expected), "{role}");
        }
    }
}
