//! Techniques, sizes and sample counts that take turns in flight.

use afterlight_measure::Held;
use afterlight_renderer::{Ahead, Done, Flight, FlightOptions, FrameContext};
use afterlight_scene::Camera;
use afterlight_techniques::{Settings, TechniqueError, graph::gpu};

use crate::{Chosen, FrameSpec, LabError, Session, play::PlaySpec};

/// What draws in a turn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Turn {
    /// The technique, by its place among those that were chosen.
    pub technique: usize,
    /// Image size, width and height in pixels.
    pub size_px: [u32; 2],
    /// Samples a pixel.
    pub samples: u32,
}

impl Turn {
    /// The turns of a round: every technique at every size and number of samples that it can, the techniques changing fastest.
    pub fn all(spec: &FrameSpec, how: &PlaySpec, chosen: &[Chosen]) -> Vec<Turn> {
        let sizes = if how.sizes_px.is_empty() { &[[spec.width, spec.height]][..] } else { &how.sizes_px };
        let samples = if how.samples.is_empty() { &[spec.samples][..] } else { &how.samples };
        // A technique that can draw none of them is asked all the same, and says so.
        let can = |one: &Chosen, count: u32| {
            let known = one.technique.info().samples;
            known.contains(&count) || samples.iter().all(|count| !known.contains(count))
        };
        let mut turns = Vec::new();
        for &size_px in sizes {
            for &samples in samples {
                let able = (0..chosen.len()).filter(|technique| can(&chosen[*technique], samples));
                turns.extend(able.map(|technique| Turn { technique, size_px, samples }));
            }
        }
        turns
    }

    /// In words: `tiled`, or `tiled at 160x90, 4 samples` where it `differs` by more than the technique.
    pub fn name(&self, id: &str, differs: bool) -> String {
        let [width_px, height_px] = self.size_px;
        match differs {
            true => format!("{id} at {width_px}x{height_px}, {} samples", self.samples),
            false => id.to_owned(),
        }
    }
}

/// Sees frames that are done, with the turn that drew each.
pub(crate) type SeesFrame<'a> = dyn FnMut(usize, &Done<'_>) -> Result<(), TechniqueError> + 'a;

/// The flights of all turns: prepared at once; or, where they differ by more than the technique, each on another thread during the turn before.
pub(crate) struct Flights<'a> {
    session: &'a Session,
    chosen: &'a [Chosen],
    turns: &'a [Turn],
    options: FlightOptions,
    /// Flights with their turns. Where they are prepared one by one, the one whose turn it is stands last.
    flights: Vec<(usize, Flight)>,
    /// Whether they are prepared one by one.
    one_by_one: bool,
    ahead: Option<Ahead<Flight>>,
    /// Turns that have begun.
    begun: u64,
    /// What the process held at the beginning of each round.
    pub held: Vec<Held>,
}

impl<'a> Flights<'a> {
    /// Prepares the flights for their first view, or the first of them; `tell` hears of each.
    pub fn new(
        session: &'a Session,
        (chosen, turns, one_by_one): (&'a [Chosen], &'a [Turn], bool),
        (first, options): (&Camera, FlightOptions),
        tell: &dyn Fn(&str),
    ) -> Result<Self, LabError> {
        let (flights, held) = (Vec::new(), Vec::new());
        let mut all =
            Self { session, chosen, turns, options, flights, one_by_one, ahead: None, begun: 0, held };
        let at_once = if one_by_one { 1 } else { turns.len() };
        for turn in 0..at_once {
            tell(chosen[turns[turn].technique].id());
            let flight = all.prepare(turn, first)?.take()?;
            all.flights.push((turn, flight));
        }
        all.held.push(held_now(session.renderer.device(), 0));
        all.prepare_next(first)?;
        Ok(all)
    }

    /// Prepares a turn's flight on another thread.
    fn prepare(&self, turn: usize, camera: &Camera) -> Result<Ahead<Flight>, LabError> {
        let Turn { technique, size_px: [width_px, height_px], samples } = self.turns[turn];
        let (chosen, renderer) = (&self.chosen[technique], &self.session.renderer);
        let settings =
            Settings { width_px, height_px, samples, camera: camera.clone(), ..renderer.settings().clone() };
        Ok(renderer.fly_ahead(chosen.technique, &chosen.params, settings, self.options)?)
    }

