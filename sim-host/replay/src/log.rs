//! The log format, one record a line (`docs/formats.md`, "Logs").

use sonarfix::config::{MAX_RANGERS, RangerId};
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Radians;
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};
use sonarfix_search::navigator::Mode;
use sonarfix_sim::trace::Pose;

use crate::scan::Scan;

/// The first line of a log.
pub const HEADER: &str = "sonarfix-log,1";

/// Largest valid time, seconds: 300 years, so that microseconds stay exact in `f64`.
const TIME_LIMIT: f64 = 1e10;

/// One line of a log. Times in seconds.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// Encoder counts, cumulative.
    Ticks {
        /// Time of the reading.
        time: f64,
        /// Count of the right wheel.
        right: i64,
        /// Count of the left wheel.
        left: i64,
    },
    /// Wheel travel, cumulative.
    Wheels {
        /// Time of the reading.
        time: f64,
        /// Travel of the right wheel, metres.
        right: f64,
        /// Travel of the left wheel, metres.
        left: f64,
    },
    /// The gyro at the end of a step, before the wheel travel of the same time.
    Turn {
        /// Time of the reading.
        time: f64,
        /// The angle since the start, 2⁻⁴⁰ rad.
        angle: i64,
        /// Interruptions since the start; `None` while the rate is not known.
        breaks: Option<u32>,
    },
    /// One range.
    Range {
        /// Time of the reflection.
        time: f64,
        /// Bearing of the sonar, radians from the heading.
        bearing: f64,
        /// The range, metres; `None` without an echo.
        range: Option<f64>,
        /// The index of the wall that the robot aimed at; `None` if not recorded.
        wall: Option<u32>,
        /// The ranger.
        ranger: RangerId,
    },
    /// A heading, position or pose from outside.
    Absolute {
        /// When the localizer took it.
        time: f64,
        /// How long before it was measured, seconds.
        age: f64,
        /// The measurement.
        measurement: AbsoluteMeasurement,
    },
    /// A measurement cycle without a measurable wall.
    Skip {
        /// Time.
        time: f64,
    },
    /// One scan.
    Scan {
        /// Time of the scan.
        time: f64,
        /// The scan.
        scan: Scan,
    },
    /// The initial estimate of the localizer.
    Start {
        /// Time of this estimate.
        time: f64,
        /// The pose.
        pose: Pose,
        /// Standard deviation of x and of y, metres.
        position_deviation: f64,
        /// Standard deviation of the heading, radians.
        heading_deviation: f64,
    },
    /// A pose that replaces that of the running localizer; its calibration is unchanged.
    Pose {
        /// Time of the pose.
        time: f64,
        /// The pose.
        pose: Pose,
        /// Standard deviation of x and of y, metres.
        position_deviation: f64,
        /// Standard deviation of the heading, radians.
        heading_deviation: f64,
    },
    /// The robot's mode has changed; its estimate then.
    Mode {
        /// Time of the change.
        time: f64,
        /// The new mode.
        mode: Mode,
        /// All states, in the filter's order.
        state: [f64; 7],
        /// Their standard deviations.
        deviation: [f64; 7],
    },
    /// The initial estimate of the localizer, with its calibration.
    Resume {
        /// Time of this estimate.
        time: f64,
        /// All states, in the filter's order.
        state: [f64; 7],
        /// Their standard deviations.
        deviation: [f64; 7],
    },
}

impl Record {
    /// Its time, seconds.
    #[must_use]
    pub fn time(&self) -> f64 {
        match *self {
            Self::Ticks { time, .. }
            | Self::Wheels { time, .. }
            | Self::Turn { time, .. }
            | Self::Range { time, .. }
            | Self::Absolute { time, .. }
            | Self::Skip { time }
            | Self::Scan { time, .. }
            | Self::Start { time, .. }
            | Self::Pose { time, .. }
            | Self::Mode { time, .. }
            | Self::Resume { time, .. } => time,
        }
    }
}

