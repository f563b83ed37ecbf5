//! The integral of a sampled rate, and the faults of the samples.

use super::{GyroParameters, MeasuredTurn};
use crate::geometry::units::{Duration, Instant, Radians, RadiansPerSecond, seconds};

/// Integral that is one radian. A sum in whole parts has no rounding error that grows with it.
const RADIAN: f32 = 1_099_511_627_776.0;
/// Share of the range from which a sample is saturated.
const SATURATED: f32 = 0.999;
/// Periods without a sample that the trapezoid spans.
const MOST_MISSING: u64 = 5;
/// Equal samples in a row, and their time, after which the gyro is stuck. The noise of a working one changes its last
/// digits.
const STUCK_SAMPLES: u16 = 20;
const STUCK_TIME: Duration = Duration::from_ticks(500_000);
/// A sample that differs by more than this from the one before and, in the same direction, from the one after it is a spike, rad/s. A robot can
/// do that once, when a wheel drops into a joint of the floor.
const SPIKE: f32 = 1.0;
/// After a second spike within this time, a gyro is erratic until it has had none for as long.
const ERRATIC_TIME: Duration = Duration::from_ticks(2_000_000);

/// What is wrong with a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SampleFault {
    /// The driver failed.
    Unreadable,
    /// The rate is NaN or infinite.
    NotFinite,
    /// The rate has reached the range of the gyro.
    Saturated,
    /// The rate has not changed in its last digit for half a second.
    Stuck,
    /// The rate has jumped to and fro at least twice in a short time, as the bytes of a disturbed bus do.
    Erratic,
    /// Samples are missing before this one, more than can be interpolated.
    Missing,
    /// The time is not after that of the sample before.
    TimeRanBackwards,
}

impl core::fmt::Display for SampleFault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Unreadable => "the gyro cannot be read",
            Self::NotFinite => "the rate is NaN or infinite",
            Self::Saturated => "the rate has reached the range of the gyro",
            Self::Stuck => "the rate has not changed for half a second",
            Self::Erratic => "the rate jumps to and fro",
            Self::Missing => "too many samples are missing before this one",
            Self::TimeRanBackwards => "the time is not after that of the sample before",
        })
    }
}

impl core::error::Error for SampleFault {}

/// Counts of faults since the start; they saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SampleFaults {
    /// Failed readings.
    pub unreadable: u32,
    /// Samples that are NaN or infinite.
    pub not_finite: u32,
    /// Saturated samples.
    pub saturated: u32,
    /// Samples of a gyro that is stuck.
    pub stuck: u32,
    /// Samples of a gyro that is erratic.
    pub erratic: u32,
    /// Missing samples, interpolated ones included.
    pub missing: u32,
    /// Samples with a time that is not after that of the sample before.
    pub mistimed: u32,
}

impl SampleFaults {
    /// The sum of both counts.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            unreadable: self.unreadable.saturating_add(other.unreadable),
            not_finite: self.not_finite.saturating_add(other.not_finite),
            saturated: self.saturated.saturating_add(other.saturated),
            stuck: self.stuck.saturating_add(other.stuck),
            erratic: self.erratic.saturating_add(other.erratic),
            missing: self.missing.saturating_add(other.missing),
            mistimed: self.mistimed.saturating_add(other.mistimed),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Sample {
    at: Instant,
    rate: f32,
}

/// The integral of a gyro's rate by trapezoids.
///
/// ```
/// use sonarfix::sensor::gyro::{GyroParameters, TurnIntegral};
/// use sonarfix::geometry::units::{Instant, RadiansPerSecond};
/// let at = |millis: u64| Instant::from_ticks(millis * 1_000);
/// let mut integral = TurnIntegral::new(&GyroParameters::MPU_6050);
/// integral.sample(at(0), RadiansPerSecond(0.0))?;
/// let before = integral.reading(at(0));
/// for millis in 1..=100 {
///     integral.sample(at(millis), RadiansPerSecond(0.01 * millis as f32))?;
/// }
/// let turn = integral.reading(at(100)).since(&before).unwrap();
/// assert!((turn.angle.0 - 0.05).abs() < 1e-7);
/// # Ok::<(), sonarfix::sensor::gyro::SampleFault>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnIntegral {
    saturated: f32,
    period: Duration,
    last: Option<Sample>,
    /// The angle, in [`RADIAN`]ths of a radian.
    angle: i64,
    /// Interruptions of the integral.
    breaks: u32,
    /// The bits of the latest rate, since when they are the same, and in how many samples.
    latest: u32,
    equal_since: Instant,
    equal: u16,
    spikes: Spikes,
    faults: SampleFaults,
}

