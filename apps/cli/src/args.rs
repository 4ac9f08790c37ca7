//! The command line.

use std::path::PathBuf;

use afterlight_experiments::{EXPERIMENTS, Options};
use afterlight_lab::FrameSpec;
use afterlight_lab::play::PLAY_FRAMES_MAX;
use afterlight_lab::spec::{DEFAULT_SCENE, FRAMES_MAX, LIGHTS_MAX};
use clap::{Args, Parser, Subcommand};

use crate::{
    effects::{self, EffectArgs},
    failure::Failure,
};

/// A workbench of deferred-shading techniques: one scene, one image, many ways, each one timed.
#[derive(Debug, Parser)]
#[command(name = "afterlight", version, arg_required_else_help = true, max_term_width = 110)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// List Vulkan devices, and which techniques run on each
    Devices(ListArgs),
    /// List techniques: sources, properties, parameters
    Techniques(ListArgs),
    /// Tell what a scene holds
    Scene(SceneArgs),
    /// Render one image with one technique
    Render(RenderArgs),
    /// Run techniques on the same view and compare times, memory and images
    Compare(CompareArgs),
    /// Check techniques from random views, and the reference against rays in f64
    Verify(VerifyArgs),
    /// Play a camera path with frames in flight, and tell how steady they are
    Play(PlayArgs),
    /// Run experiments
    Bench(BenchArgs),
    /// Print shell completions
    Completions(CompletionsArgs),
}

/// Options of lists.
#[derive(Debug, Args)]
pub struct ListArgs {
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Where JSON goes.
#[derive(Clone, Debug, Args)]
pub struct JsonArgs {
    /// Write JSON to FILE, or to standard output (`-`, or no FILE)
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub json: Option<PathBuf>,
}

impl JsonArgs {
    /// Whether JSON goes to standard output, so that nothing else may.
    pub fn on_stdout(&self) -> bool {
        self.json.as_ref().is_some_and(|path| path.as_os_str() == "-")
    }

