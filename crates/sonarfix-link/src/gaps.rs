//! Counts lost frames by their sequence numbers.

/// Counts the lost frames of one sender by the gaps in their sequence numbers.
///
/// It is separate from the receiver because commands may come from several senders with independent sequence
/// numbers; telemetry has one sender.
///
/// ```
/// use sonarfix_link::Gaps;
/// let mut gaps = Gaps::default();
/// for sequence in [65_533, 65_535, 1, 2] {
///     gaps.take(sequence);
/// }
/// assert_eq!(gaps.lost(), 1);
/// gaps.take(0); // the sender has restarted
/// assert_eq!((gaps.lost(), gaps.restarts()), (1, 1));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gaps {
    last: Option<u16>,
    lost: u32,
    restarts: u32,
}

impl Gaps {
    /// Records a frame; returns the number of frames lost before it.
    pub fn take(&mut self, sequence: u16) -> u32 {
        let lost = match self.last.replace(sequence) {
            None => 0,
            Some(_) if sequence == 0 => {
                self.restarts = self.restarts.saturating_add(1);
                0
            }
            Some(last) => between(last, sequence),
        };
        self.lost = self.lost.saturating_add(lost);
        lost
    }

    /// The number of lost frames.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// The number of restarts of the sender.
    #[must_use]
    pub fn restarts(&self) -> u32 {
        self.restarts
    }
}

/// The number of sequence numbers between two. They count from 1 to 65,535 and wrap to 1.
fn between(last: u16, sequence: u16) -> u32 {
    const PERIOD: u32 = u16::MAX as u32;
    let ahead = (u32::from(sequence) + PERIOD - u32::from(last)) % PERIOD;
    ahead.saturating_sub(1)
}
