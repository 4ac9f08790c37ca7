//! `bench msaa-table1`: memory of the G-buffer and the depth buffer without anti-aliasing, multisampled, and as per-pixel
//! lists (Fridvalszky and Tóth 2020, Table 1 and Figure 9).
//!
//! Every figure is what the allocator took for an image or buffer, and stands beside the bytes that its formats alone
//! would take: the difference is the device's granularity.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use afterlight_graph::gpu::vk;
use afterlight_graph::{BufferRole, Graph, ImageHandle, ImageInfo, Load, PassRole};
use afterlight_lab::spec::DEFAULT_SCENE;
use afterlight_lab::{
    Entrant, FrameSpec, LabError, Listener, Session, Setup, measure_in_turn, renderer_with, technique,
};
use afterlight_measure::{Buffer, Memory, RunResult, Status};
use afterlight_renderer::Renderer;
use afterlight_report::text::{self, grouped, status_text};
use afterlight_scene::{LoadOptions, load_source};
use afterlight_techniques::{Params, SceneGpu, Settings};
use serde::{Deserialize, Serialize};

use crate::kit::{
    FULL_HD_PX, Header, MIB, Options, Outcome, PaperFigures, Row, Specification, Table, at_size, broken_off,
    check_run, counter, notes_text, paper_data, sample_counts_up_to,
};

/// What the experiment is asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Share of the frame's width and height, above 0, at most 1.
    pub scale: f64,
    /// Scene.
    pub scene: String,
    /// Numbers of samples a pixel, ascending.
    pub sample_counts: Vec<u32>,
    /// What frames look like; `samples`, `post` and `view` do not count.
    pub frame: FrameSpec,
}

impl Default for Spec {
    fn default() -> Spec {
        Spec {
            scale: 1.0,
            scene: DEFAULT_SCENE.to_owned(),
            sample_counts: vec![4, 8],
            frame: FrameSpec { width: FULL_HD_PX.0, height: FULL_HD_PX.1, ..FrameSpec::default() },
        }
    }
}

impl Specification for Spec {
    const NAME: &'static str = "msaa-table1";
    const SUMMARY: &'static str = "memory of G-buffers, multisampled and as lists";

    fn from_options(options: &Options) -> Spec {
        let own = Spec::default();
        Spec {
            scale: options.scale.unwrap_or(own.scale),
            scene: options.scenes.as_ref().and_then(|scenes| scenes.first().cloned()).unwrap_or(own.scene),
            sample_counts: sample_counts_up_to(options.samples, &own.sample_counts),
            frame: options.frame_at(FULL_HD_PX),
        }
    }

    fn run(&self, listener: &dyn Listener) -> Result<Outcome, LabError> {
        run(self, listener)
    }
}

/// How far a figure may be from the paper's.
const WITHIN_PERCENT: f64 = 3.0;

/// Bytes of a sample in the paper's textures: 10 of content (Figure 3 without the pointer) and 2 that align them.
const PAPER_SAMPLE_BYTES: u64 = 12;

/// A row of the paper's table, and what it does not tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum What {
    /// What lighting reads of a surface.
    GBuffer,
    /// The depth buffer.
    ZBuffer,
    /// From what lists are filled in compute: triangle IDs of samples, or keys of depth and triangle with the queues of
    /// their rasterisation. The paper's fill has none.
    Visibility,
    /// Samples that masked surfaces have taken, a byte a pixel where lists are filled by raster in a scene that has any. The
    /// paper tells of no alpha test.
    Claims,
    /// G-buffer, depth buffer and visibility: what the paper's total holds.
    Total,
    /// The radiance that lighting writes, which the paper leaves out of its table.
    Output,
}

/// Table 1 and Figure 9.
static PAPER: LazyLock<PaperFigures<Vec<PaperColumn>>> =
    LazyLock::new(|| paper_data(include_str!("paper.json")));

/// A column of Table 1, or of Figure 9 for what a view used.
#[derive(Clone, Debug, PartialEq, Deserialize)]
struct PaperColumn {
    layout: PaperLayout,
    samples: u32,
    #[serde(flatten)]
    figures: Paper,
}

/// How a column of the paper stores surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum PaperLayout {
    /// Without anti-aliasing.
    None,
    /// Multisampled textures.
    Msaa,
    ListMin,
    ListMax,
    ListUsed,
}

/// The figures of a column, MiB: G-buffer, Z-buffer, total.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
struct Paper {
    gbuffer_mib: Option<f64>,
    zbuffer_mib: Option<f64>,
    total_mib: f64,
}

impl Paper {
    fn mib(self, what: What) -> Option<f64> {
        match what {
            What::GBuffer => self.gbuffer_mib,
            What::ZBuffer => self.zbuffer_mib,
            What::Total => Some(self.total_mib),
            What::Visibility | What::Claims | What::Output => None,
        }
    }
}

