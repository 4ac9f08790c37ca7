//! `bench antialiasing`: how near each way of anti-aliasing comes to an image of 8×8 samples a pixel, and what it stores
//! and takes for it.
//!
//! Detectors of edges are swept over thresholds, so that two can be compared where their images are equally near.

use afterlight_image::{Rgba8Image, encode_png};
use afterlight_lab::{
    FrameSpec, LabError, Listener, Measured, Session, Setup, differences, measure_setups, technique,
};
use afterlight_measure::{RunResult, SCHEMA, Spread, Status};
use afterlight_renderer::supersample;
use afterlight_report::text::{self, number_text};
use afterlight_report::{Picture, bytes_text, ms_text};
use afterlight_techniques::Post;
use serde::{Deserialize, Serialize};

use crate::kit::{
    DEFAULT_FRAMES, FILTERS, FULL_HD_PX, Options, Outcome, Part, Row, Specification, Table, at_size,
    broken_off, check_run, counter, default_scenes, notes_text, reasons_text, sample_counts_up_to,
};

/// What the experiment is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Share of the frame's width and height, above 0, at most 1.
    pub scale: f64,
    /// Scenes.
    pub scenes: Vec<String>,
    /// Numbers of samples a pixel, ascending.
    pub sample_counts: Vec<u32>,
    /// Frames measured of each technique after a warm-up frame, 1 to 10,000.
    pub frames: u32,
    /// What frames look like; `samples`, `post` and `view` do not count.
    pub frame: FrameSpec,
}

impl Default for Spec {
    fn default() -> Spec {
        Spec {
            scale: 1.0,
            scenes: default_scenes(),
            sample_counts: vec![4, 8],
            frames: DEFAULT_FRAMES,
            frame: FrameSpec { width: FULL_HD_PX.0, height: FULL_HD_PX.1, ..FrameSpec::default() },
        }
    }
}

impl Specification for Spec {
    const NAME: &'static str = "antialiasing";
    const SUMMARY: &'static str = "nearness to a supersampled image against samples, time and memory";

    fn from_options(options: &Options) -> Spec {
        let own = Spec::default();
        Spec {
            scale: options.scale.unwrap_or(own.scale),
            scenes: options.scenes.clone().unwrap_or(own.scenes),
            sample_counts: sample_counts_up_to(options.samples, &own.sample_counts),
            frames: options.frames.unwrap_or(own.frames),
            frame: options.frame_at(FULL_HD_PX),
        }
    }

    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError> {
        run(self, listener)
    }
}

/// Width and height of the reference over the image's: 64 samples a pixel.
const FACTOR: u32 = 8;

/// What images are compared to, for records.
const REFERENCE: &str = "forward, 8×8 supersampled";

/// Label of the image without anti-aliasing.
const NONE: &str = "forward 1x";

/// Thresholds at which detectors of edges are measured: shares of the distance, and one less the cosine.
const THRESHOLDS: [&str; 6] = ["0.001", "0.003", "0.01", "0.03", "0.1", "0.3"];

/// Shares of the blocks that a view needs, percent.
const BLOCKS_PERCENT: [u64; 4] = [0, 25, 50, 100];

/// Width and height of what a report shows of an image, pixels at most, and how much larger it shows them.
const CROP_PX: (u32, u32) = (128, 72);
const CROP_ENLARGED: u32 = 4;

/// A way of anti-aliasing with what it was measured at.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Cell {
    column: String,
    technique: String,
    samples: u32,
    post: &'static str,
    /// The detector of edges and its threshold, where it is a point of a sweep.
    detector: Option<&'static str>,
    threshold: Option<f64>,
    status: Status,
    reason: Option<String>,
    /// Surfaces that are stored for shading, mean of the pixels; none where shading stores none.
    stored_samples_a_pixel: Option<f64>,
    flip: Option<f64>,
    /// By how much the FLIP error is below that of the image without anti-aliasing.
    flip_below_percent: Option<f64>,
    psnr_db: Option<f64>,
    frame_ms: Option<Spread>,
    technique_bytes: Option<u64>,
}

