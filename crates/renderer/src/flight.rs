//! Frames in flight: a camera that moves, several frames on their way at once, nobody waits.
//!
//! A frame's inputs are written into memory of its own and copied by the device, so that the host can prepare the next frame while the device
//! draws this one. All frames share the plan's images and buffers, since the device draws one after another.

use std::{
    collections::VecDeque,
    sync::Arc,
    time::{Duration, Instant},
};

use afterlight_graph::{Executor, FrameSlot, FrameTimes, Turn, gpu};
use afterlight_scene::Camera;

use crate::{
    Ahead, Prepared, Renderer, ScenePose,
    before::Befores,
    chain::{Chain, Link},
};
use afterlight_frame::{
    ChangesWith, FrameTime, Params, Settings, Technique, TechniqueError, ViewBefore,
    capacity::{Counter, Demand},
    completed,
};
use growth::Growth;
use maker::Maker;

mod growth;
mod maker;

/// What a flight does with a frame that fell short of room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shortfall {
    /// Draws it again with room before it is handed on.
    DrawAgain,
    /// Hands it on with what it dropped; later frames have room.
    Tell,
}

/// How frames fly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlightOptions {
    /// Frames on their way at once, at least 1.
    pub in_flight: u32,
    /// What is done with a frame that fell short of room.
    pub shortfall: Shortfall,
    /// Whether pictures are copied to where the host can read them.
    pub pictures: bool,
    /// Whether surfaces and lights may move ([`FrameContext::pose`]): their records are then inputs of each frame.
    pub scene_moves: bool,
    /// Whether a list that grows is given its room by a plan made on another thread, while frames go on with the plan that there is; else the
    /// caller's thread makes it, and the next frame waits. That thread submits to the device's queue: where the device was adopted, this
    /// counts for nothing, and [`Flight::plan_ahead`] says that it may.
    pub plans_ahead: bool,
}

impl Default for FlightOptions {
    fn default() -> Self {
        Self {
            in_flight: 3,
            shortfall: Shortfall::DrawAgain,
            pictures: false,
            scene_moves: false,
            plans_ahead: true,
        }
    }
}

/// What a frame is given: all that may change without a new plan.
#[derive(Clone, Debug)]
pub struct FrameContext {
    /// Number of the frame.
    pub index: u64,
    /// Time of the scene, s.
    pub time_s: f64,
    /// Whether the camera has jumped: nothing of the frame before is of use. The first frame of a flight is one of its own.
    pub cut: bool,
    /// The camera.
    pub camera: Camera,
    /// Where surfaces and lights of the scene are; `None` is where they were uploaded.
    pub pose: Option<Arc<ScenePose>>,
}

/// Something that costs a frame more than its neighbours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The technique records what holds for one view alone, so the frame was planned anew.
    Planned,
    /// A list had no room for what the frame needed, or hardly any: it grows.
    Grown(Counter),
    /// What the frame counted began a plan with more room, on another thread ([`FlightOptions::plans_ahead`]).
    PlanBegun,
    /// The frame is the first that was drawn with a plan made on another thread.
    PlanTaken,
    /// The frame was drawn again, with room.
    DrawnAgain,
}

/// A frame that is done.
pub struct Done<'a> {
    /// Its number.
    pub index: u64,
    /// When the device worked on it.
    pub times: &'a FrameTimes,
    /// Time of the host's thread that it took, waiting for the device left out.
    pub cpu: Duration,
    /// What cost it more than its neighbours.
    pub events: &'a [Event],
    /// Whether it dropped something for want of room ([`Shortfall::Tell`]; or a bound that the user fixed).
    pub fell_short: bool,
    /// The picture, as [`Prepared::final_rgba8`], where the options ask for it.
    pub rgba8: Option<&'a [u8]>,
}

