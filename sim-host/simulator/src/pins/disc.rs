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
        #[expect(clippy::cast_possible_truncation, reason = "2^63 ticks are light years")]
        let target = (self.travelled / self.tick).floor() as i64;
        let step = (target - self.ticks).signum();
        while self.ticks != target {
            self.ticks += step;
            self.show(now, faults);
        }
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

#[cfg(test)]
mod tests {
    use super::super::faults::Faults;
    use super::*;
    use proptest::prelude::*;
    use sonarfix_hal::encoder::Counter;

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
                let Ok(count) = (&wires.count).count();
                let whole = (travelled / tick).floor();
                let counted = f64::from(count.cast_signed());
                prop_assert_eq!(counted.to_bits(), (whole + 0.0).to_bits());
            }
            prop_assert_eq!((&wires.count).illegal(), 0);
        }
    }
}
