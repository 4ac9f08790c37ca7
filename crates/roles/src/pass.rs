//! What a pass is for, and by what kind of work the device does it.

use crate::roles;

roles! {
    /// Which part of a frame's work a pass does. It answers where a frame's time goes.
    ///
    /// A clear or a copy has the role of the work that it is done for.
    PassRole {
        /// Finds what shows: draws surfaces into a G-buffer, triangle IDs, sample keys or lists of surfaces.
        Geometry => "geometry",
        /// Draws depth alone, before surfaces are drawn again with the depth test `EQUAL`.
        DepthPrepass => "depth-prepass",
        /// Finds the triangles that show in a finished visibility buffer, counts them, and sizes the dispatches that follow.
        TriangleSelection => "triangle-selection",
        /// Stores the attributes of visible triangles with their screen-space derivatives.
        Derivatives => "derivatives",
        /// Finds the lights that tiles, clusters or pixels need: light culling, trees, lists, indices.
        LightAssignment => "light-assignment",
        /// Evaluates materials and lights, whether surfaces are drawn in the same pass (forward) or not (deferred).
        Shading => "shading",
        /// Averages the samples of pixels, or classifies the pixels by whether they need more than one.
        Resolve => "resolve",
        /// Work that several techniques share, reported apart: shadow map, reflective shadow map.
        Shared => "shared",
        /// Chooses the draws that a view needs and puts them in order, whatever the technique.
        Culling => "culling",
        /// Draws blended surfaces over the opaque image; techniques share it as well.
        Transparency => "transparency",
        /// Anti-aliasing after shading (FXAA, SMAA, SRAA).
        Filter => "filter",
        /// Tone mapping and what else turns radiance into the final image.
        Present => "present",
        /// What serves none of these: debug views, measurements, tests.
        Upkeep => "upkeep",
    }
}

impl PassRole {
    /// Returns whether it is work that techniques share, which a technique's own time leaves out.
    pub const fn is_shared(self) -> bool {
        matches!(self, Self::Shared | Self::Culling | Self::Transparency)
    }
}

roles! {
    /// By what kind of commands the device does a pass. It answers whether a pass touches all bytes of what it writes, as a clear
    /// and a copy do.
    PassWork {
        /// Draws.
        Raster => "raster",
        /// Dispatches.
        Compute => "compute",
        /// Fills a buffer or an image with one value.
        Clear => "clear",
        /// Copies buffers or images.
        Copy => "copy",
    }
}