/// The paper's figures of a layout at so many samples a pixel; none where it has none.
fn paper(layout: PaperLayout, samples: u32) -> Option<Paper> {
    let mut columns = PAPER.figures.iter();
    columns.find(|column| (column.layout, column.samples) == (layout, samples)).map(|column| column.figures)
}

/// How many dynamic blocks a column has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Blocks {
    /// None: no anti-aliasing.
    Min,
    /// For every sample of every pixel.
    Max,
    /// As the view needs.
    Used,
}

impl Blocks {
    const ALL: [Blocks; 3] = [Blocks::Min, Blocks::Max, Blocks::Used];

    fn name(self) -> &'static str {
        match self {
            Blocks::Min => "min",
            Blocks::Max => "max",
            Blocks::Used => "used",
        }
    }

    /// The parameter's value.
    fn value(self, samples: u32, pixels: u64) -> String {
        match self {
            Blocks::Min => "0".to_owned(),
            Blocks::Max => (u64::from(samples - 1) * pixels).to_string(),
            Blocks::Used => "auto".to_owned(),
        }
    }

    /// Table 1, and Figure 9 for what a view used.
    fn paper(self, samples: u32) -> Option<Paper> {
        let layout = match self {
            Blocks::Min => PaperLayout::ListMin,
            Blocks::Max => PaperLayout::ListMax,
            Blocks::Used => PaperLayout::ListUsed,
        };
        paper(layout, samples)
    }
}

/// A column of the table.
struct Column {
    setup: Setup,
    paper: Option<Paper>,
    /// Whether the layout is the paper's, so that the figures must agree.
    comparable: bool,
    /// Bytes a sample of the images of its G-buffer, in the order in which the technique declares them; none for lists.
    surface_bytes: &'static [u64],
    /// Bytes of a depth sample, as the device stores the format.
    depth_bytes: u64,
    note: String,
}

/// Base colour with metalness, normal, roughness with occlusion and two bytes that align them.
const PADDED_BYTES: &[u64] = &[4, 4, 4];
/// Base colour with metalness, normal, roughness: what `deferred` stores.
const PACKED_BYTES: &[u64] = &[4, 4, 1];

/// An image or buffer beside what its format alone takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Resource {
    name: String,
    bytes: u64,
    /// Width × height × samples × bytes of the format, or blocks × bytes of one.
    layout_bytes: u64,
    #[serde(skip)]
    what: What,
}

/// A figure of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Cell {
    column: String,
    row: What,
    technique: String,
    samples: u32,
    status: Status,
    reason: Option<String>,
    /// As the allocator counted.
    bytes: Option<u64>,
    mib: Option<f64>,
    layout_bytes: Option<u64>,
    /// Allocated beyond what the formats take.
    granularity_bytes: Option<i64>,
    /// The paper's figure, scaled to the image's pixels.
    paper_mib: Option<f64>,
    deviation_percent: Option<f64>,
    /// The deviation of what the formats take.
    deviation_without_granularity_percent: Option<f64>,
    /// Whether the layouts are alike, so that the deviation counts.
    comparable: bool,
    note: String,
    resources: Vec<Resource>,
}

impl Cell {
    /// Whether the figure is within the bound, as allocated or without the device's granularity; none where it does not count.
    fn holds(&self) -> Option<bool> {
        let deviation = self.deviation_percent.filter(|_| self.comparable)?;
        let without = self.deviation_without_granularity_percent?;
        Some(deviation.abs() <= WITHIN_PERCENT || without.abs() <= WITHIN_PERCENT)
    }
}

/// What `bench msaa-table1` writes as JSON.
#[derive(Serialize)]
struct Table1 {
    #[serde(flatten)]
    header: Header,
    /// The share of the paper's pixels: its figures are multiplied by it.
    pixel_share: f64,
    rows: Vec<Row<Cell>>,
    verdict: Verdict,
}

/// Whether the paper's memory is reproduced.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Verdict {
    claim: String,
    /// Figures with the paper's layout.
    compared: usize,
    within: usize,
    /// Whether all are; none at another size than the paper's.
    holds: Option<bool>,
    off: Vec<String>,
}