/// Two detectors where their images are equally near to the reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct AtEqualFlip {
    scene: String,
    samples: u32,
    /// Threshold of `edges`.
    threshold: f64,
    flip: f64,
    edges_samples_a_pixel: f64,
    /// Interpolated in the sweep of `depth-edges`; none where that does not come to this FLIP error.
    depth_edges_samples_a_pixel: Option<f64>,
    /// The least FLIP error of that sweep.
    depth_edges_least_flip: Option<f64>,
}

impl AtEqualFlip {
    /// Whether `edges` comes nearer to the reference than any point of the other sweep.
    fn is_nearer_than_any(&self) -> bool {
        self.depth_edges_least_flip.is_some_and(|least| self.flip < least)
    }
}

/// A filter after shading against none.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct PostVerdict {
    scene: String,
    post: &'static str,
    flip: f64,
    flip_none: f64,
    flip_below_percent: f64,
    reduces: bool,
}

/// What `bench antialiasing` writes as JSON.
#[derive(Serialize)]
struct Antialiasing {
    schema: u32,
    experiment: &'static str,
    scale: f64,
    reference: &'static str,
    notes: Vec<String>,
    rows: Vec<Row<Cell>>,
    at_equal_flip: Vec<AtEqualFlip>,
    post: Vec<PostVerdict>,
    /// Whether FXAA and SMAA bring every scene nearer to the reference; none at another size than the experiment's.
    post_holds: Option<bool>,
}

/// A point of a sweep: the detector of edges and its threshold; none for what is no point of any.
type Sweep = Option<(&'static str, &'static str)>;

/// A set-up, and the sweep that it is a point of.
struct Column {
    setup: Setup,
    sweep: Sweep,
}

fn run(spec: &Spec, listener: &dyn Listener) -> Result<Outcome, LabError> {
    check_run(spec.scale, spec.frames, &spec.frame)?;
    let frame = at_size(&spec.frame, spec.scale);
    let is_full_size = (frame.width, frame.height) == FULL_HD_PX;
    let notes = notes(&frame);
    let (mut rows, mut sections, mut equal, mut posts, mut failed) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), None);
    for source in &spec.scenes {
        let session = Session::open(source, &frame, false, listener)?;
        let found = scene(spec, &frame, &session, listener)?;
        session.finish(&frame, listener)?;
        failed = failed.or(found.failed);
        listener.tell(&found.text);
        rows.extend(found.rows);
        sections.extend(found.sections);
        equal.extend(found.equal);
        posts.extend(found.posts);
    }
    let post_holds = post_holds(&posts, is_full_size);
    listener.tell(&verdict_text(&equal, &posts, post_holds, &notes));
    let failed = failed.or_else(|| {
        (post_holds == Some(false))
            .then(|| "antialiasing: a filter after shading does not reduce FLIP".to_owned())
    });
    let json = serde_json::to_value(&Antialiasing {
        schema: SCHEMA,
        experiment: Spec::NAME,
        scale: spec.scale,
        reference: REFERENCE,
        notes,
        rows,
        at_equal_flip: equal,
        post: posts,
        post_holds,
    })?;
    Ok(Outcome { title: "Anti-aliasing", json, sections, failed })
}

/// What a scene gave.
struct OfScene {
    text: String,
    rows: Vec<Row<Cell>>,
    sections: Vec<Part>,
    equal: Vec<AtEqualFlip>,
    posts: Vec<PostVerdict>,
    failed: Option<String>,
}

