//! The experiments of Schied and Dachsbacher 2015, section 5, and what they share: scenes, columns, and a result's passes and
//! buffers in the paper's terms.

mod account;
pub(super) mod fig5;
pub(super) mod fig7;
mod flight;
pub(super) mod table1;

use afterlight_measure::{RunResult, Status};
use afterlight_techniques::cost::Workload;
use afterlight_techniques::{Renderer, find};
use serde::Serialize;

use super::{MIB, PaperRecord, Setup, at_size, counter, measure, number_text, stand_in, status_text};
use crate::args::{self, BenchArgs, CommonArgs};
use crate::failure::Failure;
use crate::frames::Measured;
use crate::progress::Progress;
use crate::session::{self, Session};

/// What the paper measured on.
const PAPER_DEVICE: &str = "GeForce GTX 980";
/// The paper's samples a pixel.
const PAPER_SAMPLES: u32 = 8;
/// Width and height of Table 1, pixels.
const PAPER_PX: (u32, u32) = (3840, 2160);

/// The two scenes of the paper.
const PAPER_SCENES: [PaperScene; 2] = [
    PaperScene {
        name: "Sponza",
        word: "sponza",
        triangles: 262_267,
        dais: row(1.10, 0.08, 3.56, 20.79, 27.01, 2.84, 509.09),
        list: row(1.09, 0.08, 4.26, 20.80, 28.18, 2.84, 293.50),
        multirate: row(1.18, 0.08, 5.59, 8.28, 16.51, 2.84, 782.00),
        deferred: deferred_row(11.35, 22.03, 35.98),
        claimed: Claimed { list_memory: 0.23, dais_time: 0.75, multirate_time: 0.46 },
    },
    PaperScene {
        name: "San Miguel",
        word: "san_miguel",
        triangles: 8_145_860,
        dais: row(7.17, 0.65, 19.75, 33.00, 66.97, 54.69, 560.93),
        list: row(7.13, 0.64, 23.67, 33.63, 71.81, 54.69, 374.25),
        multirate: row(7.34, 0.64, 23.65, 17.87, 55.76, 54.69, 858.86),
        deferred: deferred_row(26.87, 36.07, 77.14),
        claimed: Claimed { list_memory: 0.30, dais_time: 0.87, multirate_time: 0.72 },
    },
];

/// A scene of the paper with its lines of Table 1.
#[derive(Debug)]
struct PaperScene {
    name: &'static str,
    /// What file names of the scene hold.
    word: &'static str,
    triangles: u32,
    dais: PaperRow,
    list: PaperRow,
    multirate: PaperRow,
    deferred: PaperRow,
    claimed: Claimed,
}

/// The paper's claims as ratios to deferred shading, as it rounds them.
#[derive(Clone, Copy, Debug)]
struct Claimed {
    list_memory: f64,
    dais_time: f64,
    multirate_time: f64,
}

/// A line of Table 1. Its "MB" are MiB: 3840×2160×8 samples of 20 bytes are 1265.62.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct PaperRow {
    z_prepass_ms: Option<f64>,
    derivatives_ms: Option<f64>,
    /// The depth pre-pass included.
    fill_ms: f64,
    shade_ms: f64,
    frame_ms: f64,
    triangle_buffer_mib: Option<f64>,
    total_mib: f64,
}

const fn row(
    z_prepass_ms: f64,
    derivatives_ms: f64,
    fill_ms: f64,
    shade_ms: f64,
    frame_ms: f64,
    triangle_buffer_mib: f64,
    total_mib: f64,
) -> PaperRow {
    PaperRow {
        z_prepass_ms: Some(z_prepass_ms),
        derivatives_ms: Some(derivatives_ms),
        triangle_buffer_mib: Some(triangle_buffer_mib),
        ..PaperRow { total_mib, ..deferred_row(fill_ms, shade_ms, frame_ms) }
    }
}

