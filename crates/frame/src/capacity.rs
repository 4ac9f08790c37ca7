//! Capacities of lists that can overflow: what a frame needed is counted on the device, and a frame that needed more is
//! recorded again with room, or the result says what was dropped.

use std::cell::RefCell;

use afterlight_graph::{BufferHandle, Executor, Graph, ResourceId};
use serde::Serialize;

use crate::{Frame, TechniqueError};

/// A capacity that leaves less than this unused is kept; one that leaves more than three quarters of itself unused as well is
/// cut.
const SLACK: u32 = 4096;

/// Room beyond what a frame needed, eighths of it, where the next frame of the same view needs the same.
pub const STEADY: u32 = 1;
/// The same where what is needed depends on the order in which the device runs threads: 133,822 triangles through a cache with
/// locks after 103,000 in the frame before (NVIDIA H200).
pub const UNSTEADY: u32 = 8;

/// Elements that the first frame of a view has room for: that frame is run to count what the view needs, and its memory is given
/// back. So few that every view of a real scene needs a hundred times as many, and what a shortage does is seen at once.
pub const FIRST_GUESS: u32 = 16;

/// Frames that are run to count what is [`UNSTEADY`]: the first after a pause needs least (25,000 triangles, then 57,688).
const UNSTEADY_FRAMES: u32 = 4;

/// What a frame counted of something that can overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Counter {
    /// What is counted: `blocks`.
    pub name: &'static str,
    /// Elements that the frame asked for; `u32::MAX` where their sum passed 2³² on the device.
    pub needed: u32,
    /// Elements that there was room for.
    pub capacity: u32,
    /// What was dropped for want of room, in the counter's own unit (samples for `blocks`).
    pub dropped: u32,
    /// Whether the capacity was set by a parameter.
    pub fixed: bool,
}

/// The most of what frames counted; `before` may be empty.
pub fn most(before: Vec<Counter>, last: Vec<Counter>) -> Vec<Counter> {
    if before.is_empty() {
        return last;
    }
    let more = |(a, b): (Counter, Counter)| if a.needed > b.needed { a } else { b };
    before.into_iter().zip(last).map(more).collect()
}

impl Counter {
    /// Whether the frame lacked something.
    pub fn fell_short(&self) -> bool {
        self.dropped > 0 || self.needed > self.capacity
    }

    /// Whether the list should grow before the next frame: it fell short, or less than a sixteenth of its room is left.
    pub fn is_scarce(&self) -> bool {
        !self.fixed && (self.fell_short() || self.needed > self.capacity - self.capacity / 16)
    }

    /// What found no room, in words; none where all did.
    pub fn dropped_text(&self) -> Option<String> {
        let Self { name, needed, capacity, dropped, .. } = self;
        (*dropped > 0)
            .then(|| format!("{name}: found {needed} needed, {capacity} there; {dropped} samples dropped"))
    }
}

/// A counter on the device: two words, what was asked for and what was dropped.
#[derive(Clone, Debug)]
pub struct Demand {
    name: &'static str,
    resource: ResourceId,
    /// Of the two, in the resource.
    first_word: usize,
    capacity: u32,
    fixed: bool,
    slack_eighths: u32,
    /// Whether what is needed depends on the order in which the device runs threads.
    varies: bool,
}

impl Demand {
    /// Of a list whose two words begin its counter's buffer, which is recorded again where its need is more, and whose need is steady.
    fn of(name: &'static str, resource: ResourceId, capacity: u32) -> Self {
        let (first_word, fixed, varies) = (0, false, false);
        Self { name, resource, first_word, capacity, fixed, slack_eighths: STEADY, varies }
    }

    /// The buffer that counts.
    pub fn resource(&self) -> ResourceId {
        self.resource
    }

    /// Reads the last frame's count.
    pub fn read(&self, executor: &Executor) -> Result<Counter, TechniqueError> {
        Ok(self.count(&executor.read_buffer(self.resource)?))
    }

    /// What a frame counted, from the bytes of [`Self::resource`] after it.
    pub fn count(&self, bytes: &[u8]) -> Counter {
        let word = |i: usize| {
            let i = self.first_word + i;
            bytes.get(4 * i..4 * i + 4).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        };
        self.counted(word(0), word(1))
    }

    /// The counter of two words from the device. What fits drops nothing: where something was dropped and the sum is still within the
    /// capacity, it has passed 2³² and begun anew.
    fn counted(&self, needed: u32, dropped: u32) -> Counter {
        let Self { name, capacity, fixed, .. } = *self;
        let has_wrapped = dropped > 0 && needed <= capacity;
        Counter { name, needed: if has_wrapped { u32::MAX } else { needed }, capacity, dropped, fixed }
    }
}

/// Capacities known from the frames before, and the counters that the frame being recorded has.
#[derive(Default)]
pub struct Capacities {
    known: Vec<(String, u32)>,
    demands: RefCell<Vec<Demand>>,
}

impl Capacities {
    /// Whether the frame has a list that can overflow.
    pub fn is_watched(&self) -> bool {
        !self.demands.borrow().is_empty()
    }