fn scene(
    spec: &Spec,
    frame: &FrameSpec,
    session: &Session,
    listener: &dyn Listener,
) -> Result<OfScene, LabError> {
    let columns = columns(spec, session, listener)?;
    let (setups, sweeps): (Vec<Setup>, Vec<_>) =
        columns.into_iter().map(|column| (column.setup, column.sweep)).unzip();
    let truth = reference(session, listener)?;
    let mut measured =
        measure_setups(&session.renderer, &setups, &session.workload, spec.frames, listener)?.measured;
    let task = listener.task("comparing images", 0);
    let images: Vec<Option<&Rgba8Image>> = measured.iter().map(|one| one.image.as_ref()).collect();
    let differences = differences(&truth, &images)?;
    for (one, difference) in measured.iter_mut().zip(differences) {
        one.result.difference = difference;
    }
    drop(task);

    let cells = cells(&setups, &sweeps, &measured, u64::from(frame.width) * u64::from(frame.height));
    let pictures = match listener.wants_pictures() {
        true => pictures(&setups, &cells, &measured, &truth)?,
        false => Vec::new(),
    };
    let results: Vec<RunResult> = measured.into_iter().map(|one| one.result).collect();
    let failed = broken_off(setups.iter().map(|setup| setup.label.as_str()).zip(&results));
    let equal = at_equal_flip(&session.scene.name, &cells);
    let posts = post_verdicts(&session.scene.name, &cells);
    let table = Table {
        setups: setups.iter().collect(),
        remarks: cells.iter().map(remark).collect(),
        results,
        cells: cells.into_iter().map(|cell| vec![cell]).collect(),
    };
    let heading = format!("{}, ", session.scene.name);
    let mut sections =
        table.parts(session, frame, spec.frames, REFERENCE, &heading, &notes(frame).join(". "));
    if let Some(last) = sections.last_mut() {
        last.pictures = pictures;
    }
    Ok(OfScene {
        text: table_text(session, frame, spec.frames, &table),
        rows: table.rows(session, frame, spec.frames, REFERENCE),
        sections,
        equal,
        posts,
        failed,
    })
}

/// The image that anti-aliasing aims at.
fn reference(session: &Session, listener: &dyn Listener) -> Result<Rgba8Image, LabError> {
    let task = listener.task("supersampling", 0);
    let renderer = &session.renderer;
    let forward = technique("technique", "forward")?;
    let (device, settings) = (renderer.device(), renderer.settings());
    let pixels = supersample::reference_rgba8(device, renderer.scene(), settings, forward, FACTOR)?;
    drop(task);
    Ok(Rgba8Image::new(settings.width_px, settings.height_px, pixels)?)
}

/// The columns: without anti-aliasing, filters after shading, and every way of several samples.
fn columns(spec: &Spec, session: &Session, listener: &dyn Listener) -> Result<Vec<Column>, LabError> {
    let mut columns = vec![Column { setup: Setup::new(NONE, 1, "forward", &[])?, sweep: None }];
    for post in Post::ALL.iter().copied().filter(|post| *post != Post::None) {
        let setup = Setup::new(format!("{NONE}, {}", post.name()), 1, "forward", &[])?.post(post);
        columns.push(Column { setup, sweep: None });
    }
    for &samples in &spec.sample_counts {
        for technique in ["forward", "deferred-ssaa", "deferred-msaa", "deferred-dedup"] {
            let setup = Setup::new(format!("{technique} {samples}x"), samples, technique, &[])?;
            columns.push(Column { setup, sweep: None });
        }
        columns.extend(list_columns(samples, blocks_needed(session, samples, listener)?)?);
    }
    Ok(columns)
}

/// Dynamic blocks that lists without a filter need; none where the device does not tell.
fn blocks_needed(session: &Session, samples: u32, listener: &dyn Listener) -> Result<u64, LabError> {
    let setup = [Setup::new("blocks", samples, "gbuffer-list", &[])?];
    let found = measure_setups(&session.renderer, &setup, &session.workload, 0, listener)?;
    Ok(counter(&found.measured[0].result, "blocks_needed").unwrap_or(0))
}

fn list_columns(samples: u32, blocks_needed: u64) -> Result<Vec<Column>, LabError> {
    let list = |what: String, params: &[(&str, &str)]| {
        let label = format!("list {samples}x{what}");
        Setup::new(label, samples, "gbuffer-list", params)
    };
    let mut columns = vec![Column { setup: list(String::new(), &[])?, sweep: None }];
    for filter in FILTERS {
        columns.push(Column { setup: list(format!(", {}", filter.name), filter.params)?, sweep: None });
    }
    for detector in ["depth-edges", "edges"] {
        for threshold in THRESHOLDS {
            let params = [("filter", detector), ("edge-threshold", threshold)];
            let setup = list(format!(", {detector} {threshold}"), &params)?;
            columns.push(Column { setup, sweep: Some((detector, threshold)) });
        }
    }
    for percent in BLOCKS_PERCENT {
        let blocks = (blocks_needed * percent / 100).to_string();
        let setup = list(format!(", {percent}% of blocks"), &[("blocks", &blocks)])?;
        columns.push(Column { setup, sweep: None });
    }
    Ok(columns)
}

