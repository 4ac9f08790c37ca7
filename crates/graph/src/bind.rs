//! Matches the slots that a pass binds by name with what its shaders' reflection declares.

use afterlight_gpu::vk;
use afterlight_shader::{Binding, BindingKind, Shader, Stage};

use crate::declare::{Intent, PassNode, ResourceKind, ResourceNode};
use crate::error::GraphError;

/// The descriptor set that holds a pass's resources, pushed for each pipeline.
pub(crate) const RESOURCE_SET: u32 = 0;
/// The descriptor set of the scene's textures, bound whole.
pub(crate) const TEXTURE_SET: u32 = 1;

/// One descriptor of a pipeline with the slot of the pass that fills it.
#[derive(Clone, Debug)]
pub(crate) struct BoundSlot {
    /// `binding` in set 0.
    pub binding: u32,
    pub kind: BindingKind,
    /// Index into the pass's slots.
    pub slot: usize,
    pub stages: vk::ShaderStageFlags,
    /// Whether the shader's image type has layers.
    pub arrayed: bool,
    pub readable: bool,
}

/// Returns the stage's flag.
pub(crate) fn stage_flags(stage: Stage) -> vk::ShaderStageFlags {
    match stage {
        Stage::Vertex => vk::ShaderStageFlags::VERTEX,
        Stage::TessControl => vk::ShaderStageFlags::TESSELLATION_CONTROL,
        Stage::TessEvaluation => vk::ShaderStageFlags::TESSELLATION_EVALUATION,
        Stage::Geometry => vk::ShaderStageFlags::GEOMETRY,
        Stage::Fragment => vk::ShaderStageFlags::FRAGMENT,
        Stage::Compute => vk::ShaderStageFlags::COMPUTE,
    }
}

/// Returns the pipeline stages in which shaders of those stages run.
pub(crate) fn pipeline_stages(stages: vk::ShaderStageFlags) -> vk::PipelineStageFlags2 {
    let pairs = [
        (vk::ShaderStageFlags::VERTEX, vk::PipelineStageFlags2::VERTEX_SHADER),
        (vk::ShaderStageFlags::TESSELLATION_CONTROL, vk::PipelineStageFlags2::TESSELLATION_CONTROL_SHADER),
        (
            vk::ShaderStageFlags::TESSELLATION_EVALUATION,
            vk::PipelineStageFlags2::TESSELLATION_EVALUATION_SHADER,
        ),
        (vk::ShaderStageFlags::GEOMETRY, vk::PipelineStageFlags2::GEOMETRY_SHADER),
        (vk::ShaderStageFlags::FRAGMENT, vk::PipelineStageFlags2::FRAGMENT_SHADER),
        (vk::ShaderStageFlags::COMPUTE, vk::PipelineStageFlags2::COMPUTE_SHADER),
    ];
    pairs
        .iter()
        .filter(|(flag, _)| stages.contains(*flag))
        .fold(vk::PipelineStageFlags2::NONE, |all, (_, stage)| all | *stage)
}

fn kind_name(kind: BindingKind) -> &'static str {
    match kind {
        BindingKind::UniformBuffer => "uniform buffer",
        BindingKind::StorageBuffer => "storage buffer",
        BindingKind::SampledImage => "sampled image",
        BindingKind::CombinedImageSampler => "image with sampler",
        BindingKind::StorageImage => "storage image",
        BindingKind::Sampler => "sampler",
    }
}

fn takes_buffer(kind: BindingKind) -> bool {
    matches!(kind, BindingKind::UniformBuffer | BindingKind::StorageBuffer)
}

fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names.dedup();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

