//! `bench speed`: start-up time and memory of a process, frame times of techniques for several numbers of lights.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use afterlight_lab::{
    Chosen, FrameSpec, LabError, Listener, Session, choose, compare, failure, ms_since, technique,
};
use afterlight_measure::{Run, SCHEMA, Spread};
use afterlight_report::{bytes_text, ms_text};
use serde::{Deserialize, Serialize};

use crate::kit::{
    DEFAULT_FRAMES, Options, Outcome, Part, Specification, all_techniques, at_size, check_run, compare_text,
    default_scenes, pictures_of,
};

/// What the experiment is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Share of the frame's width and height, above 0, at most 1.
    pub scale: f64,
    /// Scenes.
    pub scenes: Vec<String>,
    /// Numbers of seeded lights; start-up is measured with the first.
    pub light_counts: Vec<u32>,
    /// Techniques by their ids, or `all`; start-up is measured with the last.
    pub techniques: Vec<String>,
    /// Frames measured of each technique after a warm-up frame, 1 to 10,000.
    pub frames: u32,
    /// The `afterlight` program that is started for figures of start-up; none for the running one, which then is that program.
    pub program: Option<PathBuf>,
    /// What frames look like; `lights` and `post` do not count.
    pub frame: FrameSpec,
}

impl Default for Spec {
    fn default() -> Spec {
        Spec {
            scale: 1.0,
            scenes: default_scenes(),
            light_counts: vec![100, 1000],
            techniques: all_techniques(),
            frames: DEFAULT_FRAMES,
            program: None,
            frame: FrameSpec::default(),
        }
    }
}

impl Specification for Spec {
    const NAME: &'static str = "speed";
    const SUMMARY: &'static str = "start-up, memory and frame times";

    fn from_options(options: &Options) -> Spec {
        let own = Spec::default();
        let frame = options.frame_at((own.frame.width, own.frame.height));
        Spec {
            scale: options.scale.unwrap_or(own.scale),
            scenes: options.scenes.clone().unwrap_or(own.scenes),
            light_counts: options.light_counts.clone().unwrap_or(own.light_counts),
            techniques: options.techniques.clone().unwrap_or(own.techniques),
            frames: options.frames.unwrap_or(own.frames),
            program: None,
            frame: FrameSpec { samples: options.samples.unwrap_or(frame.samples), ..frame },
        }
    }

    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError> {
        run(self, listener)
    }
}

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

fn run(spec: &Spec, listener: &dyn Listener) -> Result<Outcome, LabError> {
    check_run(spec.scale, spec.frames, &spec.frame)?;
    let frame = &FrameSpec {
        samples: spec.frame.samples,
        view: spec.frame.view.clone(),
        ..at_size(&spec.frame, spec.scale)
    };
    let chosen = choose("techniques", &spec.techniques, &frame.set)?;
    let mut bench = Bench { schema: SCHEMA, experiment: Spec::NAME, start_up: Vec::new(), rows: Vec::new() };
    let mut pictures = Vec::new();
    for scene in &spec.scenes {
        let lights = spec.light_counts.first().copied().unwrap_or(0);
        let first = chosen.last().map_or("forward", |one| one.id());
        let started = start_up(spec, scene, first, lights, frame, listener)?;
        listener.tell(&start_up_text(&started));
        bench.start_up.push(started);
        for &lights in &spec.light_counts {
            let frame = FrameSpec { lights, ..frame.clone() };
            let session = Session::open(scene, &frame, false, listener)?;
            let reference = Chosen::new(technique("reference", "forward")?);
            let compared = compare(&session, &frame, &chosen, reference, spec.frames, listener)?;
            listener.tell(&compare_text(&compared.run, false));
            session.finish(&frame, listener)?;
            pictures.push(if listener.wants_pictures() { pictures_of(&compared)? } else { Vec::new() });
            bench.rows.push(compared.run);
        }
    }
    let failed = bench.rows.iter().find_map(failure);
    let json = serde_json::to_value(&bench)?;
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
    Ok(Outcome { title: "Speed and memory", json, sections, failed })
}

/// Starts the program anew to render one image, several times.
fn start_up(
    spec: &Spec,
    scene: &str,
    technique: &str,
    lights: u32,
    frame: &FrameSpec,
    listener: &dyn Listener,
) -> Result<StartUp, LabError> {
    let broke = |reason: String| LabError::BrokeOff { what: format!("start-up of {scene}"), reason };
    let program = match &spec.program {
        Some(program) => program.clone(),
        None => std::env::current_exe().map_err(|error| broke(error.to_string()))?,
    };
    let folder = std::env::temp_dir().join(format!("afterlight-bench-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|error| broke(format!("{}: {error}", folder.display())))?;
    let task = listener.task("start-up", START_UPS as u64);
    let mut walls_ms = Vec::new();
    let mut records = Vec::new();
    for _ in 0..START_UPS {
        let start = Instant::now();
        let record = render_once(&program, &folder, scene, technique, lights, frame).map_err(broke);
        walls_ms.push(ms_since(start));
        task.advance();
        match record {
            Ok(record) => records.push(record),
            Err(failure) => {
                // Best effort: it is a temporary folder.
                let _ = std::fs::remove_dir_all(&folder);
                return Err(failure);
            }
        }
    }
    drop(task);
    let _ = std::fs::remove_dir_all(&folder);
    let of = |value: fn(&afterlight_measure::ProcessRecord) -> f64| {
        Spread::of(&records.iter().map(value).collect::<Vec<_>>())
    };
    Ok(StartUp {
        scene: scene.to_owned(),
        technique: technique.to_owned(),
        width: frame.width,
        height: frame.height,
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
    frame: &FrameSpec,
) -> Result<afterlight_measure::ProcessRecord, String> {
    let stats = folder.join("stats.json");
    let mut command = Command::new(program);
    command.args(["render", "--quiet", "--technique", technique, "--lights", &lights.to_string()]);
    command.args(["--width", &frame.width.to_string(), "--height", &frame.height.to_string()]);
    command.args(["--samples", &frame.samples.to_string(), "--light-seed", &frame.light_seed.to_string()]);
    if let Some(device) = &frame.device {
        command.args(["--device", device]);
    }
    if let Some(camera) = &frame.camera {
        command.arg(format!("--camera={camera}"));
    }
    command.arg("--output").arg(folder.join("image.png")).arg("--stats").arg(&stats).arg("--").arg(scene);
    let output =
        command.stdin(Stdio::null()).stdout(Stdio::null()).output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(format!(
            "{}; {}",
            output.status,
            String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ")
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
