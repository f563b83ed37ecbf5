//! What the memory of a robot holds.

#![expect(unsafe_code, reason = "follows the pointer of a C program")]

use sonarfix::config::MAX_RANGERS;
use sonarfix::localizer::Start;
use sonarfix_app::App;
use sonarfix_link::Command;
use sonarfix_pil::RamFlash;
use sonarfix_pil::ram_flash::CAPACITY;

use super::devices::{SignalDevices, Signals};
use crate::memory::{handle, place};
use crate::status::{Result, sonarfix_status_t};

/// Bytes of the store of a robot.
pub const SONARFIX_STORE_SIZE: usize = 4096;

const _: () = assert!(SONARFIX_STORE_SIZE == CAPACITY);

/// 64-bit words of a robot.
#[cfg(target_pointer_width = "64")]
pub const SONARFIX_ROBOT_WORDS: usize = 1423;
/// 64-bit words of a robot.
#[cfg(not(target_pointer_width = "64"))]
pub const SONARFIX_ROBOT_WORDS: usize = 1386;

/// A robot in memory of the caller. It must not be copied or moved.
#[repr(C)]
#[derive(Debug)]
pub struct sonarfix_robot_t {
    /// Only for this library.
    pub opaque: [u64; SONARFIX_ROBOT_WORDS],
}

/// The signals, and what refers to them.
pub struct Robot {
    pub(super) signals: Signals,
    pub(super) core: Core,
}

/// The application with its drivers.
pub struct Core {
    pub(super) app: App<'static, RamFlash<&'static mut [u8]>>,
    pub(super) devices: SignalDevices,
    /// The periods of the servos, microseconds.
    pub(super) frames: [f32; MAX_RANGERS],
    pub(super) pending: Option<Pending>,
}

handle!(sonarfix_robot_t: Robot, b"Srob");

/// The parts of an open robot. The whole of it is never borrowed for a change, because the drivers refer to the signals.
///
/// # Safety
/// As of [`crate::memory::held_mut`].
pub(super) unsafe fn parts<'a>(
    robot: *mut sonarfix_robot_t,
) -> Result<(&'a Signals, &'a mut Core)> {
    // SAFETY: by the caller.
    let robot = unsafe { place(robot) }?;
    // SAFETY: it is open, and the two are separate.
    Ok(unsafe { (&(*robot).signals, &mut (*robot).core) })
}

/// Reads from an open robot.
///
/// # Safety
/// As of [`crate::memory::read`].
pub(super) unsafe fn read<T>(
    robot: *const sonarfix_robot_t,
    to: *mut T,
    read: impl FnOnce(&Core) -> Result<T>,
) -> sonarfix_status_t {
    // SAFETY: by the caller.
    unsafe { crate::memory::read(robot, to, |robot| read(&robot.core)) }
}

/// A command that waits for the next poll.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Pending {
    SetPose(Start),
    Start,
    Stop,
    Search,
    ResetCalibration,
}

impl Pending {
    pub(super) fn command(&self) -> Command {
        match *self {
            Self::SetPose(start) => Command::SetPose(start),
            Self::Start => Command::Start,
            Self::Stop => Command::Stop,
            Self::Search => Command::Search,
            Self::ResetCalibration => Command::ResetCalibration,
        }
    }
}
