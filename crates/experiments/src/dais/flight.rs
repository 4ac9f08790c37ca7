//! Columns measured in views along a camera path.

use afterlight_lab::{FrameSpec, LabError, Listener, Session};
use afterlight_measure::{RunResult, Spread, Status};
use afterlight_report::text::{Table, grouped, number_text, status_text, table};
use afterlight_report::{Chart, Line, ms_text};
use afterlight_scene::camera::CameraPath;
use afterlight_techniques::Post;
use serde::Serialize;

use super::{
    Column, Conditions, Kind, PAPER, Sizes, Source, Times, broken_off, measure_columns, paper_record,
    reasons_text,
};
use crate::kit::{
    Claim, Header, Outcome, Part, Phase, Row, labelled, phase, run_of, section_note, verdict_text,
};

/// A column in one view.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ViewCell {
    column: &'static str,
    #[serde(skip)]
    kind: Kind,
    technique: String,
    status: Status,
    reason: Option<String>,
    /// Place on the path, 0 to 1.
    at: f32,
    #[serde(flatten)]
    pub(crate) times: Times,
    #[serde(flatten)]
    pub(crate) sizes: Sizes,
    /// Most triangles that reached clipping in one pass over the scene.
    pub(crate) triangles_drawn: Option<u64>,
}

/// The length of edges of a size, and what it makes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Tessellation {
    pub width: u32,
    pub height: u32,
    pub edge_px: f32,
    /// Most triangles drawn in the views that were counted; none where the device does not count or the length was given.
    pub triangles: Option<u64>,
    /// The paper's, scaled by the image's pixels.
    pub paper_triangles: f64,
}

/// Views of one scene at one size.
pub(crate) struct Flight {
    scene: String,
    frame: FrameSpec,
    rows: Vec<Row<ViewCell>>,
    failed: Option<String>,
}

/// What an experiment with camera paths writes as JSON.
#[derive(Serialize)]
struct Figure {
    #[serde(flatten)]
    header: Header,
    /// Views along each path.
    views: u32,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tessellation: Vec<Tessellation>,
    /// A row a view.
    rows: Vec<Row<ViewCell>>,
    /// A column at one size over all views.
    curves: Vec<Curve>,
    claims: Vec<Claim>,
}

/// What an experiment's flights have given so far.
#[derive(Default)]
pub(crate) struct Gathered {
    pub(crate) notes: Vec<String>,
    pub(crate) tessellation: Vec<Tessellation>,
    rows: Vec<Row<ViewCell>>,
    curves: Vec<Curve>,
    claims: Vec<Claim>,
    sections: Vec<Part>,
    failed: Option<String>,
}

impl Gathered {
    pub fn new(notes: Vec<String>) -> Gathered {
        Gathered { notes, ..Gathered::default() }
    }

    /// Adds a scene's flights with the claims on them.
    pub fn add(&mut self, flights: Vec<Flight>, columns: &[Column], claims: Vec<Claim>) {
        let note = section_note(&self.notes, &claims);
        self.claims.extend(claims);
        for flight in flights {
            self.sections.push(flight.part(columns, &note));
            self.curves.extend(flight.curves(columns));
            self.failed = self.failed.take().or(flight.failed);
            self.rows.extend(flight.rows);
        }
    }

    /// Tells the claims and the notes.
    pub fn outcome(
        self,
        asked: &Conditions,
        experiment: &'static str,
        section: &str,
        title: &'static str,
        listener: &dyn Listener,
    ) -> Result<Outcome, LabError> {
        let Gathered { notes, tessellation, rows, curves, claims, sections, failed } = self;
        listener.tell(&verdict_text(&claims, &notes));
        let header = Header::new(experiment, asked.scale, paper_record(section), notes);
        let json =
            serde_json::to_value(&Figure { header, views: asked.views, tessellation, rows, curves, claims })?;
        Ok(Outcome { title, json, sections, failed })
    }
}

/// A column over the views of a flight: median, least and greatest of the views.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Curve {
    scene: String,
    width: u32,
    height: u32,
    tessellate_px: Option<f32>,
    column: &'static str,
    /// The first that is not `ok`.
    status: Status,
    reason: Option<String>,
    geometry_ms: Option<Spread>,
    fill_ms: Option<Spread>,
    shade_ms: Option<Spread>,
    frame_ms: Option<Spread>,
    total_mib: Option<Spread>,
    triangles_drawn: Option<Spread>,
}

