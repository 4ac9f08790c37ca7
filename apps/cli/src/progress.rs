//! What people hear while work goes on: progress bars on standard error, where a terminal listens; tables; warnings.

use std::io::IsTerminal as _;
use std::time::Duration;

use afterlight_lab::{Listener, Task};
use indicatif::{ProgressBar, ProgressStyle};

use crate::args::JsonArgs;
use crate::output;

/// Tells people, unless they asked for quiet.
pub struct Terminal<'a> {
    json: Option<&'a JsonArgs>,
    quiet: bool,
    shows_bars: bool,
    wants_pictures: bool,
}

impl<'a> Terminal<'a> {
    /// Shows bars unless `quiet` or standard error is no terminal. Tables go to standard error where `json` takes standard output;
    /// there are none without it.
    pub fn new(quiet: bool, json: Option<&'a JsonArgs>, wants_pictures: bool) -> Terminal<'a> {
        Terminal { json, quiet, shows_bars: !quiet && std::io::stderr().is_terminal(), wants_pictures }
    }
}

impl Listener for Terminal<'_> {
    fn task(&self, label: &str, steps: u64) -> Box<dyn Task> {
        if !self.shows_bars {
            return Box::new(Bar(ProgressBar::hidden()));
        }
        if steps == 0 {
            let spinner = ProgressBar::new_spinner().with_message(label.to_owned());
            spinner.enable_steady_tick(Duration::from_millis(120));
            return Box::new(Bar(spinner));
        }
        let style = ProgressStyle::with_template("{prefix:>24} {bar:32} {pos}/{len} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        Box::new(Bar(ProgressBar::new(steps).with_style(style).with_prefix(label.to_owned())))
    }

    fn tell(&self, text: &str) {
        if let Some(json) = self.json
            && !self.quiet
        {
            output::tell(json, text);
        }
    }

    fn warn(&self, warning: &str) {
        if !self.quiet {
            eprintln!("afterlight: warning: {}", output::one_line(warning));
        }
    }

    fn wants_pictures(&self) -> bool {
        self.wants_pictures
    }
}

/// A bar, which is gone when its task has ended.
struct Bar(ProgressBar);

impl Task for Bar {
    fn advance(&self) {
        self.0.inc(1);
    }

    fn place(&self, done: u64, steps: u64) {
        self.0.set_length(steps);
        self.0.set_position(done);
    }

    fn at(&self, what: &str) {
        self.0.set_message(what.to_owned());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
