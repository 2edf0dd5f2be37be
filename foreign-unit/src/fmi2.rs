//! The functions of FMI 2.0.5, by its headers `fmi2FunctionTypes.h` and `fmi2TypesPlatform.h`.
#![expect(unsafe_code, reason = "a library of others is called")]

use crate::library::function;
use crate::{Stepped, UnitError, status_word};
use libloading::Library;
use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::path::Path;
use std::ptr;
use std::sync::Mutex;

type Component = *mut c_void;
type Status = c_int;

const CO_SIMULATION: c_int = 1;
const FALSE: c_int = 0;
/// From this status on nothing more can be asked.
const WORST_USABLE: Status = 1;

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
    // SAFETY: the environment is the box that the instance holds, the message a text of C.
    unsafe { keep_message(environment, message) };
}

/// Keeps a message in the box that `environment` points to.
///
/// # Safety
/// `environment` must be null or point to the [`Log`] of an instance, `message` to a text of C.
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

/// The last message of a unit.
#[derive(Default)]
pub(crate) struct Log(pub(crate) Mutex<String>);

impl Log {
    pub(crate) fn last(&self) -> String {
        self.0.lock().map(|last| last.clone()).unwrap_or_default()
    }
}

type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const Callbacks,
    c_int,
    c_int,
) -> Component;
type SetupExperiment = unsafe extern "C" fn(Component, c_int, f64, f64, c_int, f64) -> Status;
type Plain = unsafe extern "C" fn(Component) -> Status;
type SetReal = unsafe extern "C" fn(Component, *const c_uint, usize, *const f64) -> Status;
type GetReal = unsafe extern "C" fn(Component, *const c_uint, usize, *mut f64) -> Status;
type DoStep = unsafe extern "C" fn(Component, f64, f64, c_int) -> Status;
type Free = unsafe extern "C" fn(Component);

/// One instance.
pub(crate) struct Instance {
    component: Component,
    setup: SetupExperiment,
    enter: Plain,
    exit: Plain,
    set_real: SetReal,
    get_real: GetReal,
    do_step: DoStep,
    free_instance: Free,
    log: Box<Log>,
    // The unit may keep pointers to both.
    _callbacks: Box<Callbacks>,
    _library: Library,
}

impl Instance {
    pub(crate) fn new(library: Library, token: &str, resources: &Path) -> Result<Self, UnitError> {
        let log_box = Box::<Log>::default();
        let callbacks = Box::new(Callbacks {
            logger: log,
            allocate: calloc,
            free,
            step_finished: None,
            environment: ptr::from_ref(&*log_box).cast_mut().cast(),
        });
        let text = |text: String| {
            CString::new(text).map_err(|_| UnitError::Description("a text holds a NUL".into()))
        };
        let (name, token) = (text("plant".into())?, text(token.into())?);
        let resources = text(format!("file://{}", resources.display()))?;
        // SAFETY: the types are those of the header.
        let (instantiate, mut instance) = unsafe {
            let instantiate: Instantiate = function(&library, "fmi2Instantiate")?;
            let instance = Self {
                component: ptr::null_mut(),
                setup: function(&library, "fmi2SetupExperiment")?,
                enter: function(&library, "fmi2EnterInitializationMode")?,
                exit: function(&library, "fmi2ExitInitializationMode")?,
                set_real: function(&library, "fmi2SetReal")?,
                get_real: function(&library, "fmi2GetReal")?,
                do_step: function(&library, "fmi2DoStep")?,
                free_instance: function(&library, "fmi2FreeInstance")?,
                log: log_box,
                _callbacks: callbacks,
                _library: library,
            };
            (instantiate, instance)
        };
        // SAFETY: texts and callbacks outlive the call, the callbacks also the component.
        instance.component = unsafe {
            instantiate(
                name.as_ptr(),
                CO_SIMULATION,
                token.as_ptr(),
                resources.as_ptr(),
                &raw const *instance._callbacks,
                FALSE,
                FALSE,
            )
        };
        if instance.component.is_null() {
            return Err(instance.refused("fmi2Instantiate", 3));
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
        let status = unsafe { (self.setup)(self.component, FALSE, 0.0, 0.0, FALSE, 0.0) };
        self.judged("fmi2SetupExperiment", status)?;
        // SAFETY: as above.
        let status = unsafe { (self.enter)(self.component) };
        self.judged("fmi2EnterInitializationMode", status)?;
        // SAFETY: as above.
        let status = unsafe { (self.exit)(self.component) };
        self.judged("fmi2ExitInitializationMode", status)
    }

    fn set(&mut self, reference: u32, value: f64) -> Result<(), UnitError> {
        // SAFETY: one reference and one number, as the count says.
        let status =
            unsafe { (self.set_real)(self.component, &raw const reference, 1, &raw const value) };
        self.judged("fmi2SetReal", status)
    }

    fn get(&mut self, reference: u32) -> Result<f64, UnitError> {
        let mut value = f64::NAN;
        // SAFETY: one reference and room for one number, as the count says.
        let status =
            unsafe { (self.get_real)(self.component, &raw const reference, 1, &raw mut value) };
        self.judged("fmi2GetReal", status)?;
        Ok(value)
    }

    fn step(&mut self, time_s: f64, step_s: f64) -> Result<(), UnitError> {
        // SAFETY: the component is one of this library.
        let status = unsafe { (self.do_step)(self.component, time_s, step_s, 1) };
        self.judged("fmi2DoStep", status)
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