    /// Refuses a scene taken for the file of `--json`: it would be overwritten.
    pub fn check(&self) -> Result<(), Failure> {
        let Some(path) = &self.json else { return Ok(()) };
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let is_scene = path.to_string_lossy().starts_with("builtin:")
            || ["gltf", "glb", "obj"].contains(&extension.as_str());
        if is_scene {
            let expected = "a file for JSON, or `-`; put the scene before --json";
            return Err(Failure::option("--json", format!("the scene {}", path.display()), expected));
        }
        Ok(())
    }
}

/// Arguments of `scene`.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// A .gltf, .glb or .obj file, or builtin:NAME[?key=value&…]
    #[arg(default_value = DEFAULT_SCENE)]
    pub scene: String,
    /// Time at which animated nodes are posed, seconds
    #[arg(long, value_name = "SECONDS", value_parser = finite, allow_negative_numbers = true)]
    pub time: Option<f64>,
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Arguments of `render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// A .gltf, .glb or .obj file, or builtin:NAME[?key=value&…]
    #[arg(default_value = DEFAULT_SCENE)]
    pub scene: String,
    /// Technique, by its id (see `afterlight techniques`)
    #[arg(long, value_name = "ID")]
    pub technique: String,
    /// Image: .png (tone-mapped sRGB) or .exr (linear)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Write the frame's figures as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// A .gltf, .glb or .obj file, or builtin:NAME[?key=value&…]
    #[arg(default_value = DEFAULT_SCENE)]
    pub scene: String,
    /// Techniques, by their ids, or all
    #[arg(long, value_name = "ID,ID…|all", value_delimiter = ',', default_value = "all")]
    pub techniques: Vec<String>,
    /// Technique that images are compared to
    #[arg(long, value_name = "ID", default_value = "forward")]
    pub reference: String,
    /// Frames measured of each technique, after a warm-up frame
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=i64::from(FRAMES_MAX)))]
    pub frames: u32,
    /// Show the passes of every technique as well
    #[arg(long)]
    pub passes: bool,
    /// Write an HTML report (report.html) and its figures (report.json) into DIR
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub json: JsonArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Arguments of `play`.
#[derive(Debug, Args)]
pub struct PlayArgs {
    /// A .gltf, .glb or .obj file, or builtin:NAME[?key=value&…]
    #[arg(default_value = DEFAULT_SCENE)]
    pub scene: String,
    /// Techniques, by their ids; the first draws all frames, unless they take turns (--switch-every)
    #[arg(long, value_name = "ID,ID…", value_delimiter = ',', required = true)]
    pub technique: Vec<String>,
    /// Camera path: a name, or a JSON file [default: the scene's first, or a fly-through]
    #[arg(long, value_name = "NAME|FILE.json")]
    pub path: Option<String>,
    /// Time that the path takes, seconds [default: its own]
    #[arg(long, value_name = "SECONDS", value_parser = above_zero)]
    pub path_seconds: Option<f64>,
    /// Frames
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..=PLAY_FRAMES_MAX))]
    pub frames: u64,
    /// Frames a second of the scene's time
    #[arg(long, value_name = "F", default_value_t = 60.0, value_parser = above_zero)]
    pub fps: f64,
    /// Frames on their way at once
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=8))]
    pub in_flight: u32,
    /// Let the next technique take its turn after N frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub switch_every: Option<u32>,
    /// Image sizes that take turns with the techniques, each prepared on another thread during the turn before
    #[arg(long, value_name = "WxH,WxH…", value_delimiter = ',', value_parser = size_px, requires = "switch_every", conflicts_with = "output")]
    pub sizes: Vec<[u32; 2]>,
    /// Samples a pixel that take turns, where a technique can draw them
    #[arg(long, value_name = "N,N…", value_delimiter = ',', value_parser = samples, requires = "switch_every")]
    pub samples_list: Vec<u32>,
    /// Write every frame's picture: frames/%04d.png
    #[arg(short, long, value_name = "PATTERN")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub json: JsonArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// Arguments of `verify`. What is not given is drawn at random for each view.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// A .gltf, .glb or .obj file, or builtin:NAME[?key=value&…]
    #[arg(default_value = DEFAULT_SCENE)]
    pub scene: String,
    /// Number of views
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub views: u64,
    /// Seed of the views; the time of day where none is given, which the output tells
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Number of the first view: several programs may share the views of one seed
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1_000_000_000_000))]
    pub first: u64,
    /// Begin no further view after this time, seconds
    #[arg(long, value_name = "SECONDS", value_parser = above_zero)]
    pub seconds: Option<f64>,
    /// Techniques, by their ids, or all
    #[arg(long, value_name = "ID,ID…|all", value_delimiter = ',', default_value = "all")]
    pub techniques: Vec<String>,
    /// A technique's parameter, which is then not drawn; ID.KEY=VALUE for one technique alone
    #[arg(long, value_name = "[ID.]KEY=VALUE")]
    pub set: Vec<String>,
    /// Image width, pixels [default: drawn, 64 to 640]
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u32).range(1..))]
    pub width: Option<u32>,
    /// Image height, pixels [default: drawn, by the width]
    #[arg(long, value_name = "H", value_parser = clap::value_parser!(u32).range(1..))]
    pub height: Option<u32>,
    /// Samples a pixel [default: drawn, of those up to 8 that the device has]
    #[arg(long, value_name = "1|2|4|8|16", value_parser = samples)]
    pub samples: Option<u32>,
    /// Number of seeded point lights; 0 keeps the scene's own lights [default: drawn, up to 5,000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(LIGHTS_MAX)))]
    pub lights: Option<u32>,
    /// Pixels of each view of the reference that rays in f64 judge
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    pub probes: u32,
    /// Most findings that are told
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub worst: u32,
    /// Write a picture of each of the first findings into DIR: the reference, the image, and the pixels that differ
    #[arg(long, value_name = "DIR")]
    pub pictures: Option<PathBuf>,
    /// Device, by a part of its name or its index (see `afterlight devices`)
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Time at which animated nodes are posed, seconds
    #[arg(long, value_name = "SECONDS", value_parser = finite, allow_negative_numbers = true)]
    pub time: Option<f64>,
    /// Turn on Vulkan validation; any message makes the exit code 3
    #[arg(long)]
    pub validate: bool,
    /// No progress bars and no tables
    #[arg(long)]
    pub quiet: bool,
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Options that a specification holds, so that they cannot stand beside `--spec`.
fn not_with_spec() -> Vec<&'static str> {
    let own = [
        "scale",
        "scenes",
        "light_counts",
        "techniques",
        "frames",
        "max_pairs",
        "max_commands",
        "views",
        "path",
        "width",
        "height",
        "samples",
        "lights",
        "light_seed",
        "camera",
        "set",
        "device",
        "time",
        "view",
        "validate",
    ];
    own.into_iter().chain(effects::names()).collect()
}

/// Arguments of `bench`. What is not given is the experiment's own.
#[derive(Clone, Debug, Args)]
pub struct BenchArgs {
    #[arg(value_name = "EXPERIMENT|all", help = experiments_help())]
    pub experiment: String,
    /// The experiment's specification, a JSON file, in the place of all options but --report, --json and --quiet
    #[arg(long, value_name = "FILE.json", conflicts_with_all = not_with_spec())]
    pub spec: Option<PathBuf>,
    /// Print the specification that the options give, and run nothing
    #[arg(long)]
    pub show_spec: bool,
    /// Share of the experiment's width and height, and of the most lights of lights-sweep; triangles go by its square [default: 1]
    #[arg(long, value_name = "F", value_parser = share)]
    pub scale: Option<f64>,
    /// Scenes; lights-sweep, msaa-table2 and the dais experiments have their own [default: builtin:colonnade]
    #[arg(long, alias = "scene", value_name = "SCENE,SCENE…", value_delimiter = ',')]
    pub scenes: Option<Vec<String>>,
    /// Numbers of seeded lights; msaa-table2 has its own, 5 and 50, lights-sweep 1 to 100,000 [default: 100,1000]
    #[arg(long, value_name = "N,N…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(0..=i64::from(LIGHTS_MAX)))]
    pub light_counts: Option<Vec<u32>>,
    /// Techniques, by their ids, or all [default: all]
    #[arg(long, value_name = "ID,ID…|all", value_delimiter = ',')]
    pub techniques: Option<Vec<String>>,
    /// Frames measured of each technique, after a warm-up frame; lights-sweep has its own, 3 [default: 5]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(FRAMES_MAX)))]
    pub frames: Option<u32>,
    /// Predicted pairs of a light and a surface a frame beyond which a technique is left out (lights-sweep)
    #[arg(long, value_name = "N")]
    pub max_pairs: Option<u64>,
    /// Predicted draws a frame beyond which a technique is left out (lights-sweep)
    #[arg(long, value_name = "N")]
    pub max_commands: Option<u64>,
    /// Views along the camera path (dais-fig5, dais-fig7) [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub views: Option<u32>,
    /// Camera path, a JSON file; else a fly-through of the scene (the dais experiments)
    #[arg(long, value_name = "FILE.json")]
    pub path: Option<PathBuf>,
    /// Write an HTML report (report.html) and its figures (report.json) into DIR
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub json: JsonArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

impl BenchArgs {
    /// The options as experiments take them.
    pub fn options(&self) -> Result<Options, Failure> {
        let common = &self.common;
        Ok(Options {
            scale: self.scale,
            scenes: self.scenes.clone(),
            light_counts: self.light_counts.clone(),
            techniques: self.techniques.clone(),
            frames: self.frames,
            max_pairs: self.max_pairs,
            max_commands: self.max_commands,
            views: self.views,
            path: self.path.clone(),
            width: common.width,
            height: common.height,
            samples: common.samples,
            frame: common.spec()?,
        })
    }
}

fn experiments_help() -> String {
    let list: String = EXPERIMENTS.iter().map(|one| format!(" {} ({});", one.name, one.summary)).collect();
    format!("Experiment:{list} or all")
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// The shell
    pub shell: clap_complete::Shell,
}

/// Options of every command that renders.
#[derive(Clone, Debug, Args)]
pub struct CommonArgs {
    /// Image width, pixels [default: 1280, or an experiment's own]
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u32).range(1..))]
    pub width: Option<u32>,
    /// Image height, pixels [default: 720, or an experiment's own]
    #[arg(long, value_name = "H", value_parser = clap::value_parser!(u32).range(1..))]
    pub height: Option<u32>,
    /// Samples a pixel [default: 1, or an experiment's own]
    #[arg(long, value_name = "1|2|4|8|16", value_parser = samples)]
    pub samples: Option<u32>,
    /// Number of seeded point lights; 0 keeps the scene's own lights
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(LIGHTS_MAX)))]
    pub lights: u32,
    /// Seed of the lights
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub light_seed: u64,
    /// Camera of the scene by name or index, or eye, target, vertical angle of view and near plane [default: 0.1]; or eye, target and
    /// orthographic,HALF_HEIGHT,NEAR,FAR
    #[arg(long, value_name = "NAME|INDEX|x,y,z,tx,ty,tz,fov_deg[,near_m]", allow_hyphen_values = true)]
    pub camera: Option<String>,
    /// A technique's parameter; ID.KEY=VALUE for one technique alone
    #[arg(long, value_name = "[ID.]KEY=VALUE")]
    pub set: Vec<String>,
    /// Device, by a part of its name or its index (see `afterlight devices`)
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Time at which animated nodes are posed, seconds
    #[arg(long, value_name = "SECONDS", value_parser = finite, allow_negative_numbers = true)]
    pub time: Option<f64>,
    #[command(flatten)]
    pub effects: EffectArgs,
    /// What to show: the final image, or a debug view
    #[arg(long, value_name = "final|NAME", default_value = "final")]
    pub view: String,
    /// Turn on Vulkan validation; any message makes the exit code 3
    #[arg(long)]
    pub validate: bool,
    /// No progress bars and no tables
    #[arg(long)]
    pub quiet: bool,
}

impl CommonArgs {
    /// The frames that the options ask for; refuses what this version does not have yet, and what does not go together.
    pub fn spec(&self) -> Result<FrameSpec, Failure> {
        let usual = FrameSpec::default();
        let spec = FrameSpec {
            width: self.width.unwrap_or(usual.width),
            height: self.height.unwrap_or(usual.height),
            samples: self.samples.unwrap_or(usual.samples),
            lights: self.lights,
            light_seed: self.light_seed,
            camera: self.camera.clone(),
            set: self.set.clone(),
            device: self.device.clone(),
            time_s: self.time,
            effects: self.effects.0,
            view: self.view.clone(),
            validate: self.validate,
        };
        spec.check()?;
        Ok(spec)
    }
}

/// Reads `160x90`.
fn size_px(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|px: &u32| *px > 0);
    let size_px = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
    size_px.ok_or_else(|| "expected width and height in pixels, such as 160x90".to_owned())
}

fn samples(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(samples @ (1 | 2 | 4 | 8 | 16)) => Ok(samples),
        _ => Err("expected 1, 2, 4, 8 or 16".to_owned()),
    }
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if share > 0.0 && share <= 1.0 => Ok(share),
        _ => Err("expected a number above 0, at most 1".to_owned()),
    }
}

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("expected a finite number of seconds".to_owned()),
    }
}

fn above_zero(text: &str) -> Result<f64, String> {
    finite(text).and_then(|seconds| match seconds > 0.0 {
        true => Ok(seconds),
        false => Err("expected a number of seconds above 0".to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    /// Commands that `verify` prints are read back, whatever its own time was.
    #[test]
    fn times_before_the_first_are_taken_as_they_are_printed() {
        for command in ["compare", "verify"] {
            assert!(Cli::try_parse_from(["afterlight", command, "--time", "-1.5"]).is_ok(), "{command}");
        }
        assert!(Cli::try_parse_from(["afterlight", "verify", "--seconds", "0"]).is_err());
    }

    #[test]
    fn command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    fn compare(arguments: &[&str]) -> CompareArgs {
        let all = ["afterlight", "compare"].iter().chain(arguments);
        match Cli::try_parse_from(all).expect("parses").command {
            Command::Compare(args) => args,
            other => panic!("expected compare, found {other:?}"),
        }
    }

    #[test]
    fn json_takes_a_file_a_dash_or_nothing() {
        assert!(!compare(&[]).json.on_stdout());
        assert!(compare(&["--json"]).json.on_stdout());
        assert!(compare(&["--json", "-"]).json.on_stdout());
        assert!(compare(&["--json", "--quiet"]).json.on_stdout());
        assert_eq!(compare(&["--json", "a.json"]).json.json, Some("a.json".into()));
    }

    #[test]
    fn json_does_not_swallow_a_scene() {
        for scene in ["builtin:spheres", "a.gltf", "b.GLB", "c.obj"] {
            assert!(compare(&["--json", scene]).json.check().is_err(), "{scene}");
        }
        assert!(compare(&["a.gltf", "--json", "-"]).json.check().is_ok());
    }

    #[test]
    fn a_specification_stands_for_other_options() {
        let parse = |more: &[&str]| {
            Cli::try_parse_from(["afterlight", "bench", "speed", "--spec", "a.json"].iter().chain(more))
        };
        assert!(parse(&["--quiet", "--report", "r", "--json"]).is_ok());
        for option in [["--scale", "0.5"], ["--width", "64"], ["--shadows", "map"]] {
            assert!(parse(&option).is_err(), "{option:?}");
        }
    }

    #[test]
    fn what_is_not_there_yet_is_refused() {
        let failure = compare(&["--shadow-map-size", "512"]).common.spec().expect_err("is refused");
        let line = failure.lines().remove(0);
        assert_eq!(failure.code(), 2);
        assert!(line.starts_with("--shadow-map-size") && line.contains("expected"), "{line}");
        for post in ["none", "fxaa", "smaa", "sraa"] {
            assert!(compare(&["--post", post]).common.spec().is_ok(), "{post}");
        }
        let failure = compare(&["--post", "fxaa", "--view", "edges"]).common.spec().expect_err("is refused");
        assert!(failure.lines()[0].starts_with("--post: found fxaa, expected none"));
        for option in [["--indirect", "rsm"], ["--shadows", "map"]] {
            let sized = [&option[..], &["--shadow-map-size", "256"]].concat();
            assert!(compare(&sized).common.spec().is_ok(), "{sized:?}");
        }
        assert!(compare(&["--camera", "-1,0,0,0,0,0,60"]).common.spec().is_ok());
    }
}
