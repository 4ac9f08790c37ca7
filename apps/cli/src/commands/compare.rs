//! `afterlight compare`

use std::path::Path;

use afterlight_image::Rgba8Image;
use afterlight_measure::{Run, RunResult, SCHEMA, Status};
use afterlight_report::{Picture, Report, Section, bytes_text, ms_text, psnr_text};
use afterlight_techniques::{Exactness, Info, Params, view};
use comfy_table::Table;

use crate::args::{CommonArgs, CompareArgs, Post};
use crate::failure::Failure;
use crate::frames::{self, Measured};
use crate::pictures;
use crate::progress::Progress;
use crate::session::{self, Chosen, Session};
use crate::{output, text};

/// Least PSNR to the reference of an exact technique at more than one sample, dB (contract); with a filter at one as well.
const MULTISAMPLE_PSNR_DB: f64 = 40.0;

pub fn run(args: &CompareArgs) -> Result<(), Failure> {
    let common = &args.common;
    common.check()?;
    args.json.check()?;
    if let Some(path) = args.json.json.as_deref().filter(|_| !args.json.on_stdout()) {
        output::check_file(path)?;
    }
    let chosen = session::choose("--techniques", &args.techniques, &common.set)?;
    let reference = session::technique("--reference", &args.reference)?;
    if let Some(folder) = &args.report {
        output::make_folder(folder)?;
    }
    let progress = Progress::new(common.quiet);
    let session = Session::open(&args.scene, common, false, &progress)?;
    super::render::tell_warnings(&session, common.quiet);
    check_samples(&chosen, common.samples)?;

    let reference = Chosen { technique: reference, params: Params::default() };
    let compared =
        compare(&session, common, &chosen, reference, args.frames, args.report.is_some(), &progress)?;
    output::json(&args.json, &compared.run)?;
    if !common.quiet {
        output::tell(&args.json, &tables(&compared.run));
    }
    if let Some(folder) = &args.report {
        let section = Section {
            heading: String::new(),
            note: String::new(),
            run: &compared.run,
            charts: Vec::new(),
            pictures: compared.pictures.clone(),
        };
        let path =
            write_report(folder, "Techniques compared", vec![section], &output::json_text(&compared.run)?)?;
        output::tell(&args.json, &format!("report: {}\n", path.display()));
    }
    session.finish(common, common.quiet)?;
    verdict(&compared.run)
}

/// Refuses a number of samples that no chosen technique renders.
fn check_samples(chosen: &[Chosen], samples: u32) -> Result<(), Failure> {
    if chosen.iter().any(|one| one.technique.info().samples.contains(&samples)) {
        return Ok(());
    }
    let mut counts: Vec<u32> = chosen.iter().flat_map(|one| one.technique.info().samples).copied().collect();
    counts.sort_unstable();
    counts.dedup();
    let counts: Vec<String> = counts.iter().map(u32::to_string).collect();
    Err(Failure::option(
        "--samples",
        samples,
        format!("one of: {} (what these techniques render)", counts.join(", ")),
    ))
}

/// Writes `report.html` and `report.json` into a folder and returns the path of the former.
pub fn write_report(
    folder: &Path,
    title: &str,
    sections: Vec<Section<'_>>,
    json: &str,
) -> Result<std::path::PathBuf, Failure> {
    let command: Vec<String> = std::env::args().skip(1).collect();
    let report =
        Report { title: title.to_owned(), command: format!("afterlight {}", command.join(" ")), sections };
    let path = folder.join("report.html");
    output::write_file(&path, report.html().as_bytes())?;
    output::write_file(&folder.join("report.json"), json.as_bytes())?;
    Ok(path)
}

/// A run with the pictures that a report shows.
pub struct Compared {
    pub run: Run,
    pub pictures: Vec<Picture>,
}

