//! `bench dais-fig6`: attributes from triangle records against those that the rasteriser interpolates (Schied and Dachsbacher
//! 2015, Figure 6): distance of positions in the scene scaled into [−1, 1]³, difference of texture look-ups.
//!
//! The paper shows images of Sponza and San Miguel and gives no figures; a run without `--scenes` stands in for them by the
//! built-in scene, and says so.

use std::sync::LazyLock;

use afterlight_image::{Rgba8Image, encode_png};
use afterlight_lab::spec::check_samples;
use afterlight_lab::{
    Chosen, FrameSpec, LabError, Listener, Measured, Session, Setup, choose, measure_and, renderer_with,
};
use afterlight_measure::{RunResult, SCHEMA, Status};
use afterlight_renderer::Prepared;
use afterlight_report::Picture;
use afterlight_report::text::{self, grouped};
use afterlight_techniques::{Post, TechniqueError, registry, view};
use serde::{Deserialize, Serialize};

use crate::kit::{
    FULL_HD_PX, Options, Outcome, PaperWords, Row, Specification, Table, all_techniques, at_size, broken_off,
    check_run, default_scenes, notes_text, paper_data, reasons_text,
};

/// What the experiment is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Share of the frame's width and height, above 0, at most 1.
    pub scale: f64,
    /// Scenes.
    pub scenes: Vec<String>,
    /// Techniques by their ids, `all` for those that have the views.
    pub techniques: Vec<String>,
    /// Samples a pixel: 1, 2, 4, 8 or 16.
    pub samples: u32,
    /// What frames look like; `samples`, `post` and `view` do not count.
    pub frame: FrameSpec,
}

impl Default for Spec {
    fn default() -> Spec {
        Spec {
            scale: 1.0,
            scenes: default_scenes(),
            techniques: all_techniques(),
            samples: 1,
            frame: FrameSpec { width: FULL_HD_PX.0, height: FULL_HD_PX.1, ..FrameSpec::default() },
        }
    }
}

impl Specification for Spec {
    const NAME: &'static str = "dais-fig6";
    const SUMMARY: &'static str = "attributes from triangle records against the rasteriser's";

    fn from_options(options: &Options) -> Spec {
        let own = Spec::default();
        Spec {
            scale: options.scale.unwrap_or(own.scale),
            scenes: options.scenes.clone().unwrap_or(own.scenes),
            techniques: options.techniques.clone().unwrap_or(own.techniques),
            samples: options.samples.unwrap_or(own.samples),
            frame: options.frame_at(FULL_HD_PX),
        }
    }

    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError> {
        run(self, listener)
    }
}

/// What the paper says of it.
static PAPER: LazyLock<PaperWords> = LazyLock::new(|| paper_data(include_str!("paper.json")));

/// Errors of the pixels of an image that were compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct Errors {
    /// Pixels that were compared: the triangle at their centre is one that they refer to.
    compared_pixels: u64,
    /// Distance of positions, the scene's longest side being 2.
    position_max: f64,
    position_mean: f64,
    /// Largest difference of a channel of linear base colour.
    texture_max: f64,
    texture_mean: f64,
}

/// Figures of a technique in a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Cell {
    column: String,
    technique: String,
    samples: u32,
    status: Status,
    reason: Option<String>,
    pixels: u64,
    errors: Option<Errors>,
}

/// What `bench dais-fig6` writes as JSON.
#[derive(Serialize)]
struct Figure6 {
    schema: u32,
    experiment: &'static str,
    scale: f64,
    paper: PaperWords,
    notes: Vec<String>,
    rows: Vec<Row<Cell>>,
}

/// A technique's figures and its two images.
struct Compared {
    result: RunResult,
    errors: Option<Errors>,
    position: Option<Rgba8Image>,
    texture: Option<Rgba8Image>,
}

