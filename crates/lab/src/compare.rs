//! Techniques on the same view: figures of each, and how far its image is from a reference's.

use afterlight_image::Rgba8Image;
use afterlight_measure::{Run, RunResult, SCHEMA, Status};
use afterlight_techniques::{Exactness, Post, exactness_of, view};

use crate::{Chosen, FrameSpec, LabError, Listener, Session, differences, measure};

/// Least PSNR to the reference of an exact technique at more than one sample, dB (contract); with a filter at one as well.
const MULTISAMPLE_PSNR_DB: f64 = 40.0;

/// Refuses a number of samples that no chosen technique renders.
///
/// # Errors
/// [`LabError::Setting`] that lists those that they render.
pub fn check_samples_of(chosen: &[Chosen], samples: u32) -> Result<(), LabError> {
    if chosen.iter().any(|one| one.technique.info().samples.contains(&samples)) {
        return Ok(());
    }
    let mut counts: Vec<u32> = chosen.iter().flat_map(|one| one.technique.info().samples).copied().collect();
    counts.sort_unstable();
    counts.dedup();
    let counts: Vec<String> = counts.iter().map(u32::to_string).collect();
    let expected = format!("one of: {} (what these techniques render)", counts.join(", "));
    Err(LabError::setting("samples", samples, expected))
}

/// A run with the images of it.
pub struct Compared {
    /// The figures.
    pub run: Run,
    /// The reference's image; none where it drew nothing.
    pub truth: Option<Rgba8Image>,
    /// One a result, in their order; none where the technique drew nothing.
    pub images: Vec<Option<Rgba8Image>>,
}

/// Measures every chosen technique and compares its image to the reference's.
///
/// # Errors
/// What every technique would meet: the scene, an image that is too large. What one technique or the device cannot do gives a
/// result that says so.
pub fn compare(
    session: &Session,
    spec: &FrameSpec,
    chosen: &[Chosen],
    reference: Chosen,
    frames: u32,
    listener: &dyn Listener,
) -> Result<Compared, LabError> {
    let task = listener.task("frames", u64::from(frames + 1) * chosen.len() as u64 + 1);
    // The reference runs with its default parameters first: a technique may be compared with itself under others.
    task.at(&format!("reference {}", reference.id()));
    let truth = measure(&session.renderer, &reference, &session.workload, 0, || task.advance())?;
    let mut workload = session.workload;
    if let Some(fragments) = most_fragments(&truth.result) {
        workload.object_fragments = fragments as f64;
    }
    let (mut results, mut images) = (Vec::new(), Vec::new());
    for one in chosen {
        task.at(one.id());
        let measured = measure(&session.renderer, one, &workload, frames, || task.advance())?;
        results.push(measured.result);
        images.push(measured.image);
    }
    drop(task);

    let comparing = listener.task("comparing images", 0);
    if let Some(truth) = &truth.image {
        let drawn: Vec<_> = images.iter().map(Option::as_ref).collect();
        let differences = differences(truth, &drawn)?;
        for ((result, chosen), difference) in results.iter_mut().zip(chosen).zip(differences) {
            let Some(difference) = difference else { continue };
            judge(result, chosen, difference.psnr_or_infinity_db(), spec, &reference);
            result.difference = Some(difference);
        }
    } else {
        let why = truth.result.reason.as_deref().unwrap_or("it drew nothing");
        for (result, _) in results.iter_mut().zip(&images).filter(|(_, image)| image.is_some()) {
            result.reason = Some(format!("no image of {} to compare to: {why}", reference.id()));
        }
    }
    drop(comparing);
    let run = Run {
        schema: SCHEMA,
        device: session.device.clone(),
        scene: session.scene.clone(),
        settings: session.settings_record(spec, frames, reference.id()),
        results,
        process: None,
    };
    Ok(Compared { run, truth: truth.image, images })
}

/// The most fragments that a pass of it shaded; none where the device does not count.
pub fn most_fragments(result: &RunResult) -> Option<u64> {
    let of_pass = |pass: &afterlight_measure::Pass| pass.statistics.get("fragment_invocations").copied();
    result.passes.iter().filter_map(of_pass).max().filter(|count| *count > 0)
}

/// Marks a technique as failed whose image is further from the reference than it may be.
fn judge(result: &mut RunResult, chosen: &Chosen, psnr_db: f64, spec: &FrameSpec, reference: &Chosen) {
    // Bounds are stated against forward's image.
    if reference.id() != "forward" || spec.view != view::FINAL {
        return;
    }
    let least_db = least_psnr_db(chosen, spec.samples, spec.effects.post.filter);
    if let Some(reason) = shortfall(reference.id(), psnr_db, least_db) {
        result.status = Status::Failed;
        result.reason = Some(reason);
    }
}

/// How an image falls short of the least PSNR to a reference, in words; none where it does not.
pub(crate) fn shortfall(reference: &str, psnr_db: f64, least_db: f64) -> Option<String> {
    (psnr_db < least_db)
        .then(|| format!("PSNR to {reference}: found {psnr_db:.1} dB, expected at least {least_db:.1} dB"))
}

/// Least PSNR to `forward` that a technique must have with its parameters, dB.
pub(crate) fn least_psnr_db(chosen: &Chosen, samples: u32, filter: Post) -> f64 {
    // A filter decides by the image: a difference of rounding may become another decision.
    let is_plain = samples == 1 && filter == Post::None;
    match exactness_of(chosen.technique, &chosen.params, samples) {
        Exactness::Exact { min_psnr_db } if is_plain => min_psnr_db,
        Exactness::Exact { .. } => MULTISAMPLE_PSNR_DB,
        Exactness::Approximate { min_psnr_db, .. } => min_psnr_db,
    }
}

/// Why a run has failed: techniques that broke off, dropped what found no room, or whose images are off; none where all is well.
pub fn failure(run: &Run) -> Option<String> {
    let dropped = |result: &&RunResult| {
        result.counters.iter().any(|(name, count)| name.ends_with("_dropped") && count.as_u64() > Some(0))
    };
    let failed: Vec<&RunResult> =
        run.results.iter().filter(|result| result.status == Status::Failed || dropped(result)).collect();
    let first = failed.first()?;
    let names: Vec<&str> = failed.iter().map(|result| result.technique.as_str()).collect();
    let reason = first.reason.as_deref().unwrap_or("no reason given");
    Some(match names.len() {
        1 => format!("{} failed: {reason}", names[0]),
        count => format!("{count} techniques failed: {}; {}: {reason}", names.join(", "), names[0]),
    })
}
