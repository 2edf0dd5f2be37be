//! The functions of FMI 3.0.2, by its headers `fmi3FunctionTypes.h` and `fmi3PlatformTypes.h`.
#![expect(unsafe_code, reason = "a library of others is called")]

use crate::component::{Component, Free, Status, keep_message, text};
use crate::library::function;
use crate::{Stepped, UnitError};
use libloading::Library;
use std::ffi::{c_char, c_void};
use std::path::Path;
use std::ptr;

unsafe extern "C" fn log(
    environment: *mut c_void,
    _: Status,
    _: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment is the component's, the message a text of C.
    unsafe { keep_message(environment, message) };
}

type LogMessage = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    *const c_char,
    *const c_char,
    bool,
    bool,
    bool,
    bool,
    *const u32,
    usize,
    *mut c_void,
    LogMessage,
    Option<unsafe extern "C" fn()>,
) -> *mut c_void;
type Enter = unsafe extern "C" fn(*mut c_void, bool, f64, f64, bool, f64) -> Status;
type Plain = unsafe extern "C" fn(*mut c_void) -> Status;
type SetFloat64 = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const f64, usize) -> Status;
type GetFloat64 = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut f64, usize) -> Status;
type DoStep = unsafe extern "C" fn(
    *mut c_void,
    f64,
    f64,
    bool,
    *mut bool,
    *mut bool,
    *mut bool,
    *mut f64,
) -> Status;

/// One instance.
pub(crate) struct Instance {
    component: Component,
    enter: Enter,
    exit: Plain,
    set_float: SetFloat64,
    get_float: GetFloat64,
    do_step: DoStep,
    _library: Library,
}

impl Instance {
    pub(crate) fn new(library: Library, token: &str, resources: &Path) -> Result<Self, UnitError> {
        let (name, token) = (text("plant")?, text(token)?);
        // With the separator at its end, as the standard asks for.
        let resources = text(&format!("{}/", resources.display()))?;
        // SAFETY: the types are those of the header.
        let (instantiate, mut instance) = unsafe {
            let instantiate: Instantiate = function(&library, "fmi3InstantiateCoSimulation")?;
            let free_instance: Free = function(&library, "fmi3FreeInstance")?;
            let instance = Self {
                component: Component::freed_by(free_instance),
                enter: function(&library, "fmi3EnterInitializationMode")?,
                exit: function(&library, "fmi3ExitInitializationMode")?,
                set_float: function(&library, "fmi3SetFloat64")?,
                get_float: function(&library, "fmi3GetFloat64")?,
                do_step: function(&library, "fmi3DoStep")?,
                _library: library,
            };
            (instantiate, instance)
        };
        // SAFETY: the texts outlive the call, the log also the component; no variables are
        // asked for in between, and no function is given for them.
        let made = unsafe {
            instantiate(
                name.as_ptr(),
                token.as_ptr(),
                resources.as_ptr(),
                false,
                false,
                false,
                false,
                ptr::null(),
                0,
                instance.component.environment(),
                log,
                None,
            )
        };
        instance
            .component
            .take("fmi3InstantiateCoSimulation", made)?;
        Ok(instance)
    }
}

impl Stepped for Instance {
    fn initialise(&mut self) -> Result<(), UnitError> {
        let (component, one) = (&self.component, self.component.pointer());
        // SAFETY: the component is one of this library.
        let status = unsafe { (self.enter)(one, false, 0.0, 0.0, false, 0.0) };
        component.judged("fmi3EnterInitializationMode", status)?;
        // SAFETY: as above.
        let status = unsafe { (self.exit)(one) };
        component.judged("fmi3ExitInitializationMode", status)
    }

    fn set(&mut self, reference: u32, value: f64) -> Result<(), UnitError> {
        let (which, value) = (&raw const reference, &raw const value);
        // SAFETY: one reference and one number, as the counts say.
        let status = unsafe { (self.set_float)(self.component.pointer(), which, 1, value, 1) };
        self.component.judged("fmi3SetFloat64", status)
    }

    fn get(&mut self, reference: u32) -> Result<f64, UnitError> {
        let mut value = f64::NAN;
        let (which, place) = (&raw const reference, &raw mut value);
        // SAFETY: one reference and room for one number, as the counts say.
        let status = unsafe { (self.get_float)(self.component.pointer(), which, 1, place, 1) };
        self.component.judged("fmi3GetFloat64", status)?;
        Ok(value)
    }

    fn step(&mut self, time_s: f64, step_s: f64) -> Result<(), UnitError> {
        let (mut has_event, mut is_over, mut is_early) = (false, false, false);
        let mut reached_s = time_s;
        // SAFETY: the component is one of this library, and there is room for what it answers.
        let status = unsafe {
            (self.do_step)(
                self.component.pointer(),
                time_s,
                step_s,
                true,
                &raw mut has_event,
                &raw mut is_over,
                &raw mut is_early,
                &raw mut reached_s,
            )
        };
        self.component.judged("fmi3DoStep", status)?;
        if is_over || is_early {
            return Err(self
                .component
                .refused("fmi3DoStep", "an end before its time"));
        }
        Ok(())
    }
}
