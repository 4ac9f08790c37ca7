//! `afterlight bench`: the experiments, a file each.

mod antialiasing;
mod dais;
mod dais_fig6;
mod lights_sweep;
mod msaa_table1;
mod msaa_table2;
mod speed;

use std::borrow::Borrow;
use std::path::Path;

use afterlight_measure::{Run, RunResult, SCHEMA, Status};
use afterlight_report::{Chart, Picture, Section};
use afterlight_techniques::cost::Workload;
use afterlight_techniques::{Params, Post, Renderer, Settings, view};
use serde::Serialize;
use serde_json::{Value, json};

use crate::args::{BenchArgs, CommonArgs};
use crate::commands::compare;
use crate::failure::Failure;
use crate::frames::{self, Entrant, InTurn};
use crate::output;
use crate::progress::Progress;
use crate::session::{self, Chosen, Session};

/// An experiment.
struct Experiment {
    /// Its name on the command line.
    name: &'static str,
    /// What it measures, one line.
    summary: &'static str,
    /// Runs it and tells people what it found.
    run: fn(&BenchArgs, &Progress) -> Result<Outcome, Failure>,
}

/// All experiments, in the order of `bench all`.
const EXPERIMENTS: &[Experiment] = &[
    speed::EXPERIMENT,
    lights_sweep::EXPERIMENT,
    msaa_table1::EXPERIMENT,
    msaa_table2::EXPERIMENT,
    antialiasing::EXPERIMENT,
    dais::table1::EXPERIMENT,
    dais::fig5::EXPERIMENT,
    dais_fig6::EXPERIMENT,
    dais::fig7::EXPERIMENT,
];

/// What an experiment found.
struct Outcome {
    /// Title of its report.
    title: &'static str,
    /// What `--json` writes of it.
    json: Value,
    /// The report, in order.
    sections: Vec<Part>,
    /// Why the exit code is not 0.
    failed: Option<String>,
}

/// A section of an experiment's report.
struct Part {
    heading: String,
    note: String,
    run: Run,
    charts: Vec<Chart>,
    pictures: Vec<Picture>,
}

/// Returns the help text of the experiment argument.
pub fn help() -> String {
    let mut text = "Experiment:".to_owned();
    for one in EXPERIMENTS {
        text += &format!(" {} ({});", one.name, one.summary);
    }
    text + " or all"
}

pub fn run(args: &BenchArgs) -> Result<(), Failure> {
    let wanted: Vec<&Experiment> =
        EXPERIMENTS.iter().filter(|one| args.experiment == "all" || args.experiment == one.name).collect();
    if wanted.is_empty() {
        let names: Vec<&str> = EXPERIMENTS.iter().map(|one| one.name).collect();
        let expected = format!("one of: {}, all", names.join(", "));
        return Err(Failure::option("EXPERIMENT", format!("{:?}", args.experiment), expected));
    }
    args.common.check()?;
    args.json.check()?;
    if let Some(folder) = &args.report {
        output::make_folder(folder)?;
    }
    let progress = Progress::new(args.common.quiet);
    let mut outcomes = Vec::new();
    for one in &wanted {
        let outcome = (one.run)(args, &progress)?;
        if let Some(folder) = &args.report {
            let folder = if wanted.len() > 1 { folder.join(one.name) } else { folder.clone() };
            write_report(args, &folder, &outcome)?;
        }
        outcomes.push(outcome);
    }
    let failed: Vec<String> = outcomes.iter_mut().filter_map(|outcome| outcome.failed.take()).collect();
    let mut all: Vec<Value> = outcomes.into_iter().map(|outcome| outcome.json).collect();
    let value = match all.len() {
        1 => all.remove(0),
        _ => json!({"schema": SCHEMA, "experiment": "all", "experiments": all}),
    };
    output::json(&args.json, &value)?;
    if failed.is_empty() { Ok(()) } else { Err(Failure::Failed(failed.join("; "))) }
}

fn write_report(args: &BenchArgs, folder: &Path, outcome: &Outcome) -> Result<(), Failure> {
    output::make_folder(folder)?;
    let sections = outcome
        .sections
        .iter()
        .map(|part| Section {
            heading: part.heading.clone(),
            note: part.note.clone(),
            run: &part.run,
            charts: part.charts.clone(),
            pictures: part.pictures.clone(),
        })
        .collect();
    let path = compare::write_report(folder, outcome.title, sections, &output::json_text(&outcome.json)?)?;
    output::tell(&args.json, &format!("report: {}\n", path.display()));
    Ok(())
}

