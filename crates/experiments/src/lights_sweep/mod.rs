//! `bench lights-sweep`: frame time, memory and pairs of lights and surfaces of every technique, from 1 to 100,000 point lights, with the
//! cost model's prediction beside the measurement (the argument of Petrescu et al. 2016).
//!
//! The density of lights is held: a surface point is within the range of about eight, however many there are. So whatever finds
//! just those takes as long for many lights as for few, and the growth of a frame's time is that of finding them.

use std::sync::LazyLock;

use afterlight_lab::{
    Chosen, Entrant, FrameSpec, LabError, Listener, Session, Setup, budget_bytes, choose, measure,
    measure_in_turn, measure_setups, most_fragments, renderer_with, technique,
};
use afterlight_measure::{Memory, RunResult, SCHEMA, Spread, Status};
use afterlight_report::text::{self, grouped, number_text, status_text};
use afterlight_report::{Axes, Chart, Line, bytes_text, ms_text};
use afterlight_techniques::cost::{Cost, Workload};
use afterlight_techniques::{
    Exactness, Post, exactness_of,
    stages::lights::step::{Lights, asked},
    view,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::kit::{
    MIB, Options, Outcome, PaperWords, Row, Specification, Table, all_techniques, at_size, broken_off,
    check_run, counter, notes_text, paper_data, reasons_text, stand_in,
};

/// What the paper says.
static PAPER: LazyLock<PaperWords> = LazyLock::new(|| paper_data(include_str!("paper.json")));

/// What the experiment is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Share of the frame's width and height, above 0, at most 1.
    pub scale: f64,
    /// Scenes; where there is none, the built-in one, its triangles times the square of `scale`.
    pub scenes: Vec<String>,
    /// Numbers of seeded lights; where there is none, powers of ten from 1 to 100,000 times `scale`.
    pub light_counts: Vec<u32>,
    /// Techniques by their ids, or `all`.
    pub techniques: Vec<String>,
    /// Frames measured of each technique after a warm-up frame, 1 to 10,000.
    pub frames: u32,
    /// Samples a pixel of every technique; none for one, and for techniques that need several the fewest from four on.
    pub samples: Option<u32>,
    /// Predicted pairs of a light and a surface a frame beyond which a technique is left out; none for a frame of about a second.
    pub max_pairs: Option<u64>,
    /// Predicted draws a frame beyond which a technique is left out; none for a frame of about a second.
    pub max_commands: Option<u64>,
    /// What frames look like; `lights`, `samples`, `post` and `view` do not count.
    pub frame: FrameSpec,
}

impl Default for Spec {
    fn default() -> Spec {
        Spec {
            scale: 1.0,
            scenes: Vec::new(),
            light_counts: Vec::new(),
            techniques: all_techniques(),
            frames: FRAMES,
            samples: None,
            max_pairs: None,
            max_commands: None,
            frame: FrameSpec { width: SIZE_PX.0, height: SIZE_PX.1, ..FrameSpec::default() },
        }
    }
}

impl Specification for Spec {
    const NAME: &'static str = "lights-sweep";
    const SUMMARY: &'static str = "time, memory and light pairs from 1 to 100,000 lights";

    fn from_options(options: &Options) -> Spec {
        let own = Spec::default();
        Spec {
            scale: options.scale.unwrap_or(own.scale),
            scenes: options.scenes.clone().unwrap_or(own.scenes),
            light_counts: options.light_counts.clone().unwrap_or(own.light_counts),
            techniques: options.techniques.clone().unwrap_or(own.techniques),
            frames: options.frames.unwrap_or(own.frames),
            samples: options.samples,
            max_pairs: options.max_pairs,
            max_commands: options.max_commands,
            frame: options.frame_at(SIZE_PX),
        }
    }

    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError> {
        run(self, listener)
    }
}

/// Numbers of lights at full scale.
const COUNTS: [u32; 6] = [1, 10, 100, 1_000, 10_000, 100_000];

/// Growth is told from here on, or from the most lights below.
const GROWTH_FROM: u32 = 1_000;

/// Triangles of the built-in scene.
const TRIANGLES: u32 = 262_144;

/// The image's own size, pixels.
const SIZE_PX: (u32, u32) = (1280, 720);

