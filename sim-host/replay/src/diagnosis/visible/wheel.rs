//! One encoder.

use crate::diagnosis::finding::{Finding, SHOWN};

/// What its records show.
#[derive(Debug)]
pub struct Wheel {
    /// Metres.
    pub per_count: f64,
    max_speed: f64,
    last: Option<f64>,
    /// Plausible travel, metres: its length, and forward less backward.
    pub travelled: f64,
    pub signed: f64,
    /// Whether its value has ever changed.
    pub has_changed: bool,
    /// The largest travel against the largest possible one.
    excess: f64,
    steps: u64,
    jumps: Vec<(u64, f64, Jump)>,
    all_jumps: u64,
    /// Since when it has not moved: the line, the time, and the way of the other wheel since.
    standing: Option<(u64, f64, f64)>,
    /// The stretch in which it did not move while the other one drove around it: its first line, and the times.
    stopped: Option<(u64, f64, f64)>,
    stopped_way: f64,
    /// The travel when it last moved.
    moved_at: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Jump {
    /// A counter of so many bits has overflowed.
    Wrap(u32),
    /// It begins again at zero.
    Reset,
    /// By so many counts or metres.
    Other(f64),
}

impl Wheel {
    pub fn new(per_count: f64, max_speed: f64) -> Self {
        Self {
            per_count,
            max_speed,
            last: None,
            travelled: 0.0,
            signed: 0.0,
            has_changed: false,
            excess: 0.0,
            steps: 0,
            jumps: Vec::new(),
            all_jumps: 0,
            standing: None,
            stopped: None,
            stopped_way: 0.0,
            moved_at: 0.0,
        }
    }

    pub fn add(
        &mut self,
        line: u64,
        time: f64,
        value: f64,
        unit: f64,
        elapsed: f64,
        is_count: bool,
    ) {
        let Some(last) = self.last.replace(value) else { return };
        self.steps += 1;
        let change = value - last;
        self.has_changed |= change != 0.0;
        let most = 1.2 * self.max_speed * elapsed.max(0.0) / unit;
        if elapsed <= 0.0 || change.abs() <= most {
            self.travelled += unit * change.abs();
            self.signed += unit * change;
            return;
        }
        self.all_jumps += 1;
        self.excess = self.excess.max(1.2 * change.abs() / most);
        let wrap = [8, 16, 32].into_iter().find(|&bits| {
            let period = 2_f64.powi(bits);
            let is_within = value.abs() <= period && last.abs() <= period;
            is_count && is_within && (change.abs() - period).abs() <= most.max(1.0)
        });
        let jump = match wrap {
            Some(bits) => Jump::Wrap(bits.unsigned_abs()),
            None if value.abs() <= most.max(1.0).min(0.1 * last.abs()) => Jump::Reset,
            None => Jump::Other(change),
        };
        if self.jumps.len() < SHOWN {
            self.jumps.push((line, time, jump));
        }
    }

    /// Notes whether it stands while the other wheel has moved by `other`, metres.
    pub fn stand(&mut self, line: u64, time: f64, other: f64, circle: f64) {
        let travelled = self.travelled;
        let standing = self.standing.get_or_insert((line, time, 0.0));
        if travelled > self.moved_at {
            self.moved_at = travelled;
            *standing = (line, time, 0.0);
            return;
        }
        standing.2 += other;
        if standing.2 > circle && standing.2 > self.stopped_way {
            self.stopped_way = standing.2;
            self.stopped = Some((standing.0, standing.1, time));
        }
    }

    /// Whether it is often faster than it can be.
    pub fn is_often_too_fast(&self) -> bool {
        20 * self.all_jumps > self.steps
    }

    /// How many times as fast as it can be it is at most.
    pub fn excess(&self) -> f64 {
        self.excess
    }

    pub fn findings(&self, side: &str, findings: &mut Vec<Finding>) {
        if let Some((line, from, to)) = self.stopped {
            findings.push(Finding::at(
                line,
                "encoder_stopped",
                format!(
                    "the {side} encoder has the same value from {from:.1} s to {to:.1} s, while the other wheel drives {:.1} m",
                    self.stopped_way
                ),
                format!("check the cable and the supply of the {side} encoder"),
            ));
        }
        // With many of them the unit is wrong, which the causes find.
        if self.is_often_too_fast() {
            return;
        }
        for (line, time, jump) in &self.jumps {
            let (id, what, remedy) = match jump {
                Jump::Wrap(bits) => (
                    "counter_overflow",
                    format!("the {side} counter of {bits} bits overflows"),
                    "add the counts to a wider counter before they are logged".to_owned(),
                ),
                Jump::Reset => (
                    "counter_reset",
                    format!("the {side} counter begins again at zero"),
                    "the robot was reset, or the counter is cleared: log sums that never are"
                        .to_owned(),
                ),
                Jump::Other(change) => (
                    "counter_jump",
                    format!("the {side} encoder jumps by {change:.6}, faster than max_wheel_speed"),
                    "counts were lost or a line is damaged; or max_wheel_speed is too low"
                        .to_owned(),
                ),
            };
            let message = format!("{what} at {time:.3} s");
            findings.push(Finding::at(*line, id, message, remedy));
        }
    }
}