fn run(spec: &Spec, listener: &dyn Listener) -> Result<Outcome, LabError> {
    check_run(spec.scale, 1, &spec.frame)?;
    let frame = at_size(&spec.frame, spec.scale);
    let source = spec.scene.as_str();
    let session = Session::open(source, &frame, false, listener)?;
    let base = without_emission(&session, source, &frame)?;
    let columns = columns(&base, &spec.sample_counts)?;

    let mut results = vec![single_sample_layout(&base)?];
    let task = listener.task("columns", columns.len() as u64);
    for column in &columns[1..] {
        task.at(&column.setup.label);
        let renderer = renderer_with(&base, |settings| settings.samples = column.setup.samples)?;
        // Too large for the device is a figure that is missing, not the end.
        let entrant = [Entrant { renderer: &renderer, chosen: &column.setup.chosen }];
        let found = measure_in_turn(&entrant, &session.workload, 0, u64::MAX, || task.advance())?;
        results.extend(found.measured.into_iter().map(|one| one.result));
    }
    drop(task);
    session.finish(&frame, listener)?;

    let pixels = u64::from(frame.width) * u64::from(frame.height);
    let cells: Vec<Vec<Cell>> =
        columns.iter().zip(&results).map(|(column, result)| cells(column, result, pixels)).collect();
    let verdict = verdict(&cells, pixels == full_hd_pixels());
    let notes = notes(&session, &frame);
    listener.tell(&tables(&session, &frame, &cells, &notes, &verdict));
    let failed = broken_off(columns.iter().map(|c| c.setup.label.as_str()).zip(&results)).or_else(|| {
        (verdict.holds == Some(false)).then(|| {
            format!(
                "msaa-table1: {} figure(s) off by more than {WITHIN_PERCENT}%: {}",
                verdict.off.len(),
                verdict.off.join(", ")
            )
        })
    });

    let table = Table {
        setups: columns.iter().map(|column| &column.setup).collect(),
        remarks: cells.iter().map(|cells| Some(remark(cells))).collect(),
        results,
        cells,
    };
    let rows = table.rows(&session, &frame, 1, "none");
    let sections = table.parts(&session, &frame, 1, "none", "", &notes.join(". "));
    let json = serde_json::to_value(&Table1 {
        header: Header::new(Spec::NAME, spec.scale, PAPER.source.clone(), notes),
        pixel_share: pixel_share(pixels),
        rows,
        verdict,
    })?;
    Ok(Outcome { title: "Memory of G-buffers", json, sections, failed })
}

fn full_hd_pixels() -> u64 {
    u64::from(FULL_HD_PX.0) * u64::from(FULL_HD_PX.1)
}

fn pixel_share(pixels: u64) -> f64 {
    pixels as f64 / full_hd_pixels() as f64
}

/// The scene with no surface that emits: the paper's surfaces have no emission, which would take 4 bytes more of every
/// sample, in textures and in lists.
fn without_emission(session: &Session, source: &str, frame: &FrameSpec) -> Result<Renderer, LabError> {
    let mut scene = load_source(source, &LoadOptions { time_s: frame.time_s })?;
    for material in &mut scene.materials {
        material.emissive_factor = [0.0; 3];
    }
    let on_device = SceneGpu::upload(session.renderer.device(), &scene, &|_, _| {})?;
    let settings = session.renderer.settings().clone();
    Ok(Renderer::with_scene(session.renderer.device(), on_device, &settings)?)
}

/// The columns: none (as [`single_sample_layout`] and as `deferred` has it), multisampled, lists of the paper's layout,
/// lists as they are by default.
fn columns(base: &Renderer, sample_counts: &[u32]) -> Result<Vec<Column>, LabError> {
    let Settings { width_px, height_px, .. } = *base.settings();
    let pixels = u64::from(width_px) * u64::from(height_px);
    let stencil_depth_bytes = stencil_depth_bytes(base);
    let mut columns = vec![
        Column {
            setup: Setup::new("none", 1, "deferred-ssaa", &[])?,
            paper: paper(PaperLayout::None, 1),
            comparable: true,
            surface_bytes: PADDED_BYTES,
            depth_bytes: 4,
            note: "the images of deferred-ssaa at one sample: base colour 3 bytes and metalness 1, normal 4, roughness 1, occlusion 1, 2 unused: the paper's content and padding".to_owned(),
        },
        Column {
            setup: Setup::new("none (deferred)", 1, "deferred", &[])?,
            paper: paper(PaperLayout::None, 1),
            comparable: false,
            surface_bytes: PACKED_BYTES,
            depth_bytes: 4,
            note: "the technique `deferred`: 9 bytes (base colour 3, metalness 1, normal 4, roughness 1) instead of the paper's 12: no occlusion (1 byte), no padding (2)".to_owned(),
        },
    ];
    for &samples in sample_counts {
        columns.push(Column {
            setup: Setup::new(format!("MSAA {samples}x"), samples, "deferred-ssaa", &[])?,
            paper: paper(PaperLayout::Msaa, samples),
            comparable: true,
            surface_bytes: PADDED_BYTES,
            depth_bytes: 4,
            note: format!("deferred-ssaa: {PAPER_SAMPLE_BYTES} bytes a sample, depth 4"),
        });
    }
    for (variant, fill, position, depth_bytes, comparable) in [
        ("list", "raster", "depth", stencil_depth_bytes, true),
        ("default list", "compute", "distance", 4, false),
    ] {
        for &samples in sample_counts {
            for blocks in Blocks::ALL {
                let params =
                    [("fill", fill), ("position", position), ("blocks", &blocks.value(samples, pixels))];
                columns.push(Column {
                    setup: Setup::new(
                        format!("{variant} {samples}x {}", blocks.name()),
                        samples,
                        "gbuffer-list",
                        &params,
                    )?,
                    paper: blocks.paper(samples),
                    // What a view uses is the view's: the paper's scene is another.
                    comparable: comparable && blocks != Blocks::Used,
                    surface_bytes: &[],
                    depth_bytes,
                    note: list_note(comparable, depth_bytes, blocks),
                });
            }
        }
    }
    Ok(columns)
}

