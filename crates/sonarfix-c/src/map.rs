//! Walls and maps.

#![expect(unsafe_code, reason = "exports functions to C")]

use core::mem::MaybeUninit;

use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::map::{Map, Wall};

use crate::memory::{close, handle, held, memory, open, read, slice};
use crate::status::{Result, sonarfix_status_t};

/// Size of a wall in memory, bytes.
pub const SONARFIX_WALL_SIZE: usize = 24;

/// A wall of a map in memory of the caller; sonarfix_map_from_walls fills it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sonarfix_wall_t {
    /// Only for this library.
    pub opaque: [u32; 6],
}

const _: () = assert!(
    size_of::<Wall>() == size_of::<sonarfix_wall_t>()
        && size_of::<Wall>() == SONARFIX_WALL_SIZE
        && align_of::<Wall>() == align_of::<sonarfix_wall_t>()
);

/// The ends of a wall in the map frame.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_segment_t {
    /// Along map x of one end, metres.
    pub from_x_m: f32,
    /// Along map y of one end, metres.
    pub from_y_m: f32,
    /// Along map x of the other end, metres.
    pub to_x_m: f32,
    /// Along map y of the other end, metres.
    pub to_y_m: f32,
    /// Standard deviation of the wall's place, metres, rounded to whole millimetres from 1 to 255; zero or negative: that of
    /// the configuration (echo_map_accuracy_m).
    pub accuracy_m: f32,
}

impl sonarfix_segment_t {
    fn wall(self) -> Result<Wall> {
        let from = Point::new(self.from_x_m, self.from_y_m);
        let to = Point::new(self.to_x_m, self.to_y_m);
        let accuracy = crate::state::finite(self.accuracy_m)?;
        let wall = Wall::new(from, to)?;
        Ok(if accuracy > 0.0 { wall.with_accuracy(Metres(accuracy)) } else { wall })
    }
}

/// 64-bit words of a map.
#[cfg(target_pointer_width = "64")]
pub const SONARFIX_MAP_WORDS: usize = 14;
/// 64-bit words of a map.
#[cfg(not(target_pointer_width = "64"))]
pub const SONARFIX_MAP_WORDS: usize = 8;

/// A map. It refers to walls or to an image, which must stay where they are, unchanged, as long as the map or a handle that was
/// initialised with it is open. A map must not be copied.
#[repr(C)]
#[derive(Debug)]
pub struct sonarfix_map_t {
    /// Only for this library.
    pub opaque: [u64; SONARFIX_MAP_WORDS],
}

/// A map with the checksum of its image; zero without one.
pub struct Chart {
    pub(crate) map: Map<'static>,
    #[cfg_attr(not(feature = "robot"), expect(dead_code, reason = "the link sends it"))]
    pub(crate) checksum: u32,
}

handle!(sonarfix_map_t: Chart, b"Smap");

/// The map of an open handle.
///
/// # Safety
/// As of [`held`].
pub(crate) unsafe fn map_of(map: *const sonarfix_map_t) -> Result<Map<'static>> {
    // SAFETY: by the caller.
    unsafe { held(map) }.map(|chart| chart.map)
}

/// Opens a map of walls, which suits a room: every call considers all of them.
///
/// @param map  memory for the map
/// @param walls  memory for count walls, which the map refers to
/// @param segments  the ends of count walls in the map frame, metres; wall i of the map is the i-th
/// @param count  number of walls, at least 1
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_FINITE or SONARFIX_ERROR_WALL_TOO_SHORT by the first wall that is not one;
///   SONARFIX_ERROR_LENGTH; or an error of a pointer. The map is then as it was.
/// Threads: one at a time for the map and its walls.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_map_from_walls(
    map: *mut sonarfix_map_t,
    walls: *mut sonarfix_wall_t,
    segments: *const sonarfix_segment_t,
    count: usize,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        open(map, || {
            let segments = slice(segments, count)?;
            let walls = memory(walls.cast::<Wall>(), count)?;
            for segment in segments {
                segment.wall()?;
            }
            fill(walls, segments)?;
            let walls = slice(walls.as_ptr().cast::<Wall>(), count)?;
            Ok(Chart { map: Map::new(walls), checksum: 0 })
        })
    }
}

fn fill(walls: &mut [MaybeUninit<Wall>], segments: &[sonarfix_segment_t]) -> Result<()> {
    for (wall, segment) in walls.iter_mut().zip(segments) {
        wall.write(segment.wall()?);
    }
    Ok(())
}

/// Opens a baked map, which is read in place: written by `sonarfix map bake`, in flash or in RAM, with any alignment.
///
/// The cost of a call does not depend on the size of the map. The whole image is checked once, here.
///
/// @param map  memory for the map
/// @param image  the image, which the map refers to; bytes after it are ignored
/// @param length  bytes from image on
/// @return SONARFIX_OK; SONARFIX_ERROR_MAP_... by the first fault; or an error of a pointer
/// Threads: one at a time for the map; several maps may share an image.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_map_from_image(
    map: *mut sonarfix_map_t,
    image: *const u8,
    length: usize,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        open(map, || {
            let region = slice(image, length)?;
            let length = sonarfix::map::image::length(region)?;
            let cut = sonarfix_status_t::SONARFIX_ERROR_MAP_LENGTH;
            let image = region.get(..length).ok_or(cut)?;
            let seal = image.last_chunk().ok_or(cut)?;
            Ok(Chart { map: Map::read(image)?, checksum: u32::from_le_bytes(*seal) })
        })
    }
}

/// Reads the number of walls of a map.
///
/// @param map  an open map
/// @param count  gets the number; the walls have the numbers below it
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: any number at a time while none opens or closes the map.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_map_count(
    map: *const sonarfix_map_t,
    count: *mut u32,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(map, count, |chart| Ok(chart.map.count())) }
}

/// Closes a map. Handles that were initialised with it still refer to its walls or its image.
///
/// @param map  an open map
/// @return SONARFIX_OK, or an error of the pointer or the handle
/// Threads: one at a time for the map.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_map_close(map: *mut sonarfix_map_t) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { close(map) }
}
