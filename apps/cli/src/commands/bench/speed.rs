//! `bench speed`: start-up time and memory of a process, frame times of techniques for several numbers of lights.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use afterlight_measure::{Run, SCHEMA, Spread};
use afterlight_report::{bytes_text, ms_text};
use afterlight_techniques::Params;
use serde::Serialize;

use super::{Experiment, Outcome, Part, at_size, to_json};
use crate::args::{BenchArgs, CommonArgs};
use crate::commands::compare::{self, Compared};
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::session::{self, Chosen, Session, ms_since};
use crate::text;

/// The experiment.
pub(super) const EXPERIMENT: Experiment =
    Experiment { name: "speed", summary: "start-up, memory and frame times", run };

/// Times that a process is started for a start-up figure.
const START_UPS: usize = 3;

/// What `bench` writes as JSON.
#[derive(Serialize)]
struct Bench {
    schema: u32,
    experiment: &'static str,
    start_up: Vec<StartUp>,
    rows: Vec<Run>,
}

/// A process from its command to its first image.
#[derive(Serialize)]
struct StartUp {
    scene: String,
    technique: String,
    width: u32,
    height: u32,
    lights: u32,
    /// From starting the process to its end, ms.
    wall_ms: Option<Spread>,
    /// From the program's start to the image in its file, ms, as the process tells.
    first_image_ms: Option<Spread>,
    /// Reading the scene while the device opens, ms.
    load_ms: Option<Spread>,
    /// Decoding textures and copying the scene to the device, ms.
    upload_ms: Option<Spread>,
    /// The most memory of the runs, bytes.
    peak_resident_bytes: Option<u64>,
}

fn run(args: &BenchArgs, progress: &Progress) -> Result<Outcome, Failure> {
    let samples = args.common.samples;
    let common = &CommonArgs {
        samples,
        view: args.common.view.clone(),
        ..at_size(args, (args.common.width, args.common.height))
    };
    let chosen = session::choose("--techniques", &args.techniques, &common.set)?;
    let mut bench = Bench { schema: SCHEMA, experiment: "speed", start_up: Vec::new(), rows: Vec::new() };
    let mut pictures = Vec::new();
    for scene in &args.scenes {
        let lights = args.light_counts.first().copied().unwrap_or(0);
        let first = chosen.last().map_or("forward", |one| one.id());
        bench.start_up.push(start_up(scene, first, lights, common, progress)?);
        if !common.quiet {
            output::tell(&args.json, &start_up_text(&bench.start_up[bench.start_up.len() - 1]));
        }
        for lights in &args.light_counts {
            let common = CommonArgs { lights: *lights, ..common.clone() };
            let session = Session::open(scene, &common, false, progress)?;
            let reference =
                Chosen { technique: session::technique("reference", "forward")?, params: Params::default() };
            let with_pictures = args.report.is_some();
            let Compared { run, pictures: drawn } = compare::compare(
                &session,
                &common,
                &chosen,
                reference,
                args.frames,
                with_pictures,
                progress,
            )?;
            if !common.quiet {
                output::tell(&args.json, &compare::tables(&run));
            }
            session.finish(&common, common.quiet)?;
            bench.rows.push(run);
            pictures.push(drawn);
        }
    }
    let failed = bench.rows.iter().find_map(|run| compare::verdict(run).err());
    let json = to_json(&bench)?;
    let sections = bench
        .rows
        .into_iter()
        .zip(pictures)
        .map(|(run, pictures)| Part {
            heading: format!("{}, {} lights", run.scene.name, run.scene.lights),
            note: bench
                .start_up
                .iter()
                .find(|one| one.scene == run.scene.name)
                .map_or_else(String::new, start_up_text),
            run,
            charts: Vec::new(),
            pictures,
        })
        .collect();
    let failed = failed.map(|failure| failure.lines().join("; "));
    Ok(Outcome { title: "Speed and memory", json, sections, failed })
}

