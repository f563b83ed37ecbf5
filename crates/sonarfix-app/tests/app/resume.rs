//! Pose and calibration after an interruption, against the rules of `store/resume.rs` in `f64`.

use proptest::prelude::*;
use sonarfix::config::Config;
use sonarfix::filter::ekf::{STATES, StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::localizer::Start;
use sonarfix_app::store::{Resumed, Saved};

use crate::rig::config;

/// Index of the first state of the calibration.
const CALIBRATION: usize = 3;
const RANGE_SCALE: usize = 6;

fn state() -> impl Strategy<Value = StateEstimate> {
    prop::array::uniform7(-1.0_f32..1.0).prop_map(StateEstimate::from_array)
}

fn deviation() -> impl Strategy<Value = StandardDeviations> {
    // Of the size of the priors, below and above them; metres and radians for the pose.
    let pose = prop::array::uniform3(1e-3_f32..4.0);
    let calibration = prop::array::uniform4(1e-4_f32..0.05);
    (pose, calibration).prop_map(|([x, y, heading], [right, left, track_width, range])| {
        StandardDeviations::from_array([x, y, heading, right, left, track_width, range])
    })
}

prop_compose! {
    fn resumed()(
        state in state(), deviation in deviation(), flags in prop::array::uniform4(any::<bool>()),
    ) -> Resumed {
        let [has_pose, has_calibration, is_pose_interrupted, is_calibration_interrupted] = flags;
        Resumed {
            state, deviation, has_pose, has_calibration, is_pose_interrupted,
            is_calibration_interrupted, is_pose_stored: false,
        }
    }
}

/// The state of a robot whose record holds this estimate.
fn stored(state: StateEstimate, deviation: StandardDeviations) -> Resumed {
    Resumed { is_pose_stored: true, ..Resumed::interrupted(state, deviation) }
}

fn saved(state: StateEstimate, deviation: StandardDeviations) -> Saved {
    Saved { run: 1, seconds: 2, configuration: 3, is_parked: true, state, deviation }
}

/// A configuration in which every prior differs.
fn robot() -> Config {
    let mut config = config().localizer;
    config.prior.scale_right = 0.012;
    config.prior.scale_left = 0.017;
    config.prior.track_width = Metres(0.004);
    config.prior.range_scale = 0.021;
    config
}

/// The deviations at the start, by the table of the module.
fn expected(known: &Resumed, prior: [f64; STATES]) -> [f64; STATES] {
    let mut start = known.deviation.to_array().map(f64::from);
    for (at, (start, prior)) in start.iter_mut().zip(prior).enumerate().skip(CALIBRATION) {
        if known.is_calibration_interrupted {
            *start = if at == RANGE_SCALE { prior } else { (2.0 * *start).hypot(0.1 * prior) };
        }
        *start = start.min(prior);
    }
    let [x, y, heading, ..] = &mut start;
    if !known.has_pose {
        (*x, *y, *heading) = (1_000.0, 1_000.0, std::f64::consts::PI);
    } else if known.is_pose_interrupted {
        for position in [x, y] {
            *position = position.hypot(0.1).min(1_000.0);
        }
        *heading = heading.hypot(5.0_f64.to_radians()).min(std::f64::consts::PI);
    }
    start
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn the_deviations_at_the_start_follow_the_rules(known in resumed()) {
        let prior = Resumed::afresh(&robot()).deviation.to_array().map(f64::from);
        let start = known.deviation_at_start(&robot()).to_array().map(f64::from);
        for (at, (start, expected)) in start.into_iter().zip(expected(&known, prior)).enumerate() {
            prop_assert!((start - expected).abs() <= 1e-6 * expected, "{at}: {start}, {expected}");
        }
    }

    /// Nothing but what the name of each function states changes.
    #[test]
    fn each_change_changes_its_part(known in resumed(), other in resumed()) {
        let both = Resumed { is_pose_interrupted: true, is_calibration_interrupted: true, ..known };
        prop_assert_eq!(known.interrupted_again(), both);

        let [_, _, _, right, left, width, range] = known.state.to_array();
        let state = StateEstimate::from_array([0.0, 0.0, 0.0, right, left, width, range]);
        let [_, _, _, right, left, width, range] = known.deviation.to_array();
        let deviation = StandardDeviations::from_array([0.0, 0.0, 0.0, right, left, width, range]);
        let without = Resumed { state, deviation, has_pose: false, ..known };
        prop_assert_eq!(known.without_pose(), without);
        let stored = Resumed { is_pose_stored: true, ..known };
        prop_assert_eq!(stored.without_pose(), without);

        let part = |pose: [f32; STATES], calibration: [f32; STATES]| {
            std::array::from_fn(|at| if at < CALIBRATION { pose[at] } else { calibration[at] })
        };
        let calibrated = Resumed {
            state: StateEstimate::from_array(part(known.state.to_array(), other.state.to_array())),
            deviation: StandardDeviations::from_array(
                part(known.deviation.to_array(), other.deviation.to_array()),
            ),
            has_calibration: other.has_calibration,
            is_calibration_interrupted: other.is_calibration_interrupted,
            ..known
        };
        prop_assert_eq!(known.calibrated_as(&other), calibrated);

        let start = Start {
            pose: Pose::new(5.0, 6.0, Radians(0.7)),
            position_deviation: Metres(0.03),
            heading_deviation: Radians(0.04),
        };
        let at = known.at(&start);
        let state = part([5.0, 6.0, 0.7, 0.0, 0.0, 0.0, 0.0], known.state.to_array());
        let deviation = part([0.03, 0.03, 0.04, 0.0, 0.0, 0.0, 0.0], known.deviation.to_array());
        prop_assert_eq!(at.state.to_array().map(f32::to_bits), state.map(f32::to_bits));
        prop_assert_eq!(at.deviation.to_array().map(f32::to_bits), deviation.map(f32::to_bits));
        let whole = Resumed { state: at.state, deviation: at.deviation, has_pose: true, ..known };
        prop_assert_eq!(at, Resumed { is_pose_interrupted: false, ..whole });
    }

    /// One number of a record that no localizer has, whichever it is: nothing of the record is used.
    #[test]
    fn an_unsound_record_is_not_used(
        state in state(), deviation in deviation(), which in 0..2 * STATES,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1e-3]),
    ) {
        let afresh = Resumed::afresh(&robot());
        let sound = Resumed::from(&saved(state, deviation), &robot(), 3);
        prop_assert_eq!(sound, stored(state, deviation));
        let (mut values, mut deviations) = (state.to_array(), deviation.to_array());
        if which < STATES {
            // A negative number is a valid state.
            values[which] = if value.is_finite() { f32::NAN } else { value };
        } else {
            deviations[which - STATES] = value;
        }
        let (state, deviation) =
            (StateEstimate::from_array(values), StandardDeviations::from_array(deviations));
        prop_assert_eq!(Resumed::from(&saved(state, deviation), &robot(), 3), afresh);
    }

    /// A record of a robot that might drive has no pose; one of another configuration has no calibration.
    #[test]
    fn a_record_is_used_as_far_as_it_is_valid(state in state(), deviation in deviation()) {
        let whole = stored(state, deviation);
        let record = saved(state, deviation);
        let driving = Saved { is_parked: false, ..record };
        prop_assert_eq!(Resumed::from(&driving, &robot(), 3), whole.without_pose());
        let other = Resumed::from(&record, &robot(), 4);
        prop_assert_eq!(other, whole.calibrated_as(&Resumed::afresh(&robot())));
    }
}