    /// Begins to prepare the flight of the turn after the one that has begun last, where flights are prepared one by one.
    fn prepare_next(&mut self, camera: &Camera) -> Result<(), LabError> {
        if self.one_by_one && self.turns.len() > 1 {
            let next = (self.begun + 1) as usize % self.turns.len();
            self.ahead = Some(self.prepare(next, camera)?);
        }
        Ok(())
    }

    /// Lets turn number `turn`, counted from the first frame on, begin with the frame of that number.
    pub fn turn_to(
        &mut self,
        turn: u64,
        (frame, camera): (u64, &Camera),
        sees: &mut SeesFrame<'_>,
    ) -> Result<(), LabError> {
        if turn == self.begun {
            return Ok(());
        }
        self.begun = turn;
        let place = turn as usize % self.turns.len();
        if let Some(ahead) = self.ahead.take() {
            self.flights.push((place, ahead.take()?));
        }
        if place == 0 {
            // What is held at the beginning of a round is the same in each: nothing of the turns before, nothing of the next one.
            self.land(sees)?;
            self.leave();
            self.held.push(held_now(self.session.renderer.device(), frame));
        }
        self.prepare_next(camera)
    }

    /// Sends a frame on its way, and hands on those that are done.
    pub fn frame(&mut self, context: FrameContext, sees: &mut SeesFrame<'_>) -> Result<(), LabError> {
        let place = self.begun as usize % self.turns.len();
        let now = if self.one_by_one { self.flights.len() - 1 } else { place };
        let mut context = Some(context);
        for (i, (turn, flight)) in self.flights.iter_mut().enumerate() {
            let mut done = |done: &Done<'_>| sees(*turn, done);
            match context.take_if(|_| i == now) {
                Some(context) => flight.frame(context, &mut done)?,
                None => flight.poll(&mut done)?,
            }
        }
        self.leave();
        Ok(())
    }

    /// Gives up flights whose turn is over and whose frames are all handed on, where each is prepared anew.
    fn leave(&mut self) {
        if !self.one_by_one {
            return;
        }
        let last = self.flights.len() - 1;
        let mut i = 0;
        self.flights.retain(|(_, flight)| {
            i += 1;
            i > last || flight.on_their_way() > 0
        });
    }

    /// Waits for all frames.
    pub fn land(&mut self, sees: &mut SeesFrame<'_>) -> Result<(), LabError> {
        for (turn, flight) in &mut self.flights {
            flight.land(&mut |done| sees(*turn, done))?;
        }
        Ok(())
    }

    /// Notes what is held after the last frame, when all have landed.
    pub fn end(&mut self, frames: u64) {
        drop(self.ahead.take());
        self.held.push(held_now(self.session.renderer.device(), frames));
    }

    /// Flights that there are, with their turns.
    pub fn flights(&self) -> &[(usize, Flight)] {
        &self.flights
    }
}

/// What the process holds now.
fn held_now(device: &gpu::Device, frame: u64) -> Held {
    Held {
        frame,
        device_bytes: device.held_bytes(),
        device_objects: device.held_objects() as u64,
        host_bytes: host_bytes(),
    }
}

/// Resident memory of the process, where the system tells.
fn host_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kib = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().strip_suffix("kB")?;
    Some(1024 * kib.trim().parse::<u64>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::choose;

    fn how(sizes_px: &[[u32; 2]], samples: &[u32]) -> PlaySpec {
        PlaySpec { sizes_px: sizes_px.to_vec(), samples: samples.to_vec(), ..PlaySpec::default() }
    }

    #[test]
    fn turns_are_all_that_techniques_can() {
        let ids = ["forward", "tiled", "dais"].map(str::to_owned);
        let chosen = choose("technique", &ids, &[]).expect("known");
        let spec = FrameSpec { width: 64, height: 48, ..FrameSpec::default() };
        let alone = Turn::all(&spec, &how(&[], &[]), &chosen);
        assert_eq!(alone.len(), 3);
        assert!(alone.iter().all(|turn| turn.size_px == [64, 48] && turn.samples == 1));
        let turns = Turn::all(&spec, &how(&[[8, 9], [16, 9]], &[1, 4]), &chosen);
        let able =
            |samples| chosen.iter().filter(|one| one.technique.info().samples.contains(&samples)).count();
        assert_eq!(turns.len(), 2 * (able(1) + able(4)));
        assert!(able(4) < 3, "tiled has one sample");
        assert_eq!(turns[0].name("forward", true), "forward at 8x9, 1 samples");
    }

    #[test]
    fn the_system_tells_what_the_process_holds() {
        assert!(!cfg!(target_os = "linux") || host_bytes().expect("a figure") > 1 << 20);
    }
}
