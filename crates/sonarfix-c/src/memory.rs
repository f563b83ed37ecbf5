//! Follows the pointers of a C program, after the checks that are possible.

#![expect(unsafe_code, reason = "the arguments of a C program are pointers")]

use core::mem::MaybeUninit;

use crate::status::{Result, sonarfix_status_t, status_of};

/// An object in memory of the caller.
///
/// # Safety
/// The type has the layout of bytes, and its first word lies at its beginning.
pub(crate) unsafe trait Handle: Sized {
    /// What it holds while it is open.
    type Held;
    /// The mark of an open one of this type.
    const MARK: u32;

    /// Its memory is large enough and aligned for what it holds.
    const FITS: () = assert!(
        size_of::<Slot<Self::Held>>() <= size_of::<Self>()
            && align_of::<Slot<Self::Held>>() <= align_of::<Self>()
    );
}

/// The content of the memory of a handle.
#[repr(C)]
pub(crate) struct Slot<T> {
    mark: u32,
    held: MaybeUninit<T>,
}

/// The mark of an open handle at this address: a copy of the handle at another address is not open.
fn mark_at<H: Handle>(at: *const H) -> u32 {
    let [b0, b1, b2, b3, ..] = (at.addr() as u64).to_le_bytes();
    H::MARK ^ u32::from_le_bytes([b0, b1, b2, b3])
}

fn check<T>(at: *const T) -> Result<()> {
    if at.is_null() {
        Err(sonarfix_status_t::SONARFIX_ERROR_NULL)
    } else if !at.is_aligned() {
        Err(sonarfix_status_t::SONARFIX_ERROR_MISALIGNED)
    } else {
        Ok(())
    }
}

/// The value that a pointer leads to.
///
/// # Safety
/// A pointer that passes [`check`] leads to a value, whose type is valid with any bits.
pub(crate) unsafe fn value<T: Copy>(at: *const T) -> Result<T> {
    check(at)?;
    // SAFETY: checked; otherwise by the caller.
    Ok(unsafe { at.read() })
}

/// The value that a pointer leads to, where it is.
///
/// # Safety
/// As of [`value`], and nothing changes it for `'a`.
pub(crate) unsafe fn borrowed<'a, T>(at: *const T) -> Result<&'a T> {
    check(at)?;
    // SAFETY: checked; otherwise by the caller.
    Ok(unsafe { &*at })
}

/// Changes the value that a pointer leads to, unless the change is an error.
///
/// # Safety
/// As of [`value`].
pub(crate) unsafe fn update_value<T: Copy>(
    at: *mut T,
    update: impl FnOnce(&mut T) -> Result<()>,
) -> sonarfix_status_t {
    let updated = || {
        // SAFETY: by the caller.
        let mut value = unsafe { value(at.cast_const()) }?;
        update(&mut value).map(|()| value)
    };
    // SAFETY: by the caller.
    unsafe { give(at, updated) }
}

/// The elements that a pointer leads to.
///
/// # Safety
/// A pointer that passes [`check`] leads to so many elements, which stay unchanged for `'a`.
pub(crate) unsafe fn slice<'a, T>(first: *const T, count: usize) -> Result<&'a [T]> {
    check(first)?;
    let largest = isize::MAX.unsigned_abs() / size_of::<T>();
    if count > largest {
        return Err(sonarfix_status_t::SONARFIX_ERROR_LENGTH);
    }
    // SAFETY: checked; otherwise by the caller.
    Ok(unsafe { core::slice::from_raw_parts(first, count) })
}

/// The elements that a pointer leads to, to be changed.
///
/// # Safety
/// A pointer that passes [`check`] leads to so many elements, which nothing else uses for `'a`.
pub(crate) unsafe fn slice_mut<'a, T>(first: *mut T, count: usize) -> Result<&'a mut [T]> {
    // SAFETY: by the caller.
    unsafe { slice(first.cast_const(), count) }?;
    // SAFETY: checked; otherwise by the caller.
    Ok(unsafe { core::slice::from_raw_parts_mut(first, count) })
}

/// The memory for the elements that a pointer leads to, which may be uninitialised.
///
/// # Safety
/// As of [`slice_mut`].
pub(crate) unsafe fn memory<'a, T>(
    first: *mut T,
    count: usize,
) -> Result<&'a mut [MaybeUninit<T>]> {
    // SAFETY: by the caller.
    unsafe { slice_mut(first.cast(), count) }
}

/// Writes a result, unless it is an error.
///
/// # Safety
/// A pointer that passes [`check`] leads to memory for the result.
pub(crate) unsafe fn give<T>(to: *mut T, result: impl FnOnce() -> Result<T>) -> sonarfix_status_t {
    let given = check(to).and_then(|()| result()).map(|result| {
        // SAFETY: checked; otherwise by the caller.
        unsafe { to.write(result) }
    });
    status_of(given)
}

/// What an open handle holds.
///
/// # Safety
/// A pointer that passes [`check`] leads to a handle, which nothing else changes for `'a`.
pub(crate) unsafe fn held<'a, H: Handle>(handle: *const H) -> Result<&'a H::Held> {
    check(handle)?;
    // SAFETY: checked, and the handle is large enough; otherwise by the caller.
    let slot = unsafe { &*handle.cast::<Slot<H::Held>>() };
    if slot.mark == mark_at(handle) {
        // SAFETY: `open` writes the mark after the value.
        Ok(unsafe { slot.held.assume_init_ref() })
    } else {
        Err(sonarfix_status_t::SONARFIX_ERROR_NOT_OPEN)
    }
}

