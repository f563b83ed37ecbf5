//! A hash of all bits of a run.

use sonarfix_sim::trace::{FixRecord, Outcome, Pose, Tick, Trace};

/// Offset basis and prime of FNV-1a with 64 bits (Fowler, Noll, Vo; RFC 9923).
const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// The hash of a trace: of the bits of every number of its ticks and measurement cycles, truth, estimate, covariance and
/// bound included.
#[must_use]
pub fn of(trace: &Trace) -> u64 {
    let mut hash = Hash(BASIS);
    trace.ticks.iter().for_each(|tick| hash.tick(tick));
    trace.fixes.iter().for_each(|fix| hash.fix(fix));
    hash.0
}

struct Hash(u64);

impl Hash {
    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(PRIME);
        }
    }

    fn real(&mut self, value: f64) {
        self.bytes(&value.to_bits().to_le_bytes());
    }

    fn reals(&mut self, values: impl IntoIterator<Item = f64>) {
        values.into_iter().for_each(|value| self.real(value));
    }

    fn pose(&mut self, Pose { x, y, heading }: Pose) {
        self.reals([x, y, heading]);
    }

    fn tick(&mut self, tick: &Tick) {
        let Tick { time, truth, estimate, bound, odometry } = tick;
        self.real(*time);
        if let Some(truth) = truth {
            self.pose(truth.pose);
        }
        self.pose(estimate.pose);
        let calibrations = [Some(estimate.calibration), truth.and_then(|truth| truth.calibration)];
        for of in calibrations.into_iter().flatten() {
            self.reals([of.scale_right, of.scale_left, of.track_width, of.range_scale]);
        }
        self.reals(estimate.deviation);
        self.real(estimate.covariance_xy);
        self.reals(bound.iter().flatten().copied());
        self.pose(*odometry);
    }

    fn fix(&mut self, fix: &FixRecord) {
        self.real(fix.time);
        self.reals(fix.sonar);
        self.reals([fix.direction, fix.bearing]);
        self.reals(fix.range.into_iter().chain(fix.innovation).chain(fix.innovation_variance));
        let outcome = match fix.outcome {
            Outcome::Accepted => 0,
            Outcome::Downweighted => 1,
            Outcome::Gated => 2,
            Outcome::Refused => 3,
        };
        self.bytes(&[outcome]);
        self.bytes(fix.reason.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A test vector of the algorithm, and: one bit of one number changes the hash.
    #[test]
    fn every_bit_counts() {
        let mut hash = Hash(BASIS);
        hash.bytes(b"foobar");
        assert_eq!(hash.0, 0x8594_4171_f739_67e8);

        let tick = Tick {
            time: 1.0,
            truth: None,
            estimate: sonarfix_sim::trace::Estimate::default(),
            bound: None,
            odometry: Pose::default(),
        };
        let trace = |tick: Tick| Trace { ticks: vec![tick], ..Trace::default() };
        let mut other = tick;
        other.odometry.y = f64::from_bits(1);
        assert_ne!(of(&trace(tick)), of(&trace(other)));
    }
}
