//! An experiment: a specification that runs.

use afterlight_lab::{LabError, Listener};
use afterlight_measure::Run;
use afterlight_report::{Chart, Picture, Report, Section};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::Options;

/// What an experiment is asked: a command line, a JSON file or another language fills it. What it leaves out has the experiment's
/// own value.
pub trait Specification: Serialize + DeserializeOwned + Default + Send + Sync + 'static {
    /// The experiment's name.
    const NAME: &'static str;
    /// What it measures, one line.
    const SUMMARY: &'static str;

    /// Takes what options say, and the experiment's own values where they say nothing.
    fn from_options(options: &Options) -> Self;

    /// Runs the experiment.
    ///
    /// # Errors
    /// Settings out of range, scenes, the device. What one technique cannot do is told in its result.
    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError>;
}

/// An experiment with its specification, whatever its type.
pub trait Planned: Send + Sync {
    /// Runs it.
    ///
    /// # Errors
    /// As [`Specification::run`].
    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError>;

    /// The specification as JSON.
    ///
    /// # Errors
    /// Numbers that JSON cannot hold.
    fn to_json(&self) -> Result<Value, LabError>;
}

impl<Spec: Specification> Planned for Spec {
    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError> {
        Specification::run(self, listener)
    }

    fn to_json(&self) -> Result<Value, LabError> {
        Ok(serde_json::to_value(self)?)
    }
}

/// An experiment of the registry.
#[derive(Clone, Copy)]
pub struct Experiment {
    /// Its name.
    pub name: &'static str,
    /// What it measures, one line.
    pub summary: &'static str,
    from_options: fn(&Options) -> Box<dyn Planned>,
    from_json: fn(&str) -> Result<Box<dyn Planned>, LabError>,
}

impl Experiment {
    /// The experiment that a specification is of.
    pub(crate) const fn of<Spec: Specification>() -> Experiment {
        Experiment {
            name: Spec::NAME,
            summary: Spec::SUMMARY,
            from_options: |options| Box::new(Spec::from_options(options)),
            from_json: |text| {
                let spec: Spec = serde_json::from_str(text).map_err(|error| LabError::Specification {
                    experiment: Spec::NAME,
                    reason: error.to_string(),
                })?;
                Ok(Box::new(spec))
            },
        }
    }

    /// The experiment as options ask for it.
    pub fn from_options(&self, options: &Options) -> Box<dyn Planned> {
        (self.from_options)(options)
    }

    /// The experiment as a JSON text specifies it: fields as in its `Spec`, each of which may be left out.
    ///
    /// # Errors
    /// [`LabError::Specification`] where the text is no JSON, or has fields that the specification has not.
    pub fn from_json(&self, text: &str) -> Result<Box<dyn Planned>, LabError> {
        (self.from_json)(text)
    }
}

/// What an experiment found.
pub struct Outcome {
    /// Title of its report.
    pub title: &'static str,
    /// The figures, as `--json` writes them.
    pub json: Value,
    /// The report, in order.
    pub sections: Vec<Part>,
    /// Why a check of the experiment failed; none where all is well.
    pub failed: Option<String>,
}

impl Outcome {
    /// The report; `command` tells its reader what was asked.
    pub fn report(&self, command: String) -> Report<'_> {
        Report {
            title: self.title.to_owned(),
            command,
            sections: self.sections.iter().map(Part::section).collect(),
        }
    }
}

/// A section of an experiment's report.
pub struct Part {
    /// Its heading.
    pub heading: String,
    /// What the reader should know of it.
    pub note: String,
    /// Its figures.
    pub run: Run,
    /// Charts of more runs than this one.
    pub charts: Vec<Chart>,
    /// Pictures of its techniques.
    pub pictures: Vec<Picture>,
}

impl Part {
    fn section(&self) -> Section<'_> {
        Section {
            heading: self.heading.clone(),
            note: self.note.clone(),
            run: &self.run,
            charts: self.charts.clone(),
            pictures: self.pictures.clone(),
        }
    }
}
