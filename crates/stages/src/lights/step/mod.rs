//! The stage by which surfaces find their lights, for every technique that shades a surface at once: the parameter `lights`, what it
//! builds, and what `radiance.glsl` reads of it.

use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole};

use crate::lights::{
    bvh::{self, LightBvh},
    cells::{self, CellLists, Division, Grid, VisibleDepths},
    pixel_lists::{self, LightLists},
};
use afterlight_frame::{Frame, Info, ParamInfo, ParamKind, Params, Slots, TechniqueError, views};

/// Lights up to which a loop over all of them costs less than any structure, by `auto`.
const FEW_LIGHTS: u32 = 16;

/// Name of the parameter.
pub const KEY: &str = "lights";

/// Which lights a surface visits, for sources of several surfaces a pixel.
pub const LIGHTS: ParamInfo = ParamInfo {
    key: KEY,
    summary: "lights that a surface visits: all, those on the list of its pixel (lists), its tile (tiles; tiles25 with 32 bits of depth) or its cluster, or those that a tree over the lights leads to; volumes: each light's volume adds it; auto: all where they are few, else clusters",
    kind: ParamKind::Choice {
        values: &["auto", "all", "volumes", "lists", "tiles", "tiles25", "clusters", "tree"],
    },
    default: "auto",
};

/// The same for a G-buffer of one sample, where passes may also add lights one by one, or list them for every pixel.
pub const GBUFFER_LIGHTS: ParamInfo = ParamInfo {
    key: KEY,
    summary: "how surfaces find lights: each light's volume adds it (volumes), a loop over all, the list of the pixel, tile (tiles; tiles25 with 32 bits of depth) or cluster, or a tree over the lights",
    kind: ParamKind::Choice { values: &["volumes", "all", "lists", "tiles", "tiles25", "clusters", "tree"] },
    default: "volumes",
};

/// How surfaces find their lights.
pub enum LightStep {
    /// Every surface visits all.
    All,
    /// By the list of its tile or cluster.
    Cells(CellLists),
    /// By the tree over the lights.
    Tree(LightBvh),
    /// By the list of its pixel.
    Lists(LightLists),
    /// Other passes add them.
    None,
}

/// How cells divide the view for a value of `lights`, by the technique's parameters of them or their defaults.
fn division(value: &str, params: &Params) -> Option<Division> {
    let tile_px = params.count(&afterlight_frame::params::TILE_PX);
    Some(match value {
        "tiles" => Division::Tiles { tile_px },
        "tiles25" => Division::Tiles25d { tile_px },
        "clusters" => Division::Clusters(Grid::of_params(params)),
        _ => return None,
    })
}

/// The value of `lights` of a frame's technique, `auto` resolved.
///
/// The view of cells shows clusters where the technique would have none.
pub fn chosen<'a>(frame: &'a Frame<'_>, info: &'a Info) -> &'a str {
    match frame.params.text(info, KEY) {
        value if frame.shows(views::CLUSTERS) && !value.starts_with("tiles") => "clusters",
        "auto" if frame.lights.count <= FEW_LIGHTS => "all",
        "auto" => "clusters",
        value => value,
    }
}

impl LightStep {
    /// Builds what the technique's `lights` asks for, from where the surfaces of the image stand.
    ///
    /// # Errors
    /// As [`cells::build`].
    pub fn build(
        graph: &mut Graph,
        frame: &Frame<'_>,
        info: &Info,
        surfaces: &VisibleDepths<'_>,
    ) -> Result<Self, TechniqueError> {
        let value = chosen(frame, info);
        if let Some(division) = division(value, frame.params) {
            return Ok(Self::Cells(cells::build(graph, frame, info.id, division, surfaces)?));
        }
        Ok(match value {
            "lists" => Self::Lists(pixel_lists::build(graph, frame, info, surfaces, None)?),
            "tree" => Self::Tree(bvh::build(graph, frame, info.id)?),
            "volumes" => Self::None,
            _ => Self::All,
        })
    }

    /// For surfaces wherever they stand, whatever shows of them: a loop where lights are few, else the tree over them, whose passes
    /// and boxes have the roles of the user's work.
    ///
    /// # Errors
    /// A shader that is not compiled in.
    pub fn anywhere(
        graph: &mut Graph,
        frame: &Frame<'_>,
        user: &str,
        roles: (PassRole, BufferRole),
    ) -> Result<Self, TechniqueError> {
        match frame.lights.count <= FEW_LIGHTS {
            true => Ok(Self::All),
            false => Ok(Self::Tree(bvh::build_for(graph, frame, user, roles)?)),
        }
    }

    /// Builds lists of lights a pixel over a depth buffer of the frame's samples.
    ///
    /// # Errors
    /// As [`pixel_lists::build`].
    pub fn lists(
        graph: &mut Graph,
        frame: &Frame<'_>,
        info: &Info,
        depth: &ImageHandle,
    ) -> Result<Self, TechniqueError> {
        let surfaces = VisibleDepths::of_depth(depth, frame.samples);
        let tested = (frame.samples == 1).then_some(depth);
        Ok(Self::Lists(pixel_lists::build(graph, frame, info, &surfaces, tested)?))
    }

    /// Binds what `radiance.glsl` reads. What the step does not have is read by no one, yet its slots are there: resources of the same
    /// kinds fill them.
    pub fn bind(&self, frame: &Frame<'_>, pass: &mut impl Slots) {
        let b = &frame.buffers;
        match self {
            Self::Cells(cells) => cells.bind(frame, pass),
            _ => {
                for slot in ["Cells", "CellWords", "ListEnds", "CellLists"] {
                    pass.read_buffer(slot, &b.positions);
                }
                match self {
                    Self::Tree(tree) => tree.bind(frame, pass),
                    Self::Lists(_) => {}
                    _ => pass.read_image("light_boxes", &b.light_spheres),
                }
            }
        }
        match self {
            Self::Lists(lists) => lists.bind(frame, pass),
            _ => {
                for slot in ["LightHeads", "LightNodes"] {
                    pass.read_buffer(slot, &b.positions);
                }
            }
        }
    }

    /// Specialization constants of what includes `radiance.glsl`.
    pub fn constants(&self) -> Vec<(String, u32)> {
        let (number, more) = match self {
            Self::All => (0, Vec::new()),
            Self::Cells(cells) => (1, cells.constants().to_vec()),
            Self::Tree(_) => (2, Vec::new()),
            Self::Lists(lists) => (3, vec![lists.constant()]),
            Self::None => (4, Vec::new()),
        };
        let all = std::iter::once(("LIGHT_STEP", number)).chain(more);
        all.map(|(name, value)| (name.to_owned(), value)).collect()
    }
}
