//! Reports of runs: one-file HTML pages (a summary, sortable tables, pass times as bars, charts, pictures inlined; light and
//! dark), tables for the terminal, and files that are complete or absent. Nothing here prints.

mod chart;
mod files;
mod format;
mod page;
mod pictures;
pub mod text;

pub use chart::{Axes, Chart, Line};
pub use files::{FileError, check_file, json_text, make_folder, write_file, write_report};
pub use format::{bytes_text, ms_text, psnr_text};

pub use pictures::AMPLIFICATION;

use afterlight_measure::Run;

/// A report: one page of one or more sections.
#[derive(Clone, Debug)]
pub struct Report<'a> {
    /// Title of the page.
    pub title: String,
    /// What was asked, for the reader: the command line.
    pub command: String,
    /// The sections in order.
    pub sections: Vec<Section<'a>>,
}

/// A run with its pictures.
#[derive(Clone, Debug)]
pub struct Section<'a> {
    /// Heading; empty where the page's title says all.
    pub heading: String,
    /// What the reader should know of it; empty for nothing.
    pub note: String,
    /// The figures.
    pub run: &'a Run,
    /// Charts of more runs than this one.
    pub charts: Vec<Chart>,
    /// Pictures of its techniques.
    pub pictures: Vec<Picture>,
}

/// What a technique drew.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The technique's id.
    pub technique: String,
    /// The image, a PNG file.
    pub image_png: Vec<u8>,
    /// Its difference to the reference, amplified, a PNG file.
    pub difference_png: Option<Vec<u8>>,
    /// What the difference shows.
    pub difference_caption: String,
}

impl Report<'_> {
    /// Returns the page: HTML that needs no other file and no network.
    pub fn html(&self) -> String {
        page::page(self).into_string()
    }
}
