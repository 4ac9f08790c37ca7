//! Frames in flight: a camera that moves, several frames on their way at once, nobody waits.
//!
//! A frame's inputs are written into memory of its own and copied by the device, so that the host can prepare the next frame while the device
//! draws this one. All frames share the plan's images and buffers, since the device draws one after another.

use std::{
    collections::VecDeque,
    sync::Arc,
    time::{Duration, Instant},
};

use afterlight_graph::{Executor, FrameSlot, FrameTimes, ResourceId, Turn, gpu};
use afterlight_scene::{Aabb, Camera, InstanceHandle, Light, LightHandle, Pose, Scene, ShapePose};
use glam::Affine3A;

use crate::{
    Prepared, Renderer,
    chain::{Chain, Link},
    renderer::Recipe,
};
use afterlight_frame::{
    ChangesWith, FrameTime, Params, Settings, Technique, TechniqueError, ViewBefore,
    capacity::{Capacities, Counter, Demand},
    completed,
};

/// Times that a frame is drawn again at most until everything that can overflow has room.
const DRAWN_AGAIN_MAX: u32 = 8;

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
}

impl Default for FlightOptions {
    fn default() -> Self {
        Self { in_flight: 3, shortfall: Shortfall::DrawAgain, pictures: false, scene_moves: false }
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

/// Where surfaces and lights of a scene are at one time.
#[derive(Clone, Debug)]
pub struct ScenePose {
    /// World from object of each instance of the scene.
    pub world_from_objects: Vec<Affine3A>,
    /// The lights, as many and of the same kinds as the renderer's; `None` is those.
    pub lights: Option<Vec<Light>>,
    /// Shapes of skinned and morphed meshes; `None` is those that were uploaded.
    pub shapes: Option<PosedBounds>,
}

/// Shapes of skinned and morphed meshes at one time.
#[derive(Clone, Debug)]
pub struct PosedBounds {
    /// Joints and weights, as many as the scene has.
    pub pose: ShapePose,
    /// A box of each deformed instance ([`Scene::deformed_bounds_os`]).
    pub bounds_os: Vec<(u32, Aabb)>,
}

impl ScenePose {
    /// A pose of the scene as it was loaded; its lights where `lights_move`.
    pub fn of(scene: &Scene, pose: &Pose, lights_move: bool) -> Self {
        let shapes = (!scene.deformations.is_empty()).then(|| {
            let pose =
                ShapePose { object_from_bind: pose.object_from_bind.clone(), weights: pose.weights.clone() };
            PosedBounds { bounds_os: scene.deformed_bounds_os(&pose), pose }
        });
        Self {
            world_from_objects: pose.world_from_object.clone(),
            lights: lights_move.then(|| pose.lights.clone()),
            shapes,
        }
    }

    /// A scene as it was made or loaded, to be changed by handles.
    pub fn at_rest(scene: &Scene) -> Self {
        let world_from_objects = scene.instances.iter().map(|instance| instance.world_from_object).collect();
        Self { world_from_objects, lights: Some(scene.lights.clone()), shapes: None }
    }

    /// World from object of an instance; `None` where the scene has no such instance.
    pub fn instance(&mut self, instance: InstanceHandle) -> Option<&mut Affine3A> {
        self.world_from_objects.get_mut(instance.index())
    }

    /// A light, whose kind must stay; `None` where the pose has no such light.
    pub fn light(&mut self, light: LightHandle) -> Option<&mut Light> {
        self.lights.as_mut()?.get_mut(light.index())
    }
}

/// Something that costs a frame more than its neighbours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The technique records what holds for one view alone, so the frame was planned anew.
    Planned,
    /// A list had no room for what the frame needed, or hardly any: it grows.
    Grown(Counter),
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
}

/// What sends a frame on its way.
type Sending<'a> = dyn FnMut(&mut Place, &Prepared, Turn) -> Result<(), TechniqueError> + 'a;

/// A technique that draws frame after frame.
pub struct Flight<'r> {
    renderer: &'r Renderer,
    technique: &'r dyn Technique,
    params: Params,
    options: FlightOptions,
    prepared: Prepared,
    /// Counts the plans so far.
    plan: u64,
    demands: Arc<[Demand]>,
    /// What the last frame that was sent on its way shows.
    shown: Option<Showing>,
    /// Frames that were sent on their way.
    sent: u64,
    /// What the last of them showed.
    before: Option<Arc<ViewBefore>>,
    /// Who wrote the history of the plan's resources.
    chain: Chain,
    /// In the order of their frames, the oldest first.
    places: VecDeque<Place>,
    /// Whether frames go into another program's command buffers; none of them is submitted or waited for.
    for_callers: bool,
}

