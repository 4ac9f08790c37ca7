//! Claims of papers, judged in one run.

use afterlight_report::text::number_text;
use serde::Serialize;

use super::notes_text;

/// A claim of the paper as a ratio in one run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// What is claimed.
    pub claim: String,
    /// The scene.
    pub scene: String,
    /// The column that it is about.
    pub column: &'static str,
    /// Measured; the median where there are several views.
    pub ratio: Option<f64>,
    /// Over the views.
    pub least: Option<f64>,
    /// Over the views.
    pub greatest: Option<f64>,
    /// The paper's; none where the scene is not the paper's.
    pub paper: Option<f64>,
    /// Whether it is met; none where it is not judged.
    pub met: Option<bool>,
    /// Whether scene, size and samples are the paper's.
    pub as_in_paper: bool,
}

/// Whether a ratio is at most the paper's, to the two digits that it gives.
pub(crate) fn at_most(ratio: f64, paper: f64) -> bool {
    ratio < paper + 0.005
}

fn claims_text(claims: &[Claim]) -> String {
    let line = |claim: &Claim| {
        let answer = match claim.met {
            Some(true) => "met",
            Some(false) => "not met",
            None => "not judged",
        };
        let range = match (claim.least, claim.greatest) {
            (Some(least), Some(greatest)) => format!(" ({least:.2} – {greatest:.2} over the views)"),
            _ => String::new(),
        };
        format!(
            "{}, {}: {}: {}{range} (paper: {}): {answer}{}\n",
            claim.scene,
            claim.column,
            claim.claim,
            number_text(claim.ratio, 2),
            number_text(claim.paper, 2),
            if claim.as_in_paper { "" } else { ", under other conditions than the paper's" }
        )
    };
    // What did not run has said so already.
    claims.iter().filter(|claim| claim.ratio.is_some()).map(line).collect()
}

/// What the terminal shows last.
pub(crate) fn verdict_text(claims: &[Claim], notes: &[String]) -> String {
    claims_text(claims) + &notes_text(notes)
}

/// The notes on a section and the claims on its scene, as sentences.
pub(crate) fn section_note(notes: &[String], claims: &[Claim]) -> String {
    let claims = claims_text(claims);
    notes.iter().map(String::as_str).chain(claims.lines()).collect::<Vec<_>>().join(". ")
}
