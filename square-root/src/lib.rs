//! The square root by the processor's own instruction, without the standard library.
//!
//! A square root is rounded correctly by every processor and by `libm`, so that these
//! bits are the same everywhere; only the time differs. `core` has no root yet (its
//! `float_math` is not stable), and that of `libm` 0.2.16 is written for a Cortex-M4F
//! in whole numbers and for x86-64 in an instruction of the old encoding, which waits
//! for the upper halves of the vectors about it: a third of what a fit with a tube took.
//!
//! The root of nought is that nought, below nought it is NaN.
#![no_std]

/// Square root in double precision.
#[cfg(target_arch = "x86_64")]
#[expect(
    unsafe_code,
    reason = "the compiler asks for a feature that is always there"
)]
#[inline]
pub fn sqrt(x: f64) -> f64 {
    use core::arch::x86_64::{_mm_cvtsd_f64, _mm_set_sd, _mm_sqrt_sd};
    // SAFETY: every x86-64 processor has SSE2.
    unsafe {
        let packed = _mm_set_sd(x);
        _mm_cvtsd_f64(_mm_sqrt_sd(packed, packed))
    }
}

/// Square root in single precision.
#[cfg(target_arch = "x86_64")]
#[expect(
    unsafe_code,
    reason = "the compiler asks for a feature that is always there"
)]
#[inline]
pub fn sqrtf(x: f32) -> f32 {
    use core::arch::x86_64::{_mm_cvtss_f32, _mm_set_ss, _mm_sqrt_ss};
    // SAFETY: every x86-64 processor has SSE.
    unsafe { _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x))) }
}

/// Square root in double precision.
#[cfg(not(target_arch = "x86_64"))]
#[inline]
pub fn sqrt(x: f64) -> f64 {
    libm::sqrt(x)
}

/// Square root in single precision.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[expect(
    unsafe_code,
    reason = "no function of `core` stands for this instruction"
)]
#[inline]
pub fn sqrtf(x: f32) -> f32 {
    let root_bits: u32;
    // SAFETY: an ABI that passes numbers in registers of the floating-point unit has that
    // unit; what is written is declared, and nothing else touched. Numbers go in and out by
    // way of whole ones: the compiler does not offer that unit's registers for them yet.
    unsafe {
        core::arch::asm!(
            "vmov s0, {bits}",
            "vsqrt.f32 s0, s0",
            "vmov {bits}, s0",
            bits = inlateout(reg) x.to_bits() => root_bits,
            out("s0") _,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    f32::from_bits(root_bits)
}

/// Square root in single precision.
#[cfg(not(any(
    target_arch = "x86_64",
    all(target_arch = "arm", target_abi = "eabihf")
)))]
#[inline]
pub fn sqrtf(x: f32) -> f32 {
    libm::sqrtf(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of all sizes, by their bits: the least, the largest, and steps between.
    const STEPS: u32 = 1_000_003;

    #[test]
    fn val_has_the_bits_of_a_root_in_whole_numbers() {
        for step in 0..STEPS {
            let single = f32::from_bits(step * (0x7f80_0000 / STEPS));
            assert_eq!(sqrtf(single).to_bits(), libm::sqrtf(single).to_bits());
            let double =
                f64::from_bits(u64::from(step) * (0x7ff0_0000_0000_0000 / u64::from(STEPS)));
            assert_eq!(sqrt(double).to_bits(), libm::sqrt(double).to_bits());
        }
    }

    #[test]
    fn val_of_nought_infinity_and_less_than_nought() {
        for nought in [0.0, -0.0] {
            assert_eq!(sqrt(nought).to_bits(), nought.to_bits());
        }
        assert!(sqrtf(-0.0).is_sign_negative());
        assert!(sqrt(f64::INFINITY) > f64::MAX && sqrtf(f32::INFINITY) > f32::MAX);
        assert!(sqrt(-1.0).is_nan() && sqrtf(-1.0).is_nan());
        assert!(sqrt(f64::NAN).is_nan() && sqrtf(f32::NAN).is_nan());
    }
}
