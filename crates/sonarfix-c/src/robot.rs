//! The robot's loop and its link, sans-IO: a poll takes what was sensed and received, and returns what to do and to send.
//!
//! It is the application that the shipped firmware runs. Its drivers are on signals that are fields (`devices`).

#![expect(unsafe_code, reason = "exports functions to C")]

pub mod commands;
pub mod config;
mod devices;
pub mod held;
pub mod poll;
pub mod readings;
pub mod signals;

use sonarfix_app::store::Store;
use sonarfix_app::{App, Board, FlashContents};
use sonarfix_hal::config::Unsupported;
use sonarfix_link::baked;
use sonarfix_link::message::ResetCause;
use sonarfix_pil::RamFlash;
use sonarfix_pil::ram_flash::CAPACITY;

use crate::arithmetic;
use crate::map::{Chart, sonarfix_map_t};
use crate::memory::{close, held, open_in_place, slice_mut, value};
use crate::state::instant;
use crate::status::sonarfix_status_t;

use self::held::{Core, sonarfix_robot_t};
use config::sonarfix_robot_config_t;
use devices::Signals;

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
