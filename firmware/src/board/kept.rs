//! A cause, and where the program crashed, in memory that a reset does not clear.
#![expect(unsafe_code, reason = "memory outside the language's initialisation")]

use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut};
use firmware::crash::Crash;
use firmware::start::Kept;

// SAFETY: the start-up code leaves this section as it is; the type allows that.
#[unsafe(link_section = ".uninit.kept_cause")]
static mut KEPT: MaybeUninit<Kept> = MaybeUninit::uninit();

// SAFETY: as above.
#[unsafe(link_section = ".uninit.kept_crash")]
static mut CRASHED: MaybeUninit<(Crash, u32)> = MaybeUninit::uninit();

/// Keeps where the program crashed over the resets that follow, until power goes.
pub fn keep_crash(crash: Crash) {
    // SAFETY: as in `keep`.
    unsafe { addr_of_mut!(CRASHED).write_volatile(MaybeUninit::new((crash, crash.check()))) }
}

/// Where the program crashed last since power came.
pub fn kept_crash() -> Option<Crash> {
    // SAFETY: called once, before interrupts; any bits are of this type, which has no invariants,
    // and the volatile access makes the memory's content the value.
    let (crash, check) = unsafe { addr_of!(CRASHED).cast::<(Crash, u32)>().read_volatile() };
    (crash.check() == check).then_some(crash)
}

/// Keeps a cause over the reset that follows.
pub fn keep(cause: u32) {
    // SAFETY: called on the way to a reset, with interrupts masked, and by
    // nobody else; the place is aligned and as large as the type.
    unsafe { addr_of_mut!(KEPT).write_volatile(MaybeUninit::new(Kept::new(cause))) }
}

/// The cause kept over the last reset; a second call finds none.
pub fn take_kept() -> Option<u32> {
    // SAFETY: called once, before interrupts. Any bits are a `Kept`; the volatile
    // access through a pointer makes the memory's content, whatever it is, the value.
    let found = unsafe { addr_of!(KEPT).cast::<Kept>().read_volatile() };
    // SAFETY: as above.
    unsafe { addr_of_mut!(KEPT).write_volatile(MaybeUninit::zeroed()) };
    found.read()
}