    /// Frames by which what a view needs is counted.
    pub fn counting_frames(&self) -> u32 {
        let unsteady = self.demands.borrow().iter().any(|demand| demand.slack_eighths == UNSTEADY);
        if unsteady { UNSTEADY_FRAMES } else { 1 }
    }

    /// The counters that the frame has.
    pub fn demands(&self) -> Vec<Demand> {
        self.demands.borrow().clone()
    }

    /// The same capacities for another recording of the same lists.
    pub fn again(&self) -> Self {
        let demands = self.demands.borrow();
        let free = demands.iter().filter(|demand| !demand.fixed);
        Self {
            known: free.map(|demand| (demand.name.to_owned(), demand.capacity)).collect(),
            demands: RefCell::default(),
        }
    }

    /// Whether what a frame counted would be scarce in this recording as well.
    pub fn lack(&self, counters: &[Counter]) -> bool {
        let demands = self.demands.borrow();
        let lacks = |counter: &Counter| {
            let demand = demands.iter().find(|demand| demand.name == counter.name);
            demand.is_some_and(|demand| demand.counted(counter.needed, 0).is_scarce())
        };
        counters.iter().any(lacks)
    }

    /// Capacities for another recording, with half as much again as a frame needed of what was scarce: a camera that goes on moving needs
    /// more.
    pub fn grown(&self, counters: &[Counter]) -> Self {
        let mut grown = self.again();
        for counter in counters.iter().filter(|counter| counter.is_scarce()) {
            let needed = u64::from(counter.needed);
            let room = u32::try_from(needed + needed / 2 + u64::from(SLACK / 8)).unwrap_or(u32::MAX);
            let known = grown.known.iter_mut().filter(|(name, _)| name == counter.name);
            known.for_each(|(_, capacity)| *capacity = room.max(*capacity));
        }
        grown
    }

    /// Capacities for another recording, or `None` where those of this one fit what was counted.
    pub fn next(&self, counters: &[Counter]) -> Option<Self> {
        let demands = self.demands.borrow();
        let demand = |c: &Counter| demands.iter().find(|d| d.name == c.name);
        // More than needed: the next frame may need a little more or less.
        let room = |c: &Counter| {
            let slack_eighths = u64::from(demand(c).map_or(STEADY, |d| d.slack_eighths));
            let more = u64::from(c.needed) * slack_eighths / 8 + u64::from(SLACK / 8);
            u32::try_from(u64::from(c.needed) + more).unwrap_or(u32::MAX)
        };
        // What varies by order must leave half of that room, or the next frame may fall short: eight triangles through a busy bucket fit
        // the first guess by chance.
        let least = |c: &Counter| match demand(c).is_some_and(|d| d.varies) {
            true => c.needed + (room(c) - c.needed) / 2,
            false => c.needed,
        };
        let fits = |c: &Counter| {
            c.fixed
                || least(c) <= c.capacity && (c.capacity - c.needed <= SLACK || c.capacity / 4 <= c.needed)
        };
        if counters.iter().all(fits) {
            return None;
        }
        let known = counters
            .iter()
            .map(|c| (c.name.to_owned(), if fits(c) { c.capacity } else { room(c) }))
            .collect();
        Some(Self { known, demands: RefCell::default() })
    }
}