fn run(spec: &Spec, listener: &dyn Listener) -> Result<Outcome, LabError> {
    check_run(spec.scale, 1, &spec.frame)?;
    check_samples(spec.samples)?;
    let frame = FrameSpec { samples: spec.samples, ..at_size(&spec.frame, spec.scale) };
    let setups = setups(spec)?;
    let notes = notes(spec, &frame);
    let (mut rows, mut sections, mut failed) = (Vec::new(), Vec::new(), None);
    for scene in &spec.scenes {
        let session = Session::open(scene, &frame, false, listener)?;
        let compared = setups
            .iter()
            .map(|setup| compare(&session, setup, listener.wants_pictures()))
            .collect::<Result<Vec<_>, _>>()?;
        session.finish(&frame, listener)?;
        let cells: Vec<Cell> =
            setups.iter().zip(&compared).map(|(setup, one)| cell(setup, one, &frame)).collect();
        let drawn = pictures_of(&setups, &cells, &compared)?;
        let results: Vec<RunResult> = compared.into_iter().map(|one| one.result).collect();
        let labels = setups.iter().map(|setup| setup.label.as_str());
        failed = failed.or_else(|| broken_off(labels.zip(&results)));
        let table = Table {
            setups: setups.iter().collect(),
            remarks: cells.iter().map(|cell| cell.errors.map(remark)).collect(),
            results,
            cells: cells.into_iter().map(|cell| vec![cell]).collect(),
        };
        listener.tell(&table_text(&session, &frame, &table, &notes));
        rows.extend(table.rows(&session, &frame, 1, "rasteriser"));
        let heading = format!("{scene}, ");
        let mut parts =
            table.parts(&session, &frame, 1, "rasteriser", &heading, &format!("The paper: {}", PAPER.says));
        if let Some(first) = parts.first_mut() {
            first.pictures = drawn;
        }
        sections.extend(parts);
    }
    let json = serde_json::to_value(&Figure6 {
        schema: SCHEMA,
        experiment: Spec::NAME,
        scale: spec.scale,
        paper: PAPER.clone(),
        notes,
        rows,
    })?;
    Ok(Outcome { title: "Errors of attributes from triangle records", json, sections, failed })
}

/// Techniques that have the views, or those of them that are asked for.
fn setups(spec: &Spec) -> Result<Vec<Setup>, LabError> {
    let having: Vec<&str> = registry()
        .iter()
        .map(|technique| technique.info())
        .filter(|info| info.views.contains(&view::ATTRIBUTE_ERROR))
        .map(|info| info.id)
        .collect();
    let ids: Vec<String> = match spec.techniques.iter().all(|id| id.trim() != "all") {
        true => spec.techniques.clone(),
        false => having.iter().map(|id| (*id).to_owned()).collect(),
    };
    if let Some(other) = ids.iter().find(|id| !having.contains(&id.trim())) {
        let expected = format!("some of: {}", having.join(", "));
        return Err(LabError::setting("techniques", format!("{other:?}"), expected));
    }
    let chosen = choose("techniques", &ids, &spec.frame.set)?;
    let samples = spec.samples;
    let setup = |chosen: Chosen| Setup {
        label: format!("{} {samples}x", chosen.id()),
        samples,
        post: Post::None,
        chosen,
    };
    Ok(chosen.into_iter().map(setup).collect())
}

/// Draws the views of a technique, and reads the errors.
fn compare(session: &Session, setup: &Setup, with_pictures: bool) -> Result<Compared, LabError> {
    let mut errors = None;
    let read = |prepared: &mut Prepared| {
        errors = Some(read_errors(prepared, setup.chosen.id())?);
        Ok(())
    };
    let Measured { result, image: position, .. } = shown(session, setup, view::ATTRIBUTE_ERROR, read)?;
    let texture = match with_pictures && result.status == Status::Ok {
        true => shown(session, setup, view::TEXTURE_ERROR, |_| Ok(()))?.image,
        false => None,
    };
    Ok(Compared { result, errors, position, texture })
}

fn shown(
    session: &Session,
    setup: &Setup,
    view: &str,
    read: impl FnOnce(&mut Prepared) -> Result<(), TechniqueError>,
) -> Result<Measured, LabError> {
    let renderer = renderer_with(&session.renderer, |settings| {
        settings.samples = setup.samples;
        settings.view = view.to_owned();
    })?;
    Ok(measure_and(&renderer, &setup.chosen, &session.workload, 0, read, || {})?)
}

fn read_errors(prepared: &mut Prepared, technique: &str) -> Result<Errors, TechniqueError> {
    let bytes = prepared.executor().read_buffer(&*format!("{technique}/{}", view::ATTRIBUTE_ERRORS))?;
    let float = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    Ok(summed(bytes.chunks_exact(8).map(|pixel| [float(pixel), float(&pixel[4..])])))
}

/// Largest and mean errors of pixels: position and texture look-up, negative where nothing was compared.
fn summed(pixels: impl Iterator<Item = [f32; 2]>) -> Errors {
    let mut errors = Errors::default();
    // What is not a number is compared as well, and fails by being the largest.
    for [position, texture] in pixels.filter(|[position, _]| position.is_nan() || *position >= 0.0) {
        let [position, texture] =
            [position, texture].map(|error| if error.is_nan() { f64::INFINITY } else { error.into() });
        errors.compared_pixels += 1;
        errors.position_max = errors.position_max.max(position);
        errors.position_mean += position;
        errors.texture_max = errors.texture_max.max(texture);
        errors.texture_mean += texture;
    }
    let pixels = errors.compared_pixels.max(1) as f64;
    errors.position_mean /= pixels;
    errors.texture_mean /= pixels;
    errors
}