/// Places of `count` views on a path: a closed one ends before it is at its start again.
pub(crate) fn places(path: &CameraPath, count: u32) -> impl Iterator<Item = f32> + use<> {
    let spans = if path.closed { count } else { count.saturating_sub(1) }.max(1);
    (0..count).map(move |index| index as f32 / spans as f32)
}

/// Opens a scene whose views go along a path.
pub(crate) fn open(
    source: &Source,
    frame: &mut FrameSpec,
    asked: &Conditions,
    listener: &dyn Listener,
) -> Result<(Session, CameraPath), LabError> {
    if let Some(camera) = &asked.frame.camera {
        let expected = "no camera: the views are those of --path, or of a fly-through";
        return Err(LabError::setting("camera", format!("{camera:?}"), expected));
    }
    Session::open_along(&source.source, frame, asked.path.as_deref(), listener)
}

/// Measures columns in every view, frames in turn, and tells what it found.
pub(crate) fn fly(
    experiment: &str,
    (session, path): (&Session, &CameraPath),
    source: &Source,
    columns: &[Column],
    frame: &FrameSpec,
    asked: &Conditions,
    listener: &dyn Listener,
) -> Result<Flight, LabError> {
    let mut flight = Flight { scene: source.title(), frame: frame.clone(), rows: Vec::new(), failed: None };
    for at in places(path, asked.views) {
        let (renderer, workload) = session.with_settings(|settings| {
            (settings.width_px, settings.height_px) = (frame.width, frame.height);
            settings.effects.tessellation.edge_px = frame.effects.tessellation.edge_px;
            settings.camera = path.at(at);
        })?;
        let (measured, _) = measure_columns(&renderer, columns, &workload, asked.frames, listener)?;
        let results: Vec<RunResult> = measured.into_iter().map(|one| one.result).collect();
        flight.failed = flight.failed.or_else(|| broken_off(columns, &results));
        let cells = columns.iter().zip(&results).map(|(column, result)| cell(column, result, at)).collect();
        let setting = (asked.samples, Post::None);
        let mut run = run_of(session, frame, setting, asked.frames, "none", results);
        run.settings.camera = format!("{} at {at:.3}", path.name);
        flight.rows.push(Row { run, cells });
    }
    listener.tell(&flight.text(experiment, session, asked, &flight.curves(columns)));
    Ok(flight)
}

fn cell(column: &Column, result: &RunResult, at: f32) -> ViewCell {
    ViewCell {
        column: column.label(),
        kind: column.kind,
        technique: result.technique.clone(),
        status: result.status,
        reason: result.reason.clone(),
        at,
        times: Times::of(result),
        sizes: Sizes::of(result),
        triangles_drawn: triangles_drawn(result),
    }
}

/// Most triangles that reached clipping in one pass over the scene; none where no pass counts them.
pub(crate) fn triangles_drawn(result: &RunResult) -> Option<u64> {
    let of_scene = result.passes.iter().filter(|pass| phase(pass) != Some(Phase::Indirect));
    let counts = of_scene.filter_map(|pass| pass.statistics.get("clipping_invocations").copied());
    counts.max().filter(|count| *count > 0)
}

impl Flight {
    pub fn width_px(&self) -> u32 {
        self.frame.width
    }

    /// A column's value in every view.
    pub fn values(&self, kind: Kind, value: impl Fn(&ViewCell) -> Option<f64>) -> Vec<Option<f64>> {
        let of_kind = |row: &Row<ViewCell>| row.cells.iter().find(|cell| cell.kind == kind).and_then(&value);
        self.rows.iter().map(of_kind).collect()
    }

    fn curve(&self, column: &Column) -> Curve {
        let kind = column.kind;
        let spread = |value: fn(&ViewCell) -> Option<f64>| {
            Spread::of(&self.values(kind, value).into_iter().flatten().collect::<Vec<_>>())
        };
        let mut cells = self.rows.iter().flat_map(|row| &row.cells).filter(|cell| cell.kind == kind);
        let told = cells.find(|cell| cell.status != Status::Ok || cell.reason.is_some());
        Curve {
            scene: self.scene.clone(),
            width: self.frame.width,
            height: self.frame.height,
            tessellate_px: self.frame.effects.tessellation.edge_px,
            column: column.label(),
            status: told.map_or(Status::Ok, |cell| cell.status),
            reason: told.and_then(|cell| cell.reason.clone()),
            geometry_ms: spread(|cell| cell.times.geometry_ms),
            fill_ms: spread(|cell| cell.times.fill_ms),
            shade_ms: spread(|cell| cell.times.shade_ms),
            frame_ms: spread(|cell| cell.times.frame_ms),
            total_mib: spread(|cell| cell.sizes.total_mib),
            triangles_drawn: spread(|cell| cell.triangles_drawn.map(|count| count as f64)),
        }
    }

