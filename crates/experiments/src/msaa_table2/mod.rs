//! `bench msaa-table2`: frame times of anti-aliasing for deferred shading, three scenes and two numbers of lights
//! (Fridvalszky and Tóth 2020, Table 2), with the paper's filters and what it compared to without figures.
//!
//! Times of two devices are not compared; ratios of techniques on one are.

use std::sync::LazyLock;

use afterlight_lab::{FrameSpec, LabError, Listener, Session, Setup, choose, measure_setups};
use afterlight_measure::{RunResult, Spread, Status};
use afterlight_report::text::{self, grouped, number_text, status_text};
use afterlight_report::{bytes_text, ms_text};
use afterlight_techniques::{Post, params::choices};
use serde::{Deserialize, Serialize};

use crate::kit::{
    DEFAULT_FRAMES, FILTERS, FULL_HD_PX, Header, Options, Outcome, PaperFigures, Row, Specification, Table,
    all_techniques, at_size, broken_off, check_run, counter, notes_text, paper_data, reasons_text,
    sample_counts_up_to, stand_in,
};

/// What the experiment is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Share of the frame's width and height, above 0, at most 1.
    pub scale: f64,
    /// Scenes; where there is none, built-in ones with the triangles of the paper's, times the square of `scale`.
    pub scenes: Vec<String>,
    /// Numbers of seeded lights.
    pub light_counts: Vec<u32>,
    /// Techniques by their ids, or `all`.
    pub techniques: Vec<String>,
    /// Numbers of samples a pixel, ascending.
    pub sample_counts: Vec<u32>,
    /// Frames measured of each technique after a warm-up frame, 1 to 10,000.
    pub frames: u32,
    /// What frames look like; `lights`, `samples`, `post` and `view` do not count.
    pub frame: FrameSpec,
}

impl Default for Spec {
    fn default() -> Spec {
        Spec {
            scale: 1.0,
            scenes: Vec::new(),
            light_counts: PAPER_LIGHTS.to_vec(),
            techniques: all_techniques(),
            sample_counts: vec![4, 8],
            frames: DEFAULT_FRAMES,
            frame: FrameSpec { width: FULL_HD_PX.0, height: FULL_HD_PX.1, ..FrameSpec::default() },
        }
    }
}

impl Specification for Spec {
    const NAME: &'static str = "msaa-table2";
    const SUMMARY: &'static str = "frame times of anti-aliased deferred shading";

    fn from_options(options: &Options) -> Spec {
        let own = Spec::default();
        Spec {
            scale: options.scale.unwrap_or(own.scale),
            scenes: options.scenes.clone().unwrap_or(own.scenes),
            light_counts: options.light_counts.clone().unwrap_or(own.light_counts),
            techniques: options.techniques.clone().unwrap_or(own.techniques),
            sample_counts: sample_counts_up_to(options.samples, &own.sample_counts),
            frames: options.frames.unwrap_or(own.frames),
            frame: options.frame_at(FULL_HD_PX),
        }
    }

    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError> {
        run(self, listener)
    }
}

/// Table 2's numbers of lights.
const PAPER_LIGHTS: [u32; 2] = [5, 50];

/// Table 2.
static PAPER: LazyLock<PaperFigures<Vec<PaperScene>>> =
    LazyLock::new(|| paper_data(include_str!("paper.json")));

/// A scene of the paper.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct PaperScene {
    /// As it counts them: all three numbers are multiples of three, so they are corners of triangles.
    vertices: u32,
    /// Table 2, ms, by [`PAPER_LIGHTS`].
    ms: [PaperMs; 2],
}

/// A line of Table 2, ms.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct PaperMs {
    msaa_4x: f64,
    list_4x: f64,
    list_8x: f64,
}

/// Lists without a filter: as they are by default, with triangles found by a raster pass, and as the paper has them, whose
/// blocks hold no distance.
const LISTS: [(&str, &[(&str, &str)]); 3] = [
    ("", &[]),
    (", raster visibility", &[("visibility", "raster")]),
    (", raster fill", &[("fill", "raster"), ("position", "depth")]),
];

choices! {
    /// How surfaces find their lights: the same of a column and of what it is compared to.
    enum LightsFound {
        /// Every surface visits all, as the paper's do.
        All = "all",
        /// By lists: of the clusters of the view, or of what the technique has in their place.
        Clusters = "clusters",
    }
}