fn check_slot(
    pass: &PassNode,
    resources: &[ResourceNode],
    shader: &Shader,
    binding: &Binding,
    slot_index: usize,
) -> Result<(), GraphError> {
    let slot = &pass.slots[slot_index];
    let wrong_kind = |found: String| GraphError::WrongKind {
        pass: pass.name.clone(),
        slot: slot.slot.clone(),
        shader: shader.name.to_string(),
        found,
        expected: kind_name(binding.kind).to_owned(),
    };
    if binding.count != 1 {
        return Err(GraphError::WrongKind {
            pass: pass.name.clone(),
            slot: slot.slot.clone(),
            shader: shader.name.to_string(),
            found: format!("an array of {} descriptors in set {RESOURCE_SET}", binding.count),
            expected: format!("one descriptor (arrays go into set {TEXTURE_SET})"),
        });
    }
    match slot.resource.map(|id| &resources[id.0 as usize]) {
        None if binding.kind != BindingKind::Sampler => return Err(wrong_kind("a sampler".to_owned())),
        None => {}
        Some(resource) => {
            let fits = match &resource.kind {
                ResourceKind::Buffer { .. } => takes_buffer(binding.kind),
                ResourceKind::Image(_) => !takes_buffer(binding.kind) && binding.kind != BindingKind::Sampler,
            };
            if !fits {
                let kind = match &resource.kind {
                    ResourceKind::Buffer { .. } => "buffer",
                    ResourceKind::Image(_) => "image",
                };
                return Err(wrong_kind(format!("the {kind} {:?}", resource.name)));
            }
            if let (ResourceKind::Image(info), Some(shape)) = (&resource.kind, binding.image)
                && shape.multisampled != (info.samples > 1)
            {
                return Err(wrong_kind(format!("the image {:?} of {} samples", resource.name, info.samples)));
            }
        }
    }
    let direction = |found, expected| GraphError::WrongDirection {
        pass: pass.name.clone(),
        slot: slot.slot.clone(),
        shader: shader.name.to_string(),
        found,
        expected,
    };
    match slot.intent {
        Intent::Read if !binding.readable => {
            Err(direction("read", "write (the shader declares it writeonly)"))
        }
        _ => Ok(()),
    }
}

/// Finds the slot of each descriptor in set 0 of a pipeline's shaders.
pub(crate) fn bind_shaders(
    pass: &PassNode,
    resources: &[ResourceNode],
    shaders: &[&Shader],
) -> Result<Vec<BoundSlot>, GraphError> {
    let mut bound: Vec<BoundSlot> = Vec::new();
    for shader in shaders {
        for binding in &shader.reflection.bindings {
            if binding.set == TEXTURE_SET {
                if pass.texture_set.is_none() {
                    return Err(missing(pass, shader, binding, "texture set (set 1)"));
                }
                continue;
            }
            let Some(slot) = pass.slots.iter().position(|slot| slot.slot == *binding.name) else {
                return Err(missing(pass, shader, binding, kind_name(binding.kind)));
            };
            check_slot(pass, resources, shader, binding, slot)?;
            let stages = stage_flags(shader.stage);
            match bound.iter_mut().find(|other| other.binding == binding.binding) {
                Some(other) if other.slot == slot && other.kind == binding.kind => {
                    other.stages |= stages;
                    other.readable |= binding.readable;
                }
                Some(other) => {
                    let first = &pass.slots[other.slot].slot;
                    return Err(GraphError::WrongKind {
                        pass: pass.name.clone(),
                        slot: pass.slots[slot].slot.clone(),
                        shader: shader.name.to_string(),
                        found: format!(
                            "{} {:?} at binding {}",
                            kind_name(binding.kind),
                            binding.name.as_str(),
                            binding.binding
                        ),
                        expected: format!(
                            "{} {first:?}, as the pipeline's other stage has",
                            kind_name(other.kind)
                        ),
                    });
                }
                None => bound.push(BoundSlot {
                    binding: binding.binding,
                    kind: binding.kind,
                    slot,
                    stages,
                    arrayed: binding.image.is_some_and(|shape| shape.arrayed),
                    readable: binding.readable,
                }),
            }
        }
    }
    bound.sort_by_key(|slot| slot.binding);
    Ok(bound)
}