/// Why a line cannot be parsed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Malformed {
    /// The file ends inside the line.
    #[error("the line is truncated: the file ends before its newline")]
    Torn,
    /// It is a checksum of other lines than those before it.
    #[error("lines before it are torn or changed: their checksum is another")]
    Changed,
    /// The file ends before the end of the recording.
    #[error("the end of the recording is missing: it is torn")]
    NoEnd,
    /// It is longer than [`LONGEST`](crate::lines::LONGEST).
    #[error("the line is longer than 1 MiB")]
    TooLong,
    /// It is not text.
    #[error("the line is not UTF-8 text")]
    NotText,
    /// Its kind is unknown.
    #[error(
        "`{0}` is not one of ticks, wheels, turn, range, scan, skip, heading, position, measured_pose, start, resume, pose, mode"
    )]
    UnknownKind(String),
    /// It ends too early.
    #[error("the {0} is missing")]
    Missing(&'static str),
    /// It has too many fields.
    #[error("there are more fields than a record of this kind has")]
    TooManyFields,
    /// A field has a wrong value.
    #[error("the {field} is `{text}`, which is not {rule}")]
    Field {
        /// The field.
        field: &'static str,
        /// Its text, or the beginning of it.
        text: String,
        /// The rule that it violates.
        rule: &'static str,
    },
}

/// Reads a line; `None` if it is empty or a comment.
///
/// # Errors
/// [`Malformed`], with the reason.
pub fn parse(line: &str) -> Result<Option<Record>, Malformed> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let mut fields = Fields::of(line);
    let kind = fields.next("kind")?;
    let record = match kind {
        "ticks" => Record::Ticks {
            time: fields.time()?,
            right: fields.count("right count")?,
            left: fields.count("left count")?,
        },
        "wheels" => Record::Wheels {
            time: fields.time()?,
            right: fields.number("right travel")?,
            left: fields.number("left travel")?,
        },
        "turn" => Record::Turn {
            time: fields.time()?,
            angle: fields.count("angle")?,
            breaks: fields.breaks()?,
        },
        "range" => Record::Range {
            time: fields.time()?,
            bearing: fields.number("bearing")?,
            range: fields.range()?,
            wall: fields.wall()?,
            ranger: fields.ranger()?,
        },
        "heading" => {
            let time = fields.time()?;
            let angle = Radians(fields.single("heading")?);
            let deviation = Radians(fields.single("deviation of the heading")?);
            let measurement = AbsoluteMeasurement::Heading { angle, deviation };
            Record::Absolute { time, age: fields.age()?, measurement }
        }
        "position" => {
            let time = fields.time()?;
            let point = Point::new(fields.single("x")?, fields.single("y")?);
            let noise = fields.position_noise()?;
            let measurement = AbsoluteMeasurement::Position { point, noise };
            Record::Absolute { time, age: fields.age()?, measurement }
        }
        "measured_pose" => {
            let time = fields.time()?;
            let (x, y) = (fields.single("x")?, fields.single("y")?);
            let pose =
                sonarfix::geometry::pose::Pose::new(x, y, Radians(fields.single("heading")?));
            let noise = PoseNoise {
                position: fields.position_noise()?,
                xh: fields.single("covariance of x and heading")?,
                yh: fields.single("covariance of y and heading")?,
                hh: fields.single("variance of the heading")?,
            };
            let measurement = AbsoluteMeasurement::Pose { pose, noise };
            Record::Absolute { time, age: fields.age()?, measurement }
        }
        "skip" => Record::Skip { time: fields.time()? },
        "scan" => Record::Scan { time: fields.time()?, scan: fields.scan()? },
        "start" => Record::Start {
            time: fields.time()?,
            pose: fields.pose()?,
            position_deviation: fields.deviation("deviation of the position")?,
            heading_deviation: fields.deviation("deviation of the heading")?,
        },
        "pose" => Record::Pose {
            time: fields.time()?,
            pose: fields.pose()?,
            position_deviation: fields.deviation("deviation of the position")?,
            heading_deviation: fields.deviation("deviation of the heading")?,
        },
        "resume" => Record::Resume {
            time: fields.time()?,
            state: fields.states(Fields::number)?,
            deviation: fields.states(Fields::deviation)?,
        },
        "mode" => Record::Mode {
            time: fields.time()?,
            mode: fields.mode()?,
            state: fields.states(Fields::number)?,
            deviation: fields.states(Fields::deviation)?,
        },
        other => return Err(Malformed::UnknownKind(beginning(other))),
    };
    fields.end()?;
    Ok(Some(record))
}

/// The fields of a line, separated by commas.
pub(crate) struct Fields<'a> {
    fields: std::str::Split<'a, char>,
}

impl<'a> Fields<'a> {
    pub fn of(line: &'a str) -> Self {
        Self { fields: line.split(',') }
    }