/// Frames measured of each technique where nothing else is asked for: there are many techniques.
const FRAMES: u32 = 3;

/// Seeded lights that reach a surface point, about.
const LIT_A_PIXEL: f64 = 8.0;

/// Share of the pairs that others light which an exact technique must light; a test has 0.1% at one sample.
const LEAST_LIT: f64 = 0.99;

/// Technique whose times the others' are told against.
const BASELINE: &str = "deferred";

/// Predicted work of a frame beyond which a technique is left out of a number of lights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Bounds {
    /// Evaluations of the illumination model.
    max_pairs: f64,
    /// Draws, as the model counts them.
    max_commands: f64,
}

impl Bounds {
    /// What was asked for, else a frame of about a second: lavapipe on two cores evaluates some 2e7 pairs and 1.5e4 draws in one, an H200
    /// 1.7e10 pairs (`forward`, docs/results).
    fn of(spec: &Spec, device_kind: &str) -> Self {
        let (pairs, commands) = if device_kind == "cpu" { (1e7, 3e4) } else { (3e10, 2e6) };
        Self {
            max_pairs: spec.max_pairs.map_or(pairs, |count| count as f64),
            max_commands: spec.max_commands.map_or(commands, |count| count as f64),
        }
    }

    /// Why work is beyond them.
    fn reason(&self, predicted: &Predicted) -> Option<String> {
        let beyond = |what: &str, found: f64, most: f64, option: &str| {
            (found > most).then(|| format!("not run: found {found:.1e} predicted {what} a frame, expected at most {most:.1e} ({option})"))
        };
        beyond("evaluations", predicted.evaluations, self.max_pairs, "--max-pairs")
            .or_else(|| beyond("draws", predicted.cmd, self.max_commands, "--max-commands"))
    }
}

/// What the cost model says of a technique: unit costs, memory and traffic in floats of four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Predicted {
    cmd: f64,
    proc: f64,
    mem: f64,
    band: f64,
    /// The part of `proc` that is the illumination model's.
    evaluations: f64,
    /// Over the baseline's.
    proc_over_baseline: Option<f64>,
    band_over_baseline: Option<f64>,
}

impl Predicted {
    /// Predicts a set-up's costs. A technique that visits all lights has every pair of a light and a pixel for the model's `lf`.
    fn of(setup: &Setup, workload: &Workload) -> Self {
        let Chosen { technique, params } = &setup.chosen;
        let visits_all = asked(params) == Some(Lights::All);
        let counted = Workload {
            shading_samples: f64::from(setup.samples),
            light_fragments: match visits_all {
                true => workload.lights * workload.pixels,
                false => workload.light_fragments,
            },
            ..*workload
        };
        let Cost { cmd, proc, mem, band } = technique.predict(&counted, params);
        let without = technique.predict(&Workload { evaluation: 0.0, ..counted }, params);
        Self {
            cmd,
            proc,
            mem,
            band,
            evaluations: proc - without.proc,
            proc_over_baseline: None,
            band_over_baseline: None,
        }
    }
}

/// Pairs of a light and a surface over a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Pairs {
    tested: f64,
    lit: f64,
    tested_over_lit: Option<f64>,
    /// Pixels whose counts are rounded, or end at 2,048 where blending sums.
    rounded_pixels: u64,
}

impl Pairs {
    fn of(result: &RunResult) -> Option<Self> {
        let number = |name: &str| result.counters.get(name).and_then(Value::as_f64);
        let (tested, lit) = (number("light_pairs_tested")?, number("light_pairs_lit")?);
        Some(Self {
            tested,
            lit,
            tested_over_lit: (lit > 0.0).then(|| tested / lit),
            rounded_pixels: counter(result, "light_pairs_rounded_pixels").unwrap_or_default(),
        })
    }
}

/// A technique under a number of lights.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Cell {
    column: String,
    technique: String,
    samples: u32,
    lights: u32,
    status: Status,
    reason: Option<String>,
    frame_ms: Option<Spread>,
    /// Over the baseline's median in the same run.
    over_baseline: Option<f64>,
    technique_bytes: Option<u64>,
    pairs: Option<Pairs>,
    predicted: Predicted,
}

