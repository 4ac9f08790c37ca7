//! One module a command.

pub mod bench;
pub mod compare;
pub mod completions;
pub mod devices;
pub mod play;
pub mod render;
pub mod scene;
pub mod techniques;
pub mod verify;

use afterlight_lab::{Listener, Session};

/// Tells what was tolerated in the scene.
fn tell_warnings(session: &Session, listener: &dyn Listener) {
    /// Warnings told in full; `afterlight scene` tells all.
    const TOLD_MAX: usize = 5;
    for warning in session.warnings.iter().take(TOLD_MAX) {
        listener.warn(warning);
    }
    if session.warnings.len() > TOLD_MAX {
        listener.warn(&format!("{} more, see `afterlight scene`", session.warnings.len() - TOLD_MAX));
    }
}
