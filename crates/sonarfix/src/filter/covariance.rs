//! The covariance P: 28 numbers, the upper triangle of a symmetric 7×7 matrix, by name.
//!
//! Named fields instead of indices keep the equations straight-line code without bounds checks. The
//! letters, in their order: `x`, `y`, `h` (heading), `c` and `d` (mean and difference of the wheels'
//! scale errors), `w` (track-width error), `k` (range scale error).
//!
//! The paper's states are the scale errors of the right and the left wheel. The filter holds
//! `c = (S_R + S_L)/2` and `d = S_R − S_L`: on a straight leg the first walls determine d to 1e-4,
//! while c stays uncertain by 1e-2. Held wheel by wheel, the variance of d would be the difference of
//! numbers 10⁴ times larger, and the process noise of a step would vanish in their rounding. The
//! public interface is wheel by wheel.
//!
//! | module | contents |
//! |---|---|
//! | `blocks` | the numbers, and their conversion to a matrix |
//! | `transition` | F and Q of a motion, eqs. (8) and (9) |
//! | `propagation` | eqs. (5) and (10): P ← F P Fᵀ + Q |
//! | `gain` | K |
//! | `projection` | P Hᵀ and H P Hᵀ, eq. (14) |
//! | `correction` | eqs. (6) and (18) to (20): gain, state and covariance |
//! | `column` | covariances of a quantity beside P |
//! | `bias` | bias of a gyro beside P, eqs. (37) and (38) |
//! | `mount` | place of the sonar beside P, eq. (55) |
//!
//! # Non-finite policy
//! No value is refused here, except by [`Covariance::correct`]: it reports derivatives that are NaN
//! or too large before it changes anything. Whether a result is valid is decided by its variances
//! ([`Covariance::is_valid`]); the caller restores the previous values if it is not.

mod bias;
mod blocks;
mod column;
mod correction;
#[cfg(test)]
mod dense;
mod gain;
mod mount;
mod projection;
mod propagation;
mod transition;

pub use bias::{GyroBias, TurnDifference};
pub use blocks::{Covariance, PoseBlock};
pub use correction::Correction;
pub use gain::Gain;
pub use mount::Mount;
pub use projection::PredictedMeasurement;
pub use transition::Transition;
