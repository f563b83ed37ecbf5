//! The report of a program over semihosting: lines with a key and numbers, and its end.

use core::ffi::CStr;

use crate::meter::Cost;
use crate::processor;
use crate::semihosting::{exit, print as write};

/// Digits of the largest `u32`, and the zero that ends a string.
const LONGEST: usize = 11;

/// Reports the cost of calls: `key calls instructions most_instructions most_stack`.
pub fn cost(key: &CStr, cost: &Cost) {
    write(key);
    for value in [cost.calls, cost.instructions, cost.most_instructions, cost.most_stack] {
        number(value);
    }
    write(c"\n");
}

/// Reports one number.
pub fn line(key: &CStr, value: u32) {
    write(key);
    number(value);
    write(c"\n");
}

fn number(value: u32) {
    write(c" ");
    let mut text = [0; LONGEST];
    write(decimal(value, &mut text));
}

/// Ends the program with success.
pub fn done() -> ! {
    exit(true);
    stop()
}

/// Ends the program with a failure and its reason.
pub fn fail(why: &CStr) -> ! {
    write(why);
    write(c"\n");
    exit(false);
    stop()
}

/// Not reached under QEMU, which exits.
fn stop() -> ! {
    loop {
        processor::wait();
    }
}

/// A number in decimal, written from the end of `text`, whose last byte stays zero.
fn decimal(mut value: u32, text: &mut [u8; LONGEST]) -> &CStr {
    let mut digits = LONGEST - 1;
    for byte in text.iter_mut().rev().skip(1) {
        *byte = b'0' + u8::try_from(value % 10).unwrap_or(0);
        value /= 10;
        digits -= 1;
        if value == 0 {
            break;
        }
    }
    let written = text.get(digits..).unwrap_or_default();
    CStr::from_bytes_until_nul(written).unwrap_or_default()
}
