//! The functions of the C header, called in any order with any pointers that C can check.

use core::ptr::{null, null_mut};

use sonarfix_c::aim::sonarfix_aim_t;
use sonarfix_c::config::{sonarfix_config_default, sonarfix_config_t};
use sonarfix_c::fix::sonarfix_fix_t;
use sonarfix_c::localizer::{
    measurements::{
        sonarfix_localizer_aim, sonarfix_localizer_aim_at, sonarfix_localizer_fix,
        sonarfix_localizer_no_echo, sonarfix_localizer_ranger_failed, sonarfix_localizer_skip,
    },
    readings::sonarfix_localizer_state,
    searching::{
        sonarfix_localizer_attach_search, sonarfix_localizer_search, sonarfix_localizer_work,
    },
    sonarfix_localizer_close, sonarfix_localizer_init, sonarfix_localizer_odometry,
    sonarfix_localizer_set_clock, sonarfix_localizer_set_pose, sonarfix_localizer_t,
};
use sonarfix_c::map::{
    sonarfix_map_close, sonarfix_map_from_image, sonarfix_map_from_walls, sonarfix_map_t,
    sonarfix_segment_t, sonarfix_wall_t,
};
use sonarfix_c::search::{sonarfix_search_close, sonarfix_search_init, sonarfix_search_t};
use sonarfix_c::state::{sonarfix_mode_t, sonarfix_pose_t, sonarfix_start_t, sonarfix_state_t};
use sonarfix_c::status::sonarfix_status_t;

use crate::bytes::Bytes;

/// Walls of the map.
const WALLS: usize = 4;

/// The memory of a C program. It is all zero at first, as static memory is in C.
struct Memory {
    map: sonarfix_map_t,
    walls: [sonarfix_wall_t; WALLS],
    localizer: sonarfix_localizer_t,
    search: sonarfix_search_t,
    config: sonarfix_config_t,
    aim: sonarfix_aim_t,
    now_us: u64,
}

/// Calls functions until the end of the bytes.
///
/// # Panics
/// If a call that has failed has changed the estimate, or if an estimate is not finite.
pub fn c_interface(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    // SAFETY: all types are plain numbers and arrays of them.
    let mut memory: Box<Memory> = unsafe { Box::new(core::mem::zeroed()) };
    // SAFETY: as of C: the pointer leads to a configuration.
    unsafe { sonarfix_config_default(0.16, &raw mut memory.config) };
    while !bytes.is_empty() {
        let before = memory.estimate();
        let status = memory.call(&mut bytes);
        let after = memory.estimate();
        if status != sonarfix_status_t::SONARFIX_OK {
            assert_eq!(before, after, "{status:?} has changed the estimate");
        }
        assert!(
            after.is_none_or(|state| state.iter().all(|&bits| f32::from_bits(bits).is_finite()))
        );
    }
}

impl Memory {
    /// The bits of the state; `None` if the localizer is not open.
    fn estimate(&self) -> Option<[u32; 7]> {
        let mut state = core::mem::MaybeUninit::<sonarfix_state_t>::uninit();
        // SAFETY: both pointers lead to memory of their type.
        let status =
            unsafe { sonarfix_localizer_state(&raw const self.localizer, state.as_mut_ptr()) };
        (status == sonarfix_status_t::SONARFIX_OK).then(|| {
            // SAFETY: the call was executed, so that it was written.
            let s = unsafe { state.assume_init() };
            [
                s.x_m,
                s.y_m,
                s.heading_rad,
                s.scale_right,
                s.scale_left,
                s.track_width_error_m,
                s.range_scale,
            ]
            .map(f32::to_bits)
        })
    }