const fn deferred_row(fill_ms: f64, shade_ms: f64, frame_ms: f64) -> PaperRow {
    PaperRow {
        z_prepass_ms: None,
        derivatives_ms: None,
        fill_ms,
        shade_ms,
        frame_ms,
        triangle_buffer_mib: None,
        total_mib: 1265.62,
    }
}

/// What a column is in the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// The baseline.
    Deferred,
    /// DAIS as it is by default here, which the paper does not have: the triangle buffer is filled in compute (tessellated surfaces
    /// fill it as the paper's do).
    Resolve,
    /// The paper's DAIS.
    Cache,
    List,
    /// As [`Kind::Resolve`], indirect light at half the rate.
    MultiRate,
    /// The paper's multi-rate DAIS.
    MultiRateCache,
}

impl Kind {
    const ALL: [Kind; 6] =
        [Kind::Deferred, Kind::Resolve, Kind::Cache, Kind::List, Kind::MultiRate, Kind::MultiRateCache];

    fn technique(self) -> &'static str {
        match self {
            Kind::Deferred => "deferred-dedup",
            Kind::Resolve | Kind::Cache => "dais",
            Kind::List => "dais-list",
            Kind::MultiRate | Kind::MultiRateCache => "dais-multirate",
        }
    }

    fn label(self) -> &'static str {
        match self {
            Kind::Cache => "dais, fill=cache",
            Kind::MultiRateCache => "dais-multirate, fill=cache",
            _ => self.technique(),
        }
    }

    /// Parameters besides those of every column.
    fn params(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Kind::Cache | Kind::MultiRateCache => &[("fill", "cache")],
            _ => &[],
        }
    }

    /// The paper's line; the default way to fill stands beside the paper's as well.
    fn paper(self, scene: &PaperScene) -> PaperRow {
        match self {
            Kind::Deferred => scene.deferred,
            Kind::Resolve | Kind::Cache => scene.dais,
            Kind::List => scene.list,
            Kind::MultiRate | Kind::MultiRateCache => scene.multirate,
        }
    }
}

/// A technique of an experiment.
struct Column {
    kind: Kind,
    /// None where this build does not have the technique.
    setup: Option<Setup>,
}

impl Column {
    fn label(&self) -> &'static str {
        self.kind.label()
    }
}

/// Columns of an experiment, those of `--techniques` where it is given. All draw everything, as in the paper.
fn columns(args: &BenchArgs, kinds: &[Kind]) -> Result<Vec<Column>, Failure> {
    let samples = samples(args);
    let mut columns = Vec::new();
    for &kind in kinds {
        let params = [&[("cull", "none")], kind.params()].concat();
        let setup = find(kind.technique())
            .map(|_| Setup::new(kind.label(), samples, kind.technique(), &params))
            .transpose()?;
        columns.push(Column { kind, setup });
    }
    if args.given.techniques {
        let wanted = session::choose("--techniques", &args.techniques, &[])?;
        columns.retain(|column| wanted.iter().any(|one| one.id() == column.kind.technique()));
    }
    if columns.is_empty() {
        let known: Vec<&str> = kinds.iter().map(|kind| kind.technique()).collect();
        let expected = format!("some of: {}", known.join(", "));
        return Err(Failure::option("--techniques", args.techniques.join(","), expected));
    }
    Ok(columns)
}

/// The same options with samples a pixel: those that are asked for, else the paper's, or the most that the device has below.
fn with_samples(args: &BenchArgs) -> Result<BenchArgs, Failure> {
    let mut args = args.clone();
    if !args.given.samples {
        let device = session::open_device(&args.common)?;
        let counts = [PAPER_SAMPLES, PAPER_SAMPLES / 2, PAPER_SAMPLES / 4];
        let there = counts.into_iter().find(|count| device.features().supports_samples(*count, false));
        (args.common.samples, args.given.samples) = (there.unwrap_or(PAPER_SAMPLES), true);
    }
    Ok(args)
}

