//! The page.

use afterlight_measure::{Pass, Run, RunResult, Status};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::chart::charts;
use crate::format::{bytes_text, ms_text, psnr_text};
use crate::{Picture, Report, Section};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

pub(crate) fn page(report: &Report<'_>) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (report.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { (report.title) }
                    @if let Some(section) = report.sections.first() { (device(section.run)) }
                    @if !report.command.is_empty() { pre.command { (report.command) } }
                }
                main { @for one in &report.sections { (section(one)) } }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    }
}

fn device(run: &Run) -> Markup {
    html! {
        p.facts {
            b { (run.device.name) } " (" (run.device.kind) "), driver " (run.device.driver)
            ", Vulkan " (run.device.api) ", afterlight " (run.settings.version)
        }
    }
}

fn section(section: &Section<'_>) -> Markup {
    let (run, settings) = (section.run, &section.run.settings);
    html! {
        section {
            @if !section.heading.is_empty() { h2 { (section.heading) } }
            p.facts {
                b { (run.scene.name) } ": " (grouped(run.scene.triangles)) " triangles, "
                (grouped(run.scene.draws)) " draws, " (grouped(run.scene.lights)) " lights; "
                (settings.width) "×" (settings.height) ", "
                (settings.samples) @if settings.samples == 1 { " sample" } @else { " samples" } " a pixel, "
                @if settings.post != "none" { (settings.post) ", " }
                @if let Some(px) = settings.tessellate_px { "tessellated to " (px) " pixels, " }
                @if settings.shadows != "none" { "shadows by " (settings.shadows) ", " }
                @if settings.indirect != "none" { "indirect light by " (settings.indirect) ", " }
                "median of " (settings.frames) @if settings.frames == 1 { " frame" } @else { " frames" }
                "; images compared to " code { (settings.reference) }
            }
            @if !section.note.is_empty() { p { (section.note) } }
            (charts(&section.charts))
            (table(run))
            (bars(run))
            (pictures(&section.pictures))
            (details(run))
        }
    }
}

fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A cell that sorts by a number; cells without one sort last.
fn number_cell(value: Option<f64>, text: String) -> Markup {
    html! { td.number data-value=[value.filter(|value| !value.is_nan())] { (text) } }
}

fn table(run: &Run) -> Markup {
    let best_ms =
        run.results.iter().filter_map(|result| Some(result.frame_ms?.median)).fold(f64::INFINITY, f64::min);
    html! {
        div.scroll {
            table.sortable {
                thead { tr {
                    th { "technique" } th { "status" } th.number { "frame, ms" } th.number { "least – greatest" }
                    th.number { "× fastest" } th.number { "technique memory" } th.number { "peak memory" }
                    th.number { "PSNR, dB" } th.number { "greatest error" } th.number { "FLIP" }
                } }
                tbody { @for result in &run.results { (row(result, best_ms)) } }
            }
        }
    }
}

fn row(result: &RunResult, best_ms: f64) -> Markup {
    let frame = result.frame_ms;
    let memory = result.memory.as_ref();
    let difference = result.difference;
    let status = match result.status {
        Status::Ok => "ok",
        Status::Unavailable => "unavailable",
        Status::Failed => "failed",
    };
    let text_or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    html! {
        tr {
            td { code { (result.technique) } }
            td class=(status) title=[result.reason.as_deref()] {
                (status) @if let Some(reason) = &result.reason { small { " " (reason) } }
            }
            (number_cell(frame.map(|f| f.median), text_or_dash(frame.map(|f| ms_text(f.median)))))
            (number_cell(frame.map(|f| f.min), text_or_dash(frame.map(|f| format!("{} – {}", ms_text(f.min), ms_text(f.max))))))
            (number_cell(frame.map(|f| f.median / best_ms), text_or_dash(frame.map(|f| format!("{:.2}", f.median / best_ms)))))
            (number_cell(memory.map(|m| m.technique_bytes as f64), text_or_dash(memory.map(|m| bytes_text(m.technique_bytes)))))
            (number_cell(memory.map(|m| m.peak_bytes as f64), text_or_dash(memory.map(|m| bytes_text(m.peak_bytes)))))
            (number_cell(difference.map(|d| d.psnr_db), text_or_dash(difference.map(|d| psnr_text(d.psnr_or_infinity_db())))))
            (number_cell(difference.map(|d| f64::from(d.max_abs)), text_or_dash(difference.map(|d| d.max_abs.to_string()))))
            (number_cell(difference.and_then(|d| d.flip), text_or_dash(difference.and_then(|d| d.flip).map(|flip| format!("{flip:.4}")))))
        }
    }
}

