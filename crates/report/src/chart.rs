//! Lines over places in order or over numbers, as SVG within the page.

use maud::{Markup, html};

use crate::format::three_digits;

/// A chart: one value a place for each line.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// What is shown, with its unit.
    pub title: String,
    /// What the places along the horizontal axis are.
    pub places: String,
    /// The lines.
    pub lines: Vec<Line>,
    /// How the axes are divided.
    pub axes: Axes,
}

/// Axes of a chart.
#[derive(Clone, Debug, Default)]
pub enum Axes {
    /// Places at equal steps, values from zero.
    #[default]
    Linear,
    /// Both by powers of ten; what is not above zero is left out.
    Logarithmic {
        /// Where the places are, one number a value of the lines.
        at: Vec<f64>,
    },
}

/// A line of a chart.
#[derive(Clone, Debug)]
pub struct Line {
    /// What it is of.
    pub label: String,
    /// Values at the places; none leaves a gap.
    pub values: Vec<Option<f64>>,
}

/// Width and height of the plotted area and its margins, units of the drawing.
const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 170.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 14.0;
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
    let Some(plot) = Plot::of(chart) else { return html! {} };
    let marks = plot.marks();
    let view_box = format!("0 0 {} {}", LEFT + WIDTH + RIGHT, TOP + HEIGHT + BELOW);
    html! {
        figure.chart {
            figcaption { b { (chart.title) } @if !marks.is_empty() { " over " (chart.places) } }
            svg viewBox=(view_box) role="img" aria-label=(chart.title) {
                @for (share, value) in plot.levels() { (level(share, &plot.number(value))) }
                @for (x, value) in &marks { (mark(*x, &plot.number(*value))) }
                @for (index, line) in chart.lines.iter().enumerate() {
                    @for path in plot.runs(&line.values) {
                        path d=(path) fill="none" stroke=(colour(index)) stroke-width="2" stroke-linecap="round"
                            stroke-dasharray=[dashes(index)] {}
                    }
                }
                @if marks.is_empty() {
                    text x=(LEFT + WIDTH / 2.0) y=(TOP + HEIGHT + 17.0) text-anchor="middle" { (chart.places) }
                }
            }
            div.keys {
                @for (index, line) in chart.lines.iter().enumerate() {
                    span { i.key style={ "background:" (key(index)) } {} (line.label) }
                }
            }
        }
    }
}

fn colour(index: usize) -> String {
    format!("var(--pass-{})", index % COLOURS)
}

/// Lengths of dashes and gaps of a line: lines of one colour have different ones, the first of each none.
fn dashes(index: usize) -> Option<&'static str> {
    ["7 4", "2 4", "9 3 2 3"].get((index / COLOURS).checked_sub(1)?).copied()
}

/// The same as a background.
fn key(index: usize) -> String {
    let colour = colour(index);
    let width_px = match index / COLOURS {
        0 => return colour,
        1 => 4,
        2 => 2,
        _ => 1,
    };
    format!(
        "repeating-linear-gradient(90deg,{colour} 0 {width_px}px,transparent {width_px}px {}px)",
        width_px + 2
    )
}

/// A line across at a share of the height, with its value.
fn level(share: f64, value: &str) -> Markup {
    let y = TOP + HEIGHT * (1.0 - share);
    html! {
        line x1=(LEFT) x2=(LEFT + WIDTH) y1=(y) y2=(y) stroke="var(--line)" {}
        text x=(LEFT - 6.0) y=(y + 4.0) text-anchor="end" { (value) }
    }
}

/// A place on the horizontal axis.
fn mark(x: f64, value: &str) -> Markup {
    html! {
        line x1=(x) x2=(x) y1=(TOP) y2=(TOP + HEIGHT) stroke="var(--line)" {}
        text x=(x) y=(TOP + HEIGHT + 17.0) text-anchor="middle" { (value) }
    }
}