/// By what factor something of a technique grows between two numbers of lights.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Growth {
    scene: String,
    column: String,
    from_lights: u32,
    to_lights: u32,
    frame_ms: Option<f64>,
    technique_bytes: Option<f64>,
    tested: Option<f64>,
    lit: Option<f64>,
    predicted_proc: f64,
    predicted_band: f64,
}

/// The model's symbols for a row.
#[derive(Serialize)]
struct Symbols {
    scene: String,
    lights: u32,
    workload: Workload,
}

/// What `bench lights-sweep` writes as JSON.
#[derive(Serialize)]
struct Sweep {
    schema: u32,
    experiment: &'static str,
    scale: f64,
    paper: PaperWords,
    notes: Vec<String>,
    bounds: Option<Bounds>,
    rows: Vec<Row<Cell>>,
    symbols: Vec<Symbols>,
    growth: Vec<Growth>,
}

fn run(spec: &Spec, listener: &dyn Listener) -> Result<Outcome, LabError> {
    check_run(spec.scale, spec.frames, &spec.frame)?;
    let size = at_size(&spec.frame, spec.scale);
    let setups = setups(spec)?;
    let counts = counts(spec);
    let frames = spec.frames;
    let notes = notes(spec, &size, &counts);
    let mut found = Sweep {
        schema: SCHEMA,
        experiment: Spec::NAME,
        scale: spec.scale,
        paper: PAPER.clone(),
        notes,
        bounds: None,
        rows: Vec::new(),
        symbols: Vec::new(),
        growth: Vec::new(),
    };
    let (mut sections, mut failed) = (Vec::new(), None);
    for scene in scenes(spec) {
        let mut columns: Vec<Vec<Cell>> = Vec::new();
        let first_section = sections.len();
        for &lights in &counts {
            let frame = FrameSpec { lights, ..size.clone() };
            let session = Session::open(&scene, &frame, false, listener)?;
            let bounds = Bounds::of(spec, &session.device.kind);
            let Measured { results, cells, workload } =
                measured(&session, &setups, &bounds, frames, listener)?;
            session.finish(&frame, listener)?;
            let labels = setups.iter().map(|setup| setup.label.as_str());
            failed = failed.or_else(|| broken_off(labels.zip(&results)));
            let table = Table {
                setups: setups.iter().collect(),
                remarks: cells.iter().map(remark).collect(),
                results,
                cells: cells.iter().map(|cell| vec![cell.clone()]).collect(),
            };
            listener.tell(&table_text(&session, &frame, frames, &table));
            found.rows.extend(table.rows(&session, &frame, frames, "none"));
            let heading = format!("{scene}, {} lights, ", grouped(session.scene.lights));
            sections.extend(table.parts(&session, &frame, frames, "none", &heading, NOTE));
            found.symbols.push(Symbols { scene: scene.clone(), lights, workload });
            found.bounds = Some(bounds);
            columns.push(cells);
        }
        let growth = growth(&scene, &columns);
        listener.tell(&growth_text(&growth));
        if let Some(first) = sections.get_mut(first_section) {
            first.charts = charts(&columns);
        }
        found.growth.extend(growth);
    }
    listener.tell(&notes_text(&found.notes));
    Ok(Outcome { title: "From 1 to 100,000 lights", json: serde_json::to_value(&found)?, sections, failed })
}

/// What a report says of every section.
const NOTE: &str = "Pairs are of a light and a surface: tested, and lit (within the light's range). Predictions are the cost model's in unit costs.";

/// The built-in scene of as many triangles as the image has fewer pixels, or what is named.
fn scenes(spec: &Spec) -> Vec<String> {
    if spec.scenes.is_empty() { vec![stand_in(TRIANGLES, spec.scale)] } else { spec.scenes.clone() }
}

/// Numbers of lights in ascending order: what is asked for, or powers of ten up to the scaled most.
fn counts(spec: &Spec) -> Vec<u32> {
    let mut counts = match spec.light_counts.is_empty() {
        false => spec.light_counts.clone(),
        true => {
            let most = f64::from(COUNTS[COUNTS.len() - 1]) * spec.scale;
            COUNTS.into_iter().filter(|count| *count == 1 || f64::from(*count) <= most).collect()
        }
    };
    counts.sort_unstable();
    counts.dedup();
    counts
}

