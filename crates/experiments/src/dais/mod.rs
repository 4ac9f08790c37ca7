//! What the experiments of Schied and Dachsbacher 2015, section 5, share: the paper's figures, scenes, columns, and a result's
//! passes and buffers in the paper's terms.

pub(crate) mod account;
pub(crate) mod flight;
mod paper;

use std::path::PathBuf;

use afterlight_lab::spec::check_samples;
use afterlight_lab::{
    FrameSpec, LabError, Listener, Measured, Session, Setup, choose, measure_setups, open_device,
};
use afterlight_measure::{Buffer, BufferRole, RunResult, Status};
use afterlight_renderer::Renderer;
use afterlight_techniques::cost::Workload;
use afterlight_techniques::{Indirect, find};
use serde::Serialize;

use crate::kit::{MIB, Phase, at_size, check_run, counter, of_role, phase, stand_in};

pub(crate) use paper::{PAPER, PAPER_SAMPLES, PaperRow, PaperScene, paper_px, paper_record};

/// Under what conditions an experiment of the paper runs: what its specification asks, with samples that the device has.
#[derive(Clone, Debug)]
pub(crate) struct Conditions {
    /// Share of the frame's width and height.
    pub scale: f64,
    /// None for scenes that stand in for the paper's.
    pub scenes: Vec<String>,
    /// Techniques by their ids, or `all`.
    pub techniques: Vec<String>,
    /// Frames measured of each technique.
    pub frames: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// Camera path; none for a fly-through of the scene.
    pub path: Option<PathBuf>,
    /// Views along it.
    pub views: u32,
    /// What frames look like.
    pub frame: FrameSpec,
}

impl Conditions {
    /// Checks them, and takes `samples`, else the paper's, or the most that the device has below.
    pub fn with_samples(self, samples: Option<u32>) -> Result<Conditions, LabError> {
        check_run(self.scale, self.frames, &self.frame)?;
        afterlight_lab::spec::check(
            "views",
            self.views,
            (1..=VIEWS_MAX).contains(&self.views),
            "1 to 10,000",
        )?;
        let samples = match samples {
            Some(samples) => {
                check_samples(samples)?;
                samples
            }
            None => {
                let device = open_device(&FrameSpec { samples: 1, ..self.frame.clone() })?;
                let counts = [PAPER_SAMPLES, PAPER_SAMPLES / 2, PAPER_SAMPLES / 4];
                let mut there = counts.into_iter();
                let there = there.find(|count| device.features().supports_samples(*count, false));
                there.unwrap_or(PAPER_SAMPLES)
            }
        };
        Ok(Conditions { samples, ..self })
    }
}

/// Most views along a path.
const VIEWS_MAX: u32 = 10_000;

/// What a column is in the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The baseline.
    Deferred,
    /// DAIS whose triangle buffer is filled in compute, which the paper does not have (tessellated surfaces fill it as the paper's do). The
    /// raster part finds what shows, as it does for the baseline.
    Resolve,
    /// The same where what shows is found in compute too, as by default on a GPU: another rasteriser than the baseline's.
    ResolveCompute,
    /// The paper's DAIS.
    Cache,
    List,
    /// As [`Kind::Resolve`], indirect light at half the rate.
    MultiRate,
    /// As [`Kind::ResolveCompute`], indirect light at half the rate.
    MultiRateCompute,
    /// The paper's multi-rate DAIS.
    MultiRateCache,
}

impl Kind {
    /// What has the baseline's rasteriser first, then what has another.
    pub const ALL: [Kind; 8] = [
        Kind::Deferred,
        Kind::Resolve,
        Kind::Cache,
        Kind::List,
        Kind::MultiRate,
        Kind::MultiRateCache,
        Kind::ResolveCompute,
        Kind::MultiRateCompute,
    ];

