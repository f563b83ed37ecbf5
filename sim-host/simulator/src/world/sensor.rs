//! Parameters of a sonar or a time-of-flight ranger: probability of detection, outliers, bias and noise.

use sonarfix::config::Ranging;
use sonarfix_map::Scenario;

/// A piecewise linear function, constant beyond its outermost points.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve(Vec<(f64, f64)>);

impl Curve {
    /// A curve through points in ascending order of x.
    #[must_use]
    pub fn through(points: &[(f64, f64)]) -> Self {
        Self(points.to_vec())
    }

    /// A constant.
    #[must_use]
    pub fn level(value: f64) -> Self {
        Self(vec![(0.0, value)])
    }

    /// The value at `x`; zero of a curve without points.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        let after = self.0.partition_point(|&(from, _)| from <= x);
        let left = after.checked_sub(1).and_then(|before| self.0.get(before));
        match (left, self.0.get(after)) {
            (Some(&(x0, y0)), Some(&(x1, y1))) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
            (Some(&(_, y)), None) | (None, Some(&(_, y))) => y,
            (None, None) => 0.0,
        }
    }
}

/// Probability of detection of an echo, by range (metres) and angle off the beam's axis (radians).
///
/// `share(r) / (1 + exp((|angle| − half_angle(r)) / blur(r)))`: the probability on the axis, and a
/// cone with a soft rim.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Probability on the axis.
    pub share: Curve,
    /// Angle at which half of it is left, radians.
    pub half_angle: Curve,
    /// Width of the rim, radians.
    pub blur: Curve,
}

impl Sensitivity {
    /// Detects everything.
    fn perfect() -> Self {
        let everywhere = Curve::level(f64::INFINITY);
        Self { share: Curve::level(1.0), half_angle: everywhere, blur: Curve::level(1.0) }
    }

    /// Detects nothing.
    fn deaf() -> Self {
        Self { share: Curve::level(0.0), ..Self::perfect() }
    }

    /// Whether it detects nothing, at any range.
    #[must_use]
    pub fn is_deaf(&self) -> bool {
        self.share.0.iter().all(|&(_, share)| share <= 0.0)
    }

    /// Probability of detection.
    #[must_use]
    pub fn at(&self, range: f64, off_axis: f64) -> f64 {
        let rim = (off_axis.abs() - self.half_angle.at(range)) / self.blur.at(range);
        self.share.at(range) / (1.0 + libm::exp(rim))
    }
}

/// The model of a sonar.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorModel {
    /// Half of the cone outside of which nothing is detected, radians.
    pub cone: f64,
    /// Shortest and longest reported distance, metres.
    pub reach: (f64, f64),
    /// Detection of a smooth wall at the foot of the perpendicular.
    pub mirror: Sensitivity,
    /// Detection of a corner, as a share of `mirror`.
    pub corner: f64,
    /// Detection of an edge, as a share of `mirror`.
    pub edge: f64,
    /// Detection of an echo over two walls and back, as a share of `mirror`.
    pub double_bounce: f64,
    /// Detection of a diffuse echo near the axis, by the angle between axis and normal.
    pub scatter: Sensitivity,
    /// Mean origin of a diffuse echo, as a share of the angle from normal to axis.
    pub scatter_lean: f64,
    /// Standard deviation of that origin, radians.
    pub scatter_spread: f64,
    /// Half of the sector whose nearest point answers, at any angle to its surface, radians; `None` for a sonar that hears the foot of
    /// the perpendicular. `mirror` is then by the angle between axis and normal.
    pub sector: Option<f64>,
    /// Bias of the distance by the angle off the axis, metres.
    pub bias: Curve,
    /// Probability that a short outlier replaces an echo, by distance.
    pub short: Curve,
    /// Probability that a long outlier replaces an echo, by distance.
    pub long: Curve,
    /// Probability that a cycle of the echo is missed, which adds half a wavelength.
    pub skip: f64,
    /// Standard deviation of the noise at zero range, metres.
    pub noise: f64,
    /// Standard deviation of the noise per metre of range.
    pub noise_per_metre: f64,
    /// Scale error of the range, apart from that of the speed of sound.
    pub scale: f64,
    /// Added to each range, metres.
    pub offset: f64,
    /// Resolution of the reported range, metres; zero for none.
    pub quantum: f64,
    /// Of a time-of-flight ranger its light; of a sonar none.
    pub light: Option<LightModel>,
}

