//! `afterlight play`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use afterlight_image::{Rgba8Image, write_png};
use afterlight_lab::play::{PlaySpec, SeesPicture, play};
use afterlight_lab::{Listener as _, Session, choose};
use afterlight_measure::{Distribution, Held, Play};
use afterlight_report::check_file;
use afterlight_report::text::{grouped, table};

use afterlight_scene::camera::CameraPath;

use crate::args::PlayArgs;
use crate::failure::Failure;
use crate::output;
use crate::progress::Terminal;

pub fn run(args: &PlayArgs) -> Result<(), Failure> {
    args.json.check()?;
    if let Some(path) = args.json.json.as_deref().filter(|_| !args.json.on_stdout()) {
        check_file(path)?;
    }
    let spec = args.common.spec()?;
    if let Some(camera) = &spec.camera {
        let expected = "none: cameras are the path's (--path takes a camera that moves by its name)";
        return Err(Failure::option("--camera", camera, expected));
    }
    let how = PlaySpec {
        frames: args.frames,
        fps: args.fps,
        path_s: args.path_seconds,
        in_flight: args.in_flight,
        switch_every: args.switch_every,
        sizes_px: args.sizes.clone(),
        samples: args.samples_list.clone(),
    };
    how.check()?;
    let pattern = args.output.as_deref().map(Pattern::of).transpose()?;
    if let Some(pattern) = &pattern {
        check_file(&pattern.file(0))?;
    }
    let chosen = choose("technique", &args.technique, &spec.set)?;
    let terminal = Terminal::new(args.common.quiet, Some(&args.json), false);
    let (session, scene) = Session::open_with_scene(&args.scene, &spec, &terminal)?;
    let path = CameraPath::select(&scene, args.path.as_deref())?;
    super::tell_warnings(&session, &terminal);
    let mut write = |frame: u64, rgba8: &[u8]| {
        let Some(pattern) = &pattern else { return Ok(()) };
        let image = Rgba8Image { width: spec.width, height: spec.height, pixels: rgba8.to_vec() };
        Ok(write_png(&pattern.file(frame), &image)?)
    };
    let sees = pattern.is_some().then_some(&mut write as &mut SeesPicture<'_>);
    let played = play((&session, &scene), &spec, (&path, &how), &chosen, sees, &terminal)?;
    output::json(&args.json, &played)?;
    terminal.tell(&text(&played));
    session.finish(&spec, &terminal)?;
    let short = played.fell_short.len();
    match played.fell_short.first() {
        Some(first) => {
            Err(Failure::Failed(format!("{short} frames dropped something for want of room, first {first}")))
        }
        None => Ok(()),
    }
}

/// Files of pictures: what stands before and after the frame's number, and its least number of digits.
#[derive(Debug, PartialEq)]
struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// Reads `frames/%04d.png`.
    fn of(path: &Path) -> Result<Pattern, Failure> {
        let text = path.to_string_lossy();
        let expected = "a file named .png with one %d or %04d in it, where the frame's number goes";
        let refused = || Failure::option("--output", path.display(), expected);
        let (before, rest) = text.split_once('%').ok_or_else(refused)?;
        let (width, after) = rest.split_once('d').ok_or_else(refused)?;
        let is_width =
            width.is_empty() || width.starts_with('0') && width.bytes().all(|b| b.is_ascii_digit());
        if !is_width || after.contains('%') || !after.to_ascii_lowercase().ends_with(".png") {
            return Err(refused());
        }
        let digits = if width.is_empty() { 1 } else { width.parse().map_err(|_| refused())? };
        if digits > 20 {
            return Err(refused());
        }
        Ok(Pattern { before: before.to_owned(), digits, after: after.to_owned() })
    }

    fn file(&self, frame: u64) -> PathBuf {
        let Self { before, digits, after } = self;
        PathBuf::from(format!("{before}{frame:0digits$}{after}"))
    }
}

/// Most lines of one kind that are told.
const LINES_MAX: usize = 20;

