//! What a comparison comes to.

use afterlight_measure::{Run, RunResult, Status};
use afterlight_techniques::{Exactness, exactness_of, find, params_of, set_param};

/// How many times the fastest technique's frame time one with less memory may take.
pub const TIME_FACTOR: f64 = 1.5;

/// What a comparison comes to: a run's results by frame time, and which of them to look at first.
pub struct Conclusion<'a> {
    /// Results in the order of their frame times; those without come last, in the run's order. Those of [`Self::other_samples`]
    /// are not among them.
    pub ordered: Vec<&'a RunResult>,
    /// Techniques that did not run because they do not render so many samples a pixel, with those that they render.
    pub other_samples: Vec<(&'a RunResult, &'static [u32])>,
    /// The exact technique that takes the least time.
    pub fastest_exact: Option<&'a RunResult>,
    /// The exact technique that takes the least memory of those within [`TIME_FACTOR`] times the fastest's time; the faster of
    /// two that take as much.
    pub least_memory: Option<&'a RunResult>,
}

impl<'a> Conclusion<'a> {
    /// Concludes from a run, by the registry's facts about its techniques.
    pub fn of(run: &'a Run) -> Conclusion<'a> {
        let (mut ordered, mut other_samples) = (Vec::new(), Vec::new());
        for result in &run.results {
            let renders = find(&result.technique).map(|technique| technique.info().samples);
            match renders.filter(|counts| !counts.contains(&run.settings.samples)) {
                Some(counts) if result.status == Status::Unavailable => other_samples.push((result, counts)),
                _ => ordered.push(result),
            }
        }
        let frame_ms = |result: &RunResult| result.frame_ms.map_or(f64::INFINITY, |frame| frame.median);
        ordered.sort_by(|a, b| frame_ms(a).total_cmp(&frame_ms(b)));
        let is_exact = |result: &&&RunResult| {
            let has_figures = result.status == Status::Ok && result.frame_ms.is_some();
            has_figures && matches!(exactness(result, run.settings.samples), Some(Exactness::Exact { .. }))
        };
        let fastest_exact = ordered.iter().find(is_exact).copied();
        let bytes = |result: &RunResult| result.memory.as_ref().map(|memory| memory.technique_bytes);
        let least_memory = fastest_exact.and_then(|fastest| {
            let within = TIME_FACTOR * frame_ms(fastest);
            let near = ordered.iter().filter(is_exact).filter(|one| frame_ms(one) <= within);
            near.filter(|one| bytes(one).is_some()).min_by_key(|one| bytes(one)).copied()
        });
        Conclusion { ordered, other_samples, fastest_exact, least_memory }
    }
}

/// Exactness of a result's technique with its parameters at so many samples a pixel; `None` of a technique that is not known.
fn exactness(result: &RunResult, samples: u32) -> Option<Exactness> {
    let technique = find(&result.technique)?;
    let mut params = params_of(technique);
    for (key, value) in &result.params {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        // A record of another version may have parameters that are gone.
        let _ = set_param(technique, &mut params, key, &text);
    }
    Some(exactness_of(technique, &params, samples))
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_measure::{Memory, Spread};

    fn result(technique: &str, ms: Option<f64>, bytes: u64) -> RunResult {
        let status = if ms.is_some() { Status::Ok } else { Status::Unavailable };
        let mut result = RunResult::without_figures(technique, status, "");
        result.frame_ms = ms.and_then(|ms| Spread::of(&[ms]));
        result.memory = ms.map(|_| Memory { technique_bytes: bytes, peak_bytes: bytes, buffers: Vec::new() });
        result
    }

    fn run(results: Vec<RunResult>) -> Run {
        let mut run: Run = serde_json::from_value(serde_json::json!({
            "schema": 1, "device": {"name": "", "driver": "", "api": "", "type": ""},
            "scene": {"name": "", "triangles": 0, "draws": 0, "lights": 0},
            "settings": {"width": 0, "height": 0, "samples": 1, "frames": 1, "camera": "", "reference": "",
                "light_seed": null, "version": ""},
            "results": [],
        }))
        .expect("a run");
        run.results = results;
        run
    }

    #[test]
    fn results_are_in_order_of_frame_time() {
        let run = run(vec![
            result("deferred", Some(3.0), 9),
            result("deferred-dedup", None, 0),
            result("visibility", None, 0),
            result("tiled", Some(2.0), 9),
        ]);
        let found = Conclusion::of(&run);
        let order: Vec<&str> = found.ordered.iter().map(|one| one.technique.as_str()).collect();
        assert_eq!(order, ["tiled", "deferred", "visibility"]);
        let other: Vec<&str> = found.other_samples.iter().map(|(one, _)| one.technique.as_str()).collect();
        assert_eq!(other, ["deferred-dedup"], "it renders several samples alone");
    }

    #[test]
    fn the_fastest_is_exact_and_ran_and_memory_is_within_a_factor() {
        let mut failed = result("visibility", Some(0.5), 1);
        failed.status = Status::Failed;
        let run = run(vec![
            failed,
            result("light-indexed", Some(1.0), 1),
            result("deferred", Some(2.0), 30),
            result("tiled", Some(2.9), 20),
            result("forward", Some(3.1), 0),
        ]);
        let found = Conclusion::of(&run);
        let name = |result: Option<&RunResult>| result.map(|one| one.technique.clone());
        assert_eq!(name(found.fastest_exact).as_deref(), Some("deferred"));
        assert_eq!(
            name(found.least_memory).as_deref(),
            Some("tiled"),
            "forward takes over 1.5 times as long"
        );
    }

    /// What is exact goes by the samples and the parameters of the run.
    #[test]
    fn approximate_ways_are_not_concluded_of() {
        let mut by_samples = result("deferred-ssaa", Some(2.0), 1);
        by_samples.params.insert("position".to_owned(), "sample".into());
        let mut run = run(vec![
            result("light-prepass", Some(1.0), 1),
            by_samples,
            result("deferred-ssaa", Some(3.0), 1),
            result("forward", Some(4.0), 1),
        ]);
        run.settings.samples = 4;
        let fastest = |run: &Run| {
            let found = Conclusion::of(run).fastest_exact.expect("exact ones ran");
            (found.technique.clone(), found.frame_ms.map(|ms| ms.median))
        };
        assert_eq!(fastest(&run), ("deferred-ssaa".to_owned(), Some(3.0)));
        run.settings.samples = 1;
        assert_eq!(fastest(&run), ("light-prepass".to_owned(), Some(1.0)));
    }

    #[test]
    fn without_figures_nothing_is_concluded() {
        let run = run(vec![result("deferred", None, 0)]);
        let found = Conclusion::of(&run);
        assert!(found.fastest_exact.is_none() && found.least_memory.is_none() && found.ordered.len() == 1);
    }
}
