//! Edges that hardware has stamped with a counter of its own, handed on when the loop comes by.
//!
//! A state machine, or a timer whose interrupt may come late, keeps the stamps of the last rising and
//! the last falling edge. Of several pulses between two readings only the last is seen, which is one
//! pulse for the boards of [`PulseRanger`](super::PulseRanger) and a loop that comes every few milliseconds.

use sonarfix::units::{Duration, Instant};

use super::EchoCapture;

/// What the hardware shows, in microseconds of its counter, which wraps around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stamps {
    /// The counter at the last rising edge.
    pub rise: u32,
    /// The counter at the last falling edge.
    pub fall: u32,
}

/// Tells an [`EchoCapture`] of edges by their stamps, in place of an interrupt.
///
/// ```
/// use sonarfix::units::{Duration, Instant};
/// use sonarfix_hal::ranger::{Captured, EchoCapture, EchoLine, StampedEdges, Stamps};
///
/// let capture = EchoCapture::new();
/// let mut line = Captured::new(&capture);
/// let mut edges = StampedEdges::since(Stamps { rise: 0, fall: 0 });
/// let Ok(()) = line.arm(Duration::from_ticks(100));
/// // The loop comes by at 9,000 µs of its own clock, which is 7,500 of the hardware's.
/// let now = Instant::from_ticks(9_000);
/// edges.tell(&capture, now, 7_500, Stamps { rise: 1_000, fall: 7_000 });
/// let Ok(pulse) = line.pulse(now);
/// assert_eq!(pulse.map(|pulse| pulse.rise), Some(Instant::from_ticks(2_500)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StampedEdges {
    /// The edges that were told.
    told: Stamps,
}

impl StampedEdges {
    /// Edges from now on: these are the stamps that the hardware shows before the first.
    #[must_use]
    pub const fn since(told: Stamps) -> Self {
        Self { told }
    }

    /// Tells of the edges that are new, the older first. `counter` is what the hardware's counter shows
    /// `now`, read after the stamps; stamps must be less than 71 minutes old.
    ///
    /// # Panics
    /// Never.
    pub fn tell(&mut self, capture: &EchoCapture, now: Instant, counter: u32, stamps: Stamps) {
        let age = |stamp: u32| counter.wrapping_sub(stamp);
        let at = |stamp| {
            let age = Duration::from_ticks(age(stamp).into());
            now.checked_sub_duration(age).unwrap_or(Instant::from_ticks(0))
        };
        let Stamps { rise, fall } = stamps;
        let (has_risen, has_fallen) = (rise != self.told.rise, fall != self.told.fall);
        let falls_first = age(fall) > age(rise);
        if has_fallen && falls_first {
            capture.fell(at(fall));
        }
        if has_risen {
            capture.rose(at(rise));
        }
        if has_fallen && !falls_first {
            capture.fell(at(fall));
        }
        self.told = stamps;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ranger::{Captured, EchoLine};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// What a line does: after so many microseconds it rises, and stays high for so many; it may fall
    /// and rise between two turns, and no more.
    fn any_pulses() -> impl Strategy<Value = Vec<(u32, u32)>> {
        prop::collection::vec((200..40_000_u32, 2_000..30_000_u32), 1..20)
    }

    proptest! {
        /// Told by stamps, whenever the loop comes by, a capture knows the pulses that an interrupt
        /// would have told it; and whether the line is high.
        #[test]
        fn stamps_tell_what_an_interrupt_would(
            pulses in any_pulses(),
            turns in prop::collection::vec(100..2_000_u64, 700..2_000),
            offset: u32,
        ) {
            let shortest = Duration::from_ticks(100);
            let (by_interrupt, by_stamps) = (EchoCapture::new(), EchoCapture::new());
            let mut lines = [Captured::new(&by_interrupt), Captured::new(&by_stamps)];
            for line in &mut lines {
                let Ok(()) = line.arm(shortest);
            }
            let mut edges = Vec::new();
            let mut end = 0_u64;
            for (wait, width) in pulses {
                let rise = end + u64::from(wait);
                end = rise + u64::from(width);
                edges.extend([(rise, true), (end, false)]);
            }
            let counter = |micros: u64| offset.wrapping_add(u32::try_from(micros).unwrap());
            let mut shown = Stamps { rise: offset, fall: offset };
            let mut stamped = StampedEdges::since(shown);
            let (mut now, mut seen, mut edges) = (0_u64, 0, edges.into_iter().peekable());
            for turn in turns {
                now += turn;
                while let Some((at, is_high)) = edges.next_if(|&(at, _)| at <= now) {
                    let stamp = if is_high { &mut shown.rise } else { &mut shown.fall };
                    *stamp = counter(at);
                    let at = Instant::from_ticks(at);
                    if is_high { by_interrupt.rose(at) } else { by_interrupt.fell(at) }
                }
                stamped.tell(&by_stamps, Instant::from_ticks(now), counter(now), shown);
                let at = Instant::from_ticks(now);
                let [by_interrupt, by_stamps] = lines.each_mut();
                prop_assert_eq!(by_interrupt.is_high(), by_stamps.is_high());
                let Ok(pulse) = by_interrupt.pulse(at);
                prop_assert_eq!(Ok(pulse), by_stamps.pulse(at));
                if pulse.is_some() {
                    seen += 1;
                    for line in &mut lines {
                        let Ok(()) = line.arm(shortest);
                    }
                }
            }
            // The first pulse ends within 70 ms, which 700 turns are at least.
            prop_assert!(seen > 0);
        }
    }
}
