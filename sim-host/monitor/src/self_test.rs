//! A self-test of a board, from the telemetry of a robot that waits: what somebody with a board can send in.
//!
//! It reads neither port nor clock: telemetry and the time are arguments. The robot shows its devices
//! ([`Command::ShowDevices`](sonarfix_link::Command::ShowDevices)) with its wheels at rest, then stores a pose.

use std::fmt;
use std::time::Duration;

use sonarfix_link::message::{DeviceReadings, EncoderReading, FlashStatus, LoopStatus, Telemetry};
use sonarfix_link::{CommandResult, Hello, ReceiverCounters};

use sonarfix_telemetry::signs::difference;
use sonarfix_telemetry::view;

/// The largest error of a board's clock: that of an internal oscillator with some margin.
const CLOCK: f64 = 0.02;
/// The delay of a message may change by this time.
const JITTER: f64 = 0.03;
/// The least time over which the clocks are compared, seconds.
const LONG_ENOUGH: f64 = 5.0;
/// The largest difference of a pulse and its captured width, µs: the steps of both timers.
const CAPTURE: f64 = 3.0;
/// Readings in which the servo's pulses have not changed: 0.5 s, some frames.
const STEADY: u32 = 5;

/// A verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// As it should be.
    Passed,
    /// Not as it should be.
    Failed,
    /// Not known.
    NotTested,
}

/// A part of the board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Which one.
    pub part: &'static str,
    /// The verdict.
    pub verdict: Verdict,
    /// What was measured, or why it was not.
    pub what: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::Passed => "passed",
            Verdict::Failed => "FAILED",
            Verdict::NotTested => "not tested",
        };
        write!(f, "{:<14} {verdict:<11} {}", self.part, self.what)
    }
}

/// What was heard so far.
#[derive(Debug, Default)]
pub struct SelfTest {
    /// Whether the pulses of the servo are connected with the echo.
    is_looped: bool,
    hello: Option<Hello>,
    /// The first and the last time of the robot, with those of the PC, seconds.
    clocks: Option<[(f64, f64); 2]>,
    encoders: [Encoder; 2],
    servo: Servo,
    flash: Option<FlashStatus>,
    /// The answer to the pose, and the records before it.
    stored: Option<(CommandResult, Option<u32>)>,
    restarts: u32,
}

#[derive(Debug, Default)]
struct Encoder {
    readings: u32,
    unreadable: u32,
    first: Option<EncoderReading>,
    last: Option<EncoderReading>,
}

#[derive(Debug, Default)]
struct Servo {
    /// The widths of its pulses, µs, without repetition.
    widths: Vec<f32>,
    /// Readings since the width has changed.
    steady: u32,
    failed: u32,
    /// The largest difference of a captured width from that of the pulses, and how many were captured.
    difference: f64,
    captured: u32,
    pings: u32,
}

impl SelfTest {
    /// A test of a board whose echo pin is connected with that of the servo's pulses, or with its sonar.
    #[must_use]
    pub fn new(is_looped: bool) -> Self {
        Self { is_looped, ..Self::default() }
    }

    /// Takes a message that has arrived at this time since the test began.
    pub fn take(&mut self, telemetry: &Telemetry, now: Duration) {
        match telemetry {
            Telemetry::Hello(hello) => self.hello = Some(*hello),
            Telemetry::Devices(readings) => self.read(readings, now),
            Telemetry::LoopStatus(LoopStatus { flash, .. }) => self.flash = Some(*flash),
            _ => {}
        }
    }

    /// The number of records that the robot had written at its last report.
    #[must_use]
    pub fn writes(&self) -> Option<u32> {
        self.flash.map(|flash| flash.writes)
    }

    /// The robot has answered to a pose, which it stores; `before` are the records before it.
    pub fn answered(&mut self, result: CommandResult, before: Option<u32>) {
        self.stored = Some((result, before));
    }

    fn read(&mut self, readings: &DeviceReadings, now: Duration) {
        #[expect(clippy::cast_precision_loss, reason = "exact below 2^53 µs")]
        let robot = readings.at.ticks() as f64 * 1e-6;
        let here = (robot, now.as_secs_f64());
        match &mut self.clocks {
            Some([_, last]) if robot < last.0 => {
                self.restarts += 1;
                self.clocks = Some([here; 2]);
            }
            Some([_, last]) => *last = here,
            None => self.clocks = Some([here; 2]),
        }
        let [right, left] = &mut self.encoders;
        right.read(&readings.right);
        left.read(&readings.left);
        self.servo.read(readings);
    }

