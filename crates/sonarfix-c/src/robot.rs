//! The robot's loop and its link, sans-IO: a poll takes what was sensed and received, and returns what to do and to send.
//!
//! It is the application that the shipped firmware runs. Its drivers are on signals that are fields (`devices`).

#![expect(unsafe_code, reason = "exports functions to C")]

pub mod commands;
pub mod config;
mod devices;
pub mod poll;
pub mod readings;
pub mod signals;

use sonarfix::config::MAX_RANGERS;
use sonarfix_app::store::Store;
use sonarfix_app::{App, Board, FlashContents};
use sonarfix_hal::config::Unsupported;
use sonarfix_link::baked;
use sonarfix_link::message::ResetCause;
use sonarfix_pil::RamFlash;
use sonarfix_pil::ram_flash::CAPACITY;

use crate::arithmetic;
use crate::map::{Chart, sonarfix_map_t};
use crate::memory::{close, handle, held, open_in_place, place, slice_mut, value};
use crate::state::instant;
use crate::status::{Result, sonarfix_status_t};

use commands::Pending;
use config::sonarfix_robot_config_t;
use devices::{SignalDevices, Signals};

/// Bytes of the store of a robot.
pub const SONARFIX_STORE_SIZE: usize = 4096;

const _: () = assert!(SONARFIX_STORE_SIZE == CAPACITY);

/// 64-bit words of a robot.
#[cfg(target_pointer_width = "64")]
pub const SONARFIX_ROBOT_WORDS: usize = 1385;
/// 64-bit words of a robot.
#[cfg(not(target_pointer_width = "64"))]
pub const SONARFIX_ROBOT_WORDS: usize = 1351;

/// A robot in memory of the caller. It must not be copied or moved.
#[repr(C)]
#[derive(Debug)]
pub struct sonarfix_robot_t {
    /// Only for this library.
    pub opaque: [u64; SONARFIX_ROBOT_WORDS],
}

/// The signals, and what refers to them.
pub struct Robot {
    signals: Signals,
    core: Core,
}

/// The application with its drivers.
pub struct Core {
    app: App<'static, RamFlash<&'static mut [u8]>>,
    devices: SignalDevices,
    /// The periods of the servos, microseconds.
    frames: [f32; MAX_RANGERS],
    pending: Option<Pending>,
}

handle!(sonarfix_robot_t: Robot, b"Srob");

/// The parts of an open robot. The whole of it is never borrowed for a change, because the drivers refer to the signals.
///
/// # Safety
/// As of [`crate::memory::held_mut`].
unsafe fn parts<'a>(robot: *mut sonarfix_robot_t) -> Result<(&'a Signals, &'a mut Core)> {
    // SAFETY: by the caller.
    let robot = unsafe { place(robot) }?;
    // SAFETY: it is open, and the two are separate.
    Ok(unsafe { (&(*robot).signals, &mut (*robot).core) })
}

/// Reads from an open robot.
///
/// # Safety
/// As of [`crate::memory::read`].
unsafe fn read<T>(
    robot: *const sonarfix_robot_t,
    to: *mut T,
    read: impl FnOnce(&Core) -> Result<T>,
) -> sonarfix_status_t {
    // SAFETY: by the caller.
    unsafe { crate::memory::read(robot, to, |robot| read(&robot.core)) }
}

/// Opens a robot that waits: its loop starts by sonarfix_robot_start, or by a command over the link.
///
/// @param robot  memory for the robot, which stays where it is until the robot is closed
/// @param config  the configuration, which is copied
/// @param map  an open map; that of a baked image can be compared with the one of a monitor
/// @param store  SONARFIX_STORE_SIZE bytes that survive a power loss if the program saves them when an output says so: all 0xFF at
///   first, later what was saved. They stay where they are until the robot is closed
/// @param now_us  the time, microseconds
/// @return SONARFIX_OK; SONARFIX_ERROR_CONFIG, _VALUE or _NOT_LINKED by what is wrong with the configuration
///   (sonarfix_robot_config_check names the field); SONARFIX_ERROR_UNSUPPORTED; SONARFIX_ERROR_TIME; SONARFIX_ERROR_ARITHMETIC; or
///   an error of a pointer or a handle. After an error the robot is closed
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_init(
    robot: *mut sonarfix_robot_t,
    config: *const sonarfix_robot_config_t,
    map: *const sonarfix_map_t,
    store: *mut u8,
    now_us: u64,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        open_in_place(robot, |robot| {
            let (config, now) = (value(config)?.config()?, instant(now_us)?);
            config.check_linked().map_err(|_| sonarfix_status_t::SONARFIX_ERROR_NOT_LINKED)?;
            config.check()?;
            arithmetic::check()?;
            let &Chart { map, checksum } = held(map)?;
            let flash = RamFlash::new(slice_mut(store, CAPACITY)?);
            (&raw mut (*robot).signals).write(Signals::default());
            let devices = devices::devices(&config, &(*robot).signals)?;
            let region = 0..u32::try_from(CAPACITY).unwrap_or(0);
            let store = Store::new(flash, region);
            let store = store.map_err(|_| sonarfix_status_t::SONARFIX_ERROR_OTHER)?;
            let contents = FlashContents {
                map: Ok((map, checksum)),
                config: Ok((config, baked::checksum(&config))),
            };
            let board = Board { firmware: [0; 3], reset: ResetCause::PowerOn, resets: 0 };
            let app = App::new(board, contents, store, now);
            (&raw mut (*robot).core).write(Core {
                app,
                devices,
                frames: devices::frames(&config),
                pending: None,
            });
            Ok(())
        })
    }
}

impl From<Unsupported> for sonarfix_status_t {
    fn from(_: Unsupported) -> Self {
        Self::SONARFIX_ERROR_UNSUPPORTED
    }
}

/// Closes a robot.
///
/// @param robot  an open robot
/// @return SONARFIX_OK, or an error of the pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_close(robot: *mut sonarfix_robot_t) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { close(robot) }
}