fn list_note(is_papers: bool, depth_bytes: u64, blocks: Blocks) -> String {
    match (is_papers, depth_bytes) {
        (false, _) if blocks == Blocks::Min => {
            "blocks of 144 bits (with the sample's distance); one sample a pixel is rasterised, as there is no block for another".to_owned()
        }
        (true, 4) => "blocks of 112 bits, depth and stencil 4 bytes a sample".to_owned(),
        (true, _) => format!(
            "blocks of 112 bits; float depth with stencil takes {depth_bytes} bytes a sample: the 4 of depth are compared"
        ),
        (false, _) => {
            "blocks of 144 bits (with the sample's distance); visibility is depth and triangle ID, 4 bytes each a sample, or where compute rasterises keys of 8 that hold both, and queues".to_owned()
        }
    }
}

/// Bytes that a sample of depth with stencil takes on the device: 32 + 8 bits padded to 64, or 24 + 8.
fn stencil_depth_bytes(base: &Renderer) -> u64 {
    if base.device().depth_stencil_format() == vk::Format::D24_UNORM_S8_UINT { 4 } else { 8 }
}

/// Allocates the images of `deferred-ssaa` at one sample, which the technique does not render, and returns their bytes.
fn single_sample_layout(base: &Renderer) -> Result<RunResult, LabError> {
    const IMAGES: [(&str, BufferRole, vk::Format); 4] = [
        ("base color", BufferRole::Surfaces, vk::Format::R8G8B8A8_SRGB),
        ("normal", BufferRole::Surfaces, vk::Format::R16G16_UNORM),
        ("roughness", BufferRole::Surfaces, vk::Format::R8G8B8A8_UNORM),
        ("depth", BufferRole::Depth, vk::Format::D32_SFLOAT),
    ];
    const TECHNIQUE: &str = "deferred-ssaa";
    let (width, height) = (base.settings().width_px, base.settings().height_px);
    let declare = |graph: &mut Graph, _: &ImageHandle| {
        let images = IMAGES.map(|(name, role, format)| {
            graph.image(&format!("{TECHNIQUE}/{name}"), role, ImageInfo::new(format, width, height))
        });
        let mut pass = graph.raster("bench/layout", PassRole::Upkeep);
        let [base_color, normal, roughness, depth] = images;
        let mut written: Vec<ImageHandle> =
            [base_color, normal, roughness].map(|image| pass.color(image, Load::Clear([0.0; 4]))).into();
        written.push(pass.depth(depth, Load::Clear(0.0)));
        pass.finish();
        for image in &written {
            graph.keep(image);
        }
    };
    let forward = technique("technique", "forward")?;
    let report = base.prepare_with(forward, &Params::default(), declare)?.run()?;
    let buffers: Vec<Buffer> = report
        .memory
        .iter()
        .filter(|one| one.name.starts_with(TECHNIQUE))
        .map(|one| Buffer { name: one.name.clone(), role: Some(one.role), bytes: one.bytes })
        .collect();
    let bytes = buffers.iter().map(|one| one.bytes).sum();
    let reason = "allocated and cleared, not drawn to: the technique is for several samples";
    let mut result = RunResult::without_figures(TECHNIQUE, Status::Ok, reason);
    result.memory = Some(Memory { technique_bytes: bytes, peak_bytes: bytes, buffers });
    Ok(result)
}

/// Numbers that the sizes of a technique's images and buffers follow from.
struct Sizes {
    pixels: u64,
    /// Samples a pixel that are rasterised.
    samples: u64,
    surface_bytes: &'static [u64],
    depth_bytes: u64,
    /// Dynamic blocks.
    blocks: u64,
    /// Bytes of two interleaved blocks.
    pair_bytes: u64,
    /// Capacities of the queues of rasterisation in compute.
    large_triangles: u64,
    tile_jobs: u64,
}