fn samples(args: &BenchArgs) -> u32 {
    if args.given.samples { args.common.samples } else { PAPER_SAMPLES }
}

/// What columns measured in their order, frames in turn, and the groups in which they took turns.
fn measure_columns(
    base: &Renderer,
    columns: &[Column],
    workload: &Workload,
    frames: u32,
    progress: &Progress,
) -> Result<(Vec<Measured>, usize), Failure> {
    let there: Vec<&Setup> = columns.iter().filter_map(|column| column.setup.as_ref()).collect();
    let found = measure(base, &there, workload, frames, progress)?;
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
fn broken_off(columns: &[Column], results: &[RunResult]) -> Option<String> {
    let labels: Vec<&str> = columns.iter().map(Column::label).collect();
    super::broken_off(labels.iter().copied().zip(results)).or_else(|| {
        let (label, result) = labels.iter().zip(results).find(|(_, result)| dropped(result) > 0)?;
        Some(format!("{label}: {}", result.reason.as_deref().unwrap_or("samples dropped")))
    })
}

fn dropped(result: &RunResult) -> u64 {
    let counts = result.counters.iter().filter(|(name, _)| name.ends_with("_dropped"));
    counts.filter_map(|(_, count)| count.as_u64()).sum()
}

/// A scene that an experiment runs on.
struct Source {
    source: String,
    /// The paper's scene that it is, or stands for.
    paper: Option<&'static PaperScene>,
    stands_in: bool,
}

impl Source {
    /// What a report calls it: a file without its folder.
    fn title(&self) -> String {
        match self.paper.filter(|_| self.stands_in) {
            Some(paper) => format!("{} for {}", self.source, paper.name),
            None => self.source.rsplit('/').next().unwrap_or(&self.source).to_owned(),
        }
    }
}

/// What `--scenes` names, else built-in scenes with the triangles of the paper's.
fn sources(args: &BenchArgs, paper: &'static [PaperScene]) -> Vec<Source> {
    if !args.given.scenes {
        let stands_in = |paper: &'static PaperScene| Source {
            source: stand_in(paper.triangles, args.scale),
            paper: Some(paper),
            stands_in: true,
        };
        return paper.iter().map(stands_in).collect();
    }
    let named = |source: &String| {
        let name = source.to_lowercase();
        let paper = PAPER_SCENES.iter().find(|paper| name.contains(paper.word));
        Source { source: source.clone(), paper, stands_in: false }
    };
    args.scenes.iter().map(named).collect()
}

/// The two sizes of an animation: full HD and twice its width and height, or the given one and twice it, scaled.
fn sizes(args: &BenchArgs) -> [CommonArgs; 2] {
    let small = at_size(args, super::FULL_HD_PX);
    let (width, height) = if args.given.size {
        (2 * args.common.width, 2 * args.common.height)
    } else {
        (2 * super::FULL_HD_PX.0, 2 * super::FULL_HD_PX.1)
    };
    let scaled = |px: u32| ((f64::from(px) * args.scale).round() as u32).max(1);
    let large = CommonArgs { width: scaled(width), height: scaled(height), ..small.clone() };
    [small, large]
}

/// As the paper, with light gathered from a reflective shadow map, 64 samples a pixel.
fn with_indirect(common: CommonArgs) -> CommonArgs {
    CommonArgs { indirect: args::Indirect::Rsm, ..common }
}

/// What a pass is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Phase {
    /// The light's view, which all techniques share.
    Indirect,
    /// The depth pre-pass.
    Prepass,
    /// Drawing what shows: G-buffer, triangle IDs, keys, references, lists, with what is cleared for it.
    Fill,
    /// Finding the triangles that show in a finished visibility buffer, and sizes of dispatches.
    Find,
    /// Screen-space derivatives of visible triangles.
    Derivatives,
    Shade,
    /// What every frame ends in.
    Present,
}