impl LightsFound {
    /// What it adds to the label of a column.
    fn label(self) -> &'static str {
        match self {
            LightsFound::All => "",
            LightsFound::Clusters => ", clusters",
        }
    }
}

/// Techniques that have one way to find lights.
const PLAIN_LIGHTS: [&str; 3] = ["forward", "tiled", "clustered-forward"];

/// What a column is beside its set-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Column {
    paper: PaperColumn,
    lights: LightsFound,
}

/// What a set-up is in the paper's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PaperColumn {
    Msaa4,
    List4,
    List8,
    /// Told without figures, or not at all.
    None,
}

/// What the paper measured on; it does not say which figures are of which.
fn paper_device() -> &'static str {
    &PAPER.source.device
}

impl PaperMs {
    fn of(self, column: PaperColumn) -> Option<f64> {
        match column {
            PaperColumn::Msaa4 => Some(self.msaa_4x),
            PaperColumn::List4 => Some(self.list_4x),
            PaperColumn::List8 => Some(self.list_8x),
            PaperColumn::None => None,
        }
    }
}

/// A scene of ours with what it stands for.
struct Scene {
    source: String,
    paper: Option<&'static PaperScene>,
}

/// A figure of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Cell {
    column: String,
    technique: String,
    samples: u32,
    post: &'static str,
    lights: u32,
    /// How surfaces find them: over those of the baseline that finds them in the same way.
    lights_found: LightsFound,
    /// Vertices of the paper's scene.
    paper_vertices: Option<u32>,
    status: Status,
    reason: Option<String>,
    frame_ms: Option<Spread>,
    /// Over the median, in the same run, of the baseline that finds lights in the same way.
    over_baseline: Option<f64>,
    paper_ms: Option<f64>,
    paper_over_baseline: Option<f64>,
    paper_device: Option<&'static str>,
}

/// A list against multisampling in one scene, with one number of lights.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Duel {
    scene: String,
    lights: u32,
    /// The column of lists.
    list: String,
    /// Its median over the baseline's; below 1 it is faster.
    ratio: Option<f64>,
    paper_ratio: Option<f64>,
}

/// In how many cells lists win.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Score {
    claim: String,
    list: String,
    wins: usize,
    /// Cells with figures.
    cells: usize,
    paper_wins: usize,
    paper_cells: usize,
}

/// What `bench msaa-table2` writes as JSON.
#[derive(Serialize)]
struct Table2 {
    #[serde(flatten)]
    header: Header,
    rows: Vec<Row<Cell>>,
    duels: Vec<Duel>,
    scores: Vec<Score>,
}

fn run(spec: &Spec, listener: &dyn Listener) -> Result<Outcome, LabError> {
    check_run(spec.scale, spec.frames, &spec.frame)?;
    let size = at_size(&spec.frame, spec.scale);
    let (setups, columns): (Vec<Setup>, Vec<Column>) = setups(spec)?.into_iter().unzip();
    let labels: Vec<&str> = setups.iter().map(|setup| setup.label.as_str()).collect();
    let mut notes = notes(spec, &size);
    let (mut rows, mut sections, mut duels, mut failed) = (Vec::new(), Vec::new(), Vec::new(), None);
    for scene in scenes(spec) {
        for &lights in &spec.light_counts {
            let frame = FrameSpec { lights, ..size.clone() };
            let session = Session::open(&scene.source, &frame, false, listener)?;
            let found = measure_setups(&session.renderer, &setups, &session.workload, spec.frames, listener)?;
            session.finish(&frame, listener)?;
            if found.groups > 1 {
                notes.push(format!(
                    "{}, {lights} lights: not all fit into memory at once; frames took turns within {} groups",
                    scene.source, found.groups
                ));
            }
            let results: Vec<RunResult> = found.measured.into_iter().map(|one| one.result).collect();
            let paper = scene.paper.zip(PAPER_LIGHTS.iter().position(|count| *count == lights));
            let cells = cells(&setups, &columns, &results, lights, paper);
            failed = failed.or_else(|| broken_off(labels.iter().copied().zip(&results)));
            duels.extend(duels_of(&scene.source, &cells));
            let table = Table {
                setups: setups.iter().collect(),
                remarks: cells.iter().map(remark).collect(),
                results,
                cells: cells.into_iter().map(|cell| vec![cell]).collect(),
            };
            listener.tell(&table_text(&session, &frame, spec.frames, &table));
            rows.extend(table.rows(&session, &frame, spec.frames, "none"));
            let heading = format!("{}, {lights} lights, ", scene.source);
            let vertices = format!("{} vertices drawn", grouped(session.workload.object_vertices as u64));
            sections.extend(table.parts(&session, &frame, spec.frames, "none", &heading, &vertices));
        }
    }
    let scores = scores(&duels);
    listener.tell(&verdict_text(&duels, &scores, &notes));
    let header = Header::new(Spec::NAME, spec.scale, PAPER.source.clone(), notes);
    let json = serde_json::to_value(&Table2 { header, rows, duels, scores })?;
    Ok(Outcome { title: "Frame times of anti-aliased deferred shading", json, sections, failed })
}

