//! Panics of libraries as plain results: a damaged file must not end the program.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    static IS_QUIET: Cell<bool> = const { Cell::new(false) };
}

static HOOK: Once = Once::new();

/// What `reads` gives; `None` where it panics, without a message.
pub(crate) fn or_panics<T>(reads: impl FnOnce() -> T) -> Option<T> {
    HOOK.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_QUIET.get() {
                usual(info);
            }
        }));
    });
    IS_QUIET.set(true);
    let result = panic::catch_unwind(AssertUnwindSafe(reads));
    IS_QUIET.set(false);
    result.ok()
}

#[cfg(test)]
mod tests {
    use super::or_panics;

    #[test]
    fn prop_a_panic_is_no_result() {
        assert_eq!(or_panics(|| 3), Some(3));
        assert_eq!(or_panics(|| [1, 2][std::hint::black_box(7)]), None);
        assert_eq!(or_panics(|| 4), Some(4));
    }
}
