//! Frames in another program's command buffers, their pictures in its images.

use afterlight_graph::gpu::{CallersCommands, Target};
use afterlight_scene::Camera;

use crate::{Done, Flight, FlightOptions, FrameContext, Renderer, Shortfall};
use afterlight_frame::{Params, Technique, TechniqueError};

/// A technique that draws into another program's command buffers. It submits no frame and waits for none: the program does, and says when
/// the device is done ([`Embedded::done`]).
pub struct Embedded(Flight);

impl Renderer {
    /// Prepares a technique to draw into another program's command buffers, the first frame through `camera`. With `scene_moves` frames may
    /// have a pose ([`FrameContext::pose`]). The device is one that was adopted ([`Device::adopt`](afterlight_graph::gpu::Device::adopt)), or one of Afterlight's own that
    /// somebody reaches by other ways.
    ///
    /// # Errors
    /// As [`Renderer::prepare`].
    pub fn embed(
        &self,
        technique: &'static dyn Technique,
        params: &Params,
        camera: &Camera,
        scene_moves: bool,
    ) -> Result<Embedded, TechniqueError> {
        let options = FlightOptions {
            shortfall: Shortfall::Tell,
            scene_moves,
            plans_ahead: false,
            ..FlightOptions::default()
        };
        Ok(Embedded(self.fly_for(technique, params, camera, options, true)?))
    }
}

impl Embedded {
    /// Adds a frame to the caller's commands and a copy of its picture, of the size of the renderer's settings, to the caller's image.
    /// Numbers of frames rise. Command buffers are submitted in the order in which frames were added: each may read what the one before left.
    /// Frames wait for what was recorded before them in the queue's order, and all that follows waits for the picture. How many are recorded before the first is done is the caller's choice; each holds its own inputs ([`Flight::bytes`]).
    ///
    /// # Errors
    /// [`GpuError::TargetFormat`](afterlight_graph::gpu::GpuError::TargetFormat); a plan, which techniques that choose their passes by the view make for each view, larger than the
    /// device's memory; the device. After an error nothing was added, and the frame's number may be used again.
    pub fn frame(
        &mut self,
        context: FrameContext,
        commands: &CallersCommands,
        target: &Target,
    ) -> Result<(), TechniqueError> {
        self.0.frame_into(context, commands, target)
    }

    /// The device is done with the command buffers of all frames up to number `index`, or they will never be submitted: hands these frames
    /// to `done`, in their order. The frame after such ones is a [cut](FrameContext::cut): they have left it nothing. A frame that fell short of
    /// room says so ([`Done::fell_short`]); lists that had none, or hardly any, have more of it in frames that are recorded from now on. That is
    /// a plan on this thread, which submits to the queue, or on another one ([`Self::plan_ahead`]).
    ///
    /// # Errors
    /// The device, a plan that is larger than its memory; those of `done`.
    pub fn done(
        &mut self,
        index: u64,
        done: &mut dyn FnMut(&Done<'_>) -> Result<(), TechniqueError>,
    ) -> Result<(), TechniqueError> {
        self.0.done_by_caller(index, done)
    }

    /// See [`Flight::plan_ahead`].
    pub fn plan_ahead(&mut self) {
        self.0.plan_ahead();
    }

    /// See [`Flight::moves_without_plans`].
    pub fn moves_without_plans(&self) -> bool {
        self.0.moves_without_plans()
    }

    /// See [`Flight::bytes`].
    pub fn bytes(&self) -> (u64, u64) {
        self.0.bytes()
    }

    /// See [`Flight::pass_names`].
    pub fn pass_names(&self) -> Vec<String> {
        self.0.pass_names()
    }
}