/// Whose a pass is, and its stage: bands of the image have passes of their own, told apart by a number.
fn owner_and_stage(pass: &str) -> (&str, &str) {
    let (owner, stage) = pass.split_once('/').unwrap_or(("", pass));
    (owner, stage.trim_end_matches(|c: char| c.is_ascii_digit() || c == ' '))
}

fn phase(pass: &str) -> Phase {
    let (owner, stage) = owner_and_stage(pass);
    match (owner, stage) {
        ("shared", _) => Phase::Indirect,
        ("present" | "post", _) => Phase::Present,
        (_, "depth") => Phase::Prepass,
        (_, "mark" | "count" | "scan" | "size" | "clear bits" | "clear count") => Phase::Find,
        (_, "derivatives") => Phase::Derivatives,
        (_, stage) if stage.contains("shade") || stage.contains("resolve") => Phase::Shade,
        _ => Phase::Fill,
    }
}

/// A result's times by the paper's columns, medians, ms; none where the device has no timestamps or nothing is of that kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct Times {
    /// The light's view.
    indirect_ms: Option<f64>,
    z_prepass_ms: Option<f64>,
    /// The depth pre-pass included.
    fill_ms: Option<f64>,
    /// Finding triangles that show; in the paper a part of the fill.
    find_ms: Option<f64>,
    derivatives_ms: Option<f64>,
    /// All before shading but the light's view: the first phase of deferred shading.
    geometry_ms: Option<f64>,
    shade_ms: Option<f64>,
    frame_ms: Option<f64>,
}

impl Times {
    fn of(result: &RunResult) -> Times {
        let sum = |phases: &[Phase]| {
            let of_phases = result.passes.iter().filter(|pass| phases.contains(&phase(&pass.name)));
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
            shade_ms: sum(&[Phase::Shade]),
            frame_ms: result.frame_ms.map(|frame| frame.median),
        }
    }
}

/// A result's memory, MiB as the allocator counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct Sizes {
    /// Records of visible triangles, with the room beyond what the view needs.
    triangle_buffer_mib: Option<f64>,
    /// The part of them that the view needs.
    triangle_buffer_needed_mib: Option<f64>,
    /// Triangles stored, those that are stored twice counted twice.
    triangles_stored: Option<u64>,
    /// The paper's total: all but the radiance and the memoization cache.
    total_mib: Option<f64>,
    /// The same without the room that the triangle buffer has beyond what the view needs.
    total_without_room_mib: Option<f64>,
    /// Everything, each buffer in full.
    with_radiance_mib: Option<f64>,
    /// What is allocated at once for the frame: buffers that live at different times share memory. The final image, the light's
    /// view and the radiance are in it.
    peak_mib: Option<f64>,
}

/// What the paper's totals leave out.
const NOT_IN_TOTAL: [&str; 3] = ["radiance", "cache entries", "cache locks"];

