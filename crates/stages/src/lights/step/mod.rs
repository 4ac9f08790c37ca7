//! The stage by which surfaces find their lights, for every technique that shades a surface at once: by what method, what it
//! builds, and what `radiance.glsl` reads of it.

use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole};

use crate::lights::{
    bvh::{self, LightBvh},
    cells::{self, CellLists, CellParams, Division, VisibleDepths},
    pixel_lists::{self, LightLists},
};
use afterlight_frame::{Frame, Slots, TechniqueError, params::AutoOr, views};

mod params;

pub use params::{
    GbufferLightParams, GbufferLights, LightParams, LightStepParams, Lights, StepParams, asked,
};

/// Lights up to which a loop over all of them costs less than any structure, by `auto`.
const FEW_LIGHTS: u32 = 16;

/// What a technique with these parameters answers to how lights and surfaces find each other.
pub const ANSWER: &str = "loop over all, light volumes, lists, tiles, clusters, or a tree";

/// How surfaces find their lights, where nothing is left open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightMethod {
    /// Every surface visits all.
    All,
    /// Each light's volume adds it.
    Volumes,
    /// By the list of its pixel.
    Lists,
    /// By the list of its tile or cluster.
    Cells(Division),
    /// By a tree over the lights.
    Tree,
}

impl LightStepParams {
    /// What they mean for a frame: few lights need no structure. The view of cells shows clusters where there would be none.
    pub fn method(self, frame: &Frame<'_>) -> LightMethod {
        let CellParams { tiles, clusters } = self.cells;
        let clusters = LightMethod::Cells(Division::Clusters(clusters));
        let method = match self.lights {
            Lights::Auto if frame.lights.count <= FEW_LIGHTS => LightMethod::All,
            Lights::Auto | Lights::Clusters => clusters,
            Lights::All => LightMethod::All,
            Lights::Volumes => LightMethod::Volumes,
            Lights::Lists => LightMethod::Lists,
            Lights::Tiles => LightMethod::Cells(Division::Tiles(tiles)),
            Lights::Tiles25d => LightMethod::Cells(Division::Tiles25d(tiles)),
            Lights::Tree => LightMethod::Tree,
        };
        match method {
            LightMethod::Cells(_) => method,
            _ if frame.shows(views::CLUSTERS) => clusters,
            _ => method,
        }
    }
}

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

impl LightStep {
    /// Builds what a method takes, from where the surfaces of the image stand.
    ///
    /// # Errors
    /// As [`cells::build`].
    pub fn build(
        graph: &mut Graph,
        frame: &Frame<'_>,
        technique: &str,
        method: LightMethod,
        surfaces: &VisibleDepths<'_>,
    ) -> Result<Self, TechniqueError> {
        Ok(match method {
            LightMethod::All => Self::All,
            LightMethod::Volumes => Self::None,
            LightMethod::Lists => {
                Self::Lists(pixel_lists::build(graph, frame, technique, AutoOr::Auto, surfaces, None)?)
            }
            LightMethod::Cells(division) => {
                Self::Cells(cells::build(graph, frame, technique, division, surfaces)?)
            }
            LightMethod::Tree => Self::Tree(bvh::build(graph, frame, technique)?),
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
        technique: &str,
        nodes: AutoOr<u32>,
        depth: &ImageHandle,
    ) -> Result<Self, TechniqueError> {
        let surfaces = VisibleDepths::of_depth(depth, frame.samples);
        let tested = (frame.samples == 1).then_some(depth);
        Ok(Self::Lists(pixel_lists::build(graph, frame, technique, nodes, &surfaces, tested)?))
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
