//! Parameters of `gbuffer-list`.

use afterlight_frame::params::{AutoOr, Words, choices, parameters};
use afterlight_stages::{
    lights::{
        cells::CellParams,
        step::{LightParams, LightStepParams},
    },
    surfaces::compute_raster::ComputeRasterParams,
};

choices! {
    /// Who builds the lists.
    pub enum Fill {
        /// Compute over a multisampled visibility buffer.
        Compute = "compute",
        /// A second raster pass after a depth pre-pass (the paper's).
        Raster = "raster",
    }
}

choices! {
    /// How wide the pointer to a block is.
    pub enum Pointer {
        /// Narrow where it suffices.
        Auto = "auto",
        /// 26 bits of index and 3 + 3 of coverage.
        Narrow = "narrow",
        /// 64 bits.
        Wide = "wide",
    }
}

choices! {
    /// Where a block's position comes from.
    pub enum Position {
        /// A distance in the block, exact at the pixel's centre.
        Distance = "distance",
        /// The depth buffer at one of its samples (the paper's).
        Depth = "depth",
    }
}

choices! {
    /// What keeps one sample a pixel; each one's place is its bit in `filter.glsl`.
    pub enum Filter {
        /// Outside of an ellipse.
        Ellipse = "ellipse",
        /// Outside of a rectangle.
        Rectangle = "rectangle",
        /// Beyond a depth.
        Depth = "depth",
        /// Flagged objects.
        Objects = "objects",
        /// Pixels without an edge in the depth buffer.
        DepthEdges = "depth-edges",
        /// Pixels whose surfaces are alike.
        Edges = "edges",
    }
}

choices! {
    /// Which side of the region is anti-aliased.
    pub enum Region {
        /// Its inside.
        Inside = "inside",
        /// Its outside.
        Outside = "outside",
    }
}

choices! {
    /// What the filter `depth-edges` compares to its threshold.
    pub enum DepthEdges {
        /// The range of the samples' view distances over the nearest.
        Relative = "relative",
        /// The range of the samples' depths (Fridvalszky and Tóth 2020, section 5.4).
        Range = "range",
    }
}

parameters! {
    /// Which pixels and surfaces keep one sample alone.
    pub struct FilterParams {
        /// what keeps one sample a pixel: outside of an ellipse or a rectangle, beyond a depth, flagged objects, pixels without an edge in the depth buffer, pixels whose surfaces are alike
        filters: Words<Filter> = Words::NONE, "filter";
        /// which side of the ellipse or rectangle is anti-aliased
        region: Region = Region::Inside, "region";
        /// left edge of the region, percent of the width
        left: f32 = 20.0, "left", 0.0..=100.0;
        /// upper edge of the region, percent of the height
        top: f32 = 15.0, "top", 0.0..=100.0;
        /// right edge of the region, percent of the width
        right: f32 = 80.0, "right", 0.0..=100.0;
        /// lower edge of the region, percent of the height
        bottom: f32 = 85.0, "bottom", 0.0..=100.0;
        /// view distance in metres beyond which the filter `depth` keeps one sample
        depth_threshold_m: f32 = 20.0, "depth-threshold", 0.0..=1e9;
        /// nodes or materials that the filter `objects` flags: a name, * for any characters
        objects: String = String::new(), "objects";
        /// what depth-edges compares to its threshold: the range of the samples' distances over the nearest, or the range of their depths, from 0 to 1 (the paper's)
        depth_edges: DepthEdges = DepthEdges::Relative, "depth-edges";
        /// depth-edges: share of the nearest sample's distance, or difference of depths; edges: one less the cosine between normals
        edge_threshold: f32 = 0.02, "edge-threshold", 0.0..=2.0;
    }
}

parameters! {
    /// Parameters of `gbuffer-list`.
    pub struct GbufferListParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// who builds the lists: compute over a multisampled visibility buffer, or a second raster pass after a depth pre-pass (the paper's)
        fill: Fill = Fill::Compute, "fill";
        /// Who finds the triangles.
        ..raster: ComputeRasterParams;
        /// dynamic blocks; auto: as many as the view needs, counted; fixed: what finds none is dropped and told
        blocks: AutoOr<u32> = AutoOr::Auto, "blocks";
        /// narrow: 26 bits of index and 3 + 3 of coverage, up to 8 samples and 2^26 blocks; wide: 64 bits; auto: narrow where it suffices
        pointer: Pointer = Pointer::Auto, "pointer";
        /// where a block's position comes from: the depth buffer at one of its samples (the paper's), or a distance in the block, 32 bits more, exact at the pixel's centre
        position: Position = Position::Distance, "position";
        /// What keeps one sample a pixel.
        ..filter: FilterParams;
        /// How cells divide the view.
        ..cells: CellParams;
    }
}

impl GbufferListParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
