//! Eq. (31) in `f64`.

use std::format;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::map::Wall;

impl EchoModel<'_> {
    /// Scores a ping at once.
    pub(in crate::search) fn explain(&self, beam: &Beam, sharpness: Sharpness) -> Explanation {
        let mut hearing = self.listen(beam, sharpness);
        self.hear(&mut hearing, (beam, sharpness), REFLECTORS).unwrap()
    }
}

/// A room of 6 m × 4 m with two walls in it.
fn walls(inside: [(f32, f32, f32); 2]) -> Vec<Wall> {
    let corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0), (0.0, 0.0)];
    let mut ends: Vec<_> = corners.windows(2).map(|ends| (ends[0], ends[1])).collect();
    ends.extend(inside.map(|(x, y, angle)| ((x, y), (x + angle.cos(), y + angle.sin()))));
    let point = |(x, y)| Point::new(x, y);
    ends.into_iter().map(|(from, to)| Wall::new(point(from), point(to)).unwrap()).collect()
}

fn sonar(cone: f32) -> RangerParameters {
    let mut sonar = sonarfix::config::Config::for_track_width(Metres(0.2)).rangers.first;
    (sonar.cone, sonar.max_range) = (Radians(cone), Metres(3.5));
    sonar
}

fn echo_of(missed: f32, short: f32, long: f32, free_path: Metres) -> EchoParameters {
    let mut echo = EchoParameters::HC_SR04;
    (echo.missed, echo.short, echo.long, echo.free_path) = (missed, short, long, free_path);
    echo
}

/// The reflectors in the cone up to `reach`, nearest first, and how far the axis is free.
fn in_beam(
    reflectors: &Reflectors,
    beam: &Beam,
    reach: f32,
    margin: f32,
) -> (heapless::Vec<Reflector, REFLECTORS>, f32) {
    let mut found = heapless::Vec::new();
    let free = reflectors.collect(beam, reach, margin, &mut found);
    (found, free)
}

prop_compose! {
    fn echo()(
        missed in 0.0_f32..0.5, short in 0.0_f32..0.2, long in 0.0_f32..0.2,
    ) -> EchoParameters {
        echo_of(missed, short, long, EchoParameters::HC_SR04.free_path)
    }
}

/// Logarithms of the probabilities that a reflector answers, and that it does not.
fn answers(model: &EchoModel, heard: Audibility) -> (f64, f64) {
    let of = |probability: f64| (probability.ln(), (1.0 - probability).ln());
    match heard {
        Audibility::Foot => (model.shares.answers.into(), model.shares.misses.into()),
        Audibility::Corner => of(0.75),
        Audibility::Rim => of(0.4),
        Audibility::End => of(0.1),
    }
}

/// A score, and by how much another explanation falls behind the best.
#[derive(Debug)]
struct Expected {
    score: f64,
    residual: Option<f64>,
    lead: f64,
}

