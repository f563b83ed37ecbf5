//! The encoder disc of a wheel: converts the distance rolled to edges of two channels, which the
//! shipped decoder counts.

use sonarfix_hal::encoder::Quadrature;

use super::faults::{Edge, EncoderFaults};
use super::wires::{ChannelPin, EncoderWires};

/// Levels of A and B over the four ticks of a period, for a wheel rolling ahead (x4 decoding).
const LEVELS: [(bool, bool); 4] = [(false, false), (true, false), (true, true), (false, true)];

/// A disc with its decoder and its travel.
#[derive(Debug)]
pub struct EncoderDisc<'w> {
    wires: &'w EncoderWires,
    decoder: Quadrature<'w, ChannelPin<'w>, ChannelPin<'w>>,
    /// Travel per tick, metres; negative if it counts down as the robot drives ahead.
    tick: f64,
    travelled: f64,
    ticks: i64,
}

impl<'w> EncoderDisc<'w> {
    /// A disc at its first tick.
    #[must_use]
    pub fn new(wires: &'w EncoderWires, tick: f64) -> Self {
        let Ok(decoder) = Quadrature::new(ChannelPin(&wires.a), ChannelPin(&wires.b), &wires.count);
        Self { wires, decoder, tick, travelled: 0.0, ticks: 0 }
    }

    /// Rolls the wheel by a distance, metres, up to `now`, µs.
    pub fn roll(&mut self, metres: f64, now: u64, faults: &mut EncoderFaults) {
        self.travelled += metres;
        let target = whole(self.travelled / self.tick);
        if target == self.ticks {
            return;
        }
        let step = (target - self.ticks).signum();
        if !faults.may_disturb() {
            self.skip_periods(target);
        }
        while self.ticks != target {
            self.ticks += step;
            self.show(now, faults);
        }
    }

    /// Rolls over the whole periods up to a tick: each returns to the same levels and adds four ticks to the count.
    /// The decoder sees the edges of the rest.
    fn skip_periods(&mut self, target: i64) {
        let ticks = (target - self.ticks) / 4 * 4;
        self.ticks += ticks;
        self.wires.skipped.set(self.wires.skipped.get() + ticks);
    }

    /// Sets the wires to the levels of the tick; edges of both channels interrupt the controller.
    fn show(&mut self, now: u64, faults: &mut EncoderFaults) {
        let phase = usize::try_from(self.ticks.rem_euclid(4)).unwrap_or_default();
        let Some(&undisturbed) = LEVELS.get(phase) else {
            return;
        };
        let Edge { levels: (a, b), is_served } = faults.edge(now, undisturbed);
        self.wires.a.set(a);
        self.wires.b.set(b);
        if is_served {
            let Ok(()) = self.decoder.update();
        }
    }
}

/// The greatest integer up to `ticks`; without the call that `floor` is where the processor has no instruction for it.
#[expect(clippy::cast_possible_truncation, reason = "2^63 ticks are light years")]
#[expect(clippy::cast_precision_loss, reason = "a number that was an f64")]
fn whole(ticks: f64) -> i64 {
    let towards_zero = ticks as i64;
    if towards_zero as f64 > ticks { towards_zero - 1 } else { towards_zero }
}

#[cfg(test)]
mod tests {
    use super::super::faults::Faults;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// For any motion of the wheel the decoder counts the whole ticks of its travel, without
        /// an illegal edge.
        #[test]
        fn the_decoder_counts_the_direction(
            steps in prop::collection::vec(-0.05_f64..0.05, 1..40), reversed: bool,
        ) {
            let wires = EncoderWires::default();
            let tick = if reversed { -0.001 } else { 0.001 };
            let mut disc = EncoderDisc::new(&wires, tick);
            let [mut none, _] = Faults::new(&[], 0).encoders;
            let mut travelled = 0.0;
            for step in steps {
                disc.roll(step, 0, &mut none);
                travelled += step;
                let count = wires.counted(false).ticks;
                let whole = (travelled / tick).floor();
                let counted = f64::from(count.cast_signed());
                prop_assert_eq!(counted.to_bits(), (whole + 0.0).to_bits());
            }
            prop_assert_eq!(wires.counted(false).illegal, 0);
        }
    }
}
