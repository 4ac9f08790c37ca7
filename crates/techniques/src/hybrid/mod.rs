//! `hybrid`: deferred shading or a light pre-pass, chosen draw by draw from the overdraw that is predicted.

// ORDER: 56

pub mod cost;

use std::borrow::Cow;

use afterlight_graph::{
    Blend, BufferHandle, BufferRole, Commands, DepthTest, Graph, ImageHandle, Load, PassRole, RasterPass,
    StencilFace, StencilTest, Step, gpu::vk,
};

use crate::light_prepass::{self, SUMS};
use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, ChangesWith, Exactness, Frame, Info, Need, Params, Source, Technique, TechniqueError,
    View,
    scene::{BUCKETS, Bucket, draw_list::COMMAND_BYTES},
};
use afterlight_shader::Shader;
use afterlight_stages::surfaces::{
    depth_first::FIRST_FRAGMENT,
    gbuffer::{self, GBuffer},
    geometry::SceneDraws,
    shade,
};
use paths::{Path, Run};

mod params;
mod paths;

pub use params::{HybridParams, PathChoice};

/// The technique.
pub static TECHNIQUE: Hybrid = Hybrid;

/// See the module.
pub struct Hybrid;

static INFO: Info = Info {
    id: "hybrid",
    title: "Hybrid of deferred shading and light pre-pass",
    summary: "Each draw fills the G-buffer, or leaves normal and roughness and is drawn again for its colours: what is predicted to cost less.",
    sources: &[
        Source { key: "petrescu-2016", section: "2.1" },
        Source { key: "petrescu-2016", section: "4.5" },
        Source { key: "hoef-2013", section: "all" },
    ],
    answers: Answers {
        surface: "G-buffer, colours of some surfaces left out",
        lights: "light volumes",
        schedule: "fragment shader",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "D/LPP",
        intersect: "imp",
        transparency: "n",
        hardware_msaa: "n",
        light_access: "seq",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    needs: &[Need { name: "independent blending", test: |features| features.independent_blend }],
    ..Info::USUAL
};

/// Names the owner of a pixel: the stencil reference of what is nearest so far.
const OWNER: StencilTest = {
    let face = StencilFace {
        compare: vk::CompareOp::ALWAYS,
        fail: vk::StencilOp::KEEP,
        depth_fail: vk::StencilOp::KEEP,
        pass: vk::StencilOp::REPLACE,
    };
    StencilTest { front: face, back: face, compare_mask: 0xff, write_mask: 0xff }
};

/// Passes in pixels of one owner.
const OWNED: StencilTest = {
    let face = StencilFace { compare: vk::CompareOp::EQUAL, ..StencilFace::KEEP };
    StencilTest { front: face, back: face, compare_mask: 0xff, write_mask: 0 }
};

/// Stencil of a pixel whose colours are known: by the G-buffer, or since its surface was drawn again.
const COLORED: u32 = 1;
/// Stencil of a pixel whose surface is to be drawn again.
const COLORLESS: u32 = 0;

/// The draws in view, which take one path or the other.
struct Draws {
    params: HybridParams,
    /// The host's own commands of the draws in view: the host's runs count places in them.
    commands: BufferHandle,
    /// Length of each run.
    counts: BufferHandle,
}

/// The draws of a view as runs of one path.
fn runs(params: HybridParams, view: &View<'_>) -> Vec<Run> {
    match params.path {
        PathChoice::Deferred => paths::one_path(view, Path::Deferred),
        PathChoice::Prepass => paths::one_path(view, Path::Prepass),
        PathChoice::Predicted => paths::predicted(view, params.prepass_weight),
    }
}

impl Draws {
    fn new(graph: &mut Graph, frame: &Frame<'_>, params: HybridParams) -> Result<Self, TechniqueError> {
        // There are no more runs than draws.
        let most = frame.scene.draw_count();
        let named = ("hybrid draw counts", BufferRole::Scene);
        let counts = frame.table_of_view(graph, named, most, move |view, words| {
            words.extend(runs(params, view).iter().map(|run| run.places.len() as u32));
        })?;
        let named = ("hybrid own draw", ChangesWith::Camera);
        let of_view = frame
            .inputs
            .declare_draws(frame.device, graph, named, frame.scene, |view| Cow::Borrowed(view.visible()))?;
        Ok(Self { params, commands: of_view.commands, counts })
    }

    /// Whether some view has draws on a path.
    fn may_take(&self, path: Path) -> bool {
        match self.params.path {
            PathChoice::Deferred => path == Path::Deferred,
            PathChoice::Prepass => path == Path::Prepass,
            PathChoice::Predicted => true,
        }
    }

    /// Lets a pass make the draws of each view in their order, each path's as said; `None` leaves them out. What the pass has declared
    /// before is made first.
    fn draw(
        &self,
        frame: &Frame<'_>,
        pass: &mut RasterPass<'_>,
        first_draws: u32,
        surfaces: [(Path, Option<&SceneDraws>); 2],
    ) {
        // A draw for each path and bucket of the scene, numbered from 0.
        let mut numbered = Vec::new();
        for (path, surfaces) in surfaces.into_iter().filter_map(|(path, surfaces)| Some((path, surfaces?))) {
            for bucket in (0..BUCKETS).map(Bucket) {
                let [first, end] = [bucket.0, bucket.0 + 1].map(|place| frame.scene.bucket_first[place]);
                if first < end {
                    let places = 0..end - first;
                    surfaces.draw_some(frame, pass, (bucket, &places), (&self.commands, (&self.counts, 0)));
                    numbered.push((path, bucket));
                }
            }
        }
        let params = self.params;
        frame.script_of_view(pass, move |view| {
            let step = |(i, run): (usize, Run)| {
                let number = numbered.iter().position(|one| *one == (run.path, run.bucket))?;
                let first = view.scene.bucket_first[run.bucket.0] + run.places.start;
                Some(Step::Draw {
                    draw: first_draws + number as u32,
                    scissor: None,
                    stencil_reference: None,
                    push: None,
                    commands: Some(Commands {
                        offset: COMMAND_BYTES * u64::from(first),
                        count_offset: 4 * i as u64,
                        max: run.places.end - run.places.start,
                    }),
                })
            };
            let first = (0..first_draws).map(Step::draw);
            first.chain(runs(params, view).into_iter().enumerate().filter_map(step)).collect()
        });
    }
}

impl Technique for Hybrid {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(HybridParams::default())
    }

    /// The model's objects are alike, so all take the path that reads and writes less.
    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        let [deferred, prepass] = [0.0, 1.0].map(|share| cost::hybrid(workload, share));
        let HybridParams { path, prepass_weight } = *params.typed();
        match path {
            PathChoice::Deferred => deferred,
            PathChoice::Prepass => prepass,
            PathChoice::Predicted if prepass.band * f64::from(prepass_weight) < deferred.band => prepass,
            PathChoice::Predicted => deferred,
        }
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let draws = Draws::new(graph, frame, *frame.params.typed())?;
        let filled = fill(graph, frame, &draws)?;
        let surfaces = [&filled.depth, &filled.normal, &filled.roughness];
        let sums = light_prepass::gather_lights(graph, frame, INFO.id, surfaces)?;
        apply_materials(graph, frame, filled, &sums, &draws)
    }
}

