//! The search for the pose.

#![expect(unsafe_code, reason = "exports functions to C")]

use sonarfix::geometry::pose::Point;
use sonarfix::map::Region;
use sonarfix_search::search::{Answer, Hypothesis, Search};

use crate::memory::{close, handle, open, read};
use crate::state::sonarfix_pose_t;
use crate::status::{Result, sonarfix_status_t};

/// 64-bit words of a search.
#[cfg(target_pointer_width = "64")]
pub const SONARFIX_SEARCH_WORDS: usize = 515;
/// 64-bit words of a search.
#[cfg(not(target_pointer_width = "64"))]
pub const SONARFIX_SEARCH_WORDS: usize = 507;

/// A search for the pose in memory of the caller. It must not be copied.
#[repr(C)]
#[derive(Debug)]
pub struct sonarfix_search_t {
    /// Only for this library.
    pub opaque: [u64; SONARFIX_SEARCH_WORDS],
}

handle!(sonarfix_search_t: Search<'static>, b"Ssea");

/// A rectangle of the map, parallel to its axes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_region_t {
    /// Smallest x, metres.
    pub from_x_m: f32,
    /// Smallest y, metres.
    pub from_y_m: f32,
    /// Largest x, metres.
    pub to_x_m: f32,
    /// Largest y, metres.
    pub to_y_m: f32,
}

impl From<&Region> for sonarfix_region_t {
    fn from(Region { from, to }: &Region) -> Self {
        Self { from_x_m: from.x.0, from_y_m: from.y.0, to_x_m: to.x.0, to_y_m: to.y.0 }
    }
}

impl sonarfix_region_t {
    pub(crate) fn region(&self) -> Result<Region> {
        let from = Point::new(self.from_x_m, self.from_y_m);
        let to = Point::new(self.to_x_m, self.to_y_m);
        let region = Region { from, to };
        region.is_valid().then_some(region).ok_or(sonarfix_status_t::SONARFIX_ERROR_VALUE)
    }
}

/// What a search has found.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_answer_kind_t {
    /// Nothing yet: no cycle is complete, or there are too few pings.
    SONARFIX_ANSWER_SEARCHING = 0,
    /// Several poses fit.
    SONARFIX_ANSWER_SEVERAL = 1,
    /// The position along a wall is undetermined.
    SONARFIX_ANSWER_ALONG = 2,
    /// No pose of the map fits.
    SONARFIX_ANSWER_NOWHERE = 3,
    /// One pose fits, and no other.
    SONARFIX_ANSWER_UNIQUE = 4,
}

use sonarfix_answer_kind_t::*;

/// What a search has found, with its numbers.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_answer_t {
    /// What it is.
    pub kind: sonarfix_answer_kind_t,
    /// Of several: how many poses fit, the first ones of sonarfix_search_hypothesis.
    pub count: u32,
    /// Along a wall: its number.
    pub wall: u32,
    /// Along a wall: standard deviation of the position along it, metres.
    pub extent_m: f32,
    /// The complete cycles of the search.
    pub cycles: u32,
    /// The pings in its window.
    pub pings: u32,
}

impl sonarfix_answer_t {
    fn of(search: &Search) -> Self {
        let (kind, count, wall, extent_m) = match search.answer() {
            Answer::Searching => (SONARFIX_ANSWER_SEARCHING, 0, 0, 0.0),
            Answer::Several(count) => {
                (SONARFIX_ANSWER_SEVERAL, u32::try_from(count).unwrap_or(u32::MAX), 0, 0.0)
            }
            Answer::Along { wall, extent } => (SONARFIX_ANSWER_ALONG, 0, wall.0, extent.0),
            Answer::Nowhere => (SONARFIX_ANSWER_NOWHERE, 0, 0, 0.0),
            Answer::Unique(_) => (SONARFIX_ANSWER_UNIQUE, 1, 0, 0.0),
        };
        let pings = u32::try_from(search.pings()).unwrap_or(u32::MAX);
        Self { kind, count, wall, extent_m, cycles: search.cycles(), pings }
    }
}

/// A pose that the pings of a search fit.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_hypothesis_t {
    /// The robot's pose now, in the map frame.
    pub pose: sonarfix_pose_t,
    /// Standard deviation of the position in its worst direction, metres.
    pub position_deviation_m: f32,
    /// Standard deviation of the heading, radians.
    pub heading_deviation_rad: f32,
    /// Mean weighted log-likelihood per ping, relative to a place without walls.
    pub fit: f32,
    /// Share of the echoes that the map explains.
    pub explained: f32,
}

impl From<Hypothesis> for sonarfix_hypothesis_t {
    fn from(found: Hypothesis) -> Self {
        Self {
            pose: found.pose.into(),
            position_deviation_m: found.position_deviation.0,
            heading_deviation_rad: found.heading_deviation.0,
            fit: found.fit,
            explained: found.explained,
        }
    }
}

/// Opens a search. It works for the localizer to which it is attached.
///
/// @param search  memory for the search
/// @return SONARFIX_OK, or an error of the pointer
/// Threads: one at a time for the search.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_search_init(search: *mut sonarfix_search_t) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { open(search, || Ok(Search::default())) }
}

/// Closes a search. A localizer to which it is attached refuses calls that need it: attach another one first.
///
/// @param search  an open search
/// @return SONARFIX_OK, or an error of the pointer or the handle
/// Threads: one at a time for the search and its localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_search_close(
    search: *mut sonarfix_search_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { close(search) }
}

/// Reads what a search has found in its last complete cycle.
///
/// @param search  an open search
/// @param answer  gets the answer, with metres
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the search and its localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_search_answer(
    search: *const sonarfix_search_t,
    answer: *mut sonarfix_answer_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(search, answer, |search| Ok(sonarfix_answer_t::of(search))) }
}

/// Reads a hypothesis of a search.
///
/// @param search  an open search
/// @param rank  0 for the best
/// @param hypothesis  gets the pose in the map frame, metres and radians
/// @return SONARFIX_OK; SONARFIX_ERROR_NO_HYPOTHESIS if there are not so many; or an error of a pointer or the handle
/// Threads: one at a time for the search and its localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_search_hypothesis(
    search: *const sonarfix_search_t,
    rank: u32,
    hypothesis: *mut sonarfix_hypothesis_t,
) -> sonarfix_status_t {
    let found = |search: &Search| {
        let found = usize::try_from(rank).ok().and_then(|rank| search.ranked(rank));
        found.map(Into::into).ok_or(sonarfix_status_t::SONARFIX_ERROR_NO_HYPOTHESIS)
    };
    // SAFETY: the contract of the crate.
    unsafe { read(search, hypothesis, found) }
}