/// Where values stand in the plotted area.
enum Plot<'a> {
    Linear {
        greatest: f64,
    },
    Logarithmic {
        at: &'a [f64],
        /// Powers of ten at the left and right end.
        across: [f64; 2],
        /// Whole powers of ten at the bottom and the top.
        up: [f64; 2],
    },
}

impl<'a> Plot<'a> {
    /// None where there is nothing to draw.
    fn of(chart: &'a Chart) -> Option<Self> {
        let values = chart.lines.iter().flat_map(|line| &line.values).flatten().copied();
        let above_zero = values.filter(|value| value.is_finite() && *value > 0.0);
        let (least, greatest) = bounds(above_zero)?;
        let Axes::Logarithmic { at } = &chart.axes else { return Some(Self::Linear { greatest }) };
        let (first, last) = bounds(at.iter().copied().filter(|place| place.is_finite() && *place > 0.0))?;
        let bottom = least.log10().floor();
        Some(Self::Logarithmic {
            at,
            across: [first.log10(), last.log10()],
            up: [bottom, greatest.log10().ceil().max(bottom + 1.0)],
        })
    }

    /// Shares of the height at which lines go across, with their values.
    fn levels(&self) -> Vec<(f64, f64)> {
        match self {
            Self::Linear { greatest } => (0..=STEPS)
                .map(|step| f64::from(step) / f64::from(STEPS))
                .map(|share| (share, share * greatest))
                .collect(),
            Self::Logarithmic { up: [bottom, top], .. } => {
                let powers = (top - bottom) as u32;
                // No more lines than there is room for.
                let stride = powers.div_ceil(8).max(1);
                (0..=powers)
                    .step_by(stride as usize)
                    .map(|power| {
                        (f64::from(power) / f64::from(powers), 10f64.powf(bottom + f64::from(power)))
                    })
                    .collect()
            }
        }
    }

    /// A number of an axis; powers of ten are told in full while they are short.
    fn number(&self, value: f64) -> String {
        match self {
            Self::Linear { .. } => three_digits(value),
            Self::Logarithmic { .. } if (1e-3..1e4).contains(&value) => format!("{value}"),
            Self::Logarithmic { .. } => format!("{value:.0e}"),
        }
    }

    /// Places that are told on the horizontal axis, with their numbers.
    fn marks(&self) -> Vec<(f64, f64)> {
        match self {
            Self::Linear { .. } => Vec::new(),
            Self::Logarithmic { at, .. } => at
                .iter()
                .enumerate()
                .filter_map(|(index, place)| Some((self.x(index, at.len())?, *place)))
                .collect(),
        }
    }

    /// Where place number `index` of `count` is; none where it has no place.
    fn x(&self, index: usize, count: usize) -> Option<f64> {
        let share = match self {
            Self::Linear { .. } => index as f64 / count.saturating_sub(1).max(1) as f64,
            Self::Logarithmic { at, across: [first, last], .. } => {
                let place = at.get(index).filter(|place| place.is_finite() && **place > 0.0)?;
                if last > first { (place.log10() - first) / (last - first) } else { 0.0 }
            }
        };
        Some(LEFT + WIDTH * share)
    }

    fn y(&self, value: f64) -> Option<f64> {
        let share = match self {
            Self::Linear { greatest } => value / greatest,
            Self::Logarithmic { up: [bottom, top], .. } if value > 0.0 => {
                (value.log10() - bottom) / (top - bottom)
            }
            Self::Logarithmic { .. } => return None,
        };
        Some(TOP + HEIGHT * (1.0 - share))
    }

    /// Path data of each run of values without a gap; a value between gaps is a dot.
    fn runs(&self, values: &[Option<f64>]) -> Vec<String> {
        let mut runs: Vec<String> = Vec::new();
        let mut is_open = false;
        for (index, value) in values.iter().enumerate() {
            let value = value.filter(|value| value.is_finite());
            let point = value.and_then(|value| Some((self.x(index, values.len())?, self.y(value)?)));
            let Some((x, y)) = point else {
                is_open = false;
                continue;
            };
            match runs.last_mut().filter(|_| is_open) {
                Some(run) => *run += &format!("L{x:.1} {y:.1}"),
                None => runs.push(format!("M{x:.1} {y:.1}h0")),
            }
            is_open = true;
        }
        runs
    }
}

