
/// Which mutant is active: the number in the variable `SONARFIX_MUTANT`. With `SONARFIX_REACHED`, a file, none is, and the
/// numbers of those that are asked for are appended to it.
#[doc(hidden)]
#[allow(clippy::all, clippy::pedantic, missing_docs)]
pub mod mutant {
    extern crate std;
    use std::io::Write;
    use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

    const UNKNOWN: u32 = u32::MAX;
    const RECORDING: u32 = u32::MAX - 1;
    static ACTIVE: AtomicU32 = AtomicU32::new(UNKNOWN);
    static REACHED: [AtomicBool; 8192] = [const { AtomicBool::new(false) }; 8192];

    #[inline(always)]
    pub fn is(number: u32) -> bool {
        let active = ACTIVE.load(Relaxed);
        active == number || active >= RECORDING && is_first(number)
    }

    #[cold]
    #[inline(never)]
    fn is_first(number: u32) -> bool {
        if REACHED[number as usize].load(Relaxed) {
            return false;
        }
        let file = std::env::var("SONARFIX_REACHED");
        if ACTIVE.load(Relaxed) == UNKNOWN {
            let active = std::env::var("SONARFIX_MUTANT").ok().and_then(|text| text.parse().ok());
            ACTIVE.store(if file.is_ok() { RECORDING } else { active.unwrap_or(0) }, Relaxed);
            return is(number);
        }
        if !REACHED[number as usize].swap(true, Relaxed) {
            let file = std::fs::OpenOptions::new().append(true).create(true).open(file.unwrap());
            std::writeln!(file.unwrap(), "{number}").unwrap();
        }
        false
    }
}
