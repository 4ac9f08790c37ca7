//! `afterlight render`

use std::path::Path;
use std::time::Instant;

use afterlight_image::{write_exr, write_png};
use afterlight_lab::{Listener as _, Measured, Session, choose, measure, ms_since};
use afterlight_measure::{ProcessRecord, Run, SCHEMA, Status};
use afterlight_report::{check_file, json_text, write_file};
use afterlight_techniques::Post;

use crate::args::RenderArgs;
use crate::failure::Failure;
use crate::progress::Terminal;

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
    let spec = args.common.spec()?;
    let format = format_of(&args.output)?;
    let post = spec.effects.post.filter;
    if format == Format::Exr && post != Post::None {
        let expected = "none for linear radiance (the filters work on the image that a .png shows)";
        return Err(Failure::option("--post", post.name(), expected));
    }
    check_file(&args.output)?;
    if let Some(stats) = &args.stats {
        check_file(stats)?;
    }
    let chosen = choose("technique", std::slice::from_ref(&args.technique), &spec.set)?;
    let [chosen] = &chosen[..] else {
        return Err(Failure::option("--technique", format!("{:?}", args.technique), "one technique"));
    };
    let terminal = Terminal::new(args.common.quiet, None, false);
    let session = Session::open(&args.scene, &spec, format == Format::Exr, &terminal)?;
    super::tell_warnings(&session, &terminal);
    let task = terminal.task(&format!("rendering with {}", chosen.id()), 0);
    let measured = measure(&session.renderer, chosen, &session.workload, 0, || {})?;
    drop(task);
    let Measured { result, image, radiance } = measured;
    let Some(image) = image else {
        let reason = result.reason.unwrap_or_default();
        return Err(match result.status {
            Status::Unavailable => Failure::Input(reason),
            _ => Failure::Failed(reason),
        });
    };
    match (format, radiance) {
        (Format::Exr, Some(radiance)) => write_exr(&args.output, &radiance)?,
        _ => write_png(&args.output, &image)?,
    }
    let first_image_ms = ms_since(start);
    // An image for which something was dropped is written, and said to be so.
    let dropped = result.reason.clone();
    if let Some(path) = &args.stats {
        let run = Run {
            schema: SCHEMA,
            device: session.device.clone(),
            scene: session.scene.clone(),
            settings: session.settings_record(&spec, 1, chosen.id()),
            results: vec![result],
            process: Some(ProcessRecord {
                load_ms: session.start_up.load_ms,
                upload_ms: session.start_up.upload_ms,
                first_image_ms,
                peak_resident_bytes: peak_resident_bytes(),
            }),
        };
        write_file(path, json_text(&run)?.as_bytes())?;
    }
    session.finish(&spec, &terminal)?;
    dropped.map_or(Ok(()), |reason| Err(Failure::Failed(reason)))
}

/// The most memory that this process ever held, as Linux counts it; none elsewhere.
fn peak_resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}
