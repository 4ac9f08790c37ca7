//! A frame's pipelines, made in parallel, each once.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use afterlight_gpu::{self as gpu, vk};
use afterlight_shader::{Shader, Stage};

use super::builder::Builder;
use super::descriptors::{slot_layouts, texture_set};
use super::raster::draws;
use crate::bind::{self, BoundSlot};
use crate::declare::{Blend, DepthTest, PassKind, RasterNode, RasterState, StencilFace, StencilTest};
use crate::error::GraphError;
use crate::plan::PlannedPass;

/// A pipeline to be made: the pass, and the draw that first uses it (0 for compute).
#[derive(Clone, Copy)]
pub(super) struct Job {
    pub(super) pass: usize,
    pub(super) draw: usize,
}

impl Builder<'_> {
    /// Lists the distinct pipelines, and for each pass and draw the index of its pipeline among those of the pass.
    pub(super) fn jobs(&self) -> (Vec<Job>, Vec<Vec<usize>>) {
        let mut jobs = Vec::new();
        let mut pipeline_of = Vec::new();
        for (index, pass) in self.plan.passes.iter().enumerate() {
            let mut of_pass: Vec<usize> = Vec::new();
            match &pass.node.kind {
                PassKind::Raster(node) => {
                    let mut firsts: Vec<(usize, &RasterState)> = Vec::new();
                    for (draw, state) in draws(node).map(|draw| &draw.state).enumerate() {
                        let known = firsts.iter().position(|(_, other)| same_pipeline(other, state));
                        of_pass.push(known.unwrap_or_else(|| {
                            firsts.push((draw, state));
                            jobs.push(Job { pass: index, draw });
                            firsts.len() - 1
                        }));
                    }
                }
                PassKind::Compute(_) => jobs.push(Job { pass: index, draw: 0 }),
                PassKind::Transfer(_) => {}
            }
            pipeline_of.push(of_pass);
        }
        (jobs, pipeline_of)
    }

    /// Makes pipelines on as many threads as the host has.
    pub(super) fn make_pipelines(&self, jobs: &[Job]) -> Result<Vec<gpu::Pipeline>, GraphError> {
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(jobs.len());
        let next = AtomicUsize::new(0);
        let made: Mutex<Vec<Option<Result<gpu::Pipeline, GraphError>>>> =
            Mutex::new((0..jobs.len()).map(|_| None).collect());
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(job) = jobs.get(index) else { return };
                let pipeline = self.make_pipeline(*job);
                made.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(pipeline);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads {
                scope.spawn(work);
            }
            work();
        });
        let made = made.into_inner().unwrap_or_else(PoisonError::into_inner);
        made.into_iter().flatten().collect()
    }

    fn make_pipeline(&self, job: Job) -> Result<gpu::Pipeline, GraphError> {
        let pass = &self.plan.passes[job.pass];
        match &pass.node.kind {
            PassKind::Compute(node) => {
                let slots = slot_layouts(&pass.bindings[0]);
                let constants = constants_of(&node.shader, &node.constants);
                let texture_set = texture_set(pass, &[&node.shader]);
                Ok(self.device.compute_pipeline(&gpu::ComputePipelineDesc {
                    shader: code(&node.shader, &constants),
                    slots: &slots,
                    long_lived: texture_set.map(gpu::DescriptorSet::slots),
                    push_constant_bytes: bind::push_bytes(&[&node.shader]),
                    subgroup: node.subgroup_size.map(|invocations| gpu::RequiredSubgroup {
                        invocations,
                        is_full: node.shader.reflection.local_size[0].is_multiple_of(invocations),
                    }),
                })?)
            }
            PassKind::Raster(node) => {
                let draw =
                    draws(node).nth(job.draw).unwrap_or_else(|| unreachable!("jobs list draws that exist"));
                self.raster_pipeline(pass, node, &draw.state, &pass.bindings[job.draw])
            }
            PassKind::Transfer(_) => unreachable!("transfers have no pipeline"),
        }
    }

    fn raster_pipeline(
        &self,
        pass: &PlannedPass,
        node: &RasterNode,
        state: &RasterState,
        bindings: &[BoundSlot],
    ) -> Result<gpu::Pipeline, GraphError> {
        let shaders = state.shaders();
        // In the order of `shaders`: each stage takes the constants that it has.
        let constants: Vec<_> = shaders.iter().map(|shader| constants_of(shader, &state.constants)).collect();
        let stage_code = |stage: Stage| {
            let (shader, constants) =
                shaders.iter().zip(&constants).find(|(shader, _)| shader.stage == stage)?;
            Some(code(shader, constants))
        };
        let patches = stage_code(Stage::TessControl).zip(stage_code(Stage::TessEvaluation));
        let formats: Vec<vk::Format> =
            node.colors.iter().map(|color| self.image(color.resource).format()).collect();
        let blend: Vec<gpu::BlendState> = match state.blend.is_empty() {
            true => vec![gpu::BlendState::OVERWRITE; formats.len()],
            false => state.blend.iter().map(blend_state).collect(),
        };
        let depth_format = node.depth.as_ref().map(|depth| self.image(depth.resource).format());
        let attached = node.colors.first().map(|color| color.resource);
        let attached = attached.or(node.depth.as_ref().map(|depth| depth.resource));
        let vertex_bindings: Vec<gpu::VertexBinding> = state
            .layout
            .streams
            .iter()
            .zip(0..)
            .map(|(stream, binding)| gpu::VertexBinding {
                binding,
                stride_bytes: stream.stride_bytes,
                per_instance: stream.per_instance,
            })
            .collect();
        let vertex_attributes: Vec<gpu::VertexAttribute> = state
            .layout
            .attributes
            .iter()
            .map(|attribute| gpu::VertexAttribute {
                location: attribute.location,
                binding: attribute.stream,
                format: attribute.format,
                offset_bytes: attribute.offset_bytes,
            })
            .collect();
        Ok(self.device.raster_pipeline(&gpu::RasterPipelineDesc {
            vertex: code(&state.vertex, &constants[0]),
            tessellation: patches.map(|(control, evaluation)| [control, evaluation]),
            patch_control_points: if patches.is_some() { 3 } else { 0 },
            geometry: stage_code(Stage::Geometry),
            fragment: stage_code(Stage::Fragment),
            slots: &slot_layouts(bindings),
            long_lived: texture_set(pass, &shaders).map(gpu::DescriptorSet::slots),
            push_constant_bytes: bind::push_bytes(&shaders),
            vertex_bindings: &vertex_bindings,
            vertex_attributes: &vertex_attributes,
            topology: if patches.is_some() { vk::PrimitiveTopology::PATCH_LIST } else { state.topology },
            polygon_mode: vk::PolygonMode::FILL,
            depth: (state.depth != DepthTest::OFF)
                .then_some(gpu::DepthState { compare: state.depth.compare, write: state.depth.write }),
            depth_clamp: state.depth_clamp,
            depth_bias: is_biased(state),
            stencil: state.stencil.as_ref().map(stencil_state),
            blend: &blend,
            blend_constants: state.blend_constants,
            color_formats: &formats,
            depth_format,
            samples: attached.map_or(1, |id| self.image(id).samples()),
            sample_shading: false,
            alpha_to_coverage: false,
        })?)
    }
}

