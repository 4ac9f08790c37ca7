//! Random views and settings: every technique and way of visibility against the reference, sampled pixels of the reference against rays in
//! f64.
//!
//! A view is drawn from a seed and its number, purely; [`verify`] renders it with the reference, with every variant of every technique, and
//! compares. What is off, and what comes nearest to its bound, is a [`Finding`] with the command that repeats it.

mod command;
mod probe;
mod undecided;
mod variants;
mod view;

use std::collections::BTreeMap;
use std::time::Instant;

use afterlight_image::{Rgba8Image, marked_sheet, max_abs, pixels_off, psnr_db};
use afterlight_measure::{
    Difference, Finding, LeftOut, Margin, PSNR_IDENTICAL_DB, Probes, SCHEMA, Status, Verification,
};
use afterlight_oracle::raster::RayScene;
use afterlight_renderer::{Prepared, Renderer};
use afterlight_scene::Scene;
use afterlight_scene::rng::SplitMix64;
use afterlight_techniques::{Counter, Indirect, Settings, Shadows, TechniqueError};

use command::{changed, compare_command};
use undecided::{Settled, settle};
use variants::{Variant, variants};
pub use view::Fixed;
use view::{Stage, View, draw};

use crate::compare::{least_psnr_db, shortfall};
use crate::session::settings_of;
use crate::spec::SAMPLES;
use crate::trial::status_of;
use crate::{Chosen, LabError, Listener, Session, technique};

/// The technique that images are compared to.
const REFERENCE: &str = "forward";

/// Most numbers of samples a pixel that are drawn: what devices have beyond costs much and tells no more.
const SAMPLES_MAX: u32 = 8;

/// Least difference of a channel, of 255, at which a pixel is marked as off.
const MARKED_FROM: u8 = 4;

/// Findings within their bounds that are kept.
const NEAREST_KEPT: usize = 5;

/// What to verify.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifySpec {
    /// Number of views.
    pub views: u64,
    /// Seed of the views.
    pub seed: u64,
    /// Number of the first view.
    pub first: u64,
    /// Time after which no further view begins, seconds.
    pub seconds: Option<f64>,
    /// Pixels of each view that rays judge.
    pub probes: u32,
    /// Most findings that are kept of what is off.
    pub worst: usize,
    /// What is not drawn.
    pub fixed: Fixed,
    /// Parameters of techniques that are not drawn, `KEY` or `ID.KEY`.
    pub fixed_params: Vec<String>,
}

impl Default for VerifySpec {
    fn default() -> VerifySpec {
        VerifySpec {
            views: 100,
            seed: 1,
            first: 0,
            seconds: None,
            probes: 256,
            worst: 10,
            fixed: Fixed::default(),
            fixed_params: Vec::new(),
        }
    }
}

/// Takes the picture of what is off, reference, image and marked pixels side by side, and returns the name of its file, where it keeps one.
pub type Album<'a> = &'a dyn Fn(&Finding, &Rgba8Image) -> Result<Option<String>, LabError>;

/// Verifies techniques on a scene.
///
/// # Errors
/// The scene, its camera, the device. What a technique cannot do is a finding, or told as left out.
pub fn verify(
    session: &Session,
    scene: &Scene,
    source: &str,
    techniques: &[Chosen],
    spec: &VerifySpec,
    album: Album<'_>,
    listener: &dyn Listener,
) -> Result<Verification, LabError> {
    let start = Instant::now();
    let task = listener.task("rays", 0);
    let rays = (spec.probes > 0).then(|| RayScene::new(scene));
    drop(task);
    let features = session.renderer.device().features();
    let samples: Vec<u32> = (SAMPLES.into_iter())
        .filter(|count| *count <= SAMPLES_MAX && (*count == 1 || features.supports_samples(*count, false)))
        .collect();
    let stage = Stage::of(scene);
    let mut check = Check { session, scene, source, spec, album, rays, found: Found::default() };
    let task = listener.task("views", spec.views);
    for index in spec.first..spec.first.saturating_add(spec.views) {
        if spec.seconds.is_some_and(|seconds| start.elapsed().as_secs_f64() >= seconds) {
            break;
        }
        let view = draw(&stage, spec.seed, index, &samples, &spec.fixed);
        task.at(&format!("view {index}, {}", view.place.name()));
        check.view(&view, techniques)?;
        check.found.views += 1;
        task.advance();
    }
    drop(task);
    let Found { views, comparisons, mut margins, probes, left_out, off, off_count, undecided, nearest } =
        check.found;
    // In the order of the techniques, whatever the first views could render.
    let order = |margin: &Margin| {
        let id = margin.technique.split(' ').next();
        techniques.iter().position(|one| Some(one.id()) == id)
    };
    margins.sort_by_key(order);
    let left_out = left_out.into_iter();
    Ok(Verification {
        schema: SCHEMA,
        device: session.device.clone(),
        scene: session.scene.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: spec.seed,
        first: spec.first,
        views,
        views_asked: spec.views,
        seconds: start.elapsed().as_secs_f64(),
        comparisons,
        techniques: margins,
        probes,
        left_out: left_out.map(|((technique, reason), count)| LeftOut { technique, reason, count }).collect(),
        off,
        off_count,
        undecided,
        nearest,
    })
}

