//! The frame under declaration: its resources, and where passes begin.

use std::sync::atomic::{AtomicU64, Ordering};

use afterlight_gpu::{self as gpu, vk};
use afterlight_roles::{BufferRole, PassRole};
use afterlight_shader::Shader;

use super::compute_pass::ComputePass;
use super::handles::{BufferHandle, Handle, History, ImageHandle, ResourceId};
use super::image_info::ImageInfo;
use super::nodes::{
    ComputeNode, Import, PassKind, PassNode, RasterNode, ResourceKind, ResourceNode, Version,
};
use super::raster_pass::RasterPass;
use crate::error::GraphError;

static NEXT_GRAPH: AtomicU64 = AtomicU64::new(1);

/// A frame under declaration.
pub struct Graph {
    pub(super) id: u64,
    pub(crate) resources: Vec<ResourceNode>,
    pub(crate) passes: Vec<PassNode>,
    pub(crate) errors: Vec<GraphError>,
    /// Scripts so far.
    pub(crate) scripts: u32,
}

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// Begins an empty frame.
    pub fn new() -> Self {
        Self {
            id: NEXT_GRAPH.fetch_add(1, Ordering::Relaxed),
            resources: Vec::new(),
            passes: Vec::new(),
            errors: Vec::new(),
            scripts: 0,
        }
    }

    fn add(
        &mut self,
        name: &str,
        role: BufferRole,
        kind: ResourceKind,
        import: Option<Import>,
    ) -> ResourceId {
        let bad = match &kind {
            ResourceKind::Image(info) if info.width == 0 || info.height == 0 => {
                Some(("extent", format!("{}x{}", info.width, info.height), "at least 1x1"))
            }
            ResourceKind::Image(info) if info.layers == 0 || info.mips == 0 => {
                Some(("layers and mips", format!("{} and {}", info.layers, info.mips), "at least 1 of each"))
            }
            ResourceKind::Image(info) if !info.samples.is_power_of_two() || info.samples > 64 => {
                Some(("samples", info.samples.to_string(), "a power of two from 1 to 64"))
            }
            ResourceKind::Image(info) if info.format == vk::Format::UNDEFINED => {
                Some(("format", "UNDEFINED".to_owned(), "a format"))
            }
            _ => None,
        };
        if let Some((what, found, expected)) = bad {
            let expected = expected.to_owned();
            self.errors.push(GraphError::BadResource { name: name.to_owned(), what, found, expected });
        }
        if self.resources.iter().any(|other| other.name == name) {
            self.errors.push(GraphError::DuplicateName { name: name.to_owned() });
        }
        let id = ResourceId(u32::try_from(self.resources.len()).unwrap_or(u32::MAX));
        self.resources.push(ResourceNode {
            name: name.to_owned(),
            role,
            kind,
            import,
            version: None,
            kept: false,
            output: false,
        });
        id
    }

    /// Declares a transient image; its memory may be shared with resources that live at other times.
    pub fn image(&mut self, name: &str, role: BufferRole, info: ImageInfo) -> ImageHandle {
        let resource = self.add(name, role, ResourceKind::Image(info), None);
        ImageHandle { graph: self.id, resource, info }
    }

    /// Declares a transient buffer of `bytes` bytes; its memory may be shared with resources that live at other times.
    pub fn buffer(&mut self, name: &str, role: BufferRole, bytes: u64) -> BufferHandle {
        let resource = self.add(name, role, ResourceKind::Buffer { bytes }, None);
        BufferHandle { graph: self.id, resource, bytes }
    }

    /// Declares an image that the next frame can read: what passes write to `now` is in `before` of the next frame. Nothing is copied: two
    /// images take turns ([`Turn`](crate::Turn)). Both live for the whole frame and share memory with nothing. Some pass must write all of `now`
    /// that a pass reads of `before`.
    pub fn history_image(&mut self, name: &str, role: BufferRole, info: ImageInfo) -> History<ImageHandle> {
        let [before, now] = self.add_versions(name, role, &ResourceKind::Image(info));
        let handle = |resource| ImageHandle { graph: self.id, resource, info };
        History { before: handle(before), now: handle(now) }
    }

    /// Declares a buffer of `bytes` bytes that the next frame can read, as [`Graph::history_image`].
    pub fn history_buffer(&mut self, name: &str, role: BufferRole, bytes: u64) -> History<BufferHandle> {
        let [before, now] = self.add_versions(name, role, &ResourceKind::Buffer { bytes });
        let handle = |resource| BufferHandle { graph: self.id, resource, bytes };
        History { before: handle(before), now: handle(now) }
    }

    /// Adds the versions of the frame before and of this frame.
    fn add_versions(&mut self, name: &str, role: BufferRole, kind: &ResourceKind) -> [ResourceId; 2] {
        let before = self.add(&format!("{name} before"), role, kind.clone(), None);
        let now = self.add(name, role, kind.clone(), None);
        self.resources[before.0 as usize].version = Some(Version::Before { now });
        self.resources[now.0 as usize].version = Some(Version::Now { before });
        [before, now]
    }

    /// Brings in a buffer that lives outside the graph; passes that write it always run.
    pub fn import_buffer(&mut self, name: &str, role: BufferRole, buffer: &gpu::Buffer) -> BufferHandle {
        let bytes = buffer.bytes();
        let resource =
            self.add(name, role, ResourceKind::Buffer { bytes }, Some(Import::Buffer(buffer.clone())));
        BufferHandle { graph: self.id, resource, bytes }
    }

    /// Brings in an image that lives outside the graph and is in `layout` before each frame; the frame leaves it in that
    /// layout again (with `UNDEFINED` its contents are dropped before, and its layout after is that of its last use).
    pub fn import_image(
        &mut self,
        name: &str,
        role: BufferRole,
        image: &gpu::Image,
        layout: vk::ImageLayout,
    ) -> ImageHandle {
        let [width, height] = image.extent();
        let info = ImageInfo {
            format: image.format(),
            width,
            height,
            layers: image.layers(),
            mips: image.mips(),
            samples: image.samples(),
        };
        let import = Import::Image { image: image.clone(), layout };
        let resource = self.add(name, role, ResourceKind::Image(info), Some(import));
        ImageHandle { graph: self.id, resource, info }
    }

    /// Imports an image that no device backs, for plans in tests.
    #[cfg(test)]
    pub(crate) fn import_fake(
        &mut self,
        name: &str,
        role: BufferRole,
        info: ImageInfo,
        layout: vk::ImageLayout,
    ) -> ImageHandle {
        let resource = self.add(name, role, ResourceKind::Image(info), Some(Import::Fake { layout }));
        ImageHandle { graph: self.id, resource, info }
    }

    pub(super) fn own(&mut self, place: &str, handle: &impl Handle) -> Option<ResourceId> {
        let (graph, resource) = handle.parts();
        if graph == self.id {
            return Some(resource);
        }
        let found = format!("#{}", resource.0);
        self.errors.push(GraphError::ForeignHandle { pass: place.to_owned(), found });
        None
    }

    /// Keeps a resource's contents to the end of the frame: it can be read back, and the passes that make it run.
    pub fn keep(&mut self, handle: &impl Handle) -> ResourceId {
        if let Some(id) = self.own("keep", handle) {
            self.resources[id.0 as usize].kept = true;
        }
        handle.parts().1
    }

    /// Marks a resource as the final colour target: the technique's bytes leave it out.
    pub fn mark_output(&mut self, handle: &impl Handle) {
        if let Some(id) = self.own("mark_output", handle) {
            self.resources[id.0 as usize].output = true;
        }
    }

    pub(super) fn pass(&mut self, name: &str, role: PassRole, kind: PassKind) -> usize {
        self.passes.push(PassNode {
            name: name.to_owned(),
            role,
            kind,
            slots: Vec::new(),
            texture_set: None,
            has_effect: false,
        });
        self.passes.len() - 1
    }

    /// Begins a raster pass.
    pub fn raster(&mut self, name: &str, role: PassRole) -> RasterPass<'_> {
        let pass = self.pass(name, role, PassKind::Raster(RasterNode::default()));
        RasterPass { graph: self, pass }
    }

    /// Begins a compute pass with one shader.
    pub fn compute(&mut self, name: &str, role: PassRole, shader: &Shader) -> ComputePass<'_> {
        let node = ComputeNode {
            shader: shader.clone(),
            constants: Vec::new(),
            push: Vec::new(),
            dispatches: Vec::new(),
            subgroup_size: None,
        };
        let pass = self.pass(name, role, PassKind::Compute(Box::new(node)));
        ComputePass { graph: self, pass }
    }

    /// Has the compute passes of that name, declared before, run in subgroups of `invocations`. For
    /// tests that give a stage every size that a device offers. Returns whether there is such a pass.
    pub fn set_subgroup_size(&mut self, pass: &str, invocations: u32) -> bool {
        let mut found = false;
        for node in self.passes.iter_mut().filter(|node| node.name == pass) {
            if let PassKind::Compute(node) = &mut node.kind {
                node.subgroup_size = Some(invocations);
                found = true;
            }
        }
        found
    }
}