/// Spikes of the rate, which a disturbed bus causes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spikes {
    /// The two latest rates, the earlier first; NaN before there are two.
    rates: [f32; 2],
    latest: Option<Instant>,
    is_erratic: bool,
}

impl Spikes {
    const NONE: Self = Self { rates: [f32::NAN; 2], latest: None, is_erratic: false };

    fn add(&mut self, at: Instant, rate: f32) {
        let [before, last] = self.rates;
        let (from, to) = (last - before, last - rate);
        let is_spike = from * to > 0.0 && from.abs().min(to.abs()) > SPIKE;
        let is_recent = self.latest.is_some_and(|latest| {
            at.checked_duration_since(latest).is_some_and(|since| since < ERRATIC_TIME)
        });
        self.is_erratic = is_recent && (self.is_erratic || is_spike);
        if is_spike {
            self.latest = Some(at);
        }
        self.rates = [last, rate];
    }
}

/// The integral at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TurnReading {
    at: Instant,
    angle: i64,
    /// Interruptions up to now; `None` while the integral is interrupted.
    breaks: Option<u32>,
}

impl TurnReading {
    /// A reading of recorded parts, as [`Self::at`], [`Self::angle`] and [`Self::breaks`] return them.
    #[must_use]
    pub fn new(at: Instant, angle: i64, breaks: Option<u32>) -> Self {
        Self { at, angle, breaks }
    }

    /// Its time.
    #[must_use]
    pub fn at(&self) -> Instant {
        self.at
    }

    /// The angle since the start, in units of 2⁻⁴⁰ rad.
    #[must_use]
    pub fn angle(&self) -> i64 {
        self.angle
    }

    /// Interruptions since the start; `None` while the integral is interrupted.
    #[must_use]
    pub fn breaks(&self) -> Option<u32> {
        self.breaks
    }

    /// The turn since an earlier reading; `None` if the integral was interrupted.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a turn of a step is a few radians")]
    pub fn since(&self, earlier: &Self) -> Option<MeasuredTurn> {
        let is_whole = self.breaks.is_some() && self.breaks == earlier.breaks;
        let duration = self.at.checked_duration_since(earlier.at)?;
        let angle = self.angle.wrapping_sub(earlier.angle) as f32 / RADIAN;
        is_whole.then_some(MeasuredTurn { angle: Radians(angle), duration })
    }

    /// The reading at an instant between this one and a later one, at constant rate.
    #[must_use]
    pub fn between(&self, later: &Self, at: Instant) -> Self {
        let ticks = |from: Instant, to: Instant| {
            i64::try_from(to.checked_duration_since(from).map_or(0, |time| time.ticks()))
                .unwrap_or(i64::MAX)
        };
        let (whole, part) = (ticks(self.at, later.at), ticks(self.at, at));
        let turned = i128::from(later.angle.wrapping_sub(self.angle)) * i128::from(part);
        let turned = turned.checked_div(whole.into()).unwrap_or(0);
        let turned = i64::try_from(turned).unwrap_or(0);
        let breaks = later.breaks.filter(|_| self.breaks == later.breaks);
        Self { at, angle: self.angle.wrapping_add(turned), breaks }
    }
}

impl TurnIntegral {
    /// An integral that starts with its first sample.
    #[must_use]
    pub fn new(parameters: &GyroParameters) -> Self {
        Self {
            saturated: SATURATED * parameters.range.0,
            period: parameters.period,
            last: None,
            angle: 0,
            breaks: 0,
            latest: f32::NAN.to_bits(),
            equal_since: Instant::from_ticks(0),
            equal: 0,
            spikes: Spikes::NONE,
            faults: SampleFaults::default(),
        }
    }