/// Why a verification has failed; none where all is well.
pub fn verify_failure(verification: &Verification) -> Option<String> {
    let Verification { off_count, comparisons, views, .. } = verification;
    if *views == 0 {
        return Some("no view was checked: the time was up before the first".to_owned());
    }
    let first = verification.off.first()?;
    let reason = first.reason.as_deref().unwrap_or("no reason given");
    Some(format!(
        "{off_count} off in {views} views with {comparisons} comparisons; view {}, {}: {reason}",
        first.view, first.technique
    ))
}

/// What was found so far.
#[derive(Default)]
struct Found {
    views: u64,
    comparisons: u64,
    margins: Vec<Margin>,
    probes: Probes,
    left_out: BTreeMap<(String, String), u64>,
    off: Vec<Finding>,
    off_count: u64,
    undecided: u64,
    nearest: Vec<Finding>,
}

/// By the PSNR above the bound; what drew nothing comes first.
fn worst_first(a: &Finding, b: &Finding) -> std::cmp::Ordering {
    let margin_db = |finding: &Finding| finding.margin_db.unwrap_or(f64::NEG_INFINITY);
    margin_db(a).total_cmp(&margin_db(b))
}

/// Adds a finding to those that are kept, the worst first.
fn keep_worst(kept: &mut Vec<Finding>, finding: Finding, most: usize) {
    kept.push(finding);
    kept.sort_by(worst_first);
    kept.truncate(most);
}

/// A check under way.
struct Check<'a> {
    session: &'a Session,
    scene: &'a Scene,
    source: &'a str,
    spec: &'a VerifySpec,
    album: Album<'a>,
    rays: Option<RayScene<'a>>,
    found: Found,
}