/// The light of a time-of-flight ranger. `mirror.share` is the probability of detection of a white wall by range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightModel {
    /// Half of the field of view, radians; zero: a single ray.
    pub half_view: f64,
    /// Standard deviation of the direction of the beam, radians.
    pub pointing: f64,
    /// Probability that a surface is so dark, or a pane of glass so oblique, that nothing returns.
    pub absorbed: f64,
    /// Probability that a surface is a pane of glass, behind which something else returns the light.
    pub through: f64,
}

/// Wavelength of 40 kHz sound in air at 20 °C, 343.4 m/s, metres.
pub const WAVELENGTH: f64 = 343.4 / 40e3;

impl SensorModel {
    /// The paper's sonar, with the true noise and cone of a scenario: it always detects smooth walls
    /// at the foot of the perpendicular, the nearest one inside the cone.
    #[must_use]
    pub fn ideal(scenario: &Scenario) -> Self {
        let (truth, sonar) = (&scenario.truth, &scenario.robot.localizer.rangers.first);
        let reach = (sonar.min_range.0.into(), sonar.max_range.0.into());
        let light = match sonar.ranging {
            Ranging::Sound => None,
            Ranging::Light(beam) => {
                let pointing = beam.pointing.0.into();
                Some(LightModel { half_view: 0.0, pointing, absorbed: 0.0, through: 0.0 })
            }
        };
        Self {
            noise: truth.range_noise,
            noise_per_metre: truth.range_noise_per_metre,
            scale: truth.range_scale,
            offset: truth.range_offset,
            light,
            ..Self::of_mirrors(truth.cone, reach, Sensitivity::perfect())
        }
    }

    /// VL53L1X in its long mode with 50 ms of light. From `docs/hardware.md`: 4 cm to 4 m, a field of view of 27°,
    /// steps of 1 mm. The noise in indoor light is assumed.
    #[must_use]
    pub fn vl53l1x() -> Self {
        let share = Curve::through(&[(2.5, 0.99), (3.2, 0.9), (4.0, 0.3)]);
        let light = Self::of_light(13.5_f64.to_radians(), (0.04, 4.0), share);
        Self { noise: 0.004, noise_per_metre: 0.003, ..light }
    }

    /// VL53L0X with 50 ms for a range. From `docs/hardware.md`: to 1.2 m, on a white wall up to 2 m, a field of view of 25°,
    /// steps of 1 mm. The noise in indoor light is assumed.
    #[must_use]
    pub fn vl53l0x() -> Self {
        let share = Curve::through(&[(0.7, 0.99), (1.2, 0.9), (2.0, 0.1)]);
        let light = Self::of_light(12.5_f64.to_radians(), (0.04, 2.0), share);
        Self { noise: 0.006, noise_per_metre: 0.015, ..light }
    }

    /// A time-of-flight ranger without noise, with steps of 1 mm. The shares of dark walls, glass and outliers are assumed.
    fn of_light(half_view: f64, reach: (f64, f64), share: Curve) -> Self {
        Self {
            short: Curve::level(0.005),
            long: Curve::level(0.005),
            quantum: 0.001,
            light: Some(LightModel { half_view, pointing: 0.0, absorbed: 0.03, through: 0.005 }),
            ..Self::of_mirrors(half_view, reach, Sensitivity { share, ..Sensitivity::perfect() })
        }
    }