    pub fn technique(self) -> &'static str {
        match self {
            Kind::Deferred => "deferred-dedup",
            Kind::Resolve | Kind::ResolveCompute | Kind::Cache => "dais",
            Kind::List => "dais-list",
            Kind::MultiRate | Kind::MultiRateCompute | Kind::MultiRateCache => "dais-multirate",
        }
    }

    pub fn label(self) -> &'static str {
        match self {
            Kind::Cache => "dais, fill=cache",
            Kind::ResolveCompute => "dais, visibility=compute",
            Kind::MultiRateCompute => "dais-multirate, visibility=compute",
            Kind::MultiRateCache => "dais-multirate, fill=cache",
            _ => self.technique(),
        }
    }

    /// Parameters besides those of every column.
    fn params(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Kind::Cache | Kind::MultiRateCache => &[("fill", "cache")],
            Kind::Resolve | Kind::MultiRate => &[("visibility", "raster")],
            Kind::ResolveCompute | Kind::MultiRateCompute => &[("visibility", "compute")],
            Kind::Deferred | Kind::List => &[],
        }
    }

    /// The paper's line; ways to fill that it does not have stand beside it as well.
    pub fn paper(self, scene: &PaperScene) -> PaperRow {
        match self {
            Kind::Deferred => scene.deferred,
            Kind::Resolve | Kind::ResolveCompute | Kind::Cache => scene.dais,
            Kind::List => scene.list,
            Kind::MultiRate | Kind::MultiRateCompute | Kind::MultiRateCache => scene.multirate,
        }
    }
}

/// A technique of an experiment.
pub(crate) struct Column {
    pub kind: Kind,
    /// None where this build does not have the technique.
    pub setup: Option<Setup>,
}

impl Column {
    pub fn label(&self) -> &'static str {
        self.kind.label()
    }
}

/// Columns of an experiment, those of the techniques that are asked for. All draw everything, as in the paper.
pub(crate) fn columns(asked: &Conditions, kinds: &[Kind]) -> Result<Vec<Column>, LabError> {
    let mut columns = Vec::new();
    for &kind in kinds {
        let params = [&[("cull", "none")], kind.params()].concat();
        let setup = find(kind.technique())
            .map(|_| Setup::new(kind.label(), asked.samples, kind.technique(), &params))
            .transpose()?;
        columns.push(Column { kind, setup });
    }
    if asked.techniques.iter().all(|id| id.trim() != "all") {
        let wanted = choose("techniques", &asked.techniques, &[])?;
        columns.retain(|column| wanted.iter().any(|one| one.id() == column.kind.technique()));
    }
    if columns.is_empty() {
        let known: Vec<&str> = kinds.iter().map(|kind| kind.technique()).collect();
        let expected = format!("some of: {}", known.join(", "));
        return Err(LabError::setting("techniques", asked.techniques.join(","), expected));
    }
    Ok(columns)
}

/// What columns measured in their order, frames in turn, and the groups in which they took turns.
pub(crate) fn measure_columns(
    base: &Renderer,
    columns: &[Column],
    workload: &Workload,
    frames: u32,
    listener: &dyn Listener,
) -> Result<(Vec<Measured>, usize), LabError> {
    let there: Vec<&Setup> = columns.iter().filter_map(|column| column.setup.as_ref()).collect();
    let found = measure_setups(base, &there, workload, frames, listener)?;
    let mut measured = found.measured.into_iter();
    let of_column = |column: &Column| {
        column.setup.as_ref().and_then(|_| measured.next()).unwrap_or_else(|| {
            let technique = column.kind.technique();
            let result = RunResult::without_figures(technique, Status::Unavailable, "not in this build");
            Measured { result, image: None, radiance: None }
        })
    };
    Ok((columns.iter().map(of_column).collect(), found.groups))
}

/// Why an experiment failed: a technique that broke off, or dropped what it found no room for.
pub(crate) fn broken_off(columns: &[Column], results: &[RunResult]) -> Option<String> {
    let labels: Vec<&str> = columns.iter().map(Column::label).collect();
    crate::kit::broken_off(labels.iter().copied().zip(results)).or_else(|| {
        let (label, result) = labels.iter().zip(results).find(|(_, result)| dropped(result) > 0)?;
        Some(format!("{label}: {}", result.reason.as_deref().unwrap_or("samples dropped")))
    })
}

fn dropped(result: &RunResult) -> u64 {
    let counts = result.counters.iter().filter(|(name, _)| name.ends_with("_dropped"));
    counts.filter_map(|(_, count)| count.as_u64()).sum()
}