    /// One call. Every pointer is NULL, misaligned, or leads to memory of its type.
    fn call(&mut self, bytes: &mut Bytes) -> sonarfix_status_t {
        let number = bytes.byte();
        let localizer = mutable(bytes, &raw mut self.localizer);
        let search = mutable(bytes, &raw mut self.search);
        let aim = mutable(bytes, &raw mut self.aim);
        // SAFETY: a plain structure of numbers.
        let mut result: sonarfix_fix_t = unsafe { core::mem::zeroed() };
        let fix = mutable(bytes, &raw mut result);
        // SAFETY: the contract of the crate: what is neither NULL nor misaligned leads to memory of its type, and map, walls and
        // search stay where they are.
        unsafe {
            match number % 16 {
                0 => {
                    // It closes the localizer first, so that an error says nothing about that.
                    self.open_map(bytes);
                    sonarfix_status_t::SONARFIX_OK
                }
                1 => self.open(bytes, localizer),
                2 => sonarfix_localizer_close(localizer),
                3 => sonarfix_search_init(search),
                4 => sonarfix_localizer_attach_search(localizer, search),
                5 => sonarfix_localizer_search(localizer),
                6 => self.work(bytes, localizer),
                7 => sonarfix_localizer_aim(localizer, aim),
                8 => sonarfix_localizer_aim_at(
                    localizer,
                    bytes.byte().into(),
                    bytes.number(3.0),
                    aim,
                ),
                9 => sonarfix_localizer_fix(localizer, aim, bytes.number(4.0), fix),
                10 => sonarfix_localizer_no_echo(localizer, aim, fix),
                11 => sonarfix_localizer_skip(localizer),
                12 => sonarfix_localizer_ranger_failed(localizer, bytes.byte().into()),
                13 => sonarfix_localizer_set_pose(localizer, &start(bytes)),
                14 => sonarfix_localizer_set_clock(localizer, self.time(bytes)),
                _ => {
                    let now_us = self.time(bytes);
                    let (right, left) = (bytes.number(0.05), bytes.number(0.05));
                    sonarfix_localizer_odometry(localizer, now_us, right, left)
                }
            }
        }
    }

    /// Usually 100 ms later.
    fn time(&mut self, bytes: &mut Bytes) -> u64 {
        self.now_us = match bytes.byte() {
            0..8 => u64::from(bytes.word()) << (bytes.byte() % 32),
            _ => self.now_us.wrapping_add(100_000),
        };
        self.now_us
    }

    /// Closes the localizer and the map, and opens the map with other walls, or with an image of arbitrary bytes.
    unsafe fn open_map(&mut self, bytes: &mut Bytes) {
        static IMAGE: [u8; 64] = [0x53; 64];
        // SAFETY: by the caller; nothing refers to the walls any more.
        unsafe {
            sonarfix_localizer_close(&raw mut self.localizer);
            sonarfix_search_close(&raw mut self.search);
            sonarfix_map_close(&raw mut self.map);
            if bytes.byte() < 16 {
                let length = usize::from(bytes.byte() % 64);
                sonarfix_map_from_image(&raw mut self.map, IMAGE.as_ptr(), length);
                return;
            }
            let segments: [sonarfix_segment_t; WALLS] =
                core::array::from_fn(|_| sonarfix_segment_t {
                    from_x_m: bytes.number(5.0),
                    from_y_m: bytes.number(5.0),
                    to_x_m: bytes.number(5.0),
                    to_y_m: bytes.number(5.0),
                    accuracy_m: bytes.number(0.1),
                });
            let walls = self.walls.as_mut_ptr();
            sonarfix_map_from_walls(&raw mut self.map, walls, segments.as_ptr(), WALLS);
        }
    }

    unsafe fn open(
        &mut self,
        bytes: &mut Bytes,
        localizer: *mut sonarfix_localizer_t,
    ) -> sonarfix_status_t {
        self.config.track_width_m = bytes.between(0.05, 0.6);
        self.config.gating_confidence = bytes.between(0.0, 4.0);
        self.config.policy = i32::from(bytes.byte() % 4);
        let map = if bytes.byte() < 8 { null() } else { &raw const self.map };
        let start = start(bytes);
        // SAFETY: by the caller.
        unsafe {
            sonarfix_localizer_init(
                localizer,
                &raw const self.config,
                map,
                &raw const start,
                self.now_us,
            )
        }
    }

    unsafe fn work(
        &mut self,
        bytes: &mut Bytes,
        localizer: *mut sonarfix_localizer_t,
    ) -> sonarfix_status_t {
        let mut mode = sonarfix_mode_t::SONARFIX_MODE_TRACKING;
        // SAFETY: by the caller.
        unsafe { sonarfix_localizer_work(localizer, bytes.byte().into(), &raw mut mode) }
    }
}

fn start(bytes: &mut Bytes) -> sonarfix_start_t {
    sonarfix_start_t {
        pose: sonarfix_pose_t {
            x_m: bytes.number(5.0),
            y_m: bytes.number(5.0),
            heading_rad: bytes.number(3.2),
        },
        position_deviation_m: bytes.between(1e-3, 1.0),
        heading_deviation_rad: bytes.between(1e-3, 0.1),
    }
}

/// Usually the pointer; sometimes NULL, or one that is not aligned.
fn mutable<T>(bytes: &mut Bytes, at: *mut T) -> *mut T {
    match bytes.byte() {
        0 => null_mut(),
        1 => at.wrapping_byte_add(1),
        _ => at,
    }
}