    fn curves(&self, columns: &[Column]) -> Vec<Curve> {
        columns.iter().map(|column| self.curve(column)).collect()
    }

    /// A section of a report: charts over the views, and the figures of the first.
    fn part(&self, columns: &[Column], note: &str) -> Part {
        let labels = columns.iter().map(Column::label);
        let mut run = self.rows[0].run.clone();
        run.results =
            run.results.iter().zip(labels).map(|(result, label)| labelled(result, label, None)).collect();
        let FrameSpec { width, height, .. } = self.frame;
        let chart = |title: &str, value: fn(&ViewCell) -> Option<f64>| Chart {
            title: title.to_owned(),
            places: "views along the camera path".to_owned(),
            lines: columns
                .iter()
                .map(|column| Line {
                    label: column.label().to_owned(),
                    values: self.values(column.kind, value),
                })
                .collect(),
            ..Chart::default()
        };
        Part {
            heading: format!("{}, {width}×{height}", self.scene),
            note: format!("{note}. The table and the passes below are of the first view."),
            run,
            charts: vec![
                chart("geometry pass, ms", |cell| cell.times.geometry_ms),
                chart("shading, ms", |cell| cell.times.shade_ms),
                chart("memory, MiB", |cell| cell.sizes.total_mib),
            ],
            pictures: Vec::new(),
        }
    }

    /// What the terminal shows.
    fn text(&self, experiment: &str, session: &Session, asked: &Conditions, curves: &[Curve]) -> String {
        let device = &session.device;
        let tessellated = self
            .frame
            .effects
            .tessellation
            .edge_px
            .map_or_else(String::new, |px| format!(", tessellated to {px:.2} pixels"));
        format!(
            "{experiment}: {} on {} ({}): {} triangles, {}×{}, {} samples{tessellated}, {} views, median (least – greatest of the views), {} frame(s) each, in turn; paper: {}\n\n{}\n{}\n",
            self.scene,
            device.name,
            device.kind,
            grouped(session.scene.triangles),
            self.frame.width,
            self.frame.height,
            asked.samples,
            asked.views,
            asked.frames,
            PAPER.source.device,
            curves_table(curves),
            reasons_text(curves.iter().map(|curve| (curve.column, curve.status, curve.reason.as_deref()))),
        )
    }
}

fn curves_table(curves: &[Curve]) -> Table {
    let heading = [
        "column",
        "status",
        "geometry ms",
        "fill ms",
        "shading ms",
        "frame ms",
        "memory MiB",
        "triangles drawn",
    ];
    let mut table = table(&heading, 2);
    let spread = |spread: Option<Spread>, text: fn(f64) -> String| {
        spread.map_or_else(
            || "–".to_owned(),
            |s| format!("{} ({} – {})", text(s.median), text(s.min), text(s.max)),
        )
    };
    for curve in curves {
        table.add_row([
            curve.column.to_owned(),
            status_text(curve.status).to_owned(),
            spread(curve.geometry_ms, ms_text),
            spread(curve.fill_ms, ms_text),
            spread(curve.shade_ms, ms_text),
            spread(curve.frame_ms, ms_text),
            spread(curve.total_mib, |mib| number_text(Some(mib), 2)),
            spread(curve.triangles_drawn, |count| grouped(count as u64)),
        ]);
    }
    table
}

/// A value over another, view by view.
pub(crate) fn ratios(values: &[Option<f64>], over: &[Option<f64>]) -> Vec<f64> {
    values.iter().zip(over).filter_map(|(value, over)| Some((*value)? / (*over)?)).collect()
}