    /// An HC-SR04. From `docs/hardware.md`: 2–400 cm, about 3 m in practice, a half-angle from 9–10°
    /// (the board parallel to a plate) to 23° (facing it), 3 mm steps, jumps of half a wavelength and
    /// more. The shares of corners, edges and outliers are in no datasheet: they are chosen between
    /// the ideal sonar and the NXT.
    #[must_use]
    pub fn hc_sr04() -> Self {
        let degrees = f64::to_radians;
        Self {
            cone: degrees(30.0),
            reach: (0.02, 4.0),
            mirror: Sensitivity {
                share: Curve::through(&[(0.1, 0.99), (2.0, 0.97), (3.0, 0.85), (4.0, 0.3)]),
                half_angle: Curve::through(&[(0.3, degrees(23.0)), (3.0, degrees(14.0))]),
                blur: Curve::level(degrees(1.5)),
            },
            corner: 0.9,
            edge: 0.1,
            double_bounce: 0.5,
            scatter: Sensitivity::deaf(),
            scatter_lean: 1.0,
            scatter_spread: 0.0,
            sector: None,
            bias: Curve::through(&[(0.0, 0.0), (degrees(20.0), 0.005)]),
            short: Curve::through(&[(1.0, 0.01), (3.0, 0.03)]),
            long: Curve::through(&[(1.0, 0.005), (3.0, 0.01)]),
            skip: 0.05,
            noise: 0.0015,
            noise_per_metre: 0.001,
            scale: 0.0,
            offset: 0.0,
            quantum: 0.003,
            light: None,
        }
    }

    /// The LEGO EV3 ultrasonic sensor. Against an overhead camera its ranges are those of the nearest point of a cone of 15° to either
    /// side, up to 45° off the normal at 0.5 m. Reach and steps are those of its manual; noise, outliers and the angle at which it hears half of the
    /// echoes are assumed.
    #[must_use]
    pub fn ev3() -> Self {
        let degrees = f64::to_radians;
        Self {
            sector: Some(degrees(15.0)),
            short: Curve::level(0.01),
            long: Curve::level(0.01),
            noise: 0.004,
            noise_per_metre: 0.002,
            quantum: 0.001,
            ..Self::of_mirrors(
                degrees(15.0),
                (0.03, 2.55),
                Sensitivity {
                    share: Curve::through(&[(1.0, 0.98), (2.0, 0.9), (2.55, 0.6)]),
                    half_angle: Curve::through(&[(0.5, degrees(50.0)), (2.0, degrees(35.0))]),
                    blur: Curve::level(degrees(3.0)),
                },
            )
        }
    }

    /// LV-MaxSonar-EZ. From `docs/hardware.md`: 0.15–6.45 m, steps of 25 mm. Cone and shares are
    /// chosen: in the datasheet the beam on a large plate is about 15° to either side.
    #[must_use]
    pub fn lv_maxsonar() -> Self {
        let degrees = f64::to_radians;
        Self {
            cone: degrees(25.0),
            reach: (0.15, 6.45),
            mirror: Sensitivity {
                share: Curve::through(&[(3.0, 0.97), (5.0, 0.85), (6.45, 0.3)]),
                half_angle: Curve::level(degrees(15.0)),
                blur: Curve::level(degrees(1.5)),
            },
            noise: 0.005,
            quantum: 0.0254,
            ..Self::hc_sr04()
        }
    }

    /// SRF08. From `docs/hardware.md`: 0.03–6 m, 55° at −6 dB, so 27.5° to either side. Its register
    /// counts centimetres; the shares are chosen.
    #[must_use]
    pub fn srf08() -> Self {
        let degrees = f64::to_radians;
        Self {
            cone: degrees(40.0),
            reach: (0.03, 6.0),
            mirror: Sensitivity {
                share: Curve::through(&[(3.0, 0.97), (4.5, 0.85), (6.0, 0.3)]),
                half_angle: Curve::level(degrees(27.5)),
                blur: Curve::level(degrees(2.0)),
            },
            noise: 0.003,
            quantum: 0.01,
            ..Self::hc_sr04()
        }
    }

    /// Polaroid 6500. From `docs/hardware.md`: 0.26–10.7 m, 12° at −3 dB, 1 %. A plate is detected
    /// where the beam is weaker, too: 12° are taken to either side. The shares are chosen.
    #[must_use]
    pub fn polaroid_6500() -> Self {
        let degrees = f64::to_radians;
        Self {
            cone: degrees(20.0),
            reach: (0.26, 10.7),
            mirror: Sensitivity {
                share: Curve::through(&[(6.0, 0.98), (9.0, 0.9), (10.7, 0.5)]),
                half_angle: Curve::level(degrees(12.0)),
                blur: Curve::level(degrees(1.5)),
            },
            noise: 0.003,
            noise_per_metre: 0.005,
            quantum: 0.0,
            ..Self::hc_sr04()
        }
    }