fn cells(setups: &[Setup], sweeps: &[Sweep], measured: &[Measured], pixels: u64) -> Vec<Cell> {
    let flip = |one: &Measured| one.result.difference.and_then(|difference| difference.flip);
    let flip_none =
        setups.iter().position(|setup| setup.label == NONE).and_then(|index| flip(&measured[index]));
    let cell = |((setup, sweep), one): ((&Setup, &Sweep), &Measured)| {
        let result = &one.result;
        let has_figures = result.status == Status::Ok;
        Cell {
            column: setup.label.clone(),
            technique: result.technique.clone(),
            samples: setup.samples,
            post: setup.post.name(),
            detector: sweep.map(|(detector, _)| detector),
            threshold: sweep.and_then(|(_, threshold)| threshold.parse().ok()),
            status: result.status,
            reason: result.reason.clone(),
            stored_samples_a_pixel: stored_samples(setup, result, pixels).filter(|_| has_figures),
            flip: flip(one),
            flip_below_percent: flip(one).zip(flip_none).map(|(flip, none)| below_percent(flip, none)),
            psnr_db: result.difference.map(|difference| difference.psnr_db),
            frame_ms: result.frame_ms,
            technique_bytes: result.memory.as_ref().map(|memory| memory.technique_bytes),
        }
    };
    setups.iter().zip(sweeps).zip(measured).map(cell).collect()
}

/// By how many percent an error is below another.
fn below_percent(error: f64, other: f64) -> f64 {
    if other > 0.0 { (1.0 - error / other) * 100.0 } else { 0.0 }
}

/// Surfaces that a technique stores for shading, mean of the pixels.
fn stored_samples(setup: &Setup, result: &RunResult, pixels: u64) -> Option<f64> {
    match setup.chosen.id() {
        "forward" => None,
        "gbuffer-list" => {
            let (needed, capacity) = (counter(result, "blocks_needed")?, counter(result, "blocks_capacity")?);
            Some(1.0 + needed.min(capacity) as f64 / pixels as f64)
        }
        _ => Some(f64::from(setup.samples)),
    }
}

/// Samples a pixel at which a curve of (FLIP, samples) comes to a FLIP error, straight between its points; none beyond.
fn samples_at(curve: &[(f64, f64)], flip: f64) -> Option<f64> {
    let mut curve = curve.to_vec();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let between = curve.windows(2).find(|pair| pair[0].0 <= flip && flip <= pair[1].0)?;
    let [(low, at_low), (high, at_high)] = [between[0], between[1]];
    let share = if high > low { (flip - low) / (high - low) } else { 0.0 };
    Some(at_low + share * (at_high - at_low))
}

/// The sweep of `edges` beside that of `depth-edges` at the same FLIP error, which ends where nothing is filtered.
fn at_equal_flip(scene: &str, cells: &[Cell]) -> Vec<AtEqualFlip> {
    let point = |cell: &Cell| Some((cell.flip?, cell.stored_samples_a_pixel?));
    let mut found = Vec::new();
    for cell in cells.iter().filter(|cell| cell.detector == Some("edges")) {
        let Some((flip, edges_samples_a_pixel)) = point(cell) else { continue };
        let unfiltered = format!("list {}x", cell.samples);
        let is_other = |other: &&Cell| {
            other.samples == cell.samples
                && (other.detector == Some("depth-edges") || other.column == unfiltered)
        };
        let curve: Vec<(f64, f64)> = cells.iter().filter(is_other).filter_map(point).collect();
        found.push(AtEqualFlip {
            scene: scene.to_owned(),
            samples: cell.samples,
            threshold: cell.threshold.unwrap_or(0.0),
            flip,
            edges_samples_a_pixel,
            depth_edges_samples_a_pixel: samples_at(&curve, flip),
            depth_edges_least_flip: curve.iter().map(|point| point.0).min_by(f64::total_cmp),
        });
    }
    found
}