/// What images and buffers of a role are, and the bytes that their formats take, in the order in which techniques declare them;
/// none for what the table does not know.
fn layout(role: BufferRole, sizes: &Sizes) -> Option<(What, Vec<u64>)> {
    let all_samples = sizes.pixels * sizes.samples;
    Some(match role {
        BufferRole::Surfaces => {
            (What::GBuffer, sizes.surface_bytes.iter().map(|bytes| all_samples * bytes).collect())
        }
        BufferRole::Depth => (What::ZBuffer, vec![all_samples * sizes.depth_bytes]),
        BufferRole::Visibility => (What::Visibility, vec![all_samples * 4]),
        BufferRole::SampleKeys => (What::Visibility, vec![all_samples * 8]),
        // Large triangles, tile jobs, and a count of each.
        BufferRole::RasterQueues => {
            (What::Visibility, vec![sizes.large_triangles * 4, sizes.tile_jobs * 8, 8, 8])
        }
        // Blocks, and their count.
        BufferRole::SurfaceListNodes => {
            (What::GBuffer, vec![(sizes.pixels + sizes.blocks).div_ceil(2) * sizes.pair_bytes, 8])
        }
        BufferRole::Claims => (What::Claims, vec![sizes.pixels.div_ceil(4) * 4]),
        BufferRole::Targets => (What::Output, vec![sizes.pixels * 8]),
        BufferRole::SurfaceListHeads
        | BufferRole::Triangles
        | BufferRole::TriangleSets
        | BufferRole::MemoizationCache
        | BufferRole::Lights
        | BufferRole::Counters
        | BufferRole::Scene
        | BufferRole::Constants
        | BufferRole::Shared
        | BufferRole::Transparency
        | BufferRole::Filters => return None,
    })
}

/// Samples a pixel that are rasterised: lists filled in compute take one where there is no block for another.
fn rasterised_samples(column: &Column, result: &RunResult, blocks: u64) -> u64 {
    let in_compute = result.params.get("fill").is_some_and(|fill| fill == "compute");
    if in_compute && blocks == 0 { 1 } else { u64::from(column.setup.samples) }
}

/// The images and buffers of a result that the table knows.
fn resources(column: &Column, result: &RunResult, pixels: u64) -> Vec<Resource> {
    let capacity = |name: &str| counter(result, &format!("{name}_capacity")).unwrap_or(0);
    let blocks = capacity("blocks");
    let sizes = Sizes {
        pixels,
        samples: rasterised_samples(column, result, blocks),
        surface_bytes: column.surface_bytes,
        depth_bytes: column.depth_bytes,
        blocks,
        // 10 bytes of content each with a pointer of 4, and 4 of distance.
        pair_bytes: if result.params.get("position").is_some_and(|p| p == "distance") { 36 } else { 28 },
        large_triangles: capacity("large_triangles"),
        tile_jobs: capacity("tile_jobs"),
    };
    let buffers = result.memory.iter().flat_map(|memory| &memory.buffers);
    let mut seen: BTreeMap<BufferRole, usize> = BTreeMap::new();
    let resource = |buffer: &Buffer| {
        let role = buffer.role?;
        let (what, layouts) = layout(role, &sizes)?;
        let place = seen.entry(role).or_default();
        let layout_bytes = layouts.get(*place).copied();
        *place += 1;
        Some(Resource { name: buffer.name.clone(), bytes: buffer.bytes, layout_bytes: layout_bytes?, what })
    };
    buffers.filter_map(resource).collect()
}

fn cells(column: &Column, result: &RunResult, pixels: u64) -> Vec<Cell> {
    let resources = resources(column, result, pixels);
    [What::GBuffer, What::ZBuffer, What::Visibility, What::Total, What::Claims, What::Output]
        .into_iter()
        .map(|what| cell(column, result, what, &resources, pixels))
        .collect()
}

/// Deviation of bytes from MiB, percent.
fn deviation_percent(bytes: f64, mib: f64) -> f64 {
    (bytes / MIB / mib - 1.0) * 100.0
}

fn cell(column: &Column, result: &RunResult, what: What, resources: &[Resource], pixels: u64) -> Cell {
    let resources: Vec<Resource> = resources
        .iter()
        .filter(|one| {
            one.what == what || what == What::Total && !matches!(one.what, What::Output | What::Claims)
        })
        .cloned()
        .collect();
    let has_figures = result.memory.is_some();
    let sum = |bytes: fn(&Resource) -> u64| has_figures.then(|| resources.iter().map(bytes).sum::<u64>());
    let (bytes, layout_bytes) = (sum(|one| one.bytes), sum(|one| one.layout_bytes));
    // Of a depth sample with stencil that takes more than the paper's 4 bytes, 4 are compared.
    let compared = |bytes: fn(&Resource) -> u64| {
        let shares = resources.iter().map(|one| match one.what {
            What::ZBuffer => bytes(one) as f64 * 4.0 / column.depth_bytes as f64,
            _ => bytes(one) as f64,
        });
        has_figures.then(|| shares.sum::<f64>())
    };
    let paper_mib = column.paper.and_then(|paper| paper.mib(what)).map(|mib| mib * pixel_share(pixels));
    let deviation = |bytes: Option<f64>| Some(deviation_percent(bytes?, paper_mib?));
    Cell {
        column: column.setup.label.clone(),
        row: what,
        technique: result.technique.clone(),
        samples: column.setup.samples,
        status: result.status,
        reason: result.reason.clone().filter(|_| result.status != Status::Ok),
        bytes,
        mib: bytes.map(|bytes| bytes as f64 / MIB),
        layout_bytes,
        granularity_bytes: bytes.zip(layout_bytes).map(|(bytes, layout)| bytes as i64 - layout as i64),
        paper_mib,
        deviation_percent: deviation(compared(|one| one.bytes)),
        deviation_without_granularity_percent: deviation(compared(|one| one.layout_bytes)),
        comparable: column.comparable,
        note: note(column, result, what),
        resources,
    }
}