    /// What was found of each part.
    #[must_use]
    pub fn findings(&self, counters: &ReceiverCounters) -> Vec<Finding> {
        let [right, left] = &self.encoders;
        vec![
            self.board(),
            link(counters),
            self.clock(),
            right.finding("right encoder"),
            left.finding("left encoder"),
            self.servo.pulses(),
            self.servo.capture(self.is_looped),
            self.store(),
        ]
    }

    fn board(&self) -> Finding {
        let Some(hello) = &self.hello else {
            return finding("board", Verdict::Failed, "no Hello".to_owned());
        };
        let [major, minor, patch] = hello.firmware;
        let (map, robot) = (view::flashed(hello.map), view::flashed(hello.configuration));
        let (reset, restarts) = (view::reset(hello.reset), self.restarts);
        let what = format!(
            "{major}.{minor}.{patch}, map {map}, robot {robot}, started by {reset}, {restarts} restarts since"
        );
        finding("board", passed(restarts == 0), what)
    }

    fn clock(&self) -> Finding {
        let Some([(robot, here), (robot_end, here_end)]) = self.clocks else {
            return finding("clock", Verdict::NotTested, "no readings of the devices".to_owned());
        };
        let (robot, here) = (robot_end - robot, here_end - here);
        if here < LONG_ENOUGH {
            return finding("clock", Verdict::NotTested, format!("only {here:.1} s of readings"));
        }
        let (off, uncertain) = (robot / here - 1.0, JITTER / here);
        let what = format!(
            "{:+.3} % ± {:.3} % against this PC, {here:.0} s",
            100.0 * off,
            100.0 * uncertain
        );
        finding("clock", passed(off.abs() <= CLOCK + uncertain), what)
    }

    fn store(&self) -> Finding {
        let Some((result, before)) = self.stored else {
            return finding("flash", Verdict::NotTested, "no pose was stored".to_owned());
        };
        if let CommandResult::Refused(reason) = result {
            return finding("flash", Verdict::NotTested, format!("the pose is refused: {reason}"));
        }
        let Some((flash, before)) = self.flash.zip(before) else {
            return finding("flash", Verdict::NotTested, "no status of the loop".to_owned());
        };
        let written = flash.writes.wrapping_sub(before);
        let what = format!("{written} records written and read back, {} failures", flash.failures);
        finding("flash", passed(written > 0 && flash.failures == 0), what)
    }
}

impl Encoder {
    fn read(&mut self, reading: &EncoderReading) {
        self.readings += 1;
        self.unreadable += u32::from(reading.count.is_none());
        self.first.get_or_insert(*reading);
        self.last = Some(*reading);
    }

    /// At rest it counts nothing: an open or noisy line does.
    fn finding(&self, part: &'static str) -> Finding {
        let (Some(first), Some(last)) = (self.first, self.last) else {
            return finding(part, Verdict::NotTested, "no readings".to_owned());
        };
        let moved = first.count.zip(last.count).map(|(from, to)| difference(to, from, last.bits));
        let illegal = last.illegal.wrapping_sub(first.illegal);
        let what = format!(
            "{} edges at rest in {} readings, {} unreadable, {illegal} illegal transitions",
            moved.unwrap_or(0),
            self.readings,
            self.unreadable
        );
        finding(part, passed(moved == Some(0) && self.unreadable == 0 && illegal == 0), what)
    }
}

impl Servo {
    fn read(&mut self, readings: &DeviceReadings) {
        let Some(servo) = readings.servo else {
            self.failed += 1;
            return;
        };
        let is_same = self.widths.last().is_some_and(|last| (last - servo.micros).abs() < 0.1);
        self.steady = if is_same { self.steady + 1 } else { 0 };
        if !is_same {
            self.widths.push(servo.micros);
        }
        let Some(ping) = readings.ping.filter(|_| self.steady >= STEADY) else { return };
        self.pings += 1;
        if let Ok(echo) = ping {
            let flight = echo.heard.checked_duration_since(echo.sent).map_or(0, |it| it.ticks());
            #[expect(clippy::cast_precision_loss, reason = "a few milliseconds")]
            let off = (flight as f64 - f64::from(servo.micros)).abs();
            self.captured += 1;
            self.difference = self.difference.max(off);
        }
    }

    fn pulses(&self) -> Finding {
        let mut widths: Vec<i64> = self.widths.iter().map(|width| rounded(*width)).collect();
        widths.sort_unstable();
        widths.dedup();
        let (part, failed) = ("servo pulses", self.failed);
        let what = match widths.as_slice() {
            [] => {
                return finding(
                    part,
                    passed(failed == 0),
                    "no servo, or no configuration".to_owned(),
                );
            }
            [0] => "a sonar at a fixed bearing".to_owned(),
            several => format!("commanded {several:?} µs, {failed} times refused"),
        };
        finding(part, passed(failed == 0), what)
    }