/// Where a paper's figures stand, and what they were measured on.
#[derive(Serialize)]
struct PaperRecord {
    /// Key in REFERENCES.toml.
    key: &'static str,
    section: &'static str,
    device: &'static str,
    width: u32,
    height: u32,
}

/// What the JSON of an experiment beside a paper begins with.
#[derive(Serialize)]
struct Header {
    schema: u32,
    experiment: &'static str,
    scale: f64,
    paper: PaperRecord,
    /// What differs from the paper, and what stood in.
    notes: Vec<String>,
}

impl Header {
    fn new(experiment: &'static str, args: &BenchArgs, paper: PaperRecord, notes: Vec<String>) -> Header {
        Header { schema: SCHEMA, experiment, scale: args.scale, paper, notes }
    }
}

/// 2^20 bytes: the unit of the papers' "MB", as their figures of known layouts show.
const MIB: f64 = (1u64 << 20) as f64;

/// Least triangles of a stand-in.
const STAND_IN_TRIANGLES_MIN: u32 = 16_384;

/// The colonnade that stands in for a scene of so many triangles, as many fewer as the image has fewer pixels.
fn stand_in(triangles: u32, scale: f64) -> String {
    let triangles = ((f64::from(triangles) * scale * scale).round() as u32).max(STAND_IN_TRIANGLES_MIN);
    format!("builtin:colonnade?triangles={triangles}")
}

/// Anything as JSON.
fn to_json(value: &impl Serialize) -> Result<Value, Failure> {
    serde_json::to_value(value).map_err(|error| Failure::Failed(format!("JSON: {error}")))
}

/// Width and height of the papers' experiments on anti-aliasing, pixels.
const FULL_HD_PX: (u32, u32) = (1920, 1080);

/// The common options at the size of an experiment: its own unless one was given, scaled; one sample, the final image without a filter.
fn at_size(args: &BenchArgs, own_px: (u32, u32)) -> CommonArgs {
    let common = &args.common;
    let (width, height) = if args.given.size { (common.width, common.height) } else { own_px };
    let scaled = |px: u32| ((f64::from(px) * args.scale).round() as u32).max(1);
    CommonArgs {
        width: scaled(width),
        height: scaled(height),
        samples: 1,
        post: crate::args::Post::None,
        view: view::FINAL.to_owned(),
        ..common.clone()
    }
}

/// Numbers of samples of an experiment: those up to `--samples` where it is given, or it alone where it is below them all.
fn sample_counts(args: &BenchArgs, own: &[u32]) -> Vec<u32> {
    if !args.given.samples {
        return own.to_vec();
    }
    let most = args.common.samples;
    let up_to: Vec<u32> = own.iter().copied().filter(|count| *count <= most).collect();
    if up_to.is_empty() { vec![most] } else { up_to }
}

/// A technique as an experiment runs it.
struct Setup {
    /// What tells it from the others.
    label: String,
    /// Samples a pixel.
    samples: u32,
    /// Anti-aliasing after shading.
    post: Post,
    /// The technique and its parameters.
    chosen: Chosen,
}

impl Setup {
    fn new(
        label: impl Into<String>,
        samples: u32,
        technique: &str,
        params: &[(&str, &str)],
    ) -> Result<Setup, Failure> {
        let technique = session::technique("technique", technique)?;
        let mut chosen = Chosen { technique, params: Params::default() };
        for (key, value) in params {
            chosen.params.set(technique.info(), key, value)?;
        }
        Ok(Setup { label: label.into(), samples, post: Post::None, chosen })
    }

    /// The same with a filter after it.
    fn post(self, post: Post) -> Setup {
        Setup { post, ..self }
    }
}

/// A renderer of the same scene and view with other settings.
fn renderer_with(base: &Renderer, change: impl FnOnce(&mut Settings)) -> Result<Renderer, Failure> {
    let mut settings = base.settings().clone();
    change(&mut settings);
    Ok(Renderer::with_scene(base.device(), base.scene().clone(), &settings)?)
}