/// A scene that an experiment runs on.
pub(crate) struct Source {
    pub source: String,
    /// The paper's scene that it is, or stands for.
    pub paper: Option<&'static PaperScene>,
    pub stands_in: bool,
}

impl Source {
    /// What a report calls it: a file without its folder.
    pub fn title(&self) -> String {
        match self.paper.filter(|_| self.stands_in) {
            Some(paper) => format!("{} for {}", self.source, paper.name),
            None => self.source.rsplit('/').next().unwrap_or(&self.source).to_owned(),
        }
    }
}

/// What is named, else built-in scenes with the triangles of the paper's.
pub(crate) fn sources(asked: &Conditions, paper: &'static [PaperScene]) -> Vec<Source> {
    if asked.scenes.is_empty() {
        let stands_in = |paper: &'static PaperScene| Source {
            source: stand_in(paper.triangles, asked.scale),
            paper: Some(paper),
            stands_in: true,
        };
        return paper.iter().map(stands_in).collect();
    }
    let named = |source: &String| {
        let name = source.to_lowercase();
        let paper = PAPER.scenes.iter().find(|paper| name.contains(&paper.word));
        Source { source: source.clone(), paper, stands_in: false }
    };
    asked.scenes.iter().map(named).collect()
}

/// The two sizes of an animation: the frame's, scaled, and twice its width and height, scaled.
pub(crate) fn sizes(asked: &Conditions) -> [FrameSpec; 2] {
    let twice = FrameSpec {
        width: asked.frame.width.saturating_mul(2),
        height: asked.frame.height.saturating_mul(2),
        ..asked.frame.clone()
    };
    [&asked.frame, &twice].map(|frame| at_size(frame, asked.scale))
}

/// As the paper, with light gathered from a reflective shadow map, 64 samples a pixel.
pub(crate) fn with_indirect(mut frame: FrameSpec) -> FrameSpec {
    frame.effects.indirect.method = Indirect::Rsm;
    frame
}

/// A result's times by the paper's columns, medians, ms; none where the device has no timestamps or nothing is of that kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Times {
    /// The light's view.
    pub indirect_ms: Option<f64>,
    pub z_prepass_ms: Option<f64>,
    /// The depth pre-pass included.
    pub fill_ms: Option<f64>,
    /// Finding triangles that show; in the paper a part of the fill.
    pub find_ms: Option<f64>,
    pub derivatives_ms: Option<f64>,
    /// All before shading but the light's view: the first phase of deferred shading.
    pub geometry_ms: Option<f64>,
    /// Finding lights included.
    pub shade_ms: Option<f64>,
    pub frame_ms: Option<f64>,
}

impl Times {
    pub fn of(result: &RunResult) -> Times {
        let sum = |phases: &[Phase]| {
            let of_phases =
                result.passes.iter().filter(|pass| phase(pass).is_some_and(|one| phases.contains(&one)));
            let times: Vec<f64> = of_phases.filter_map(|pass| Some(pass.ms?.median)).collect();
            (!times.is_empty()).then(|| times.iter().sum())
        };
        Times {
            indirect_ms: sum(&[Phase::Indirect]),
            z_prepass_ms: sum(&[Phase::Prepass]),
            fill_ms: sum(&[Phase::Prepass, Phase::Fill]),
            find_ms: sum(&[Phase::Find]),
            derivatives_ms: sum(&[Phase::Derivatives]),
            geometry_ms: sum(&[Phase::Prepass, Phase::Fill, Phase::Find, Phase::Derivatives]),
            shade_ms: sum(&[Phase::Lights, Phase::Shade]),
            frame_ms: result.frame_ms.map(|frame| frame.median),
        }
    }
}

