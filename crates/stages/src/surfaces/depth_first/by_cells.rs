//! Forward shading by the lists of lights of cells, for techniques that differ in how they divide the view.

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{Frame, Info, ParamSet, Params, Technique, TechniqueError};
use afterlight_graph::{Graph, ImageHandle};

use super::{draw_depth, shade_forward};
use crate::lights::{
    cells::{self, Division, VisibleDepths},
    step::LightStep,
};

/// A depth pre-pass, lists of lights of the cells that it shows, and forward shading by them; the technique's parameters say how the
/// view is divided.
pub struct ForwardByCells<P> {
    /// Facts about it.
    pub info: Info,
    /// How the view is divided.
    pub division: fn(P) -> Division,
    /// What it costs where so many pixels share a list.
    pub cost: fn(&Workload, f64) -> Cost,
}

impl<P: ParamSet + Default + Copy> ForwardByCells<P> {
    fn division(&self, params: &Params) -> Division {
        (self.division)(*params.typed())
    }
}

impl<P: ParamSet + Default + Copy> Technique for ForwardByCells<P> {
    fn info(&self) -> &Info {
        &self.info
    }

    fn params(&self) -> Params {
        Params::of(P::default())
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        (self.cost)(workload, self.division(params).most_pixels())
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let technique = self.info.id;
        let division = self.division(frame.params);
        let depth = draw_depth(graph, frame, technique)?;
        let lists =
            cells::build(graph, frame, technique, division, &VisibleDepths::of_depth(&depth, frame.samples))?;
        shade_forward(graph, frame, technique, depth, &LightStep::Cells(lists))
    }
}