impl Renderer {
    /// Prepares a technique for frames in flight, the first of them through `camera`.
    ///
    /// # Errors
    /// As [`Renderer::prepare`].
    pub fn fly<'r>(
        &'r self,
        technique: &'r dyn Technique,
        params: &Params,
        camera: &Camera,
        options: FlightOptions,
    ) -> Result<Flight<'r>, TechniqueError> {
        self.fly_for(technique, params, camera, options, false)
    }

    pub(crate) fn fly_for<'r>(
        &'r self,
        technique: &'r dyn Technique,
        params: &Params,
        camera: &Camera,
        options: FlightOptions,
        for_callers: bool,
    ) -> Result<Flight<'r>, TechniqueError> {
        let params = completed(technique, params);
        let recipe = Recipe {
            technique,
            params: &params,
            moves: true,
            scene_moves: options.scene_moves,
            earlier: None,
        };
        let prepared = self.prepare_to_move(&recipe, camera)?;
        let mut flight = Flight {
            renderer: self,
            technique,
            params,
            options,
            plan: 0,
            demands: prepared.demands.clone().into(),
            prepared,
            shown: None,
            sent: 0,
            before: None,
            chain: Chain::default(),
            places: VecDeque::new(),
            for_callers,
        };
        // Ahead of the frames that need them.
        for _ in 0..options.in_flight.max(1) {
            let place = flight.new_place()?;
            flight.places.push_back(place);
        }
        Ok(flight)
    }
}