/// Every technique with its parameters' defaults or those asked for, at one sample a pixel or as many as asked for; those that need several at the fewest
/// from four on.
fn setups(spec: &Spec) -> Result<Vec<Setup>, LabError> {
    let setup = |chosen: Chosen| {
        let info = chosen.technique.info();
        let samples = match spec.samples {
            Some(samples) => samples,
            None if info.samples.contains(&1) => 1,
            None => info.samples.iter().copied().find(|count| *count >= 4).unwrap_or(1),
        };
        let label = if samples == 1 { info.id.to_owned() } else { format!("{} {samples}x", info.id) };
        Setup { label, samples, post: Post::None, chosen }
    };
    let chosen = choose("techniques", &spec.techniques, &spec.frame.set)?;
    Ok(chosen.into_iter().map(setup).collect())
}

/// A number of lights, measured.
struct Measured {
    /// One a set-up.
    results: Vec<RunResult>,
    cells: Vec<Cell>,
    /// The model's symbols as counted.
    workload: Workload,
}

fn measured(
    session: &Session,
    setups: &[Setup],
    bounds: &Bounds,
    frames: u32,
    listener: &dyn Listener,
) -> Result<Measured, LabError> {
    let lights = session.scene.lights as f64;
    let fragments = object_fragments(session)?;
    let lit_by = |lit: f64| Workload {
        object_fragments: fragments.unwrap_or(session.workload.object_fragments),
        light_fragments: lit,
        light_list_floats: lit / session.workload.pixels_a_tile,
        ..session.workload
    };
    // What is run is decided before pairs are counted: by those that the lights' density gives.
    let expected = lit_by(session.workload.pixels * lights.min(LIT_A_PIXEL));
    let mut results: Vec<Option<RunResult>> = setups
        .iter()
        .map(|setup| {
            let reason = bounds.reason(&Predicted::of(setup, &expected))?;
            Some(RunResult::without_figures(setup.chosen.id(), Status::Unavailable, reason))
        })
        .collect();

    let task = listener.task("light pairs", setups.len() as u64);
    let mut pairs: Vec<Option<Pairs>> = Vec::new();
    for (setup, result) in setups.iter().zip(&mut results) {
        task.advance();
        let counts = result.is_none() && setup.chosen.technique.counts_light_pairs();
        let counted = if counts { Some(count_pairs(session, setup)?) } else { None };
        pairs.push(counted.as_ref().and_then(Pairs::of));
        if let Some(counted) = counted
            && counted.status != Status::Ok
        {
            *result = Some(counted);
        }
    }
    drop(task);
    let workload = lit_pairs(setups, &pairs).map_or(expected, lit_by);

    let running: Vec<&Setup> =
        setups.iter().zip(&results).filter(|(_, result)| result.is_none()).map(|(setup, _)| setup).collect();
    let measured = measure_setups(&session.renderer, &running, &workload, frames, listener)?.measured;
    let mut measured = measured.into_iter().map(|one| one.result);
    let results: Vec<RunResult> =
        results.into_iter().filter_map(|result| result.or_else(|| measured.next())).collect();
    Ok(with_cells(setups, results, &pairs, workload, session.scene.lights as u32))
}

/// Fragments of objects: what a forward pass counts of the view; none where the device does not count.
fn object_fragments(session: &Session) -> Result<Option<f64>, LabError> {
    let (renderer, workload) = session.with_settings(|settings| {
        settings.lights.truncate(1);
        settings.samples = 1;
    })?;
    let chosen = Chosen::new(technique("technique", "forward")?);
    let result = measure(&renderer, &chosen, &workload, 0, || {})?.result;
    Ok(most_fragments(&result).map(|count| count as f64))
}

/// A frame of a set-up that counts pairs in the place of radiance.
fn count_pairs(session: &Session, setup: &Setup) -> Result<RunResult, LabError> {
    let base = &session.renderer;
    let renderer = renderer_with(base, |settings| {
        settings.samples = setup.samples;
        settings.view = view::LIGHT_COUNT.to_owned();
    })?;
    let entrant = Entrant { renderer: &renderer, chosen: &setup.chosen };
    let found = measure_in_turn(&[entrant], &session.workload, 0, budget_bytes(base), || {})?;
    let result = found.measured.into_iter().next().map(|one| one.result);
    Ok(result.unwrap_or_else(|| {
        RunResult::without_figures(setup.chosen.id(), Status::Failed, "no frame was drawn")
    }))
}

