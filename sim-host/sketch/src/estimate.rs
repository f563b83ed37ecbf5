//! The estimate of a program, from what it writes to its serial port: frames of the link, or lines of text.

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::health::Verdict;
use sonarfix::localizer::Start;
use sonarfix_link::{Receiver, Telemetry};

/// An estimate that a program has reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reported {
    /// The pose and its deviations.
    pub start: Start,
    /// The verdict.
    pub verdict: Verdict,
}

/// Finds estimates in the bytes of a serial port.
#[derive(Debug, Default)]
pub struct Listener {
    receiver: Receiver<Telemetry>,
    line: Vec<u8>,
}

impl Listener {
    /// Reads bytes; returns the last estimate in them, if there is one.
    pub fn hear(&mut self, bytes: &[u8]) -> Option<Reported> {
        let mut heard = None;
        for &byte in bytes {
            if let Some(frame) = self.receiver.push(byte)
                && let Telemetry::Estimate(estimate) = frame.message
            {
                let (state, deviation) = (estimate.state, estimate.deviation);
                let start = Start {
                    pose: Pose::new(state.x.0, state.y.0, state.heading),
                    position_deviation: deviation.x,
                    heading_deviation: deviation.heading,
                };
                heard = Some(Reported { start, verdict: estimate.health.verdict });
            }
            heard = self.end_line(byte).or(heard);
        }
        heard
    }

    fn end_line(&mut self, byte: u8) -> Option<Reported> {
        /// Longer than any line of an estimate.
        const LONGEST: usize = 100;
        if byte != b'\n' {
            if self.line.len() < LONGEST {
                self.line.push(byte);
            }
            return None;
        }
        let line = std::mem::take(&mut self.line);
        parse(std::str::from_utf8(&line).ok()?)
    }
}

/// Reads `pose X Y HEADING VERDICT`: metres, degrees, and the verdict by its name.
fn parse(line: &str) -> Option<Reported> {
    let mut words = line.strip_prefix("pose ")?.split_whitespace();
    let mut number = || words.next()?.parse::<f32>().ok();
    let (x, y, heading) = (number()?, number()?, number()?);
    let verdict = match words.next()? {
        "tracking" => Verdict::Tracking,
        "degraded" => Verdict::Degraded,
        _ => Verdict::Lost,
    };
    let start = Start {
        pose: Pose::new(x, y, Radians(heading.to_radians())),
        position_deviation: Metres(0.01),
        heading_deviation: Radians(0.01),
    };
    Some(Reported { start, verdict })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_an_estimate_once_it_has_ended() {
        let mut listener = Listener::default();
        assert_eq!(listener.hear(b"hello\npose 1.5 -2 90 degr"), None);
        let heard = listener.hear(b"aded\n");
        let heard = heard.map(|heard| (heard.start.pose.x.0, heard.start.pose.y.0, heard.verdict));
        assert_eq!(heard, Some((1.5, -2.0, Verdict::Degraded)));
    }
}
