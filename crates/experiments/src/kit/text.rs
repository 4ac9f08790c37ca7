//! Texts about results.

use afterlight_lab::Setup;
use afterlight_measure::{RunResult, Status};
use serde_json::Value;

/// Notes, a line each.
pub(crate) fn notes_text(notes: &[String]) -> String {
    notes.iter().map(|note| format!("note: {note}\n")).collect()
}

/// A counter of a result.
pub(crate) fn counter(result: &RunResult, name: &str) -> Option<u64> {
    result.counters.get(name).and_then(Value::as_u64)
}

/// Lines that say why a set-up has no figures, each reason once.
pub(crate) fn reasons_text(setups: &[&Setup], results: &[RunResult]) -> String {
    let mut told: Vec<(&str, Vec<&str>)> = Vec::new();
    for (setup, result) in setups.iter().zip(results) {
        let Some(reason) = result.reason.as_deref().filter(|_| result.status != Status::Ok) else { continue };
        match told.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, labels)) => labels.push(&setup.label),
            None => told.push((reason, vec![&setup.label])),
        }
    }
    told.iter().map(|(reason, labels)| format!("{}: {reason}\n", labels.join("; "))).collect()
}

/// Why an experiment failed whose techniques may not break off; dropped samples are for the experiment to judge.
pub(crate) fn broken_off<'a>(results: impl IntoIterator<Item = (&'a str, &'a RunResult)>) -> Option<String> {
    results.into_iter().find(|(_, result)| result.status == Status::Failed).map(|(label, result)| {
        format!("{label} failed: {}", result.reason.as_deref().unwrap_or("no reason given"))
    })
}