/// Whether a set-up gives the image of `forward`.
fn is_exact(setup: &Setup) -> bool {
    let exactness = exactness_of(setup.chosen.technique, &setup.chosen.params, setup.samples);
    matches!(exactness, Exactness::Exact { .. })
}

/// Lit pairs of a frame: those of the first exact technique at the fewest samples.
fn lit_pairs(setups: &[Setup], pairs: &[Option<Pairs>]) -> Option<f64> {
    let counted = setups.iter().zip(pairs).filter(|(setup, _)| is_exact(setup));
    let counted = counted.filter_map(|(setup, pairs)| Some((setup.samples, (*pairs)?.lit)));
    counted.min_by_key(|(samples, _)| *samples).map(|(_, lit)| lit)
}

/// Marks exact techniques as failed that light fewer pairs than others of as many samples: some of their lights are lost, to a bound of the
/// device or of their lists.
fn judge_lit(setups: &[Setup], results: &mut [RunResult], pairs: &[Option<Pairs>]) {
    for (index, setup) in setups.iter().enumerate().filter(|(_, setup)| is_exact(setup)) {
        let Some(found) = pairs[index].filter(|_| results[index].status == Status::Ok) else { continue };
        let alike =
            setups.iter().zip(pairs).filter(|(other, _)| is_exact(other) && other.samples == setup.samples);
        let most = alike.filter_map(|(_, pairs)| Some((*pairs)?.lit)).fold(0.0, f64::max);
        if found.lit < LEAST_LIT * most {
            results[index].status = Status::Failed;
            results[index].reason = Some(format!(
                "lit pairs: found {:.0}, expected {most:.0} as other techniques light",
                found.lit
            ));
        }
    }
}

fn with_cells(
    setups: &[Setup],
    mut results: Vec<RunResult>,
    pairs: &[Option<Pairs>],
    workload: Workload,
    lights: u32,
) -> Measured {
    judge_lit(setups, &mut results, pairs);
    let mut predicted: Vec<Predicted> = setups.iter().map(|setup| Predicted::of(setup, &workload)).collect();
    let baseline = setups.iter().position(|setup| setup.chosen.id() == BASELINE);
    let baseline_ms = baseline.and_then(|index| Some(results[index].frame_ms?.median));
    let baseline_predicted = baseline.map(|index| predicted[index]);
    for one in &mut predicted {
        one.proc_over_baseline = baseline_predicted.map(|base| one.proc / base.proc);
        one.band_over_baseline = baseline_predicted.map(|base| one.band / base.band);
    }
    for ((result, pairs), cost) in results.iter_mut().zip(pairs).zip(&predicted) {
        let Predicted { cmd, proc, mem, band, .. } = *cost;
        result.cost = Some(afterlight_measure::CostRecord { cmd, proc, mem, band });
        if let Some(pairs) = pairs {
            result.counters.insert("light_pairs_tested".to_owned(), pairs.tested.into());
            result.counters.insert("light_pairs_lit".to_owned(), pairs.lit.into());
        }
    }
    let cell = |index: usize| {
        let (setup, result) = (&setups[index], &results[index]);
        let bytes = |memory: &Memory| memory.technique_bytes;
        Cell {
            column: setup.label.clone(),
            technique: result.technique.clone(),
            samples: setup.samples,
            lights,
            status: result.status,
            reason: result.reason.clone(),
            frame_ms: result.frame_ms,
            over_baseline: result.frame_ms.zip(baseline_ms).map(|(ms, baseline)| ms.median / baseline),
            technique_bytes: result.memory.as_ref().map(bytes),
            pairs: pairs[index],
            predicted: predicted[index],
        }
    };
    let cells = (0..setups.len()).map(cell).collect();
    Measured { results, cells, workload }
}

