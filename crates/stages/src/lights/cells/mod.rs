//! The stage that gives every part of the view that holds a surface its list of lights (Petrescu et al. 2016, sections 4.8 to 4.10).
//!
//! The view is divided into cells: tiles, tiles with 32 bits of depth, or clusters, tiles cut into slices of view distance. A pass finds
//! the cells that hold a surface; another walks down the tree over the lights (`lights/bvh/`) for each of them. No list has a bound:
//! what is found is counted before it is written, and a frame that had less room is recorded again.

use afterlight_graph::{BufferHandle, BufferRole, ComputePass, Graph, ImageHandle, PassRole};

use afterlight_shader::Shader;

use crate::lights::bvh::{self, LightBvh};
use afterlight_frame::{Frame, Slots, TechniqueError, capacity::FIRST_GUESS};

mod params;

pub use params::{CellParams, ClusterParams, Slicing, TileParams};

/// How the view is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Division {
    /// Tiles, each from the nearest to the farthest of its surfaces.
    Tiles(TileParams),
    /// The same, and which of 32 equal steps between the two hold a surface (Harada 2012).
    Tiles25d(TileParams),
    /// Tiles cut into slices of view distance.
    Clusters(ClusterParams),
}

impl Division {
    /// Most pixels that share one list.
    pub fn most_pixels(self) -> f64 {
        f64::from(self.tile_px()) * f64::from(self.tile_px())
    }

    fn tile_px(self) -> u32 {
        match self {
            Self::Tiles(tiles) | Self::Tiles25d(tiles) => tiles.tile_px,
            Self::Clusters(clusters) => clusters.cluster_px,
        }
    }

    /// Cells of a tile.
    fn slices(self) -> u32 {
        match self {
            Self::Clusters(clusters) => clusters.slices,
            Self::Tiles(_) | Self::Tiles25d(_) => 1,
        }
    }

    fn tiles(self, frame: &Frame<'_>) -> u64 {
        let tiles = |size_px: u32| u64::from(size_px.div_ceil(self.tile_px()));
        tiles(frame.width_px) * tiles(frame.height_px)
    }

    /// Specialization constants of `grid.glsl`.
    fn constants(self) -> [(&'static str, u32); 4] {
        let (number, logarithmic) = match self {
            Self::Clusters(clusters) => (0, clusters.slicing == Slicing::Logarithmic),
            Self::Tiles(_) => (1, false),
            Self::Tiles25d(_) => (2, false),
        };
        [
            ("DIVISION", number),
            ("LIGHT_TILE_PX", self.tile_px()),
            ("SLICES", self.slices()),
            ("LOGARITHMIC", u32::from(logarithmic)),
        ]
    }
}

/// Where view distances of what shows come from.
pub struct VisibleDepths<'a> {
    /// Who lists the variants of templates for it: a technique's folder; none for those of the stages' own sources.
    folder: Option<&'a str>,
    /// Tag of the variants, with `#`; empty for the plain one.
    tag: String,
    /// Samples a pixel.
    samples: u32,
    bind: Box<dyn Fn(&mut ComputePass<'_>) + 'a>,
}

impl<'a> VisibleDepths<'a> {
    /// A depth buffer of that many samples a pixel, reversed.
    pub fn of_depth(depth: &'a ImageHandle, samples: u32) -> Self {
        let tag = if samples == 1 { "#one" } else { "" };
        Self {
            folder: None,
            tag: tag.to_owned(),
            samples,
            bind: Box::new(move |pass| _ = pass.read("gbuffer_depth", depth)),
        }
    }

    /// The keys of `compute_raster`.
    pub fn of_keys(keys: &'a BufferHandle, samples: u32) -> Self {
        Self {
            folder: None,
            tag: "#keys".to_owned(),
            samples,
            bind: Box::new(move |pass| _ = pass.read("SampleKeys", keys)),
        }
    }

    /// Samples a pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Name of the variant of a template of a stage that reads it.
    pub fn shader(&self, stage: &str, template: &str) -> String {
        format!("{}/{template}{}", self.folder.unwrap_or(stage), self.tag)
    }

    /// Binds what the source of a template reads.
    pub fn bind(&self, shader: &Shader, pass: &mut ComputePass<'_>) {
        if shader.reflection.spec_constant("SAMPLES").is_some() {
            pass.constant("SAMPLES", self.samples);
        }
        (self.bind)(pass);
    }