/// Scenes of the paper's numbers of triangles, or what is named.
fn scenes(spec: &Spec) -> Vec<Scene> {
    if !spec.scenes.is_empty() {
        return spec.scenes.iter().map(|source| Scene { source: source.clone(), paper: None }).collect();
    }
    let scene = |paper: &'static PaperScene| Scene {
        source: stand_in(paper.vertices / 3, spec.scale),
        paper: Some(paper),
    };
    PAPER.figures.iter().map(scene).collect()
}

/// The columns, those of the techniques that are asked for. What has the choice stands there once for each way to find lights, so
/// that like is compared to like; post-processing and filters, which change nothing about lights, with all lights alone.
fn setups(spec: &Spec) -> Result<Vec<(Setup, Column)>, LabError> {
    let counts = &spec.sample_counts;
    let Some(&few) = counts.first() else {
        return Err(LabError::setting("samples", "none", "one or more numbers of samples a pixel"));
    };
    let mut all = Vec::new();
    for &found in LightsFound::ALL {
        let lights = [("lights", found.name())];
        let column = Column { paper: PaperColumn::None, lights: found };
        let mut add = |label: &str, samples, technique, params: &[_], paper| -> Result<(), LabError> {
            let params = match PLAIN_LIGHTS.contains(&technique) {
                true => params.to_vec(),
                false => [params, &lights].concat(),
            };
            let label = format!("{label}{}", found.label());
            all.push((Setup::new(label, samples, technique, &params)?, Column { paper, ..column }));
            Ok(())
        };
        add("deferred 1x", 1, "deferred", &[], PaperColumn::None)?;
        match found {
            LightsFound::All => add(&format!("forward {few}x"), few, "forward", &[], PaperColumn::None)?,
            LightsFound::Clusters => {
                add("tiled 1x", 1, "tiled", &[], PaperColumn::None)?;
                add(&format!("clustered-forward {few}x"), few, "clustered-forward", &[], PaperColumn::None)?;
            }
        }
        for technique in ["deferred-ssaa", "deferred-msaa", "deferred-dedup"] {
            let is_papers = technique == "deferred-ssaa" && few == 4 && found == LightsFound::All;
            let paper = if is_papers { PaperColumn::Msaa4 } else { PaperColumn::None };
            add(&format!("{technique} {few}x"), few, technique, &[], paper)?;
        }
        for (variant, params) in LISTS {
            for &samples in counts {
                let paper = match (samples, found) {
                    (4, LightsFound::All) => PaperColumn::List4,
                    (8, LightsFound::All) => PaperColumn::List8,
                    _ => PaperColumn::None,
                };
                let label = format!("gbuffer-list {samples}x{variant}");
                add(&label, samples, "gbuffer-list", params, paper)?;
            }
        }
    }
    let all_lights = [("lights", LightsFound::All.name())];
    let plain = Column { paper: PaperColumn::None, lights: LightsFound::All };
    for post in Post::ALL.iter().copied().filter(|post| *post != Post::None) {
        let label = format!("deferred 1x, {}", post.name());
        all.push((Setup::new(label, 1, "deferred", &all_lights)?.post(post), plain));
    }
    for filter in FILTERS {
        for &samples in counts {
            let label = format!("gbuffer-list {samples}x, {}", filter.name);
            let params = [filter.params, &all_lights].concat();
            all.push((Setup::new(label, samples, "gbuffer-list", &params)?, plain));
        }
    }
    let wanted = choose("techniques", &spec.techniques, &[])?;
    all.retain(|(setup, _)| wanted.iter().any(|one| one.id() == setup.chosen.id()));
    if all.is_empty() {
        let expected = "some of: deferred, tiled, forward, clustered-forward, deferred-ssaa, deferred-msaa, deferred-dedup, gbuffer-list";
        return Err(LabError::setting("techniques", spec.techniques.join(","), expected));
    }
    Ok(all)
}