/// A frame's place: recorded for one plan, and perhaps on its way.
struct Place {
    slot: FrameSlot,
    /// The plan that it is recorded for.
    plan: u64,
    /// Lists that can overflow, each an output of the slot.
    demands: Arc<[Demand]>,
    /// The pose that it has the inputs of.
    pose: Option<u64>,
    flying: Option<Flying>,
}

/// A frame with what the one before it showed: what a frame that is drawn again is given once more.
#[derive(Clone)]
struct Showing {
    context: FrameContext,
    /// Its number in the order in which frames were sent.
    sent: u64,
    before: Option<Arc<ViewBefore>>,
}

struct Flying {
    frame: Showing,
    cpu: Duration,
    events: Vec<Event>,
    /// Whether the events tell already what it lacked.
    is_told: bool,
    drawings_left: u32,
}

/// What sends a frame on its way.
type Sending<'a> = dyn FnMut(&mut Place, &Prepared, Turn) -> Result<(), TechniqueError> + 'a;

/// A technique that draws frame after frame.
pub struct Flight {
    maker: Arc<Maker>,
    options: FlightOptions,
    prepared: Prepared,
    /// Counts the plans so far.
    plan: u64,
    /// Frames that were sent on their way.
    sent: u64,
    /// What they showed.
    befores: Befores,
    /// Who wrote the history of the plan's resources.
    chain: Chain,
    /// In the order of their frames, the oldest first; those that wait for one stand before them.
    places: VecDeque<Place>,
    growth: Growth,
}

impl Renderer {
    /// Prepares a technique for frames in flight, the first of them through `camera`.
    ///
    /// # Errors
    /// As [`Renderer::prepare`].
    pub fn fly(
        &self,
        technique: &'static dyn Technique,
        params: &Params,
        camera: &Camera,
        options: FlightOptions,
    ) -> Result<Flight, TechniqueError> {
        self.fly_for(technique, params, camera, options, false)
    }

    /// Prepares a flight on another thread while frames of other flights go on: of the same scene, with other settings, another technique,
    /// other parameters, or several of them. Its first view is through the settings' camera.
    ///
    /// The thread uploads small buffers and, where the technique has lists that can overflow, draws some frames to count what they need:
    /// it submits to the device's queue between the frames of the program. A device that was adopted must therefore be used
    /// within [`Device::with_queue`](afterlight_graph::gpu::Device::with_queue) meanwhile.
    ///
    /// # Errors
    /// No thread. What [`Renderer::fly`] and [`Renderer::with_settings`] tell, [`Ahead::take`] tells.
    pub fn fly_ahead(
        &self,
        technique: &'static dyn Technique,
        params: &Params,
        settings: Settings,
        options: FlightOptions,
    ) -> Result<Ahead<Flight>, TechniqueError> {
        let (renderer, params) = (self.clone(), completed(technique, params));
        Ahead::begin(move || {
            let camera = settings.camera.clone();
            renderer.with_settings(settings)?.fly(technique, &params, &camera, options)
        })
    }

    pub(crate) fn fly_for(
        &self,
        technique: &'static dyn Technique,
        params: &Params,
        camera: &Camera,
        options: FlightOptions,
        for_callers: bool,
    ) -> Result<Flight, TechniqueError> {
        let params = completed(technique, params);
        let options =
            FlightOptions { plans_ahead: options.plans_ahead && !self.device().is_adopted(), ..options };
        let maker = Maker { renderer: self.clone(), technique, params, options, for_callers };
        let prepared = maker.first(camera)?;
        // Ahead of the frames that need them.
        let places = maker.places(&prepared)?;
        Ok(Flight {
            maker: Arc::new(maker),
            options,
            prepared,
            plan: 0,
            sent: 0,
            befores: Befores::default(),
            chain: Chain::default(),
            places,
            growth: Growth::default(),
        })
    }
}

