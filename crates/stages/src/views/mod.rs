//! Debug views: heat images of what a technique did in each pixel.
//!
//! A view is an image of display colours in place of radiance; it is shown without tone mapping.

mod light_pairs;
mod records;
mod velocity;

pub use light_pairs::light_pair_colors;
pub use records::{ATTRIBUTE_ERRORS, RECORD_SAMPLES, RecordSource};
pub use velocity::velocity_colors;

use afterlight_frame::{
    Frame, Technique, TechniqueError,
    views::{CLUSTERS, LIGHT_PAIRS, VELOCITY},
};
use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole, RasterPass, gpu::vk};

use crate::lights::cells::{ClusterParams, TileParams};

/// Debug views that a technique has besides [`afterlight_frame::views::FINAL`]: its own, those of light pairs, that of cells, and that of
/// velocities, which any has.
pub fn of(technique: &dyn Technique) -> Vec<&'static str> {
    let params = technique.params();
    let pairs = if technique.counts_light_pairs() { LIGHT_PAIRS } else { &[] };
    let has_cells = params.holds::<TileParams>() || params.holds::<ClusterParams>();
    let cells = if has_cells { &[CLUSTERS][..] } else { &[] };
    technique.info().views.iter().chain(pairs).chain(cells).chain(&[VELOCITY]).copied().collect()
}

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