    fn capture(&self, is_looped: bool) -> Finding {
        let (captured, pings) = (self.captured, self.pings);
        let part = "capture";
        if !is_looped {
            let what = format!("{captured} echoes in {pings} pings; --loop tests it by a wire");
            return finding(part, Verdict::NotTested, what);
        }
        let what = format!(
            "{captured} pulses of the servo in {pings} pings, each within {:.0} µs of its width",
            self.difference
        );
        finding(part, passed(captured > 0 && self.difference <= CAPTURE), what)
    }
}

fn link(counters: &ReceiverCounters) -> Finding {
    let (frames, skipped) = (counters.frames, counters.skipped());
    // The first frame may have begun before the test.
    let is_clean = frames > 0 && skipped <= 1;
    finding("link", passed(is_clean), format!("{frames} frames, {skipped} damaged"))
}

fn finding(part: &'static str, verdict: Verdict, what: String) -> Finding {
    Finding { part, verdict, what }
}

fn passed(is_passed: bool) -> Verdict {
    if is_passed { Verdict::Passed } else { Verdict::Failed }
}

#[expect(clippy::cast_possible_truncation, reason = "microseconds of a pulse")]
fn rounded(micros: f32) -> i64 {
    micros.round() as i64
}

#[cfg(test)]
mod tests {
    use sonarfix::geometry::units::{Duration as Span, Instant, Metres, Radians};
    use sonarfix_hal::ranger::{Echo, NoEcho};
    use sonarfix_link::message::{CommandError, ServoReading};

    use super::*;

    const RIGHT: EncoderReading =
        EncoderReading { count: Some(7), bits: 32, illegal: 0, metres_per_edge: 1e-4 };

    /// Readings of ten seconds by a clock that is fast by this part, with a pulse and what was captured of it.
    fn readings(fast: f64, count: impl Fn(u32) -> u32, captured: u64) -> SelfTest {
        let mut test = SelfTest::new(true);
        for number in 0..100_u32 {
            let seconds = 0.1 * f64::from(number);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small")]
            let at = Instant::from_ticks((1e6 * seconds * (1.0 + fast)) as u64);
            let micros = if number < 50 { 1_500.0 } else { 1_900.0 };
            let flight = Span::from_ticks(captured + if number < 50 { 1_500 } else { 1_900 });
            let echo = Echo { sent: at, heard: at + flight, range: Metres(0.3) };
            let devices = DeviceReadings {
                at,
                right: EncoderReading { count: Some(count(number)), ..RIGHT },
                left: RIGHT,
                servo: Some(ServoReading { bearing: Radians(0.0), micros }),
                ping: Some(if number % 3 == 0 { Err(NoEcho::Nothing) } else { Ok(echo) }),
            };
            test.take(&Telemetry::Devices(devices), Duration::from_secs_f64(seconds));
        }
        test
    }

    fn verdict(test: &SelfTest, part: &str) -> Verdict {
        let counters = ReceiverCounters { frames: 100, ..ReceiverCounters::default() };
        let findings = test.findings(&counters);
        findings.into_iter().find(|it| it.part == part).unwrap().verdict
    }

    #[test]
    fn a_good_board_passes_and_each_defect_fails_its_part() {
        let good = readings(0.001, |_| 7, 2);
        let parts = ["link", "clock", "right encoder", "left encoder", "servo pulses", "capture"];
        for part in parts {
            assert_eq!(verdict(&good, part), Verdict::Passed, "{part}");
        }
        assert_eq!(verdict(&readings(0.03, |_| 7, 2), "clock"), Verdict::Failed);
        assert_eq!(verdict(&readings(0.0, |number| number, 2), "right encoder"), Verdict::Failed);
        assert_eq!(verdict(&readings(0.0, |_| 7, 9), "capture"), Verdict::Failed);
        assert_eq!(verdict(&good, "board"), Verdict::Failed, "no Hello");
        let unplugged = SelfTest { is_looped: false, ..good };
        assert_eq!(verdict(&unplugged, "capture"), Verdict::NotTested);
    }

    #[test]
    fn a_record_more_without_a_failure_passes() {
        let of = |result, writes: u32, failures: u32| {
            let flash = Some(FlashStatus { writes, failures });
            let test = SelfTest { flash, stored: Some((result, Some(3))), ..SelfTest::default() };
            verdict(&test, "flash")
        };
        assert_eq!(of(CommandResult::Done, 4, 0), Verdict::Passed);
        assert_eq!(of(CommandResult::Done, 3, 0), Verdict::Failed);
        assert_eq!(of(CommandResult::Done, 4, 1), Verdict::Failed);
        let refused = CommandResult::Refused(CommandError::NoMap);
        assert_eq!(of(refused, 3, 0), Verdict::NotTested);
    }
}
