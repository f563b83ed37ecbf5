//! Which of the things that could answer is heard, and what the sonar makes of it: chance.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use super::reflector::{Reflector, Source};
use super::sensor::{SensorModel, WAVELENGTH};

/// More missed cycles than this are another echo.
const MOST_SKIPS: u32 = 3;

/// What is heard before the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Heard {
    pub source: Source,
    /// Half the way that the sound seems to have gone, metres.
    pub distance: f64,
}

/// The earliest that is heard. What is certain, or impossible, costs no draw.
pub(super) fn first(found: &[Reflector], luck: &mut impl Rng) -> Option<Reflector> {
    found.iter().find(|reflector| happens(reflector.audible, luck)).copied()
}

/// What the sonar makes of it, apart from noise.
pub(super) fn distorted(of: Reflector, sensor: &SensorModel, luck: &mut impl Rng) -> Heard {
    let (nearest, farthest) = sensor.reach;
    if happens(sensor.short.at(of.distance), luck) {
        let distance = luck.random_range(nearest..=of.distance);
        return Heard { source: Source::Outlier, distance };
    }
    if happens(sensor.long.at(of.distance), luck) {
        let distance = luck.random_range(of.distance..=farthest);
        return Heard { source: Source::Outlier, distance };
    }
    let mut skips = 0;
    while skips < MOST_SKIPS && happens(sensor.skip, luck) {
        skips += 1;
    }
    let late = f64::from(skips) * 0.5 * WAVELENGTH;
    let distance = of.distance + sensor.bias.at(of.off_axis.abs()) + late;
    Heard { source: of.source, distance }
}

/// What is reported of a distance, with a standard normal draw for its noise.
pub(super) fn reported(distance: f64, sensor: &SensorModel, normal: f64) -> f64 {
    let sigma = sensor.noise.hypot(sensor.noise_per_metre * distance);
    let range = (1.0 + sensor.scale) * distance + sigma * normal;
    if sensor.quantum > 0.0 { (range / sensor.quantum).round() * sensor.quantum } else { range }
}

/// Where on the way from a wall's normal to the beam's axis, `off` radians apart, its roughness
/// answers this time.
pub(super) fn scatter_angle(off: f64, sensor: &SensorModel, luck: &mut impl Rng) -> f64 {
    sensor.scatter_lean * off + sensor.scatter_spread * luck.sample::<f64, _>(StandardNormal)
}

pub(super) fn happens(probability: f64, luck: &mut impl Rng) -> bool {
    if probability <= 0.0 {
        return false;
    }
    probability >= 1.0 || luck.random::<f64>() < probability
}