fn cells(
    setups: &[Setup],
    columns: &[Column],
    results: &[RunResult],
    lights: u32,
    paper: Option<(&PaperScene, usize)>,
) -> Vec<Cell> {
    let median_ms = |result: &RunResult| result.frame_ms.map(|frame| frame.median);
    // Multisampling whose surfaces find their lights in the same way.
    let baseline_ms = |lights: LightsFound| {
        let mut all = setups.iter().zip(columns).zip(results);
        let is_baseline =
            |setup: &Setup, column: &Column| setup.chosen.id() == "deferred-ssaa" && column.lights == lights;
        median_ms(all.find(|((setup, column), _)| is_baseline(setup, column))?.1)
    };
    let cell = |((setup, column), result): ((&Setup, &Column), &RunResult)| {
        let line = paper.map(|(scene, index)| scene.ms[index]);
        let paper_ms = line.and_then(|line| line.of(column.paper));
        Cell {
            column: setup.label.clone(),
            technique: result.technique.clone(),
            samples: setup.samples,
            post: setup.post.name(),
            lights,
            lights_found: column.lights,
            paper_vertices: paper.map(|(scene, _)| scene.vertices),
            status: result.status,
            reason: result.reason.clone().filter(|_| result.status != Status::Ok),
            frame_ms: result.frame_ms,
            over_baseline: median_ms(result)
                .zip(baseline_ms(column.lights))
                .map(|(ms, baseline)| ms / baseline),
            paper_ms,
            paper_over_baseline: paper_ms.zip(line).map(|(ms, line)| ms / line.msaa_4x),
            paper_device: paper_ms.map(|_| paper_device()),
        }
    };
    setups.iter().zip(columns).zip(results).map(cell).collect()
}

/// Lists without a filter against the baseline.
fn duels_of(scene: &str, cells: &[Cell]) -> Vec<Duel> {
    let is_plain = |cell: &&Cell| {
        let rest = cell.column.strip_prefix(&format!("gbuffer-list {}x", cell.samples));
        let variant = rest.map(|rest| rest.strip_suffix(cell.lights_found.label()).unwrap_or(rest));
        variant.is_some_and(|found| LISTS.iter().any(|(variant, _)| *variant == found))
    };
    let duel = |cell: &Cell| Duel {
        scene: scene.to_owned(),
        lights: cell.lights,
        list: cell.column.clone(),
        ratio: cell.over_baseline,
        paper_ratio: cell.paper_over_baseline,
    };
    cells.iter().filter(is_plain).map(duel).collect()
}

fn scores(duels: &[Duel]) -> Vec<Score> {
    let mut lists: Vec<&str> = Vec::new();
    for duel in duels {
        if !lists.contains(&duel.list.as_str()) {
            lists.push(&duel.list);
        }
    }
    let score = |list: &str| {
        let of_list: Vec<&Duel> = duels.iter().filter(|duel| duel.list == list).collect();
        let count = |ratio: fn(&Duel) -> Option<f64>| of_list.iter().filter_map(|duel| ratio(duel)).count();
        let wins = |ratio: fn(&Duel) -> Option<f64>| {
            of_list.iter().filter_map(|duel| ratio(duel)).filter(|ratio| *ratio < 1.0).count()
        };
        Score {
            claim: format!(
                "{list} takes less time than deferred-ssaa at the fewest samples, lights found in the same way"
            ),
            list: list.to_owned(),
            wins: wins(|duel| duel.ratio),
            cells: count(|duel| duel.ratio),
            paper_wins: wins(|duel| duel.paper_ratio),
            paper_cells: count(|duel| duel.paper_ratio),
        }
    };
    lists.into_iter().map(score).collect()
}

fn notes(spec: &Spec, size: &FrameSpec) -> Vec<String> {
    let mut notes = vec![
        "deferred-ssaa stands for the paper's MSAA; ratios to it carry over between devices, times do not".to_owned(),
        "lights are seeded; surfaces visit all of them, as in the paper, or those of their cluster: columns that say so, over deferred-ssaa by clusters (tiled by its tiles)".to_owned(),
    ];
    if spec.scenes.is_empty() {
        notes.push("builtin:colonnade stands in for the paper's scenes; their vertices are taken for corners of triangles (all three numbers are multiples of three), a third of them triangles".to_owned());
    }
    if (size.width, size.height) != FULL_HD_PX || spec.scale < 1.0 {
        notes.push(format!(
            "{}×{} instead of the paper's {}×{}; triangles go by the square of --scale {}",
            size.width, size.height, FULL_HD_PX.0, FULL_HD_PX.1, spec.scale
        ));
    }
    notes
}

