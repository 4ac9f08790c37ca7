//! Who hears of a laboratory's work while it goes on. The libraries print nothing themselves.

/// Hears what work tells while it goes on.
pub trait Listener: Sync {
    /// A task begins, of so many steps; of an unknown number where `steps` is 0. It ends when what is returned is dropped.
    fn task(&self, label: &str, steps: u64) -> Box<dyn Task>;

    /// Something for people to read: tables, verdicts, with line ends.
    fn tell(&self, text: &str);

    /// Something is not as it was asked for, yet the work goes on; one line.
    fn warn(&self, warning: &str);

    /// Whether pictures are drawn for a report, which takes time and memory.
    fn wants_pictures(&self) -> bool {
        false
    }
}

/// A task while it goes on.
pub trait Task: Sync {
    /// One step more is done.
    fn advance(&self);

    /// So many of so many steps are done.
    fn place(&self, done: u64, steps: u64);

    /// What the task is at.
    fn at(&self, what: &str);
}

/// Hears nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Listener for Silent {
    fn task(&self, _: &str, _: u64) -> Box<dyn Task> {
        Box::new(Silent)
    }

    fn tell(&self, _: &str) {}

    fn warn(&self, _: &str) {}
}

impl Task for Silent {
    fn advance(&self) {}

    fn place(&self, _: u64, _: u64) {}

    fn at(&self, _: &str) {}
}
