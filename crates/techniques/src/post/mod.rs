//! The last stage where anti-aliasing is asked for: filters of the image that is shown, for any technique.
//!
//! [`Post::Fxaa`] and [`Post::Smaa`] see the image alone; [`Post::Sraa`] also rasterises the scene once more, without
//! shading it.

use afterlight_graph::{
    Graph, ImageHandle,
    gpu::{self, SamplerDesc, vk},
};

use crate::{error::TechniqueError, frame::Frame, present};

/// Anti-aliasing after shading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Post {
    /// None.
    #[default]
    None,
    /// Fast approximate anti-aliasing 3.11, quality (Lottes 2009).
    Fxaa,
    /// Enhanced subpixel morphological anti-aliasing, one sample (Jimenez et al. 2012).
    Smaa,
    /// Subpixel reconstruction anti-aliasing (Chajdas et al. 2011).
    Sraa,
}

impl Post {
    /// All of them.
    pub const ALL: [Post; 4] = [Post::None, Post::Fxaa, Post::Smaa, Post::Sraa];

    /// Name on the command line and in run records.
    pub const fn name(self) -> &'static str {
        match self {
            Post::None => "none",
            Post::Fxaa => "fxaa",
            Post::Smaa => "smaa",
            Post::Sraa => "sraa",
        }
    }
}

/// Declares the tone map and the filter after it; returns the final image, RGBA8, sRGB-encoded.
///
/// # Errors
/// A shader that is not compiled in; a device without what the filter needs.
pub(crate) fn finish(
    device: &gpu::Device,
    graph: &mut Graph,
    frame: &Frame<'_>,
    hdr: &ImageHandle,
    post: Post,
) -> Result<ImageHandle, TechniqueError> {
    let _ = device;
    if post == Post::None {
        return present::tonemap(graph, frame, hdr);
    }
    let shown = present::display(graph, frame, hdr, "post/color")?;
    let target = graph.image("final color", frame.image_info(vk::Format::R8G8B8A8_UNORM));
    graph.mark_output(&target);
    fxaa(graph, frame, &shown, target)
}

fn fxaa(
    graph: &mut Graph,
    frame: &Frame<'_>,
    color: &ImageHandle,
    target: ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let mut pass = frame.compute(graph, "post/fxaa", &frame.shader("post/fxaa.comp")?);
    pass.read_sampled("color", color, SamplerDesc::LINEAR);
    let target = pass.write("final_color", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}