    /// What variants of templates read that a technique lists for a source of distances of its own.
    pub fn of_source(
        (folder, tag): (&'a str, &str),
        samples: u32,
        bind: impl Fn(&mut ComputePass<'_>) + 'a,
    ) -> Self {
        let separator = if tag.is_empty() { "" } else { "#" };
        Self { folder: Some(folder), tag: format!("{separator}{tag}"), samples, bind: Box::new(bind) }
    }
}

/// Lists of lights of cells.
pub struct CellLists {
    /// Specialization constants of `lights/cells/grid.glsl`.
    constants: Vec<(&'static str, u32)>,
    tree: LightBvh,
    /// A cell each: number, nearest and farthest view distance in m, steps that hold a surface; `Cell` in `grid.glsl`.
    pub cells: BufferHandle,
    /// Two words for each word of bits: the bits, the cells before.
    pub words: BufferHandle,
    /// First and end of the list of each cell.
    pub ends: BufferHandle,
    /// The lists: lights, ascending; those without an end are on none.
    pub lists: BufferHandle,
}

impl CellLists {
    /// Binds what `lights/cells/cell_lists.glsl` reads.
    pub fn bind(&self, frame: &Frame<'_>, pass: &mut impl Slots) {
        pass.read_buffer("Cells", &self.cells);
        pass.read_buffer("CellWords", &self.words);
        pass.read_buffer("ListEnds", &self.ends);
        pass.read_buffer("CellLists", &self.lists);
        self.tree.bind(frame, pass);
    }

    /// Specialization constants of what includes `lights/cells/cell_lists.glsl`.
    pub fn constants(&self) -> &[(&'static str, u32)] {
        &self.constants
    }
}

/// Groups that walk over the cells: enough to fill a GPU several times.
const GROUPS_MAX: u32 = 16_384;

/// Declares the passes from surfaces to lists.
///
/// # Errors
/// More cells, or longer lists, than one binding holds: [`TechniqueError::TooLarge`], in bytes. A shader that is not compiled
/// in.
pub fn build(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    division: Division,
    surfaces: &VisibleDepths<'_>,
) -> Result<CellLists, TechniqueError> {
    let stage = Stage::new(frame, technique, division)?;
    let tree = bvh::build(graph, frame, technique)?;
    let found = stage.find_cells(graph, surfaces)?;
    let (lists, ends) = stage.assign(graph, &found, &tree)?;
    Ok(CellLists { constants: stage.constants, tree, cells: found.cells, words: found.words, ends, lists })
}

/// What all passes of the stage are declared from.
struct Stage<'a> {
    frame: &'a Frame<'a>,
    technique: &'a str,
    constants: Vec<(&'static str, u32)>,
    tiles: u32,
    words: u64,
    cell_capacity: u32,
    list_capacity: u32,
}

/// Cells that hold a surface.
struct FoundCells {
    cells: BufferHandle,
    words: BufferHandle,
    count: BufferHandle,
}

impl<'a> Stage<'a> {
    fn new(frame: &'a Frame<'a>, technique: &'a str, division: Division) -> Result<Self, TechniqueError> {
        let tiles = division.tiles(frame);
        let words = tiles * u64::from(division.slices().div_ceil(32));
        let cell_capacity = frame.capacity("clusters", FIRST_GUESS);
        let list_capacity = frame.capacity("cluster lights", FIRST_GUESS);
        for (what, bytes) in [
            (format!("the bits of {} clusters", tiles * u64::from(division.slices())), 8 * words),
            (format!("the list of {cell_capacity} clusters"), 16 * u64::from(cell_capacity)),
            (format!("the lists of {list_capacity} lights of clusters"), 4 * u64::from(list_capacity)),
        ] {
            frame.check_binding(technique, &what, bytes)?;
        }
        let constants = division.constants().to_vec();
        Ok(Self { frame, technique, constants, tiles: tiles as u32, words, cell_capacity, list_capacity })
    }

    fn name(&self, what: &str) -> String {
        format!("{}/{what}", self.technique)
    }

    fn zeroed(&self, graph: &mut Graph, name: &str) -> BufferHandle {
        let buffer = graph.buffer(&self.name(name), BufferRole::Lights, 8);
        graph.clear_buffer(&self.name(&format!("clear {name}")), PassRole::LightAssignment, buffer, 0)
    }

    /// A pass `technique/name` of a shader of the stage, with those of the stage's constants that the shader has.
    fn pass<'g>(&self, graph: &'g mut Graph, name: &str, shader: &Shader) -> ComputePass<'g> {
        let mut pass = self.frame.compute(graph, &self.name(name), PassRole::LightAssignment, shader);
        for (constant, value) in &self.constants {
            if shader.reflection.spec_constant(constant).is_some() {
                pass.constant(constant, *value);
            }
        }
        pass
    }

    /// Cells that hold a surface.
    fn find_cells(
        &self,
        graph: &mut Graph,
        surfaces: &VisibleDepths<'_>,
    ) -> Result<FoundCells, TechniqueError> {
        let cells =
            graph.buffer(&self.name("cells"), BufferRole::Lights, 16 * u64::from(self.cell_capacity.max(1)));
        let words = graph.buffer(&self.name("cell words"), BufferRole::Lights, 8 * self.words.max(1));
        let count = self.zeroed(graph, "cell count");
        let shader = self.frame.shader(&surfaces.shader("lights/cells", "cells.comp"))?;
        let mut pass = self.pass(graph, "cells", &shader);
        surfaces.bind(&shader, &mut pass);
        let cells = pass.write("Cells", cells);
        let words = pass.write("CellWords", words);
        let count = pass.write("CellCount", count);
        pass.dispatch(self.frame.groups_in_rows(self.tiles));
        pass.finish();
        self.frame.watch(graph, "clusters", &count, self.cell_capacity, false);
        Ok(FoundCells { cells, words, count })
    }

    /// Lists, and their ends.
    fn assign(
        &self,
        graph: &mut Graph,
        found: &FoundCells,
        tree: &LightBvh,
    ) -> Result<(BufferHandle, BufferHandle), TechniqueError> {
        let lists = graph.buffer(
            &self.name("cell lists"),
            BufferRole::Lights,
            4 * u64::from(self.list_capacity.max(1)),
        );
        let ends = graph.buffer(
            &self.name("list ends"),
            BufferRole::Lights,
            8 * u64::from(self.cell_capacity.max(1)),
        );
        let count = self.zeroed(graph, "list count");
        let mut pass = self.pass(graph, "assign lights", &self.frame.shader("lights/cells/assign.comp")?);
        pass.read("Cells", &found.cells).read("CellCount", &found.count);
        tree.bind(self.frame, &mut pass);
        let lists = pass.write("CellLists", lists);
        let ends = pass.write("ListEnds", ends);
        let count = pass.write("ListCount", count);
        pass.dispatch([self.cell_capacity.clamp(1, GROUPS_MAX), 1, 1]);
        pass.finish();
        self.frame.watch(graph, "cluster lights", &count, self.list_capacity, false);
        Ok((lists, ends))
    }
}
