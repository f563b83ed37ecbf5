//! The bank against a sorted list, and placements that move in `f64`.

use std::vec::Vec as List;

use proptest::prelude::*;

use super::*;

fn is_one_mode(one: &Placement, other: &Placement, distance: f32) -> Option<bool> {
    let wide = |vector: Vector| (f64::from(vector.x), f64::from(vector.y));
    let ((x0, y0), (x1, y1)) = (wide(one.at), wide(other.at));
    let ((c0, s0), (c1, s1)) = (wide(one.rotation), wide(other.rotation));
    let agreement = c0 * c1 + s0 * s1 - 0.906;
    let between = (x0 - x1).hypot(y0 - y1) - f64::from(distance);
    let is_clear = agreement.abs() > 1e-4 && between.abs() > 1e-4;
    is_clear.then_some(agreement > 0.0 && between < 0.0)
}

prop_compose! {
    fn placement()(
        (x, y) in (0.0_f32..1.5, 0.0_f32..0.6), angle in prop::sample::select(&[-0.3_f32, 0.0, 0.3, 3.0][..]),
        bend in (-0.1_f32..0.1, -0.1_f32..0.1),
    ) -> Placement {
        Placement {
            at: Vector::new(x, y), rotation: Vector::of_angle(angle), bend: Bend { drift: bend.0, turn_scale: bend.1 },
        }
    }
}

prop_compose! {
    fn entry()(placement in placement(), score in 0_u8..20, past in 0_u8..30) -> Entry {
        let (score, past) = (f32::from(score), f32::from(past));
        let evidence = past + 0.5 * score;
        Entry { score, evidence, state: State::Fresh, ..Entry::proposed(placement, past) }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { max_global_rejects: 50_000, ..ProptestConfig::default() })]

    /// One entry for each mode, the one with the best score of it and the largest past, ranked by evidence; the first ones of equal
    /// evidence stay.
    #[test]
    fn the_bank_holds_the_best_of_each_mode(entries in prop::collection::vec(entry(), 1..30)) {
        let mut bank: Bank<4> = Bank::new();
        let mut expected: List<Entry> = List::new();
        for entry in entries {
            let mut same = List::new();
            for other in &expected {
                let is_same = is_one_mode(&other.placement, &entry.placement, 0.3);
                prop_assume!(is_same.is_some());
                same.push(is_same == Some(true));
            }
            let of_mode = || expected.iter().zip(&same).filter(|(_, is_same)| **is_same).map(|(other, _)| other);
            prop_assert_eq!(bank.has_near(&entry.placement, 0.3), of_mode().count() > 0);
            bank.offer(entry);
            if of_mode().all(|other| other.score < entry.score) {
                let past = of_mode().map(|other| other.past).fold(entry.past, f32::max);
                let mut same = same.iter();
                expected.retain(|_| same.next() == Some(&false));
                expected.push(Entry { past, evidence: entry.evidence + past - entry.past, ..entry });
                // Stable.
                expected.sort_by(|one, other| other.evidence.total_cmp(&one.evidence));
                expected.truncate(4);
            }
            prop_assert_eq!(bank.entries(), &expected[..]);
            let least = (expected.len() == 4).then(|| expected[3].score);
            prop_assert_eq!(bank.least_score(), least);
            let least = expected.iter().map(|entry| entry.past).fold(f32::INFINITY, f32::min);
            // No more than 10.5 below the best.
            let least = least.max(expected[0].past - 10.5);
            prop_assert_eq!(bank.least_past().to_bits(), least.to_bits());
        }
    }

    /// The station is where the path to it, bent by what is not taken out, leads from the origin.
    #[test]
    fn a_placement_moves_with_the_reference(
        placement in placement(), (x, y) in (-2.0_f32..2.0, -2.0_f32..2.0), taken in (-0.1_f32..0.1, -0.1_f32..0.1),
        (travelled, turned) in (-3.0_f32..3.0, -3.0_f32..3.0),
    ) {
        let station = Station { at: Vector::new(x, y), travelled, turned };
        let wide = f64::from;
        let turn = (wide(placement.bend.drift) - wide(taken.0)) * wide(travelled)
            + (wide(placement.bend.turn_scale) - wide(taken.1)) * wide(turned);
        let angle = wide(placement.rotation.y).atan2(wide(placement.rotation.x));
        let (sin, cos) = (angle + 0.5 * turn).sin_cos();
        let at = (
            wide(placement.at.x) + cos * wide(x) - sin * wide(y),
            wide(placement.at.y) + sin * wide(x) + cos * wide(y),
        );
        let (sin, cos) = (angle + turn).sin_cos();
        let bend = Bend { drift: taken.0, turn_scale: taken.1 };
        let mut bank: Bank<4> = Bank::of(&[Entry::proposed(placement, 0.0)]);
        bank.rebase(&station, bend);
        let moved = bank.entries()[0].placement;
        for (is, expected) in [
            (moved.at.x, at.0), (moved.at.y, at.1), (moved.rotation.x, cos), (moved.rotation.y, sin),
        ] {
            prop_assert!((wide(is) - expected).abs() < 1e-5, "{moved:?}");
        }
        prop_assert_eq!(moved.bend, placement.bend);
    }

    #[test]
    fn a_near_placement_is_in_distance_and_rotation(
        one in placement(), other in placement(), distance in 0.1_f32..0.6,
    ) {
        let expected = is_one_mode(&one, &other, distance);
        prop_assume!(expected.is_some());
        let bank: Bank<4> = Bank::of(&[Entry::proposed(one, 0.0)]);
        prop_assert_eq!(Some(bank.has_near(&other, distance)), expected);
    }
}

/// Each entry is tried once, and leaves the bank when its trial ends.
#[test]
fn entries_are_tried_one_after_the_other() {
    let entry = |x: f32, score| {
        let rotation = Vector::new(1.0, 0.0);
        let placement = Placement { at: Vector::new(x, 0.0), rotation, bend: Bend::NONE };
        Entry { score, evidence: score, ..Entry::proposed(placement, 0.0) }
    };
    let mut bank: Bank<4> = Bank::of(&[entry(0.0, 3.0), entry(1.0, 2.0), entry(2.0, 1.0)]);
    for entry in bank.entries_mut() {
        entry.state = State::Fresh;
    }
    assert_eq!(bank.next_stale(), None);
    bank.begin_refinement();
    let first = bank.next_stale().unwrap();
    assert_eq!((first.score, first.state, bank.entries().len()), (3.0, State::InTrial, 3));
    bank.end_trial();
    assert_eq!(bank.entries().len(), 2);
    bank.offer(Entry { state: State::Fresh, ..first });
    assert_eq!(bank.next_stale().map(|entry| entry.score.to_bits()), Some(2.0_f32.to_bits()));
    bank.end_trial();
    assert_eq!(bank.next_stale().map(|entry| entry.score.to_bits()), Some(1.0_f32.to_bits()));
    bank.end_trial();
    assert_eq!(bank.next_stale(), None);
    assert_eq!(bank.entries().len(), 1);
    bank.clear();
    assert!(bank.entries().is_empty());
}