impl Check<'_> {
    fn renderer(&self, settings: &Settings) -> Result<Renderer, LabError> {
        let base = &self.session.renderer;
        Ok(Renderer::with_scene(base.device(), base.scene().clone(), settings)?)
    }

    /// Renders a view with the reference and with every technique.
    fn view(&mut self, view: &View, techniques: &[Chosen]) -> Result<(), LabError> {
        let settings = settings_of(self.scene, &view.spec)?;
        let renderer = self.renderer(&settings)?;
        let reference = Chosen::new(technique("reference", REFERENCE)?);
        let truth = match render(&renderer, &reference) {
            Ok(Frame { image, .. }) => image,
            Err(error @ (TechniqueError::Scene(_) | TechniqueError::TooLarge { .. })) => {
                return Err(error.into());
            }
            Err(error) => {
                self.add_off(self.finding(view, &reference, 0.0), Some(error.to_string()), None)?;
                return Ok(());
            }
        };
        self.judge_reference(view, &settings, &reference, &truth)?;
        // Parameters have a generator of their own: a technique more or less changes no camera.
        let mut rng = SplitMix64::new(view::generator(self.spec.seed, view.index).next_u64());
        for base in techniques {
            let mut of_technique = SplitMix64::new(rng.next_u64());
            for variant in variants(base, &self.spec.fixed_params, &mut of_technique)? {
                self.variant(view, &renderer, &truth, &variant)?;
            }
        }
        Ok(())
    }

    /// Renders a variant and compares it.
    fn variant(
        &mut self,
        view: &View,
        renderer: &Renderer,
        truth: &Rgba8Image,
        variant: &Variant,
    ) -> Result<(), LabError> {
        let Variant { chosen, label } = variant;
        let info = chosen.technique.info();
        if !info.samples.contains(&view.spec.samples) {
            return Ok(());
        }
        let bound_db = least_psnr_db(chosen, view.spec.samples, view.spec.effects.post.filter);
        let mut finding = self.finding(view, chosen, bound_db);
        let (image, dropped) = match render(renderer, chosen) {
            Ok(Frame { image, dropped }) => (image, dropped),
            Err(error @ TechniqueError::Scene(_)) => return Err(error.into()),
            // What a drawn parameter does not go together with is told; the defaults must run.
            Err(error @ TechniqueError::Conflict { .. }) if !finding.params.is_empty() => {
                self.leave_out(label, &error);
                return Ok(());
            }
            Err(error) if status_of(&error) == Status::Unavailable => {
                self.leave_out(label, &error);
                return Ok(());
            }
            Err(error) => {
                self.count(label, view.index, None, true);
                return self.add_off(finding, Some(error.to_string()), None);
            }
        };
        let psnr = psnr_db(truth, &image)?;
        let psnr = if psnr.is_infinite() { PSNR_IDENTICAL_DB } else { psnr };
        let mut margin_db = psnr - bound_db;
        finding.difference =
            Some(Difference { psnr_db: psnr, max_abs: max_abs(truth, &image)?.into(), flip: None });
        finding.pixels_off = pixels_off(truth, &image, MARKED_FROM)?;
        let mut reason = dropped;
        if reason.is_none() {
            reason = shortfall(REFERENCE, psnr, bound_db);
            if reason.is_some()
                && let Some(settled) = self.settled(view, renderer.settings(), (truth, &image), bound_db)?
            {
                reason = None;
                margin_db = settled.psnr_db.min(PSNR_IDENTICAL_DB) - bound_db;
                finding.pixels_undecided = settled.pixels;
                self.found.undecided += 1;
            }
        }
        finding.margin_db = Some(margin_db);
        self.count(label, view.index, Some(margin_db), reason.is_some());
        if reason.is_some() {
            let picture = marked_sheet(truth, &image, MARKED_FROM)?;
            return self.add_off(finding, reason, Some(&picture));
        }
        if psnr >= PSNR_IDENTICAL_DB {
            return Ok(());
        }
        keep_worst(&mut self.found.nearest, finding, NEAREST_KEPT);
        Ok(())
    }

    /// An image that keeps its bound without pixels that no rule decides; `None` where it does not, and without rays.
    fn settled(
        &self,
        view: &View,
        settings: &Settings,
        images: (&Rgba8Image, &Rgba8Image),
        bound_db: f64,
    ) -> Result<Option<Settled>, LabError> {
        let Some(rays) = &self.rays else { return Ok(None) };
        Ok(settle(rays, &settings.camera, view.spec.samples, images, bound_db)?)
    }

    /// Has rays judge pixels of the reference at one sample, without shadows and indirect light, which rays do not see.
    fn judge_reference(
        &mut self,
        view: &View,
        settings: &Settings,
        reference: &Chosen,
        truth: &Rgba8Image,
    ) -> Result<(), LabError> {
        let Some(rays) = &self.rays else { return Ok(()) };
        let mut plain = Settings { samples: 1, keep_hdr: true, keep_depth: true, ..settings.clone() };
        plain.effects.shadows.method = Shadows::None;
        plain.effects.indirect.method = Indirect::None;
        let renderer = self.renderer(&plain)?;
        let mut prepared = match ready(&renderer, reference) {
            Ok(prepared) => prepared,
            Err(error @ (TechniqueError::Scene(_) | TechniqueError::TooLarge { .. })) => {
                return Err(error.into());
            }
            Err(error) => {
                let finding = self.finding(&plain_view(view), reference, 0.0);
                return self.add_off(finding, Some(error.to_string()), None);
            }
        };
        let (Some(depth), Some(radiance)) = (prepared.depth()?, prepared.hdr_rgba()?) else {
            return Err(LabError::BrokeOff {
                what: REFERENCE.to_owned(),
                reason: "found no depth, expected what it puts on the board".to_owned(),
            });
        };
        let drawn = probe::Drawn { settings: &plain, depth: &depth, radiance: &radiance };
        let mut rng = SplitMix64::new(!view::generator(self.spec.seed, view.index).next_u64());
        let judged = probe::judge(rays, &drawn, self.spec.probes, &mut rng);
        let probes = &mut self.found.probes;
        probes.surfaces += judged.probes.surfaces;
        probes.radiances += judged.probes.radiances;
        probes.unjudged += judged.probes.unjudged;
        probes.off += judged.probes.off;
        let Some((pixel, reason)) = judged.off.first() else { return Ok(()) };
        let mut finding = self.finding(&plain_view(view), reference, 0.0);
        finding.pixels_off = judged.probes.off;
        let reason = format!(
            "rays in f64: pixel {},{} {reason}; {} of {} pixels off",
            pixel[0], pixel[1], judged.probes.off, judged.probes.surfaces
        );
        let image = Rgba8Image::new(truth.width, truth.height, prepared.final_rgba8()?)?;
        let mut marked = image.clone();
        for ([x, y], _) in &judged.off {
            let at = 4 * (*y as usize * image.width as usize + *x as usize);
            // Black or white, whatever is farther from what is there.
            let is_dark = image.pixels[at..at + 3].iter().map(|c| u32::from(*c)).sum::<u32>() < 384;
            marked.pixels[at..at + 3].fill(if is_dark { 255 } else { 0 });
        }
        let picture = marked_sheet(&image, &marked, MARKED_FROM)?;
        self.add_off(finding, Some(reason), Some(&picture))
    }

    fn finding(&self, view: &View, chosen: &Chosen, bound_db: f64) -> Finding {
        Finding {
            view: view.index,
            place: view.place.name().to_owned(),
            technique: chosen.id().to_owned(),
            params: changed(chosen),
            reason: None,
            difference: None,
            bound_db,
            margin_db: None,
            pixels_off: 0,
            pixels_undecided: 0,
            command: compare_command(self.source, &view.spec, chosen),
            picture: None,
        }
    }

    /// Keeps what is off, with its picture.
    fn add_off(
        &mut self,
        mut finding: Finding,
        reason: Option<String>,
        picture: Option<&Rgba8Image>,
    ) -> Result<(), LabError> {
        finding.reason = reason;
        if let Some(picture) = picture {
            finding.picture = (self.album)(&finding, picture)?;
        }
        self.found.off_count += 1;
        keep_worst(&mut self.found.off, finding, self.spec.worst);
        Ok(())
    }

    fn leave_out(&mut self, label: &str, error: &TechniqueError) {
        *self.found.left_out.entry((label.to_owned(), error.to_string())).or_default() += 1;
    }

    /// Counts a comparison.
    fn count(&mut self, label: &str, view: u64, margin_db: Option<f64>, is_off: bool) {
        self.found.comparisons += 1;
        let margins = &mut self.found.margins;
        let place = margins.iter().position(|one| one.technique == label).unwrap_or_else(|| {
            let technique = label.to_owned();
            margins.push(Margin { technique, comparisons: 0, off: 0, least_margin_db: None, view: None });
            margins.len() - 1
        });
        let margin = &mut margins[place];
        margin.comparisons += 1;
        margin.off += u64::from(is_off);
        let is_less = margin.least_margin_db.is_none_or(|least_db| margin_db < Some(least_db));
        if let (Some(margin_db), true) = (margin_db, is_less) {
            (margin.least_margin_db, margin.view) = (Some(margin_db), Some(view));
        }
    }
}

/// What rays judge of a view: one sample a pixel, without shadows and indirect light.
fn plain_view(view: &View) -> View {
    let mut plain = view.clone();
    plain.spec.samples = 1;
    plain.spec.effects.shadows = Default::default();
    plain.spec.effects.indirect = Default::default();
    plain
}

/// A frame of a technique.
struct Frame {
    image: Rgba8Image,
    /// What found no room.
    dropped: Option<String>,
}

/// A technique whose frame has been run.
fn ready(renderer: &Renderer, chosen: &Chosen) -> Result<Prepared, TechniqueError> {
    let mut prepared = renderer.prepare(chosen.technique, &chosen.params)?;
    prepared.run()?;
    Ok(prepared)
}

fn render(renderer: &Renderer, chosen: &Chosen) -> Result<Frame, TechniqueError> {
    let mut prepared = ready(renderer, chosen)?;
    let dropped = prepared.counters()?.iter().find_map(Counter::dropped_text);
    let (width, height) = prepared.size_px();
    let image = Rgba8Image { width, height, pixels: prepared.final_rgba8()? };
    Ok(Frame { image, dropped })
}
