//! The microcontroller's program: executes the requests of one session after another.

use embedded_io::{Read, Write};

use crate::line::{Line, LineError, REQUEST_MAX};
use crate::message::{Answer, Begin, Request, RequestError};
use crate::meter::Meter;
use crate::session::Session;
use crate::wires::Wires;

/// Executes requests until the line is closed. `memory` must hold the longest [`Request::Begin`], which contains a map.
///
/// # Errors
/// [`LineError`]; [`LineError::Closed`] at the regular end.
pub fn serve<S: Read + Write>(
    line: &mut Line<S>,
    meter: &mut impl Meter,
    memory: &mut [u8],
) -> Result<core::convert::Infallible, LineError<S::Error>> {
    loop {
        match line.receive_request(memory)? {
            Request::Begin(begin, map) => session(line, meter, &begin, map)?,
            _ => line.send_reply(&Answer::Refused(RequestError::OutOfPlace), 0)?,
        }
    }
}

/// Executes one session. A session that is refused ends at once.
fn session<S: Read + Write>(
    line: &mut Line<S>,
    meter: &mut impl Meter,
    begin: &Begin,
    map: &[u8],
) -> Result<(), LineError<S::Error>> {
    let wires = Wires::default();
    let mut running = match Session::begin(begin, map, &wires, meter) {
        Ok((session, actuators, longest)) => {
            line.send_reply(&Answer::Started(actuators), longest)?;
            session
        }
        Err(error) => return line.send_reply(&Answer::Refused(error), 0),
    };
    meter.watch_stack();
    loop {
        let mut space = [0; REQUEST_MAX];
        let request = line.receive_request(&mut space)?;
        if request == Request::End {
            return line.send_reply(&Answer::Ended(meter.deepest()), 0);
        }
        let (answer, instructions) = running.execute(&request, meter);
        line.send_reply(&answer, instructions)?;
    }
}
