//! Lines over the views of a camera path, as SVG within the page.

use maud::{Markup, html};

use crate::format::three_digits;

/// A chart: one value a view for each line.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What is shown, with its unit.
    pub title: String,
    /// What the places along the horizontal axis are.
    pub places: String,
    /// The lines.
    pub lines: Vec<Line>,
}

/// A line of a chart.
#[derive(Clone, Debug)]
pub struct Line {
    /// What it is of.
    pub label: String,
    /// Values at even places; none leaves a gap.
    pub values: Vec<Option<f64>>,
}

/// Width and height of the plotted area and its margins, units of the drawing.
const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 170.0;
const LEFT: f64 = 56.0;
const TOP: f64 = 8.0;
const BELOW: f64 = 22.0;
/// Lines across the plotted area.
const STEPS: u32 = 4;
/// Number of colours that lines take in turn (`--pass-0` and on in the style sheet).
const COLOURS: usize = 8;

pub(crate) fn charts(charts: &[Chart]) -> Markup {
    html! {
        @if !charts.is_empty() { div.charts { @for one in charts { (chart(one)) } } }
    }
}

fn chart(chart: &Chart) -> Markup {
    let values = chart.lines.iter().flat_map(|line| &line.values).flatten();
    let greatest = values.copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
    if greatest <= 0.0 {
        return html! {};
    }
    let view_box = format!("0 0 {} {}", LEFT + WIDTH + 8.0, TOP + HEIGHT + BELOW);
    html! {
        figure.chart {
            figcaption { b { (chart.title) } }
            svg viewBox=(view_box) role="img" aria-label=(chart.title) {
                @for step in 0..=STEPS { (level(f64::from(step) / f64::from(STEPS), greatest)) }
                @for (index, line) in chart.lines.iter().enumerate() {
                    @for path in runs(&line.values, greatest) {
                        path d=(path) fill="none" stroke=(colour(index)) stroke-width="2" stroke-linecap="round" {}
                    }
                }
                text x=(LEFT + WIDTH / 2.0) y=(TOP + HEIGHT + 17.0) text-anchor="middle" { (chart.places) }
            }
            div.keys {
                @for (index, line) in chart.lines.iter().enumerate() {
                    span { i.key style={ "background:" (colour(index)) } {} (line.label) }
                }
            }
        }
    }
}

fn colour(index: usize) -> String {
    format!("var(--pass-{})", index % COLOURS)
}

/// A line across at a share of the greatest value, with the value.
fn level(share: f64, greatest: f64) -> Markup {
    let y = TOP + HEIGHT * (1.0 - share);
    html! {
        line x1=(LEFT) x2=(LEFT + WIDTH) y1=(y) y2=(y) stroke="var(--line)" {}
        text x=(LEFT - 6.0) y=(y + 4.0) text-anchor="end" { (three_digits(share * greatest)) }
    }
}

/// Path data of each run of values without a gap; a value between gaps is a dot.
fn runs(values: &[Option<f64>], greatest: f64) -> Vec<String> {
    let spans = values.len().saturating_sub(1).max(1) as f64;
    let mut runs: Vec<String> = Vec::new();
    let mut is_open = false;
    for (index, value) in values.iter().enumerate() {
        let Some(value) = value.filter(|value| value.is_finite()) else {
            is_open = false;
            continue;
        };
        let x = LEFT + WIDTH * index as f64 / spans;
        let y = TOP + HEIGHT * (1.0 - value / greatest);
        match runs.last_mut().filter(|_| is_open) {
            Some(run) => *run += &format!("L{x:.1} {y:.1}"),
            None => runs.push(format!("M{x:.1} {y:.1}h0")),
        }
        is_open = true;
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_part_a_line() {
        let found = runs(&[Some(0.0), Some(2.0), None, Some(1.0)], 2.0);
        assert_eq!(found.len(), 2, "{found:?}");
        assert_eq!(found[0], format!("M{LEFT:.1} {:.1}h0L{:.1} {TOP:.1}", TOP + HEIGHT, LEFT + WIDTH / 3.0));
        assert!(
            found[1].starts_with(&format!("M{:.1} {:.1}", LEFT + WIDTH, TOP + HEIGHT / 2.0)),
            "{found:?}"
        );
        assert_eq!(runs(&[Some(f64::NAN), None], 2.0), Vec::<String>::new());
    }

    #[test]
    fn a_chart_without_values_is_left_out() {
        let of = |values: Vec<Option<f64>>| {
            let line = Line { label: "a <b>".into(), values };
            charts(&[Chart { title: "ms".into(), places: "view".into(), lines: vec![line] }]).into_string()
        };
        assert!(!of(vec![None, Some(0.0)]).contains("svg"));
        let drawn = of(vec![Some(1.0), Some(2.0)]);
        assert!(drawn.contains("<path") && drawn.contains("a &lt;b&gt;"), "{drawn}");
    }
}