/// What was measured, for people.
fn text(played: &Play) -> String {
    let mut text = String::new();
    let frames: u64 = played.techniques.iter().map(|one| one.frames).sum();
    let _ = writeln!(
        text,
        "{} frames along {} at {} frames a second, {} in flight",
        grouped(frames),
        played.path,
        played.fps,
        played.in_flight
    );
    let mut rows = table(&["technique", "frames", "ms", "median", "95%", "99%", "worst"], 1);
    let mut row = |name: &str, frames: u64, what: &str, times: Option<Distribution>| {
        let figures = times.map_or_else(
            || ["—"; 4].map(str::to_owned),
            |Distribution { median, p95, p99, worst }| [median, p95, p99, worst].map(|ms| format!("{ms:.3}")),
        );
        rows.add_row([vec![name.to_owned(), grouped(frames), what.to_owned()], figures.to_vec()].concat());
    };
    for one in &played.techniques {
        row(&one.technique, one.frames, "GPU", one.gpu_ms);
        row(&one.technique, one.frames, "CPU", one.cpu_ms);
    }
    row("all", frames, "frame to frame", played.frame_ms);
    let _ = writeln!(text, "{rows}");
    for one in played.techniques.iter().filter(|one| !one.moves_without_plans) {
        let _ = writeln!(
            text,
            "{}: records what holds for one view alone, so every frame is planned anew",
            one.technique
        );
    }
    if let Some(idle) = played.idle_fraction {
        let _ = writeln!(text, "the device was idle for {:.1}% of the time", 100.0 * idle);
    }
    let _ = writeln!(
        text,
        "{} bytes of plans, {} of frames in flight",
        grouped(played.memory.plan_bytes),
        grouped(played.memory.in_flight_bytes)
    );
    if let [first, .., last] = &played.held[..] {
        let at = |when: &str, held: &Held| {
            let host = held.host_bytes.map_or_else(|| "—".to_owned(), grouped);
            let [bytes, objects] = [held.device_bytes, held.device_objects].map(grouped);
            format!("held {when}: {bytes} bytes in {objects} objects of the device, {host} bytes of the host")
        };
        let _ = writeln!(text, "{}", at("before the first frame", first));
        let _ = writeln!(text, "{}", at("after the last", last));
    }
    tell(&mut text, "plans made while frames went on", &played.plans, |plan| {
        let frame = |frame: Option<u64>| frame.map_or_else(|| "—".to_owned(), grouped);
        format!("begun by frame {}, taken by frame {}", frame(plan.begun), frame(plan.taken))
    });
    tell(&mut text, "hitches", &played.hitches, |hitch| {
        let causes = if hitch.causes.is_empty() { "unknown".to_owned() } else { hitch.causes.join(", ") };
        format!(
            "frame {}: {:.3} ms among neighbours of {:.3}: {causes}",
            hitch.frame, hitch.ms, hitch.neighbours_ms
        )
    });
    tell(&mut text, "lists that grew", &played.capacity_events, |event| {
        format!(
            "frame {}: {}: {} needed, {} there, {} dropped",
            event.frame,
            event.list,
            grouped(event.needed.into()),
            grouped(event.capacity.into()),
            grouped(event.dropped.into())
        )
    });
    text
}

fn tell<T>(text: &mut String, what: &str, all: &[T], line: impl Fn(&T) -> String) {
    let _ = writeln!(text, "{what}: {}", all.len());
    for one in all.iter().take(LINES_MAX) {
        let _ = writeln!(text, "  {}", line(one));
    }
    if all.len() > LINES_MAX {
        let _ = writeln!(text, "  and {} more", all.len() - LINES_MAX);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_numbered() {
        let file = |pattern: &str, frame| Pattern::of(Path::new(pattern)).map(|one| one.file(frame));
        assert_eq!(file("frames/%04d.png", 7).expect("a pattern"), Path::new("frames/0007.png"));
        assert_eq!(file("frames/%04d.png", 12_345).expect("a pattern"), Path::new("frames/12345.png"));
        assert_eq!(file("%d.PNG", 3).expect("a pattern"), Path::new("3.PNG"));
        for refused in ["frames.png", "%04d.exr", "%d%d.png", "%4d.png", "%x.png", "%099d.png"] {
            assert!(Pattern::of(Path::new(refused)).is_err(), "{refused}");
        }
    }
}
