//! Corrections by what is probably clutter, with the bias of a gyro.

use super::turn::{GyroTurn, SlipLimits};
use super::*;
use crate::filter::covariance::GyroBias;
use crate::filter::motion::WheelTravel;
use crate::geometry::units::PerRootMetre;

/// P and the variance of the bias grow together along the gain, whose part for the bias follows from its correction.
#[test]
fn clutter_spreads_the_bias_too() {
    let drive = Drive {
        track_width: Metres(0.3),
        wheel_noise: PerRootMetre(Metres(2e-3)),
        scale_walk: PerRootMetre(0.0),
        track_width_walk: PerRootMetre(Metres(0.0)),
    };
    let deviation = StandardDeviations::from_array([0.01, 0.01, 0.01, 0.1, 0.1, 0.02, 0.0]);
    let mut ekf = Ekf::new(drive, StateEstimate::default(), deviation).unwrap();
    let mut bias = GyroBias::unknown(0.05);
    let limits = SlipLimits { deviations: 5.0, angle: 0.1 };
    for _ in 0..30 {
        let turn = GyroTurn { angle: 0.0, seconds: 0.1, noise: 1e-6 };
        ekf.predict_with_turn(WheelTravel::new(0.02, 0.02), &turn, limits, &mut bias).unwrap();
    }
    let heading = ExpectedRange::linear(0.0, 0.0, 1.0);
    let prediction = ekf.predict_measurement(&heading, None);
    let noise = SquareMetres(1e-4);
    let s = f64::from(prediction.variance + noise.0);
    for (deviations, association) in [(3.0, 0.5), (4.0, 0.3), (-5.0, 0.7)] {
        let (mut corrected, mut after) = (ekf, bias);
        let nu = deviations * s.sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "radians")]
        let innovation = Metres(nu as f32);
        #[expect(clippy::cast_possible_truncation, reason = "a probability")]
        let share = association as f32;
        corrected
            .update_predicted(&prediction, innovation, noise, share, Some(&mut after))
            .unwrap();
        // Eq. (16): P + (a − 1) S K Kᵀ.
        let growth = (1.0 - association) * (1.0 + association * nu * nu / s) - 1.0;
        assert!(growth > 0.0);
        let gain = f64::from(after.rate - bias.rate) / (association * nu);
        let expected = growth * s * gain * gain;
        let is = f64::from(after.variance()) - f64::from(bias.variance());
        assert!(gain.abs() > 1e-3 && (is / expected - 1.0).abs() < 0.01, "{is} {expected} {gain}");
        let hh = f64::from(prediction.variance);
        let expected = hh + growth * hh * hh / s;
        let is = f64::from(corrected.pose_covariance().hh);
        assert!((is / expected - 1.0).abs() < 1e-5, "{is} {expected}");
    }
}
