//! `bench dais-fig5`: time of the geometry pass, time of shading and memory along a camera path at two sizes (Schied and
//! Dachsbacher 2015, Figure 5).

use std::path::PathBuf;
use std::sync::LazyLock;

use afterlight_lab::{FrameSpec, LabError, Listener};
use serde::{Deserialize, Serialize};

use crate::dais::flight::{Flight, Gathered, claim, fly, open, ratios};
use crate::dais::{
    Column, Conditions, Kind, PAPER, PAPER_SAMPLES, Source, as_in_paper, columns, session_notes, sizes,
    sources, with_indirect,
};
use crate::kit::{
    Claim, DEFAULT_FRAMES, FULL_HD_PX, Options, Outcome, Specification, all_techniques, at_most, paper_data,
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
    /// What frames look like, at the smaller of the two sizes; `camera`, `samples`, `post` and `view` do not count, `indirect` is on.
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
    const NAME: &'static str = "dais-fig5";
    const SUMMARY: &'static str = "deferred attribute interpolation along a camera path, two sizes";

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

/// What the paper says of the time of the geometry pass.
static GROWTH: LazyLock<Growth> = LazyLock::new(|| paper_data(include_str!("paper.json")));

/// By what factor the geometry pass grows with twice the width and height.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Growth {
    /// What of the paper the experiment stands beside; the growth is told in its section 5.
    section: String,
    /// Of a pass over the visibility buffer.
    visibility: f64,
    /// The G-buffer's grows by more than this.
    gbuffer_more_than: f64,
}

/// What still is about the paper's growth of a pass over the visibility buffer.
const GROWTH_MAX: f64 = 1.45;
fn run(spec: &Spec, listener: &dyn Listener) -> Result<Outcome, LabError> {
    let asked = &spec.conditions()?;
    let asked_sizes = sizes(asked).map(with_indirect);
    let columns = columns(asked, &Kind::ALL)?;
    let sources = sources(asked, &PAPER.scenes);
    let notes = crate::dais::notes(asked, &sources, asked_sizes[1].width);
    let mut gathered = Gathered::new(notes);
    for source in &sources {
        let mut sizes = asked_sizes.clone();
        let (session, path) = open(source, &mut sizes[0], asked, listener)?;
        sizes[1].lights = sizes[0].lights;
        gathered.notes.extend(session_notes(&session, source, &asked_sizes[0], &sizes[0]));
        let mut flights = Vec::new();
        for frame in &sizes {
            let along = (&session, &path);
            flights.push(fly(Spec::NAME, along, source, &columns, frame, asked, listener)?);
        }
        session.finish(&sizes[0], listener)?;
        let is_papers = as_in_paper(asked, source, sizes[1].width);
        let mut claims = growth_claims(source, &columns, &flights, is_papers);
        claims.extend(memory_claims(source, &columns, &flights, is_papers));
        gathered.add(flights, &columns, claims);
    }
    let title = "Deferred attribute interpolation along a camera path";
    gathered.outcome(asked, Spec::NAME, &GROWTH.section, title, listener)
}

/// The time of the geometry pass at twice the width and height over that at once, view by view.
fn growth_claims(source: &Source, columns: &[Column], flights: &[Flight], as_in_paper: bool) -> Vec<Claim> {
    let [small, large] = flights else { return Vec::new() };
    let growth = |column: &Column| {
        let values = |flight: &Flight| flight.values(column.kind, |cell| cell.times.geometry_ms);
        let is_deferred = column.kind == Kind::Deferred;
        let text = match is_deferred {
            true => "twice the width and height take the geometry pass more than twice as long",
            false => "twice the width and height take the geometry pass about 1.4 times as long, or less",
        };
        let paper =
            source.paper.map(|_| if is_deferred { GROWTH.gbuffer_more_than } else { GROWTH.visibility });
        let found = ratios(&values(large), &values(small));
        claim(text, source.title(), column.label(), &found, paper, as_in_paper, |growth| {
            paper?;
            Some(match is_deferred {
                true => growth.median > GROWTH.gbuffer_more_than,
                false => growth.median <= GROWTH_MAX,
            })
        })
    };
    columns.iter().map(growth).collect()
}