/// Growth of every column from the most lights up to [`GROWTH_FROM`], the least where there are none, to the most of all.
fn growth(scene: &str, columns: &[Vec<Cell>]) -> Vec<Growth> {
    let from = columns.iter().rfind(|cells| cells.first().is_some_and(|cell| cell.lights <= GROWTH_FROM));
    let (Some(from), Some(to)) = (from.or(columns.first()), columns.last()) else { return Vec::new() };
    let ratio = |from: Option<f64>, to: Option<f64>| {
        from.zip(to).filter(|(from, _)| *from > 0.0).map(|(from, to)| to / from)
    };
    let of = |(from, to): (&Cell, &Cell)| {
        let both = |value: fn(&Cell) -> Option<f64>| ratio(value(from), value(to));
        Growth {
            scene: scene.to_owned(),
            column: from.column.clone(),
            from_lights: from.lights,
            to_lights: to.lights,
            frame_ms: both(|cell| Some(cell.frame_ms?.median)),
            technique_bytes: both(|cell| Some(cell.technique_bytes? as f64)),
            tested: both(|cell| Some(cell.pairs?.tested)),
            lit: both(|cell| Some(cell.pairs?.lit)),
            predicted_proc: to.predicted.proc / from.predicted.proc,
            predicted_band: to.predicted.band / from.predicted.band,
        }
    };
    from.iter().zip(to).map(of).collect()
}

/// Time, tested pairs and memory over the number of lights, a line a column.
fn charts(columns: &[Vec<Cell>]) -> Vec<Chart> {
    let at: Vec<f64> =
        columns.iter().filter_map(|cells| cells.first()).map(|cell| f64::from(cell.lights)).collect();
    let labels: Vec<&str> = columns
        .first()
        .map_or_else(Vec::new, |cells| cells.iter().map(|cell| cell.column.as_str()).collect());
    let chart = |title: &str, value: fn(&Cell) -> Option<f64>| {
        let line = |(index, label): (usize, &&str)| Line {
            label: (*label).to_owned(),
            values: columns.iter().map(|cells| value(cells.get(index)?)).collect(),
        };
        Chart {
            title: title.to_owned(),
            places: "lights".to_owned(),
            lines: labels.iter().enumerate().map(line).collect(),
            axes: Axes::Logarithmic { at: at.clone() },
        }
    };
    vec![
        chart("frame time, ms", |cell| Some(cell.frame_ms?.median)),
        chart("pairs tested", |cell| Some(cell.pairs?.tested)),
        chart("processing as predicted, unit costs", |cell| cell.frame_ms.map(|_| cell.predicted.proc)),
        chart("technique memory, MiB", |cell| Some(cell.technique_bytes? as f64 / MIB)),
    ]
}

fn notes(spec: &Spec, size: &FrameSpec, counts: &[u32]) -> Vec<String> {
    let mut notes = vec![
        "lights are seeded, about 8 at a surface point however many there are; pairs are of a light and a surface that is shaded: tested, and lit where the light's range holds the surface".to_owned(),
        "predictions are the model's in unit costs, calibrated to nothing: lf is the lit pairs as counted, of the fragments that forward shades; a technique that visits all lights has every pair of a light and a pixel for lf".to_owned(),
        "what is left out for its predicted work says so; --max-pairs and --max-commands set the bounds".to_owned(),
    ];
    if (size.width, size.height) != SIZE_PX || spec.scale < 1.0 {
        notes.push(format!(
            "{}×{} pixels instead of {}×{}; up to {} lights; triangles go by the square of --scale {}",
            size.width,
            size.height,
            SIZE_PX.0,
            SIZE_PX.1,
            grouped(counts.last().copied().unwrap_or_default().into()),
            spec.scale
        ));
    }
    notes
}