    fn next(&mut self, field: &'static str) -> Result<&'a str, Malformed> {
        let text = self.fields.next().ok_or(Malformed::Missing(field))?;
        Ok(text.trim())
    }

    pub fn end(mut self) -> Result<(), Malformed> {
        match self.fields.next() {
            None => Ok(()),
            Some(_) => Err(Malformed::TooManyFields),
        }
    }

    pub fn number(&mut self, field: &'static str) -> Result<f64, Malformed> {
        let text = self.next(field)?;
        number(text).ok_or_else(|| not(field, text, "a finite number"))
    }

    pub fn time(&mut self) -> Result<f64, Malformed> {
        let text = self.next("time")?;
        number(text)
            .filter(|time| time.abs() <= TIME_LIMIT)
            .ok_or_else(|| not("time", text, "a number of seconds within 300 years"))
    }

    fn deviation(&mut self, field: &'static str) -> Result<f64, Malformed> {
        let text = self.next(field)?;
        number(text)
            .filter(|&sigma| sigma >= 0.0)
            .ok_or_else(|| not(field, text, "a finite number, zero or positive"))
    }

    fn pose(&mut self) -> Result<Pose, Malformed> {
        Ok(Pose { x: self.number("x")?, y: self.number("y")?, heading: self.number("heading")? })
    }

    /// A number for the robot, which computes in `f32`.
    fn single(&mut self, field: &'static str) -> Result<f32, Malformed> {
        let text = self.next(field)?;
        #[expect(clippy::cast_possible_truncation, reason = "the robot computes in f32")]
        let value = number(text).map(|value| value as f32);
        value
            .filter(|v| v.is_finite())
            .ok_or_else(|| not(field, text, "a finite number below 3e38"))
    }

    fn position_noise(&mut self) -> Result<PositionNoise, Malformed> {
        Ok(PositionNoise {
            xx: self.single("variance of x")?,
            xy: self.single("covariance of x and y")?,
            yy: self.single("variance of y")?,
        })
    }

    /// The age of a measurement, if there is such a field.
    fn age(&mut self) -> Result<f64, Malformed> {
        let Some(text) = self.fields.next() else {
            return Ok(0.0);
        };
        let text = text.trim();
        number(text)
            .filter(|age| (0.0..=TIME_LIMIT).contains(age))
            .ok_or_else(|| not("age", text, "a number of seconds from 0 to 300 years"))
    }

    fn count(&mut self, field: &'static str) -> Result<i64, Malformed> {
        let text = self.next(field)?;
        text.parse().map_err(|_| not(field, text, "a whole number"))
    }

    fn range(&mut self) -> Result<Option<f64>, Malformed> {
        let text = self.next("range")?;
        if text.is_empty() {
            return Ok(None);
        }
        let range = number(text).filter(|&range| range > 0.0);
        let rule = "a positive number, or empty for no echo";
        range.map(Some).ok_or_else(|| not("range", text, rule))
    }

    /// The wall that was looked at, if there is such a field.
    fn wall(&mut self) -> Result<Option<u32>, Malformed> {
        let Some(text) = self.fields.next() else {
            return Ok(None);
        };
        let text = text.trim();
        if text.is_empty() {
            return Ok(None);
        }
        text.parse().map(Some).map_err(|_| not("wall", text, "a whole number, from 0"))
    }

    /// The ranger that measured, if there is such a field; otherwise the first.
    fn ranger(&mut self) -> Result<RangerId, Malformed> {
        let Some(text) = self.fields.next() else {
            return Ok(RangerId::FIRST);
        };
        let text = text.trim();
        let number = text.parse().ok().filter(|number| usize::from(*number) < MAX_RANGERS);
        number.map(RangerId).ok_or_else(|| not("ranger", text, "a whole number, from 0 to 2"))
    }

    fn breaks(&mut self) -> Result<Option<u32>, Malformed> {
        let text = self.next("number of interruptions")?;
        if text.is_empty() {
            return Ok(None);
        }
        let rule = "a whole number from 0, or empty";
        text.parse().map(Some).map_err(|_| not("number of interruptions", text, rule))
    }

    fn mode(&mut self) -> Result<Mode, Malformed> {
        let text = self.next("mode")?;
        match text {
            "tracking" => Ok(Mode::Tracking),
            "searching" => Ok(Mode::Searching),
            "provisional" => Ok(Mode::Provisional),
            _ => Err(not("mode", text, "one of tracking, searching, provisional")),
        }
    }

    /// A number for each state.
    fn states(
        &mut self,
        mut field: impl FnMut(&mut Self, &'static str) -> Result<f64, Malformed>,
    ) -> Result<[f64; 7], Malformed> {
        let mut values = [0.0; 7];
        for (value, state) in values.iter_mut().zip(sonarfix_sim::STATES) {
            *value = field(self, state)?;
        }
        Ok(values)
    }

    fn scan(&mut self) -> Result<Scan, Malformed> {
        let first = self.number("first bearing")?;
        let step = self.number("step")?;
        let beam = |text: &str| {
            if text == "-" {
                return Ok(0.0);
            }
            let range: Option<f32> = text.parse().ok();
            range
                .filter(|range| range.is_finite() && *range >= 0.0)
                .ok_or_else(|| not("range of a beam", text, "a number, zero or positive, or -"))
        };
        let ranges = self.next("list of ranges")?.split_ascii_whitespace().map(beam);
        let ranges: Vec<f32> = ranges.collect::<Result<_, _>>()?;
        if ranges.is_empty() {
            return Err(Malformed::Missing("list of ranges"));
        }
        Ok(Scan { first, step, ranges })
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

fn not(field: &'static str, text: &str, rule: &'static str) -> Malformed {
    Malformed::Field { field, text: beginning(text), rule }
}

/// The beginning of a text, escaped for printing.
fn beginning(text: &str) -> String {
    const SHOWN: usize = 24;
    let mut shown: String = text.chars().take(SHOWN).flat_map(char::escape_default).collect();
    if text.chars().nth(SHOWN).is_some() {
        shown.push('…');
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ranger is behind the wall, which may be empty.
    #[test]
    fn a_range_may_have_a_ranger() {
        let read = |line: &str| parse(line).unwrap();
        for (line, expected) in [
            ("range,3,-1.5,2,7,1", (Some(7), RangerId(1))),
            ("range,3,-1.5,2,,2", (None, RangerId(2))),
            ("range,3,-1.5,2,7", (Some(7), RangerId::FIRST)),
        ] {
            let Some(Record::Range { wall, ranger, .. }) = read(line) else { panic!("{line}") };
            assert_eq!((wall, ranger), expected, "{line}");
        }
    }

    #[test]
    fn every_kind_of_record_is_read() {
        let range = |range, wall| {
            let (time, bearing, ranger) = (3.0, -1.5, RangerId::FIRST);
            Record::Range { time, bearing, range, wall, ranger }
        };
        let cases = [
            (
                "ticks,0.25,-12,9007199254740993",
                Record::Ticks { time: 0.25, right: -12, left: 9_007_199_254_740_993 },
            ),
            (
                " wheels , 1e1 , 0.5 , -0.25 ",
                Record::Wheels { time: 10.0, right: 0.5, left: -0.25 },
            ),
            ("range,3,-1.5,2.25", range(Some(2.25), None)),
            ("range,3,-1.5,", range(None, None)),
            ("range,3,-1.5,,7", range(None, Some(7))),
            ("skip,3.5", Record::Skip { time: 3.5 }),
            (
                "heading,3,1.5,0.25",
                Record::Absolute {
                    time: 3.0,
                    age: 0.0,
                    measurement: AbsoluteMeasurement::Heading {
                        angle: Radians(1.5),
                        deviation: Radians(0.25),
                    },
                },
            ),
            (
                "position,3,1,-2,0.25,0.125,0.5,0.03",
                Record::Absolute {
                    time: 3.0,
                    age: 0.03,
                    measurement: AbsoluteMeasurement::Position {
                        point: Point::new(1.0, -2.0),
                        noise: PositionNoise { xx: 0.25, xy: 0.125, yy: 0.5 },
                    },
                },
            ),
            (
                "measured_pose,3,1,-2,0.5,4,5,6,7,8,9,0",
                Record::Absolute {
                    time: 3.0,
                    age: 0.0,
                    measurement: AbsoluteMeasurement::Pose {
                        pose: sonarfix::geometry::pose::Pose::new(1.0, -2.0, Radians(0.5)),
                        noise: PoseNoise {
                            position: PositionNoise { xx: 4.0, xy: 5.0, yy: 6.0 },
                            xh: 7.0,
                            yh: 8.0,
                            hh: 9.0,
                        },
                    },
                },
            ),
            (
                "resume,2,1,2,3,4,5,6,7,8,9,10,11,12,13,0",
                Record::Resume {
                    time: 2.0,
                    state: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0],
                    deviation: [8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 0.0],
                },
            ),
            (
                "scan,4,-0.5,0.25,1.5  - 0 2",
                Record::Scan {
                    time: 4.0,
                    scan: Scan { first: -0.5, step: 0.25, ranges: vec![1.5, 0.0, 0.0, 2.0] },
                },
            ),
            (
                "pose,7,1,-2,3,0.01,0.02",
                Record::Pose {
                    time: 7.0,
                    pose: Pose { x: 1.0, y: -2.0, heading: 3.0 },
                    position_deviation: 0.01,
                    heading_deviation: 0.02,
                },
            ),
            (
                "start,0,1,-2,3,0.01,0.02",
                Record::Start {
                    time: 0.0,
                    pose: Pose { x: 1.0, y: -2.0, heading: 3.0 },
                    position_deviation: 0.01,
                    heading_deviation: 0.02,
                },
            ),
        ];
        for (line, record) in cases {
            assert_eq!(parse(line), Ok(Some(record)), "{line}");
        }
        for nothing in ["", "   ", "# ticks,1,2", "  #"] {
            assert_eq!(parse(nothing), Ok(None), "{nothing:?}");
        }
    }

    #[test]
    fn every_malformed_line_has_its_error() {
        let cases = [
            (
                "tick,1,2,3",
                "`tick` is not one of ticks, wheels, turn, range, scan, skip, heading, position, measured_pose, start, resume, pose, mode",
            ),
            ("heading,1,1e39,1", "the heading is `1e39`, which is not a finite number below 3e38"),
            ("heading,1,2", "the deviation of the heading is missing"),
            (
                "heading,1,2,3,-1",
                "the age is `-1`, which is not a number of seconds from 0 to 300 years",
            ),
            ("position,1,2,3,4,5", "the variance of y is missing"),
            ("measured_pose,1,2,3,4,5,6,7,8,9", "the variance of the heading is missing"),
            ("range,1,2,3,x", "the wall is `x`, which is not a whole number, from 0"),
            ("range,1,2,3,4,5", "the ranger is `5`, which is not a whole number, from 0 to 2"),
            ("range,1,2,3,4,1,5", "there are more fields than a record of this kind has"),
            ("resume,1,2,3,4,5,6,7,8", "the x is missing"),
            (
                "resume,2,1,2,3,4,5,6,7,8,9,-10,11,12,13,0",
                "the heading is `-10`, which is not a finite number, zero or positive",
            ),
            ("ticks,1,2", "the left count is missing"),
            ("ticks,1,2,3,4", "there are more fields than a record of this kind has"),
            ("ticks,1,2.5,3", "the right count is `2.5`, which is not a whole number"),
            ("ticks", "the time is missing"),
            ("wheels,1,nan,0", "the right travel is `nan`, which is not a finite number"),
            ("wheels,x,1,0", "the time is `x`, which is not a number of seconds within 300 years"),
            (
                "wheels,1e300,1,0",
                "the time is `1e300`, which is not a number of seconds within 300 years",
            ),
            ("range,1,2", "the range is missing"),
            (
                "range,1,2,-3",
                "the range is `-3`, which is not a positive number, or empty for no echo",
            ),
            ("range,1,inf,3", "the bearing is `inf`, which is not a finite number"),
            ("scan,1,0,0.1", "the list of ranges is missing"),
            ("scan,1,0,0.1,  ", "the list of ranges is missing"),
            (
                "scan,1,0,0.1,1 -2",
                "the range of a beam is `-2`, which is not a number, zero or positive, or -",
            ),
            (
                "start,0,0,0,0,-1,0",
                "the deviation of the position is `-1`, which is not a finite number, zero or positive",
            ),
            ("start,0,0,0,0,1", "the deviation of the heading is missing"),
            (
                "\u{1b}[31m,0",
                "`\\u{1b}[31m` is not one of ticks, wheels, turn, range, scan, skip, heading, position, measured_pose, start, resume, pose, mode",
            ),
        ];
        for (line, reason) in cases {
            let malformed = parse(line).unwrap_err().to_string();
            assert_eq!(malformed, reason, "{line}");
        }
    }
}
