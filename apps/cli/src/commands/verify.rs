//! `afterlight verify`

use std::fmt::Write as _;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use afterlight_image::write_png;
use afterlight_lab::verify::{Fixed, VerifySpec, verify, verify_failure};
use afterlight_lab::{FrameSpec, Listener as _, Session, check_samples_of, choose};
use afterlight_measure::{Finding, Margin, PSNR_IDENTICAL_DB, Verification};
use afterlight_report::text::{grouped, table};
use afterlight_report::{check_file, make_folder};

use crate::args::VerifyArgs;
use crate::failure::Failure;
use crate::output;
use crate::progress::Terminal;

/// Most pictures of one run.
const PICTURES_MAX: u32 = 200;

pub fn run(args: &VerifyArgs) -> Result<(), Failure> {
    args.json.check()?;
    if let Some(path) = args.json.json.as_deref().filter(|_| !args.json.on_stdout()) {
        check_file(path)?;
    }
    let spec = spec(args);
    // The device is opened and the scene loaded for this one; views have their own.
    let usual = FrameSpec {
        width: args.width.unwrap_or(64),
        height: args.height.unwrap_or(64),
        samples: args.samples.unwrap_or(1),
        lights: args.lights.unwrap_or(0),
        device: args.device.clone(),
        time_s: args.time,
        validate: args.validate,
        ..FrameSpec::default()
    };
    usual.check()?;
    let techniques = choose("techniques", &args.techniques, &args.set)?;
    if let Some(samples) = args.samples {
        check_samples_of(&techniques, samples)?;
    }
    if let Some(folder) = &args.pictures {
        make_folder(folder)?;
    }
    let terminal = Terminal::new(args.quiet, Some(&args.json), false);
    let (session, scene) = Session::open_with_scene(&args.scene, &usual, &terminal)?;
    super::tell_warnings(&session, &terminal);
    let written = AtomicU32::new(0);
    let album = |finding: &Finding, picture: &afterlight_image::Rgba8Image| {
        let Some(folder) = &args.pictures else { return Ok(None) };
        let number = written.fetch_add(1, Ordering::Relaxed);
        if number >= PICTURES_MAX {
            return Ok(None);
        }
        let file = folder.join(format!("{:06}-{}-{number}.png", finding.view, finding.technique));
        write_png(&file, picture)?;
        Ok(Some(file.display().to_string()))
    };
    let verification = verify(&session, &scene, &args.scene, &techniques, &spec, &album, &terminal)?;
    output::json(&args.json, &verification)?;
    terminal.tell(&text(&verification));
    session.finish(&usual, &terminal)?;
    verify_failure(&verification).map_or(Ok(()), |reason| Err(Failure::Failed(reason)))
}

fn spec(args: &VerifyArgs) -> VerifySpec {
    let time_of_day = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(1, |since| since.as_secs());
    let key = |set: &String| set.split_once('=').map_or(set.as_str(), |(name, _)| name).to_owned();
    VerifySpec {
        views: args.views,
        seed: args.seed.unwrap_or_else(time_of_day),
        first: args.first,
        seconds: args.seconds,
        probes: args.probes,
        worst: args.worst as usize,
        fixed: Fixed {
            width: args.width,
            height: args.height,
            samples: args.samples,
            lights: args.lights,
            device: args.device.clone(),
            time_s: args.time,
            validate: args.validate,
        },
        fixed_params: args.set.iter().map(key).collect(),
    }
}

/// What was found, for people.
fn text(verification: &Verification) -> String {
    let mut text = String::new();
    let Verification { views, seed, first, comparisons, probes, .. } = verification;
    let _ = writeln!(
        text,
        "{} views of seed {seed}, from {first}: {} comparisons to forward in {:.1} s, {} off",
        grouped(*views),
        grouped(*comparisons),
        verification.seconds,
        verification.off_count,
    );
    if verification.undecided > 0 {
        let _ = writeln!(
            text,
            "{} of them within their bounds but for pixels at edges and rims of masks, which Vulkan leaves open (one of 1,000 at most)",
            grouped(verification.undecided),
        );
    }
    if *views < verification.views_asked {
        let _ = writeln!(text, "the time was up: {} views were asked for", verification.views_asked);
    }
    let _ = writeln!(
        text,
        "forward by rays in f64: {} pixels judged, {} of them shaded as well, {} off; {} too near for 32-bit floats\n",
        grouped(probes.surfaces),
        grouped(probes.radiances),
        probes.off,
        grouped(probes.unjudged),
    );
    let mut margins = table(&["technique", "images", "off", "least margin, dB", "view"], 1);
    for Margin { technique, comparisons, off, least_margin_db, view } in &verification.techniques {
        margins.add_row([
            technique.clone(),
            grouped(*comparisons),
            off.to_string(),
            least_margin_db.map_or_else(|| "—".to_owned(), margin_text),
            view.map_or_else(|| "—".to_owned(), |view| view.to_string()),
        ]);
    }
    let _ = writeln!(text, "{margins}");
    for left_out in &verification.left_out {
        let _ =
            writeln!(text, "left out: {}, {} times: {}", left_out.technique, left_out.count, left_out.reason);
    }
    if !verification.off.is_empty() {
        let _ = writeln!(text, "\noff, the worst first:");
        verification.off.iter().for_each(|finding| tell(&mut text, finding));
    }
    if !verification.nearest.is_empty() {
        let _ = writeln!(text, "\nwithin their bounds, the nearest first:");
        verification.nearest.iter().for_each(|finding| tell(&mut text, finding));
    }
    text
}

/// A margin; images that are equal have no figure.
fn margin_text(margin_db: f64) -> String {
    if margin_db > 0.5 * PSNR_IDENTICAL_DB { "equal".to_owned() } else { format!("{margin_db:.1}") }
}

fn tell(text: &mut String, finding: &Finding) {
    let what = match (&finding.reason, &finding.difference) {
        (Some(reason), _) => reason.clone(),
        (None, Some(difference)) => {
            format!("{:.1} dB, at least {:.0} expected", difference.psnr_db, finding.bound_db)
        }
        (None, None) => String::new(),
    };
    let pixels = match finding.pixels_off {
        0 => String::new(),
        count => format!("; {count} pixels off"),
    };
    let _ = writeln!(text, "view {}, {}, {}: {what}{pixels}", finding.view, finding.place, finding.technique);
    let _ = writeln!(text, "  {}", finding.command);
    if let Some(picture) = &finding.picture {
        let _ = writeln!(text, "  {picture}");
    }
}
