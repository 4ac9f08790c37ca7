//! What is made on another thread while frames go on: plans that a program will need soon.

use std::{
    panic::resume_unwind,
    thread::{Builder, JoinHandle},
};

use afterlight_frame::TechniqueError;

/// Something that is made on a thread of its own. Dropped before it was taken, it waits for the thread, so that nothing of the device outlives
/// what its owner believes to be gone.
pub struct Ahead<T> {
    /// `None` only once taken or dropped.
    thread: Option<JoinHandle<Result<T, TechniqueError>>>,
}

impl<T: Send + 'static> Ahead<T> {
    pub(crate) fn begin(
        make: impl FnOnce() -> Result<T, TechniqueError> + Send + 'static,
    ) -> Result<Self, TechniqueError> {
        let thread = Builder::new().name("afterlight plan".to_owned()).spawn(make);
        Ok(Self { thread: Some(thread.map_err(TechniqueError::NoThread)?) })
    }
}

impl<T> Ahead<T> {
    /// Whether [`Self::take`] would return at once.
    pub fn is_ready(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// What was made; waits for it where it is not ready.
    ///
    /// # Errors
    /// Those of making it.
    pub fn take(mut self) -> Result<T, TechniqueError> {
        let thread = self.thread.take().expect("a thread until it is taken");
        thread.join().unwrap_or_else(|panic| resume_unwind(panic))
    }
}

impl<T> Drop for Ahead<T> {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            // What nobody takes has no error or panic to tell.
            let _ = thread.join();
        }
    }
}
