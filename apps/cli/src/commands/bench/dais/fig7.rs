//! `bench dais-fig7`: time of the geometry pass and memory along a camera path, surfaces tessellated to triangles of about one
//! size (Schied and Dachsbacher 2015, Figure 7).

use afterlight_measure::Spread;
use afterlight_scene::camera::CameraPath;
use afterlight_techniques::Params;
use afterlight_techniques::geometry::{MAX_TESSELLATE_PX, MIN_TESSELLATE_PX};
use serde::Serialize;

use super::flight::{Flight, Gathered, ViewCell, claim, fly, open, places, ratios, triangles_drawn};
use super::{
    Claim, Column, Kind, PAPER_PX, PAPER_SCENES, Source, as_in_paper, columns, sizes, sources, with_samples,
};
use crate::args::{BenchArgs, CommonArgs};
use crate::commands::bench::{Experiment, FULL_HD_PX, Outcome};
use crate::failure::Failure;
use crate::frames;
use crate::progress::Progress;
use crate::session::{Chosen, Session, technique};
use crate::text;

/// The experiment.
pub(in crate::commands::bench) const EXPERIMENT: Experiment = Experiment {
    name: "dais-fig7",
    summary: "deferred attribute interpolation of tessellated surfaces along a camera path",
    run,
};

/// The paper's sizes, pixels, and the most triangles that its tessellation makes in a view.
const PAPER_TRIANGLES: [((u32, u32), f64); 2] = [(FULL_HD_PX, 13e6), (PAPER_PX, 26e6)];
/// Length of edges where triangles cannot be counted, pixels.
const DEFAULT_EDGE_PX: f32 = 4.0;
/// Views in which triangles are counted to choose the length of edges.
const PROBES: u32 = 4;
/// Lengths that are tried at most.
const TRIALS: usize = 6;
/// How near to the paper's number of triangles is near enough.
const NEAR: f64 = 0.05;

/// The length of edges of a size, and what it makes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Tessellation {
    width: u32,
    height: u32,
    edge_px: f32,
    /// Most triangles drawn in the views that were counted; none where the device does not count or `--tessellate` was given.
    triangles: Option<u64>,
    /// The paper's, scaled by the image's pixels.
    paper_triangles: f64,
}

fn run(args: &BenchArgs, progress: &Progress) -> Result<Outcome, Failure> {
    let args = &with_samples(args)?;
    let sizes = sizes(args);
    let columns = columns(args, &[Kind::Deferred, Kind::Resolve, Kind::List])?;
    let sources = sources(args, &PAPER_SCENES[..1]);
    let mut notes = super::notes(args, &sources, sizes[1].width);
    notes.push("patches out of view or facing away make no triangles here; the paper culled none".to_owned());
    let mut gathered = Gathered::new(notes);
    for source in &sources {
        let (session, path) = open(source, &mut sizes[0].clone(), args, progress)?;
        let mut flights = Vec::new();
        for (common, (paper_px, paper_triangles)) in sizes.iter().zip(PAPER_TRIANGLES) {
            let pixels = |(width, height): (u32, u32)| f64::from(width) * f64::from(height);
            let target = paper_triangles * pixels((common.width, common.height)) / pixels(paper_px);
            let chosen = choose_edge(&session, &path, common, target, args)?;
            gathered.notes.push(edge_note(&chosen));
            let common = CommonArgs { tessellate: Some(chosen.edge_px), ..common.clone() };
            gathered.tessellation.push(chosen);
            let along = (&session, &path);
            flights.push(fly(EXPERIMENT.name, along, source, &columns, &common, args, progress)?);
        }
        session.finish(&sizes[0], sizes[0].quiet)?;
        let is_papers = as_in_paper(args, source, sizes[1].width);
        let claims =
            flights.iter().flat_map(|flight| claims_of(source, &columns, flight, is_papers)).collect();
        gathered.add(flights, &columns, claims);
    }
    let title = "Deferred attribute interpolation of tessellated surfaces";
    gathered.outcome(args, EXPERIMENT.name, "Figure 7", title)
}

/// The length of edges that makes about `target` triangles in the view that has most of them.
fn choose_edge(
    session: &Session,
    path: &CameraPath,
    common: &CommonArgs,
    target: f64,
    args: &BenchArgs,
) -> Result<Tessellation, Failure> {
    let of = |edge_px: f32, triangles: Option<u64>| Tessellation {
        width: common.width,
        height: common.height,
        edge_px,
        triangles,
        paper_triangles: target,
    };
    if let Some(edge_px) = args.common.tessellate {
        return Ok(of(edge_px, None));
    }
    let (mut edge_px, mut triangles) = (DEFAULT_EDGE_PX, None);
    for _ in 0..TRIALS {
        triangles = count_triangles(session, path, common, edge_px, args)?;
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
    common: &CommonArgs,
    edge_px: f32,
    args: &BenchArgs,
) -> Result<Option<u64>, Failure> {
    // Any technique that tessellates draws the same triangles; one sample a pixel is the least work.
    let mut counter = Chosen { technique: technique("technique", "tiled")?, params: Params::default() };
    counter.params.set(counter.technique.info(), "cull", "none")?;
    let mut most = None;
    for at in places(path, args.views.min(PROBES)) {
        let (renderer, workload) = session.with_settings(|settings| {
            (settings.width_px, settings.height_px) = (common.width, common.height);
            settings.tessellate_px = Some(edge_px);
            settings.camera = path.at(at);
        })?;
        let measured = frames::measure(&renderer, &counter, &workload, 0, || {})?;
        most = most.max(triangles_drawn(&measured.result));
    }
    Ok(most)
}

fn edge_note(chosen: &Tessellation) -> String {
    let Tessellation { width, height, edge_px, triangles, paper_triangles } = chosen;
    let made = triangles.map_or_else(
        || "their triangles are in the table".to_owned(),
        |triangles| format!("up to {} triangles", text::grouped(triangles)),
    );
    format!(
        "{width}×{height}: edges of {edge_px:.2} pixels, {made} (the paper's, by pixels: {})",
        text::grouped(*paper_triangles as u64)
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
    use super::super::flight::tests::flight;
    use super::*;

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
        let source = Source { source: "sponza.gltf".into(), paper: Some(&PAPER_SCENES[0]), stands_in: false };
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