impl Frame<'_> {
    /// The capacity that a list should have: what earlier frames needed, or `first_guess`.
    pub fn capacity(&self, name: &str, first_guess: u32) -> u32 {
        let known = self.capacities.known.iter().find(|(known, _)| known == name);
        known.map_or(first_guess, |(_, capacity)| *capacity)
    }

    /// Has a list's counter read after each frame: two words, elements asked for and what was dropped. Where `fixed` is
    /// false, a frame that asks for more than `capacity` is recorded again with room.
    pub fn watch(
        &self,
        graph: &mut Graph,
        name: &'static str,
        counter: &BufferHandle,
        capacity: u32,
        fixed: bool,
    ) {
        let demand = Demand { fixed, ..Demand::of(name, graph.keep(counter), capacity) };
        self.capacities.demands.borrow_mut().push(demand);
    }

    /// As [`Self::watch`], of a list whose need depends on the order in which the device runs threads, with a share of room beyond what
    /// was needed: [`STEADY`] or [`UNSTEADY`].
    pub fn watch_varying(
        &self,
        graph: &mut Graph,
        name: &'static str,
        counter: &BufferHandle,
        capacity: u32,
        slack_eighths: u32,
    ) {
        let of = Demand::of(name, graph.keep(counter), capacity);
        let demand = Demand { slack_eighths, varies: true, ..of };
        self.capacities.demands.borrow_mut().push(demand);
    }

    /// As [`Self::watch`] without a fixed bound, of several counters that stand in one buffer, two words each: one clear serves all, and
    /// on a GPU a clear costs as much for 8 bytes as for 8,000.
    pub fn watch_all(&self, graph: &mut Graph, counters: &BufferHandle, of: &[(&'static str, u32)]) {
        let resource = graph.keep(counters);
        let demand = |(i, (name, capacity)): (usize, &(&'static str, u32))| Demand {
            first_word: 2 * i,
            ..Demand::of(name, resource, *capacity)
        };
        self.capacities.demands.borrow_mut().extend(of.iter().enumerate().map(demand));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_graph::BufferRole;

    fn counter(needed: u32, capacity: u32, fixed: bool) -> Counter {
        Counter { name: "blocks", needed, capacity, dropped: 0, fixed }
    }

    #[test]
    fn what_overflows_gets_room_and_what_fits_stays() {
        let capacities = Capacities::default();
        assert!(capacities.next(&[counter(100, 100, false)]).is_none());
        assert!(capacities.next(&[counter(200, 100, true)]).is_none(), "a fixed bound stays");
        let next = capacities.next(&[counter(200_000, 100, false)]).expect("too small");
        assert!(next.known[0].1 >= 200_000);
        let next = capacities.next(&[counter(10, 1_000_000, false)]).expect("far too large");
        assert!((10..10_000).contains(&next.known[0].1));
        assert!(next.next(&[counter(10, next.known[0].1, false)]).is_none(), "settles");
    }

    /// The room that a count is given is kept by the next frame that counts the same, whatever its slack: else a view would be
    /// recorded as often as may be.
    #[test]
    fn what_was_given_room_settles() {
        for (slack_eighths, varies) in [(STEADY, false), (STEADY, true), (UNSTEADY, true)] {
            for needed in [0, 1, 5_000, 133_822, 1 << 24] {
                let demand = Demand { slack_eighths, varies, ..Demand::of("blocks", kept(), 0) };
                let first = Capacities { known: Vec::new(), demands: RefCell::new(vec![demand]) };
                let room = match first.next(&[counter(needed, needed.saturating_sub(1), false)]) {
                    Some(next) => next.known[0].1,
                    None => continue,
                };
                assert!(room >= needed);
                assert!(
                    first.next(&[counter(needed, room, false)]).is_none(),
                    "{needed}: {room} does not settle"
                );
            }
        }
    }

    /// A sum that has passed 2³² looks small, and would be taken for a list that fits.
    #[test]
    fn a_sum_that_has_begun_anew_is_no_list_that_fits() {
        let demand = |capacity, fixed| Demand { fixed, ..Demand::of("blocks", kept(), capacity) };
        let counted = demand(100, false).counted(90, 5);
        assert_eq!((counted.needed, counted.dropped), (u32::MAX, 5));
        let next = Capacities::default().next(&[counted]).expect("no room for all");
        assert_eq!(
            next.known[0].1,
            u32::MAX,
            "room that no device binds is asked for, and refused with its bytes"
        );
        assert_eq!(demand(100, true).counted(100, 1).needed, u32::MAX, "a fixed bound tells it as well");
        // The edge: what fits to the last element, and what is one more.
        assert_eq!(demand(100, false).counted(100, 0).needed, 100);
        assert_eq!(demand(100, false).counted(101, 1).needed, 101);
    }

    /// What varies has room for more than what was counted by chance, also where that fits.
    #[test]
    fn what_varies_has_room_for_more() {
        let demand = |varies| Demand { slack_eighths: UNSTEADY, varies, ..Demand::of("blocks", kept(), 16) };
        let of = |varies| Capacities { known: Vec::new(), demands: RefCell::new(vec![demand(varies)]) };
        assert!(of(false).next(&[counter(8, 16, false)]).is_none());
        let next = of(true).next(&[counter(8, 16, false)]).expect("room for more");
        assert_eq!(next.known[0].1, 8 + 8 + SLACK / 8);
    }

    /// A list grows before it falls short: where less than a sixteenth of its room is left. A bound that the user fixed never grows.
    #[test]
    fn what_is_nearly_full_grows_by_half() {
        assert!(!counter(1500, 1600, false).is_scarce() && !counter(1500, 1600, false).fell_short());
        assert!(counter(1501, 1600, false).is_scarce() && !counter(1501, 1600, false).fell_short());
        assert!(counter(1601, 1600, true).fell_short() && !counter(1601, 1600, true).is_scarce());
        let recorded = |capacity| Capacities {
            known: Vec::new(),
            demands: RefCell::new(vec![Demand::of("blocks", kept(), capacity)]),
        };
        let counters = [counter(1501, 1600, false)];
        assert_eq!(recorded(1600).grown(&counters).known[0].1, 1501 + 750 + SLACK / 8);
        assert_eq!(recorded(9000).grown(&counters).known[0].1, 9000, "what another frame has made is kept");
        assert!(recorded(1600).lack(&counters) && !recorded(1602).lack(&counters));
    }

    #[test]
    fn the_frame_that_needs_most_counts() {
        let frame = |needed| vec![counter(needed, 100, false), counter(7, 100, false)];
        let all = [30, 90, 50].into_iter().fold(Vec::new(), |most_of, needed| most(most_of, frame(needed)));
        assert_eq!(all, frame(90));
    }

    /// A resource for a demand that is not read.
    fn kept() -> ResourceId {
        let mut graph = Graph::new();
        let buffer = graph.buffer("count", BufferRole::Counters, 8);
        graph.keep(&buffer)
    }
}
