//! The numbers of P, block by block.

use nalgebra::SMatrix;

use crate::filter::process_noise::AccumulatedRandomWalk;
use crate::geometry::numeric::is_valid_variance;
use crate::geometry::units::{Metres, Radians};
use crate::state::StandardDeviations;
use crate::state::estimate::wheels;

/// Rows of the pose: heading, x and y, which every prediction changes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[rustfmt::skip]
pub struct PoseBlock {
    pub(crate) hc: f32, pub(crate) hd: f32, pub(crate) hw: f32, pub(crate) hh: f32,
    pub(crate) xc: f32, pub(crate) xd: f32, pub(crate) xw: f32, pub(crate) xh: f32, pub(crate) xx: f32,
    pub(crate) yc: f32, pub(crate) yd: f32, pub(crate) yw: f32, pub(crate) yh: f32, pub(crate) yy: f32,
    pub(crate) xy: f32,
}

/// Block of the calibration: scale errors and track-width error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[rustfmt::skip]
pub struct CalibrationBlock {
    pub(crate) cc: f32, pub(crate) cd: f32, pub(crate) cw: f32,
    pub(crate) dd: f32, pub(crate) dw: f32, pub(crate) ww: f32,
}

/// Column of the range scale error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[rustfmt::skip]
pub struct RangeScaleBlock {
    pub(crate) ck: f32, pub(crate) dk: f32, pub(crate) wk: f32,
    pub(crate) xk: f32, pub(crate) yk: f32, pub(crate) hk: f32,
    pub(crate) kk: f32,
}

/// Upper triangle of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Covariance {
    /// Of the pose with all but the range scale.
    pub pose: PoseBlock,
    /// Of the calibration with itself.
    pub calibration: CalibrationBlock,
    /// Of the range scale with all.
    pub range_scale: RangeScaleBlock,
}

impl PoseBlock {
    /// Independent errors with these standard deviations of x and y and of the heading.
    #[must_use]
    pub fn independent(position: Metres, heading: Radians) -> Self {
        let (xx, hh) = (position.0 * position.0, heading.0 * heading.0);
        Self { xx, yy: xx, hh, ..Self::default() }
    }

    /// Whether the variances of the pose are valid.
    #[inline]
    pub fn is_valid(&self) -> bool {
        is_valid_variance(self.xx) && is_valid_variance(self.yy) && is_valid_variance(self.hh)
    }
}

impl CalibrationBlock {
    /// The variances cc, dd and ww with the accumulated random walk.
    #[inline]
    pub(crate) fn variances_with(&self, walk: &AccumulatedRandomWalk) -> (f32, f32, f32) {
        (
            self.cc + walk.scale_common,
            self.dd + walk.scale_difference,
            self.ww + walk.track_width_error,
        )
    }

    // ===== Eq. (48) =====
    /// Correlates the scale errors of the wheels, so that their difference has this deviation, of `CalibrationPrior::difference_of`.
    /// The deviations of the wheels do not change.
    pub(crate) fn correlate_wheels(&mut self, difference: f32) {
        let dd = difference * difference;
        self.cc += 0.25 * (self.dd - dd);
        self.dd = dd;
    }
}

impl RangeScaleBlock {
    /// Removes the covariance with the pose.
    pub(crate) fn forget_pose(&mut self) {
        (self.xk, self.yk, self.hk) = (0.0, 0.0, 0.0);
    }
}

impl Covariance {
    /// Independent errors with these standard deviations.
    #[must_use]
    pub fn independent(deviations: &StandardDeviations) -> Self {
        let [xx, yy, hh, rr, ll, ww, kk] = deviations.to_array().map(|sigma| sigma * sigma);
        Self {
            pose: PoseBlock { hh, xx, yy, ..PoseBlock::default() },
            calibration: CalibrationBlock {
                cc: 0.25 * (rr + ll),
                cd: 0.5 * (rr - ll),
                dd: rr + ll,
                ww,
                ..CalibrationBlock::default()
            },
            range_scale: RangeScaleBlock { kk, ..RangeScaleBlock::default() },
        }
    }

    /// The matrix in the order of [`StateEstimate`](crate::state::StateEstimate), with the scale
    /// errors wheel by wheel (`docs/model.md`, "Mean and difference").
    #[rustfmt::skip]
    #[must_use]
    pub fn to_matrix(self) -> SMatrix<f32, 7, 7> {
        let (p, q, k) = (self.pose, self.calibration, self.range_scale);
        let (xr, xl) = wheels(p.xc, p.xd);
        let (yr, yl) = wheels(p.yc, p.yd);
        let (hr, hl) = wheels(p.hc, p.hd);
        let (wr, wl) = wheels(q.cw, q.dw);
        let (kr, kl) = wheels(k.ck, k.dk);
        let (rr, ll) = wheel_variances(q.cc, q.cd, q.dd);
        let rl = q.cc - 0.25 * q.dd;
        SMatrix::from([
            [p.xx, p.xy, p.xh,   xr,   xl, p.xw, k.xk],
            [p.xy, p.yy, p.yh,   yr,   yl, p.yw, k.yk],
            [p.xh, p.yh, p.hh,   hr,   hl, p.hw, k.hk],
            [  xr,   yr,   hr,   rr,   rl,   wr,   kr],
            [  xl,   yl,   hl,   rl,   ll,   wl,   kl],
            [p.xw, p.yw, p.hw,   wr,   wl, q.ww, k.wk],
            [k.xk, k.yk, k.hk,   kr,   kl, k.wk, k.kk],
        ])
    }

    /// One standard deviation of each state, with the accumulated random walk of the calibration.
    #[must_use]
    pub fn standard_deviations(&self, walk: &AccumulatedRandomWalk) -> StandardDeviations {
        let (p, q, k) = (&self.pose, &self.calibration, &self.range_scale);
        let (cc, dd, ww) = q.variances_with(walk);
        let (rr, ll) = wheel_variances(cc, q.cd, dd);
        let variances = [p.xx, p.yy, p.hh, rr, ll, ww, k.kk];
        StandardDeviations::from_array(variances.map(libm::sqrtf))
    }

    /// Adds the accumulated random walk of the calibration.
    #[inline]
    pub fn add_random_walk(&mut self, walk: &AccumulatedRandomWalk) {
        let q = &mut self.calibration;
        (q.cc, q.dd, q.ww) = q.variances_with(walk);
    }

    /// Whether a variance is negative, so that P is no covariance.
    #[cold]
    #[must_use]
    pub fn has_negative_variance(&self) -> bool {
        let (p, q, k) = (&self.pose, &self.calibration, &self.range_scale);
        [p.xx, p.yy, p.hh, q.cc, q.dd, q.ww, k.kk].iter().any(|&variance| variance < 0.0)
    }

    /// Whether all variances are valid.
    #[inline]
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let q = &self.calibration;
        self.pose.is_valid()
            && is_valid_variance(q.cc)
            && is_valid_variance(q.dd)
            && is_valid_variance(q.ww)
            && is_valid_variance(self.range_scale.kk)
    }
}

/// Variances of the right and the left wheel's scale error, from those of their mean and difference.
fn wheel_variances(cc: f32, cd: f32, dd: f32) -> (f32, f32) {
    wheels(cc + 0.25 * dd, 2.0 * cd)
}

#[cfg(test)]
mod tests;