/// Measures set-ups of one scene and view with frames in turn.
fn measure(
    base: &Renderer,
    setups: &[impl Borrow<Setup>],
    workload: &Workload,
    frames: u32,
    progress: &Progress,
) -> Result<InTurn, Failure> {
    let renderers = setups
        .iter()
        .map(|setup| {
            let setup = setup.borrow();
            renderer_with(base, |settings| {
                settings.samples = setup.samples;
                settings.post = setup.post;
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    let entrants: Vec<Entrant<'_>> = setups
        .iter()
        .zip(&renderers)
        .map(|(setup, renderer)| Entrant { renderer, chosen: &setup.borrow().chosen })
        .collect();
    let bar = progress.bar("frames", u64::from(frames + 1) * setups.len() as u64);
    let found = frames::measure_in_turn(&entrants, workload, frames, budget_bytes(base), || bar.inc(1))?;
    bar.finish_and_clear();
    Ok(found)
}

/// Bytes that set-ups may hold at once: half of the device's memory, a quarter where the host shares it.
fn budget_bytes(renderer: &Renderer) -> u64 {
    let features = renderer.device().features();
    features.device_local_heap_bytes / if features.unified_memory { 4 } else { 2 }
}

/// A run as JSON, with the experiment's cells of it.
#[derive(Serialize)]
struct Row<Cell> {
    #[serde(flatten)]
    run: Run,
    /// The experiment's table: figures beside the paper's.
    cells: Vec<Cell>,
}

/// Measured set-ups with an experiment's cells of each.
struct Table<'a, Cell> {
    setups: Vec<&'a Setup>,
    results: Vec<RunResult>,
    cells: Vec<Vec<Cell>>,
    /// What a report tells of each.
    remarks: Vec<Option<String>>,
}

impl<Cell: Clone> Table<'_, Cell> {
    /// Runs: one for each number of samples and filter, in the order of the first set-up of each.
    fn rows(&self, session: &Session, common: &CommonArgs, frames: u32, reference: &str) -> Vec<Row<Cell>> {
        let groups = groups(&self.setups, |setup| (setup.samples, setup.post));
        let row = |((samples, post), members): ((u32, Post), Vec<usize>)| {
            let results = members.iter().map(|&index| self.results[index].clone()).collect();
            Row {
                run: run_of(session, common, (samples, post), frames, reference, results),
                cells: members.iter().flat_map(|&index| self.cells[index].clone()).collect(),
            }
        };
        groups.into_iter().map(row).collect()
    }

    /// The same for a report, under labels, one section for each number of samples.
    fn parts(
        &self,
        session: &Session,
        common: &CommonArgs,
        frames: u32,
        reference: &str,
        heading: &str,
        note: &str,
    ) -> Vec<Part> {
        let part = |(samples, members): (u32, Vec<usize>)| {
            let labelled = |&index: &usize| {
                labelled(&self.results[index], &self.setups[index].label, self.remarks[index].clone())
            };
            let results = members.iter().map(labelled).collect();
            Part {
                heading: format!("{heading}{samples} sample{} a pixel", if samples == 1 { "" } else { "s" }),
                note: note.to_owned(),
                run: run_of(session, common, (samples, Post::None), frames, reference, results),
                charts: Vec::new(),
                pictures: Vec::new(),
            }
        };
        groups(&self.setups, |setup| setup.samples).into_iter().map(part).collect()
    }
}

/// Groups set-ups by what they share, groups and members in the order in which they come.
fn groups<Key: PartialEq>(setups: &[&Setup], key: impl Fn(&Setup) -> Key) -> Vec<(Key, Vec<usize>)> {
    let mut groups: Vec<(Key, Vec<usize>)> = Vec::new();
    for (index, setup) in setups.iter().enumerate() {
        let key = key(setup);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, members)) => members.push(index),
            None => groups.push((key, vec![index])),
        }
    }
    groups
}

/// A run of results with one number of samples and one filter.
fn run_of(
    session: &Session,
    common: &CommonArgs,
    (samples, post): (u32, Post),
    frames: u32,
    reference: &str,
    results: Vec<RunResult>,
) -> Run {
    let common = CommonArgs { samples, ..common.clone() };
    let mut settings = session.settings_record(&common, frames, reference);
    settings.post = post.name().to_owned();
    Run {
        schema: SCHEMA,
        device: session.device.clone(),
        scene: session.scene.clone(),
        settings,
        results,
        process: None,
    }
}

/// A filter of `gbuffer-list` as the experiments set it: its name and its parameters.
struct Filter {
    name: &'static str,
    params: &'static [(&'static str, &'static str)],
}