impl Flight {
    /// Sends a frame on its way. Frames that are done by now are handed to `done` first, in their order; if as many as the options allow are
    /// on their way, the oldest is waited for.
    ///
    /// # Errors
    /// The device, a plan that is larger than its memory; those of `done`.
    pub fn frame(
        &mut self,
        context: FrameContext,
        done: &mut dyn FnMut(&Done<'_>) -> Result<(), TechniqueError>,
    ) -> Result<(), TechniqueError> {
        self.hand_on(self.options.in_flight.max(1) as usize - 1, done)?;
        self.send(context, &mut |place, _, turn| Ok(place.slot.submit(turn)?))
    }

    /// Adds a frame to another program's command buffer, and a copy of its picture to its image.
    pub(crate) fn frame_into(
        &mut self,
        context: FrameContext,
        commands: &gpu::CallersCommands,
        target: &gpu::Target,
    ) -> Result<(), TechniqueError> {
        // A frame that cannot be shown is not begun.
        self.maker.renderer.device().check_target(target)?;
        self.send(context, &mut |place, prepared, turn| {
            let picture = (prepared.kept.final_color, turn);
            Ok(place.slot.execute_in(&prepared.executor, picture, commands, target)?)
        })
    }

    fn send(&mut self, context: FrameContext, how: &mut Sending<'_>) -> Result<(), TechniqueError> {
        let start = Instant::now();
        let mut events = Vec::new();
        self.take_ready(&mut events)?;
        let before = self.befores.last().filter(|_| !context.cut);
        let frame = Showing { context, sent: self.sent, before };
        self.show(&frame)?;
        if !self.prepared.shows_all_views {
            self.plan_anew(self.prepared.capacities.again())?;
            events.push(Event::Planned);
        }
        let (mut place, link) = self.fill_place(&frame)?;
        how(&mut place, &self.prepared, link.turn)?;
        self.chain.append(link);
        self.sent += 1;
        let with_records = self.prepared.asks_for_records_before;
        self.befores.write(|one| self.prepared.viewed.write_as_before(with_records, one));
        let cpu = start.elapsed();
        place.flying = Some(Flying::new(frame, cpu, events));
        self.places.push_back(place);
        Ok(())
    }

    /// The device is done with the command buffers of all frames up to number `index`; hands these frames to `done`.
    pub(crate) fn done_by_caller(
        &mut self,
        index: u64,
        done: &mut dyn FnMut(&Done<'_>) -> Result<(), TechniqueError>,
    ) -> Result<(), TechniqueError> {
        for place in &mut self.places {
            if place.flying.as_ref().is_some_and(|flying| flying.frame.context.index <= index) {
                place.slot.release_from_caller();
            }
        }
        self.hand_on(usize::MAX, done)
    }

    /// Waits for all frames on their way and hands them to `done`.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn land(
        &mut self,
        done: &mut dyn FnMut(&Done<'_>) -> Result<(), TechniqueError>,
    ) -> Result<(), TechniqueError> {
        self.hand_on(0, done)
    }

    /// Hands frames that are done by now to `done`, and waits for none.
    ///
    /// # Errors
    /// As [`Self::frame`].
    pub fn poll(
        &mut self,
        done: &mut dyn FnMut(&Done<'_>) -> Result<(), TechniqueError>,
    ) -> Result<(), TechniqueError> {
        self.hand_on(usize::MAX, done)
    }

    /// Frames that were not handed on yet.
    pub fn on_their_way(&self) -> usize {
        self.places.iter().filter(|place| place.flying.is_some()).count()
    }

    /// Whether another view needs no new plan: all that depends on the view is an input.
    pub fn moves_without_plans(&self) -> bool {
        self.prepared.shows_all_views
    }

    /// Bytes of the plan, and those that frames in flight hold for themselves.
    pub fn bytes(&self) -> (u64, u64) {
        (self.prepared.executor.plan().peak_bytes(), self.places.iter().map(|place| place.slot.bytes()).sum())
    }

    /// Names of the passes, in the order of [`FrameTimes::pass_ns`].
    pub fn pass_names(&self) -> Vec<String> {
        self.prepared.executor.plan().passes.iter().map(|pass| pass.name.clone()).collect()
    }

    /// The executor of the current plan, for memory figures and for what was kept of the last frame.
    pub fn executor(&self) -> &Executor {
        &self.prepared.executor
    }

    /// Looks at what a frame shows.
    fn show(&mut self, frame: &Showing) -> Result<(), TechniqueError> {
        let context = &frame.context;
        if context.pose.is_some() && !self.options.scene_moves {
            return Err(TechniqueError::SceneStandsStill);
        }
        let viewed = &mut self.prepared.viewed;
        viewed.place(context.pose.as_deref(), &self.maker.renderer.settings().lights)?;
        viewed.look_through(&context.camera);
        viewed.time = time_of(frame);
        Ok(())
    }

    /// A place that nobody uses, with the inputs of a frame, which is shown, and that frame's place in the chain.
    fn fill_place(&mut self, frame: &Showing) -> Result<(Place, Link), TechniqueError> {
        let link = self.chain.link(frame.sent);
        self.prepared.viewed.time = FrameTime { has_history: link.has_history(), ..time_of(frame) };
        // A place whose frame was handed on stands at the front.
        let idle = self.places.iter().position(|place| place.flying.is_none() && place.plan == self.plan);
        let mut place = match idle.and_then(|idle| self.places.remove(idle)) {
            Some(place) => place,
            None => Place { plan: self.plan, ..self.maker.place(&self.prepared)? },
        };
        let prepared = &mut self.prepared;
        if !prepared.scripts.is_empty() {
            prepared.choose_draws();
            prepared.executor.record_again(&mut place.slot, link.turn)?;
        }
        let view = prepared.viewed.view();
        let stands_still = place.pose == Some(prepared.viewed.pose);
        for (i, input) in prepared.inputs.iter().enumerate() {
            if input.changes_with == ChangesWith::Camera || !stands_still {
                place.slot.write(i, |bytes| input.fill(&view, bytes))?;
            }
        }
        place.pose = Some(prepared.viewed.pose);
        Ok((place, link))
    }

    /// Hands frames that are done to `done`, the oldest first, and waits until no more than `left` are on their way.
    fn hand_on(
        &mut self,
        left: usize,
        done: &mut dyn FnMut(&Done<'_>) -> Result<(), TechniqueError>,
    ) -> Result<(), TechniqueError> {
        loop {
            let flying = self.on_their_way();
            let Some(oldest) = self.places.iter().position(|place| place.flying.is_some()) else {
                return Ok(());
            };
            let may_wait = flying > left;
            if !may_wait && !self.places[oldest].slot.is_done()? {
                return Ok(());
            }
            let Some(mut place) = self.places.remove(oldest) else { return Ok(()) };
            let Some(mut flying) = place.flying.take() else { return Ok(()) };
            place.slot.wait()?;
            let Some(fell_short) = self.make_room(&mut place, &mut flying, may_wait)? else {
                // Its turn comes when there is a plan with room.
                place.flying = Some(flying);
                self.places.insert(oldest, place);
                return Ok(());
            };
            let picture = self.options.pictures.then_some(place.demands.len());
            place.slot.finish_and_read(picture, |times, rgba8| {
                done(&Done {
                    index: flying.frame.context.index,
                    times,
                    cpu: flying.cpu,
                    events: &flying.events,
                    fell_short,
                    rgba8,
                })
            })??;
            if place.plan == self.plan {
                self.places.push_front(place);
            }
        }
    }
}

impl Flying {
    fn new(frame: Showing, cpu: Duration, events: Vec<Event>) -> Self {
        Self { frame, cpu, events, is_told: false, drawings_left: growth::DRAWN_AGAIN_MAX }
    }
}

/// When a frame is, as long as it is not known whether it finds history.
fn time_of(frame: &Showing) -> FrameTime {
    let FrameContext { index, time_s, .. } = frame.context;
    FrameTime { index, time_s, before: frame.before.clone(), has_history: false }
}
