//! What experiments share: their registry's entries, options, tables, claims, what papers say, texts.

pub mod claims;
mod compared;
mod experiment;
mod filters;
mod options;
mod paper;
pub(crate) mod phases;
mod pictures;
mod table;
mod text;

pub(crate) use claims::{Claim, at_most, section_note, verdict_text};
pub use compared::compare_text;
pub use experiment::{Experiment, Outcome, Part, Planned, Specification};
pub(crate) use filters::FILTERS;
pub use options::Options;
pub(crate) use options::{
    DEFAULT_FRAMES, all_techniques, at_size, check_run, default_scenes, sample_counts_up_to,
};
pub(crate) use paper::{
    FULL_HD_PX, Header, MIB, PaperFigures, PaperRecord, PaperWords, paper_data, stand_in,
};
pub use phases::Phase;
pub(crate) use phases::{of_role, phase};
pub use pictures::pictures_of;
pub(crate) use table::{Row, Table, labelled, run_of};
pub(crate) use text::{broken_off, counter, notes_text, reasons_text};
