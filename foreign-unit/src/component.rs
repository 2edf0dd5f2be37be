//! An instance of a unit, whatever its standard: its pointer, its log, its end.
#![expect(unsafe_code, reason = "a library of others is called")]

use crate::UnitError;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr;
use std::sync::Mutex;

/// A status of either standard.
pub(crate) type Status = c_int;

/// From this status on nothing more can be asked: 0 is *ok*, 1 a warning.
const WORST_USABLE: Status = 1;

/// The type of `fmi2FreeInstance` and `fmi3FreeInstance`.
pub(crate) type Free = unsafe extern "C" fn(*mut c_void);

/// The last message of a unit.
#[derive(Default)]
struct Log(Mutex<String>);

/// What a library made: freed by it in the end. Dropped before the library.
pub(crate) struct Component {
    pointer: *mut c_void,
    free: Free,
    log: Box<Log>,
}

impl Component {
    /// Nothing made yet, to be freed by this function.
    pub(crate) fn freed_by(free: Free) -> Self {
        Self {
            pointer: ptr::null_mut(),
            free,
            log: Box::default(),
        }
    }

    /// What the library's messages are to bring with them: [`keep_message`] finds the log by it.
    pub(crate) fn environment(&self) -> *mut c_void {
        ptr::from_ref(&*self.log).cast_mut().cast()
    }

    /// Takes what the function that makes an instance gave.
    pub(crate) fn take(
        &mut self,
        function: &'static str,
        pointer: *mut c_void,
    ) -> Result<(), UnitError> {
        self.pointer = pointer;
        if pointer.is_null() {
            return Err(self.refused(function, "no instance"));
        }
        Ok(())
    }

    /// The instance.
    pub(crate) fn pointer(&self) -> *mut c_void {
        self.pointer
    }

    /// Whether a function succeeded.
    pub(crate) fn judged(&self, function: &'static str, status: Status) -> Result<(), UnitError> {
        let word = match status {
            0..=WORST_USABLE => return Ok(()),
            2 => "discard",
            3 => "error",
            4 => "fatal",
            _ => "pending",
        };
        Err(self.refused(function, word))
    }

    /// A function did not do what it is for.
    pub(crate) fn refused(&self, function: &'static str, status: &'static str) -> UnitError {
        let log = self.log.0.lock();
        UnitError::Refused {
            function,
            status,
            log: log.map(|last| last.clone()).unwrap_or_default(),
        }
    }
}

impl Drop for Component {
    fn drop(&mut self) {
        if !self.pointer.is_null() {
            // SAFETY: the library made it, which still is loaded, and nothing uses it again.
            unsafe { (self.free)(self.pointer) };
        }
    }
}

/// Keeps a message in the log that `environment` points to.
///
/// # Safety
/// `environment` must be null or that of a [`Component`], `message` null or a text of C.
pub(crate) unsafe fn keep_message(environment: *mut c_void, message: *const c_char) {
    if environment.is_null() || message.is_null() {
        return;
    }
    // SAFETY: as the caller answers for.
    let (log, message) = unsafe { (&*environment.cast::<Log>(), CStr::from_ptr(message)) };
    if let Ok(mut last) = log.0.lock() {
        *last = message.to_string_lossy().trim().to_owned();
    }
}

/// A text for a function of C.
pub(crate) fn text(text: &str) -> Result<CString, UnitError> {
    CString::new(text).map_err(|_| UnitError::Description("a text holds a NUL".into()))
}
