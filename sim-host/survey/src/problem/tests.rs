use proptest::prelude::*;
use sonarfix_batch::chain_of_poses::Spacing;
use sonarfix_batch::odometry::WheelNoise;
use sonarfix_batch::recording::{Ping, Reading};

use super::*;

/// Step of the differences, metres or radians.
const H: f64 = 1e-8;

fn recording(steps: &[[f64; 2]], bearings: &[f64]) -> Recording {
    let mut recording = Recording::default();
    let mut travel = [0.0, 0.0];
    recording.readings.push(Reading { time: 0.0, travel });
    for (n, (step, bearing)) in (1..).zip(steps.iter().zip(bearings.iter().cycle())) {
        travel = [travel[0] + step[0], travel[1] + step[1]];
        let time = 0.1 * f64::from(n);
        recording.pings.push(Ping { time: time - 0.04, bearing: *bearing, range: Some(1.1) });
        recording.readings.push(Reading { time, travel });
    }
    recording
}

/// The state after a change of one unknown: poses, constants, then angle and offset of each line.
fn moved(state: &State, unknown: usize, by: f64) -> State {
    let mut state = state.clone();
    let poses = 3 * state.poses.len();
    match unknown {
        k if k < poses => state.poses[k / 3][k % 3] += by,
        k if k < poses + COUNT => state.constants[k - poses] += by,
        k => {
            let line = &mut state.lines[(k - poses - COUNT) / 2];
            if (k - poses - COUNT).is_multiple_of(2) { line.angle += by } else { line.offset += by }
        }
    }
    state
}

proptest! {
    /// The right-hand side is the negative gradient of the cost, with all losses and priors.
    #[test]
    fn the_right_hand_side_is_the_gradient_of_the_cost(
        steps in prop::collection::vec([0.01..0.06_f64, 0.01..0.06_f64], 20..40),
        bearings in prop::collection::vec(-0.3..0.3_f64, 7),
        noise in prop::collection::vec(-1e-3..1e-3_f64, 300),
        constants in prop::array::uniform7(-0.01..0.01_f64),
    ) {
        let recording = recording(&steps, &bearings);
        let spacing = Spacing { travel: 0.2, turn: 0.03, at_echoes: false };
        let chain = Chain::build(&recording, 0.0, spacing).unwrap();
        let robot =
            Robot { track_width: 0.12, mount: [0.06, 0.01], wheel_noise: WheelNoise::independent(3e-3), reach: [0.1, 3.0] };
        let lines = vec![Line { angle: 0.02, offset: 1.2 }, Line { angle: 0.1, offset: 1.19 }];
        let mut noise = noise.into_iter().cycle();
        let mut state = State { poses: vec![Vector3::zeros(); chain.len()], constants, lines };
        let drive = state.drive(&robot);
        for (i, edge) in chain.edges.iter().enumerate() {
            let (pose, _) = compose(&state.poses[i], &integrate(edge, &drive).pose);
            state.poses[i + 1] = pose + Vector3::from_fn(|_, _| noise.next().unwrap());
        }
        let mut priors = [(0.0, 0.02); COUNT];
        priors[AXES] = (0.0, 1.0);
        let problem = Problem {
            recording: &recording,
            chain: &chain,
            robot,
            range_noise: 0.05,
            matches: (0..chain.pings.len()).map(|k| [Some(0), Some(1), None][k % 3]).collect(),
            priors,
            is_square: true,
            kernel: 4.0,
        };
        let window = Window {
            poses: 0..chain.len(),
            first: (Vector3::zeros(), Matrix3::identity() * 0.01),
            pings: 0..chain.pings.len(),
            holds: vec![(1, Vector2::new(1.2, 0.3), 0.02)],
        };
        let (normal, _, order) = problem.linearize(&state, &window);
        let count = 3 * chain.len();
        for unknown in 0..count + COUNT + 4 {
            let cost = |by: f64| problem.linearize(&moved(&state, unknown, by), &window).1;
            let slope = (cost(H) - cost(-H)) / (2.0 * H);
            let rhs = if unknown < count {
                normal.poses[unknown / 3][unknown % 3]
            } else if unknown < count + COUNT {
                normal.constants[unknown - count]
            } else {
                let k = unknown - count - COUNT;
                let column = order.iter().position(|&line| line == k / 2).unwrap();
                normal.constants[COUNT + 2 * column + k % 2]
            };
            // The noise of the travel grows with the wheels, which the equations neglect.
            let neglected = [count + DIFFERENCE, count + TRACK].contains(&unknown);
            let least = if neglected { 5e4 } else { 1.0 };
            // The curvature of the loss of an edge jumps at its threshold; a difference across it is off by at most
            // the step times a quarter of the curvature.
            let curvature = if unknown < count {
                normal.diagonal[unknown / 3][(unknown % 3, unknown % 3)]
            } else {
                0.0
            };
            let limit = 1e-3 * (least + slope.abs()) + 0.25 * H * curvature;
            prop_assert!((rhs + slope).abs() < limit, "{unknown}: {rhs} {slope}");
        }
    }
}