impl Flight<'_> {
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
        self.renderer.device().check_target(target)?;
        self.send(context, &mut |place, prepared, turn| {
            let picture = (prepared.kept.final_color, turn);
            Ok(place.slot.execute_in(&prepared.executor, picture, commands, target)?)
        })
    }

    fn send(&mut self, context: FrameContext, how: &mut Sending<'_>) -> Result<(), TechniqueError> {
        let start = Instant::now();
        let mut events = Vec::new();
        let before = self.before.clone().filter(|_| !context.cut);
        let frame = Showing { context, sent: self.sent, before };
        self.show(&frame)?;
        if !self.prepared.shows_all_views {
            self.plan_anew(&frame.context.camera, self.prepared.capacities.again())?;
            events.push(Event::Planned);
        }
        let (mut place, link) = self.fill_place(&frame)?;
        how(&mut place, &self.prepared, link.turn)?;
        self.chain.append(link);
        self.sent += 1;
        let with_records = self.prepared.asks_for_records_before;
        self.before = Some(Arc::new(self.prepared.viewed.as_before(with_records)));
        self.shown = Some(frame.clone());
        let flying = Flying { frame, cpu: start.elapsed(), events };
        self.places.push_back(Place { flying: Some(flying), ..place });
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
        self.prepared.viewed.place(context.pose.as_deref(), &self.renderer.settings().lights)?;
        self.prepared.viewed.look_through(&context.camera);
        self.prepared.viewed.time = time_of(frame);
        Ok(())
    }

    /// Submits a frame, which is shown.
    fn launch(&mut self, frame: &Showing) -> Result<Place, TechniqueError> {
        let (mut place, link) = self.fill_place(frame)?;
        place.slot.submit(link.turn)?;
        self.chain.append(link);
        Ok(place)
    }

    /// A place that nobody uses, with the inputs of a frame, which is shown, and that frame's place in the chain.
    fn fill_place(&mut self, frame: &Showing) -> Result<(Place, Link), TechniqueError> {
        let link = self.chain.link(frame.sent);
        self.prepared.viewed.time = FrameTime { has_history: link.has_history(), ..time_of(frame) };
        // A place whose frame was handed on stands at the front.
        let idle = self.places.iter().position(|place| place.flying.is_none() && place.plan == self.plan);
        let mut place = match idle.and_then(|idle| self.places.remove(idle)) {
            Some(place) => place,
            None => {
                // Places of older plans are of no use.
                self.places.retain(|place| place.flying.is_some());
                self.new_place()?
            }
        };
        if !self.prepared.scripts.is_empty() {
            self.prepared.choose_draws();
            self.prepared.executor.record_again(&mut place.slot, link.turn)?;
        }
        let view = self.prepared.viewed.view();
        let stands_still = place.pose == Some(self.prepared.viewed.pose);
        for (i, input) in self.prepared.inputs.iter().enumerate() {
            if input.changes_with == ChangesWith::Camera || !stands_still {
                place.slot.write(i, |bytes| input.fill(&view, bytes))?;
            }
        }
        place.pose = Some(self.prepared.viewed.pose);
        Ok((place, link))
    }

    /// A place of the current plan.
    fn new_place(&self) -> Result<Place, TechniqueError> {
        let inputs: Vec<_> = self.prepared.inputs.iter().map(|input| input.target.clone()).collect();
        let executor = &self.prepared.executor;
        let slot = match self.for_callers {
            true => executor.slot_for_callers(&inputs, &self.outputs())?,
            false => executor.slot(&inputs, &self.outputs())?,
        };
        Ok(Place { slot, plan: self.plan, demands: self.demands.clone(), pose: None, flying: None })
    }

    /// What is read after each frame: a counter a list, then the picture.
    fn outputs(&self) -> Vec<ResourceId> {
        let counters = self.demands.iter().map(Demand::resource);
        counters.chain(self.options.pictures.then_some(self.prepared.kept.final_color)).collect()
    }

    fn plan_anew(&mut self, camera: &Camera, capacities: Capacities) -> Result<(), TechniqueError> {
        let lights = self.prepared.viewed.settings.lights.clone();
        let settings = Settings { camera: camera.clone(), lights, ..self.renderer.settings().clone() };
        let moved = std::mem::take(&mut self.prepared.viewed.moved);
        let recipe = Recipe {
            technique: self.technique,
            params: &self.params,
            moves: true,
            scene_moves: self.options.scene_moves,
            earlier: Some(&self.prepared.executor),
        };
        self.prepared = self.renderer.record(&recipe, &settings, moved, capacities, &|_, _| {})?;
        self.demands = self.prepared.demands.clone().into();
        self.plan += 1;
        if !self.prepared.executor.takes_over() {
            self.chain = Chain::default();
        }
        Ok(())
    }

    /// Hands frames that are done to `done`, the oldest first, and waits until no more than `left` are on their way.
    fn hand_on(
        &mut self,
        left: usize,
        done: &mut dyn FnMut(&Done<'_>) -> Result<(), TechniqueError>,
    ) -> Result<(), TechniqueError> {
        loop {
            let flying = self.places.iter().filter(|place| place.flying.is_some()).count();
            let Some(oldest) = self.places.iter().position(|place| place.flying.is_some()) else {
                return Ok(());
            };
            if flying <= left && !self.places[oldest].slot.is_done()? {
                return Ok(());
            }
            let Some(mut place) = self.places.remove(oldest) else { return Ok(()) };
            let Some(mut flying) = place.flying.take() else { return Ok(()) };
            place.slot.wait()?;
            let fell_short = self.make_room(&mut place, &mut flying)?;
            let times = place.slot.finish()?.clone();
            let picture = self.options.pictures.then_some(place.demands.len());
            let mut tell = |rgba8: Option<&[u8]>| {
                done(&Done {
                    index: flying.frame.context.index,
                    times: &times,
                    cpu: flying.cpu,
                    events: &flying.events,
                    fell_short,
                    rgba8,
                })
            };
            match picture {
                Some(output) => place.slot.read(output, |bytes| tell(Some(bytes)))??,
                None => tell(None)?,
            }
            if place.plan == self.plan {
                self.places.push_front(place);
            }
        }
    }

    /// Gives lists that had no room for what a frame needed, or hardly any, more of it, and draws the frame again where something was dropped
    /// and the options say so. Returns whether the frame that `place` now holds dropped something.
    fn make_room(&mut self, place: &mut Place, flying: &mut Flying) -> Result<bool, TechniqueError> {
        let mut drawings_left = DRAWN_AGAIN_MAX;
        loop {
            let start = Instant::now();
            let counters = place.counters()?;
            let fell_short = counters.iter().any(Counter::fell_short);
            if drawings_left == 0 || !counters.iter().any(Counter::is_scarce) {
                return Ok(fell_short);
            }
            drawings_left -= 1;
            flying.events.extend(counters.iter().filter(|one| one.is_scarce()).copied().map(Event::Grown));
            let now = self.shown.clone();
            // What another program's commands have drawn is in its image: it can only be told.
            let can_draw_again = self.options.shortfall == Shortfall::DrawAgain && !self.for_callers;
            let is_drawn_again = fell_short && can_draw_again;
            if is_drawn_again {
                self.show(&flying.frame)?;
            }
            let camera = self.prepared.viewed.settings.camera.clone();
            // A frame before this one may have made room already.
            if self.prepared.capacities.lack(&counters) {
                self.plan_anew(&camera, self.prepared.capacities.grown(&counters))?;
            } else if is_drawn_again && !self.prepared.shows_all_views {
                self.plan_anew(&camera, self.prepared.capacities.again())?;
            }
            if !is_drawn_again {
                flying.cpu += start.elapsed();
                return Ok(fell_short);
            }
            flying.events.push(Event::DrawnAgain);
            *place = self.launch(&flying.frame)?;
            flying.cpu += start.elapsed();
            place.slot.wait()?;
            if let Some(now) = &now {
                self.show(now)?;
            }
        }
    }
}

/// When a frame is, as long as it is not known whether it finds history.
fn time_of(frame: &Showing) -> FrameTime {
    let FrameContext { index, time_s, .. } = frame.context;
    FrameTime { index, time_s, before: frame.before.clone(), has_history: false }
}

impl Place {
    /// What the frame counted of lists that can overflow.
    fn counters(&mut self) -> Result<Vec<Counter>, TechniqueError> {
        let slot = &mut self.slot;
        let demands = self.demands.iter().enumerate();
        demands.map(|(output, demand)| Ok(slot.read(output, |bytes| demand.count(bytes))?)).collect()
    }
}