fn remark(cell: &Cell) -> Option<String> {
    let pairs = cell.pairs.map(|pairs| {
        let times = number_text(pairs.tested_over_lit, 2);
        format!("{} pairs tested, {times} of those lit", grouped(pairs.tested as u64))
    });
    let over = cell.over_baseline.map(|over| {
        format!(
            "{over:.2} of {BASELINE} (predicted processing: {})",
            number_text(cell.predicted.proc_over_baseline, 2)
        )
    });
    let parts: Vec<String> = over.into_iter().chain(pairs).collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

fn table_text(session: &Session, frame: &FrameSpec, frames: u32, table: &Table<'_, Cell>) -> String {
    let heading = [
        "column",
        "status",
        "frame ms",
        "min – max",
        "/ deferred",
        "predicted",
        "memory",
        "tested",
        "lit",
        "tested / lit",
    ];
    let mut printed = text::table(&heading, 2);
    for cell in table.cells.iter().flatten() {
        let dash = || "–".to_owned();
        printed.add_row([
            cell.column.clone(),
            status_text(cell.status).to_owned(),
            cell.frame_ms.map_or_else(dash, |ms| ms_text(ms.median)),
            cell.frame_ms.map_or_else(dash, |ms| format!("{} – {}", ms_text(ms.min), ms_text(ms.max))),
            number_text(cell.over_baseline, 2),
            number_text(cell.predicted.proc_over_baseline, 2),
            cell.technique_bytes.map_or_else(dash, bytes_text),
            cell.pairs.map_or_else(dash, |pairs| grouped(pairs.tested as u64)),
            cell.pairs.map_or_else(dash, |pairs| grouped(pairs.lit as u64)),
            number_text(cell.pairs.and_then(|pairs| pairs.tested_over_lit), 2),
        ]);
    }
    let rounded = table.cells.iter().flatten().filter_map(|cell| cell.pairs).map(|p| p.rounded_pixels).max();
    let rounded = rounded.filter(|pixels| *pixels > 0).map_or_else(String::new, |pixels| {
        format!("counts of up to {pixels} pixels are rounded, by 0.1% of them at most where a shader sums; where blending sums they end at 2,048\n")
    });
    format!(
        "lights-sweep: {} on {} ({}): {} triangles, {} lights, {}×{}, median of {frames} frame(s) in turn; predicted: K_proc over {BASELINE}'s\n\n{printed}\n{rounded}{}\n",
        session.scene.name,
        session.device.name,
        session.device.kind,
        grouped(session.scene.triangles),
        grouped(session.scene.lights),
        frame.width,
        frame.height,
        reasons_text(&table.setups, &table.results)
    )
}

fn growth_text(growth: &[Growth]) -> String {
    let Some(first) = growth.first() else { return String::new() };
    let mut table = text::table(&["column", "frame ms", "K_proc", "K_band", "tested", "lit", "memory"], 1);
    for one in growth {
        table.add_row([
            one.column.clone(),
            number_text(one.frame_ms, 2),
            format!("{:.2}", one.predicted_proc),
            format!("{:.2}", one.predicted_band),
            number_text(one.tested, 2),
            number_text(one.lit, 2),
            number_text(one.technique_bytes, 2),
        ]);
    }
    format!(
        "{}: growth from {} to {} lights, measured and predicted\n\n{table}\n",
        first.scene,
        grouped(first.from_lights.into()),
        grouped(first.to_lights.into())
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    fn setup(technique: &str, params: &[(&str, &str)]) -> Setup {
        Setup::new(technique, 1, technique, params).unwrap_or_else(|_| panic!("{technique} is known"))
    }

    /// 100 pixels, drawn twice, 1,000 lights of which eight light a pixel.
    fn workload() -> Workload {
        Workload {
            objects: 10.0,
            lights: 1000.0,
            pixels: 100.0,
            object_fragments: 200.0,
            light_fragments: 800.0,
            ..Workload::default()
        }
    }

    #[test]
    fn scale_sets_the_most_lights() {
        let of = |scale: f64| counts(&Spec { scale, ..Spec::default() });
        assert_eq!(of(1.0), COUNTS);
        assert_eq!(of(0.25), COUNTS[..5]);
        assert_eq!(of(0.00001), [1]);
        let named = Spec { scale: 0.1, light_counts: vec![50, 5, 50], ..Spec::default() };
        assert_eq!(counts(&named), [5, 50]);
    }

    #[test]
    fn columns_are_all_techniques() {
        let labels = |spec: &Spec| {
            let setups = setups(spec).expect("known");
            setups.into_iter().map(|setup| setup.label).collect::<Vec<_>>()
        };
        let all = labels(&Spec::default());
        assert_eq!(all.len(), afterlight_techniques::registry().len());
        let techniques = ["deferred-dedup", "gbuffer-list"].map(str::to_owned).to_vec();
        let two = Spec { techniques, ..Spec::default() };
        assert_eq!(labels(&two), ["deferred-dedup 4x", "gbuffer-list"]);
        let more = Spec { samples: Some(2), ..two };
        assert_eq!(labels(&more), ["deferred-dedup 2x", "gbuffer-list 2x"]);
    }

    #[test]
    fn evaluations_are_the_formulas_without_vertices() {
        let evaluations = |technique: &str, params: &[(&str, &str)]| {
            Predicted::of(&setup(technique, params), &workload()).evaluations
        };
        assert_eq!(evaluations("forward", &[]), 200.0 * 1000.0);
        assert_eq!(evaluations("tiled", &[]), 800.0);
        assert_eq!(evaluations("gbuffer-list", &[("lights", "all")]), 100.0 * 1000.0);
        assert_eq!(evaluations("gbuffer-list", &[("lights", "tiles")]), 800.0);
    }

    #[test]
    fn what_is_left_out_says_why() {
        let given = Bounds::of(&Spec { max_pairs: Some(1000), ..Spec::default() }, "cpu");
        assert_eq!((given.max_pairs, given.max_commands), (1e3, 3e4));
        assert!(
            Bounds::of(&Spec::default(), "discrete").max_pairs
                > Bounds::of(&Spec::default(), "cpu").max_pairs
        );
        let reason = |bounds: Bounds, technique: &str| {
            bounds.reason(&Predicted::of(&setup(technique, &[]), &workload()))
        };
        let line = reason(given, "forward").expect("too many pairs");
        assert!(line.contains("found 2.0e5") && line.contains("1.0e3 (--max-pairs)"), "{line}");
        assert_eq!(reason(given, "tiled"), None);
        let commands = Bounds::of(&Spec { max_commands: Some(100), ..Spec::default() }, "cpu");
        let line = reason(commands, "forward-multipass").expect("too many draws");
        assert!(line.contains("found 1.0e4") && line.contains("--max-commands"), "{line}");
    }

    #[test]
    fn a_technique_that_loses_lights_fails() {
        let setups = [setup("tiled", &[]), setup("forward", &[])];
        let judged = |lit: f64| {
            let pairs = [100.0, lit]
                .map(|lit| Some(Pairs { tested: 200.0, lit, tested_over_lit: None, rounded_pixels: 0 }));
            let result = |setup: &Setup| {
                let mut result = RunResult::without_figures(setup.chosen.id(), Status::Ok, "");
                result.reason = None;
                result
            };
            let mut results: Vec<RunResult> = setups.iter().map(result).collect();
            judge_lit(&setups, &mut results, &pairs);
            results
        };
        assert!(judged(99.5).iter().all(|result| result.status == Status::Ok));
        let results = judged(65.0);
        assert_eq!((results[0].status, results[1].status), (Status::Ok, Status::Failed));
        let reason = results[1].reason.as_deref().unwrap_or_default();
        assert!(reason.contains("found 65") && reason.contains("expected 100"), "{reason}");
    }

    #[test]
    fn growth_is_from_a_thousand_lights_to_the_most() {
        let cells = |lights: u32, ms: Option<f64>| {
            let mut result = RunResult::without_figures("tiled", Status::Ok, "");
            result.frame_ms = ms.and_then(|ms| Spread::of(&[ms]));
            let pairs =
                Pairs { tested: ms.unwrap_or(0.0), lit: 8.0, tested_over_lit: None, rounded_pixels: 0 };
            let workload = Workload { light_fragments: f64::from(lights), ..workload() };
            with_cells(&[setup("tiled", &[])], vec![result], &[Some(pairs)], workload, lights).cells
        };
        let columns = [cells(10, Some(1.0)), cells(1000, Some(2.0)), cells(100_000, Some(6.0))];
        let found = growth("s", &columns);
        assert_eq!((found[0].from_lights, found[0].to_lights), (1000, 100_000));
        assert_eq!((found[0].frame_ms, found[0].tested, found[0].lit), (Some(3.0), Some(3.0), Some(1.0)));
        assert_eq!(found[0].predicted_proc, 100.0);
        let missing = growth("s", &[cells(1000, Some(2.0)), cells(10_000, None)]);
        assert_eq!((missing[0].frame_ms, missing[0].tested), (None, Some(0.0)));
        assert!(growth("s", &[]).is_empty());
        // Nothing below a thousand: from the least.
        assert_eq!(growth("s", &columns[2..])[0].from_lights, 100_000);
        assert_eq!(charts(&columns)[0].lines[0].values, [Some(1.0), Some(2.0), Some(6.0)]);
    }
}
