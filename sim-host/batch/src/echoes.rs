//! What the sonar measures at walls of the map, from the estimated poses: how often it misses a wall that is square to it, and which
//! distance it reports of an oblique one.
//!
//! At an angle α between the axis and the normal of a wall at the perpendicular distance d, a sonar reports
//!
//! ```text
//! d                        the foot of the perpendicular
//! d / cos α                the point on its axis
//! d / cos(|α| − half)      the nearest point of a cone with this half-angle
//! ```
//!
//! or something else. The shares of these four are the maximum of the likelihood of a mixture (expectation–maximization: Dempster, Laird and
//! Rubin 1977), for each of some half-angles.
//!
//! The pings are those at walls that stand alone (`lone_walls`).

/// Angles between axis and normal of an oblique wall, radians: 15° to 55°.
const OBLIQUE: [f64; 2] = [0.262, 0.96];
/// Deviations within which a range is that of the wall.
const OF_WALL: f64 = 4.0;
/// Deviations of pose and heading that the estimate leaves, metres and radians.
const POSE: [f64; 2] = [0.005, 0.01];
/// Fewest pings of a share.
const FEWEST: usize = 40;
/// Fewest echoes of oblique walls from which their source is determined.
const ENOUGH: f64 = 20.0;
/// Pings in a row that count as one sample: they meet the same objects.
const BLOCK: usize = 20;
/// The half-angles that are compared, degrees.
const HALF_ANGLES: std::ops::RangeInclusive<u8> = 5..=35;
/// The logarithm of odds of 1,000 to 1, by which a cone must be more likely than none.
const DECISIVE: f64 = 6.9;

/// A share of pings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Its value.
    pub value: f64,
    /// Standard deviation, from the differences between blocks of 20 pings.
    pub deviation: f64,
}

impl Share {
    /// Half of its 95 % interval.
    #[must_use]
    pub fn half_interval(&self) -> f64 {
        1.96 * self.deviation
    }
}

/// What pings at a wall square to the sonar return, apart from its range, beyond the range up to which the sonar hardly misses an echo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Square {
    /// Their number.
    pub pings: usize,
    /// No echo.
    pub missed: Share,
    /// A shorter range, from an object before the wall, too.
    pub short: Share,
    /// A longer range.
    pub long: Share,
}

/// Where most echoes of oblique walls come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The foot of the perpendicular.
    Perpendicular,
    /// The point on the axis.
    Axis,
    /// The nearest point of the cone.
    Cone,
}

/// The distances that the echoes of oblique walls have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oblique {
    /// Their number, with those of objects.
    pub echoes: usize,
    /// Share of them that are the wall's.
    pub of_wall: f64,
    /// Share of these at the perpendicular distance.
    pub perpendicular: f64,
    /// Share of these along the axis.
    pub axis: f64,
    /// Those at the nearest point of a cone, if one is much more likely than none.
    pub cone: Option<Cone>,
}

/// A cone whose nearest point some echoes come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Their share of the wall's echoes.
    pub share: f64,
    /// Its half-angle, radians.
    pub half_angle: f64,
}

impl Oblique {
    /// Where more than half of the wall's echoes come from; `None`: too few echoes, or no place has more than half.
    #[must_use]
    pub fn source(&self) -> Option<Source> {
        #[expect(clippy::cast_precision_loss, reason = "numbers of echoes")]
        let of_wall = self.of_wall * self.echoes as f64;
        if of_wall < ENOUGH {
            return None;
        }
        let shares = [
            (self.perpendicular, Source::Perpendicular),
            (self.axis, Source::Axis),
            (self.cone.map_or(0.0, |cone| cone.share), Source::Cone),
        ];
        shares.into_iter().find(|(share, _)| *share > 0.5).map(|(_, source)| source)
    }
}

/// What the recording says of the sonar's echoes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Echoes {
    /// At walls square to the sonar.
    pub square: Option<Square>,
    /// At oblique walls.
    pub oblique: Option<Oblique>,
}

/// A ping at a wall that stands alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AtWall {
    /// Perpendicular distance, metres.
    pub(crate) distance: f64,
    /// Angle between axis and normal, without a sign, radians.
    pub(crate) angle: f64,
    /// The range without its scale error and its constant error, metres.
    pub(crate) range: Option<f64>,
    /// Growth of the range with the angle, metres per radian.
    pub(crate) bias: f64,
    /// Standard deviation of the range of this wall, metres.
    pub(crate) noise: f64,
}

/// What of the sensor is known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Angle between axis and normal up to which a wall is square to the sonar, radians.
    pub(crate) square: f64,
    /// Range up to which the sonar hardly misses an echo, metres.
    pub(crate) sure_within: f64,
    /// Longest range, metres.
    pub(crate) farthest: f64,
}

/// What a share is counted of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Returned {
    Wall,
    Nothing,
    Shorter,
    Longer,
}

