//! Techniques as an experiment sets them up, and frames of them in turn.

use std::borrow::Borrow;

use afterlight_renderer::Renderer;
use afterlight_techniques::cost::Workload;
use afterlight_techniques::{Post, Settings};

use crate::{Chosen, Entrant, InTurn, LabError, Listener, measure_in_turn, technique};

/// A technique as an experiment runs it.
pub struct Setup {
    /// What tells it from the others.
    pub label: String,
    /// Samples a pixel.
    pub samples: u32,
    /// Anti-aliasing after shading.
    pub post: Post,
    /// The technique and its parameters.
    pub chosen: Chosen,
}

impl Setup {
    /// A set-up of a technique by its id, without a filter after it.
    ///
    /// # Errors
    /// Ids, keys and values that are not known.
    pub fn new(
        label: impl Into<String>,
        samples: u32,
        id: &str,
        params: &[(&str, &str)],
    ) -> Result<Setup, LabError> {
        let mut chosen = Chosen::new(technique("technique", id)?);
        for (key, value) in params {
            chosen.set(key, value)?;
        }
        Ok(Setup { label: label.into(), samples, post: Post::None, chosen })
    }

    /// The same with a filter after it.
    pub fn post(self, post: Post) -> Setup {
        Setup { post, ..self }
    }
}

/// A renderer of the same scene and view with other settings.
///
/// # Errors
/// A size that the device does not take, the device itself.
pub fn renderer_with(base: &Renderer, change: impl FnOnce(&mut Settings)) -> Result<Renderer, LabError> {
    let mut settings = base.settings().clone();
    change(&mut settings);
    Ok(Renderer::with_scene(base.device(), base.scene().clone(), &settings)?)
}

/// Measures set-ups of one scene and view with frames in turn, in groups that fit into memory at once.
///
/// # Errors
/// The scene, the device. What one set-up cannot do gives a result that says so.
pub fn measure_setups(
    base: &Renderer,
    setups: &[impl Borrow<Setup>],
    workload: &Workload,
    frames: u32,
    listener: &dyn Listener,
) -> Result<InTurn, LabError> {
    let renderers = setups
        .iter()
        .map(|setup| {
            let setup = setup.borrow();
            renderer_with(base, |settings| {
                settings.samples = setup.samples;
                settings.effects.post.filter = setup.post;
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    let entrants: Vec<Entrant<'_>> = setups
        .iter()
        .zip(&renderers)
        .map(|(setup, renderer)| Entrant { renderer, chosen: &setup.borrow().chosen })
        .collect();
    let task = listener.task("frames", u64::from(frames + 1) * setups.len() as u64);
    Ok(measure_in_turn(&entrants, workload, frames, budget_bytes(base), || task.advance())?)
}

/// Bytes that set-ups may hold at once: half of the device's memory, a quarter where the host shares it.
pub fn budget_bytes(renderer: &Renderer) -> u64 {
    let features = renderer.device().features();
    features.device_local_heap_bytes / if features.unified_memory { 4 } else { 2 }
}