fn post_verdicts(scene: &str, cells: &[Cell]) -> Vec<PostVerdict> {
    let Some(flip_none) = cells.iter().find(|cell| cell.column == NONE).and_then(|cell| cell.flip) else {
        return Vec::new();
    };
    let verdict = |cell: &Cell| {
        let flip = cell.flip?;
        Some(PostVerdict {
            scene: scene.to_owned(),
            post: cell.post,
            flip,
            flip_none,
            flip_below_percent: below_percent(flip, flip_none),
            reduces: flip < flip_none,
        })
    };
    cells.iter().filter(|cell| cell.post != Post::None.name()).filter_map(verdict).collect()
}

/// Whether FXAA and SMAA reduce FLIP on every scene.
fn post_holds(posts: &[PostVerdict], is_full_size: bool) -> Option<bool> {
    let judged: Vec<&PostVerdict> = posts.iter().filter(|one| ["fxaa", "smaa"].contains(&one.post)).collect();
    (is_full_size && !judged.is_empty()).then(|| judged.iter().all(|one| one.reduces))
}

fn notes(frame: &FrameSpec) -> Vec<String> {
    let mut notes = vec![
        "FLIP and PSNR to forward at 8×8 times the pixels, radiance averaged, then tone-mapped".to_owned(),
        "stored samples: surfaces that are kept for shading, mean of the pixels; with a bound on blocks, those that found one".to_owned(),
    ];
    if (frame.width, frame.height) != FULL_HD_PX {
        notes.push(format!("{}×{} instead of {}×{}", frame.width, frame.height, FULL_HD_PX.0, FULL_HD_PX.1));
    }
    notes
}

fn remark(cell: &Cell) -> Option<String> {
    let below = format!("FLIP {:.1}% below {NONE}", cell.flip_below_percent?);
    Some(match cell.stored_samples_a_pixel {
        Some(samples) => format!("{below}; {samples:.3} stored samples a pixel"),
        None => below,
    })
}

fn table_text(session: &Session, frame: &FrameSpec, frames: u32, table: &Table<'_, Cell>) -> String {
    let heading = ["column", "samples stored", "FLIP", "below none", "PSNR dB", "frame ms", "memory"];
    let mut printed = text::table(&heading, 1);
    // What did not run is told under the table.
    for cell in table.cells.iter().flatten().filter(|cell| cell.status == Status::Ok) {
        let dash = || "–".to_owned();
        printed.add_row([
            cell.column.clone(),
            number_text(cell.stored_samples_a_pixel, 3),
            number_text(cell.flip, 5),
            cell.flip_below_percent.map_or_else(dash, |percent| format!("{percent:.1}%")),
            number_text(cell.psnr_db, 2),
            cell.frame_ms.map_or_else(dash, |ms| ms_text(ms.median)),
            cell.technique_bytes.map_or_else(dash, bytes_text),
        ]);
    }
    format!(
        "antialiasing: {} on {} ({}), {}×{}, {} lights, median of {frames} frame(s) in turn; images compared to {REFERENCE}\n\n{printed}\n{}\n",
        session.scene.name,
        session.device.name,
        session.device.kind,
        frame.width,
        frame.height,
        session.scene.lights,
        reasons_text(&table.setups, &table.results)
    )
}

fn verdict_text(
    equal: &[AtEqualFlip],
    posts: &[PostVerdict],
    post_holds: Option<bool>,
    notes: &[String],
) -> String {
    let mut printed =
        text::table(&["scene", "samples", "edges threshold", "FLIP", "edges stores", "depth-edges would"], 1);
    for one in equal {
        printed.add_row([
            one.scene.clone(),
            one.samples.to_string(),
            one.threshold.to_string(),
            format!("{:.5}", one.flip),
            format!("{:.3}", one.edges_samples_a_pixel),
            number_text(one.depth_edges_samples_a_pixel, 3),
        ]);
    }
    let compared: Vec<(f64, f64)> = equal
        .iter()
        .filter_map(|one| Some((one.edges_samples_a_pixel, one.depth_edges_samples_a_pixel?)))
        .collect();
    let fewer = compared.iter().filter(|(edges, depth_edges)| edges < depth_edges).count();
    let nearer = equal.iter().filter(|one| one.is_nearer_than_any()).count();
    let posts: String = posts
        .iter()
        .map(|one| {
            let PostVerdict { scene, post, flip, flip_none, flip_below_percent, .. } = one;
            format!(
                "{scene}: {post} changes FLIP from {flip_none:.5} to {flip:.5}, {:+.1}%\n",
                -flip_below_percent
            )
        })
        .collect();
    let holds = match post_holds {
        Some(true) => "holds",
        Some(false) => "does not hold",
        None => "not judged at this size",
    };
    let notes = notes_text(notes);
    format!(
        "{printed}\nat equal FLIP `edges` stores fewer samples than `depth-edges` in {fewer} of {} points; in {nearer} more its FLIP is below any that `depth-edges` comes to\n{posts}FXAA and SMAA reduce FLIP on every scene: {holds}\n{notes}",
        compared.len()
    )
}

