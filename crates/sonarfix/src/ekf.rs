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
//! the filter has changed.

use nalgebra::{SMatrix, SVector};

use crate::covariance::{Covariance, Row, each_entry};
use crate::motion::{Drive, Step, WheelTravel};
use crate::range::ExpectedRange;
use crate::state::Mean;
use crate::units::{Metres, SquareMetres};

pub use crate::state::{STATES, State};

/// The sharpest that the covariance gets along a range's direction: this share of the variances
/// that make it up.
///
/// A slanted wall ties x and y together. If each is uncertain by 100 m and the range by 0.1 mm, the
/// tie is a difference of numbers 10¹² times larger, where an `f32` has seven digits: P would soon
/// have a negative eigenvalue. 2⁻¹⁴ leaves ten bits for the rounding of the steps to come (measured
/// by `tests/properties/covariance.rs`: at 2⁻¹⁶ it goes wrong within a few hundred runs of a parked
/// robot, at 2⁻¹⁵ it does not).
const SHARPEST: f32 = 1.0 / 16_384.0;

/// What the rounding of a sum of a few terms is worth, as a share of them: four times 2⁻²⁴.
const ROUNDING: f32 = 1.0 / 4_194_304.0;

/// What the filter refuses to compute with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EkfError {
    /// An argument is NaN or infinite, or the result would be.
    NotFinite,
    /// A variance or a standard deviation is negative.
    Negative,
    /// The noise of a range is zero: its correction could not be undone.
    Noiseless,
}

impl core::fmt::Display for EkfError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a value is NaN or infinite, or the result would be",
            Self::Negative => "a variance or a standard deviation is negative",
            Self::Noiseless => "the variance of a range is zero",
        })
    }
}

impl core::error::Error for EkfError {}