/// Starts this program anew to render one image, several times.
fn start_up(
    scene: &str,
    technique: &str,
    lights: u32,
    common: &CommonArgs,
    progress: &Progress,
) -> Result<StartUp, Failure> {
    let broke = |what: String| Failure::Failed(format!("start-up of {scene}: {what}"));
    let program = std::env::current_exe().map_err(|error| broke(error.to_string()))?;
    let folder = std::env::temp_dir().join(format!("afterlight-bench-{}", std::process::id()));
    output::make_folder(&folder)?;
    let bar = progress.bar("start-up", START_UPS as u64);
    let mut walls_ms = Vec::new();
    let mut records = Vec::new();
    for _ in 0..START_UPS {
        let start = Instant::now();
        let record = render_once(&program, &folder, scene, technique, lights, common).map_err(broke);
        walls_ms.push(ms_since(start));
        bar.inc(1);
        match record {
            Ok(record) => records.push(record),
            Err(failure) => {
                // Best effort: it is a temporary folder.
                let _ = std::fs::remove_dir_all(&folder);
                return Err(failure);
            }
        }
    }
    bar.finish_and_clear();
    let _ = std::fs::remove_dir_all(&folder);
    let of = |value: fn(&afterlight_measure::ProcessRecord) -> f64| {
        Spread::of(&records.iter().map(value).collect::<Vec<_>>())
    };
    Ok(StartUp {
        scene: scene.to_owned(),
        technique: technique.to_owned(),
        width: common.width,
        height: common.height,
        lights,
        wall_ms: Spread::of(&walls_ms),
        first_image_ms: of(|record| record.first_image_ms),
        load_ms: of(|record| record.load_ms),
        upload_ms: of(|record| record.upload_ms),
        peak_resident_bytes: records.iter().filter_map(|record| record.peak_resident_bytes).max(),
    })
}

fn render_once(
    program: &Path,
    folder: &Path,
    scene: &str,
    technique: &str,
    lights: u32,
    common: &CommonArgs,
) -> Result<afterlight_measure::ProcessRecord, String> {
    let stats = folder.join("stats.json");
    let mut command = Command::new(program);
    command.args(["render", "--quiet", "--technique", technique, "--lights", &lights.to_string()]);
    command.args(["--width", &common.width.to_string(), "--height", &common.height.to_string()]);
    command.args(["--samples", &common.samples.to_string(), "--light-seed", &common.light_seed.to_string()]);
    if let Some(device) = &common.device {
        command.args(["--device", device]);
    }
    if let Some(camera) = &common.camera {
        command.arg(format!("--camera={camera}"));
    }
    command.arg("--output").arg(folder.join("image.png")).arg("--stats").arg(&stats).arg("--").arg(scene);
    let output =
        command.stdin(Stdio::null()).stdout(Stdio::null()).output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(format!(
            "{}; {}",
            output.status,
            text::one_line(&String::from_utf8_lossy(&output.stderr))
        ));
    }
    let json = std::fs::read_to_string(&stats).map_err(|error| error.to_string())?;
    let run: Run = serde_json::from_str(&json).map_err(|error| error.to_string())?;
    run.process.ok_or_else(|| "the process told no figures of itself".to_owned())
}

fn start_up_text(start_up: &StartUp) -> String {
    let ms = |spread: Option<Spread>| spread.map_or_else(|| "–".to_owned(), |spread| ms_text(spread.median));
    format!(
        "{} with {}, {}×{}, {} lights: {} ms from command to image ({} load, {} upload), {} resident at most\n",
        start_up.scene,
        start_up.technique,
        start_up.width,
        start_up.height,
        start_up.lights,
        ms(start_up.wall_ms),
        ms(start_up.load_ms),
        ms(start_up.upload_ms),
        start_up.peak_resident_bytes.map_or_else(|| "–".to_owned(), bytes_text)
    )
}