/// The least and the greatest; none of nothing.
fn bounds(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |found, value| {
        let (least, greatest) = found.unwrap_or((value, value));
        Some((value.min(least), value.max(greatest)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_part_a_line() {
        let plot = Plot::Linear { greatest: 2.0 };
        let found = plot.runs(&[Some(0.0), Some(2.0), None, Some(1.0)]);
        assert_eq!(found.len(), 2, "{found:?}");
        assert_eq!(found[0], format!("M{LEFT:.1} {:.1}h0L{:.1} {TOP:.1}", TOP + HEIGHT, LEFT + WIDTH / 3.0));
        assert!(
            found[1].starts_with(&format!("M{:.1} {:.1}", LEFT + WIDTH, TOP + HEIGHT / 2.0)),
            "{found:?}"
        );
        assert_eq!(plot.runs(&[Some(f64::NAN), None]), Vec::<String>::new());
    }

    #[test]
    fn logarithmic_axes_go_by_powers_of_ten() {
        let chart = |at: &[f64], values: Vec<Option<f64>>| Chart {
            lines: vec![Line { label: String::new(), values }],
            axes: Axes::Logarithmic { at: at.to_vec() },
            ..Chart::default()
        };
        let one = chart(&[1.0, 10.0, 100.0], vec![Some(0.1), Some(0.0), Some(10.0)]);
        let plot = Plot::of(&one).expect("something to draw");
        let (bottom, right) = (TOP + HEIGHT, LEFT + WIDTH);
        // Nothing is zero powers of ten: a gap.
        assert_eq!(
            plot.runs(&one.lines[0].values),
            [format!("M{LEFT:.1} {bottom:.1}h0"), format!("M{right:.1} {TOP:.1}h0")]
        );
        assert_eq!(plot.x(1, 3), Some(LEFT + WIDTH / 2.0));
        assert_eq!(plot.levels(), [(0.0, 0.1), (0.5, 1.0), (1.0, 10.0)]);
        assert_eq!(plot.marks().len(), 3);
        assert_eq!([0.1, 1000.0, 1e5, 1e-4].map(|value| plot.number(value)), ["0.1", "1000", "1e5", "1e-4"]);
        for (at, values) in [(&[1.0][..], vec![Some(0.0)]), (&[0.0], vec![Some(1.0)])] {
            assert!(Plot::of(&chart(at, values)).is_none());
        }
        let single = chart(&[5.0], vec![Some(3.0)]);
        let plot = Plot::of(&single).expect("one value");
        assert!(plot.runs(&single.lines[0].values)[0].starts_with(&format!("M{LEFT:.1}")));
    }

    #[test]
    fn lines_of_one_colour_are_told_apart() {
        assert_eq!((dashes(0), dashes(COLOURS - 1)), (None, None));
        let of = |index: usize| (colour(index), dashes(index), key(index));
        for index in 1..3 * COLOURS {
            assert!((0..index).all(|other| of(other) != of(index)), "{index}");
        }
    }

    #[test]
    fn a_chart_without_values_is_left_out() {
        let of = |values: Vec<Option<f64>>| {
            let line = Line { label: "a <b>".into(), values };
            charts(&[Chart {
                title: "ms".into(),
                places: "view".into(),
                lines: vec![line],
                ..Chart::default()
            }])
            .into_string()
        };
        assert!(!of(vec![None, Some(0.0)]).contains("svg"));
        let drawn = of(vec![Some(1.0), Some(2.0)]);
        assert!(drawn.contains("<path") && drawn.contains("a &lt;b&gt;"), "{drawn}");
    }
}
