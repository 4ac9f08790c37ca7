//! `cargo xtask NAME`: the project's chores.

use std::{
    path::Path,
    process::{Command, ExitCode},
};

use xtask::{Error, arrows, new_technique, workspace};

const HELP: &str = "\
cargo xtask arrows                              checks the direction of imports: crates, folders, shaders
cargo xtask new-technique ID [--title TEXT]     makes the folder of a new technique
cargo xtask tables [--check]                    fills the generated tables of the documents, or checks them";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        ["arrows"] => check_arrows(),
        ["new-technique", id] => make_technique(id, None),
        ["new-technique", id, "--title", title] => make_technique(id, Some(title)),
        ["tables"] => tables(true),
        ["tables", "--check"] => tables(false),
        ["help" | "--help" | "-h"] => {
            println!("{HELP}");
            Ok(ExitCode::SUCCESS)
        }
        _ => {
            eprintln!("xtask: found `{}`, expected one of:\n{HELP}", arguments.join(" "));
            return ExitCode::from(2);
        }
    };
    done.unwrap_or_else(|error| {
        eprintln!("xtask: {error}");
        ExitCode::from(2)
    })
}

/// Prints every broken arrow.
fn check_arrows() -> Result<ExitCode, Error> {
    let broken = arrows::check(&workspace(), &arrows::TABLE)?;
    for arrow in &broken {
        println!("{arrow}");
    }
    println!("{} broken arrows", broken.len());
    Ok(if broken.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn make_technique(id: &str, title: Option<&str>) -> Result<ExitCode, Error> {
    let folder = new_technique::make(&workspace(), id, title)?;
    println!("{}", folder.display());
    format_code(&folder)?;
    Ok(ExitCode::SUCCESS)
}

/// Formats the Rust files of a folder: where lines break depends on the length of the id.
fn format_code(folder: &Path) -> Result<(), Error> {
    let files = std::fs::read_dir(folder).map_err(|error| Error(format!("{}: {error}", folder.display())))?;
    let files = files.filter_map(Result::ok).map(|entry| entry.path());
    let files = files.filter(|path| path.extension().is_some_and(|extension| extension == "rs"));
    let status = Command::new("rustfmt").args(["--edition", "2024"]).args(files).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Error(format!("rustfmt: found {status}, expected success"))),
        Err(error) => Err(Error(format!("cannot run rustfmt: {error}"))),
    }
}

/// Runs the test that compares the generated tables with the registry; with `write` it rewrites them instead. The registry is read by a test of
/// the crate of techniques, so that this program need not be linked with it.
fn tables(write: bool) -> Result<ExitCode, Error> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(["test", "--quiet", "--package", "afterlight-techniques", "--test", "tables"]);
    command.current_dir(workspace());
    if write {
        command.env("AFTERLIGHT_BLESS", "1");
    } else {
        command.env_remove("AFTERLIGHT_BLESS");
    }
    let status = command.status().map_err(|error| Error(format!("cannot run cargo: {error}")))?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
