//! `bench dais-fig7`: time of the geometry pass and memory along a camera path, surfaces tessellated to triangles of about one
//! size (Schied and Dachsbacher 2015, Figure 7).

use std::path::PathBuf;
use std::sync::LazyLock;

use afterlight_lab::{Chosen, FrameSpec, LabError, Listener, Session, measure, technique};
use afterlight_measure::Spread;
use afterlight_report::text::grouped;
use afterlight_scene::camera::CameraPath;
use afterlight_techniques::geometry::{MAX_TESSELLATE_PX, MIN_TESSELLATE_PX};
use afterlight_techniques::{Cull, DrawParams};
use serde::{Deserialize, Serialize};

use crate::dais::flight::{
    Flight, Gathered, Tessellation, ViewCell, claim, fly, open, places, ratios, triangles_drawn,
};
use crate::dais::{
    Column, Conditions, Kind, PAPER, PAPER_SAMPLES, Source, as_in_paper, columns, sizes, sources,
};
use crate::kit::{
    Claim, DEFAULT_FRAMES, FULL_HD_PX, Options, Outcome, Specification, all_techniques, paper_data,
};

/// What the experiment is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Share of the frame's width and height, above 0, at most 1.
    pub scale: f64,
    /// Scenes; where there is none, built-in ones with the triangles of the paper's, times the square of `scale`.
    pub scenes: Vec<String>,
    /// Techniques by their ids, or `all`.
    pub techniques: Vec<String>,
    /// Frames measured of each technique after a warm-up frame, 1 to 10,000.
    pub frames: u32,
    /// Samples a pixel, 1, 2, 4, 8 or 16; none for the paper's 8, or the most that the device has below.
    pub samples: Option<u32>,
    /// Camera path, a JSON file; none for a fly-through of the scene.
    pub path: Option<PathBuf>,
    /// Views along the camera path, 1 to 10,000.
    pub views: u32,
    /// What frames look like, at the smaller of the two sizes; `camera`, `samples`, `post` and `view` do not count. Edges of
    /// `tessellate_px`; none for the length that makes the paper's number of triangles.
    pub frame: FrameSpec,
}

impl Default for Spec {
    fn default() -> Spec {
        Spec {
            scale: 1.0,
            scenes: Vec::new(),
            techniques: all_techniques(),
            frames: DEFAULT_FRAMES,
            samples: None,
            path: None,
            views: 16,
            frame: FrameSpec { width: FULL_HD_PX.0, height: FULL_HD_PX.1, ..FrameSpec::default() },
        }
    }
}

impl Specification for Spec {
    const NAME: &'static str = "dais-fig7";
    const SUMMARY: &'static str =
        "deferred attribute interpolation of tessellated surfaces along a camera path";

    fn from_options(options: &Options) -> Spec {
        let own = Spec::default();
        Spec {
            scale: options.scale.unwrap_or(own.scale),
            scenes: options.scenes.clone().unwrap_or(own.scenes),
            techniques: options.techniques.clone().unwrap_or(own.techniques),
            frames: options.frames.unwrap_or(own.frames),
            samples: options.samples,
            path: options.path.clone(),
            views: options.views.unwrap_or(own.views),
            frame: options.frame_at(FULL_HD_PX),
        }
    }

    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError> {
        run(self, listener)
    }
}

impl Spec {
    fn conditions(&self) -> Result<Conditions, LabError> {
        let asked = Conditions {
            scale: self.scale,
            scenes: self.scenes.clone(),
            techniques: self.techniques.clone(),
            frames: self.frames,
            samples: PAPER_SAMPLES,
            path: self.path.clone(),
            views: self.views,
            frame: self.frame.clone(),
        };
        asked.with_samples(self.samples)
    }
}

/// The paper's sizes.
static FIGURE: LazyLock<Figure> = LazyLock::new(|| paper_data(include_str!("paper.json")));

/// What Figure 7 is of.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Figure {
    section: String,
    /// The smaller, then the larger.
    sizes: [PaperSize; 2],
}

