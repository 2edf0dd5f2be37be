//! The functions of FMI 3.0.2, by its headers `fmi3FunctionTypes.h` and `fmi3PlatformTypes.h`.
#![expect(unsafe_code, reason = "a library of others is called")]

use crate::fmi2::{Log, keep_message};
use crate::library::function;
use crate::{Stepped, UnitError, status_word};
use libloading::Library;
use std::ffi::{CString, c_char, c_int, c_void};
use std::path::Path;
use std::ptr;

type Component = *mut c_void;
type Status = c_int;

const WORST_USABLE: Status = 1;

unsafe extern "C" fn log(
    environment: *mut c_void,
    _: Status,
    _: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment is the box that the instance holds, the message a text of C.
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
) -> Component;
type Enter = unsafe extern "C" fn(Component, bool, f64, f64, bool, f64) -> Status;
type Plain = unsafe extern "C" fn(Component) -> Status;
type SetFloat64 = unsafe extern "C" fn(Component, *const u32, usize, *const f64, usize) -> Status;
type GetFloat64 = unsafe extern "C" fn(Component, *const u32, usize, *mut f64, usize) -> Status;
type DoStep = unsafe extern "C" fn(
    Component,
    f64,
    f64,
    bool,
    *mut bool,
    *mut bool,
    *mut bool,
    *mut f64,
) -> Status;
type Free = unsafe extern "C" fn(Component);

/// One instance.
pub(crate) struct Instance {
    component: Component,
    enter: Enter,
    exit: Plain,
    set_float: SetFloat64,
    get_float: GetFloat64,
    do_step: DoStep,
    free_instance: Free,
    log: Box<Log>,
    _library: Library,
}

impl Instance {
    pub(crate) fn new(library: Library, token: &str, resources: &Path) -> Result<Self, UnitError> {
        let text = |text: String| {
            CString::new(text).map_err(|_| UnitError::Description("a text holds a NUL".into()))
        };
        let (name, token) = (text("plant".into())?, text(token.into())?);
        // With the separator at its end, as the standard asks for.
        let resources = text(format!("{}/", resources.display()))?;
        // SAFETY: the types are those of the header.
        let (instantiate, mut instance) = unsafe {
            let instantiate: Instantiate = function(&library, "fmi3InstantiateCoSimulation")?;
            let instance = Self {
                component: ptr::null_mut(),
                enter: function(&library, "fmi3EnterInitializationMode")?,
                exit: function(&library, "fmi3ExitInitializationMode")?,
                set_float: function(&library, "fmi3SetFloat64")?,
                get_float: function(&library, "fmi3GetFloat64")?,
                do_step: function(&library, "fmi3DoStep")?,
                free_instance: function(&library, "fmi3FreeInstance")?,
                log: Box::default(),
                _library: library,
            };
            (instantiate, instance)
        };
        let environment = ptr::from_ref(&*instance.log).cast_mut().cast();
        // SAFETY: the texts outlive the call, the log also the component; no variables are
        // asked for in between, and no function is given for them.
        instance.component = unsafe {
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
                environment,
                log,
                None,
            )
        };
        if instance.component.is_null() {
            return Err(instance.refused("fmi3InstantiateCoSimulation", 3));
        }
        Ok(instance)
    }

    fn refused(&self, function: &'static str, status: Status) -> UnitError {
        UnitError::Refused {
            function,
            status: status_word(status),
            log: self.log.last(),
        }
    }

    fn judged(&self, function: &'static str, status: Status) -> Result<(), UnitError> {
        if (0..=WORST_USABLE).contains(&status) {
            Ok(())
        } else {
            Err(self.refused(function, status))
        }
    }
}

impl Stepped for Instance {
    fn initialise(&mut self) -> Result<(), UnitError> {
        // SAFETY: the component is one of this library.
        let status = unsafe { (self.enter)(self.component, false, 0.0, 0.0, false, 0.0) };
        self.judged("fmi3EnterInitializationMode", status)?;
        // SAFETY: as above.
        let status = unsafe { (self.exit)(self.component) };
        self.judged("fmi3ExitInitializationMode", status)
    }

    fn set(&mut self, reference: u32, value: f64) -> Result<(), UnitError> {
        let (reference, value) = (&raw const reference, &raw const value);
        // SAFETY: one reference and one number, as the counts say.
        let status = unsafe { (self.set_float)(self.component, reference, 1, value, 1) };
        self.judged("fmi3SetFloat64", status)
    }

    fn get(&mut self, reference: u32) -> Result<f64, UnitError> {
        let mut value = f64::NAN;
        let (reference, place) = (&raw const reference, &raw mut value);
        // SAFETY: one reference and room for one number, as the counts say.
        let status = unsafe { (self.get_float)(self.component, reference, 1, place, 1) };
        self.judged("fmi3GetFloat64", status)?;
        Ok(value)
    }

    fn step(&mut self, time_s: f64, step_s: f64) -> Result<(), UnitError> {
        let (mut has_event, mut is_over, mut is_early) = (false, false, false);
        let mut reached_s = time_s;
        // SAFETY: the component is one of this library, and there is room for what it answers.
        let status = unsafe {
            (self.do_step)(
                self.component,
                time_s,
                step_s,
                true,
                &raw mut has_event,
                &raw mut is_over,
                &raw mut is_early,
                &raw mut reached_s,
            )
        };
        self.judged("fmi3DoStep", status)?;
        if is_over || is_early {
            return Err(self.refused("fmi3DoStep", 2));
        }
        Ok(())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if !self.component.is_null() {
            // SAFETY: the component is one of this library, and is not used again.
            unsafe { (self.free_instance)(self.component) };
        }
    }
}
