//! The extended Kalman filter: seven states in `f32`, predicted from wheel travel, corrected by
//! one range at a time (`docs/model.md`, eqs. 4–6, 13–15 and 17).
//!
//! It holds numbers and equations only. Which wall a range belongs to, whether it may be
//! believed and what time it is, others decide.
//!
//! # Form
//! The covariance is kept as its upper triangle. Prediction multiplies out F P Fᵀ with F's zeros
//! and ones left out; correction is Joseph's form in two passes, each a rank-one change: the first
//! is the plain P − K H P, the second adds what the rounding of the first, and of K, left wrong.
//! Variances stay positive in single precision even for a range a million times sharper than the
//! prior, where the plain form reaches zero. What two states know of each other can be sharper
//! still than single precision holds; a range is then believed less than its noise allows (eq. 17).
//!
//! # Non-finite policy
//! NaN or infinity in an argument, or arising on the way, is an [`EkfError`], and not one bit of
//! the filter has changed. Only numbers within limits far beyond a robot's are computed with: a
//! turn of 64 rad a step, innovations of 1,000 km, variances of (1,000 km)², derivatives of 1,000.
//! Within them nothing overflows, and an entry of P is no larger than its row's and its column's
//! variance allow: so after a step it is enough to look at the variances. What fails there is put
//! back as it was.

use nalgebra::{SMatrix, SVector};

use crate::covariance::{Correction, Covariance, Derivatives, SixStates, is_within};
use crate::motion::{Drive, Noise, Rates, Step, Walk, WheelTravel};
use crate::range::ExpectedRange;
use crate::state::{Mean, Remainder};
use crate::trig::sin_cos_within;
use crate::units::{Metres, Radians, SquareMetres};

pub use crate::state::{STATES, State};

/// The largest innovation (m) and noise (m²) that is computed with.
const FURTHEST: f32 = 1e6;

/// The largest turn of one step, radians: a heading and half of it stay where sine and cosine need
/// no other reduction.
const LARGEST_TURN: f32 = 64.0;

/// What the filter refuses to compute with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum EkfError {
    /// An argument is NaN, infinite or larger than is computed with, or the result would be.
    NotFinite,
    /// A variance or a standard deviation is negative.
    Negative,
    /// A variance would come out negative: P no longer is what a covariance is.
    Indefinite,
    /// The noise of a range is zero: its correction could not be undone.
    Noiseless,
}

impl core::fmt::Display for EkfError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a value is NaN, infinite or too large, or the result would be",
            Self::Negative => "a variance or a standard deviation is negative",
            Self::Indefinite => "a variance would become negative",
            Self::Noiseless => "the variance of a range is zero",
        })
    }
}

impl core::error::Error for EkfError {}

/// A measured range against the expected one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Innovation {
    /// ν = z − h(X̂).
    pub value: Metres,
    /// S = H P Hᵀ + R.
    pub variance: SquareMetres,
}

impl Innovation {
    /// Normalised innovation squared ν²/S, dimensionless: 1 on average if the filter is
    /// consistent.
    ///
    /// ```
    /// use sonarfix::ekf::Innovation;
    /// use sonarfix::units::{Metres, SquareMetres};
    /// let innovation = Innovation { value: Metres(0.02), variance: SquareMetres(0.0001) };
    /// assert!((innovation.nis() - 4.0).abs() < 1e-5);
    /// ```
    #[must_use]
    pub fn nis(&self) -> f32 {
        self.value.0 * self.value.0 / self.variance.0
    }
}

/// The covariance of the position, m², and the variance of the heading, rad².
pub(crate) struct PoseCovariance {
    pub xx: f32,
    pub xy: f32,
    pub yy: f32,
    pub hh: f32,
}

/// What a range would tell if it were measured.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prospect {
    /// Its covariance with x, y, heading and range scale.
    pub with_pose: Derivatives,
    /// Its covariance with the common part and the difference of the scale errors.
    pub with_wheels: (f32, f32),
    /// S: its variance about the expected one.
    pub variance: f32,
}

impl PoseCovariance {
    /// The position's standard deviation in the direction in which it is largest, m: the root of the
    /// larger eigenvalue.
    pub fn worst_deviation(&self) -> f32 {
        let half = 0.5 * (self.xx - self.yy);
        let middle = 0.5 * (self.xx + self.yy);
        libm::sqrtf(middle + libm::sqrtf(half * half + self.xy * self.xy))
    }
}