/// Memory of the lists over deferred shading's in every view, at each size. The paper's share is of the larger.
fn memory_claims(source: &Source, columns: &[Column], flights: &[Flight], as_in_paper: bool) -> Vec<Claim> {
    let Some(list) = columns.iter().find(|column| column.kind == Kind::List) else { return Vec::new() };
    let of_flight = |(index, flight): (usize, &Flight)| {
        let total = |kind: Kind| flight.values(kind, |cell| cell.sizes.total_mib);
        let found = ratios(&total(Kind::List), &total(Kind::Deferred));
        let paper = source.paper.filter(|_| index == 1).map(|paper| paper.claimed.list_memory);
        let text = format!(
            "at {} pixels wide, memory over deferred shading's is at most the paper's in every view",
            flight.width_px()
        );
        claim(&text, source.title(), list.label(), &found, paper, as_in_paper, |ratio| {
            Some(at_most(ratio.max, paper?))
        })
    };
    flights.iter().enumerate().map(of_flight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dais::flight::tests::flight;

    fn source() -> Source {
        Source { source: "sponza.gltf".into(), paper: Some(&PAPER.scenes[0]), stands_in: false }
    }

    fn columns_of(kinds: &[Kind]) -> Vec<Column> {
        kinds.iter().map(|&kind| Column { kind, setup: None }).collect()
    }

    #[test]
    fn the_papers_growth_reads() {
        assert_eq!(GROWTH.section, "Figure 5");
        assert!(GROWTH_MAX > GROWTH.visibility && GROWTH_MAX < GROWTH.gbuffer_more_than);
    }

    #[test]
    fn growth_is_the_median_of_the_views() {
        let kinds = [Kind::Deferred, Kind::Cache, Kind::List];
        let small = flight(
            100,
            &[
                (kinds[0], &[(2.0, 9), (2.0, 9), (2.0, 9)]),
                (kinds[1], &[(1.0, 9), (1.0, 9), (1.0, 9)]),
                (kinds[2], &[(1.0, 9), (1.0, 9), (1.0, 9)]),
            ],
        );
        let large = flight(
            200,
            &[
                (kinds[0], &[(4.0, 9), (4.2, 9), (6.0, 9)]),
                (kinds[1], &[(1.3, 9), (1.44, 9), (3.0, 9)]),
                (kinds[2], &[(1.3, 9), (1.46, 9), (1.5, 9)]),
            ],
        );
        let claims = growth_claims(&source(), &columns_of(&kinds), &[small, large], true);
        let told: Vec<_> = claims.iter().map(|claim| (claim.ratio.unwrap_or(0.0), claim.met)).collect();
        assert_eq!(told, [(2.1, Some(true)), (1.44, Some(true)), (1.46, Some(false))]);
        assert_eq!((claims[1].least, claims[1].greatest), (Some(1.3), Some(3.0)));
    }

    #[test]
    fn memory_is_judged_by_the_worst_view_of_the_larger_size() {
        let kinds = [Kind::Deferred, Kind::List];
        let of = |width: u32, list: &[(f64, u64)]| {
            flight(width, &[(kinds[0], &[(1.0, 100), (1.0, 100)]), (kinds[1], list)])
        };
        let judged = |list: &[(f64, u64)]| {
            let flights = [of(100, &[(1.0, 90), (1.0, 90)]), of(200, list)];
            memory_claims(&source(), &columns_of(&kinds), &flights, true)
        };
        let claims = judged(&[(1.0, 20), (1.0, 23)]);
        assert_eq!((claims[0].ratio, claims[0].met), (Some(0.9), None), "the paper tells none of this size");
        assert_eq!((claims[1].least, claims[1].greatest, claims[1].met), (Some(0.2), Some(0.23), Some(true)));
        assert_eq!(judged(&[(1.0, 20), (1.0, 24)])[1].met, Some(false));
    }
}