/// Measures every chosen technique and compares its image to the reference's.
pub fn compare(
    session: &Session,
    common: &CommonArgs,
    chosen: &[Chosen],
    reference: Chosen,
    frames: u32,
    with_pictures: bool,
    progress: &Progress,
) -> Result<Compared, Failure> {
    let bar = progress.bar("frames", u64::from(frames + 1) * chosen.len() as u64 + 1);
    // The reference runs with its default parameters first: a technique may be compared with itself under others.
    bar.set_message(format!("reference {}", reference.id()));
    let truth = frames::measure(&session.renderer, &reference, &session.workload, 0, || bar.inc(1))?;
    let mut workload = session.workload;
    if let Some(fragments) = most_fragments(&truth.result) {
        workload.object_fragments = fragments as f64;
    }
    let mut measured = Vec::new();
    for one in chosen {
        bar.set_message(one.id());
        measured.push(frames::measure(&session.renderer, one, &workload, frames, || bar.inc(1))?);
    }
    bar.finish_and_clear();

    let spinner = progress.spinner("comparing images");
    let mut pictures = Vec::new();
    if let Some(truth) = &truth.image {
        let images: Vec<_> = measured.iter().map(|one| one.image.as_ref()).collect();
        let differences = pictures::differences(truth, &images)?;
        for ((one, chosen), difference) in measured.iter_mut().zip(chosen).zip(differences) {
            let Some(difference) = difference else { continue };
            judge(
                &mut one.result,
                chosen.technique.info(),
                difference.psnr_or_infinity_db(),
                common,
                &reference,
            );
            one.result.difference = Some(difference);
            if with_pictures {
                pictures.extend(picture(one, truth)?);
            }
        }
    } else {
        let why = truth.result.reason.as_deref().unwrap_or("it drew nothing");
        for one in measured.iter_mut().filter(|one| one.image.is_some()) {
            one.result.reason = Some(format!("no image of {} to compare to: {why}", reference.id()));
        }
    }
    spinner.finish_and_clear();
    let run = Run {
        schema: SCHEMA,
        device: session.device.clone(),
        scene: session.scene.clone(),
        settings: session.settings_record(common, frames, reference.id()),
        results: measured.into_iter().map(|one| one.result).collect(),
        process: None,
    };
    Ok(Compared { run, pictures })
}

/// The most fragments that a pass of it shaded; none where the device does not count.
pub fn most_fragments(result: &RunResult) -> Option<u64> {
    let of_pass = |pass: &afterlight_measure::Pass| pass.statistics.get("fragment_invocations").copied();
    result.passes.iter().filter_map(of_pass).max().filter(|count| *count > 0)
}

/// Marks a technique as failed whose image is further from the reference than it may be.
fn judge(result: &mut RunResult, info: &Info, psnr_db: f64, common: &CommonArgs, reference: &Chosen) {
    // Bounds are stated against forward's image.
    if reference.id() != "forward" || common.view != view::FINAL {
        return;
    }
    // A filter decides by the image: a difference of rounding may become another decision.
    let is_plain = common.samples == 1 && common.post == Post::None;
    let least_db = match info.exactness {
        Exactness::Exact { min_psnr_db } if is_plain => min_psnr_db,
        Exactness::Exact { .. } => MULTISAMPLE_PSNR_DB,
        Exactness::Approximate { min_psnr_db, .. } => min_psnr_db,
    };
    if psnr_db < least_db {
        result.status = Status::Failed;
        result.reason = Some(format!(
            "PSNR to {}: found {psnr_db:.1} dB, expected at least {least_db:.1} dB",
            reference.id()
        ));
    }
}

/// What a report shows of a technique's image; none where there is none.
pub fn picture(measured: &Measured, truth: &Rgba8Image) -> Result<Option<Picture>, Failure> {
    let (Some(image), Some(difference)) = (&measured.image, measured.result.difference) else {
        return Ok(None);
    };
    let is_same = difference.max_abs == 0;
    let caption = match is_same {
        true => "equal to the reference".to_owned(),
        false => format!(
            "{} dB, at most {} of 255; difference ×{}",
            psnr_text(difference.psnr_or_infinity_db()),
            difference.max_abs,
            pictures::AMPLIFICATION
        ),
    };
    Ok(Some(Picture {
        technique: measured.result.technique.clone(),
        image_png: pictures::png(image)?,
        difference_png: if is_same { None } else { Some(pictures::difference_png(truth, image)?) },
        difference_caption: caption,
    }))
}

