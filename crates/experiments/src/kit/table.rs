//! Tables of experiments: measured set-ups with cells, rows of JSON, sections of reports.

use afterlight_lab::{FrameSpec, Session, Setup};
use afterlight_measure::{Run, RunResult, SCHEMA};
use afterlight_techniques::Post;
use serde::Serialize;

use super::Part;

/// A run as JSON, with the experiment's cells of it.
#[derive(Serialize)]
pub(crate) struct Row<Cell> {
    #[serde(flatten)]
    pub run: Run,
    /// The experiment's table: figures beside the paper's.
    pub cells: Vec<Cell>,
}

/// Measured set-ups with an experiment's cells of each.
pub(crate) struct Table<'a, Cell> {
    pub setups: Vec<&'a Setup>,
    pub results: Vec<RunResult>,
    pub cells: Vec<Vec<Cell>>,
    /// What a report tells of each.
    pub remarks: Vec<Option<String>>,
}

impl<Cell: Clone> Table<'_, Cell> {
    /// Runs: one for each number of samples and filter, in the order of the first set-up of each.
    pub fn rows(&self, session: &Session, frame: &FrameSpec, frames: u32, reference: &str) -> Vec<Row<Cell>> {
        let groups = groups(&self.setups, |setup| (setup.samples, setup.post));
        let row = |((samples, post), members): ((u32, Post), Vec<usize>)| {
            let results = members.iter().map(|&index| self.results[index].clone()).collect();
            Row {
                run: run_of(session, frame, (samples, post), frames, reference, results),
                cells: members.iter().flat_map(|&index| self.cells[index].clone()).collect(),
            }
        };
        groups.into_iter().map(row).collect()
    }

    /// The same for a report, under labels, one section for each number of samples.
    pub fn parts(
        &self,
        session: &Session,
        frame: &FrameSpec,
        frames: u32,
        reference: &str,
        heading: &str,
        note: &str,
    ) -> Vec<Part> {
        let part = |(samples, members): (u32, Vec<usize>)| {
            let labelled = |&index: &usize| {
                labelled(&self.results[index], &self.setups[index].label, self.remarks[index].clone())
            };
            let results = members.iter().map(labelled).collect();
            Part {
                heading: format!("{heading}{samples} sample{} a pixel", if samples == 1 { "" } else { "s" }),
                note: note.to_owned(),
                run: run_of(session, frame, (samples, Post::None), frames, reference, results),
                charts: Vec::new(),
                pictures: Vec::new(),
            }
        };
        groups(&self.setups, |setup| setup.samples).into_iter().map(part).collect()
    }
}

/// Groups set-ups by what they share, groups and members in the order in which they come.
fn groups<Key: PartialEq>(setups: &[&Setup], key: impl Fn(&Setup) -> Key) -> Vec<(Key, Vec<usize>)> {
    let mut groups: Vec<(Key, Vec<usize>)> = Vec::new();
    for (index, setup) in setups.iter().enumerate() {
        let key = key(setup);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, members)) => members.push(index),
            None => groups.push((key, vec![index])),
        }
    }
    groups
}

/// A run of results with one number of samples and one filter.
pub(crate) fn run_of(
    session: &Session,
    frame: &FrameSpec,
    (samples, post): (u32, Post),
    frames: u32,
    reference: &str,
    results: Vec<RunResult>,
) -> Run {
    let frame = FrameSpec { samples, ..frame.clone() };
    let mut settings = session.settings_record(&frame, frames, reference);
    settings.post = post.name().to_owned();
    Run {
        schema: SCHEMA,
        device: session.device.clone(),
        scene: session.scene.clone(),
        settings,
        results,
        process: None,
    }
}

/// A result under its label, for a report: techniques stand there several times with other parameters.
pub(crate) fn labelled(result: &RunResult, label: &str, remark: Option<String>) -> RunResult {
    let reason = match (&result.reason, remark) {
        (Some(reason), Some(remark)) => Some(format!("{remark}; {reason}")),
        (reason, remark) => remark.or_else(|| reason.clone()),
    };
    RunResult { technique: label.to_owned(), reason, ..result.clone() }
}
