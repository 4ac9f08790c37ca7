//! `afterlight render`

use std::path::Path;
use std::time::Instant;

use afterlight_measure::{ProcessRecord, Run, SCHEMA, Status};

use crate::args::RenderArgs;
use crate::failure::Failure;
use crate::frames::{self, Measured};
use crate::output;
use crate::pictures;
use crate::progress::Progress;
use crate::session::{self, Session, ms_since};

/// What the image file's name asks for.
#[derive(Clone, Copy, PartialEq)]
enum Format {
    Png,
    Exr,
}

fn format_of(path: &Path) -> Result<Format, Failure> {
    match path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase().as_str() {
        "png" => Ok(Format::Png),
        "exr" => Ok(Format::Exr),
        _ => Err(Failure::option("--output", path.display(), "a file named .png or .exr")),
    }
}

pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let start = Instant::now();
    let common = &args.common;
    common.check()?;
    let format = format_of(&args.output)?;
    let post = afterlight_techniques::Post::from(common.post);
    if format == Format::Exr && post != afterlight_techniques::Post::None {
        let expected = "none for linear radiance (the filters work on the image that a .png shows)";
        return Err(Failure::option("--post", post.name(), expected));
    }
    output::check_file(&args.output)?;
    if let Some(stats) = &args.stats {
        output::check_file(stats)?;
    }
    let chosen = session::choose("--technique", std::slice::from_ref(&args.technique), &common.set)?;
    let [chosen] = &chosen[..] else {
        return Err(Failure::option("--technique", format!("{:?}", args.technique), "one technique"));
    };
    let progress = Progress::new(common.quiet);
    let session = Session::open(&args.scene, common, format == Format::Exr, &progress)?;
    tell_warnings(&session, common.quiet);
    let spinner = progress.spinner(&format!("rendering with {}", chosen.id()));
    let measured = frames::measure(&session.renderer, chosen, &session.workload, 0, || {})?;
    spinner.finish_and_clear();
    let Measured { result, image, radiance } = measured;
    let Some(image) = image else {
        let reason = result.reason.unwrap_or_default();
        return Err(match result.status {
            Status::Unavailable => Failure::Input(reason),
            _ => Failure::Failed(reason),
        });
    };
    match (format, radiance) {
        (Format::Exr, Some(radiance)) => pictures::write_exr(&args.output, &radiance)?,
        _ => pictures::write_png(&args.output, &image)?,
    }
    let first_image_ms = ms_since(start);
    // An image for which something was dropped is written, and said to be so.
    let dropped = result.reason.clone();
    if let Some(path) = &args.stats {
        let run = Run {
            schema: SCHEMA,
            device: session.device.clone(),
            scene: session.scene.clone(),
            settings: session.settings_record(common, 1, chosen.id()),
            results: vec![result],
            process: Some(ProcessRecord {
                load_ms: session.start_up.load_ms,
                upload_ms: session.start_up.upload_ms,
                first_image_ms,
                peak_resident_bytes: peak_resident_bytes(),
            }),
        };
        output::write_file(path, output::json_text(&run)?.as_bytes())?;
    }
    session.finish(common, common.quiet)?;
    dropped.map_or(Ok(()), |reason| Err(Failure::Failed(reason)))
}

/// Tells what was tolerated in the scene.
pub fn tell_warnings(session: &Session, quiet: bool) {
    /// Warnings told in full; `afterlight scene` tells all.
    const TOLD_MAX: usize = 5;
    if quiet {
        return;
    }
    for warning in session.warnings.iter().take(TOLD_MAX) {
        eprintln!("afterlight: warning: {}", crate::text::one_line(warning));
    }
    if session.warnings.len() > TOLD_MAX {
        eprintln!("afterlight: warning: {} more, see `afterlight scene`", session.warnings.len() - TOLD_MAX);
    }
}

/// The most memory that this process ever held, as Linux counts it; none elsewhere.
fn peak_resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}