impl AtWall {
    /// The range of a point of the wall at this angle from its normal, radians, and its standard deviation.
    fn expected(&self, off: f64) -> (f64, f64) {
        let range = self.distance / off.cos();
        let [position, heading] = POSE;
        let by_heading = range * off.tan() * heading;
        (range, (self.noise.powi(2) + position.powi(2) + by_heading.powi(2)).sqrt())
    }

    fn returned(&self) -> Returned {
        let Some(range) = self.range else { return Returned::Nothing };
        let (expected, deviation) = self.expected(0.0);
        let error = range - expected - self.bias * self.angle;
        if error.abs() <= OF_WALL * deviation {
            Returned::Wall
        } else if error < 0.0 {
            Returned::Shorter
        } else {
            Returned::Longer
        }
    }

    /// Density of a range from a point of the wall, one per metre.
    fn density(&self, range: f64, off: f64, bias: f64) -> f64 {
        let (expected, deviation) = self.expected(off);
        let error = (range - expected - bias * self.angle) / deviation;
        (-0.5 * error.powi(2)).exp() / (deviation * (2.0 * std::f64::consts::PI).sqrt())
    }
}

impl Echoes {
    /// From pings at walls that stand alone.
    pub(crate) fn of(pings: &[AtWall], limits: &Limits) -> Self {
        let is_square =
            |ping: &&AtWall| ping.angle <= limits.square && ping.distance >= limits.sure_within;
        let returned: Vec<Returned> =
            pings.iter().filter(is_square).map(AtWall::returned).collect();
        let [least, most] = OBLIQUE;
        let oblique: Vec<AtWall> = pings
            .iter()
            .filter(|ping| ping.range.is_some() && (least..=most).contains(&ping.angle))
            .copied()
            .collect();
        Self {
            square: (returned.len() >= FEWEST).then(|| Square {
                pings: returned.len(),
                missed: share_of(&returned, Returned::Nothing),
                short: share_of(&returned, Returned::Shorter),
                long: share_of(&returned, Returned::Longer),
            }),
            oblique: (oblique.len() >= FEWEST).then(|| distances(&oblique, limits.farthest)),
        }
    }
}

/// A share with its deviation: that of independent pings, or that of the blocks if it is larger.
fn share_of(returned: &[Returned], what: Returned) -> Share {
    #[expect(clippy::cast_precision_loss, reason = "numbers of pings")]
    let of = |some: &[Returned]| {
        some.iter().filter(|one| **one == what).count() as f64 / some.len() as f64
    };
    #[expect(clippy::cast_precision_loss, reason = "numbers of pings")]
    let count = returned.len() as f64;
    let value = of(returned);
    // One ping more and one less: a share of 0 has a deviation, too.
    let smoothed = (value * count + 1.0) / (count + 2.0);
    let independent = smoothed * (1.0 - smoothed) / count;
    let blocks: Vec<f64> =
        returned.chunks_exact(BLOCK).map(|block| (of(block) - value).powi(2)).collect();
    #[expect(clippy::cast_precision_loss, reason = "numbers of blocks")]
    let number = blocks.len() as f64;
    let between =
        if number > 1.0 { blocks.iter().sum::<f64>() / (number * (number - 1.0)) } else { 0.0 };
    Share { value, deviation: independent.max(between).sqrt() }
}

/// The shares of the distances, with a cone if one is much more likely than none.
fn distances(echoes: &[AtWall], reach: f64) -> Oblique {
    let mut best = Mixture::maximum(echoes, reach, None);
    for degrees in HALF_ANGLES {
        let with = Mixture::maximum(echoes, reach, Some(f64::from(degrees).to_radians()));
        let needed = if best.half_angle.is_some() { 0.0 } else { DECISIVE };
        if with.likelihood > best.likelihood + needed {
            best = with;
        }
    }
    let [perpendicular, axis, cone, other] = best.shares;
    let of_wall = 1.0 - other;
    let part = |share: f64| if of_wall > 0.0 { share / of_wall } else { 0.0 };
    Oblique {
        echoes: echoes.len(),
        of_wall,
        perpendicular: part(perpendicular),
        axis: part(axis),
        cone: best.half_angle.map(|half_angle| Cone { share: part(cone), half_angle }),
    }
}

/// The maximum of the likelihood for one half-angle.
struct Mixture {
    likelihood: f64,
    /// Perpendicular, axis, cone, other.
    shares: [f64; 4],
    half_angle: Option<f64>,
}