/// Number of colours that passes take in turn (`--pass-0` and on in the style sheet).
const PASS_COLOURS: usize = 8;

fn bars(run: &Run) -> Markup {
    let total = |result: &RunResult| -> f64 { result.passes.iter().map(pass_ms).sum() };
    let longest = run.results.iter().map(total).fold(0.0, f64::max);
    if longest <= 0.0 {
        return html! {};
    }
    html! {
        h3 { "Where the time goes" }
        div.bars {
            @for result in run.results.iter().filter(|result| !result.passes.is_empty()) {
                div.name { code { (result.technique) } }
                div.bar {
                    @for (index, pass) in result.passes.iter().enumerate() {
                        span style={ "width:" (format!("{:.3}", 100.0 * pass_ms(pass) / longest)) "%;background:var(--pass-" (index % PASS_COLOURS) ")" }
                            title={ (pass.name) ": " (ms_text(pass_ms(pass))) " ms" } {}
                    }
                    em { (ms_text(total(result))) " ms" }
                }
            }
        }
    }
}

fn pass_ms(pass: &Pass) -> f64 {
    pass.ms.map_or(0.0, |ms| ms.median)
}

fn data_uri(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", BASE64.encode(png))
}

fn pictures(pictures: &[Picture]) -> Markup {
    if pictures.is_empty() {
        return html! {};
    }
    html! {
        h3 { "Images" }
        div.pictures {
            @for picture in pictures {
                figure {
                    img src=(data_uri(&picture.image_png)) alt={ "Image of " (picture.technique) } loading="lazy";
                    @if let Some(difference) = &picture.difference_png {
                        img src=(data_uri(difference)) alt={ "Difference of " (picture.technique) } loading="lazy";
                    }
                    figcaption { code { (picture.technique) } " " (picture.difference_caption) }
                }
            }
        }
    }
}

fn details(run: &Run) -> Markup {
    html! {
        @for result in run.results.iter().filter(|result| result.frame_ms.is_some()) {
            details {
                summary { code { (result.technique) } ": passes, memory, parameters" }
                div.columns {
                    div { (passes(result)) }
                    div { (memory(result)) }
                    div { (facts(result)) }
                }
            }
        }
    }
}

fn passes(result: &RunResult) -> Markup {
    html! {
        table.sortable {
            thead { tr { th { "pass" } th.number { "ms" } th.number { "vertex runs" } th.number { "fragment runs" } th.number { "compute runs" } } }
            tbody {
                @for (index, pass) in result.passes.iter().enumerate() {
                    tr {
                        td { i.key style={ "background:var(--pass-" (index % PASS_COLOURS) ")" } {} (pass.name) }
                        (number_cell(pass.ms.map(|ms| ms.median), pass.ms.map_or("–".to_owned(), |ms| ms_text(ms.median))))
                        @for name in ["vertex_invocations", "fragment_invocations", "compute_invocations"] {
                            @let count = pass.statistics.get(name).copied().filter(|count| *count > 0);
                            (number_cell(count.map(|count| count as f64), count.map_or("–".to_owned(), grouped)))
                        }
                    }
                }
            }
        }
    }
}

fn memory(result: &RunResult) -> Markup {
    html! {
        @if let Some(memory) = &result.memory {
            table.sortable {
                thead { tr { th { "buffer or image" } th.number { "bytes" } } }
                tbody {
                    @for buffer in &memory.buffers {
                        tr { td { (buffer.name) } (number_cell(Some(buffer.bytes as f64), bytes_text(buffer.bytes))) }
                    }
                }
            }
        }
    }
}

fn facts(result: &RunResult) -> Markup {
    html! {
        table {
            tbody {
                @for (key, value) in &result.params { tr { td { (key) } td.number { (plain(value)) } } }
                @for (key, value) in &result.counters { tr { td { (key) } td.number { (plain(value)) } } }
                @if let Some(record) = result.record_ms {
                    tr { td { "CPU time to record, ms" } td.number { (ms_text(record.median)) } }
                }
                @if let Some(cost) = result.cost {
                    @for (key, value) in [("cmd", cost.cmd), ("proc", cost.proc), ("mem", cost.mem), ("band", cost.band)] {
                        tr { td { "predicted " (key) } td.number { (format!("{value:.3e}")) } }
                    }
                }
            }
        }
    }
}

fn plain(value: &serde_json::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}