/// First pass: draws fill the G-buffer as a whole, or but normal and roughness, in the order of all techniques.
fn fill(graph: &mut Graph, frame: &Frame<'_>, draws: &Draws) -> Result<GBuffer, TechniqueError> {
    let mut whole =
        SceneDraws::shaded(frame, "surfaces/gbuffer/gbuffer.frag", "surfaces/gbuffer/gbuffer.frag#mask")?
            .stencil(OWNER, COLORED);
    whole.blend = vec![Blend::REPLACE; 4];
    let mut lobe =
        SceneDraws::shaded(frame, "light_prepass/lobe.frag#gbuffer", "light_prepass/lobe.frag#gbuffer-mask")?
            .stencil(OWNER, COLORLESS);
    // Accumulation and base colour stay.
    lobe.blend = vec![Blend::NONE, Blend::NONE, Blend::REPLACE, Blend::REPLACE];
    Ok(gbuffer::fill_by(graph, frame, INFO.id, frame.depth_stencil_format(), |pass| {
        pass.stencil_clear(COLORLESS);
        draws.draw(frame, pass, 0, [(Path::Deferred, Some(&whole)), (Path::Prepass, Some(&lobe))]);
    }))
}

/// Third pass: the sums under the colours of the G-buffer; then draws without colours again, where their depth is equal. The stencil
/// lets the first of equal depths pass and keeps them off the pixels of the others.
fn apply_materials(
    graph: &mut Graph,
    frame: &Frame<'_>,
    filled: GBuffer,
    sums: &[ImageHandle; 3],
    draws: &Draws,
) -> Result<ImageHandle, TechniqueError> {
    let again = SceneDraws::shaded(frame, "light_prepass/material.frag", "light_prepass/material.frag#mask")?
        .depth(DepthTest::EQUAL)
        .stencil(FIRST_FRAGMENT, COLORED);
    let mut pass = graph.raster("hybrid/materials", PassRole::Shading);
    frame.bind_scene(&mut pass);
    for (slot, sum) in SUMS.iter().zip(sums) {
        pass.read(slot, sum);
    }
    pass.read("gbuffer_base_color", &filled.base_color);
    let radiance = pass.color(filled.accumulation, Load::Keep);
    let _depth = pass.stencil(filled.depth, Load::Keep);
    let composes = draws.may_take(Path::Deferred);
    if composes {
        compose(frame, &mut pass)?;
    }
    draws.draw(
        frame,
        &mut pass,
        u32::from(composes),
        [(Path::Deferred, None), (Path::Prepass, Some(&again))],
    );
    pass.finish();
    Ok(radiance)
}

/// Adds what pixels with colours reflect of the light that they gathered.
fn compose(frame: &Frame<'_>, pass: &mut RasterPass<'_>) -> Result<(), TechniqueError> {
    let state = shade::full_screen(frame, "hybrid/compose.frag", &[])?.stencil(OWNED).blend(vec![Blend::ADD]);
    shade::draw_full_screen(pass, state, COLORED);
    Ok(())
}