impl Mixture {
    fn maximum(echoes: &[AtWall], reach: f64, half_angle: Option<f64>) -> Self {
        const ITERATIONS: usize = 60;
        let densities: Vec<[f64; 4]> = echoes
            .iter()
            .filter_map(|echo| {
                let range = echo.range?;
                let cone = |half: f64| echo.density(range, (echo.angle - half).max(0.0), 0.0);
                Some([
                    echo.density(range, 0.0, echo.bias),
                    echo.density(range, echo.angle, 0.0),
                    half_angle.map_or(0.0, cone),
                    1.0 / reach,
                ])
            })
            .collect();
        let mut shares = [0.3, 0.3, if half_angle.is_some() { 0.3 } else { 0.0 }, 0.1];
        let mut likelihood = f64::NEG_INFINITY;
        for _ in 0..ITERATIONS {
            let mut sums = [0.0; 4];
            likelihood = 0.0;
            for of in &densities {
                let mut joint = shares;
                for (part, density) in joint.iter_mut().zip(of) {
                    *part *= density;
                }
                let whole: f64 = joint.iter().sum();
                likelihood += whole.ln();
                for (sum, part) in sums.iter_mut().zip(joint) {
                    *sum += part / whole;
                }
            }
            let all: f64 = sums.iter().sum();
            shares = sums.map(|sum| sum / all);
        }
        Self { likelihood, shares, half_angle }
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    const LIMITS: Limits = Limits { square: 0.14, sure_within: 0.0, farthest: 3.5 };

    /// A ping at a wall up to 55° off its normal.
    fn at_wall(rng: &mut impl Rng) -> AtWall {
        let (distance, angle) = (rng.random_range(0.4..1.5), rng.random_range(0.0..OBLIQUE[1]));
        AtWall { distance, angle, range: None, bias: 0.0, noise: 0.005 }
    }

    /// Oblique echoes of which parts come from each place, and the rest from objects.
    fn oblique(seed: u64, [perpendicular, axis, cone]: [f64; 3], half: f64) -> Oblique {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let pings: Vec<AtWall> = (0..1500)
            .map(|_| {
                let ping = at_wall(&mut rng);
                let chance: f64 = rng.random();
                let off = if chance < perpendicular {
                    0.0
                } else if chance < perpendicular + axis {
                    ping.angle
                } else if chance < perpendicular + axis + cone {
                    (ping.angle - half).max(0.0)
                } else {
                    return AtWall { range: Some(rng.random_range(0.1..3.5)), ..ping };
                };
                let noise: f64 = rng.sample(StandardNormal);
                AtWall { range: Some(ping.distance / off.cos() + 0.005 * noise), ..ping }
            })
            .collect();
        Echoes::of(&pings, &LIMITS).oblique.unwrap()
    }

    #[test]
    fn the_distances_of_oblique_walls_are_told_apart() {
        let half = 15_f64.to_radians();
        for (shares, source) in [
            ([0.8, 0.0, 0.0], Some(Source::Perpendicular)),
            ([0.0, 0.8, 0.0], Some(Source::Axis)),
            ([0.0, 0.0, 0.8], Some(Source::Cone)),
            ([0.6, 0.2, 0.0], Some(Source::Perpendicular)),
            ([0.3, 0.3, 0.3], None),
        ] {
            for seed in 0..4 {
                let found = oblique(seed, shares, half);
                assert_eq!(found.source(), source, "{shares:?}: {found:?}");
                let all: f64 = shares.iter().sum();
                let cone = found.cone.map_or(0.0, |cone| cone.share);
                let is = [found.perpendicular, found.axis, cone];
                for (is, share) in is.into_iter().zip(shares) {
                    assert!((is - share / all).abs() < 0.08, "{shares:?}: {found:?}");
                }
                assert!((found.of_wall - all).abs() < 0.08, "{found:?}");
                if shares[2] > 0.0 {
                    let found = found.cone.unwrap();
                    assert!((found.half_angle - half).abs() < 0.04, "{found:?}");
                }
            }
        }
    }

    #[test]
    fn few_echoes_of_a_wall_have_no_source() {
        let found = oblique(1, [0.01, 0.0, 0.0], 0.0);
        assert_eq!(found.source(), None, "{found:?}");
        let pings = [at_wall(&mut ChaCha8Rng::seed_from_u64(0)); FEWEST - 1];
        assert_eq!(Echoes::of(&pings, &Limits { square: 1.0, ..LIMITS }), Echoes::default());
    }

    /// The shares of independent pings, and of pings of which 40 in a row meet one object.
    #[test]
    fn intervals_of_shares_hold_for_pings_at_one_object_too() {
        for in_a_row in [1, 40] {
            let mut inside = 0;
            for seed in 0..200 {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                let mut returned = Vec::new();
                while returned.len() < 2000 {
                    let is_missed = rng.random::<f64>() < 0.1;
                    let one = if is_missed { Returned::Nothing } else { Returned::Wall };
                    returned.extend([one].repeat(in_a_row));
                }
                let found = share_of(&returned, Returned::Nothing);
                inside += usize::from((found.value - 0.1).abs() <= 1.96 * found.deviation);
            }
            assert!(inside >= 160, "{in_a_row}: {inside} of 200");
        }
    }
}
