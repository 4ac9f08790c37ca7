//! What passes and buffers are for.

use serde::Serialize;

/// What a pass is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// The light's view, which all techniques share.
    Indirect,
    /// The depth pre-pass.
    Prepass,
    /// Drawing what shows: G-buffer, triangle IDs, keys, references, lists, with what is cleared for it.
    Fill,
    /// Finding the triangles that show in a finished visibility buffer, and sizes of dispatches.
    Find,
    /// Screen-space derivatives of visible triangles.
    Derivatives,
    /// Shading.
    Shade,
    /// What every frame ends in.
    Present,
}

/// Whose a pass is, and its stage: bands of the image have passes of their own, told apart by a number.
pub(crate) fn owner_and_stage(pass: &str) -> (&str, &str) {
    let (owner, stage) = pass.split_once('/').unwrap_or(("", pass));
    (owner, stage.trim_end_matches(|c: char| c.is_ascii_digit() || c == ' '))
}

pub(crate) fn phase(pass: &str) -> Phase {
    let (owner, stage) = owner_and_stage(pass);
    match (owner, stage) {
        ("shared", _) => Phase::Indirect,
        ("present" | "post", _) => Phase::Present,
        (_, "depth") => Phase::Prepass,
        (_, "mark" | "count" | "scan" | "size" | "clear bits" | "clear count") => Phase::Find,
        (_, "derivatives") => Phase::Derivatives,
        (_, stage) if stage.contains("shade") || stage.contains("resolve") => Phase::Shade,
        _ => Phase::Fill,
    }
}

/// A resource's name without its technique.
pub(crate) fn part(name: &str) -> &str {
    name.split_once('/').map_or(name, |(_, part)| part)
}