/// The filter.
///
/// ```
/// use sonarfix::ekf::{Ekf, State};
/// use sonarfix::motion::{Drive, WheelTravel};
/// use sonarfix::units::{Metres, PerRootMetre};
///
/// let drive = Drive {
///     track_width: Metres(0.35),
///     wheel_noise: PerRootMetre(Metres(0.0005)),
///     scale_walk: PerRootMetre(5e-6),
///     track_width_walk: PerRootMetre(Metres(5e-6)),
/// };
/// let deviation = State {
///     x: 0.001, y: 0.001, heading: 0.001,
///     scale_right: 0.01, scale_left: 0.01, track_width_error: 0.01, range_scale: 0.0,
/// };
/// let mut ekf = Ekf::new(drive, State::default(), deviation)?;
/// for _ in 0..10 {
///     ekf.predict(WheelTravel::new(0.04, 0.04))?;
/// }
/// assert!((ekf.state().x - 0.4).abs() < 1e-6);
/// // The scale errors are unknown by 1 %, so 0.4 m of travel is uncertain by 2.8 mm.
/// assert!((ekf.deviation().x - 0.0030).abs() < 0.0001);
/// # Ok::<(), sonarfix::ekf::EkfError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ekf {
    mean: Mean,
    rest: Remainder,
    /// P, but for what the calibration has walked since the last range.
    p: Covariance,
    /// How far both wheels together have rolled since then, metres.
    way: f32,
    rates: Rates,
}

impl Ekf {
    /// A filter at `state`, whose errors are independent with the standard deviations in
    /// `deviation` (each in the unit of its state). A deviation of zero means: known exactly, and
    /// for the range scale: not estimated. Of the two scale errors either both are known exactly or
    /// none; they are held as mean and difference.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`] or [`EkfError::Negative`], by what is wrong with an argument.
    pub fn new(drive: Drive, state: State, deviation: State) -> Result<Self, EkfError> {
        if !state.is_finite() || !deviation.is_finite() {
            return Err(EkfError::NotFinite);
        }
        if deviation.to_vector().iter().any(|&sigma| sigma < 0.0) {
            return Err(EkfError::Negative);
        }
        let p = Covariance::independent(&deviation);
        let rates = Rates::new(&drive);
        if !p.is_sound() || !rates.is_sound() {
            return Err(EkfError::NotFinite);
        }
        Ok(Self { mean: Mean::new(&state), rest: Remainder::default(), p, way: 0.0, rates })
    }

    /// The estimate X̂.
    #[must_use]
    pub fn state(&self) -> State {
        self.mean.state()
    }

    /// The estimate X̂ as a 7×1 vector: x, y, heading, right and left scale error, track-width
    /// error, range scale error; metres, radians, dimensionless.
    #[must_use]
    pub fn state_vector(&self) -> SVector<f32, STATES> {
        self.state().to_vector()
    }

    /// The covariance P, 7×7, exactly symmetric, in the order of [`Self::state_vector`].
    #[must_use]
    pub fn covariance(&self) -> SMatrix<f32, STATES, STATES> {
        self.walked().to_matrix()
    }

    /// One standard deviation of each state, in the state's own unit.
    #[must_use]
    pub fn deviation(&self) -> State {
        let p = self.walked();
        let (rr, ll) = p.wheel_variances();
        State {
            x: libm::sqrtf(p.six.pose.xx),
            y: libm::sqrtf(p.six.pose.yy),
            heading: libm::sqrtf(p.six.pose.hh),
            scale_right: libm::sqrtf(rr),
            scale_left: libm::sqrtf(ll),
            track_width_error: libm::sqrtf(p.six.calibration.ww),
            range_scale: libm::sqrtf(p.scale.kk),
        }
    }

    /// P.
    fn walked(&self) -> Covariance {
        let mut p = self.p;
        p.widen(&Walk::new(&self.rates, self.way));
        p
    }

    /// Variances and covariance of x and y, and the heading's variance.
    pub(crate) fn pose_covariance(&self) -> PoseCovariance {
        let p = &self.p.six.pose;
        PoseCovariance { xx: p.xx, xy: p.xy, yy: p.yy, hh: p.hh }
    }

    /// What this range would tell if it were measured, with noise variance `noise`.
    pub(crate) fn prospect(&self, expected: &ExpectedRange, noise: SquareMetres) -> Prospect {
        let h = row(expected);
        let with_pose = self.p.cross(&h);
        let variance = noise.0 + h.times(&with_pose);
        Prospect { with_pose, with_wheels: self.p.cross_wheels(&h), variance }
    }

