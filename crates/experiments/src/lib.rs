//! The experiments of the papers, a folder each over a shared [`kit`].
//!
//! An experiment is a specification ([`Specification`]) that a command line, a JSON file or another language fills; it runs, and
//! gives an [`Outcome`]: figures as JSON, sections of a report, and why a check of it failed. What papers measured stands beside
//! the experiment as data (`paper.json`). Nothing here prints: a [`Listener`](afterlight_lab::Listener) hears what people read.
//!
//! ```no_run
//! use afterlight_experiments::{Specification as _, msaa_table2};
//! # fn main() -> Result<(), afterlight_lab::LabError> {
//! let spec = msaa_table2::Spec { scale: 0.25, frames: 3, ..Default::default() };
//! let outcome = spec.run(&afterlight_lab::Silent)?;
//! println!("{}", outcome.json["scores"]);
//! // The same from JSON, by name:
//! let found = afterlight_experiments::find("msaa-table2").expect("is listed");
//! found.from_json(r#"{"scale": 0.25, "frames": 3}"#)?.run(&afterlight_lab::Silent)?;
//! # Ok(()) }
//! ```

pub mod antialiasing;
mod dais;
pub mod dais_fig5;
pub mod dais_fig6;
pub mod dais_fig7;
pub mod dais_table1;
pub mod kit;
pub mod lights_sweep;
pub mod msaa_table1;
pub mod msaa_table2;
pub mod speed;

pub use kit::{Experiment, Options, Outcome, Part, Planned, Specification, compare_text, pictures_of};

/// All experiments, in the order in which all are run.
pub const EXPERIMENTS: &[Experiment] = &[
    Experiment::of::<speed::Spec>(),
    Experiment::of::<lights_sweep::Spec>(),
    Experiment::of::<msaa_table1::Spec>(),
    Experiment::of::<msaa_table2::Spec>(),
    Experiment::of::<antialiasing::Spec>(),
    Experiment::of::<dais_table1::Spec>(),
    Experiment::of::<dais_fig5::Spec>(),
    Experiment::of::<dais_fig6::Spec>(),
    Experiment::of::<dais_fig7::Spec>(),
];

/// The experiment of that name.
pub fn find(name: &str) -> Option<&'static Experiment> {
    EXPERIMENTS.iter().find(|one| one.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_differ() {
        for (index, one) in EXPERIMENTS.iter().enumerate() {
            assert!(EXPERIMENTS[..index].iter().all(|other| other.name != one.name), "{}", one.name);
            assert!(find(one.name).is_some() && !one.summary.is_empty());
        }
    }

    #[test]
    fn specifications_are_json_and_back_and_all_fields_may_be_left_out() {
        for one in EXPERIMENTS {
            let usual = one.from_options(&Options::default()).to_json().expect("is JSON");
            let read = |text: &str| one.from_json(text).map(|planned| planned.to_json().expect("is JSON"));
            assert_eq!(read("{}").expect("reads"), usual, "{}: options and Default differ", one.name);
            assert_eq!(read(&usual.to_string()).expect("reads"), usual, "{}", one.name);
            let refused = read(r#"{"sclae": 1}"#).expect_err("is refused").to_string();
            assert!(refused.contains(one.name) && refused.contains("sclae"), "{refused}");
        }
    }

    #[test]
    fn what_options_say_goes_into_the_specification() {
        let options = Options {
            scale: Some(0.5),
            techniques: Some(vec!["dais".to_owned()]),
            width: Some(64),
            height: Some(36),
            samples: Some(4),
            ..Options::default()
        };
        for one in EXPERIMENTS {
            let spec = one.from_options(&options).to_json().expect("is JSON");
            assert_eq!(spec["scale"], 0.5, "{}", one.name);
            assert_eq!((&spec["frame"]["width"], &spec["frame"]["height"]), (&64.into(), &36.into()));
            let samples = [&spec["samples"], &spec["sample_counts"][0], &spec["frame"]["samples"]];
            assert!(samples.contains(&&4.into()), "{}: {spec}", one.name);
            assert!(spec["techniques"].is_null() || spec["techniques"][0] == "dais", "{}", one.name);
        }
    }
}