/// What a report shows: the part of the image that suffers most without anti-aliasing, enlarged.
fn pictures(
    setups: &[Setup],
    cells: &[Cell],
    measured: &[Measured],
    truth: &Rgba8Image,
) -> Result<Vec<Picture>, LabError> {
    let none = setups.iter().position(|setup| setup.label == NONE).and_then(|at| measured[at].image.as_ref());
    let Some(none) = none else { return Ok(Vec::new()) };
    let at_px = busiest_px(none, truth);
    let shown = |label: &str, image: &Rgba8Image, caption: String| {
        Ok::<_, LabError>(Picture {
            technique: label.to_owned(),
            image_png: encode_png(&enlarged(image, at_px))?,
            difference_png: None,
            difference_caption: caption,
        })
    };
    let where_px = format!("pixels from ({}, {}), {CROP_ENLARGED} times as large", at_px.0, at_px.1);
    let mut all = vec![shown(REFERENCE, truth, where_px)?];
    for (cell, one) in cells.iter().zip(measured) {
        if let Some(image) = &one.image {
            all.push(shown(&cell.column, image, remark(cell).unwrap_or_default())?);
        }
    }
    Ok(all)
}

/// Size of the part that is shown, pixels.
fn crop_px(image: &Rgba8Image) -> (u32, u32) {
    (CROP_PX.0.min(image.width), CROP_PX.1.min(image.height))
}

/// The upper left corner of the part in which two images of one size differ most, among parts side by side.
fn busiest_px(image: &Rgba8Image, other: &Rgba8Image) -> (u32, u32) {
    let (width, height) = crop_px(image);
    let difference = |left: u32, top: u32| -> u64 {
        let rows = top..top + height;
        let bytes = rows.flat_map(|y| {
            let first = 4 * (y as usize * image.width as usize + left as usize);
            first..first + 4 * width as usize
        });
        bytes.map(|at| u64::from(image.pixels[at].abs_diff(other.pixels[at]))).sum()
    };
    let corners = (0..image.height / height)
        .flat_map(|row| (0..image.width / width).map(move |column| (column * width, row * height)));
    corners.max_by_key(|&(left, top)| difference(left, top)).unwrap_or((0, 0))
}