    /// The same sonar with only its detection of walls: no other reflectors, outliers or noise.
    #[must_use]
    pub fn undistorted(&self) -> Self {
        let light = self.light.map(|_| LightModel {
            half_view: 0.0,
            pointing: 0.0,
            absorbed: 0.0,
            through: 0.0,
        });
        Self { light, ..Self::of_mirrors(self.cone, self.reach, self.mirror.clone()) }
    }

    /// A sonar without errors that only detects walls, at the foot of the perpendicular.
    fn of_mirrors(cone: f64, reach: (f64, f64), mirror: Sensitivity) -> Self {
        Self {
            cone,
            reach,
            mirror,
            corner: 0.0,
            edge: 0.0,
            double_bounce: 0.0,
            scatter: Sensitivity::deaf(),
            scatter_lean: 1.0,
            scatter_spread: 0.0,
            sector: None,
            bias: Curve::level(0.0),
            short: Curve::level(0.0),
            long: Curve::level(0.0),
            skip: 0.0,
            noise: 0.0,
            noise_per_metre: 0.0,
            scale: 0.0,
            offset: 0.0,
            quantum: 0.0,
            light: None,
        }
    }

    /// The LEGO NXT ultrasonic sensor, fitted to 20 sweeps of four robots
    /// (`docs/sonar-model.md` shows the fit; `sonarfix-studies sonar-model` writes that page).
    #[must_use]
    pub fn nxt() -> Self {
        let degrees = f64::to_radians;
        Self {
            cone: degrees(75.0),
            reach: (0.03, 2.54),
            mirror: Sensitivity {
                share: Curve::through(&[(0.6, 0.98), (1.0, 0.99), (1.15, 0.75), (1.6, 0.6)]),
                half_angle: Curve::through(&[(0.3, degrees(38.0)), (0.8, degrees(30.0))]),
                blur: Curve::through(&[(0.3, degrees(6.0)), (0.8, degrees(2.5))]),
            },
            corner: 0.6,
            edge: 0.1,
            double_bounce: 0.2,
            scatter: Sensitivity {
                share: Curve::through(&[(0.4, 0.9), (0.9, 0.5), (1.3, 0.1)]),
                half_angle: Curve::level(degrees(55.0)),
                blur: Curve::level(degrees(5.0)),
            },
            scatter_lean: 0.8,
            scatter_spread: degrees(7.0),
            sector: None,
            bias: Curve::through(&[(0.0, 0.0), (degrees(22.5), 0.014), (degrees(32.5), 0.021)]),
            short: Curve::through(&[(0.5, 0.025), (0.7, 0.0), (1.0, 0.0), (1.2, 0.16)]),
            long: Curve::through(&[(1.0, 0.005), (1.2, 0.08)]),
            skip: 0.0,
            noise: 0.013,
            noise_per_metre: 0.0,
            scale: 0.0,
            offset: 0.0,
            quantum: 0.01,
            light: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_linear_between_its_points_and_constant_beyond() {
        let curve = Curve::through(&[(1.0, 10.0), (3.0, 20.0)]);
        for (x, y) in [(0.0, 10.0), (1.0, 10.0), (1.5, 12.5), (3.0, 20.0), (9.0, 20.0)] {
            assert!((curve.at(x) - y).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn half_of_the_echoes_are_detected_at_the_half_angle() {
        let soft = Sensitivity {
            share: Curve::level(0.8),
            half_angle: Curve::level(0.3),
            blur: Curve::level(0.05),
        };
        assert!((soft.at(1.0, -0.3) - 0.4).abs() < 1e-12);
        assert!(soft.at(1.0, 0.0) > 0.79 && soft.at(1.0, 0.6) < 0.01);
        // Exactly one: no random draw is needed.
        assert_eq!(Sensitivity::perfect().at(3.0, 1.0).to_bits(), 1.0_f64.to_bits());
        assert_eq!(Sensitivity::deaf().at(3.0, 0.0).to_bits(), 0.0_f64.to_bits());
    }
}