/// The exit code's reason: techniques that broke off or whose images are off.
pub fn verdict(run: &Run) -> Result<(), Failure> {
    let dropped = |result: &&RunResult| {
        result.counters.iter().any(|(name, count)| name.ends_with("_dropped") && count.as_u64() > Some(0))
    };
    let failed: Vec<&RunResult> =
        run.results.iter().filter(|result| result.status == Status::Failed || dropped(result)).collect();
    let Some(first) = failed.first() else { return Ok(()) };
    let names: Vec<&str> = failed.iter().map(|result| result.technique.as_str()).collect();
    let reason = first.reason.as_deref().unwrap_or("no reason given");
    Err(Failure::Failed(match names.len() {
        1 => format!("{} failed: {reason}", names[0]),
        count => format!("{count} techniques failed: {}; {}: {reason}", names.join(", "), names[0]),
    }))
}

/// A line for each technique with something to say.
fn reasons(run: &Run) -> String {
    run.results
        .iter()
        .filter_map(|result| Some(format!("{}: {}\n", result.technique, result.reason.as_ref()?)))
        .collect()
}

/// What the terminal shows: a line of facts, the techniques, their passes.
pub fn tables(run: &Run) -> String {
    let settings = &run.settings;
    format!(
        "{} ({}), driver {}\n{}: {} triangles, {} draws, {} lights; {}×{}, {} sample(s); median of {} frame(s)\n\n{}\n{}{}\n",
        run.device.name,
        run.device.kind,
        run.device.driver,
        run.scene.name,
        text::grouped(run.scene.triangles),
        text::grouped(run.scene.draws),
        text::grouped(run.scene.lights),
        settings.width,
        settings.height,
        settings.samples,
        settings.frames,
        technique_table(run),
        reasons(run),
        if run.results.iter().all(|result| result.passes.is_empty()) {
            String::new()
        } else {
            pass_table(run).to_string()
        }
    )
}

fn technique_table(run: &Run) -> Table {
    let psnr = format!("PSNR to {}", run.settings.reference);
    let heading =
        ["technique", "status", "frame ms", "min – max", "record ms", "memory", "peak", &psnr, "max", "FLIP"];
    let mut table = text::table(&heading, 2);
    for result in &run.results {
        let dash = || "–".to_owned();
        let (frame, memory, difference) = (result.frame_ms, result.memory.as_ref(), result.difference);
        let status = match result.status {
            Status::Ok => "ok",
            Status::Unavailable => "unavailable",
            Status::Failed => "failed",
        };
        table.add_row([
            result.technique.clone(),
            status.to_owned(),
            frame.map_or_else(dash, |f| ms_text(f.median)),
            frame.map_or_else(dash, |f| format!("{} – {}", ms_text(f.min), ms_text(f.max))),
            result.record_ms.map_or_else(dash, |r| ms_text(r.median)),
            memory.map_or_else(dash, |m| bytes_text(m.technique_bytes)),
            memory.map_or_else(dash, |m| bytes_text(m.peak_bytes)),
            difference.map_or_else(dash, |d| psnr_text(d.psnr_or_infinity_db())),
            difference.map_or_else(dash, |d| d.max_abs.to_string()),
            difference.and_then(|d| d.flip).map_or_else(dash, |flip| format!("{flip:.4}")),
        ]);
    }
    table
}

fn pass_table(run: &Run) -> Table {
    let mut table = text::table(&["pass", "ms", "share", "vertex runs", "fragment runs", "compute runs"], 1);
    for result in &run.results {
        let total: f64 = result.passes.iter().filter_map(|pass| Some(pass.ms?.median)).sum();
        for pass in &result.passes {
            let ms = pass.ms.map_or(0.0, |ms| ms.median);
            let count = |name: &str| match pass.statistics.get(name) {
                Some(0) | None => "–".to_owned(),
                Some(count) => text::grouped(*count),
            };
            // Passes that techniques share (tone mapping) do not carry the technique's name.
            let name = match pass.name.starts_with(&result.technique) {
                true => pass.name.clone(),
                false => format!("{}: {}", result.technique, pass.name),
            };
            table.add_row([
                name,
                ms_text(ms),
                if total > 0.0 { format!("{:.0}%", 100.0 * ms / total) } else { "–".to_owned() },
                count("vertex_invocations"),
                count("fragment_invocations"),
                count("compute_invocations"),
            ]);
        }
    }
    table
}
