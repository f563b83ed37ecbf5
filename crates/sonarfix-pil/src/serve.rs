//! What the microcontroller's program does: it answers, session after session.

use embedded_io::{Read, Write};

use crate::device::{Device, Refusal};
use crate::line::{Line, LineError, REQUEST_MAX};
use crate::message::{Answer, Begin, Request};
use crate::wires::Wires;

/// What the emulator, or a cycle counter, can tell of a call.
pub trait Meter {
    /// Makes the call, and counts its instructions: zero where nobody counts. What it gives it
    /// leaves where it likes: a result that is handed on would be counted, too.
    fn measure(&mut self, call: impl FnOnce()) -> u32;

    /// Begins to watch how deep the stack goes.
    fn watch_stack(&mut self);

    /// Bytes of stack that the deepest call took since then: zero where nobody knows.
    fn deepest(&self) -> u32;
}

/// Nobody counts: on the PC.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unmetered;

impl Meter for Unmetered {
    fn measure(&mut self, call: impl FnOnce()) -> u32 {
        call();
        0
    }

    fn watch_stack(&mut self) {}

    fn deepest(&self) -> u32 {
        0
    }
}

/// Answers whatever comes, for as long as the line lasts. `memory` must hold the longest
/// [`Request::Begin`], which has a map in it.
///
/// # Errors
/// [`LineError`], when the line is at its end.
pub fn serve<S: Read + Write>(
    line: &mut Line<S>,
    meter: &mut impl Meter,
    memory: &mut [u8],
) -> Result<core::convert::Infallible, LineError<S::Error>> {
    loop {
        match line.asked(memory)? {
            Request::Begin(begin, map) => session(line, meter, &begin, map)?,
            _ => line.reply(&Answer::Refused(Refusal::OutOfPlace), 0)?,
        }
    }
}

/// A session, up to its end; one that is refused is over at once.
fn session<S: Read + Write>(
    line: &mut Line<S>,
    meter: &mut impl Meter,
    begin: &Begin,
    map: &[u8],
) -> Result<(), LineError<S::Error>> {
    let wires = Wires::default();
    let mut device = match Device::begin(begin, map, &wires) {
        Ok((device, actuators)) => {
            line.reply(&Answer::Began(actuators), 0)?;
            device
        }
        Err(refusal) => return line.reply(&Answer::Refused(refusal), 0),
    };
    meter.watch_stack();
    loop {
        let mut space = [0; REQUEST_MAX];
        let request = line.asked(&mut space)?;
        if request == Request::End {
            return line.reply(&Answer::Ended(meter.deepest()), 0);
        }
        let (answer, instructions) = device.answer(&request, meter);
        line.reply(&answer, instructions)?;
    }
}
