//! Debug views: heat images of what a technique did in each pixel.
//!
//! A view is an image of display colours in place of radiance; it is shown without tone mapping.

mod light_pairs;
mod records;

pub use light_pairs::light_pair_colors;
pub use records::{ATTRIBUTE_ERRORS, RECORD_SAMPLES, RecordSource};

use afterlight_frame::{Frame, TechniqueError};
use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole, RasterPass, gpu::vk};

/// A count a pixel that fragment shaders add to.
pub struct InvocationCount(ImageHandle);

impl InvocationCount {
    /// Declares the count, zero everywhere.
    pub fn new(graph: &mut Graph, frame: &Frame<'_>, technique: &str) -> Self {
        let image = graph.image(
            &format!("{technique}/invocation count"),
            BufferRole::Counters,
            frame.image_info(vk::Format::R32_UINT),
        );
        Self(graph.clear_image(&format!("{technique}/clear count"), PassRole::Upkeep, image, [0.0; 4]))
    }

    /// Binds it to a pass whose shaders were compiled with COUNT_INVOCATIONS.
    pub fn bind(self, pass: &mut RasterPass<'_>) -> Self {
        Self(pass.write("invocation_count", self.0))
    }

    /// Declares the pass that turns it into colours.
    ///
    /// # Errors
    /// A shader that is not compiled in.
    pub fn heat(
        self,
        graph: &mut Graph,
        frame: &Frame<'_>,
        technique: &str,
    ) -> Result<ImageHandle, TechniqueError> {
        let target = graph.image(
            &format!("{technique}/heat"),
            BufferRole::Targets,
            frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
        );
        let mut pass = frame.compute(
            graph,
            &format!("{technique}/heat"),
            PassRole::Upkeep,
            &frame.shader("views/heat.comp")?,
        );
        pass.read("invocation_count", &self.0);
        let target = pass.write("hdr", target);
        pass.dispatch(frame.groups(8));
        pass.finish();
        Ok(target)
    }
}
