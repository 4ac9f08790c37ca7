//! What a raster pass accesses besides its slots, and whether its draws fit its attachments.

use afterlight_gpu::vk;
use afterlight_shader::Stage;

use super::access::{Access, aspects, color_access, is_depth, mip_extent};
use super::resolve::Resolver;
use crate::bind;
use crate::declare::{CallNode, Load, PassKind, RasterCommand, ResourceId, Subresource};
use crate::error::GraphError;

impl<'a> Resolver<'a> {
    pub(super) fn attachment_error(&self, what: &'static str, found: String, expected: String) -> GraphError {
        GraphError::Attachment { pass: self.pass.name.clone(), what, found, expected }
    }

    pub(super) fn raster(&mut self) -> Result<(), GraphError> {
        let PassKind::Raster(node) = &self.pass.kind else { return Ok(()) };
        let mut extent: Option<(u32, u32)> = node.extent;
        let mut samples: Option<u32> = None;
        let attach = |resolver: &Self, id: ResourceId, range: Subresource, is_color: bool| {
            let name = &resolver.node(id).name;
            let Some(info) = resolver.info(id) else {
                return Err(resolver.attachment_error(
                    "attachment",
                    format!("the buffer {name:?}"),
                    "an image".to_owned(),
                ));
            };
            if is_color == is_depth(aspects(info.format)) {
                let expected = if is_color { "a colour format" } else { "a depth format" };
                return Err(resolver.attachment_error(
                    "attachment's format",
                    format!("{:?} of {name:?}", info.format),
                    expected.to_owned(),
                ));
            }
            let range = resolver.range(id, range)?;
            if range.mip_count != 1 {
                return Err(resolver.attachment_error(
                    "mip levels of the attachment",
                    range.mip_count.to_string(),
                    "1".to_owned(),
                ));
            }
            Ok((info, range))
        };
        let fits = |resolver: &Self,
                    id: ResourceId,
                    size: (u32, u32),
                    count: u32,
                    extent: &mut Option<(u32, u32)>,
                    samples: &mut Option<u32>| {
            let name = &resolver.node(id).name;
            let first = *extent.get_or_insert(size);
            if first != size {
                return Err(resolver.attachment_error(
                    "extent of an attachment",
                    format!("{}x{} of {name:?}", size.0, size.1),
                    format!("{}x{}, as the attachment before", first.0, first.1),
                ));
            }
            let first = *samples.get_or_insert(count);
            if first != count {
                return Err(resolver.attachment_error(
                    "samples of an attachment",
                    format!("{count} of {name:?}"),
                    format!("{first}, as the attachment before"),
                ));
            }
            Ok(())
        };
        for color in &node.colors {
            let (info, range) = attach(self, color.resource, color.range, true)?;
            fits(
                self,
                color.resource,
                mip_extent(&info, range.mip),
                info.samples,
                &mut extent,
                &mut samples,
            )?;
            self.out.image_usage.push((color.resource, vk::ImageUsageFlags::COLOR_ATTACHMENT));
            self.out.accesses.push(color_access(
                color.resource,
                range,
                !color.load.keeps(),
                "colour attachment",
            ));
            if let Some((target, target_range)) = color.resolve {
                let (target_info, target_range) = attach(self, target, target_range, true)?;
                if (target_info.format, target_info.samples) != (info.format, 1)
                    || mip_extent(&target_info, target_range.mip) != mip_extent(&info, range.mip)
                    || info.samples == 1
                {
                    return Err(self.attachment_error(
                        "resolve target",
                        format!("{target_info:?} for {info:?}"),
                        "one sample, the attachment's format and extent, and an attachment of several samples"
                            .to_owned(),
                    ));
                }
                self.out.image_usage.push((target, vk::ImageUsageFlags::COLOR_ATTACHMENT));
                self.out.accesses.push(color_access(target, target_range, true, "resolve target"));
            }
        }
        if let Some(depth) = &node.depth {
            let (info, range) = attach(self, depth.resource, depth.range, false)?;
            fits(
                self,
                depth.resource,
                mip_extent(&info, range.mip),
                info.samples,
                &mut extent,
                &mut samples,
            )?;
            self.out.image_usage.push((depth.resource, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT));
            self.depth_accesses(depth, range, aspects(info.format))?;
        }
        if extent.is_none() {
            return Err(self.attachment_error(
                "attachments",
                "none, and no extent".to_owned(),
                "at least one attachment, or an extent".to_owned(),
            ));
        }
        self.draws(node)
    }