/// A measured range against the expected one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
    /// P Hᵀ: its covariance with each state.
    pub with_states: Row,
    /// S: its variance about the expected one.
    pub variance: f32,
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
    rest: Rest,
    p: Covariance,
    drive: Drive,
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
        if !p.is_sound() {
            return Err(EkfError::NotFinite);
        }
        Ok(Self { mean: Mean::new(&state), rest: Rest::default(), p, drive })
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
        self.p.to_matrix()
    }

    /// One standard deviation of each state, in the state's own unit.
    #[must_use]
    pub fn deviation(&self) -> State {
        let p = &self.p;
        let (rr, ll) = p.wheel_variances();
        State {
            x: libm::sqrtf(p.xx),
            y: libm::sqrtf(p.yy),
            heading: libm::sqrtf(p.hh),
            scale_right: libm::sqrtf(rr),
            scale_left: libm::sqrtf(ll),
            track_width_error: libm::sqrtf(p.ww),
            range_scale: libm::sqrtf(p.kk),
        }
    }

    /// Variances and covariance of x and y, and the heading's variance.
    pub(crate) fn pose_covariance(&self) -> PoseCovariance {
        PoseCovariance { xx: self.p.xx, xy: self.p.xy, yy: self.p.yy, hh: self.p.hh }
    }

    /// What this range would tell if it were measured, with noise variance `noise`.
    pub(crate) fn prospect(&self, expected: &ExpectedRange, noise: SquareMetres) -> Prospect {
        let with_states = self.cross_covariance(expected);
        Prospect { with_states, variance: innovation_variance(expected, &with_states, noise) }
    }

    /// Predicts the state over one step of the wheels: `X̂ ← f(X̂, U)`, `P ← F P Fᵀ + Q`
    /// (`docs/model.md`, eqs. 4–5 and 7–9). Q grows with the distance rolled, never with time: a
    /// step without travel changes nothing.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`] if a travel is NaN or infinite or the result would be; the filter
    /// is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn predict(&mut self, travel: WheelTravel) -> Result<(), EkfError> {
        if !travel.is_finite() {
            return Err(EkfError::NotFinite);
        }
        if travel == WheelTravel::default() {
            return Ok(());
        }
        let step = Step::new(&self.drive, &self.mean, travel);
        let (mut mean, mut rest) = (self.mean, self.rest);
        add(&mut mean.x, &mut rest.x, step.advance * step.cos);
        add(&mut mean.y, &mut rest.y, step.advance * step.sin);
        add(&mut mean.heading, &mut rest.heading, step.turn);

        let mut p = propagated(&self.p, &step);
        let scale_walk = self.drive.scale_walk.0;
        let width_walk = self.drive.track_width_walk.0.0;
        let distance = travel.distance().0;
        // Of two independent walks the mean has half the variance, the difference twice.
        let scale_variance = scale_walk * scale_walk * distance;
        add(&mut p.cc, &mut rest.cc, 0.5 * scale_variance);
        add(&mut p.dd, &mut rest.dd, 2.0 * scale_variance);
        add(&mut p.ww, &mut rest.ww, width_walk * width_walk * distance);
        self.replace(mean, rest, p)
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

    /// Corrects the state by one measured `range` with noise variance `noise`
    /// (`docs/model.md`, eqs. 6, 13–15 and 17). There is no gate here: what is given is believed,
    /// except that nothing is believed to be sharper than single precision can hold.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`], [`EkfError::Negative`] or [`EkfError::Noiseless`] by what is
    /// wrong with an argument; the filter is unchanged.
    ///
    /// # Panics
    /// Never.
    pub fn update(
        &mut self,
        range: Metres,
        expected: &ExpectedRange,
        noise: SquareMetres,
    ) -> Result<(), EkfError> {
        if !range.is_finite() || !noise.0.is_finite() {
            return Err(EkfError::NotFinite);
        }
        if noise.0 < 0.0 {
            return Err(EkfError::Negative);
        }
        if noise.0 <= 0.0 {
            return Err(EkfError::Noiseless);
        }
        let m = self.cross_covariance(expected);
        let Some(noise) = self.bearable(noise, expected, &m) else {
            return Ok(());
        };
        let per_variance = 1.0 / innovation_variance(expected, &m, noise);
        let gain = m.scaled(per_variance);
        let innovation = (range - expected.range).0;
        let (mut mean, mut rest) = (self.mean, self.rest);
        add(&mut mean.x, &mut rest.x, gain.x * innovation);
        add(&mut mean.y, &mut rest.y, gain.y * innovation);
        add(&mut mean.heading, &mut rest.heading, gain.h * innovation);
        mean.scale_common += gain.c * innovation;
        mean.scale_difference += gain.d * innovation;
        mean.track_width_error += gain.w * innovation;
        mean.range_scale += gain.k * innovation;
        self.replace(mean, rest, corrected(&self.p, &m, &gain, expected, noise))
    }

    /// P Hᵀ: the covariance of each state with the expected range.
    fn cross_covariance(&self, expected: &ExpectedRange) -> Row {
        let e = expected;
        self.p.times(e.by_x, e.by_y, e.by_heading, e.by_range_scale)
    }

    /// The noise of a range, or more if the variance that it leaves along H would be less than
    /// [`SHARPEST`] allows (`docs/model.md`, eq. 17); `None` if that variance is there already.
    fn bearable(
        &self,
        noise: SquareMetres,
        expected: &ExpectedRange,
        m: &Row,
    ) -> Option<SquareMetres> {
        let (e, p) = (expected, &self.p);
        let per_variance = 1.0 / innovation_variance(e, m, noise);
        let left = |by: f32, variance: f32, m: f32| by * by * (variance - m * m * per_variance);
        let terms = left(e.by_x, p.xx, m.x)
            + left(e.by_y, p.yy, m.y)
            + left(e.by_heading, p.hh, m.h)
            + left(e.by_range_scale, p.kk, m.k);
        let (along_h, least) = (along(e, m), SHARPEST * terms);
        if along_h <= least {
            return None;
        }
        // What leaves v r/(v + r) = least.
        let bearable = along_h * least / (along_h - least);
        Some(if bearable > noise.0 { SquareMetres(bearable) } else { noise })
    }

    /// Takes the new numbers if they are sound; changes nothing if not.
    fn replace(&mut self, mean: Mean, rest: Rest, p: Covariance) -> Result<(), EkfError> {
        if !mean.state().is_finite() || !p.is_sound() {
            return Err(EkfError::NotFinite);
        }
        self.mean = mean.wrapped();
        self.rest = rest;
        self.p = p;
        Ok(())
    }
}

/// What rounding has left over of the sums that grow by small steps.
///
/// 40 m from the origin one step of an `f32` is 4 µm, and a leg is a thousand additions: the
/// rounding alone would move the estimate by a fiftieth of its own deviation. And what a scale
/// error walks in one step is too little to change its variance at all as long as that is wide.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Rest {
    x: f32,
    y: f32,
    heading: f32,
    cc: f32,
    dd: f32,
    ww: f32,
}

/// Adds a change to a sum together with what rounding left over of the earlier ones (Kahan).
fn add(sum: &mut f32, rest: &mut f32, change: f32) {
    let change = change + *rest;
    let before = *sum;
    *sum = before + change;
    *rest = change - (*sum - before);
}

/// S = H P Hᵀ + R, given m = P Hᵀ.
fn innovation_variance(expected: &ExpectedRange, m: &Row, noise: SquareMetres) -> f32 {
    noise.0 + along(expected, m)
}

/// H times a column.
fn along(expected: &ExpectedRange, column: &Row) -> f32 {
    let e = expected;
    e.by_x * column.x + e.by_y * column.y + e.by_heading * column.h + e.by_range_scale * column.k
}