/// A result's memory, MiB as the allocator counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Sizes {
    /// Records of visible triangles, with the room beyond what the view needs.
    pub triangle_buffer_mib: Option<f64>,
    /// The part of them that the view needs.
    pub triangle_buffer_needed_mib: Option<f64>,
    /// Triangles stored, those that are stored twice counted twice.
    pub triangles_stored: Option<u64>,
    /// The paper's total: all but the radiance and the memoization cache.
    pub total_mib: Option<f64>,
    /// The same without the room that the triangle buffer has beyond what the view needs.
    pub total_without_room_mib: Option<f64>,
    /// Everything, each buffer in full.
    pub with_radiance_mib: Option<f64>,
    /// What is allocated at once for the frame: buffers that live at different times share memory. The final image, the light's
    /// view and the radiance are in it.
    pub peak_mib: Option<f64>,
}

/// Whether the paper's totals count it: they leave out the radiance and the memoization cache.
fn is_in_total(buffer: &Buffer) -> bool {
    buffer.role.is_some_and(|role| match role {
        BufferRole::Targets | BufferRole::MemoizationCache => false,
        BufferRole::Surfaces
        | BufferRole::Depth
        | BufferRole::Visibility
        | BufferRole::SampleKeys
        | BufferRole::RasterQueues
        | BufferRole::SurfaceListHeads
        | BufferRole::SurfaceListNodes
        | BufferRole::Claims
        | BufferRole::Triangles
        | BufferRole::TriangleSets
        | BufferRole::Lights
        | BufferRole::Counters
        | BufferRole::Scene
        | BufferRole::Constants
        | BufferRole::Shared
        | BufferRole::Transparency
        | BufferRole::Filters => true,
    })
}

impl Sizes {
    pub fn of(result: &RunResult) -> Sizes {
        let Some(memory) = &result.memory else { return Sizes::default() };
        let mib = |bytes: u64| bytes as f64 / MIB;
        let records = of_role(&memory.buffers, BufferRole::Triangles);
        let total = memory.buffers.iter().filter(|buffer| is_in_total(buffer));
        let total_mib = mib(total.map(|buffer| buffer.bytes).sum());
        let triangle_buffer_mib = records.map(|records| mib(records.bytes));
        let needed_mib = triangle_buffer_mib.map(|allocated| allocated * share_needed(result));
        let room_mib =
            triangle_buffer_mib.zip(needed_mib).map_or(0.0, |(allocated, needed)| allocated - needed);
        Sizes {
            triangle_buffer_mib,
            triangle_buffer_needed_mib: needed_mib,
            triangles_stored: counter(result, "triangles_needed"),
            total_mib: Some(total_mib),
            total_without_room_mib: Some(total_mib - room_mib),
            with_radiance_mib: Some(mib(memory.technique_bytes)),
            peak_mib: Some(mib(memory.peak_bytes)),
        }
    }
}

/// The share of the triangle buffer that the view needs.
pub(crate) fn share_needed(result: &RunResult) -> f64 {
    let needed = counter(result, "triangles_needed").zip(counter(result, "triangles_capacity"));
    needed.map_or(1.0, |(needed, capacity)| needed as f64 / capacity.max(1) as f64).min(1.0)
}

/// What opening a scene has to tell: a light that was put in, what of the settings it cannot give.
pub(crate) fn session_notes(
    session: &Session,
    source: &Source,
    asked: &FrameSpec,
    frame: &FrameSpec,
) -> Vec<String> {
    let mut notes = session.renderer.warnings();
    if frame.lights != asked.lights {
        notes.push(format!("{} has no light: a seeded one is put in", source.title()));
    }
    notes
}

/// What differs from the paper.
pub(crate) fn notes(asked: &Conditions, sources: &[Source], width_px: u32) -> Vec<String> {
    let mut notes = Vec::new();
    for source in sources.iter().filter(|source| source.stands_in) {
        let Some(paper) = source.paper else { continue };
        notes.push(format!("{} stands in for {} of the paper", source.source, paper.name));
    }
    if width_px != paper_px().0 {
        notes.push(format!(
            "{width_px} pixels wide instead of the paper's {}; its figures are shown as they are",
            paper_px().0
        ));
    }
    if asked.samples != PAPER_SAMPLES {
        notes.push(format!("{} samples instead of the paper's {PAPER_SAMPLES}", asked.samples));
    }
    notes.push("a MiB is what the paper calls MB; totals leave out the radiance and the memoization cache, as the paper's do".to_owned());
    notes
}

