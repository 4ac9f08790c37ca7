//! Lists that need more room than they have: a larger plan, made on another thread while frames go on.

use std::{collections::VecDeque, mem, sync::Arc, time::Instant};

use afterlight_frame::{
    Settings, TechniqueError,
    capacity::{Capacities, Counter},
};

use super::{Event, Flight, Flying, Place, Shortfall};
use crate::{Ahead, Prepared, chain::Chain};

/// Times that a frame is drawn again at most until everything that can overflow has room.
pub(super) const DRAWN_AGAIN_MAX: u32 = 8;

/// The larger plan that is being made, and what asks for it.
#[derive(Default)]
pub(super) struct Growth {
    ahead: Option<Ahead<(Prepared, VecDeque<Place>)>>,
    /// The most that frames needed of each list since the plan was begun; it may be more than the plan has room for. Empty where no list asks
    /// for room.
    needs: Vec<Counter>,
    /// Plans that followed one that frames had outgrown, without a frame that asked for them.
    followed: u32,
    /// Whether no frame was drawn yet with the plan that was taken last.
    is_new: bool,
    /// What the frame in hand counted, kept for its memory.
    counted: Vec<Counter>,
}

impl Growth {
    fn is_ready(&self) -> bool {
        self.ahead.as_ref().is_some_and(Ahead::is_ready)
    }

    /// Remembers what the frame in hand needed.
    fn note(&mut self) {
        if self.needs.len() != self.counted.len() {
            self.needs.clone_from(&self.counted);
        }
        for (need, counted) in self.needs.iter_mut().zip(&self.counted) {
            if counted.needed > need.needed {
                *need = *counted;
            }
        }
    }
}

impl Flight {
    /// Makes larger plans on another thread from now on, also on a device that was adopted. That thread submits to the queue at any time: the
    /// program must submit and present within [`Device::with_queue`](afterlight_graph::gpu::Device::with_queue).
    pub fn plan_ahead(&mut self) {
        self.options.plans_ahead = true;
    }

    /// Whether a larger plan is being made on another thread, or waits to be taken by the next frame.
    pub fn is_planning(&self) -> bool {
        self.growth.ahead.is_some()
    }

    /// Waits for the larger plan that is being made on another thread, where one is: the next frame is drawn with it.
    ///
    /// # Errors
    /// A plan that is larger than the device's memory, the device.
    pub fn wait_for_plan(&mut self) -> Result<(), TechniqueError> {
        while self.is_planning() {
            self.take_plan()?;
        }
        Ok(())
    }

    /// Takes the larger plan where it is ready, or was taken since the last frame.
    pub(super) fn take_ready(&mut self, events: &mut Vec<Event>) -> Result<(), TechniqueError> {
        if self.growth.is_ready() {
            self.take_plan()?;
        }
        if mem::take(&mut self.growth.is_new) {
            events.push(Event::PlanTaken);
        }
        Ok(())
    }

    /// Waits for the larger plan, and draws with it from now on. Begins another one where frames have come to need yet more meanwhile.
    fn take_plan(&mut self) -> Result<(), TechniqueError> {
        let Some(ahead) = self.growth.ahead.take() else { return Ok(()) };
        let (prepared, places) = ahead.take()?;
        self.begin_with(prepared);
        self.growth.is_new = true;
        let plan = self.plan;
        for place in places {
            self.places.push_front(Place { plan, ..place });
        }
        // A list that cannot grow must not be planned for ever.
        if self.growth.followed < DRAWN_AGAIN_MAX && self.prepared.capacities.lack(&self.growth.needs) {
            self.growth.followed += 1;
            return self.begin_plan();
        }
        self.growth.followed = 0;
        self.growth.needs.clear();
        Ok(())
    }

    /// Draws with another plan from now on. Frames that are on their way end with theirs.
    fn begin_with(&mut self, prepared: Prepared) {
        self.prepared = prepared;
        self.plan += 1;
        if !self.prepared.executor.takes_over() {
            self.chain = Chain::default();
        }
        // Places of older plans are of no use.
        self.places.retain(|place| place.flying.is_some());
    }

    fn begin_plan(&mut self) -> Result<(), TechniqueError> {
        let capacities = self.prepared.capacities.grown(&self.growth.needs);
        let (maker, camera) = (Arc::clone(&self.maker), self.prepared.viewed.settings.camera.clone());
        let history = self.prepared.executor.history();
        self.growth.ahead = Some(Ahead::begin(move || maker.ahead(camera, capacities, history))?);
        Ok(())
    }