/// An image's size, pixels, and the most triangles that the paper's tessellation makes in a view.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PaperSize {
    width: u32,
    height: u32,
    triangles: f64,
}

/// Length of edges where triangles cannot be counted, pixels.
const DEFAULT_EDGE_PX: f32 = 4.0;
/// Views in which triangles are counted to choose the length of edges.
const PROBES: u32 = 4;
/// Lengths that are tried at most.
const TRIALS: usize = 6;
/// How near to the paper's number of triangles is near enough.
const NEAR: f64 = 0.05;

fn run(spec: &Spec, listener: &dyn Listener) -> Result<Outcome, LabError> {
    let asked = &spec.conditions()?;
    let sizes = sizes(asked);
    let columns = columns(asked, &[Kind::Deferred, Kind::Resolve, Kind::List])?;
    let sources = sources(asked, &PAPER.scenes[..1]);
    let mut notes = crate::dais::notes(asked, &sources, sizes[1].width);
    notes.push("patches out of view or facing away make no triangles here; the paper culled none".to_owned());
    let mut gathered = Gathered::new(notes);
    for source in &sources {
        let (session, path) = open(source, &mut sizes[0].clone(), asked, listener)?;
        let mut flights = Vec::new();
        for (frame, paper) in sizes.iter().zip(&FIGURE.sizes) {
            let pixels = |width: u32, height: u32| f64::from(width) * f64::from(height);
            let share = pixels(frame.width, frame.height) / pixels(paper.width, paper.height);
            let target = paper.triangles * share;
            let chosen = choose_edge(&session, &path, frame, target, asked)?;
            gathered.notes.push(edge_note(&chosen));
            let mut frame = frame.clone();
            frame.effects.tessellation.edge_px = Some(chosen.edge_px);
            gathered.tessellation.push(chosen);
            let along = (&session, &path);
            flights.push(fly(Spec::NAME, along, source, &columns, &frame, asked, listener)?);
        }
        session.finish(&sizes[0], listener)?;
        let is_papers = as_in_paper(asked, source, sizes[1].width);
        let claims =
            flights.iter().flat_map(|flight| claims_of(source, &columns, flight, is_papers)).collect();
        gathered.add(flights, &columns, claims);
    }
    let title = "Deferred attribute interpolation of tessellated surfaces";
    gathered.outcome(asked, Spec::NAME, &FIGURE.section, title, listener)
}

/// The length of edges that makes about `target` triangles in the view that has most of them.
fn choose_edge(
    session: &Session,
    path: &CameraPath,
    frame: &FrameSpec,
    target: f64,
    asked: &Conditions,
) -> Result<Tessellation, LabError> {
    let of = |edge_px: f32, triangles: Option<u64>| Tessellation {
        width: frame.width,
        height: frame.height,
        edge_px,
        triangles,
        paper_triangles: target,
    };
    if let Some(edge_px) = asked.frame.effects.tessellation.edge_px {
        return Ok(of(edge_px, None));
    }
    let (mut edge_px, mut triangles) = (DEFAULT_EDGE_PX, None);
    for _ in 0..TRIALS {
        triangles = count_triangles(session, path, frame, edge_px, asked)?;
        let Some(next) = triangles.and_then(|found| next_edge(edge_px, found as f64, target)) else { break };
        edge_px = next;
    }
    Ok(of(edge_px, triangles))
}

/// A better length; none where this one is near enough or no other is to be had. Triangles go by the inverse square of their
/// edges, but for those that are too small to be cut.
fn next_edge(edge_px: f32, triangles: f64, target: f64) -> Option<f32> {
    if (triangles / target - 1.0).abs() <= NEAR {
        return None;
    }
    let next = (f64::from(edge_px) * (triangles / target).sqrt()) as f32;
    let next = next.clamp(MIN_TESSELLATE_PX, MAX_TESSELLATE_PX);
    (next != edge_px).then_some(next)
}