/// Whether scene, size and samples are the paper's.
pub(crate) fn as_in_paper(asked: &Conditions, source: &Source, width_px: u32) -> bool {
    source.paper.is_some() && !source.stands_in && width_px == paper_px().0 && asked.samples == PAPER_SAMPLES
}

/// Why columns have no figures, a line each.
pub(crate) fn reasons_text<'a>(
    results: impl IntoIterator<Item = (&'a str, Status, Option<&'a str>)>,
) -> String {
    let mut lines: Vec<String> = results
        .into_iter()
        .filter(|(_, status, _)| *status != Status::Ok)
        .map(|(label, _, reason)| format!("{label}: {}\n", reason.unwrap_or("no reason given")))
        .collect();
    lines.dedup();
    lines.concat()
}

#[cfg(test)]
mod tests {
    use super::flight::tests::conditions;
    use super::*;
    use afterlight_techniques::{Cull, DrawParams};

    #[test]
    fn scenes_are_known_by_their_files() {
        let sources = |scenes: &[&str], scale: f64| {
            let scenes = scenes.iter().map(|scene| (*scene).to_owned()).collect();
            sources(&Conditions { scenes, scale, ..conditions() }, &PAPER.scenes)
        };
        let named = sources(&["a/Sponza.gltf", "san_miguel_meshopt.gltf", "builtin:edge"], 1.0);
        let papers: Vec<_> = named.iter().map(|one| one.paper.map(|paper| paper.name.as_str())).collect();
        assert_eq!(papers, [Some("Sponza"), Some("San Miguel"), None]);
        assert!(named.iter().all(|one| !one.stands_in));
        assert_eq!(named[0].title(), "Sponza.gltf");
        let stand_ins = sources(&[], 0.5);
        assert_eq!(stand_ins[1].source, "builtin:colonnade?triangles=2036465");
        assert!(stand_ins.iter().all(|one| one.stands_in && one.paper.is_some()));
        assert_eq!(sources(&["a.glb"], 1.0).len(), 1);
    }

    #[test]
    fn only_the_papers_conditions_count_as_them() {
        let is_papers = |scene: &str, samples: u32, width_px: u32| {
            let scenes =
                Some(scene).filter(|scene| !scene.is_empty()).map(str::to_owned).into_iter().collect();
            let asked = Conditions { scenes, samples, ..conditions() };
            as_in_paper(&asked, &sources(&asked, &PAPER.scenes)[0], width_px)
        };
        assert!(is_papers("sponza.gltf", 8, 3840));
        assert!(!is_papers("sponza.gltf", 8, 1920));
        assert!(!is_papers("sponza.gltf", 4, 3840));
        assert!(!is_papers("other.gltf", 8, 3840));
        assert!(!is_papers("", 8, 3840));
    }

    #[test]
    fn the_larger_size_is_twice_the_smaller() {
        let of = |width: u32, height: u32, scale: f64| {
            let frame = FrameSpec { width, height, ..FrameSpec::default() };
            sizes(&Conditions { frame, scale, ..conditions() }).map(|size| (size.width, size.height))
        };
        assert_eq!(of(1920, 1080, 1.0), [(1920, 1080), (3840, 2160)]);
        assert_eq!(of(100, 60, 0.5), [(50, 30), (100, 60)]);
    }

