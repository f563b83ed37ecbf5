//! Jacobian F and process noise Q of the pose over one odometry increment (`docs/model.md`, eqs. 8 and 9).

use crate::filter::motion::LinearizedMotion;
use crate::filter::process_noise::ProcessNoise;

/// F without its zeros and ones, and Q.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// Displacement, metres; the derivatives of x and y by the heading are −dy and dx.
    pub(crate) dx: f32,
    pub(crate) dy: f32,
    /// Derivatives of the pose by the mean and the difference of the scale errors, and by the track-width error.
    pub(crate) x_by_c: f32,
    pub(crate) x_by_d: f32,
    pub(crate) x_by_w: f32,
    pub(crate) y_by_c: f32,
    pub(crate) y_by_d: f32,
    pub(crate) y_by_w: f32,
    pub(crate) turn_by_c: f32,
    pub(crate) turn_by_d: f32,
    pub(crate) turn_by_w: f32,
    /// Q: covariance of the noise of x, y and heading.
    pub(crate) xx: f32,
    pub(crate) xy: f32,
    pub(crate) yy: f32,
    pub(crate) xh: f32,
    pub(crate) yh: f32,
    pub(crate) hh: f32,
    /// Variance of the noise of the advance, m².
    pub(crate) advance: f32,
}

impl Transition {
    // ===== Eqs. (8) and (9) =====
    /// Of a motion and the noise of its travels.
    #[inline]
    #[must_use]
    pub fn new(motion: &LinearizedMotion, noise: &ProcessNoise) -> Self {
        let m = motion;
        let (gx, gy) = (-0.5 * m.dy, 0.5 * m.dx);
        // Covariances of the noise of x and y with that of turn and advance.
        let (xt, yt) = (
            gx * noise.turn + m.cos * noise.advance_turn,
            gy * noise.turn + m.sin * noise.advance_turn,
        );
        let (xs, ys) = (
            gx * noise.advance_turn + m.cos * noise.advance,
            gy * noise.advance_turn + m.sin * noise.advance,
        );
        Self {
            dx: m.dx,
            dy: m.dy,
            x_by_c: m.cos * m.advance_by_c + gx * m.turn_by_c,
            x_by_d: m.cos * m.advance_by_d + gx * m.turn_by_d,
            x_by_w: gx * m.turn_by_w,
            y_by_c: m.sin * m.advance_by_c + gy * m.turn_by_c,
            y_by_d: m.sin * m.advance_by_d + gy * m.turn_by_d,
            y_by_w: gy * m.turn_by_w,
            turn_by_c: m.turn_by_c,
            turn_by_d: m.turn_by_d,
            turn_by_w: m.turn_by_w,
            xx: gx * xt + m.cos * xs,
            xy: gx * yt + m.cos * ys,
            yy: gy * yt + m.sin * ys,
            xh: xt,
            yh: yt,
            hh: noise.turn,
            advance: noise.advance,
        }
    }
}
