//! The messages of a CARMEN log, one a line.

use std::f64::consts::{FRAC_PI_2, PI};

use sonarfix_sim::angle;
use sonarfix_sim::trace::Pose;

use crate::scan::Scan;

/// A line of the log.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    Odometry { time: f64, robot: Pose },
    Laser { time: f64, robot: Pose, laser: Pose, scan: Scan },
    Other,
}

/// Reads a line; `None` if it is a relevant message, but incomplete.
pub fn parse(line: &str) -> Option<Message> {
    let mut words = Words(line.split_ascii_whitespace());
    let message = match words.0.next().unwrap_or("#") {
        "O" => {
            let time = words.number()?;
            Message::Odometry { time, robot: words.pose()? }
        }
        "S" => {
            let time = words.number()?;
            let (robot, laser) = (words.pose()?, words.pose()?);
            let scan = half_turn(words.ranges()?);
            Message::Laser { time, robot, laser, scan }
        }
        "ODOM" => {
            let robot = words.pose()?;
            words.skip(3)?;
            Message::Odometry { time: words.timestamp()?, robot }
        }
        "FLASER" => {
            let scan = half_turn(words.ranges()?);
            let (laser, robot) = (words.pose()?, words.pose()?);
            Message::Laser { time: words.timestamp()?, robot, laser, scan }
        }
        "ROBOTLASER1" => {
            words.skip(1)?;
            let first = words.number()?;
            words.skip(1)?;
            let step = words.number()?;
            words.skip(3)?;
            let ranges = words.ranges()?;
            let remissions = words.count()?;
            words.skip(remissions)?;
            let (laser, robot) = (words.pose()?, words.pose()?);
            words.skip(5)?;
            let scan = Scan { first, step, ranges };
            Message::Laser { time: words.timestamp()?, robot, laser, scan }
        }
        _ => return Some(Message::Other),
    };
    words.0.next().is_none().then_some(message)
}

/// A scan over the half turn ahead, counter-clockwise: 180 or 360 beams leave out the last one,
/// 181 or 361 have both ends.
fn half_turn(ranges: Vec<f32>) -> Scan {
    #[expect(clippy::cast_precision_loss, reason = "a scan has thousands of beams, not 2^53")]
    let steps = (ranges.len() - ranges.len() % 2) as f64;
    Scan { first: -FRAC_PI_2, step: PI / steps.max(1.0), ranges }
}

struct Words<'a>(std::str::SplitAsciiWhitespace<'a>);

impl Words<'_> {
    fn number(&mut self) -> Option<f64> {
        self.0.next()?.parse().ok().filter(|number: &f64| number.is_finite())
    }

    fn count(&mut self) -> Option<usize> {
        self.0.next()?.parse().ok()
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        (0..count).try_for_each(|_| self.0.next().map(|_| ()))
    }

    fn pose(&mut self) -> Option<Pose> {
        let (x, y, heading) = (self.number()?, self.number()?, self.number()?);
        Some(Pose { x, y, heading: angle::wrap(heading) })
    }

    fn ranges(&mut self) -> Option<Vec<f32>> {
        let count = self.count()?;
        let mut ranges = Vec::new();
        for _ in 0..count {
            let range = self.number()?;
            #[expect(clippy::cast_possible_truncation, reason = "a scanner's millimetres")]
            ranges.push(range.max(0.0) as f32);
        }
        (!ranges.is_empty()).then_some(ranges)
    }

    /// The end of every CARMEN message: time sent, host, time logged.
    fn timestamp(&mut self) -> Option<f64> {
        let sent = self.number()?;
        self.skip(1)?;
        self.number()?;
        Some(sent)
    }
}