    #[test]
    fn columns_are_the_techniques_of_this_build() {
        let all = columns(&conditions(), &Kind::ALL).expect("known");
        assert_eq!(all.len(), Kind::ALL.len());
        for column in &all {
            let info = find(column.kind.technique()).map(|technique| technique.info());
            assert_eq!(column.setup.is_some(), info.is_some(), "{}", column.label());
            if let (Some(setup), Some(info)) = (&column.setup, info) {
                assert_eq!(setup.samples, PAPER_SAMPLES);
                assert_eq!(setup.chosen.params.typed::<DrawParams>().cull, Cull::None, "{}", info.id);
            }
        }
        let cache = all.iter().find(|column| column.kind == Kind::Cache).and_then(|c| c.setup.as_ref());
        let chosen = &cache.expect("in every build").chosen;
        assert_eq!(chosen.params.get("fill").as_deref(), Some("cache"));
        // Like against like first: no column leaves its rasteriser to what the device prefers, and another than the baseline's comes last.
        let visibility = |column: &Column| {
            let setup = column.setup.as_ref().expect("in every build");
            setup.chosen.params.get("visibility").unwrap_or_else(|| "raster".to_owned())
        };
        let filled_by_raster = |column: &&Column| !matches!(column.kind, Kind::Cache | Kind::MultiRateCache);
        let found: Vec<String> = all.iter().filter(filled_by_raster).map(visibility).collect();
        assert_eq!(found, ["raster", "raster", "raster", "raster", "compute", "compute"]);
        let of =
            |id: &str| columns(&Conditions { techniques: vec![id.to_owned()], ..conditions() }, &Kind::ALL);
        assert_eq!(of("dais").expect("known").len(), 3);
        assert!(of("tiled").is_err());
    }

    #[test]
    fn times_and_sizes_are_told_apart() {
        let pass = |name: &str, role: &str, ms: f64| serde_json::json!({"name": name, "role": role, "ms": {"median": ms, "min": ms, "max": ms}});
        let buffer = |name: &str, role: &str, mib: u64| serde_json::json!({"name": name, "role": role, "bytes": mib << 20});
        let mut result = RunResult::without_figures("dais", Status::Ok, "");
        result.passes = serde_json::from_value(serde_json::json!([
            pass("shared/rsm", "shared", 64.0),
            pass("dais/clear cache", "geometry", 1.0),
            pass("dais/depth", "depth-prepass", 2.0),
            pass("dais/fill", "geometry", 4.0),
            pass("dais/size", "triangle-selection", 8.0),
            pass("dais/derivatives", "derivatives", 16.0),
            pass("dais/shade", "shading", 32.0),
            pass("present/tonemap", "present", 128.0),
        ]))
        .expect("passes");
        result.memory = serde_json::from_value(serde_json::json!({
            "technique_bytes": 15 << 20, "peak_bytes": 9 << 20,
            "buffers": [buffer("dais/depth", "depth", 1), buffer("dais/triangle buffer", "triangles", 2), buffer("dais/radiance", "targets", 4),
                buffer("dais/cache entries", "memoization-cache", 8)],
        }))
        .ok();
        result.counters.insert("triangles_needed".into(), 5.into());
        result.counters.insert("triangles_capacity".into(), 20.into());
        let times = Times::of(&result);
        assert_eq!(
            (times.indirect_ms, times.z_prepass_ms, times.fill_ms),
            (Some(64.0), Some(2.0), Some(7.0))
        );
        assert_eq!(
            (times.find_ms, times.derivatives_ms, times.shade_ms),
            (Some(8.0), Some(16.0), Some(32.0))
        );
        assert_eq!((times.geometry_ms, times.frame_ms), (Some(31.0), None));
        let sizes = Sizes::of(&result);
        assert_eq!(
            (sizes.total_mib, sizes.with_radiance_mib, sizes.peak_mib),
            (Some(3.0), Some(15.0), Some(9.0))
        );
        assert_eq!((sizes.triangle_buffer_mib, sizes.triangle_buffer_needed_mib), (Some(2.0), Some(0.5)));
        assert_eq!((sizes.triangles_stored, sizes.total_without_room_mib), (Some(5), Some(1.5)));
        let renamed = crate::kit::phases::tests::renamed(&result);
        assert_eq!((Times::of(&renamed), Sizes::of(&renamed)), (times, sizes), "names are for people");
    }

    #[test]
    fn what_is_dropped_fails() {
        let columns = [Column { kind: Kind::List, setup: None }];
        let mut result = RunResult::without_figures("dais-list", Status::Ok, "nodes: 3 samples dropped");
        result.counters.insert("nodes_dropped".into(), 0.into());
        assert_eq!(broken_off(&columns, std::slice::from_ref(&result)), None);
        result.counters.insert("nodes_dropped".into(), 3.into());
        let told = broken_off(&columns, &[result]).expect("fails");
        assert!(told.contains("dais-list") && told.contains("3 samples"), "{told}");
    }
}
