//! Tables for the terminal.

use afterlight_measure::{Run, RunResult, Status};
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, TableStyle};

use crate::{bytes_text, ms_text, psnr_text};

pub use comfy_table::Table;

/// Lines above, below and under the heading, none between rows.
const STYLE: TableStyle = TableStyle::new()
    .top_border(LineStyle::none().fill('─').junction('─'))
    .header_separator(LineStyle::none().fill('─').junction('─'))
    .bottom_border(LineStyle::none().fill('─').junction('─'));

/// Makes a table with a heading; `left` columns are of text, the others of numbers.
pub fn table(heading: &[&str], left: usize) -> Table {
    let mut table = Table::new();
    table.load_style(STYLE);
    table.set_content_arrangement(ContentArrangement::Dynamic);
    table.set_header(heading.iter().copied());
    for index in left..heading.len() {
        if let Some(column) = table.column_mut(index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// Returns a whole number with a thin space between groups of three digits.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// A number of a table, or a dash.
pub fn number_text(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
}

/// How a result ended, as tables tell it.
pub fn status_text(status: Status) -> &'static str {
    match status {
        Status::Ok => "ok",
        Status::Unavailable => "unavailable",
        Status::Failed => "failed",
    }
}

/// Results of a run in the given order: times, memory, differences.
pub fn technique_table(run: &Run, results: &[&RunResult]) -> Table {
    let psnr = format!("PSNR to {}", run.settings.reference);
    let heading =
        ["technique", "status", "frame ms", "min – max", "record ms", "memory", "peak", &psnr, "max", "FLIP"];
    let mut table = table(&heading, 2);
    for result in results {
        let dash = || "–".to_owned();
        let (frame, memory, difference) = (result.frame_ms, result.memory.as_ref(), result.difference);
        table.add_row([
            result.technique.clone(),
            status_text(result.status).to_owned(),
            frame.map_or_else(dash, |f| ms_text(f.median)),
            frame.map_or_else(dash, |f| format!("{} – {}", ms_text(f.min), ms_text(f.max))),
            result.record_ms.map_or_else(dash, |r| ms_text(r.median)),
            memory.map_or_else(dash, |m| bytes_text(m.technique_bytes)),
            memory.map_or_else(dash, |m| bytes_text(m.peak_bytes)),
            difference.map_or_else(dash, |d| psnr_text(d.psnr_or_infinity_db())),
            difference.map_or_else(dash, |d| d.max_abs.to_string()),
            difference.and_then(|d| d.flip).map_or_else(dash, |flip| format!("{flip:.4}")),
        ]);
    }
    table
}

/// The passes of a run's results.
pub fn pass_table(run: &Run) -> Table {
    let mut table = table(&["pass", "ms", "share", "vertex runs", "fragment runs", "compute runs"], 1);
    for result in &run.results {
        let total: f64 = result.passes.iter().filter_map(|pass| Some(pass.ms?.median)).sum();
        for pass in &result.passes {
            let ms = pass.ms.map_or(0.0, |ms| ms.median);
            let count = |name: &str| match pass.statistics.get(name) {
                Some(0) | None => "–".to_owned(),
                Some(count) => grouped(*count),
            };
            // Passes that techniques share (tone mapping) do not carry the technique's name.
            let name = match pass.name.starts_with(&result.technique) {
                true => pass.name.clone(),
                false => format!("{}: {}", result.technique, pass.name),
            };
            table.add_row([
                name,
                ms_text(ms),
                if total > 0.0 { format!("{:.0}%", 100.0 * ms / total) } else { "–".to_owned() },
                count("vertex_invocations"),
                count("fragment_invocations"),
                count("compute_invocations"),
            ]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1 000", "1 234 567"]);
    }
}
