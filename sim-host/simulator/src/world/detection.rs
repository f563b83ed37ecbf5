//! Which reflector is detected, and with what error: the random part of the sonar model.

use rand::{Rng, RngExt};

use crate::random;

use super::reflector::{Reflector, Source};
use super::sensor::{SensorModel, WAVELENGTH};

/// Largest number of missed cycles of one echo.
const MOST_SKIPS: u32 = 3;

/// A detected echo, before range noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Detected {
    pub source: Source,
    /// Half the apparent path of the sound, metres.
    pub distance: f64,
}

/// The earliest reflector that is detected. A certain or impossible detection needs no draw.
pub(super) fn first(found: &[Reflector], rng: &mut impl Rng) -> Option<Reflector> {
    found.iter().find(|reflector| happens(reflector.audible, rng)).copied()
}

/// The echo with outliers, missed cycles and bias, but without noise.
pub(super) fn distorted(of: Reflector, sensor: &SensorModel, rng: &mut impl Rng) -> Detected {
    let (nearest, farthest) = sensor.reach;
    if happens(sensor.short.at(of.distance), rng) {
        let distance = rng.random_range(nearest..=of.distance);
        return Detected { source: Source::Outlier, distance };
    }
    if happens(sensor.long.at(of.distance), rng) {
        let distance = rng.random_range(of.distance..=farthest);
        return Detected { source: Source::Outlier, distance };
    }
    let mut skips = 0;
    while skips < MOST_SKIPS && happens(sensor.skip, rng) {
        skips += 1;
    }
    let late = f64::from(skips) * 0.5 * WAVELENGTH;
    let distance = of.distance + sensor.bias.at(of.off_axis.abs()) + late;
    Detected { source: of.source, distance }
}

/// The reported range of a distance, given a standard normal draw for its noise.
pub(super) fn reported(distance: f64, sensor: &SensorModel, normal: f64) -> f64 {
    let sigma = libm::hypot(sensor.noise, sensor.noise_per_metre * distance);
    let range = (1.0 + sensor.scale) * distance + sensor.offset + sigma * normal;
    if sensor.quantum > 0.0 { (range / sensor.quantum).round() * sensor.quantum } else { range }
}

/// The angle from a wall's normal at which a diffuse echo originates; `off` is the angle between
/// normal and beam axis, radians.
pub(super) fn scatter_angle(off: f64, sensor: &SensorModel, rng: &mut impl Rng) -> f64 {
    sensor.scatter_lean * off + sensor.scatter_spread * random::normal(rng)
}

pub(super) fn happens(probability: f64, rng: &mut impl Rng) -> bool {
    if probability <= 0.0 {
        return false;
    }
    probability >= 1.0 || rng.random::<f64>() < probability
}
