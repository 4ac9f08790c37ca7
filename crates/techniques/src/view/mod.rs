//! Debug views: heat images of what a technique did in each pixel.
//!
//! A view is an image of display colours in place of radiance; it is shown without tone mapping.

mod light_pairs;
mod records;

pub use light_pairs::{CLUSTERS, LIGHT_COUNT, LIGHT_ERROR, LIGHT_PAIRS, LightPairs, counts_light_pairs};
pub(crate) use light_pairs::{LIGHT_PAIR, light_pair_colors};
pub(crate) use light_pairs::{light_pairs_constant, replaces_light};
pub use records::{ATTRIBUTE_ERRORS, RECORD_SAMPLES, RecordSource};

use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole, RasterPass, gpu::vk};

use crate::{
    clusters::{CLUSTER_PX, TILE_PX},
    error::TechniqueError,
    frame::Frame,
    params::Params,
    technique::Technique,
};

/// The image itself.
pub const FINAL: &str = "final";
/// Shading runs a pixel.
pub const INVOCATIONS: &str = "invocations";
/// Shading samples that a pixel keeps: black 1, red as many as it has visibility samples (Fridvalszky and Tóth 2020,
/// Figure 5).
pub const SAMPLE_USAGE: &str = "sample-usage";
/// Pixels that are shaded at more than pixel rate.
pub const EDGES: &str = "edges";
/// Pixels whose weights sum to more than the number of samples: red; to less: blue; others are black.
pub const WEIGHTS: &str = "weights";

/// Visibility samples of the image that refer to the same triangle's record (Schied and Dachsbacher 2015, Figure 1, right).
pub const TRIANGLE_SHARING: &str = "triangle-sharing";
/// Distance of positions from triangle records to those that the rasteriser interpolates (Schied and Dachsbacher 2015,
/// Figure 6, left).
pub const ATTRIBUTE_ERROR: &str = "attribute-error";
/// Difference of base colours that are looked up by texture coordinates from triangle records and by the rasteriser's
/// (Schied and Dachsbacher 2015, Figure 6, right).
pub const TEXTURE_ERROR: &str = "texture-error";

/// Views of techniques whose samples refer to records of a triangle buffer.
pub const TRIANGLES: &[&str] =
    &[SAMPLE_USAGE, INVOCATIONS, EDGES, WEIGHTS, TRIANGLE_SHARING, ATTRIBUTE_ERROR, TEXTURE_ERROR];

/// Debug views that a technique has besides [`FINAL`]: its own, those of light pairs, and that of cells.
pub fn of(technique: &dyn Technique) -> Vec<&'static str> {
    let pairs = if technique.counts_light_pairs() { LIGHT_PAIRS } else { &[] };
    let has_cells = Params::known(technique.info()).any(|p| [TILE_PX.key, CLUSTER_PX.key].contains(&p.key));
    let cells = if has_cells { &[CLUSTERS][..] } else { &[] };
    technique.info().views.iter().chain(pairs).chain(cells).copied().collect()
}

/// Whether a view is one of [`RecordSource`].
pub fn is_of_triangles(view: &str) -> bool {
    view == TRIANGLE_SHARING || compares_triangles(view)
}

/// Whether a view compares triangle records to what the rasteriser shows.
pub fn compares_triangles(view: &str) -> bool {
    [ATTRIBUTE_ERROR, TEXTURE_ERROR].contains(&view)
}

/// Number of a view in `multisample/shade.glsl`.
pub fn number(view: &str) -> u32 {
    match view {
        SAMPLE_USAGE => 1,
        INVOCATIONS => 2,
        EDGES => 3,
        WEIGHTS => 4,
        _ => 0,
    }
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
            &frame.shader("view/heat.comp")?,
        );
        pass.read("invocation_count", &self.0);
        let target = pass.write("hdr", target);
        pass.dispatch(frame.groups(8));
        pass.finish();
        Ok(target)
    }
}