fn same_shader(a: &Shader, b: &Shader) -> bool {
    a.name == b.name && a.spirv.len() == b.spirv.len() && std::ptr::eq(a.spirv.as_ptr(), b.spirv.as_ptr())
}

/// Whether a bias is added to depth.
fn is_biased(state: &RasterState) -> bool {
    state.depth_bias_slope != 0.0
}

/// Whether two states make the same pipeline; cull mode, front face and the depth bias are set with the draw.
fn same_pipeline(a: &RasterState, b: &RasterState) -> bool {
    // A shader knows its stage, so that lists of one length that agree hold the same stages.
    let (of_a, of_b) = (a.shaders(), b.shaders());
    of_a.len() == of_b.len()
        && of_a.iter().zip(of_b).all(|(a, b)| same_shader(a, b))
        && a.constants == b.constants
        && a.topology == b.topology
        && a.depth == b.depth
        && a.depth_clamp == b.depth_clamp
        && is_biased(a) == is_biased(b)
        && a.stencil == b.stencil
        && a.blend == b.blend
        && a.blend_constants == b.blend_constants
        && a.layout == b.layout
}

fn constants_of(shader: &Shader, constants: &[(String, u32)]) -> Vec<(u32, u32)> {
    constants
        .iter()
        .filter_map(|(name, bits)| Some((shader.reflection.spec_constant(name)?.id, *bits)))
        .collect()
}

fn code<'a>(shader: &'a Shader, constants: &'a [(u32, u32)]) -> gpu::ShaderCode<'a> {
    gpu::ShaderCode { name: shader.name.as_str(), spirv: &shader.spirv, constants }
}

fn blend_state(blend: &Blend) -> gpu::BlendState {
    gpu::BlendState {
        write: blend.write_mask,
        equation: blend.equation.map(|equation| gpu::BlendEquation {
            color: [equation.src_color, equation.dst_color],
            color_op: equation.color_op,
            alpha: [equation.src_alpha, equation.dst_alpha],
            alpha_op: equation.alpha_op,
        }),
    }
}

fn stencil_state(test: &StencilTest) -> gpu::StencilState {
    let face = |face: &StencilFace| gpu::StencilFace {
        compare: face.compare,
        compare_mask: test.compare_mask,
        write_mask: test.write_mask,
        pass: face.pass,
        fail: face.fail,
        depth_fail: face.depth_fail,
    };
    gpu::StencilState { front: face(&test.front), back: face(&test.back) }
}
