//! What a tool's pointers point to.

use crate::instance::{ERROR, Instance, OK, get, set};
use host_sim::fmu::{Component, Refusal};
use std::ffi::{CStr, c_char, c_int};

/// A text; `None` for no text and for one that is not UTF-8.
///
/// # Safety
/// The pointer is null, or a text that ends in zero and lives as long as the answer is used.
pub unsafe fn text<'a>(pointer: *const c_char) -> Option<&'a str> {
    if pointer.is_null() {
        return None;
    }
    // SAFETY: not null, and the caller answers for the rest.
    unsafe { CStr::from_ptr(pointer) }.to_str().ok()
}

/// An array; empty where there is none.
///
/// # Safety
/// The pointer is null, or `count` values that live as long as the answer is used.
unsafe fn array<'a, T>(pointer: *const T, count: usize) -> &'a [T] {
    if pointer.is_null() || count == 0 {
        return &[];
    }
    // SAFETY: not null, and the caller answers for the rest.
    unsafe { std::slice::from_raw_parts(pointer, count) }
}

/// An array to write to; empty where there is none.
///
/// # Safety
/// The pointer is null, or `count` values that nobody else touches while the answer is used.
unsafe fn array_mut<'a, T>(pointer: *mut T, count: usize) -> &'a mut [T] {
    if pointer.is_null() || count == 0 {
        return &mut [];
    }
    // SAFETY: not null, and the caller answers for the rest.
    unsafe { std::slice::from_raw_parts_mut(pointer, count) }
}

/// Writes a value where there is room for it.
///
/// # Safety
/// The pointer is null, or room for a value.
pub unsafe fn put<T>(pointer: *mut T, value: T) {
    if !pointer.is_null() {
        // SAFETY: not null, and the caller answers for the rest.
        unsafe { pointer.write(value) };
    }
}

/// Works on a unit; without one the call fails.
///
/// # Safety
/// The pointer is null, or a unit that the tool has from this library and uses in one thread.
pub unsafe fn on(
    instance: *mut Instance,
    work: impl FnOnce(&mut Component) -> Result<(), Refusal>,
) -> c_int {
    // SAFETY: the caller's.
    unsafe { instance.as_mut() }.map_or(ERROR, |instance| instance.answered(work))
}

/// Reads values of a unit's variables.
///
/// # Safety
/// A unit as in [`on`]; arrays as in [`array`] and [`array_mut`], of these lengths.
pub unsafe fn read<T>(
    instance: *mut Instance,
    (references, count): (*const u32, usize),
    (values, value_count): (*mut T, usize),
    as_type: fn(f64) -> T,
) -> c_int {
    // SAFETY: the caller's.
    let (references, values) =
        unsafe { (array(references, count), array_mut(values, value_count)) };
    // SAFETY: the caller's.
    unsafe { on(instance, |unit| get(unit, references, values, as_type)) }
}

/// Sets values of a unit's variables.
///
/// # Safety
/// A unit as in [`on`]; arrays as in [`array`], of these lengths.
pub unsafe fn write<T: Copy + Into<f64>>(
    instance: *mut Instance,
    (references, count): (*const u32, usize),
    (values, value_count): (*const T, usize),
) -> c_int {
    // SAFETY: the caller's.
    let (references, values) = unsafe { (array(references, count), array(values, value_count)) };
    // SAFETY: the caller's.
    unsafe { on(instance, |unit| set(unit, references, values)) }
}

/// Ends a unit.
///
/// # Safety
/// The pointer is null, or a unit that the tool has from this library and gives up.
pub unsafe fn free(instance: *mut Instance) {
    if !instance.is_null() {
        // SAFETY: the caller's; units are made by `instance::boxed`.
        drop(unsafe { Box::from_raw(instance) });
    }
}

/// Keeps a copy of a unit; what the place held before is overwritten, as the standards ask.
///
/// # Safety
/// A unit as in [`on`]; a place that is null, holds null, or a copy of this unit.
pub unsafe fn keep(instance: *mut Instance, place: *mut *mut Component) -> c_int {
    // SAFETY: the caller's.
    let (Some(instance), Some(place)) = (unsafe { (instance.as_ref(), place.as_mut()) }) else {
        return ERROR;
    };
    let state = instance.state();
    // SAFETY: null, or a copy that was made here.
    match unsafe { place.as_mut() } {
        Some(kept) => *kept = state,
        None => *place = Box::into_raw(Box::new(state)),
    }
    OK
}

/// Makes a unit what it was.
///
/// # Safety
/// A unit as in [`on`], and null or a copy from [`keep`].
pub unsafe fn bring_back(instance: *mut Instance, state: *const Component) -> c_int {
    // SAFETY: the caller's.
    let (Some(instance), Some(state)) = (unsafe { (instance.as_mut(), state.as_ref()) }) else {
        return ERROR;
    };
    instance.restore(state);
    OK
}

/// Gives a copy up.
///
/// # Safety
/// The place is null, holds null, or a copy from [`keep`].
pub unsafe fn let_go(place: *mut *mut Component) -> c_int {
    // SAFETY: the caller's.
    if let Some(state) = unsafe { place.as_mut() }
        && !state.is_null()
    {
        // SAFETY: made by `keep`, and nobody else's.
        drop(unsafe { Box::from_raw(*state) });
        *state = std::ptr::null_mut();
    }
    OK
}