/// The place of what an open handle holds.
///
/// # Safety
/// As of [`held`].
pub(crate) unsafe fn place<H: Handle>(handle: *mut H) -> Result<*mut H::Held> {
    // SAFETY: by the caller.
    unsafe { held(handle.cast_const()) }?;
    // SAFETY: it was checked.
    Ok(unsafe { place_in(handle) })
}

/// The place of what a handle holds, or is to hold.
///
/// # Safety
/// The pointer passes [`check`] and leads to the memory of a handle.
unsafe fn place_in<H: Handle>(handle: *mut H) -> *mut H::Held {
    // SAFETY: the handle is large enough.
    unsafe { &raw mut (*handle.cast::<Slot<H::Held>>()).held }.cast()
}

/// What an open handle holds, to be changed.
///
/// # Safety
/// A pointer that passes [`check`] leads to a handle, which nothing else uses for `'a`.
pub(crate) unsafe fn held_mut<'a, H: Handle>(handle: *mut H) -> Result<&'a mut H::Held> {
    // SAFETY: by the caller; it is open.
    Ok(unsafe { &mut *place(handle)? })
}

/// Reads from a handle.
///
/// # Safety
/// As of [`held`] and [`give`].
pub(crate) unsafe fn read<H: Handle, T>(
    handle: *const H,
    to: *mut T,
    read: impl FnOnce(&H::Held) -> Result<T>,
) -> sonarfix_status_t {
    // SAFETY: by the caller.
    unsafe { give(to, || read(held(handle)?)) }
}

/// Changes what a handle holds, and writes a result.
///
/// # Safety
/// As of [`held_mut`] and [`give`].
pub(crate) unsafe fn change<H: Handle, T>(
    handle: *mut H,
    to: *mut T,
    change: impl FnOnce(&mut H::Held) -> Result<T>,
) -> sonarfix_status_t {
    // SAFETY: by the caller.
    unsafe { give(to, || change(held_mut(handle)?)) }
}

/// Changes what a handle holds.
///
/// # Safety
/// As of [`held_mut`].
pub(crate) unsafe fn update<H: Handle>(
    handle: *mut H,
    update: impl FnOnce(&mut H::Held) -> Result<()>,
) -> sonarfix_status_t {
    // SAFETY: by the caller.
    status_of(unsafe { held_mut(handle) }.and_then(update))
}

/// Opens a handle with a value; one that is open already is replaced.
///
/// # Safety
/// A pointer that passes [`check`] leads to the memory of a handle, which nothing else uses.
#[inline]
pub(crate) unsafe fn open<H: Handle>(
    handle: *mut H,
    held: impl FnOnce() -> Result<H::Held>,
) -> sonarfix_status_t {
    let opened = check(handle).and_then(|()| held()).map(|held| {
        // SAFETY: it was checked.
        unsafe { place_in(handle).write(held) };
        // SAFETY: the value is in its place.
        unsafe { mark_open(handle) };
    });
    status_of(opened)
}

/// Opens a handle with a value that is built in its place. After an error the handle is closed.
///
/// # Safety
/// As of [`open`]. `build` writes the value, unless it is an error.
#[cfg(feature = "robot")]
pub(crate) unsafe fn open_in_place<H: Handle>(
    handle: *mut H,
    build: impl FnOnce(*mut H::Held) -> Result<()>,
) -> sonarfix_status_t {
    let opened = check(handle).and_then(|()| {
        // SAFETY: it was checked.
        unsafe { mark_closed(handle) };
        // SAFETY: it was checked.
        build(unsafe { place_in(handle) })
    });
    let opened = opened.map(|()| {
        // SAFETY: the value is in its place.
        unsafe { mark_open(handle) };
    });
    status_of(opened)
}

/// Marks a handle as open.
///
/// # Safety
/// The pointer passes [`check`] and leads to the memory of a handle, with its value.
unsafe fn mark_open<H: Handle>(handle: *mut H) {
    let () = H::FITS;
    // SAFETY: the mark is the first word.
    unsafe { handle.cast::<u32>().write(mark_at(handle)) };
}

/// Marks a handle as closed.
///
/// # Safety
/// The pointer passes [`check`] and leads to the memory of a handle.
unsafe fn mark_closed<H>(handle: *mut H) {
    // SAFETY: the mark is the first word.
    unsafe { handle.cast::<u32>().write(0) };
}

/// Closes an open handle.
///
/// # Safety
/// As of [`held_mut`].
pub(crate) unsafe fn close<H: Handle>(handle: *mut H) -> sonarfix_status_t {
    // SAFETY: by the caller.
    let closed = unsafe { held(handle.cast_const()) }.map(|_| {
        // SAFETY: it is open, and owns nothing that would have to be released.
        unsafe { mark_closed(handle) };
    });
    status_of(closed)
}

/// Makes a C structure the memory of a handle: `handle!(sonarfix_map_t: Map<'static>, *b"map ")`.
macro_rules! handle {
    ($name:ident: $held:ty, $mark:literal) => {
        // SAFETY: it consists of words.
        unsafe impl $crate::memory::Handle for $name {
            type Held = $held;
            const MARK: u32 = u32::from_le_bytes(*$mark);
        }
    };
}
pub(crate) use handle;