/// Of the reflectors in the beam; `None` at a limit.
fn expected(
    model: &EchoModel,
    beam: &Beam,
    deviation: f32,
    beam_deviation: f64,
) -> Option<Expected> {
    let margin = 3.0 * deviation;
    let reach = beam.range.map_or(3.5, |range| range + margin);
    let (reflectors, free) = in_beam(&model.reflectors, beam, reach, margin);
    let sigma = f64::from(deviation);
    let mut missed = 0.0;
    let mut scores: Vec<(f64, Option<f64>)> = Vec::new();
    for reflector in &reflectors {
        let Some(heard) = model.reflectors.heard(beam, reflector) else { continue };
        let (hit, miss) = answers(model, heard);
        if let Some(range) = beam.range {
            let residual = f64::from(range) - f64::from(reflector.distance);
            if ((residual / sigma).abs() - 3.0).abs() < 1e-4 {
                return None;
            }
            if residual.abs() < 3.0 * sigma {
                let (one, other) = (beam.axis, reflector.toward);
                let sine =
                    f64::from(one.x) * f64::from(other.y) - f64::from(one.y) * f64::from(other.x);
                let normal = -0.5 * (residual / sigma).powi(2)
                    - (sigma * std::f64::consts::TAU.sqrt() * 0.25).ln();
                let aside = -0.5 * (sine / beam_deviation).powi(2);
                scores.push((missed + hit + normal + aside, Some(residual)));
            }
            // What lies behind the range has not answered.
            if residual < 0.0 {
                break;
            }
        }
        missed += miss;
    }
    let other = match beam.range {
        None => (0.7 + missed).max(model.shares.silence.into()),
        Some(range) => {
            let beyond = f64::from(range) - f64::from(free) - 3.0 * sigma;
            if beyond.abs() < 1e-4 {
                return None;
            }
            let clutter = if beyond < 0.0 { model.shares.before } else { model.shares.behind };
            (f64::from(clutter) + missed).max(-3.5)
        }
    };
    scores.push((other, None));
    scores.sort_by(|one, other| other.0.total_cmp(&one.0));
    let lead = scores.get(1).map_or(f64::INFINITY, |second| scores[0].0 - second.0);
    Some(Expected { score: scores[0].0, residual: scores[0].1, lead })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1_000, max_global_rejects: 50_000, ..ProptestConfig::default() })]

    /// Many ranges are near one that the map explains. Logarithms of probabilities are rounded to 0.0005, and a few are added.
    #[test]
    fn the_best_explanation_of_a_ping_is_that_of_the_mixture(
        inside in [(0.5_f32..5.5, 0.5_f32..3.5, -3.1_f32..3.1), (0.5_f32..5.5, 0.5_f32..3.5, -3.1_f32..3.1)],
        (x, y, angle) in (0.2_f32..5.8, 0.2_f32..3.8, -3.1_f32..3.1), echo in echo(), cone in 0.1_f32..0.5,
        deviation in 0.02_f32..0.2, (kind, off, any_range) in (0_usize..5, -4.0_f32..4.0, 0.1_f32..3.5),
    ) {
        let (walls, sonar) = (walls(inside), sonar(cone));
        let model = EchoModel::new(Map::new(&walls), &sonar, &echo);
        let silent = Beam { from: Vector::new(x, y), axis: Vector::of_angle(angle), range: None };
        let (reflectors, _) = in_beam(&model.reflectors, &silent, 3.5, 0.0);
        let near = reflectors.get(kind).map_or(any_range, |reflector| reflector.distance + off * deviation);
        let range = (kind < 4).then_some(near).filter(|range| *range >= 0.0);
        let beam = Beam { range, ..silent };
        let expected = expected(&model, &beam, deviation, 0.8 * f64::from(cone));
        prop_assume!(expected.is_some());
        let expected = expected.unwrap();
        let sharpness = Sharpness { deviation, ..Sharpness::new(deviation, 0.0) };
        let is = model.explain(&beam, sharpness);
        prop_assert!((f64::from(is.score) - expected.score).abs() < 4e-3, "{is:?} {expected:?}");
        if expected.lead > 8e-3 {
            prop_assert_eq!(is.target.is_some(), expected.residual.is_some(), "{:?} {:?}", is, expected);
        }
        if let (Some(target), Some(residual), true) = (is.target, expected.residual, expected.lead > 8e-3) {
            prop_assert!((f64::from(target.residual) - residual).abs() < 1e-5);
            let explains = |reflector: &Reflector| {
                let sine = beam.axis.left().dot(reflector.toward);
                target.toward == reflector.toward && (target.off_axis - sine).abs() < 1e-6
            };
            let reach = range.unwrap_or(0.0) + 3.0 * deviation;
            let (reflectors, _) = in_beam(&model.reflectors, &beam, reach, 3.0 * deviation);
            prop_assert!(reflectors.iter().any(explains), "{target:?}");
        }
    }

    /// The same bits, however much is looked at in one evaluation, and with the reflectors that were found, not what is left of
    /// them in memory.
    #[test]
    fn a_ping_that_is_looked_at_in_parts_has_the_same_score(
        inside in [(0.5_f32..5.5, 0.5_f32..3.5, -3.1_f32..3.1), (0.5_f32..5.5, 0.5_f32..3.5, -3.1_f32..3.1)],
        (x, y, angle) in (0.2_f32..5.8, 0.2_f32..3.8, -3.1_f32..3.1), cone in 0.1_f32..0.5,
        range in prop::option::of(0.1_f32..3.5), parts in prop::collection::vec(0_usize..4, 6),
    ) {
        let (walls, sonar) = (walls(inside), sonar(cone));
        let model = EchoModel::new(Map::new(&walls), &sonar, &EchoParameters::HC_SR04);
        let beam = Beam { from: Vector::new(x, y), axis: Vector::of_angle(angle), range };
        let sharpness = Sharpness::new(0.08, 0.0);
        let reach = range.map_or(3.5, |range| range + 3.0 * sharpness.deviation);
        let (reflectors, _) = in_beam(&model.reflectors, &beam, reach, 3.0 * sharpness.deviation);
        for reflector in &reflectors {
            let again = model.reflectors.at(&beam, reflector.place());
            prop_assert_eq!(format!("{:?}", again), format!("{:?}", Some(reflector)));
        }
        let mut hearing = model.listen(&beam, sharpness);
        prop_assert_eq!(hearing.at_first(), (6 - reflectors.len()) / 2);
        let mut parts = parts.into_iter();
        let (mut looked, mut explanation) = (0, None);
        while explanation.is_none() {
            let most = parts.next().unwrap_or(1);
            explanation = model.hear(&mut hearing, (&beam, sharpness), most);
            looked += most;
            prop_assert!(explanation.is_some() || usize::from(hearing.heard) == looked);
        }
        let at_once = model.explain(&beam, sharpness);
        prop_assert_eq!(format!("{:?}", explanation.unwrap()), format!("{:?}", at_once));
    }

    #[test]
    fn the_score_of_nothing_is_that_of_clutter_or_silence(echo in echo()) {
        let walls = walls([(1.0, 1.0, 0.0); 2]);
        let model = EchoModel::new(Map::new(&walls), &sonar(0.2), &echo);
        let (clutter, silence) = (f64::from(model.shares.before), f64::from(model.shares.silence));
        for (has_echo, expected) in [(true, clutter.max(-3.5)), (false, silence.max(0.7))] {
            let is = f64::from(model.nothing(has_echo));
            prop_assert!((is - expected).abs() < 1e-6, "{is} {expected}");
        }
    }

    #[test]
    fn deviations_of_range_and_odometry_are_independent(
        deviation in 0.02_f32..0.2, odometry in 0.0_f32..0.3,
    ) {
        let sharpness = Sharpness::new(deviation, odometry);
        let expected = f64::from(deviation).hypot(odometry.into());
        prop_assert!((f64::from(sharpness.deviation) - expected).abs() < 1e-5);
        let peak = -(expected * std::f64::consts::TAU.sqrt() * 0.25).ln();
        prop_assert!((f64::from(sharpness.peak) - peak).abs() < 1e-4);
    }
}

