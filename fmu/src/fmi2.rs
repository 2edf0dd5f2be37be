//! FMI 2.0.5: the functions of a unit for co-simulation.

#![allow(
    non_snake_case,
    clippy::missing_safety_doc,
    reason = "the names are the standard's, and so is what a tool has to see to"
)]

use crate::instance::{ERROR, Instance, OK, Say, boxed, folder_of_address, tell};
use crate::pointers::{bring_back, free, keep, let_go, on, put, read, text, write};
use host_sim::fmu::Component;
use std::ffi::{CString, c_char, c_double, c_int, c_uint, c_void};
use std::ptr;

type Logger =
    unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);

/// `fmi2CallbackFunctions`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Callbacks {
    logger: Option<Logger>,
    allocate: *mut c_void,
    free: *mut c_void,
    step_finished: *mut c_void,
    environment: *mut c_void,
}

const CO_SIMULATION: c_int = 1;

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resources: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    _logging: c_int,
) -> *mut Instance {
    // SAFETY: the tool hands over texts and callbacks that are valid in this call.
    let (name, guid, address) = unsafe { (text(name), text(guid), text(resources)) };
    // SAFETY: as above; null is none.
    let callbacks = unsafe { callbacks.as_ref() }.copied();
    let name = CString::new(name.unwrap_or("unit")).unwrap_or_default();
    let say: Say = Box::new(move |status, message| {
        let Some((logger, environment)) =
            callbacks.and_then(|own| Some((own.logger?, own.environment)))
        else {
            return;
        };
        // The message is a format for the tool.
        let safe = message.to_string_lossy().replace('%', "%%");
        let safe = CString::new(safe).unwrap_or_default();
        // SAFETY: the tool's own function, with texts that outlive the call and no place to fill.
        unsafe {
            logger(
                environment,
                name.as_ptr(),
                status,
                c"error".as_ptr(),
                safe.as_ptr(),
            )
        };
    });
    let folder = address.and_then(folder_of_address);
    match folder.filter(|_| kind == CO_SIMULATION) {
        Some(folder) => boxed(&folder, guid, say),
        None => {
            let expected = "expected co-simulation and a file: address of the resources";
            tell(&say, ERROR, expected);
            ptr::null_mut()
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(instance: *mut Instance) {
    // SAFETY: the tool's instance, which it gives up.
    unsafe { free(instance) };
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    _instance: *mut Instance,
    _logging: c_int,
    _count: usize,
    _categories: *const *const c_char,
) -> c_int {
    // Errors are always said, and there is nothing else to say.
    OK
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    _instance: *mut Instance,
    _tolerance_defined: c_int,
    _tolerance: c_double,
    _start: c_double,
    _stop_defined: c_int,
    _stop: c_double,
) -> c_int {
    // A unit counts ticks from its start, and a tick has no tolerance.
    OK
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(instance: *mut Instance) -> c_int {
    // SAFETY: the tool's instance.
    unsafe { on(instance, Component::begin_initialisation) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(instance: *mut Instance) -> c_int {
    // SAFETY: the tool's instance.
    unsafe { on(instance, Component::end_initialisation) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(instance: *mut Instance) -> c_int {
    // SAFETY: the tool's instance.
    unsafe { on(instance, |_| Ok(())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(instance: *mut Instance) -> c_int {
    // SAFETY: the tool's instance.
    unsafe { on(instance, Component::reset) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(
    instance: *mut Instance,
    references: *const c_uint,
    count: usize,
    values: *mut c_double,
) -> c_int {
    // SAFETY: the tool's instance, and its arrays.
    unsafe {
        read(instance, (references, count), (values, count), |value| {
            value
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(
    instance: *mut Instance,
    references: *const c_uint,
    count: usize,
    values: *mut c_int,
) -> c_int {
    // SAFETY: the tool's instance, and its arrays.
    unsafe {
        read(instance, (references, count), (values, count), |value| {
            value as c_int
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(
    instance: *mut Instance,
    references: *const c_uint,
    count: usize,
    values: *const c_double,
) -> c_int {
    // SAFETY: the tool's instance, and its arrays.
    unsafe { write(instance, (references, count), (values, count)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetInteger(
    instance: *mut Instance,
    references: *const c_uint,
    count: usize,
    values: *const c_int,
) -> c_int {
    // SAFETY: the tool's instance, and its arrays.
    unsafe { write(instance, (references, count), (values, count)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(
    instance: *mut Instance,
    _time: c_double,
    step: c_double,
    _no_way_back: c_int,
) -> c_int {
    // SAFETY: the tool's instance.
    unsafe { on(instance, |unit| unit.step(step)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(
    instance: *mut Instance,
    state: *mut *mut Component,
) -> c_int {
    // SAFETY: the tool's instance, and room for a pointer.
    unsafe { keep(instance, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(
    instance: *mut Instance,
    state: *const Component,
) -> c_int {
    // SAFETY: the tool's instance and a state of it.
    unsafe { bring_back(instance, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(
    _instance: *mut Instance,
    state: *mut *mut Component,
) -> c_int {
    // SAFETY: null, or the place of a state that the tool gives up.
    unsafe { let_go(state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(
    _instance: *mut Instance,
    _kind: c_int,
    value: *mut c_int,
) -> c_int {
    // Nothing is pending, and the unit never asks to end.
    // SAFETY: null, or room for a value.
    unsafe { put(value, 0) };
    OK
}

/// Functions for what the description does not offer; in C whoever calls clears the arguments.
macro_rules! not_offered {
    ($($name:ident)*) => {
        $(
            #[unsafe(no_mangle)]
            pub extern "C" fn $name() -> c_int {
                ERROR
            }
        )*
    };
}
pub(crate) use not_offered;

not_offered! {
    fmi2GetBoolean fmi2GetString fmi2SetBoolean fmi2SetString
    fmi2SerializedFMUstateSize fmi2SerializeFMUstate fmi2DeSerializeFMUstate
    fmi2GetDirectionalDerivative fmi2SetRealInputDerivatives fmi2GetRealOutputDerivatives
    fmi2CancelStep fmi2GetStatus fmi2GetRealStatus fmi2GetIntegerStatus fmi2GetStringStatus
}
