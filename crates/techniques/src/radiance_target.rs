//! Where fragments that shade write: linear radiance, averaged over the samples of a pixel where there are several.

use afterlight_graph::{BufferRole, Graph, ImageHandle, Load, RasterPass, gpu::vk};

use crate::frame::Frame;

/// Radiance a sample and, at several samples, the image that they are averaged into.
pub(crate) struct RadianceTarget {
    samples: ImageHandle,
    resolved: Option<ImageHandle>,
}

impl RadianceTarget {
    /// Declares the images of a technique.
    pub fn new(graph: &mut Graph, frame: &Frame<'_>, technique: &str) -> Self {
        let format = vk::Format::R16G16B16A16_SFLOAT;
        if frame.samples == 1 {
            let samples =
                graph.image(&format!("{technique}/radiance"), BufferRole::Targets, frame.image_info(format));
            return Self { samples, resolved: None };
        }
        Self {
            samples: graph.image(
                &format!("{technique}/sample radiance"),
                BufferRole::Targets,
                frame.multisampled_info(format),
            ),
            resolved: Some(graph.image(
                &format!("{technique}/radiance"),
                BufferRole::Targets,
                frame.image_info(format),
            )),
        }
    }

    /// Attaches it to a pass that begins with the background, and returns the image of one radiance a pixel.
    pub fn attach(self, frame: &Frame<'_>, pass: &mut RasterPass<'_>) -> ImageHandle {
        let samples = pass.color(self.samples, Load::Clear(frame.background()));
        match self.resolved {
            Some(resolved) => pass.resolve(resolved),
            None => samples,
        }
    }
}