    /// Predicts the state over one step of the wheels: `X̂ ← f(X̂, U)`, `P ← F P Fᵀ + Q`
    /// (`docs/model.md`, eqs. 4–5 and 7–9). Q grows with the distance rolled, never with time: a
    /// step without travel changes nothing.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`] if a travel is NaN, infinite or a turn of more than 64 rad, or the
    /// result would be too large; [`EkfError::Indefinite`] if a variance would be negative. The
    /// filter is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn predict(&mut self, travel: WheelTravel) -> Result<(), EkfError> {
        let rolled = travel.right.abs().0 + travel.left.abs().0;
        if rolled <= 0.0 {
            return Ok(());
        }
        let step = Step::new(&self.rates, &self.mean, travel, sin_cos_within);
        if !is_within(step.turn.abs(), LARGEST_TURN) {
            return Err(EkfError::NotFinite);
        }
        let noise = Noise::new(&self.rates, &self.mean, travel, self.way, &self.p.six.pose);
        let before = self.p.six.pose;
        self.p.six.propagate(&step, &noise);
        if !self.p.six.pose.is_sound() {
            let error = self.what_is_unsound();
            self.p.six.pose = before;
            return Err(error);
        }
        self.p.scale.propagate(&step);
        self.way += rolled;
        self.mean.advance(&mut self.rest, &step);
        Ok(())
    }

    /// The innovation that a measured `range` would bring, with noise variance `noise`
    /// (`docs/model.md`, eq. 13). Changes nothing.
    #[must_use]
    pub fn innovation(
        &self,
        range: Metres,
        expected: &ExpectedRange,
        noise: SquareMetres,
    ) -> Innovation {
        let m = self.cross_covariance(expected);
        Innovation {
            value: range - expected.range,
            variance: SquareMetres(innovation_variance(expected, &m, noise)),
        }
    }

    /// How much the position's variance (x's and y's together) would drop if this range were
    /// measured, with noise variance `noise`; computed without trying the update
    /// (`docs/model.md`, eq. 16).
    #[must_use]
    pub fn position_gain(&self, expected: &ExpectedRange, noise: SquareMetres) -> SquareMetres {
        let m = self.cross_covariance(expected);
        SquareMetres((m.x * m.x + m.y * m.y) / innovation_variance(expected, &m, noise))
    }

    /// Admits more doubt of the pose: adds these standard deviations, independent of all else, to x
    /// and y each and to the heading. The state stays; no entry but their three variances changes.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`] or [`EkfError::Negative`], by what is wrong with an argument; the
    /// filter is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn loosen(&mut self, position: Metres, heading: Radians) -> Result<(), EkfError> {
        if !position.is_finite() || !heading.is_finite() {
            return Err(EkfError::NotFinite);
        }
        if position < Metres(0.0) || heading < Radians(0.0) {
            return Err(EkfError::Negative);
        }
        let before = self.p.six.pose;
        let p = &mut self.p.six.pose;
        p.xx += position.0 * position.0;
        p.yy += position.0 * position.0;
        p.hh += heading.0 * heading.0;
        if p.is_sound() {
            return Ok(());
        }
        self.p.six.pose = before;
        Err(EkfError::NotFinite)
    }

    /// Corrects the state by one measured `range` with noise variance `noise`
    /// (`docs/model.md`, eqs. 6, 13–15 and 17). There is no gate here: what is given is believed,
    /// except that nothing is believed to be sharper than single precision can hold.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`], [`EkfError::Negative`] or [`EkfError::Noiseless`] by what is
    /// wrong with an argument; [`EkfError::Indefinite`] if a variance would be negative. The filter
    /// is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn update(
        &mut self,
        range: Metres,
        expected: &ExpectedRange,
        noise: SquareMetres,
    ) -> Result<(), EkfError> {
        let innovation = (range - expected.range).0;
        let noise_is_sound = noise.0 > 0.0 && noise.0 <= FURTHEST;
        let innovation_is_sound = innovation.abs() <= FURTHEST;
        if !(noise_is_sound && innovation_is_sound) {
            return Err(what_is_wrong_with(noise));
        }
        // In three parts, each small enough to be copied without a call.
        let Covariance { six: SixStates { pose, calibration }, scale } = self.p;
        self.p.widen(&Walk::new(&self.rates, self.way));
        let error = match self.p.correct(&row(expected), noise.0) {
            Correction::Taken(gain) if self.p.is_sound() => {
                self.way = 0.0;
                self.mean.take(&mut self.rest, &gain, innovation);
                return Ok(());
            }
            Correction::Spare => {
                self.way = 0.0;
                return Ok(());
            }
            Correction::Taken(_) => self.what_is_unsound(),
            Correction::NotFinite => EkfError::NotFinite,
            Correction::Indefinite => EkfError::Indefinite,
        };
        self.p.six.pose = pose;
        self.p.six.calibration = calibration;
        self.p.scale = scale;
        Err(error)
    }

    /// Why a result is refused.
    #[cold]
    fn what_is_unsound(&self) -> EkfError {
        if self.p.is_negative() { EkfError::Indefinite } else { EkfError::NotFinite }
    }

    /// P Hᵀ: the covariance of each state with the expected range.
    fn cross_covariance(&self, expected: &ExpectedRange) -> Derivatives {
        self.p.cross(&row(expected))
    }
}

fn row(e: &ExpectedRange) -> Derivatives {
    Derivatives { x: e.by_x, y: e.by_y, h: e.by_heading, k: e.by_range_scale }
}

/// Why a range is refused.
#[cold]
fn what_is_wrong_with(noise: SquareMetres) -> EkfError {
    if noise.0 < 0.0 && noise.is_finite() {
        EkfError::Negative
    } else if noise.0.abs() <= 0.0 {
        EkfError::Noiseless
    } else {
        EkfError::NotFinite
    }
}

/// S = H P Hᵀ + R, given m = P Hᵀ.
fn innovation_variance(expected: &ExpectedRange, m: &Derivatives, noise: SquareMetres) -> f32 {
    noise.0 + row(expected).times(m)
}
