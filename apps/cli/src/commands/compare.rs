//! `afterlight compare`

use afterlight_experiments::{compare_text, pictures_of};
use afterlight_lab::{Chosen, Listener as _, Session, check_samples_of, choose, compare, failure, technique};
use afterlight_report::{Report, Section, check_file, json_text, make_folder, write_report};

use crate::args::CompareArgs;
use crate::failure::Failure;
use crate::output;
use crate::progress::Terminal;

pub fn run(args: &CompareArgs) -> Result<(), Failure> {
    let spec = args.common.spec()?;
    args.json.check()?;
    if let Some(path) = args.json.json.as_deref().filter(|_| !args.json.on_stdout()) {
        check_file(path)?;
    }
    let chosen = choose("techniques", &args.techniques, &spec.set)?;
    let reference = technique("reference", &args.reference)?;
    if let Some(folder) = &args.report {
        make_folder(folder)?;
    }
    let terminal = Terminal::new(args.common.quiet, Some(&args.json), args.report.is_some());
    let session = Session::open(&args.scene, &spec, false, &terminal)?;
    super::tell_warnings(&session, &terminal);
    check_samples_of(&chosen, spec.samples)?;

    let reference = Chosen::new(reference);
    let compared = compare(&session, &spec, &chosen, reference, args.frames, &terminal)?;
    output::json(&args.json, &compared.run)?;
    if let Some(folder) = &args.report {
        let section = Section {
            heading: String::new(),
            note: String::new(),
            run: &compared.run,
            charts: Vec::new(),
            pictures: pictures_of(&compared)?,
        };
        let title = "Techniques compared".to_owned();
        let report = Report { title, command: output::command(), sections: vec![section] };
        let path = write_report(folder, &report, &json_text(&compared.run)?)?;
        output::tell(&args.json, &format!("report: {}\n\n", path.display()));
    }
    terminal.tell(&compare_text(&compared.run, args.passes));
    session.finish(&spec, &terminal)?;
    failure(&compared.run).map_or(Ok(()), |reason| Err(Failure::Failed(reason)))
}