/// Most triangles drawn in some views along the path; none where the device does not tessellate or does not count.
fn count_triangles(
    session: &Session,
    path: &CameraPath,
    frame: &FrameSpec,
    edge_px: f32,
    asked: &Conditions,
) -> Result<Option<u64>, LabError> {
    // Any technique that tessellates draws the same triangles; one sample a pixel is the least work.
    let mut counter = Chosen::new(technique("technique", "tiled")?);
    counter.params.typed_mut::<DrawParams>().cull = Cull::None;
    let mut most = None;
    for at in places(path, asked.views.min(PROBES)) {
        let (renderer, workload) = session.with_settings(|settings| {
            (settings.width_px, settings.height_px) = (frame.width, frame.height);
            settings.effects.tessellation.edge_px = Some(edge_px);
            settings.camera = path.at(at);
        })?;
        let measured = measure(&renderer, &counter, &workload, 0, || {})?;
        most = most.max(triangles_drawn(&measured.result));
    }
    Ok(most)
}

fn edge_note(chosen: &Tessellation) -> String {
    let Tessellation { width, height, edge_px, triangles, paper_triangles } = chosen;
    let made = triangles.map_or_else(
        || "their triangles are in the table".to_owned(),
        |triangles| format!("up to {} triangles", grouped(triangles)),
    );
    format!(
        "{width}×{height}: edges of {edge_px:.2} pixels, {made} (the paper's, by pixels: {})",
        grouped(*paper_triangles as u64)
    )
}

/// Memory and time over deferred shading's, view by view.
fn claims_of(source: &Source, columns: &[Column], flight: &Flight, as_in_paper: bool) -> Vec<Claim> {
    let width = flight.width_px();
    let of_column = |column: &Column| {
        let over = |value: fn(&ViewCell) -> Option<f64>| {
            ratios(&flight.values(column.kind, value), &flight.values(Kind::Deferred, value))
        };
        let memory = format!("at {width} pixels wide, memory is less than deferred shading's in every view");
        let time = format!(
            "at {width} pixels wide, geometry pass over deferred shading's (the paper: longer at 1920, about as long at 3840)"
        );
        let found = |text: &str, ratios: &[f64], met: fn(Spread) -> Option<bool>| {
            claim(text, source.title(), column.label(), ratios, None, as_in_paper, met)
        };
        [
            found(&memory, &over(|cell| cell.sizes.total_mib), |ratio| Some(ratio.max < 1.0)),
            found(&time, &over(|cell| cell.times.geometry_ms), |_| None),
        ]
    };
    columns.iter().filter(|column| column.kind != Kind::Deferred).flat_map(of_column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dais::flight::tests::flight;

    #[test]
    fn edges_go_by_the_root_of_the_triangles() {
        assert_eq!(next_edge(4.0, 4e6, 1e6), Some(8.0));
        assert_eq!(next_edge(4.0, 1e6, 4e6), Some(2.0));
        assert_eq!(next_edge(4.0, 1.04e6, 1e6), None, "near enough");
        assert_eq!(next_edge(2.0, 1e6, 9e6), Some(MIN_TESSELLATE_PX));
        assert_eq!(next_edge(MIN_TESSELLATE_PX, 1e6, 9e6), None, "nothing shorter is to be had");
    }

    #[test]
    fn memory_is_less_only_where_every_view_needs_less() {
        let source = Source { source: "sponza.gltf".into(), paper: Some(&PAPER.scenes[0]), stands_in: false };
        let columns: Vec<Column> =
            [Kind::Deferred, Kind::Cache].into_iter().map(|kind| Column { kind, setup: None }).collect();
        let claims = |views: &[(f64, u64)]| {
            let flight = flight(100, &[(Kind::Deferred, &[(2.0, 100), (2.0, 100)]), (Kind::Cache, views)]);
            claims_of(&source, &columns, &flight, true)
        };
        let found = claims(&[(4.0, 50), (3.0, 99)]);
        assert_eq!((found[0].met, found[0].greatest), (Some(true), Some(0.99)));
        assert_eq!((found[1].met, found[1].ratio), (None, Some(1.75)), "times are not judged");
        assert_eq!(claims(&[(4.0, 50), (3.0, 100)])[0].met, Some(false));
    }
}