fn note(column: &Column, result: &RunResult, what: What) -> String {
    let needed = counter(result, "blocks_needed");
    match needed.filter(|_| matches!(what, What::GBuffer | What::Total)) {
        Some(needed) => format!("{}; the view needs {needed} dynamic blocks", column.note),
        None => column.note.clone(),
    }
}

fn verdict(cells: &[Vec<Cell>], at_papers_size: bool) -> Verdict {
    let judged: Vec<(&Cell, bool)> =
        cells.iter().flatten().filter_map(|cell| Some((cell, cell.holds()?))).collect();
    let off: Vec<String> = judged
        .iter()
        .filter(|(_, holds)| !holds)
        .map(|(cell, _)| {
            format!(
                "{} {}: {} ({} without granularity)",
                cell.column,
                row_name(cell.row),
                percent(cell.deviation_percent),
                percent(cell.deviation_without_granularity_percent)
            )
        })
        .collect();
    Verdict {
        claim: format!(
            "figures with the paper's layout are within {WITHIN_PERCENT}% of the paper's, as allocated or without the device's granularity"
        ),
        compared: judged.len(),
        within: judged.len() - off.len(),
        holds: (at_papers_size && !judged.is_empty()).then_some(off.is_empty()),
        off,
    }
}

fn row_name(what: What) -> &'static str {
    match what {
        What::GBuffer => "G-buffer",
        What::ZBuffer => "Z-buffer",
        What::Visibility => "visibility",
        What::Claims => "claims",
        What::Total => "total",
        What::Output => "output",
    }
}

fn percent(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:+.2}%"))
}

fn mib_text(mib: Option<f64>) -> String {
    mib.map_or_else(|| "–".to_owned(), |mib| format!("{mib:.2}"))
}

fn notes(session: &Session, frame: &FrameSpec) -> Vec<String> {
    let mut notes = vec![
        "claims: a byte a pixel where a raster fill meets masked surfaces, beside the total: the paper has none"
            .to_owned(),
        format!(
            "{} stands in for the paper's scenes; its surfaces do not emit here, since the paper's have no emission (it would take 4 bytes more of every sample)",
            session.scene.name
        ),
        "columns `min` have no dynamic blocks, so that samples are dropped there: that is what they measure"
            .to_owned(),
        "the paper's `used` is Figure 9, another scene: shown, not judged".to_owned(),
    ];
    if (frame.width, frame.height) != FULL_HD_PX {
        notes.push(format!(
            "{}×{} instead of the paper's {}×{}: its figures are multiplied by the share of pixels, and not judged",
            frame.width, frame.height, FULL_HD_PX.0, FULL_HD_PX.1
        ));
    }
    notes
}

fn tables(
    session: &Session,
    frame: &FrameSpec,
    cells: &[Vec<Cell>],
    notes: &[String],
    verdict: &Verdict,
) -> String {
    let heading = ["column", "status", "row", "MiB", "paper", "off by", "bytes", "formats", "granularity"];
    let mut table = text::table(&heading, 3);
    for cell in cells.iter().flatten() {
        // What a column does not have, and all but one line of what did not run.
        if cell.bytes == Some(0) || cell.bytes.is_none() && cell.row != What::Total {
            continue;
        }
        let number = |bytes: Option<u64>| bytes.map_or_else(|| "–".to_owned(), grouped);
        table.add_row([
            cell.column.clone(),
            status_text(cell.status).to_owned(),
            row_name(cell.row).to_owned(),
            mib_text(cell.mib),
            mib_text(cell.paper_mib),
            percent(cell.deviation_percent),
            number(cell.bytes),
            number(cell.layout_bytes),
            cell.granularity_bytes.map_or_else(|| "–".to_owned(), |bytes| bytes.to_string()),
        ]);
    }
    let mut reasons: Vec<String> = cells
        .iter()
        .flatten()
        .filter_map(|cell| Some(format!("{}: {}\n", cell.column, cell.reason.as_ref()?)))
        .collect();
    reasons.dedup();
    let notes = notes_text(notes);
    let device = &session.device;
    format!(
        "msaa-table1: memory at {}×{} on {} ({}), beside Fridvalszky and Tóth 2020, Table 1 (GTX 970 and GTX 1050)\n\n{table}\n{}{notes}{}",
        frame.width,
        frame.height,
        device.name,
        device.kind,
        reasons.concat(),
        verdict_text(verdict)
    )
}

