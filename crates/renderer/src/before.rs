//! What the frames before showed, for the frames after them.

use std::sync::Arc;

use afterlight_frame::ViewBefore;

/// What frames showed, in memory that is used again once no frame on its way needs it: a frame takes none of its own.
#[derive(Default)]
pub(crate) struct Befores {
    all: Vec<Arc<ViewBefore>>,
    /// The last of them, by its place.
    last: Option<usize>,
}

impl Befores {
    /// What the last frame showed; `None` before the first one.
    pub fn last(&self) -> Option<Arc<ViewBefore>> {
        self.last.map(|place| Arc::clone(&self.all[place]))
    }

    /// Writes what a frame shows, which is the last one then.
    pub fn write(&mut self, write: impl FnOnce(&mut ViewBefore)) {
        let unused = self.all.iter_mut().position(|one| Arc::get_mut(one).is_some());
        let place = unused.unwrap_or_else(|| {
            self.all.push(Arc::default());
            self.all.len() - 1
        });
        if let Some(one) = Arc::get_mut(&mut self.all[place]) {
            write(one);
        }
        self.last = Some(place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_used_again_when_no_frame_holds_it() {
        let mut befores = Befores::default();
        assert!(befores.last().is_none());
        let mut held = Vec::new();
        for number in 1..20 {
            befores.write(|one| one.clip_from_world.x_axis.x = number as f32);
            held.push(befores.last().expect("the last one"));
            if held.len() > 3 {
                held.remove(0);
            }
            let numbers: Vec<f32> = held.iter().map(|one| one.clip_from_world.x_axis.x).collect();
            let expected: Vec<f32> = (1..number + 1).rev().take(held.len()).map(|n| n as f32).rev().collect();
            assert_eq!(numbers, expected, "what a frame holds has changed");
        }
        assert!(befores.all.len() <= 4, "{}", befores.all.len());
    }
}
