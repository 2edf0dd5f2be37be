//! The functions of FMI 2.0.5, by its headers `fmi2FunctionTypes.h` and `fmi2TypesPlatform.h`.
#![expect(unsafe_code, reason = "a library of others is called")]

use crate::component::{Component, Free, Status, keep_message, text};
use crate::library::function;
use crate::{Stepped, UnitError};
use libloading::Library;
use std::ffi::{c_char, c_int, c_uint, c_void};
use std::path::Path;

const CO_SIMULATION: c_int = 1;
const FALSE: c_int = 0;

/// `fmi2CallbackFunctions`.
#[repr(C)]
struct Callbacks {
    logger: unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char),
    allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    environment: *mut c_void,
}

unsafe extern "C" {
    fn calloc(count: usize, bytes: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

/// Keeps the last message. The header's function takes more arguments behind these, as `printf`
/// does; they are the caller's to clear away, and the message is kept with its `%`.
unsafe extern "C" fn log(
    environment: *mut c_void,
    _: *const c_char,
    _: Status,
    _: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment is the component's, the message a text of C.
    unsafe { keep_message(environment, message) };
}

type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const Callbacks,
    c_int,
    c_int,
) -> *mut c_void;
type SetupExperiment = unsafe extern "C" fn(*mut c_void, c_int, f64, f64, c_int, f64) -> Status;
type Plain = unsafe extern "C" fn(*mut c_void) -> Status;
type SetReal = unsafe extern "C" fn(*mut c_void, *const c_uint, usize, *const f64) -> Status;
type GetReal = unsafe extern "C" fn(*mut c_void, *const c_uint, usize, *mut f64) -> Status;
type DoStep = unsafe extern "C" fn(*mut c_void, f64, f64, c_int) -> Status;

/// One instance.
pub(crate) struct Instance {
    component: Component,
    setup: SetupExperiment,
    enter: Plain,
    exit: Plain,
    set_real: SetReal,
    get_real: GetReal,
    do_step: DoStep,
    // The unit may keep a pointer to them.
    callbacks: Box<Callbacks>,
    _library: Library,
}

impl Instance {
    pub(crate) fn new(library: Library, token: &str, resources: &Path) -> Result<Self, UnitError> {
        let (name, token) = (text("plant")?, text(token)?);
        let resources = text(&format!("file://{}", resources.display()))?;
        // SAFETY: the types are those of the header.
        let (instantiate, mut instance) = unsafe {
            let instantiate: Instantiate = function(&library, "fmi2Instantiate")?;
            let free_instance: Free = function(&library, "fmi2FreeInstance")?;
            let component = Component::freed_by(free_instance);
            let callbacks = Box::new(Callbacks {
                logger: log,
                allocate: calloc,
                free,
                step_finished: None,
                environment: component.environment(),
            });
            let instance = Self {
                component,
                setup: function(&library, "fmi2SetupExperiment")?,
                enter: function(&library, "fmi2EnterInitializationMode")?,
                exit: function(&library, "fmi2ExitInitializationMode")?,
                set_real: function(&library, "fmi2SetReal")?,
                get_real: function(&library, "fmi2GetReal")?,
                do_step: function(&library, "fmi2DoStep")?,
                callbacks,
                _library: library,
            };
            (instantiate, instance)
        };
        // SAFETY: texts and callbacks outlive the call, the callbacks also the component.
        let made = unsafe {
            instantiate(
                name.as_ptr(),
                CO_SIMULATION,
                token.as_ptr(),
                resources.as_ptr(),
                &raw const *instance.callbacks,
                FALSE,
                FALSE,
            )
        };
        instance.component.take("fmi2Instantiate", made)?;
        Ok(instance)
    }
}

impl Stepped for Instance {
    fn initialise(&mut self) -> Result<(), UnitError> {
        let (component, one) = (&self.component, self.component.pointer());
        // SAFETY: the component is one of this library.
        let status = unsafe { (self.setup)(one, FALSE, 0.0, 0.0, FALSE, 0.0) };
        component.judged("fmi2SetupExperiment", status)?;
        // SAFETY: as above.
        let status = unsafe { (self.enter)(one) };
        component.judged("fmi2EnterInitializationMode", status)?;
        // SAFETY: as above.
        let status = unsafe { (self.exit)(one) };
        component.judged("fmi2ExitInitializationMode", status)
    }

    fn set(&mut self, reference: u32, value: f64) -> Result<(), UnitError> {
        let (which, value) = (&raw const reference, &raw const value);
        // SAFETY: one reference and one number, as the count says.
        let status = unsafe { (self.set_real)(self.component.pointer(), which, 1, value) };
        self.component.judged("fmi2SetReal", status)
    }

    fn get(&mut self, reference: u32) -> Result<f64, UnitError> {
        let mut value = f64::NAN;
        let (which, place) = (&raw const reference, &raw mut value);
        // SAFETY: one reference and room for one number, as the count says.
        let status = unsafe { (self.get_real)(self.component.pointer(), which, 1, place) };
        self.component.judged("fmi2GetReal", status)?;
        Ok(value)
    }

    fn step(&mut self, time_s: f64, step_s: f64) -> Result<(), UnitError> {
        // SAFETY: the component is one of this library.
        let status = unsafe { (self.do_step)(self.component.pointer(), time_s, step_s, 1) };
        self.component.judged("fmi2DoStep", status)
    }
}
