//! The bytes between the simulator and a program: little-endian, as `struct Inputs` and `struct Outputs` of
//! `c/arduino/host/wire.h` have them.

use std::io::{self, Read, Write};

use sonarfix::config::MAX_RANGERS;
use sonarfix::geometry::units::Instant;
use sonarfix_pil::{EchoSignals, Sensors};

/// The outputs for a ranger and its servo in a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct RangerOutput {
    /// The servo's pulse, µs; zero if it is unchanged.
    pub servo: u16,
    /// Whether the trigger has fallen, or a time-of-flight ranger was started.
    pub has_pinged: bool,
}

/// What a program does in a step.
#[derive(Debug, Clone, Default)]
pub struct Outputs {
    /// Of each ranger.
    pub rangers: [RangerOutput; MAX_RANGERS],
    /// What it has written to its serial port.
    pub serial: Vec<u8>,
}

/// Sends the signals of the sensors.
///
/// # Errors
/// If the program has ended.
pub fn send(sensors: &Sensors, to: &mut impl Write) -> io::Result<()> {
    let micros = |at: Option<Instant>| at.map_or(0, |at| at.ticks()).to_le_bytes();
    let mut bytes = sensors.at.ticks().to_le_bytes().to_vec();
    for EchoSignals { rose, fell, .. } in &sensors.echoes {
        bytes.extend(micros(*rose));
        bytes.extend(micros(*fell));
    }
    for wheel in [&sensors.right, &sensors.left] {
        bytes.extend(wheel.ticks.to_le_bytes());
    }
    bytes.extend(sensors.gyro.micros.to_le_bytes());
    for EchoSignals { light, .. } in &sensors.echoes {
        bytes.extend(light.millimetres.to_le_bytes());
        bytes.push(light.status);
        bytes.push(u8::from(light.has_failed));
    }
    to.write_all(&bytes)?;
    to.flush()
}

/// Receives what the program has done.
///
/// # Errors
/// If the program has ended.
pub fn receive(from: &mut impl Read) -> io::Result<Outputs> {
    let mut outputs = Outputs::default();
    for ranger in &mut outputs.rangers {
        ranger.servo = u16::from_le_bytes(array(from)?);
        ranger.has_pinged = u16::from_le_bytes(array(from)?) != 0;
    }
    let length = u32::from_le_bytes(array(from)?);
    outputs.serial = vec![0; usize::try_from(length).unwrap_or(0)];
    from.read_exact(&mut outputs.serial)?;
    Ok(outputs)
}

fn array<const N: usize>(from: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    from.read_exact(&mut bytes)?;
    Ok(bytes)
}