/// F P Fᵀ and the wheels' noise, multiplied out (`docs/model.md`, eq. 9).
///
/// The step is seen as three small movements: half the turn, the advance along the mid-heading,
/// the other half. So the pose after it is linear in the pose before it, the turn t and the
/// advance s, and all that is needed are the covariances of these: `ht` is that of heading and
/// turn, `xm` that of x and the mid-heading m = h + t/2, and so on.
fn propagated(p: &Covariance, step: &Step) -> Covariance {
    let (sin, cos) = (step.sin, step.cos);
    // ∂x/∂m and ∂y/∂m.
    let (swing_x, swing_y) = (-step.advance * sin, step.advance * cos);

    let turn_with = |c: f32, d: f32, w: f32| step.turn_c * c + step.turn_d * d + step.turn_w * w;
    let advance_with = |c: f32, d: f32| step.advance_c * c + step.advance_d * d;
    let (tc, td) = (turn_with(p.cc, p.cd, p.cw), turn_with(p.cd, p.dd, p.dw));
    let (tw, tk) = (turn_with(p.cw, p.dw, p.ww), turn_with(p.ck, p.dk, p.wk));
    let (sc, sd) = (advance_with(p.cc, p.cd), advance_with(p.cd, p.dd));
    let (sw, sk) = (advance_with(p.cw, p.dw), advance_with(p.ck, p.dk));
    let (xt, xs) = (turn_with(p.xc, p.xd, p.xw), advance_with(p.xc, p.xd));
    let (yt, ys) = (turn_with(p.yc, p.yd, p.yw), advance_with(p.yc, p.yd));
    let (ht, hs) = (turn_with(p.hc, p.hd, p.hw), advance_with(p.hc, p.hd));
    let tt = turn_with(tc, td, tw) + step.turn_variance;
    let ts = advance_with(tc, td) + step.advance_turn;
    let ss = advance_with(sc, sd) + step.advance_variance;

    let (xm, ym, hm) = (p.xh + 0.5 * xt, p.yh + 0.5 * yt, p.hh + 0.5 * ht);
    let mt = ht + 0.5 * tt;
    let (mm, ms) = (hm + 0.5 * mt, hs + 0.5 * ts);
    // Covariances of the way along x and y with the mid-heading, the advance and the new heading.
    let (ways_xm, ways_ym) = (swing_x * mm + cos * ms, swing_y * mm + sin * ms);
    let (ways_xs, ways_ys) = (swing_x * ms + cos * ss, swing_y * ms + sin * ss);
    let (m_new, s_new) = (hm + mt, hs + ts);

    // Each entry is added to once, with its whole change: it may be far larger, and rounds.
    let along_x = |m: f32, s: f32| swing_x * m + cos * s;
    let along_y = |m: f32, s: f32| swing_y * m + sin * s;
    // A way's variance is a sum that may cancel to nothing, but must not round to less.
    let rounding_x = ROUNDING * (swing_x * swing_x * mm + cos * cos * ss);
    let rounding_y = ROUNDING * (swing_y * swing_y * mm + sin * sin * ss);
    let (cm, dm) = (p.hc + 0.5 * tc, p.hd + 0.5 * td);
    let (wm, km) = (p.hw + 0.5 * tw, p.hk + 0.5 * tk);
    Covariance {
        xx: p.xx + (2.0 * along_x(xm, xs) + along_x(ways_xm, ways_xs) + rounding_x),
        xy: p.xy + (along_x(ym, ys) + along_y(xm + ways_xm, xs + ways_xs)),
        xh: p.xh + (xt + along_x(m_new, s_new)),
        xc: p.xc + along_x(cm, sc),
        xd: p.xd + along_x(dm, sd),
        xw: p.xw + along_x(wm, sw),
        xk: p.xk + along_x(km, sk),
        yy: p.yy + (2.0 * along_y(ym, ys) + along_y(ways_ym, ways_ys) + rounding_y),
        yh: p.yh + (yt + along_y(m_new, s_new)),
        yc: p.yc + along_y(cm, sc),
        yd: p.yd + along_y(dm, sd),
        yw: p.yw + along_y(wm, sw),
        yk: p.yk + along_y(km, sk),
        hh: p.hh + (ht + mt + 0.5 * tt),
        hc: p.hc + tc,
        hd: p.hd + td,
        hw: p.hw + tw,
        hk: p.hk + tk,
        ..*p
    }
}

/// The covariance after a correction: Joseph's form in two passes (`docs/model.md`, eq. 15).
fn corrected(
    p: &Covariance,
    m: &Row,
    gain: &Row,
    expected: &ExpectedRange,
    noise: SquareMetres,
) -> Covariance {
    let mut p = *p;
    macro_rules! subtract_gain_times_cross_covariance {
        ($entry:ident $i:ident $j:ident) => {
            p.$entry -= gain.$i * m.$j;
        };
    }
    each_entry!(subtract_gain_times_cross_covariance);

    // In exact arithmetic P₁ Hᵀ = K R, and the second pass adds nothing.
    let e = expected;
    let left_over = p.times(e.by_x, e.by_y, e.by_heading, e.by_range_scale);
    let d = gain.scaled(noise.0).plus_scaled(&left_over, -1.0);
    // Half of it on either side, for K Hᵀ on the one is (K Hᵀ)ᵀ on the other.
    let d = d.plus_scaled(gain, -0.5 * along(expected, &d));
    macro_rules! add_what_rounding_left {
        ($entry:ident $i:ident $j:ident) => {
            p.$entry += d.$i * gain.$j + gain.$i * d.$j;
        };
    }
    each_entry!(add_what_rounding_left);
    p
}
