//! A comparison as people read it: what is asked about most stands last.

use std::fmt::Write as _;

use afterlight_lab::{Conclusion, TIME_FACTOR};
use afterlight_measure::{Run, RunResult};
use afterlight_report::text::{grouped, pass_table, technique_table};
use afterlight_report::{bytes_text, ms_text};

/// What the terminal shows of a comparison: facts, passes where they are wanted, then the techniques in the order of their frame
/// times, why some have no figures, and two lines of conclusion.
pub fn compare_text(run: &Run, with_passes: bool) -> String {
    let found = Conclusion::of(run);
    let mut text = facts_text(run);
    if with_passes && run.results.iter().any(|result| !result.passes.is_empty()) {
        let _ = writeln!(text, "{}\n", pass_table(run));
    }
    let _ = writeln!(text, "{}", technique_table(run, &found.ordered));
    for result in &found.ordered {
        if let Some(reason) = &result.reason {
            let _ = writeln!(text, "{}: {reason}", result.technique);
        }
    }
    text + &other_samples_text(run, &found) + &conclusion_text(&found)
}

fn facts_text(run: &Run) -> String {
    let settings = &run.settings;
    format!(
        "{} ({}), driver {}\n{}: {} triangles, {} draws, {} lights; {}×{}, {} sample(s); median of {} frame(s)\n\n",
        run.device.name,
        run.device.kind,
        run.device.driver,
        run.scene.name,
        grouped(run.scene.triangles),
        grouped(run.scene.draws),
        grouped(run.scene.lights),
        settings.width,
        settings.height,
        settings.samples,
        settings.frames,
    )
}

/// Techniques that render other numbers of samples, in one line.
fn other_samples_text(run: &Run, found: &Conclusion<'_>) -> String {
    if found.other_samples.is_empty() {
        return String::new();
    }
    let names: Vec<&str> = found.other_samples.iter().map(|(result, _)| result.technique.as_str()).collect();
    let mut counts: Vec<u32> = found.other_samples.iter().flat_map(|(_, counts)| *counts).copied().collect();
    counts.sort_unstable();
    counts.dedup();
    let counts: Vec<String> = counts.iter().map(u32::to_string).collect();
    let (last, others) = counts.split_last().map_or((String::new(), &[][..]), |(l, o)| (l.clone(), o));
    let counts = if others.is_empty() { last } else { format!("{} or {last}", others.join(", ")) };
    format!(
        "not at {} sample{} a pixel, but with --samples {counts}: {}\n",
        run.settings.samples,
        if run.settings.samples == 1 { "" } else { "s" },
        names.join(", ")
    )
}

fn conclusion_text(found: &Conclusion<'_>) -> String {
    let Some((fastest, least)) = found.fastest_exact.zip(found.least_memory) else { return String::new() };
    let figures = |result: &RunResult| {
        let ms = result.frame_ms.map_or_else(|| "–".to_owned(), |frame| ms_text(frame.median));
        let memory = result.memory.as_ref();
        let memory = memory.map_or_else(|| "–".to_owned(), |memory| bytes_text(memory.technique_bytes));
        format!("{}, {ms} ms, {memory}", result.technique)
    };
    format!(
        "fastest exact technique: {}\nleast memory of the exact ones within {TIME_FACTOR} times its frame time: {}\n",
        figures(fastest),
        figures(least)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_measure::{Memory, Pass, Spread, Status};

    fn run() -> Run {
        let mut run: Run = serde_json::from_value(serde_json::json!({
            "schema": 1, "device": {"name": "d", "driver": "", "api": "", "type": ""},
            "scene": {"name": "s", "triangles": 0, "draws": 0, "lights": 0},
            "settings": {"width": 0, "height": 0, "samples": 1, "frames": 1, "camera": "", "reference": "forward",
                "light_seed": null, "version": ""},
            "results": [],
        }))
        .expect("a run");
        let result = |technique: &str, ms: f64, bytes: u64| {
            let mut result = RunResult::without_figures(technique, Status::Ok, "");
            result.reason = None;
            result.frame_ms = Spread::of(&[ms]);
            result.memory = Some(Memory { technique_bytes: bytes, peak_bytes: bytes, buffers: Vec::new() });
            result.passes = vec![Pass {
                name: format!("{technique}/shade"),
                role: None,
                work: None,
                ms: Spread::of(&[ms]),
                reads: Vec::new(),
                writes: Vec::new(),
                statistics: Default::default(),
            }];
            result
        };
        let lacking =
            |technique: &str| RunResult::without_figures(technique, Status::Unavailable, "1 sample: no");
        run.results = vec![
            result("forward", 9.0, 0),
            lacking("deferred-dedup"),
            result("deferred", 5.0, 2048),
            lacking("dais-list"),
            result("tiled", 4.0, 4096),
        ];
        run
    }

    #[test]
    fn the_summary_is_last_and_by_frame_time() {
        let text = compare_text(&run(), false);
        let at = |part: &str| text.find(part).unwrap_or_else(|| panic!("no {part} in:\n{text}"));
        assert!(at("\n tiled") < at("\n deferred") && at("\n deferred") < at("\n forward"), "{text}");
        let lines: Vec<&str> = text.lines().collect();
        let [.., other, fastest, least] = &lines[..] else { panic!("{text}") };
        assert_eq!(
            *other,
            "not at 1 sample a pixel, but with --samples 2, 4, 8 or 16: deferred-dedup, dais-list"
        );
        assert_eq!(*fastest, "fastest exact technique: tiled, 4.00 ms, 4.00 KiB");
        assert!(
            least.contains("within 1.5 times") && least.ends_with("deferred, 5.00 ms, 2.00 KiB"),
            "{least}"
        );
    }

    #[test]
    fn passes_are_told_when_wanted_before_the_summary() {
        assert!(!compare_text(&run(), false).contains("tiled/shade"));
        let text = compare_text(&run(), true);
        let passes = text.find("tiled/shade").expect("told");
        assert!(
            passes < text.find("fastest").expect("told") && passes < text.find("technique ").expect("told")
        );
    }
}