fn missing(pass: &PassNode, shader: &Shader, binding: &Binding, expected: &'static str) -> GraphError {
    GraphError::MissingSlot {
        pass: pass.name.clone(),
        shader: shader.name.to_string(),
        slot: binding.name.to_string(),
        expected,
        bound: names(pass.slots.iter().map(|slot| slot.slot.as_str())),
    }
}

/// Checks that some shader of the pass can write each slot that the pass declares as written. A pass over a scene without draws has no
/// shader and writes nothing.
pub(crate) fn check_writes(pass: &PassNode, shaders: &[&Shader]) -> Result<(), GraphError> {
    if shaders.is_empty() {
        return Ok(());
    }
    for slot in pass.slots.iter().filter(|slot| slot.intent == Intent::Write) {
        let mut found = shaders
            .iter()
            .filter_map(|shader| Some((*shader, shader.reflection.binding(&slot.slot)?)))
            .peekable();
        let Some((first, _)) = found.peek().copied() else {
            let known = shaders.iter().flat_map(|shader| shader.reflection.bindings.iter());
            return Err(GraphError::UnknownSlot {
                pass: pass.name.clone(),
                slot: slot.slot.clone(),
                known: names(known.map(|binding| binding.name.as_str())),
            });
        };
        if !found.any(|(_, binding)| binding.writable) {
            return Err(GraphError::WrongDirection {
                pass: pass.name.clone(),
                slot: slot.slot.clone(),
                shader: first.name.to_string(),
                found: "write",
                expected: "read (the shader declares it readonly)",
            });
        }
    }
    Ok(())
}

/// A slot declared as read must not be one that a shader could write: the planner would miss the hazard.
pub(crate) fn check_reads(pass: &PassNode, shaders: &[&Shader]) -> Result<(), GraphError> {
    for slot in pass.slots.iter().filter(|slot| slot.intent == Intent::Read) {
        for shader in shaders {
            if shader.reflection.binding(&slot.slot).is_some_and(|binding| binding.writable) {
                return Err(GraphError::WrongDirection {
                    pass: pass.name.clone(),
                    slot: slot.slot.clone(),
                    shader: shader.name.to_string(),
                    found: "read",
                    expected: "write (the shader does not declare it readonly)",
                });
            }
        }
    }
    Ok(())
}

/// Checks constants' names and the size of push constants of a pipeline.
pub(crate) fn check_constants(
    pass: &str,
    shaders: &[&Shader],
    constants: &[(String, u32)],
    push: &[u8],
) -> Result<(), GraphError> {
    for (name, _) in constants {
        if !shaders.iter().any(|shader| shader.reflection.spec_constant(name).is_some()) {
            let known = shaders.iter().flat_map(|shader| shader.reflection.spec_constants.iter());
            return Err(GraphError::UnknownConstant {
                pass: pass.to_owned(),
                constant: name.clone(),
                known: names(known.map(|constant| constant.name.as_str())),
            });
        }
    }
    let expected = push_bytes(shaders);
    let found = u32::try_from(push.len()).unwrap_or(u32::MAX);
    // A struct's end may be padded to its alignment; what the shader declares must be there.
    let padded = expected.next_multiple_of(16);
    if found < expected || found > padded {
        return Err(GraphError::PushBytes {
            pass: pass.to_owned(),
            shader: shaders.first().map(|shader| shader.name.to_string()).unwrap_or_default(),
            found,
            expected,
        });
    }
    Ok(())
}

/// Returns the bytes of push constants that the shaders of one pipeline declare together.
pub(crate) fn push_bytes(shaders: &[&Shader]) -> u32 {
    shaders.iter().map(|shader| shader.reflection.push_constant_bytes).max().unwrap_or(0)
}

/// Checks the stage of a shader.
pub(crate) fn check_stage(
    pass: &str,
    shader: &Shader,
    expected: Stage,
    name: &'static str,
) -> Result<(), GraphError> {
    if shader.stage == expected {
        return Ok(());
    }
    Err(GraphError::WrongStage {
        pass: pass.to_owned(),
        shader: shader.name.to_string(),
        found: format!("{:?}", shader.stage),
        expected: name,
    })
}
