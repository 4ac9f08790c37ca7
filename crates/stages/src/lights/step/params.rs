//! Parameters of the stage by which surfaces find their lights.

use afterlight_frame::params::{Params, choices, parameters};

use crate::lights::cells::CellParams;

choices! {
    /// Which lights a surface visits.
    pub enum Lights {
        /// All where they are few, else those of its cluster.
        Auto = "auto",
        /// All.
        All = "all",
        /// Each light's volume adds it.
        Volumes = "volumes",
        /// Those on the list of its pixel.
        Lists = "lists",
        /// Those on the list of its tile.
        Tiles = "tiles",
        /// Those on the list of its tile, which tells 32 ranges of depth apart.
        Tiles25d = "tiles25",
        /// Those on the list of its cluster.
        Clusters = "clusters",
        /// Those that a tree over the lights leads to.
        Tree = "tree",
    }
}

choices! {
    /// The same for a G-buffer of one sample, whose technique is for volumes where nothing else is asked for.
    pub enum GbufferLights {
        /// Each light's volume adds it.
        Volumes = "volumes",
        /// All.
        All = "all",
        /// Those on the list of its pixel.
        Lists = "lists",
        /// Those on the list of its tile.
        Tiles = "tiles",
        /// Those on the list of its tile, which tells 32 ranges of depth apart.
        Tiles25d = "tiles25",
        /// Those on the list of its cluster.
        Clusters = "clusters",
        /// Those that a tree over the lights leads to.
        Tree = "tree",
    }
}

impl From<GbufferLights> for Lights {
    fn from(lights: GbufferLights) -> Self {
        match lights {
            GbufferLights::Volumes => Self::Volumes,
            GbufferLights::All => Self::All,
            GbufferLights::Lists => Self::Lists,
            GbufferLights::Tiles => Self::Tiles,
            GbufferLights::Tiles25d => Self::Tiles25d,
            GbufferLights::Clusters => Self::Clusters,
            GbufferLights::Tree => Self::Tree,
        }
    }
}

/// What the stage is asked for, whichever technique asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightStepParams {
    /// Which lights a surface visits.
    pub lights: Lights,
    /// How cells divide the view.
    pub cells: CellParams,
}

parameters! {
    /// Which lights a surface visits, for sources of several surfaces a pixel.
    #[derive(Copy)]
    pub struct LightParams {
        /// lights that a surface visits: all, those on the list of its pixel (lists), its tile (tiles; tiles25 with 32 bits of depth) or its cluster, or those that a tree over the lights leads to; volumes: each light's volume adds it; auto: all where they are few, else clusters
        lights: Lights = Lights::Auto, "lights";
    }
}

parameters! {
    /// The same for a G-buffer of one sample.
    #[derive(Copy)]
    pub struct GbufferLightParams {
        /// how surfaces find lights: each light's volume adds it (volumes), a loop over all, the list of the pixel, tile (tiles; tiles25 with 32 bits of depth) or cluster, or a tree over the lights
        lights: GbufferLights = GbufferLights::Volumes, "lights";
    }
}

impl LightParams {
    /// With how cells divide the view.
    pub fn with(self, cells: CellParams) -> LightStepParams {
        LightStepParams { lights: self.lights, cells }
    }
}

/// The lights that a surface visits by those parameters; `None` where they leave no choice.
pub fn asked(params: &Params) -> Option<Lights> {
    let one_sample = || params.find::<GbufferLightParams>().map(|params| params.lights.into());
    params.find::<LightParams>().map(|params| params.lights).or_else(one_sample)
}

impl GbufferLightParams {
    /// With how cells divide the view.
    pub fn with(self, cells: CellParams) -> LightStepParams {
        LightStepParams { lights: self.lights.into(), cells }
    }
}

parameters! {
    /// Parameters of a technique that asks for nothing besides how its surfaces find their lights.
    #[derive(Copy)]
    pub struct StepParams {
        /// Which lights a surface visits.
        ..lights: LightParams;
        /// How cells divide the view.
        ..cells: CellParams;
    }
}

impl StepParams {
    /// How surfaces find their lights.
    pub fn light_step(&self) -> LightStepParams {
        self.lights.with(self.cells)
    }
}