impl Sizes {
    fn of(result: &RunResult) -> Sizes {
        let Some(memory) = &result.memory else { return Sizes::default() };
        let mib = |bytes: u64| bytes as f64 / MIB;
        let records = memory.buffers.iter().find(|buffer| part(&buffer.name) == "triangle buffer");
        let total = memory.buffers.iter().filter(|buffer| !NOT_IN_TOTAL.contains(&part(&buffer.name)));
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

/// A resource's name without its technique.
fn part(name: &str) -> &str {
    name.split_once('/').map_or(name, |(_, part)| part)
}

/// The share of the triangle buffer that the view needs.
fn share_needed(result: &RunResult) -> f64 {
    let needed = counter(result, "triangles_needed").zip(counter(result, "triangles_capacity"));
    needed.map_or(1.0, |(needed, capacity)| needed as f64 / capacity.max(1) as f64).min(1.0)
}

/// A claim of the paper as a ratio in one run.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Claim {
    claim: String,
    scene: String,
    column: &'static str,
    /// Measured; the median where there are several views.
    ratio: Option<f64>,
    /// Over the views.
    least: Option<f64>,
    greatest: Option<f64>,
    /// The paper's; none where the scene is not the paper's.
    paper: Option<f64>,
    met: Option<bool>,
    /// Whether scene, size and samples are the paper's.
    as_in_paper: bool,
}

/// Whether a ratio is at most the paper's, to the two digits that it gives.
fn at_most(ratio: f64, paper: f64) -> bool {
    ratio < paper + 0.005
}

fn claims_text(claims: &[Claim]) -> String {
    let line = |claim: &Claim| {
        let answer = match claim.met {
            Some(true) => "met",
            Some(false) => "not met",
            None => "not judged",
        };
        let range = match (claim.least, claim.greatest) {
            (Some(least), Some(greatest)) => format!(" ({least:.2} – {greatest:.2} over the views)"),
            _ => String::new(),
        };
        format!(
            "{}, {}: {}: {}{range} (paper: {}): {answer}{}\n",
            claim.scene,
            claim.column,
            claim.claim,
            number_text(claim.ratio, 2),
            number_text(claim.paper, 2),
            if claim.as_in_paper { "" } else { ", under other conditions than the paper's" }
        )
    };
    // What did not run has said so already.
    claims.iter().filter(|claim| claim.ratio.is_some()).map(line).collect()
}

/// What the terminal shows last.
fn verdict_text(claims: &[Claim], notes: &[String]) -> String {
    let notes: String = notes.iter().map(|note| format!("note: {note}\n")).collect();
    claims_text(claims) + &notes
}

/// The notes on a section and the claims on its scene, as sentences.
fn section_note(notes: &[String], claims: &[Claim]) -> String {
    let claims = claims_text(claims);
    notes.iter().map(String::as_str).chain(claims.lines()).collect::<Vec<_>>().join(". ")
}

/// What opening a scene has to tell: a light that was put in, what of the settings it cannot give.
fn session_notes(session: &Session, source: &Source, asked: &CommonArgs, common: &CommonArgs) -> Vec<String> {
    let mut notes = session.renderer.warnings();
    if common.lights != asked.lights {
        notes.push(format!("{} has no light: a seeded one is put in", source.title()));
    }
    notes
}

/// What differs from the paper.
fn notes(args: &BenchArgs, sources: &[Source], width_px: u32) -> Vec<String> {
    let mut notes = Vec::new();
    for source in sources.iter().filter(|source| source.stands_in) {
        let Some(paper) = source.paper else { continue };
        notes.push(format!("{} stands in for {} of the paper", source.source, paper.name));
    }
    if width_px != PAPER_PX.0 {
        notes.push(format!(
            "{width_px} pixels wide instead of the paper's {}; its figures are shown as they are",
            PAPER_PX.0
        ));
    }
    if samples(args) != PAPER_SAMPLES {
        notes.push(format!("{} samples instead of the paper's {PAPER_SAMPLES}", samples(args)));
    }
    notes.push("a MiB is what the paper calls MB; totals leave out the radiance and the memoization cache, as the paper's do".to_owned());
    notes
}

/// Whether scene, size and samples are the paper's.
fn as_in_paper(args: &BenchArgs, source: &Source, width_px: u32) -> bool {
    source.paper.is_some() && !source.stands_in && width_px == PAPER_PX.0 && samples(args) == PAPER_SAMPLES
}

fn paper_record(section: &'static str) -> PaperRecord {
    let (width, height) = PAPER_PX;
    PaperRecord { key: "schied-2015", section, device: PAPER_DEVICE, width, height }
}

/// Why columns have no figures, a line each.
fn reasons_text<'a>(results: impl IntoIterator<Item = (&'a str, Status, Option<&'a str>)>) -> String {
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
    use super::flight::tests::args;
    use super::*;