/// A claim on ratios of every view: `met` judges their spread.
pub(crate) fn claim(
    claim: &str,
    scene: String,
    column: &'static str,
    ratios: &[f64],
    paper: Option<f64>,
    as_in_paper: bool,
    met: impl FnOnce(Spread) -> Option<bool>,
) -> Claim {
    let spread = Spread::of(ratios);
    Claim {
        claim: claim.to_owned(),
        scene,
        column,
        ratio: spread.map(|spread| spread.median),
        least: spread.map(|spread| spread.min),
        greatest: spread.map(|spread| spread.max),
        paper,
        met: spread.and_then(met),
        as_in_paper,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use afterlight_measure::{Buffer, BufferRole, Memory, Pass, PassRole, PassWork};

    /// The paper's conditions.
    pub fn conditions() -> Conditions {
        Conditions {
            scale: 1.0,
            scenes: Vec::new(),
            techniques: vec!["all".to_owned()],
            frames: 5,
            samples: super::super::PAPER_SAMPLES,
            path: None,
            views: 16,
            frame: FrameSpec::default(),
        }
    }

    /// A flight whose columns have a geometry time and a total of memory in each view.
    pub fn flight(width: u32, columns: &[(Kind, &[(f64, u64)])]) -> Flight {
        let frame = FrameSpec { width, ..FrameSpec::default() };
        let views = columns.first().map_or(0, |(_, views)| views.len());
        let cell_of = |(kind, views): &(Kind, &[(f64, u64)]), view: usize| {
            let (geometry_ms, mib) = views[view];
            let mut result = RunResult::without_figures(kind.technique(), Status::Ok, "");
            result.reason = None;
            let pass = |name: &str, role: PassRole, ms: f64, triangles: u64| Pass {
                name: name.into(),
                role: Some(role),
                work: Some(PassWork::Raster),
                ms: Spread::of(&[ms]),
                reads: Vec::new(),
                writes: Vec::new(),
                statistics: [("clipping_invocations".to_owned(), triangles)].into(),
            };
            result.passes = vec![
                pass("shared/rsm", PassRole::Shared, 100.0, 900),
                pass(&format!("{}/gbuffer", kind.technique()), PassRole::Geometry, geometry_ms, 70),
                pass(&format!("{}/shade", kind.technique()), PassRole::Shading, 50.0, 0),
            ];
            let buffers = vec![Buffer {
                name: "dais/ids".into(),
                role: Some(BufferRole::Visibility),
                bytes: mib << 20,
            }];
            result.memory = Some(Memory { technique_bytes: 0, peak_bytes: 0, buffers });
            cell(&Column { kind: *kind, setup: None }, &result, view as f32)
        };
        let rows = (0..views)
            .map(|view| Row {
                run: serde_json::from_value(serde_json::json!({
                    "schema": 1, "device": {"name": "", "driver": "", "api": "", "type": ""},
                    "scene": {"name": "", "triangles": 0, "draws": 0, "lights": 0},
                    "settings": {"width": 0, "height": 0, "samples": 1, "frames": 1, "camera": "", "reference": "",
                        "light_seed": null, "version": ""},
                    "results": [],
                }))
                .expect("a run"),
                cells: columns.iter().map(|column| cell_of(column, view)).collect(),
            })
            .collect();
        Flight { scene: "s".into(), frame, rows, failed: None }
    }

    #[test]
    fn a_closed_path_ends_before_its_start() {
        let path = |closed: bool| {
            let keyframe = serde_json::json!({"eye_ws": [0, 0, 1], "target_ws": [0, 0, 0], "fov_deg": 60});
            let json = serde_json::json!({"name": "p", "closed": closed, "keyframes": [keyframe]});
            CameraPath::from_json(&json.to_string(), std::path::Path::new("p.json")).expect("a path")
        };
        let at = |closed: bool, count: u32| places(&path(closed), count).collect::<Vec<_>>();
        assert_eq!(at(true, 4), [0.0, 0.25, 0.5, 0.75]);
        assert_eq!(at(false, 5), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!((at(false, 1), at(true, 1)), (vec![0.0], vec![0.0]));
    }

    #[test]
    fn curves_are_of_all_views_and_leave_the_lights_view_out() {
        let flight = flight(100, &[(Kind::Deferred, &[(2.0, 10), (4.0, 10), (3.0, 16)])]);
        let column = Column { kind: Kind::Deferred, setup: None };
        let curve = flight.curve(&column);
        assert_eq!(curve.geometry_ms, Some(Spread { median: 3.0, min: 2.0, max: 4.0 }));
        assert_eq!(curve.total_mib, Some(Spread { median: 10.0, min: 10.0, max: 16.0 }));
        assert_eq!(curve.triangles_drawn.map(|count| count.max), Some(70.0));
        assert_eq!(flight.part(&[column], "note").charts[0].lines[0].values.len(), 3);
    }

    #[test]
    fn ratios_need_both_values() {
        assert_eq!(ratios(&[Some(3.0), None, Some(1.0)], &[Some(2.0), Some(1.0), None]), [1.5]);
    }
}
