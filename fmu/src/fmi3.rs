//! FMI 3.0.2: the functions of a unit for co-simulation.

#![allow(
    non_snake_case,
    clippy::missing_safety_doc,
    clippy::too_many_arguments,
    reason = "the names and arguments are the standard's, and so is what a tool has to see to"
)]

use crate::fmi2::not_offered;
use crate::instance::{ERROR, Instance, OK, Say, boxed};
use crate::pointers::{bring_back, free, keep, let_go, on, put, read, text, write};
use host_sim::fmu::Component;
use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::path::PathBuf;
use std::ptr;

type LogMessage = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _event_mode: bool,
    _early_return: bool,
    _intermediate: *const c_uint,
    _intermediate_count: usize,
    environment: *mut c_void,
    log: Option<LogMessage>,
    _update: *mut c_void,
) -> *mut Instance {
    // SAFETY: the tool hands over texts that are valid in this call.
    let (token, resources) = unsafe { (text(token), text(resources)) };
    let say: Say = Box::new(move |status, message: &CString| {
        if let Some(log) = log {
            // SAFETY: the tool's own function, with texts that outlive the call.
            unsafe { log(environment, status, c"error".as_ptr(), message.as_ptr()) };
        }
    });
    boxed(&PathBuf::from(resources.unwrap_or_default()), token, say)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange() -> *mut Instance {
    ptr::null_mut()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution() -> *mut Instance {
    ptr::null_mut()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: *mut Instance) {
    // SAFETY: the tool's instance, which it gives up.
    unsafe { free(instance) };
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetDebugLogging(
    _instance: *mut Instance,
    _logging: bool,
    _count: usize,
    _categories: *const *const c_char,
) -> c_int {
    // Errors are always said, and there is nothing else to say.
    OK
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: *mut Instance,
    _tolerance_defined: bool,
    _tolerance: f64,
    _start: f64,
    _stop_defined: bool,
    _stop: f64,
) -> c_int {
    // A unit counts ticks from its start, and a tick has no tolerance.
    // SAFETY: the tool's instance.
    unsafe { on(instance, Component::begin_initialisation) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3ExitInitializationMode(instance: *mut Instance) -> c_int {
    // SAFETY: the tool's instance.
    unsafe { on(instance, Component::end_initialisation) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Terminate(instance: *mut Instance) -> c_int {
    // SAFETY: the tool's instance.
    unsafe { on(instance, |_| Ok(())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3Reset(instance: *mut Instance) -> c_int {
    // SAFETY: the tool's instance.
    unsafe { on(instance, Component::reset) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    instance: *mut Instance,
    references: *const c_uint,
    count: usize,
    values: *mut f64,
    value_count: usize,
) -> c_int {
    // SAFETY: the tool's instance, and its arrays.
    unsafe {
        read(
            instance,
            (references, count),
            (values, value_count),
            |value| value,
        )
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetInt32(
    instance: *mut Instance,
    references: *const c_uint,
    count: usize,
    values: *mut i32,
    value_count: usize,
) -> c_int {
    // SAFETY: the tool's instance, and its arrays.
    unsafe {
        read(
            instance,
            (references, count),
            (values, value_count),
            |value| value as i32,
        )
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    instance: *mut Instance,
    references: *const c_uint,
    count: usize,
    values: *const f64,
    value_count: usize,
) -> c_int {
    // SAFETY: the tool's instance, and its arrays.
    unsafe { write(instance, (references, count), (values, value_count)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetInt32(
    instance: *mut Instance,
    references: *const c_uint,
    count: usize,
    values: *const i32,
    value_count: usize,
) -> c_int {
    // SAFETY: the tool's instance, and its arrays.
    unsafe { write(instance, (references, count), (values, value_count)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: *mut Instance,
    time: f64,
    step: f64,
    _no_way_back: bool,
    event_needed: *mut bool,
    terminate: *mut bool,
    early_return: *mut bool,
    last_time: *mut f64,
) -> c_int {
    // SAFETY: the tool's instance, and null or room for each value.
    unsafe {
        let status = on(instance, |unit| unit.step(step));
        put(event_needed, false);
        put(terminate, false);
        put(early_return, false);
        put(last_time, if status == OK { time + step } else { time });
        status
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterStepMode(instance: *mut Instance) -> c_int {
    // Without event mode the initialisation ends in step mode.
    // SAFETY: the tool's instance.
    unsafe { on(instance, |_| Ok(())) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(
    instance: *mut Instance,
    state: *mut *mut Component,
) -> c_int {
    // SAFETY: the tool's instance, and the place of a state.
    unsafe { keep(instance, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(
    instance: *mut Instance,
    state: *const Component,
) -> c_int {
    // SAFETY: the tool's instance and a state of it.
    unsafe { bring_back(instance, state) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(
    _instance: *mut Instance,
    state: *mut *mut Component,
) -> c_int {
    // SAFETY: null, or the place of a state that the tool gives up.
    unsafe { let_go(state) }
}

not_offered! {
    fmi3GetFloat32 fmi3GetInt8 fmi3GetUInt8 fmi3GetInt16 fmi3GetUInt16 fmi3GetUInt32 fmi3GetInt64
    fmi3GetUInt64 fmi3GetBoolean fmi3GetString fmi3GetBinary fmi3GetClock
    fmi3SetFloat32 fmi3SetInt8 fmi3SetUInt8 fmi3SetInt16 fmi3SetUInt16 fmi3SetUInt32 fmi3SetInt64
    fmi3SetUInt64 fmi3SetBoolean fmi3SetString fmi3SetBinary fmi3SetClock
    fmi3GetNumberOfVariableDependencies fmi3GetVariableDependencies
    fmi3SerializedFMUStateSize fmi3SerializeFMUState fmi3DeserializeFMUState
    fmi3GetDirectionalDerivative fmi3GetAdjointDerivative fmi3GetOutputDerivatives
    fmi3EnterConfigurationMode fmi3ExitConfigurationMode fmi3EnterEventMode
    fmi3GetIntervalDecimal fmi3GetIntervalFraction fmi3GetShiftDecimal fmi3GetShiftFraction
    fmi3SetIntervalDecimal fmi3SetIntervalFraction fmi3SetShiftDecimal fmi3SetShiftFraction
    fmi3EvaluateDiscreteStates fmi3UpdateDiscreteStates fmi3EnterContinuousTimeMode
    fmi3CompletedIntegratorStep fmi3SetTime fmi3SetContinuousStates
    fmi3GetContinuousStateDerivatives fmi3GetEventIndicators fmi3GetContinuousStates
    fmi3GetNominalsOfContinuousStates fmi3GetNumberOfEventIndicators
    fmi3GetNumberOfContinuousStates fmi3ActivateModelPartition
}