    /// Plans anew on this thread, for the current view alone where the technique asks for that.
    pub(super) fn plan_anew(&mut self, capacities: Capacities) -> Result<(), TechniqueError> {
        let viewed = &mut self.prepared.viewed;
        let (camera, lights) = (viewed.settings.camera.clone(), viewed.settings.lights.clone());
        let settings = Settings { camera, lights, ..self.maker.renderer.settings().clone() };
        let moved = mem::take(&mut viewed.moved);
        let history = self.prepared.executor.history();
        let prepared = self.maker.plan(&settings, moved, capacities, history.as_ref())?;
        self.begin_with(prepared);
        Ok(())
    }

    /// Sees to it that lists get room that had none for what a frame needed, or hardly any, and draws the frame again where something was
    /// dropped and the options say so. Returns whether the frame that `place` now holds dropped something; `None` where it must be drawn
    /// again with a plan that is not ready, and nobody may wait.
    pub(super) fn make_room(
        &mut self,
        place: &mut Place,
        flying: &mut Flying,
        may_wait: bool,
    ) -> Result<Option<bool>, TechniqueError> {
        loop {
            let start = Instant::now();
            place.count(&mut self.growth.counted)?;
            let counted = &self.growth.counted;
            let fell_short = counted.iter().any(Counter::fell_short);
            if !counted.iter().any(Counter::is_scarce) {
                return Ok(Some(fell_short));
            }
            if !mem::replace(&mut flying.is_told, true) {
                let scarce = counted.iter().filter(|one| one.is_scarce());
                flying.events.extend(scarce.copied().map(Event::Grown));
            }
            // What another program's commands have drawn is in its image: it can only be told.
            let can_draw_again = self.options.shortfall == Shortfall::DrawAgain && !self.maker.for_callers;
            let draws_again = fell_short && can_draw_again && flying.drawings_left > 0;
            let has_room = match self.options.plans_ahead && self.prepared.shows_all_views {
                true => self.ask_for_room(flying, draws_again, may_wait)?,
                false => self.make_room_here(flying, draws_again)?,
            };
            if !draws_again {
                flying.cpu += start.elapsed();
                return Ok(Some(fell_short));
            }
            if !has_room {
                return Ok(None);
            }
            flying.drawings_left -= 1;
            flying.is_told = false;
            self.draw_again(place, flying, start)?;
        }
    }

    /// Begins a plan with room for what the frame in hand needed, unless there is one. Where the frame `must_fit`, waits until there is room,
    /// if it may, for a few plans at most. Returns whether it may be drawn again.
    fn ask_for_room(
        &mut self,
        flying: &mut Flying,
        must_fit: bool,
        may_wait: bool,
    ) -> Result<bool, TechniqueError> {
        for _ in 0..DRAWN_AGAIN_MAX {
            // A frame before this one may have made room already.
            if !self.prepared.capacities.lack(&self.growth.counted) {
                break;
            }
            self.growth.note();
            if !self.is_planning() {
                flying.events.push(Event::PlanBegun);
                self.begin_plan()?;
            }
            if !must_fit || !may_wait && !self.growth.is_ready() {
                return Ok(false);
            }
            self.take_plan()?;
        }
        Ok(true)
    }

    /// The same by a plan made on this thread.
    fn make_room_here(&mut self, flying: &Flying, must_fit: bool) -> Result<bool, TechniqueError> {
        if must_fit {
            self.show(&flying.frame)?;
        }
        let capacities = &self.prepared.capacities;
        if capacities.lack(&self.growth.counted) {
            self.plan_anew(capacities.grown(&self.growth.counted))?;
        } else if must_fit && !self.prepared.shows_all_views {
            self.plan_anew(capacities.again())?;
        }
        Ok(true)
    }

    /// Draws a frame again with the plan that there is now, and waits for it.
    fn draw_again(
        &mut self,
        place: &mut Place,
        flying: &mut Flying,
        start: Instant,
    ) -> Result<(), TechniqueError> {
        if mem::take(&mut self.growth.is_new) {
            flying.events.push(Event::PlanTaken);
        }
        flying.events.push(Event::DrawnAgain);
        self.show(&flying.frame)?;
        let (mut with_room, link) = self.fill_place(&flying.frame)?;
        with_room.slot.submit(link.turn)?;
        self.chain.append(link);
        let without = mem::replace(place, with_room);
        if without.plan == self.plan {
            self.places.push_front(without);
        }
        flying.cpu += start.elapsed();
        Ok(place.slot.wait()?)
    }
}

impl Place {
    /// What the frame counted of lists that can overflow.
    fn count(&mut self, counters: &mut Vec<Counter>) -> Result<(), TechniqueError> {
        counters.clear();
        for (output, demand) in self.demands.iter().enumerate() {
            counters.push(self.slot.read(output, |bytes| demand.count(bytes))?);
        }
        Ok(())
    }
}