fn verdict_text(verdict: &Verdict) -> String {
    let answer = match verdict.holds {
        Some(true) => "holds",
        Some(false) => "does not hold",
        None => "not judged at this size",
    };
    let off: String = verdict.off.iter().map(|off| format!("  off: {off}\n")).collect();
    format!("{}: {} of {}: {answer}\n{off}", verdict.claim, verdict.within, verdict.compared)
}

/// What a report tells of a column.
fn remark(cells: &[Cell]) -> String {
    let told = cells.iter().filter(|cell| cell.bytes.is_some_and(|bytes| bytes > 0)).map(|cell| {
        let paper = cell.paper_mib.map_or_else(String::new, |mib| {
            format!(" (paper {mib:.2}, {})", percent(cell.deviation_percent))
        });
        format!("{} {} MiB{paper}", row_name(cell.row), mib_text(cell.mib))
    });
    told.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: u64 = 1920 * 1080;

    #[test]
    fn the_papers_figures_are_whole_bytes_of_its_layouts() {
        let mib = |bytes: u64| (PIXELS * bytes) as f64 / MIB;
        let near =
            |found: f64, expected: f64| assert!((found - expected).abs() < 0.006, "{found} {expected}");
        let none = paper(PaperLayout::None, 1).expect("there");
        near(mib(PAPER_SAMPLE_BYTES), none.gbuffer_mib.expect("there"));
        near(mib(4), none.zbuffer_mib.expect("there"));
        for samples in [4u32, 8] {
            let s = u64::from(samples);
            let msaa = paper(PaperLayout::Msaa, samples).expect("there");
            near(mib(s * PAPER_SAMPLE_BYTES), msaa.gbuffer_mib.expect("there"));
            near(mib(s * 4), msaa.zbuffer_mib.expect("there"));
            for (blocks, factor) in [(Blocks::Min, 1), (Blocks::Max, s)] {
                let list = blocks.paper(samples).expect("there");
                near(mib(14 * factor), list.gbuffer_mib.expect("there"));
                near(mib(s * 4), list.zbuffer_mib.expect("there"));
                assert!(
                    (list.gbuffer_mib.unwrap_or(0.0) + list.zbuffer_mib.unwrap_or(0.0) - list.total_mib)
                        .abs()
                        < 0.011
                );
            }
        }
        assert_eq!(paper(PaperLayout::Msaa, 2), None);
        assert_eq!(Blocks::Min.paper(2), None);
    }

    fn column(blocks: Blocks, depth_bytes: u64) -> Column {
        Column {
            setup: Setup::new("list", 4, "gbuffer-list", &[("position", "depth")]).expect("known"),
            paper: blocks.paper(4),
            comparable: true,
            surface_bytes: &[],
            depth_bytes,
            note: String::new(),
        }
    }

    /// A result of lists with `extra` bytes of granularity in the blocks.
    fn result(pixels: u64, blocks: u64, depth_bytes: u64, extra: u64) -> RunResult {
        let mut result = RunResult::without_figures("gbuffer-list", Status::Ok, "");
        result.params.insert("position".into(), "depth".into());
        result.counters.insert("blocks_capacity".into(), blocks.into());
        let buffers = [
            ("gbuffer-list/blocks", BufferRole::SurfaceListNodes, (pixels + blocks).div_ceil(2) * 28 + extra),
            ("gbuffer-list/block count", BufferRole::SurfaceListNodes, 8),
            ("gbuffer-list/depth", BufferRole::Depth, pixels * 4 * depth_bytes),
            ("gbuffer-list/radiance", BufferRole::Targets, pixels * 8),
        ]
        .map(|(name, role, bytes)| Buffer { name: name.into(), role: Some(role), bytes })
        .to_vec();
        result.memory = Some(Memory { technique_bytes: 0, peak_bytes: 0, buffers });
        result
    }

    fn of(cells: &[Cell], what: What) -> Cell {
        cells.iter().find(|cell| cell.row == what).expect("there").clone()
    }

    #[test]
    fn cells_add_up_beside_the_papers() {
        let found = cells(&column(Blocks::Max, 4), &result(PIXELS, 3 * PIXELS, 4, 0), PIXELS);
        let gbuffer = of(&found, What::GBuffer);
        assert_eq!(gbuffer.bytes, Some(PIXELS * 4 * 14 + 8));
        assert_eq!(gbuffer.granularity_bytes, Some(0));
        assert!(gbuffer.deviation_percent.expect("there").abs() < 0.01 && gbuffer.holds() == Some(true));
        let total = of(&found, What::Total);
        assert_eq!(total.bytes, Some(PIXELS * 4 * 18 + 8));
        assert_eq!(
            (of(&found, What::Output).bytes, of(&found, What::Output).holds()),
            (Some(PIXELS * 8), None)
        );
        assert_eq!(of(&found, What::Visibility).bytes, Some(0));
        // A quarter of the pixels: a quarter of the paper's figure.
        let quarter = cells(&column(Blocks::Max, 4), &result(PIXELS / 4, 3 * PIXELS / 4, 4, 0), PIXELS / 4);
        assert!(of(&quarter, What::Total).deviation_percent.expect("there").abs() < 0.01);
    }

    #[test]
    fn granularity_explains_and_nothing_else_does() {
        let columns = column(Blocks::Min, 4);
        let padded = cells(&columns, &result(PIXELS, 0, 4, 4 << 20), PIXELS);
        let gbuffer = of(&padded, What::GBuffer);
        assert_eq!(gbuffer.granularity_bytes, Some(4 << 20));
        assert!(gbuffer.deviation_percent > Some(WITHIN_PERCENT) && gbuffer.holds() == Some(true));
        // Blocks that are there beyond none are no granularity.
        let more = cells(&columns, &result(PIXELS, PIXELS / 10, 4, 0), PIXELS);
        assert_eq!(of(&more, What::GBuffer).holds(), Some(false));
        let judged = verdict(&[padded, more.clone()], true);
        assert_eq!((judged.compared, judged.within, judged.holds), (6, 4, Some(false)));
        assert!(judged.off[0].contains("G-buffer"), "{judged:?}");
        assert_eq!(verdict(&[more], false).holds, None, "at another size");
    }

    #[test]
    fn a_wide_depth_with_stencil_counts_as_its_depth() {
        let found = cells(&column(Blocks::Min, 8), &result(PIXELS, 0, 8, 0), PIXELS);
        let depth = of(&found, What::ZBuffer);
        assert_eq!(depth.bytes, Some(PIXELS * 32));
        assert!(depth.deviation_percent.expect("there").abs() < 0.1, "{depth:?}");
    }

    #[test]
    fn lists_filled_in_compute_rasterise_what_has_blocks() {
        let column = column(Blocks::Min, 4);
        let mut result = result(PIXELS, 0, 4, 0);
        assert_eq!(rasterised_samples(&column, &result, 0), 4);
        result.params.insert("fill".into(), "compute".into());
        assert_eq!(
            (rasterised_samples(&column, &result, 0), rasterised_samples(&column, &result, 1)),
            (1, 4)
        );
    }

    #[test]
    fn keys_stand_for_depth_and_triangle() {
        let sizes = Sizes {
            pixels: 100,
            samples: 4,
            surface_bytes: PACKED_BYTES,
            depth_bytes: 4,
            blocks: 3,
            pair_bytes: 36,
            large_triangles: 7,
            tile_jobs: 5,
        };
        let of = |role: BufferRole| layout(role, &sizes);
        assert_eq!(of(BufferRole::SampleKeys), Some((What::Visibility, vec![3200])));
        assert_eq!(of(BufferRole::RasterQueues), Some((What::Visibility, vec![28, 40, 8, 8])));
        assert_eq!(of(BufferRole::SurfaceListNodes), Some((What::GBuffer, vec![52 * 36, 8])));
        assert_eq!(of(BufferRole::Surfaces), Some((What::GBuffer, vec![1600, 1600, 400])));
        assert_eq!(of(BufferRole::Lights), None);
    }

    #[test]
    fn names_are_for_people() {
        let column = column(Blocks::Max, 4);
        let result = result(PIXELS, 3 * PIXELS, 4, 0);
        let told = |result: &RunResult| {
            let mut cells = cells(&column, result, PIXELS);
            for resource in cells.iter_mut().flat_map(|cell| &mut cell.resources) {
                resource.name.clear();
            }
            cells
        };
        assert_eq!(told(&crate::kit::phases::tests::renamed(&result)), told(&result));
    }

    #[test]
    fn what_did_not_run_has_no_figures() {
        let result = RunResult::without_figures("gbuffer-list", Status::Unavailable, "8 samples");
        let found = cells(&column(Blocks::Min, 4), &result, PIXELS);
        assert!(found.iter().all(|cell| cell.bytes.is_none() && cell.holds().is_none()));
        assert_eq!(found[0].reason.as_deref(), Some("8 samples"));
        assert_eq!(verdict(&[found], true).holds, None);
    }
}
