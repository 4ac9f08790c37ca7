//! `afterlight bench`

use std::path::Path;

use afterlight_experiments::{EXPERIMENTS, Experiment, Outcome, Planned};
use afterlight_measure::SCHEMA;
use afterlight_report::{json_text, make_folder, write_report};
use serde_json::{Value, json};

use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::output;
use crate::progress::Terminal;

pub fn run(args: &BenchArgs) -> Result<(), Failure> {
    let wanted: Vec<&Experiment> =
        EXPERIMENTS.iter().filter(|one| args.experiment == "all" || args.experiment == one.name).collect();
    if wanted.is_empty() {
        let names: Vec<&str> = EXPERIMENTS.iter().map(|one| one.name).collect();
        let expected = format!("one of: {}, all", names.join(", "));
        return Err(Failure::option("EXPERIMENT", format!("{:?}", args.experiment), expected));
    }
    args.json.check()?;
    let planned = plan(args, &wanted)?;
    if args.show_spec {
        for one in &planned {
            output::print(&json_text(&one.to_json()?)?);
        }
        return Ok(());
    }
    if let Some(folder) = &args.report {
        make_folder(folder)?;
    }
    let terminal = Terminal::new(args.common.quiet, Some(&args.json), args.report.is_some());
    let mut outcomes = Vec::new();
    for (one, planned) in wanted.iter().zip(&planned) {
        let outcome = planned.run(&terminal)?;
        if let Some(folder) = &args.report {
            let folder = if wanted.len() > 1 { folder.join(one.name) } else { folder.clone() };
            report(args, &folder, &outcome)?;
        }
        outcomes.push(outcome);
    }
    let failed: Vec<String> = outcomes.iter_mut().filter_map(|outcome| outcome.failed.take()).collect();
    let mut all: Vec<Value> = outcomes.into_iter().map(|outcome| outcome.json).collect();
    let value = match all.len() {
        1 => all.remove(0),
        _ => json!({"schema": SCHEMA, "experiment": "all", "experiments": all}),
    };
    output::json(&args.json, &value)?;
    if failed.is_empty() { Ok(()) } else { Err(Failure::Failed(failed.join("; "))) }
}

/// The experiments as the options or a file specify them.
fn plan(args: &BenchArgs, wanted: &[&Experiment]) -> Result<Vec<Box<dyn Planned>>, Failure> {
    let Some(file) = &args.spec else {
        let options = args.options()?;
        return Ok(wanted.iter().map(|one| one.from_options(&options)).collect());
    };
    let [one] = wanted else {
        return Err(Failure::option("--spec", file.display(), "one experiment, not all"));
    };
    let text = std::fs::read_to_string(file).map_err(|error| {
        Failure::Input(format!("{}: cannot be read ({error}), expected a JSON file", file.display()))
    })?;
    Ok(vec![one.from_json(&text)?])
}

fn report(args: &BenchArgs, folder: &Path, outcome: &Outcome) -> Result<(), Failure> {
    make_folder(folder)?;
    let path = write_report(folder, &outcome.report(output::command()), &json_text(&outcome.json)?)?;
    output::tell(&args.json, &format!("report: {}\n", path.display()));
    Ok(())
}
