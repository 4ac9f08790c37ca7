//! Binding of resources to the slots of a pass, raster or compute.

use afterlight_graph::{BufferHandle, ImageHandle, gpu};

/// What binds resources to the slots of a pass: raster or compute.
pub trait Slots {
    /// Binds a buffer that shaders read.
    fn read_buffer(&mut self, slot: &str, buffer: &BufferHandle);
    /// Binds an image that shaders read.
    fn read_image(&mut self, slot: &str, image: &ImageHandle);
    /// Binds the scene's textures.
    fn textures(&mut self, set: &gpu::DescriptorSet);
}

/// What a source of surfaces is bound to: the slots of a pass, and specialization constants of its shaders.
pub trait SourceSlots: Slots {
    /// Sets a specialization constant.
    fn constant(&mut self, name: &str, value: u32);
}

/// Sets specialization constants.
pub fn set_constants<N: AsRef<str>>(
    pass: &mut (impl SourceSlots + ?Sized),
    constants: impl IntoIterator<Item = (N, u32)>,
) {
    for (name, value) in constants {
        pass.constant(name.as_ref(), value);
    }
}

impl SourceSlots for afterlight_graph::ComputePass<'_> {
    fn constant(&mut self, name: &str, value: u32) {
        afterlight_graph::ComputePass::constant(self, name, value);
    }
}

macro_rules! slots {
    ($pass:ident) => {
        impl Slots for afterlight_graph::$pass<'_> {
            fn read_buffer(&mut self, slot: &str, buffer: &BufferHandle) {
                self.read(slot, buffer);
            }
            fn read_image(&mut self, slot: &str, image: &ImageHandle) {
                self.read(slot, image);
            }
            fn textures(&mut self, set: &gpu::DescriptorSet) {
                self.texture_set(set);
            }
        }
    };
}
slots!(RasterPass);
slots!(ComputePass);
