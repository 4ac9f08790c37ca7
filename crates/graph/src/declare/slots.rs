//! What all kinds of passes share: resources bound by the shaders' names. The macro's user imports the types that it names.

use super::graph::Graph;
use super::handles::ResourceId;
use super::nodes::SlotNode;
use crate::error::GraphError;

/// The slots of a pass: what draws and dispatches of it see in set 0, by the shader's names.
macro_rules! slots {
    () => {
        fn bind(
            &mut self,
            slot: &str,
            intent: Intent,
            handle: &impl Handle,
            range: Subresource,
            sampler: Option<gpu::SamplerDesc>,
        ) {
            let name = self.graph.passes[self.pass].name.clone();
            if let Some(resource) = self.graph.own(&name, handle) {
                self.graph.bind_slot(
                    self.pass,
                    SlotNode { slot: slot.to_owned(), intent, resource: Some(resource), range, sampler },
                );
            }
        }

        /// Binds a resource that the shaders read: uniform or storage buffer, sampled or storage image, as the shader
        /// declares the slot. A combined image sampler gets a nearest, clamping sampler; it suits `texelFetch`.
        pub fn read(&mut self, slot: &str, handle: &impl Handle) -> &mut Self {
            self.bind(slot, Intent::Read, handle, Subresource::ALL, None);
            self
        }

        /// Binds levels and layers of an image that the shaders read.
        pub fn read_range(&mut self, slot: &str, image: &ImageHandle, range: Subresource) -> &mut Self {
            self.bind(slot, Intent::Read, image, range, None);
            self
        }

        /// Binds an image with its sampler.
        pub fn read_sampled(
            &mut self,
            slot: &str,
            image: &ImageHandle,
            sampler: gpu::SamplerDesc,
        ) -> &mut Self {
            self.bind(slot, Intent::Read, image, Subresource::ALL, Some(sampler));
            self
        }

        /// Binds levels and layers of an image with a sampler.
        pub fn read_sampled_range(
            &mut self,
            slot: &str,
            image: &ImageHandle,
            range: Subresource,
            sampler: gpu::SamplerDesc,
        ) -> &mut Self {
            self.bind(slot, Intent::Read, image, range, Some(sampler));
            self
        }

        /// Binds a sampler alone.
        pub fn sampler(&mut self, slot: &str, sampler: gpu::SamplerDesc) -> &mut Self {
            let node = SlotNode {
                slot: slot.to_owned(),
                intent: Intent::Read,
                resource: None,
                range: Subresource::ALL,
                sampler: Some(sampler),
            };
            self.graph.bind_slot(self.pass, node);
            self
        }

        /// Binds a storage buffer or image that the shaders write (and may read), and returns its next version.
        pub fn write<H: Handle>(&mut self, slot: &str, handle: H) -> H {
            self.bind(slot, Intent::Write, &handle, Subresource::ALL, None);
            handle
        }

        /// Binds levels and layers of a storage image that the shaders write, and returns the image's next version.
        pub fn write_range(&mut self, slot: &str, image: ImageHandle, range: Subresource) -> ImageHandle {
            self.bind(slot, Intent::Write, &image, range, None);
            image
        }

        /// Binds a long-lived descriptor set (the scene's textures) as set 1.
        pub fn texture_set(&mut self, set: &gpu::DescriptorSet) -> &mut Self {
            self.graph.passes[self.pass].texture_set = Some(set.clone());
            self
        }

        /// Lets the pass run even if nothing uses what it writes.
        pub fn has_effect(&mut self) -> &mut Self {
            self.graph.passes[self.pass].has_effect = true;
            self
        }

        /// Ends the declaration of the pass; dropping it does the same.
        pub fn finish(self) {}
    };
}

pub(super) use slots;

impl Graph {
    pub(super) fn bind_slot(&mut self, pass: usize, node: SlotNode) {
        let pass = &mut self.passes[pass];
        if let Some(first) = pass.slots.iter().find(|other| other.slot == node.slot) {
            let name_of = |id: Option<ResourceId>| match id {
                Some(id) => self.resources[id.0 as usize].name.clone(),
                None => "a sampler".to_owned(),
            };
            self.errors.push(GraphError::DoublyBound {
                pass: pass.name.clone(),
                slot: node.slot,
                first: name_of(first.resource),
                second: name_of(node.resource),
            });
            return;
        }
        pass.slots.push(node);
    }
}
