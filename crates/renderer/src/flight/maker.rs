//! Plans of a flight and places for its frames: what any thread can make.

use std::{collections::VecDeque, sync::Arc};

use afterlight_frame::{
    Params, Settings, Technique, TechniqueError,
    capacity::{Capacities, Demand},
};
use afterlight_graph::{KeptHistory, ResourceId};
use afterlight_scene::Camera;

use super::{FlightOptions, Place};
use crate::{Prepared, Renderer, prepared::Moved, renderer::Recipe};

/// What a flight draws, and how.
pub(super) struct Maker {
    pub renderer: Renderer,
    pub technique: &'static dyn Technique,
    /// All of the technique's.
    pub params: Params,
    pub options: FlightOptions,
    /// Whether frames go into another program's command buffers; none of them is submitted or waited for.
    pub for_callers: bool,
}

impl Maker {
    fn recipe<'a>(&'a self, earlier: Option<&'a KeptHistory>) -> Recipe<'a> {
        Recipe {
            technique: self.technique,
            params: &self.params,
            moves: true,
            scene_moves: self.options.scene_moves,
            earlier,
        }
    }

    /// A plan with room for what the view of a camera is counted to need.
    pub fn first(&self, camera: &Camera) -> Result<Prepared, TechniqueError> {
        self.renderer.prepare_to_move(&self.recipe(None), camera)
    }

    /// A plan with these capacities for a view of a scene that has moved, which goes on with the history of an `earlier` one.
    pub fn plan(
        &self,
        settings: &Settings,
        moved: Moved,
        capacities: Capacities,
        earlier: Option<&KeptHistory>,
    ) -> Result<Prepared, TechniqueError> {
        self.renderer.record(&self.recipe(earlier), settings, moved, capacities, &|_, _| {})
    }

    /// A plan with these capacities, and places for its frames. The scene is at rest in it until a frame moves it, as in a flight's first plan.
    pub fn ahead(
        &self,
        camera: Camera,
        capacities: Capacities,
        earlier: Option<KeptHistory>,
    ) -> Result<(Prepared, VecDeque<Place>), TechniqueError> {
        let settings = Settings { camera, ..self.renderer.settings().clone() };
        let prepared = self.plan(&settings, Moved::default(), capacities, earlier.as_ref())?;
        let places = self.places(&prepared)?;
        Ok((prepared, places))
    }

    /// Places for as many frames as are on their way at once.
    pub fn places(&self, prepared: &Prepared) -> Result<VecDeque<Place>, TechniqueError> {
        (0..self.options.in_flight.max(1)).map(|_| self.place(prepared)).collect()
    }

    /// A place of a plan, which the flight numbers.
    pub fn place(&self, prepared: &Prepared) -> Result<Place, TechniqueError> {
        let inputs: Vec<_> = prepared.inputs.iter().map(|input| input.target.clone()).collect();
        let outputs = self.outputs(prepared);
        let slot = match self.for_callers {
            true => prepared.executor.slot_for_callers(&inputs, &outputs)?,
            false => prepared.executor.slot(&inputs, &outputs)?,
        };
        Ok(Place { slot, plan: 0, demands: Arc::clone(&prepared.demands), pose: None, flying: None })
    }

    /// What is read after each frame: a counter a list, then the picture.
    fn outputs(&self, prepared: &Prepared) -> Vec<ResourceId> {
        let counters = prepared.demands.iter().map(Demand::resource);
        counters.chain(self.options.pictures.then_some(prepared.kept.final_color)).collect()
    }
}
