//! `libsonarfix.a`: the functions of [`sonarfix_c`], and what every static library needs.

#![no_std]

pub use sonarfix_c::*;

#[cfg(all(target_arch = "arm", target_os = "none"))]
use sonarfix_soft_float as _;

/// The library for a microcontroller contains no call of it, which `cargo xtask c` checks.
#[cfg(not(unix))]
#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    loop {
        core::hint::spin_loop();
    }
}

/// Ends the program, so that a test fails.
#[cfg(unix)]
#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        safe fn abort() -> !;
    }
    abort()
}

/// The standard library of a computer refers to this name, by which a panic would unwind. Nothing unwinds here.
#[cfg(unix)]
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}