fn remark(cell: &Cell) -> Option<String> {
    let over = cell.over_baseline.map(|over| format!("{over:.2} of deferred-ssaa"))?;
    let paper = cell.paper_ms.zip(cell.paper_over_baseline);
    Some(paper.map_or(over.clone(), |(ms, ratio)| {
        format!("{over} (paper: {ratio:.2}, {ms:.2} ms on {})", paper_device())
    }))
}

fn table_text(session: &Session, frame: &FrameSpec, frames: u32, table: &Table<'_, Cell>) -> String {
    let heading = [
        "column",
        "status",
        "frame ms",
        "min – max",
        "/ ssaa",
        "paper ms",
        "paper / MSAA",
        "memory",
        "blocks",
    ];
    let mut printed = text::table(&heading, 2);
    for (cell, result) in table.cells.iter().flatten().zip(&table.results) {
        let dash = || "–".to_owned();
        printed.add_row([
            cell.column.clone(),
            status_text(cell.status).to_owned(),
            cell.frame_ms.map_or_else(dash, |ms| ms_text(ms.median)),
            cell.frame_ms.map_or_else(dash, |ms| format!("{} – {}", ms_text(ms.min), ms_text(ms.max))),
            number_text(cell.over_baseline, 2),
            number_text(cell.paper_ms, 2),
            number_text(cell.paper_over_baseline, 2),
            result.memory.as_ref().map_or_else(dash, |memory| bytes_text(memory.technique_bytes)),
            counter(result, "blocks_needed").map_or_else(dash, grouped),
        ]);
    }
    format!(
        "msaa-table2: {} on {} ({}): {} triangles, {} vertices drawn, {} lights, {}×{}, median of {frames} frame(s) in turn; paper: {}\n\n{printed}\n{}\n",
        session.scene.name,
        session.device.name,
        session.device.kind,
        grouped(session.scene.triangles),
        grouped(session.workload.object_vertices as u64),
        frame.lights,
        frame.width,
        frame.height,
        paper_device(),
        reasons_text(&table.setups, &table.results)
    )
}