    /// Adds a sample of the time `at`.
    ///
    /// # Errors
    /// [`SampleFault`]. A saturated, stuck or erratic sample, and missing ones, interrupt the integral; other faults count as a
    /// missing sample.
    pub fn sample(&mut self, at: Instant, rate: RadiansPerSecond) -> Result<(), SampleFault> {
        let result = self.add(at, rate.0);
        let faults = &mut self.faults;
        let count = match result {
            Ok(()) => return Ok(()),
            // Counted where their number is known.
            Err(SampleFault::Missing) => return result,
            Err(SampleFault::Unreadable) => &mut faults.unreadable,
            Err(SampleFault::NotFinite) => &mut faults.not_finite,
            Err(SampleFault::Saturated) => &mut faults.saturated,
            Err(SampleFault::Stuck) => &mut faults.stuck,
            Err(SampleFault::Erratic) => &mut faults.erratic,
            Err(SampleFault::TimeRanBackwards) => &mut faults.mistimed,
        };
        *count = count.saturating_add(1);
        result
    }

    /// Records that a sample could not be read.
    pub fn unreadable(&mut self) {
        self.faults.unreadable = self.faults.unreadable.saturating_add(1);
    }

    fn add(&mut self, at: Instant, rate: f32) -> Result<(), SampleFault> {
        if !rate.is_finite() {
            return Err(SampleFault::NotFinite);
        }
        let elapsed = match self.last {
            None => Duration::from_ticks(0),
            Some(last) => match at.checked_duration_since(last.at) {
                Some(elapsed) if !elapsed.is_zero() => elapsed,
                _ => return Err(SampleFault::TimeRanBackwards),
            },
        };
        self.count_equal(at, rate);
        self.spikes.add(at, rate);
        let fault = self.fault(at, rate, elapsed);
        self.count_missing(elapsed);
        match (fault, self.last) {
            (None, Some(last)) => {
                self.angle =
                    self.angle.wrapping_add(parts(0.5 * (last.rate + rate) * seconds(elapsed)));
            }
            (None, None) => {}
            (Some(_), _) => self.breaks = self.breaks.wrapping_add(1),
        }
        let interrupts = matches!(
            fault,
            Some(SampleFault::Saturated | SampleFault::Stuck | SampleFault::Erratic)
        );
        self.last = (!interrupts).then_some(Sample { at, rate });
        fault.map_or(Ok(()), Err)
    }

    fn count_equal(&mut self, at: Instant, rate: f32) {
        if rate.to_bits() == self.latest {
            self.equal = self.equal.saturating_add(1);
        } else {
            (self.latest, self.equal, self.equal_since) = (rate.to_bits(), 0, at);
        }
    }

    fn fault(&self, at: Instant, rate: f32, elapsed: Duration) -> Option<SampleFault> {
        let equal_for = at.checked_duration_since(self.equal_since);
        let is_old = equal_for.is_some_and(|time| time >= STUCK_TIME);
        if rate.abs() >= self.saturated {
            Some(SampleFault::Saturated)
        } else if self.equal >= STUCK_SAMPLES && is_old {
            Some(SampleFault::Stuck)
        } else if self.spikes.is_erratic {
            Some(SampleFault::Erratic)
        } else if elapsed.ticks() > self.longest_gap() {
            Some(SampleFault::Missing)
        } else {
            None
        }
    }

    fn longest_gap(&self) -> u64 {
        self.period.ticks().saturating_mul(MOST_MISSING)
    }

    fn count_missing(&mut self, elapsed: Duration) {
        let period = self.period.ticks();
        let half = period / 2;
        let periods = elapsed.ticks().saturating_add(half).checked_div(period).unwrap_or(0);
        let missing = u32::try_from(periods.saturating_sub(1)).unwrap_or(u32::MAX);
        self.faults.missing = self.faults.missing.saturating_add(missing);
    }

    /// The integral at `at`, not before the last sample; since that sample the rate is taken as constant.
    #[must_use]
    pub fn reading(&self, at: Instant) -> TurnReading {
        let since = self.last.and_then(|last| {
            let elapsed = at.checked_duration_since(last.at)?;
            (elapsed.ticks() <= self.longest_gap()).then_some((last.rate, elapsed))
        });
        let ahead = since.map_or(0, |(rate, elapsed)| parts(rate * seconds(elapsed)));
        let breaks = since.map(|_| self.breaks);
        TurnReading { at, angle: self.angle.wrapping_add(ahead), breaks }
    }

    /// The faults since the start.
    #[must_use]
    pub fn faults(&self) -> SampleFaults {
        self.faults
    }
}

#[expect(clippy::cast_possible_truncation, reason = "saturates far beyond every turn")]
fn parts(angle: f32) -> i64 {
    (angle * RADIAN) as i64
}
