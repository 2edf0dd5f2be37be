//! Ctrl-C as a wish that long work looks at.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::CommandError;
use super::inputs::bad_input;

/// Set by Ctrl-C.
pub(super) fn stop_wish() -> Result<Arc<AtomicBool>, CommandError> {
    let stopped = Arc::new(AtomicBool::new(false));
    let wish = Arc::clone(&stopped);
    match ctrlc::set_handler(move || wish.store(true, Ordering::Relaxed)) {
        Ok(()) | Err(ctrlc::Error::MultipleHandlers) => Ok(stopped),
        Err(error) => Err(bad_input(format!("Ctrl-C cannot be watched: {error}"))),
    }
}