    #[test]
    fn scenes_are_known_by_their_files() {
        let sources = |more: &[&str]| sources(&args(more), &PAPER_SCENES);
        let named = sources(&["--scenes", "a/Sponza.gltf,san_miguel_meshopt.gltf,builtin:edge"]);
        let papers: Vec<_> = named.iter().map(|one| one.paper.map(|paper| paper.name)).collect();
        assert_eq!(papers, [Some("Sponza"), Some("San Miguel"), None]);
        assert!(named.iter().all(|one| !one.stands_in));
        assert_eq!(named[0].title(), "Sponza.gltf");
        let stand_ins = sources(&["--scale", "0.5"]);
        assert_eq!(stand_ins[1].source, "builtin:colonnade?triangles=2036465");
        assert!(stand_ins.iter().all(|one| one.stands_in && one.paper.is_some()));
        assert_eq!(sources(&["--scene", "a.glb"]).len(), 1);
    }

    #[test]
    fn only_the_papers_conditions_count_as_them() {
        let is_papers = |more: &[&str], width_px: u32| {
            let args = args(more);
            as_in_paper(&args, &sources(&args, &PAPER_SCENES)[0], width_px)
        };
        assert!(is_papers(&["--scenes", "sponza.gltf"], 3840));
        assert!(!is_papers(&["--scenes", "sponza.gltf"], 1920));
        assert!(!is_papers(&["--scenes", "sponza.gltf", "--samples", "4"], 3840));
        assert!(!is_papers(&["--scenes", "other.gltf"], 3840));
        assert!(!is_papers(&[], 3840));
    }

    #[test]
    fn the_larger_size_is_twice_the_smaller() {
        let of = |more: &[&str]| sizes(&args(more)).map(|size| (size.width, size.height));
        assert_eq!(of(&[]), [(1920, 1080), (3840, 2160)]);
        assert_eq!(of(&["--width", "100", "--height", "60", "--scale", "0.5"]), [(50, 30), (100, 60)]);
    }

    #[test]
    fn columns_are_the_techniques_of_this_build() {
        let all = columns(&args(&[]), &Kind::ALL).expect("known");
        assert_eq!(all.len(), Kind::ALL.len());
        for column in &all {
            let info = find(column.kind.technique()).map(|technique| technique.info());
            assert_eq!(column.setup.is_some(), info.is_some(), "{}", column.label());
            if let (Some(setup), Some(info)) = (&column.setup, info) {
                assert_eq!(setup.samples, PAPER_SAMPLES);
                assert_eq!(setup.chosen.params.text(info, "cull"), "none", "{}", column.label());
            }
        }
        let cache = all.iter().find(|column| column.kind == Kind::Cache).and_then(|c| c.setup.as_ref());
        let chosen = &cache.expect("in every build").chosen;
        assert_eq!(chosen.params.text(chosen.technique.info(), "fill"), "cache");
        assert_eq!(columns(&args(&["--techniques", "dais"]), &Kind::ALL).expect("known").len(), 2);
        assert!(columns(&args(&["--techniques", "tiled"]), &Kind::ALL).is_err());
    }

    #[test]
    fn times_and_sizes_are_told_apart() {
        let pass = |name: &str, ms: f64| serde_json::json!({"name": name, "ms": {"median": ms, "min": ms, "max": ms}});
        let buffer = |name: &str, mib: u64| serde_json::json!({"name": name, "bytes": mib << 20});
        let mut result = RunResult::without_figures("dais", Status::Ok, "");
        result.passes = serde_json::from_value(serde_json::json!([
            pass("shared/rsm", 64.0),
            pass("dais/clear cache", 1.0),
            pass("dais/depth", 2.0),
            pass("dais/fill", 4.0),
            pass("dais/size", 8.0),
            pass("dais/derivatives", 16.0),
            pass("dais/shade", 32.0),
            pass("present/tonemap", 128.0),
        ]))
        .expect("passes");
        result.memory = serde_json::from_value(serde_json::json!({
            "technique_bytes": 15 << 20, "peak_bytes": 9 << 20,
            "buffers": [buffer("dais/depth", 1), buffer("dais/triangle buffer", 2), buffer("dais/radiance", 4),
                buffer("dais/cache entries", 8)],
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