/// Behind a wall that hardly ever fails to answer nothing is looked at: a corner there makes no echo more or less likely.
#[test]
fn what_is_certain_to_answer_ends_the_list_of_reflectors() {
    let walls = walls([(1.0, 1.0, 0.0); 2]);
    let echo = echo_of(0.0, 0.0, 0.0, Metres(1e9));
    let model = EchoModel::new(Map::new(&walls), &sonar(0.5), &echo);
    let beam = Beam { from: Vector::new(5.0, 3.7), axis: Vector::new(1.0, 0.0), range: None };
    let (reflectors, _) = in_beam(&model.reflectors, &beam, 3.5, 3.0);
    let heard: Vec<Option<Audibility>> =
        reflectors.iter().map(|reflector| model.reflectors.heard(&beam, reflector)).collect();
    assert_eq!(heard, [Some(Audibility::Foot), Some(Audibility::Corner)]);
    let is = f64::from(model.explain(&beam, Sharpness::new(1.0, 0.0)).score);
    assert!((is - (0.7 + 0.01_f64.ln())).abs() < 1e-3, "{is}");
}

/// The deviations of a score by the noise of the sonar at a metre and the error of the map, in quadrature, up to 3.5 cm.
#[test]
fn a_coarser_sonar_or_map_has_a_less_sharp_score() {
    use sonarfix::sensor::range::RangeNoise;
    let of = |floor: f32, per_metre: f32, map: f32| {
        let mut sonar = sonar(0.3);
        sonar.noise = RangeNoise { floor: Metres(floor), per_metre };
        let mut echo = EchoParameters::HC_SR04;
        echo.map_accuracy = Metres(map);
        let model = EchoModel::new(Map::new(&[]), &sonar, &echo);
        [model.fine(), model.sharp()].map(f64::from)
    };
    for (floor, per_metre, map) in [
        (0.0, 0.0, 0.0),
        (0.003, 0.004, 0.0),
        (0.015, 0.0, 0.0),
        (0.003, 0.01, 0.02),
        (0.015, 0.005, 0.06),
    ] {
        let [floor_, slope, of_map] = [floor, per_metre, map].map(f64::from);
        let other = (floor_.powi(2) + slope.powi(2) + of_map.powi(2)).min(0.035_f64.powi(2) - 4e-4);
        for (is, least) in of(floor, per_metre, map).into_iter().zip([0.02_f64, 0.015]) {
            assert!((is - (least.powi(2) + other).sqrt()).abs() < 1e-6, "{is}");
        }
    }
}
