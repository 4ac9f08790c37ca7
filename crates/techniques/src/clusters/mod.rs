//! The stage that gives every part of the view that holds a surface its list of lights (Olsson et al. 2012; Petrescu et al. 2016,
//! section 4.10).
//!
//! The view is a grid of tiles and slices of view distance; a bit a cluster marks what a depth buffer shows. Marked clusters are
//! listed, a group each counts the lights that touch it, a scan gives every list its place, and the same groups fill them. No
//! list has a bound: the room of all is known before it is filled, and a frame that had less is recorded again.

use afterlight_graph::{BufferHandle, ComputePass, Graph, ImageHandle};

use crate::{
    ParamInfo, ParamKind,
    capacity::FIRST_GUESS,
    error::TechniqueError,
    frame::{Frame, Slots},
};

/// How the view is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Width and height of a tile, pixels, at least 1.
    pub cluster_px: u32,
    /// Slices of view distance, at least 1.
    pub slices: u32,
    /// Whether slices end at equal ratios of view distance; else in equal steps.
    pub logarithmic: bool,
}

/// Parameters of techniques with clusters.
pub const PARAMS: &[ParamInfo] = &[
    ParamInfo {
        key: "cluster-px",
        summary: "width and height of a cluster, pixels",
        kind: ParamKind::Integer { min: 8, max: 256 },
        default: "32",
    },
    ParamInfo {
        key: "slices",
        summary: "clusters of a tile, one behind the other",
        kind: ParamKind::Integer { min: 1, max: 256 },
        default: "32",
    },
    ParamInfo {
        key: "slicing",
        summary: "view distances at which clusters end: in equal steps, or at equal ratios",
        kind: ParamKind::Choice { values: &["logarithmic", "uniform"] },
        default: "logarithmic",
    },
];

impl Grid {
    /// The grid that [`PARAMS`] ask for.
    pub fn of_params(params: &crate::Params, info: &crate::Info) -> Self {
        Self {
            cluster_px: params.number(info, "cluster-px") as u32,
            slices: params.number(info, "slices") as u32,
            logarithmic: params.text(info, "slicing") == "logarithmic",
        }
    }

    /// Most pixels that share one list.
    pub fn most_pixels(self) -> f64 {
        f64::from(self.cluster_px) * f64::from(self.cluster_px)
    }

    /// Clusters of an image.
    fn clusters(self, frame: &Frame<'_>) -> u64 {
        let tiles = |size_px: u32| u64::from(size_px.div_ceil(self.cluster_px));
        tiles(frame.width_px) * tiles(frame.height_px) * u64::from(self.slices)
    }
}

