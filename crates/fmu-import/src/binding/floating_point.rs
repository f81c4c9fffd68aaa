//! Reads how the processor calculates: what it rounds to, and which results end the program.

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use std::arch::asm;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// How the processor calculates, as one number.
#[cfg(target_arch = "x86_64")]
#[inline]
pub(super) fn floating_point_control() -> u64 {
    /// Flags of what happened in calculations are none of what rules them.
    const FLAGS: u32 = 0x3f;
    let (mut control, mut x87) = (0_u32, 0_u16);
    // SAFETY: both instructions write the number at their address.
    unsafe {
        asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack, preserves_flags));
        asm!("fnstcw [{}]", in(reg) &raw mut x87, options(nostack, preserves_flags));
    }
    u64::from(control & !FLAGS) | u64::from(x87) << 32
}

/// How the processor calculates, as one number.
#[cfg(target_arch = "aarch64")]
#[inline]
pub(super) fn floating_point_control() -> u64 {
    let control: u64;
    // SAFETY: the instruction reads a register.
    unsafe { asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack, preserves_flags)) };
    control
}

/// Not known of other processors: there, a change is seen after steps that look at all.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub(super) fn floating_point_control() -> u64 {
    0
}

static USUAL_CONTROL: AtomicU64 = AtomicU64::new(0);

/// Notes how the processor calculates, before there is any foreign code.
pub(super) fn note_usual_control() {
    USUAL_CONTROL.store(floating_point_control(), Relaxed);
}

/// What was noted.
#[inline]
pub(super) fn usual_control() -> u64 {
    USUAL_CONTROL.load(Relaxed)
}