fn verdict_text(duels: &[Duel], scores: &[Score], notes: &[String]) -> String {
    let mut heading = vec!["scene", "lights"];
    heading.extend(scores.iter().map(|score| score.list.as_str()));
    let mut table = text::table(&heading, 1);
    for line in duels.chunks(scores.len().max(1)) {
        let mut row = vec![line[0].scene.clone(), line[0].lights.to_string()];
        let ratio =
            |duel: &Duel| format!("{} ({})", number_text(duel.ratio, 2), number_text(duel.paper_ratio, 2));
        row.extend(line.iter().map(ratio));
        table.add_row(row);
    }
    let scores: String = scores
        .iter()
        .map(|score| {
            format!(
                "{}: in {} of {} cells (paper: {} of {})\n",
                score.claim, score.wins, score.cells, score.paper_wins, score.paper_cells
            )
        })
        .collect();
    let notes = notes_text(notes);
    format!(
        "frame time over that of deferred-ssaa (the paper's list over its MSAA 4x):\n{table}\n{scores}{notes}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    fn techniques(ids: &[&str]) -> Spec {
        Spec { techniques: ids.iter().map(|id| (*id).to_owned()).collect(), ..Spec::default() }
    }

    fn split(spec: &Spec) -> (Vec<Setup>, Vec<Column>) {
        setups(spec).expect("known").into_iter().unzip()
    }

    #[test]
    fn the_papers_vertices_are_corners() {
        for scene in &PAPER.figures {
            assert_eq!(scene.vertices % 3, 0, "{}", scene.vertices);
        }
        let source =
            |index: usize, scale: f64| scenes(&Spec { scale, ..Spec::default() })[index].source.clone();
        assert_eq!(source(2, 1.0), "builtin:colonnade?triangles=7940056");
        assert_eq!(source(2, 0.5), "builtin:colonnade?triangles=1985014");
        assert_eq!(source(0, 0.1), "builtin:colonnade?triangles=16384");
    }

    #[test]
    fn the_papers_lists_win_four_and_three_cells() {
        let (setups, columns) = split(&Spec::default());
        let results: Vec<RunResult> = setups
            .iter()
            .map(|setup| RunResult::without_figures(setup.chosen.id(), Status::Unavailable, "none"))
            .collect();
        let mut duels = Vec::new();
        for scene in &PAPER.figures {
            for (index, lights) in PAPER_LIGHTS.into_iter().enumerate() {
                duels
                    .extend(duels_of("s", &cells(&setups, &columns, &results, lights, Some((scene, index)))));
            }
        }
        let scores = scores(&duels);
        let of = |list: &str| scores.iter().find(|score| score.list == list).expect("there");
        assert_eq!((of("gbuffer-list 4x").paper_wins, of("gbuffer-list 4x").paper_cells), (4, 6));
        assert_eq!((of("gbuffer-list 8x").paper_wins, of("gbuffer-list 8x").cells), (3, 0));
        assert_eq!((of("gbuffer-list 4x, clusters").paper_cells, scores.len()), (0, 12), "{scores:?}");
    }

    #[test]
    fn ratios_are_over_the_baseline_of_the_run() {
        let (setups, columns) = split(&techniques(&["deferred-ssaa", "gbuffer-list"]));
        let results: Vec<RunResult> = setups
            .iter()
            .map(|setup| {
                let mut result = RunResult::without_figures(setup.chosen.id(), Status::Ok, "");
                let all =
                    if setup.chosen.id() == "deferred-ssaa" { 8.0 } else { 2.0 * f64::from(setup.samples) };
                // By clusters everything takes a quarter.
                let ms = if setup.label.ends_with("clusters") { 0.25 * all } else { all };
                result.frame_ms = Spread::of(&[ms]);
                result
            })
            .collect();
        let cells = cells(&setups, &columns, &results, 50, Some((&PAPER.figures[0], 1)));
        let of = |column: &str| cells.iter().find(|cell| cell.column == column).expect("there");
        assert_eq!(of("deferred-ssaa 4x").over_baseline, Some(1.0));
        assert_eq!(of("gbuffer-list 4x").over_baseline, Some(1.0));
        assert_eq!(of("gbuffer-list 8x").over_baseline, Some(2.0));
        assert_eq!(of("gbuffer-list 8x, clusters").over_baseline, Some(2.0), "like over like");
        assert_eq!(of("gbuffer-list 8x, clusters").paper_ms, None);
        assert_eq!(of("gbuffer-list 8x").paper_ms, Some(14.0772));
        assert_eq!(of("gbuffer-list 8x, edges").paper_ms, None);
        let scores = scores(&duels_of("s", &cells));
        // As fast is no win.
        assert!(scores.iter().all(|score| score.wins == 0 && score.cells == 1), "{scores:?}");
    }

    /// No column leaves to a default how it finds its lights, and each is compared to one that finds them in the same way.
    #[test]
    fn lights_are_found_in_the_same_way() {
        let (setups, columns) = split(&Spec::default());
        let mut labels = std::collections::BTreeSet::new();
        for (setup, column) in setups.iter().zip(&columns) {
            assert!(labels.insert(setup.label.clone()), "{} stands there twice", setup.label);
            match setup.chosen.params.get("lights") {
                Some(lights) => assert_eq!(lights, column.lights.name(), "{}", setup.label),
                None => assert!(PLAIN_LIGHTS.contains(&setup.chosen.id()), "{}", setup.label),
            }
        }
        for &lights in LightsFound::ALL {
            let of = |id: &str| {
                let mut all = setups.iter().zip(&columns);
                all.any(|(setup, column)| setup.chosen.id() == id && column.lights == lights)
            };
            for id in ["deferred-ssaa", "deferred-msaa", "deferred-dedup", "gbuffer-list", "deferred"] {
                assert!(of(id), "{id} by {lights}");
            }
        }
    }

    #[test]
    fn columns_can_be_chosen() {
        let four = Spec { sample_counts: vec![4], ..Spec::default() };
        assert!(setups(&four).expect("known").iter().all(|(setup, _)| setup.samples <= 4));
        assert!(setups(&techniques(&["visibility"])).is_err());
        assert!(setups(&techniques(&["backward"])).is_err());
        assert!(setups(&Spec { sample_counts: Vec::new(), ..Spec::default() }).is_err());
        assert_eq!(scenes(&Spec { scenes: vec!["a.gltf".to_owned()], ..Spec::default() }).len(), 1);
        let options = Options { light_counts: Some(vec![7]), ..Options::default() };
        assert_eq!(Spec::from_options(&options).light_counts, [7]);
    }
}
