//! Edges that hardware has time-stamped with its own counter, passed on by the loop.
//!
//! A state machine, or a timer with a slow interrupt, holds the stamps of the last rising and the last falling edge. Of
//! several pulses between two readings only the last is detected; a [`PulseRanger`](super::PulseRanger) generates at
//! most one pulse between two polls that are a few milliseconds apart.

use sonarfix::geometry::units::{Duration, Instant};

use super::EchoCapture;

/// The stamps of the hardware, in microseconds of its counter, which wraps around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stamps {
    /// The counter at the last rising edge.
    pub rise: u32,
    /// The counter at the last falling edge.
    pub fall: u32,
}

/// Passes edges to an [`EchoCapture`] by their stamps, in place of an interrupt.
///
/// ```
/// use sonarfix::geometry::units::{Duration, Instant};
/// use sonarfix_hal::ranger::{Captured, EchoCapture, EchoLine, StampedEdges, Stamps};
///
/// let capture = EchoCapture::new();
/// let mut line = Captured::new(&capture);
/// let mut edges = StampedEdges::since(Stamps { rise: 0, fall: 0 });
/// let Ok(()) = line.arm(Duration::from_ticks(100));
/// // The loop is polled at 9,000 µs of its own clock, which is 7,500 of the hardware's.
/// let now = Instant::from_ticks(9_000);
/// edges.update(&capture, now, 7_500, Stamps { rise: 1_000, fall: 7_000 });
/// let Ok(pulse) = line.pulse(now);
/// assert_eq!(pulse.map(|pulse| pulse.rise), Some(Instant::from_ticks(2_500)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StampedEdges {
    /// The edges that have been passed on.
    passed: Stamps,
}

impl StampedEdges {
    /// Starts with the stamps of the hardware before the first edge.
    #[must_use]
    pub const fn since(passed: Stamps) -> Self {
        Self { passed }
    }

    /// Passes the new edges on, the older first. `counter` is the hardware's counter at `now`, read after the stamps;
    /// stamps must be less than 71 minutes old.
    ///
    /// # Panics
    /// Never.
    pub fn update(&mut self, capture: &EchoCapture, now: Instant, counter: u32, stamps: Stamps) {
        let age = |stamp: u32| counter.wrapping_sub(stamp);
        let at = |stamp| {
            let age = Duration::from_ticks(age(stamp).into());
            now.checked_sub_duration(age).unwrap_or(Instant::from_ticks(0))
        };
        let Stamps { rise, fall } = stamps;
        let (has_risen, has_fallen) = (rise != self.passed.rise, fall != self.passed.fall);
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
        self.passed = stamps;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ranger::{Captured, EchoLine};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Pulses: the microseconds before each rising edge, and its width. Between two polls there is at most one falling and
    /// one rising edge.
    fn any_pulses() -> impl Strategy<Value = Vec<(u32, u32)>> {
        prop::collection::vec((200..40_000_u32, 2_000..30_000_u32), 1..20)
    }

    proptest! {
        /// A capture that is updated by stamps at any polls has the pulses and the level that it has by an interrupt.
        #[test]
        fn stamps_give_the_pulses_of_an_interrupt(
            pulses in any_pulses(),
            polls in prop::collection::vec(100..2_000_u64, 700..2_000),
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
            for poll in polls {
                now += poll;
                while let Some((at, is_high)) = edges.next_if(|&(at, _)| at <= now) {
                    let stamp = if is_high { &mut shown.rise } else { &mut shown.fall };
                    *stamp = counter(at);
                    let at = Instant::from_ticks(at);
                    if is_high { by_interrupt.rose(at) } else { by_interrupt.fell(at) }
                }
                stamped.update(&by_stamps, Instant::from_ticks(now), counter(now), shown);
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
            // The first pulse ends within 70 ms, the least duration of 700 polls.
            prop_assert!(seen > 0);
        }
    }
}
