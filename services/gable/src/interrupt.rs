//! Ctrl-C: the first asks the run to stop where it can go on later, the second ends the program at once.

use crate::terminal;
use std::sync::atomic::{AtomicU32, Ordering};

static PRESSED: AtomicU32 = AtomicU32::new(0);

/// Starts to listen for interrupts.
pub(crate) fn listen() {
    let handler = || {
        if PRESSED.fetch_add(1, Ordering::SeqCst) == 0 {
            terminal::stderr_line("stopping: what is under way is being finished; press Ctrl-C again to stop at once");
        } else {
            std::process::exit(130);
        }
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        tracing::warn!("Ctrl-C ends the program at once, because its handler cannot be set: {error}");
    }
}

/// Whether the user wants to stop.
pub(crate) fn requested() -> bool {
    PRESSED.load(Ordering::SeqCst) > 0
}