/// Lists of lights. Words of 32 bits.
pub struct Clusters {
    /// Specialization constants of `clusters/lists.glsl`.
    constants: [(&'static str, u32); 4],
    /// View distances at which slices begin and the last ends, m, 32-bit floats.
    pub slices: BufferHandle,
    /// A bit a cluster: whether it holds a surface. Cluster: tile × slices + slice, tiles by rows.
    pub bits: BufferHandle,
    /// Kept clusters before each word of bits.
    pub before: BufferHandle,
    /// Kept clusters, ascending.
    pub kept: BufferHandle,
    /// Where the list of each kept cluster begins, and where the last ends.
    pub begins: BufferHandle,
    /// The lists: lights, ascending; those without an end are on none.
    pub lists: BufferHandle,
}

impl Clusters {
    /// Binds what `clusters/lists.glsl` reads.
    pub fn bind(&self, pass: &mut impl Slots) {
        pass.read_buffer("ClusterSlices", &self.slices);
        pass.read_buffer("ClusterBits", &self.bits);
        pass.read_buffer("KeptBefore", &self.before);
        pass.read_buffer("ListBegins", &self.begins);
        pass.read_buffer("ClusterLists", &self.lists);
    }

    /// Specialization constants of what includes `clusters/lists.glsl`.
    pub fn constants(&self) -> impl Iterator<Item = (&'static str, u32)> {
        self.constants.into_iter()
    }
}

/// Checks that a binding holds the words of a buffer, and returns their bytes, at least one word.
fn bytes_of(frame: &Frame<'_>, technique: &str, what: &str, words: u64) -> Result<u64, TechniqueError> {
    let bytes = 4 * words.max(1);
    frame.check_binding(technique, what, bytes)?;
    Ok(bytes)
}

/// Declares the passes from a depth buffer of one sample to lists.
///
/// # Errors
/// More clusters, or longer lists, than one binding holds: [`TechniqueError::TooLarge`], in bytes. A shader that is not compiled
/// in.
pub fn build(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    grid: Grid,
    depth: &ImageHandle,
) -> Result<Clusters, TechniqueError> {
    let stage = Stage::new(frame, technique, grid)?;
    let slices = stage.slices(graph, depth)?;
    let bits = stage.mark(graph, depth, &slices)?;
    let kept = stage.compact(graph, &bits)?;
    let begins = stage.count(graph, &slices, &kept)?;
    let lists = stage.fill(graph, &slices, &kept, &begins)?;
    Ok(Clusters {
        constants: stage.constants,
        slices,
        bits,
        before: kept.before,
        kept: kept.clusters,
        begins,
        lists,
    })
}

/// What all passes of the stage are declared from.
struct Stage<'a> {
    frame: &'a Frame<'a>,
    technique: &'a str,
    grid: Grid,
    constants: [(&'static str, u32); 4],
    words: u32,
    cluster_capacity: u32,
    list_capacity: u32,
}

/// Clusters that hold a surface.
struct Kept {
    clusters: BufferHandle,
    before: BufferHandle,
    count: BufferHandle,
    groups: BufferHandle,
}

impl Kept {
    /// Binds what `clusters/cull.glsl` reads.
    fn bind(&self, pass: &mut ComputePass<'_>, slices: &BufferHandle) {
        pass.read("ClusterSlices", slices);
        pass.read("KeptClusters", &self.clusters).read("KeptCount", &self.count);
    }
}

impl<'a> Stage<'a> {
    fn new(frame: &'a Frame<'a>, technique: &'a str, grid: Grid) -> Result<Self, TechniqueError> {
        let clusters = grid.clusters(frame);
        let words = clusters.div_ceil(32);
        let bytes = bytes_of(frame, technique, &format!("the bits of {clusters} clusters"), words)?;
        let cluster_capacity = frame.capacity("clusters", FIRST_GUESS);
        let list_capacity = frame.capacity("cluster lights", FIRST_GUESS);
        bytes_of(
            frame,
            technique,
            &format!("the list of {cluster_capacity} clusters"),
            u64::from(cluster_capacity) + 1,
        )?;
        bytes_of(
            frame,
            technique,
            &format!("the lists of {list_capacity} lights of clusters"),
            list_capacity.into(),
        )?;
        Ok(Self {
            frame,
            technique,
            grid,
            constants: [
                ("CLUSTER_PX", grid.cluster_px),
                ("SLICES", grid.slices),
                ("CLUSTER_CAPACITY", cluster_capacity),
                ("LIST_CAPACITY", list_capacity),
            ],
            words: (bytes / 4) as u32,
            cluster_capacity,
            list_capacity,
        })
    }

    fn buffer(&self, graph: &mut Graph, name: &str, words: u32) -> BufferHandle {
        graph.buffer(&format!("{}/{name}", self.technique), 4 * u64::from(words.max(1)))
    }

    /// A pass `technique/name` of `clusters/file.comp`, with the stage's constants that the shader has.
    fn pass<'g>(
        &self,
        graph: &'g mut Graph,
        name: &str,
        file: &str,
    ) -> Result<ComputePass<'g>, TechniqueError> {
        let shader = self.frame.shader(&format!("clusters/{file}.comp"))?;
        let mut pass = self.frame.compute(graph, &format!("{}/{name}", self.technique), &shader);
        let own = [("WORDS", self.words), ("LOGARITHMIC", u32::from(self.grid.logarithmic))];
        for (constant, value) in self.constants.into_iter().chain(own) {
            if shader.reflection.spec_constant(constant).is_some() {
                pass.constant(constant, value);
            }
        }
        Ok(pass)
    }

    /// View distances at which slices begin, from the range that the depth buffer shows.
    fn slices(&self, graph: &mut Graph, depth: &ImageHandle) -> Result<BufferHandle, TechniqueError> {
        let range = self.buffer(graph, "depth range", 2);
        let range = graph.clear_buffer(&format!("{}/clear range", self.technique), range, 0);
        let begins = self.buffer(graph, "cluster slices", self.grid.slices + 1);
        let mut pass = self.pass(graph, "range", "range")?;
        pass.read("cluster_depth", depth);
        let range = pass.write("DepthRange", range);
        pass.dispatch(self.frame.groups(16));
        pass.finish();

        let mut pass = self.pass(graph, "slices", "slices")?;
        pass.read("DepthRange", &range);
        let begins = pass.write("SliceBegins", begins);
        pass.dispatch([1, 1, 1]);
        pass.finish();
        Ok(begins)
    }

    fn mark(
        &self,
        graph: &mut Graph,
        depth: &ImageHandle,
        slices: &BufferHandle,
    ) -> Result<BufferHandle, TechniqueError> {
        let bits = self.buffer(graph, "cluster bits", self.words);
        let bits = graph.clear_buffer(&format!("{}/clear clusters", self.technique), bits, 0);
        let mut pass = self.pass(graph, "mark", "mark")?;
        pass.read("cluster_depth", depth).read("ClusterSlices", slices);
        let bits = pass.write("MarkedClusters", bits);
        pass.dispatch(self.frame.groups(16));
        pass.finish();
        Ok(bits)
    }

    fn compact(&self, graph: &mut Graph, bits: &BufferHandle) -> Result<Kept, TechniqueError> {
        let before = self.buffer(graph, "kept before", self.words);
        let clusters = self.buffer(graph, "kept clusters", self.cluster_capacity);
        let count = self.buffer(graph, "cluster count", 2);
        let groups = self.buffer(graph, "cluster groups", 3);
        let mut pass = self.pass(graph, "compact", "compact")?;
        pass.read("ClusterBits", bits);
        let before = pass.write("KeptBeforeOut", before);
        let clusters = pass.write("KeptOut", clusters);
        let count = pass.write("ClusterCount", count);
        let groups = pass.write("ClusterGroups", groups);
        pass.dispatch([1, 1, 1]);
        pass.finish();
        self.frame.watch(graph, "clusters", &count, self.cluster_capacity, false);
        Ok(Kept { clusters, before, count, groups })
    }

    /// Where the list of each kept cluster begins.
    fn count(
        &self,
        graph: &mut Graph,
        slices: &BufferHandle,
        kept: &Kept,
    ) -> Result<BufferHandle, TechniqueError> {
        let lengths = self.buffer(graph, "list lengths", self.cluster_capacity);
        let begins = self.buffer(graph, "list begins", self.cluster_capacity + 1);
        let count = self.buffer(graph, "list count", 2);
        let mut pass = self.pass(graph, "count lights", "count")?;
        kept.bind(&mut pass, slices);
        let lengths = pass.write("ListLengths", lengths);
        pass.dispatch_indirect(&kept.groups, 0);
        pass.finish();

        let mut pass = self.pass(graph, "scan", "scan")?;
        pass.read("ListLengths", &lengths).read("KeptCount", &kept.count);
        let begins = pass.write("ListBeginsOut", begins);
        let count = pass.write("ListCount", count);
        pass.dispatch([1, 1, 1]);
        pass.finish();
        self.frame.watch(graph, "cluster lights", &count, self.list_capacity, false);
        Ok(begins)
    }

    fn fill(
        &self,
        graph: &mut Graph,
        slices: &BufferHandle,
        kept: &Kept,
        begins: &BufferHandle,
    ) -> Result<BufferHandle, TechniqueError> {
        let lists = self.buffer(graph, "cluster lists", self.list_capacity);
        let mut pass = self.pass(graph, "fill lists", "fill")?;
        kept.bind(&mut pass, slices);
        pass.read("ListBegins", begins);
        let lists = pass.write("ListsOut", lists);
        pass.dispatch_indirect(&kept.groups, 0);
        pass.finish();
        Ok(lists)
    }
}
