//! The search for the pose of a localizer.

#![expect(unsafe_code, reason = "exports functions to C")]

use sonarfix::map::Region;

use crate::localizer::sonarfix_localizer_t;
use crate::memory::{change, held, update, value};
use crate::search::{sonarfix_region_t, sonarfix_search_t};
use crate::state::sonarfix_mode_t;
use crate::status::{Result, sonarfix_status_t};

/// Attaches a search to a localizer, which from then on begins it when the verdict is Lost, and uses it in every call. A search is
/// attached to one localizer at a time.
///
/// @param localizer  an open localizer
/// @param search  an open search, which stays where it is until it is detached or the localizer is closed; NULL detaches the present one
/// @return SONARFIX_OK, or an error of a pointer or a handle
/// Threads: one at a time for the localizer and the search together, from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_attach_search(
    localizer: *mut sonarfix_localizer_t,
    search: *mut sonarfix_search_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        update(localizer, |tracker| {
            if !search.is_null() {
                held(search.cast_const())?;
            }
            tracker.attach(search);
            Ok(())
        })
    }
}

/// Declares the pose unknown and begins the search; the present pose is proposed to it.
///
/// @param localizer  an open localizer with a search
/// @return SONARFIX_OK; SONARFIX_ERROR_NO_SEARCH; or an error of the pointer or a handle
/// Threads: one at a time for the localizer and its search.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_search(
    localizer: *mut sonarfix_localizer_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        update(localizer, |tracker| {
            let (navigator, search) = tracker.searching()?;
            navigator.search(search);
            Ok(())
        })
    }
}

/// Begins the search of a localizer that was opened with sonarfix_start_unknown, anywhere on the map.
///
/// @param localizer  an open localizer with a search
/// @return SONARFIX_OK; SONARFIX_ERROR_NO_SEARCH; or an error of the pointer or a handle
/// Threads: one at a time for the localizer and its search.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_search_anywhere(
    localizer: *mut sonarfix_localizer_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { search_in(localizer, || Ok(None)) }
}

/// Begins the search of a localizer that was opened with sonarfix_start_unknown, in a part of the map.
///
/// @param localizer  an open localizer with a search
/// @param region  where the robot starts, metres in the map frame
/// @return SONARFIX_OK; SONARFIX_ERROR_NO_SEARCH; SONARFIX_ERROR_VALUE if the region is empty or not finite; or an error of a pointer or
///   a handle
/// Threads: one at a time for the localizer and its search.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_search_in(
    localizer: *mut sonarfix_localizer_t,
    region: *const sonarfix_region_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { search_in(localizer, || value(region)?.region().map(Some)) }
}

/// Begins a search.
///
/// # Safety
/// As of [`update`].
unsafe fn search_in(
    localizer: *mut sonarfix_localizer_t,
    region: impl FnOnce() -> Result<Option<Region>>,
) -> sonarfix_status_t {
    // SAFETY: by the caller.
    unsafe {
        update(localizer, |tracker| {
            let region = region()?;
            let (navigator, search) = tracker.searching()?;
            navigator.search_in(region, search);
            Ok(())
        })
    }
}

/// Works on the search while the pose is not confirmed, and changes the mode when it is time. To be called after each input, and
/// in any time that is left.
///
/// @param localizer  an open localizer with a search
/// @param evaluations  number of slices of work; one takes less than 0.1 ms on a Cortex-M4F at 168 MHz
/// @param mode  gets what determines the pose now
/// @return SONARFIX_OK; SONARFIX_ERROR_NO_SEARCH; or an error of a pointer or a handle
/// Threads: one at a time for the localizer and its search.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_work(
    localizer: *mut sonarfix_localizer_t,
    evaluations: u16,
    mode: *mut sonarfix_mode_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        change(localizer, mode, |tracker| {
            let (navigator, search) = tracker.searching()?;
            navigator.work(evaluations, search);
            Ok(navigator.mode().into())
        })
    }
}