/// A part of an image, every pixel a square.
fn enlarged(image: &Rgba8Image, (left, top): (u32, u32)) -> Rgba8Image {
    let (width, height) = crop_px(image);
    let (width, height) = (width * CROP_ENLARGED, height * CROP_ENLARGED);
    let mut pixels = Vec::with_capacity(4 * width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let (x, y) = ((left + x / CROP_ENLARGED) as usize, (top + y / CROP_ENLARGED) as usize);
            let first = 4 * (y * image.width as usize + x);
            pixels.extend_from_slice(&image.pixels[first..first + 4]);
        }
    }
    Rgba8Image { width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_measure::Difference;

    fn measured(setup: &Setup, flip: f64, needed: u64) -> Measured {
        let mut result = RunResult::without_figures(setup.chosen.id(), Status::Ok, "");
        result.reason = None;
        result.counters.insert("blocks_needed".into(), needed.into());
        result.counters.insert("blocks_capacity".into(), 1000.into());
        result.difference = Some(Difference { psnr_db: 30.0, max_abs: 3, flip: Some(flip) });
        Measured { result, image: None, radiance: None }
    }

    #[test]
    fn curves_are_straight_between_points_and_end() {
        let curve = [(0.4, 1.0), (0.1, 3.0), (0.2, 2.0)];
        assert_eq!(samples_at(&curve, 0.1), Some(3.0));
        assert!((samples_at(&curve, 0.3).expect("between") - 1.5).abs() < 1e-12);
        assert_eq!(samples_at(&curve, 0.05), None);
        assert_eq!(samples_at(&curve, 0.5), None);
        assert_eq!(samples_at(&curve[..1], 0.4), None);
        // Two points of one error: no division by nothing.
        assert_eq!(samples_at(&[(0.2, 1.0), (0.2, 3.0)], 0.2), Some(1.0));
    }

    #[test]
    fn lists_store_what_found_a_block() {
        let list = Setup::new("list 4x", 4, "gbuffer-list", &[]).expect("known");
        let stored = |needed| stored_samples(&list, &measured(&list, 0.1, needed).result, 2000);
        assert_eq!(stored(500), Some(1.25));
        assert_eq!(stored(5000), Some(1.5), "the rest was dropped");
        let of = |technique: &str| {
            let setup = Setup::new("", 4, technique, &[]).expect("known");
            stored_samples(&setup, &measured(&setup, 0.1, 0).result, 2000)
        };
        assert_eq!((of("deferred-ssaa"), of("forward")), (Some(4.0), None));
    }

    #[test]
    fn filters_are_judged_against_none_at_full_size() {
        let setups = [
            Setup::new(NONE, 1, "forward", &[]).expect("known"),
            Setup::new("fxaa", 1, "forward", &[]).expect("known").post(Post::Fxaa),
            Setup::new("smaa", 1, "forward", &[]).expect("known").post(Post::Smaa),
        ];
        let judge = |flips: [f64; 3]| {
            let measured: Vec<Measured> =
                setups.iter().zip(flips).map(|(setup, flip)| measured(setup, flip, 0)).collect();
            post_verdicts("s", &cells(&setups, &[None, None, None], &measured, 100))
        };
        let good = judge([0.4, 0.3, 0.1]);
        assert_eq!(good.iter().map(|one| one.post).collect::<Vec<_>>(), ["fxaa", "smaa"]);
        assert!((good[1].flip_below_percent - 75.0).abs() < 1e-9);
        assert_eq!((post_holds(&good, true), post_holds(&good, false)), (Some(true), None));
        assert_eq!(post_holds(&judge([0.4, 0.4, 0.1]), true), Some(false));
    }

    #[test]
    fn detectors_are_compared_at_equal_error() {
        let (setups, sweeps): (Vec<Setup>, Vec<_>) = list_columns(4, 1000)
            .expect("known")
            .into_iter()
            .map(|column| (column.setup, column.sweep))
            .unzip();
        // `edges` comes to each error with half of the blocks.
        let measured: Vec<Measured> = setups
            .iter()
            .zip(&sweeps)
            .map(|(setup, sweep)| match sweep {
                Some((detector, threshold)) => {
                    let threshold: f64 = threshold.parse().expect("a number");
                    let blocks = 800.0 * (1.0 - threshold);
                    let share = if *detector == "edges" { 0.5 } else { 1.0 };
                    measured(setup, 0.1 + threshold, (share * blocks) as u64)
                }
                None => measured(setup, 0.1, 1000),
            })
            .collect();
        let equal = at_equal_flip("s", &cells(&setups, &sweeps, &measured, 1000));
        assert_eq!(equal.len(), THRESHOLDS.len());
        for one in equal {
            let other = one.depth_edges_samples_a_pixel.expect("within the sweep");
            assert!(((other - 1.0) / (one.edges_samples_a_pixel - 1.0) - 2.0).abs() < 0.01, "{other}");
        }
    }

    #[test]
    fn the_part_that_differs_most_is_shown() {
        let black = Rgba8Image { width: 300, height: 150, pixels: vec![0; 4 * 300 * 150] };
        let mut other = black.clone();
        other.pixels[4 * (80 * 300 + 130)] = 200;
        assert_eq!(busiest_px(&black, &other), (128, 72));
        let part = enlarged(&other, (128, 72));
        assert_eq!((part.width, part.height), (512, 288));
        assert_eq!(part.pixels[4 * (8 * 4 * 512 + 2 * 4)], 200);
        let small = Rgba8Image { width: 3, height: 2, pixels: vec![7; 24] };
        assert_eq!(busiest_px(&small, &small), (0, 0));
        assert_eq!(enlarged(&small, (0, 0)).width, 12);
    }
}