/// Every filter, each alone. Foliage is flagged by its material's name, as the paper flags trees; regions and thresholds are
/// the parameters' defaults, written out.
const FILTERS: &[Filter] = &[
    Filter { name: "ellipse", params: &[("filter", "ellipse")] },
    Filter { name: "rectangle", params: &[("filter", "rectangle")] },
    Filter { name: "depth", params: &[("filter", "depth"), ("depth-threshold", "20")] },
    Filter { name: "objects", params: &[("filter", "objects"), ("objects", "leaves")] },
    Filter { name: "depth-edges", params: &[("filter", "depth-edges"), ("edge-threshold", "0.02")] },
    Filter { name: "edges", params: &[("filter", "edges"), ("edge-threshold", "0.02")] },
];

/// What the paper of the per-pixel lists measured on; its Table 2 does not say which figures are of which.
const LISTS_PAPER_DEVICE: &str = "GTX 970 or GTX 1050 (the paper does not say which)";

/// A counter of a result.
fn counter(result: &RunResult, name: &str) -> Option<u64> {
    result.counters.get(name).and_then(Value::as_u64)
}

/// A number of a table, or a dash.
fn number_text(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
}

/// Lines that say why a set-up has no figures, each reason once.
fn reasons_text(setups: &[&Setup], results: &[RunResult]) -> String {
    let mut told: Vec<(&str, Vec<&str>)> = Vec::new();
    for (setup, result) in setups.iter().zip(results) {
        let Some(reason) = result.reason.as_deref().filter(|_| result.status != Status::Ok) else { continue };
        match told.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, labels)) => labels.push(&setup.label),
            None => told.push((reason, vec![&setup.label])),
        }
    }
    told.iter().map(|(reason, labels)| format!("{}: {reason}\n", labels.join("; "))).collect()
}

/// A result under its label, for a report: techniques stand there several times with other parameters.
fn labelled(result: &RunResult, label: &str, remark: Option<String>) -> RunResult {
    let reason = match (&result.reason, remark) {
        (Some(reason), Some(remark)) => Some(format!("{remark}; {reason}")),
        (reason, remark) => remark.or_else(|| reason.clone()),
    };
    RunResult { technique: label.to_owned(), reason, ..result.clone() }
}

/// Why an experiment failed whose techniques may not break off; dropped samples are for the experiment to judge.
fn broken_off<'a>(results: impl IntoIterator<Item = (&'a str, &'a RunResult)>) -> Option<String> {
    results.into_iter().find(|(_, result)| result.status == Status::Failed).map(|(label, result)| {
        format!("{label} failed: {}", result.reason.as_deref().unwrap_or("no reason given"))
    })
}

/// What of a result is told where there are no figures: its status.
fn status_text(status: Status) -> &'static str {
    match status {
        Status::Ok => "ok",
        Status::Unavailable => "unavailable",
        Status::Failed => "failed",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command};
    use clap::Parser as _;

    fn bench(arguments: &[&str]) -> BenchArgs {
        let all = ["afterlight", "bench", "all"].iter().chain(arguments);
        match Cli::try_parse_from(all).expect("parses").command {
            Command::Bench(args) => args,
            other => panic!("expected bench, found {other:?}"),
        }
    }

    #[test]
    fn names_differ_and_are_told() {
        for (index, one) in EXPERIMENTS.iter().enumerate() {
            assert!(EXPERIMENTS[..index].iter().all(|other| other.name != one.name), "{}", one.name);
            assert!(help().contains(one.name), "{}", help());
        }
    }

    #[test]
    fn sizes_are_the_experiments_own_unless_given() {
        let size = |arguments: &[&str]| {
            let common = at_size(&bench(arguments), FULL_HD_PX);
            (common.width, common.height)
        };
        assert_eq!(size(&[]), (1920, 1080));
        assert_eq!(size(&["--scale", "0.1"]), (192, 108));
        assert_eq!(size(&["--width", "1280", "--height", "720"]), (1280, 720));
        assert_eq!(size(&["--width", "100", "--height", "50", "--scale", "0.5"]), (50, 25));
        assert_eq!(size(&["--scale", "0.0001"]), (1, 1));
    }

    #[test]
    fn samples_limit_columns() {
        let counts = |arguments: &[&str]| sample_counts(&bench(arguments), &[4, 8]);
        assert_eq!(counts(&[]), [4, 8]);
        assert_eq!(counts(&["--samples", "4"]), [4]);
        assert_eq!(counts(&["--samples", "16"]), [4, 8]);
        assert_eq!(counts(&["--samples", "2"]), [2]);
    }

    #[test]
    fn scale_is_a_share() {
        for scale in ["0", "-1", "1.5", "nan", "much"] {
            let all = ["afterlight", "bench", "all", "--scale", scale];
            assert!(Cli::try_parse_from(all).is_err(), "{scale}");
        }
    }
}
