//! `bench dais-fig5`: time of the geometry pass, time of shading and memory along a camera path at two sizes (Schied and
//! Dachsbacher 2015, Figure 5).

use super::flight::{Flight, Gathered, claim, fly, open, ratios};
use super::{
    Claim, Column, Kind, PAPER_SCENES, Source, as_in_paper, at_most, columns, session_notes, sizes, sources,
    with_indirect, with_samples,
};
use crate::args::BenchArgs;
use crate::commands::bench::{Experiment, Outcome};
use crate::failure::Failure;
use crate::progress::Progress;

/// The experiment.
pub(in crate::commands::bench) const EXPERIMENT: Experiment = Experiment {
    name: "dais-fig5",
    summary: "deferred attribute interpolation along a camera path, two sizes",
    run,
};

/// By how much a pass over the visibility buffer grows with four times the pixels (section 5: "about 40%").
const GROWTH: f64 = 1.4;
/// What still is about that.
const GROWTH_MAX: f64 = 1.45;
/// What the G-buffer's grows by more than.
const DEFERRED_GROWTH: f64 = 2.0;

fn run(args: &BenchArgs, progress: &Progress) -> Result<Outcome, Failure> {
    let args = &with_samples(args)?;
    let asked = sizes(args).map(with_indirect);
    let columns = columns(args, &Kind::ALL)?;
    let sources = sources(args, &PAPER_SCENES);
    let notes = super::notes(args, &sources, asked[1].width);
    let mut gathered = Gathered::new(notes);
    for source in &sources {
        let mut sizes = asked.clone();
        let (session, path) = open(source, &mut sizes[0], args, progress)?;
        sizes[1].lights = sizes[0].lights;
        gathered.notes.extend(session_notes(&session, source, &asked[0], &sizes[0]));
        let mut flights = Vec::new();
        for common in &sizes {
            let along = (&session, &path);
            flights.push(fly(EXPERIMENT.name, along, source, &columns, common, args, progress)?);
        }
        session.finish(&sizes[0], sizes[0].quiet)?;
        let is_papers = as_in_paper(args, source, sizes[1].width);
        let mut claims = growth_claims(source, &columns, &flights, is_papers);
        claims.extend(memory_claims(source, &columns, &flights, is_papers));
        gathered.add(flights, &columns, claims);
    }
    let title = "Deferred attribute interpolation along a camera path";
    gathered.outcome(args, EXPERIMENT.name, "Figure 5", title)
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
        let paper = source.paper.map(|_| if is_deferred { DEFERRED_GROWTH } else { GROWTH });
        let found = ratios(&values(large), &values(small));
        claim(text, source.title(), column.label(), &found, paper, as_in_paper, |growth| {
            paper?;
            Some(match is_deferred {
                true => growth.median > DEFERRED_GROWTH,
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
    use super::super::flight::tests::flight;
    use super::*;

    fn source() -> Source {
        Source { source: "sponza.gltf".into(), paper: Some(&PAPER_SCENES[0]), stands_in: false }
    }

    fn columns_of(kinds: &[Kind]) -> Vec<Column> {
        kinds.iter().map(|&kind| Column { kind, setup: None }).collect()
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