    fn depth_accesses(
        &mut self,
        depth: &crate::declare::DepthNode,
        range: Subresource,
        format_aspects: vk::ImageAspectFlags,
    ) -> Result<(), GraphError> {
        let has_stencil = format_aspects.contains(vk::ImageAspectFlags::STENCIL);
        let clears_stencil = matches!(depth.stencil, Some(Load::Clear(_)));
        if !has_stencil && (clears_stencil || depth.depth.is_none() && depth.stencil.is_some()) {
            return Err(self.attachment_error(
                "stencil of the depth attachment",
                format!("a format without stencil in {:?}", self.node(depth.resource).name),
                "a format with stencil, such as D32_SFLOAT_S8_UINT".to_owned(),
            ));
        }
        let mut push = |aspect: vk::ImageAspectFlags, write: bool, keeps: bool| {
            if !format_aspects.contains(aspect) {
                return;
            }
            let mut access = vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ;
            if write {
                access |= vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE;
            }
            self.out.accesses.push(Access {
                resource: depth.resource,
                range,
                aspects: aspect,
                stages: vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS
                    | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS,
                access,
                layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
                write,
                discard: write && !keeps,
                what: if aspect == vk::ImageAspectFlags::DEPTH {
                    "depth attachment"
                } else {
                    "stencil attachment"
                },
            });
        };
        let depth_keeps = matches!(depth.depth, Some(Load::Keep));
        let stencil_keeps = matches!(depth.stencil, Some(Load::Keep));
        push(vk::ImageAspectFlags::DEPTH, depth.depth.is_some(), depth_keeps);
        push(vk::ImageAspectFlags::STENCIL, depth.stencil.is_some(), stencil_keeps);
        Ok(())
    }

    fn draws(&mut self, node: &crate::declare::RasterNode) -> Result<(), GraphError> {
        let color_count = node.colors.len();
        for command in &node.commands {
            let draw = match command {
                RasterCommand::Draw(draw) => draw,
                RasterCommand::ClearStencil { .. } => {
                    let writes = node.depth.as_ref().is_some_and(|depth| {
                        depth.stencil.is_some()
                            && self.aspects(depth.resource).contains(vk::ImageAspectFlags::STENCIL)
                    });
                    if !writes {
                        return Err(self.attachment_error(
                            "stencil clear between draws",
                            "no stencil attachment that the pass writes".to_owned(),
                            "a call of depth or stencil with a format with stencil".to_owned(),
                        ));
                    }
                    continue;
                }
            };
            self.draw_state(node, draw, color_count)?;
            for id in &draw.vertex_buffers {
                self.fixed_buffer(
                    *id,
                    vk::BufferUsageFlags::VERTEX_BUFFER,
                    vk::PipelineStageFlags2::VERTEX_ATTRIBUTE_INPUT,
                    vk::AccessFlags2::VERTEX_ATTRIBUTE_READ,
                    "vertex buffer",
                );
            }
            if let Some((id, _)) = draw.index_buffer {
                self.fixed_buffer(
                    id,
                    vk::BufferUsageFlags::INDEX_BUFFER,
                    vk::PipelineStageFlags2::INDEX_INPUT,
                    vk::AccessFlags2::INDEX_READ,
                    "index buffer",
                );
            }
            let indirect = match draw.call {
                CallNode::Direct { .. } | CallNode::Indexed { .. } => [None, None],
                CallNode::IndexedIndirect { buffer, .. } => [Some(buffer), None],
                CallNode::IndexedIndirectCount { buffer, count_buffer, .. } => {
                    [Some(buffer), Some(count_buffer)]
                }
            };
            for id in indirect.into_iter().flatten() {
                self.indirect(id);
            }
        }
        Ok(())
    }

