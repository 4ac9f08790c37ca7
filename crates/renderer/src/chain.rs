//! Which frame wrote the history that a frame finds.

use afterlight_graph::Turn;

/// Frames of a plan one after another, by what they wrote of resources with history.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Chain {
    last: Option<Link>,
}

/// A frame's place among those that were submitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Link {
    /// Number of the frame in the order in which frames were sent.
    sent: u64,
    /// Its turn.
    pub turn: Turn,
    /// The frame whose history it finds.
    before: Option<u64>,
}

impl Link {
    /// Whether it finds what the frame that was sent before it wrote.
    pub fn has_history(&self) -> bool {
        self.sent.checked_sub(1).is_some_and(|before| self.before == Some(before))
    }
}

impl Chain {
    /// The place of frame number `sent`, if it is submitted next. A frame that is drawn again takes the place that it had; where later
    /// frames were submitted since, it finds what they wrote.
    pub fn link(&self, sent: u64) -> Link {
        match self.last {
            None => Link { sent, turn: Turn::default(), before: None },
            Some(last) if last.sent == sent => last,
            Some(last) => Link { sent, turn: last.turn.other(), before: Some(last.sent) },
        }
    }

    /// The frame was submitted.
    pub fn append(&mut self, link: Link) {
        self.last = Some(link);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns and whether there is history, of frames in the order of their submission.
    fn submitted(frames: &[u64]) -> Vec<(Turn, bool)> {
        let mut chain = Chain::default();
        let submit = |sent: &u64| {
            let link = chain.link(*sent);
            chain.append(link);
            (link.turn, link.has_history())
        };
        frames.iter().map(submit).collect()
    }

    #[test]
    fn frames_take_turns() {
        use Turn::{Even, Odd};
        assert_eq!(submitted(&[0, 1, 2]), [(Even, false), (Odd, true), (Even, true)]);
        assert_eq!(submitted(&[5, 6]), [(Even, false), (Odd, true)], "the first of a plan finds none");
    }

    #[test]
    fn a_frame_that_is_drawn_again_keeps_its_turn() {
        use Turn::{Even, Odd};
        let again = [(Even, false), (Odd, true), (Odd, true), (Even, true)];
        assert_eq!(submitted(&[0, 1, 1, 2]), again);
        let late = submitted(&[0, 1, 2, 1, 3, 4]);
        assert_eq!(late[3..], [(Odd, false), (Even, false), (Odd, true)], "frame 2 has overwritten it");
    }
}
