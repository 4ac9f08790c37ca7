//! Standard output and standard error: what people read, and JSON.

use std::io::Write as _;

use afterlight_report::{json_text, write_file};
use serde::Serialize;

use crate::args::JsonArgs;
use crate::failure::Failure;

/// Writes JSON where `--json` says; nothing without it.
pub fn json(args: &JsonArgs, value: &impl Serialize) -> Result<(), Failure> {
    let Some(path) = &args.json else { return Ok(()) };
    let text = json_text(value)?;
    if args.on_stdout() {
        print(&text);
        return Ok(());
    }
    Ok(write_file(path, text.as_bytes())?)
}

/// Prints to standard output; a reader that closed the pipe has read enough.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Prints for people: to standard output, or to standard error where JSON takes the former.
pub fn tell(args: &JsonArgs, text: &str) {
    if args.on_stdout() {
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
    } else {
        print(text);
    }
}

/// The command line after the program's name, for readers of reports.
pub fn command() -> String {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    format!("afterlight {}", arguments.join(" "))
}

/// Returns a message as one line: what clap says of usage and help is left out, lines are joined by spaces.
pub fn one_line(message: &str) -> String {
    let mut words = Vec::new();
    for line in message.lines().map(str::trim) {
        if line.starts_with("Usage:") || line.starts_with("For more information") {
            break;
        }
        if !line.is_empty() {
            words.push(line);
        }
    }
    let text = words.join(" ");
    text.strip_prefix("error: ").unwrap_or(&text).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_become_one_line() {
        let message = "error: invalid value 'x' for '--samples <S>'\n  [possible values: 1, 2]\n\nUsage: a\n\nFor more information, try '--help'.\n";
        assert_eq!(one_line(message), "invalid value 'x' for '--samples <S>' [possible values: 1, 2]");
    }
}
