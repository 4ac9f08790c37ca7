//! What a buffer or an image holds.

use crate::roles;

roles! {
    /// What a buffer or an image holds. It answers where a frame's memory and its memory traffic go.
    BufferRole {
        /// Attributes of visible surfaces in a G-buffer, one value a sample: base colour, normal, roughness, emission, distance.
        Surfaces => "surfaces",
        /// Depth, with or without stencil, and stencil alone.
        Depth => "depth",
        /// Visibility buffer: an image of triangle IDs, or of references to triangle records, one a sample.
        Visibility => "visibility",
        /// Depth and triangle of each sample in one 64-bit key, which compute shaders write by atomics.
        SampleKeys => "sample-keys",
        /// Queues of rasterisation in compute, with their counts: large triangles, tile jobs.
        RasterQueues => "raster-queues",
        /// Start of the list of surfaces of each pixel.
        SurfaceListHeads => "surface-list-heads",
        /// Nodes or blocks of the lists of surfaces, and what is counted with them: how many are in use, samples that found none.
        SurfaceListNodes => "surface-list-nodes",
        /// Bits by which masked surfaces of one depth share the samples of a pixel.
        Claims => "claims",
        /// Triangle buffer: attributes of visible triangles with their screen-space derivatives.
        Triangles => "triangles",
        /// Sets of triangles while the visible ones are found: a bit a triangle, prefix sums, counts, sizes of dispatches.
        TriangleSets => "triangle-sets",
        /// Memoization cache by which fragments find the record of their triangle.
        MemoizationCache => "memoization-cache",
        /// Lights, and what finds them: trees, cells of tiles and clusters, lists, indices a pixel.
        Lights => "lights",
        /// Radiance, what is accumulated or averaged into it, and the final image.
        Targets => "targets",
        /// Counts and measurements that debug views show or the host reads, and numbers that draws count up.
        Counters => "counters",
        /// The scene: vertices, indices, materials, textures, draws and their commands.
        Scene => "scene",
        /// Constants of shaders: camera, settings.
        Constants => "constants",
        /// Maps that several techniques share, reported apart: shadow map, reflective shadow map.
        Shared => "shared",
        /// Depth, samples and layers of blended surfaces, and what finds their lights; techniques share it as well.
        Transparency => "transparency",
        /// Tables and images of anti-aliasing after shading.
        Filters => "filters",
    }
}

impl BufferRole {
    /// Returns whether it belongs to work that techniques share, which a technique's own bytes leave out.
    pub const fn is_shared(self) -> bool {
        matches!(self, Self::Shared | Self::Transparency)
    }
}