fn cell(setup: &Setup, compared: &Compared, frame: &FrameSpec) -> Cell {
    Cell {
        column: setup.label.clone(),
        technique: setup.chosen.id().to_owned(),
        samples: setup.samples,
        status: compared.result.status,
        reason: compared.result.reason.clone().filter(|_| compared.result.status != Status::Ok),
        pixels: u64::from(frame.width) * u64::from(frame.height),
        errors: compared.errors.filter(|_| compared.result.status == Status::Ok),
    }
}

fn notes(spec: &Spec, frame: &FrameSpec) -> Vec<String> {
    let mut notes = vec![
        "position: distance to what a fragment shader has at the pixel's centre, the scene's longest side being 2".to_owned(),
        "texture: largest difference of a channel of linear base colour; the rasteriser's gradients are differences within quads"
            .to_owned(),
        format!("the paper: {}", PAPER.says),
    ];
    if spec.scenes == default_scenes() {
        notes
            .push("the built-in scene stands in for the paper's Sponza and San Miguel (--scenes)".to_owned());
    }
    if (frame.width, frame.height) != FULL_HD_PX {
        notes.push(format!("{}×{} instead of {}×{}", frame.width, frame.height, FULL_HD_PX.0, FULL_HD_PX.1));
    }
    notes
}

fn remark(errors: Errors) -> String {
    let Errors { compared_pixels, position_max, position_mean, texture_max, texture_mean } = errors;
    format!(
        "position error {position_max:.2e} at most, {position_mean:.2e} on average; texture difference {texture_max:.2e}, {texture_mean:.2e}; {compared_pixels} pixels"
    )
}

fn table_text(session: &Session, frame: &FrameSpec, table: &Table<'_, Cell>, notes: &[String]) -> String {
    let heading = ["technique", "pixels compared", "position max", "mean", "texture max", "mean"];
    let mut printed = text::table(&heading, 1);
    for cell in table.cells.iter().flatten() {
        let Some(errors) = cell.errors else { continue };
        let share = 100.0 * errors.compared_pixels as f64 / cell.pixels as f64;
        let number = |value: f64| format!("{value:.2e}");
        printed.add_row([
            cell.column.clone(),
            format!("{} ({share:.1}%)", grouped(errors.compared_pixels)),
            number(errors.position_max),
            number(errors.position_mean),
            number(errors.texture_max),
            number(errors.texture_mean),
        ]);
    }
    let notes = notes_text(notes);
    format!(
        "dais-fig6: {} on {} ({}), {}×{}\n\n{printed}\n{}{notes}\n",
        session.scene.name,
        session.device.name,
        session.device.kind,
        frame.width,
        frame.height,
        reasons_text(&table.setups, &table.results)
    )
}

/// Figure 6's halves of each technique.
fn pictures_of(setups: &[Setup], cells: &[Cell], compared: &[Compared]) -> Result<Vec<Picture>, LabError> {
    let mut all = Vec::new();
    for ((setup, cell), one) in setups.iter().zip(cells).zip(compared) {
        let Some((position, texture)) = one.position.as_ref().zip(one.texture.as_ref()) else { continue };
        let remark = cell.errors.map(remark).unwrap_or_default();
        all.push(Picture {
            technique: setup.label.clone(),
            image_png: encode_png(position)?,
            difference_png: Some(encode_png(texture)?),
            difference_caption: format!(
                "left: position error, blue 1e-8 to white 1e-4; right: texture difference times 1000; {remark}"
            ),
        });
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_that_were_not_compared_do_not_count() {
        let errors = summed([[-1.0, -1.0], [0.5, 0.25], [0.25, 0.0]].into_iter());
        assert_eq!(errors.compared_pixels, 2);
        assert_eq!((errors.position_max, errors.position_mean), (0.5, 0.375));
        assert_eq!((errors.texture_max, errors.texture_mean), (0.25, 0.125));
        assert_eq!(summed([[-1.0, -1.0]].into_iter()), Errors::default());
        assert_eq!(summed([[f32::NAN, 0.0]].into_iter()).position_max, f64::INFINITY);
    }

    #[test]
    fn techniques_without_the_views_are_refused() {
        let found = |techniques: &str| {
            let techniques = techniques.split(',').map(str::to_owned).collect();
            let spec = Spec { techniques, ..Spec::default() };
            setups(&spec).map(|setups| setups.into_iter().map(|one| one.label).collect::<Vec<_>>())
        };
        assert_eq!(found("dais").ok(), Some(vec!["dais 1x".to_owned()]));
        assert!(found("all").is_ok_and(|labels| labels.len() >= 2));
        assert!(found("dais,forward").is_err());
    }
}