    pub(super) fn indirect(&mut self, id: ResourceId) {
        self.fixed_buffer(
            id,
            vk::BufferUsageFlags::INDIRECT_BUFFER,
            vk::PipelineStageFlags2::DRAW_INDIRECT,
            vk::AccessFlags2::INDIRECT_COMMAND_READ,
            "indirect arguments",
        );
    }

    fn draw_state(
        &self,
        node: &crate::declare::RasterNode,
        draw: &crate::declare::DrawNode,
        color_count: usize,
    ) -> Result<(), GraphError> {
        let state = &draw.state;
        let pass = &self.pass.name;
        bind::check_stage(pass, &state.vertex, Stage::Vertex, "Vertex")?;
        if let Some((control, evaluation)) = &state.tessellation {
            bind::check_stage(pass, control, Stage::TessControl, "TessControl")?;
            bind::check_stage(pass, evaluation, Stage::TessEvaluation, "TessEvaluation")?;
            if state.topology != vk::PrimitiveTopology::TRIANGLE_LIST {
                return Err(self.attachment_error(
                    "topology of a draw with tessellation",
                    format!("{:?}", state.topology),
                    "TRIANGLE_LIST, a patch a triangle".to_owned(),
                ));
            }
        }
        if let Some(geometry) = &state.geometry {
            bind::check_stage(pass, geometry, Stage::Geometry, "Geometry")?;
        }
        if let Some(fragment) = &state.fragment {
            bind::check_stage(pass, fragment, Stage::Fragment, "Fragment")?;
            let beyond =
                fragment.reflection.outputs.iter().find(|output| output.location as usize >= color_count);
            if let Some(output) = beyond {
                return Err(self.attachment_error(
                    "output of the fragment shader",
                    format!(
                        "{:?} of {} at location {}",
                        output.name.as_str(),
                        fragment.name,
                        output.location
                    ),
                    format!("a location below {color_count}, the number of colour attachments"),
                ));
            }
        }
        if !state.blend.is_empty() && state.blend.len() != color_count {
            return Err(self.attachment_error(
                "blend entries",
                state.blend.len().to_string(),
                format!("{color_count}, one a colour attachment, or none"),
            ));
        }
        let writes_depth = node.depth.as_ref().is_some_and(|depth| depth.depth.is_some());
        let writes_stencil = node.depth.as_ref().is_some_and(|depth| depth.stencil.is_some());
        if state.depth.write && !writes_depth {
            return Err(self.attachment_error(
                "depth test",
                "a draw that writes depth".to_owned(),
                "a depth attachment that the pass writes (RasterPass::depth)".to_owned(),
            ));
        }
        if state.stencil.is_some_and(|stencil| stencil.writes()) && !writes_stencil {
            return Err(self.attachment_error(
                "stencil test",
                "a draw that writes the stencil".to_owned(),
                "a stencil that the pass writes (RasterPass::stencil or depth)".to_owned(),
            ));
        }
        for input in &state.vertex.reflection.inputs {
            if !state.layout.attributes.iter().any(|attribute| attribute.location == input.location) {
                return Err(GraphError::MissingAttribute {
                    pass: pass.clone(),
                    shader: state.vertex.name.to_string(),
                    input: input.name.to_string(),
                    location: input.location,
                });
            }
        }
        if draw.vertex_buffers.len() != state.layout.streams.len() {
            return Err(self.attachment_error(
                "vertex buffers of a draw",
                draw.vertex_buffers.len().to_string(),
                format!("{}, the layout's streams", state.layout.streams.len()),
            ));
        }
        let indexed = !matches!(draw.call, CallNode::Direct { .. });
        if indexed && draw.index_buffer.is_none() {
            return Err(self.attachment_error(
                "index buffer of an indexed draw",
                "none".to_owned(),
                "an index buffer".to_owned(),
            ));
        }
        bind::check_constants(pass, &state.shaders(), &state.constants, &draw.push)
    }
}
