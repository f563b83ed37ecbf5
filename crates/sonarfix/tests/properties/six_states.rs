//! Without a prior for the range scale, the filter equals the six-state one of the paper, bit for
//! bit.

use nalgebra::SMatrix;
use proptest::prelude::*;
use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::{Heading, Point};
use sonarfix::geometry::trig::sin_cos;
use sonarfix::geometry::units::{Metres, Radians, SquareMetres};
use sonarfix::map::Wall;
use sonarfix::sensor::range::ExpectedRange;

use crate::strategies::{Event, any_deviation, any_drive, any_event, any_state, bits};

/// The constants of the crate, eqs. (10) and (20).
const ROUNDING: f32 = 1.0 / 4_194_304.0;
const SHARPEST: f32 = 1.0 / 16_384.0;

/// A filter without a range scale: the equations of the crate, in the same order, without the
/// seventh state. Indices: x, y, heading, mean and difference of the scale errors, width.
#[derive(Debug, Clone, Copy)]
struct SixStateFilter {
    x: [f32; 6],
    /// Kahan compensation of x, y, heading.
    compensation: [f32; 3],
    /// Upper triangle; entries below the diagonal are not used.
    p: [[f32; 6]; 6],
    drive: Drive,
    /// Distance of both wheels since the last update; the random walk of the calibration over it is
    /// not in `p`.
    distance_since_update: f32,
}

/// Adds to a sum with Kahan compensation.
fn add(sum: &mut f32, compensation: &mut f32, change: f32) {
    let change = change + *compensation;
    let before = *sum;
    *sum = before + change;
    *compensation = change - (*sum - before);
}

impl SixStateFilter {
    fn new(drive: Drive, state: StateEstimate, deviation: StandardDeviations) -> Self {
        let [x, y, heading, right, left, width, _] = state.to_array();
        let heading = Heading::new(Radians(heading)).radians().0;
        let x = [x, y, heading, 0.5 * (right + left), right - left, width];
        let [xx, yy, hh, rr, ll, ww, _] = deviation.to_array().map(|sigma| sigma * sigma);
        let mut p = [[0.0; 6]; 6];
        p[0][0] = xx;
        p[1][1] = yy;
        p[2][2] = hh;
        p[3][3] = 0.25 * (rr + ll);
        p[3][4] = 0.5 * (rr - ll);
        p[4][4] = rr + ll;
        p[5][5] = ww;
        Self { x, compensation: [0.0; 3], p, drive, distance_since_update: 0.0 }
    }

    /// An entry, from the upper triangle.
    fn at(&self, i: usize, j: usize) -> f32 {
        if i <= j { self.p[i][j] } else { self.p[j][i] }
    }

    /// Eqs. (4), (5) and (7) to (10).
    fn predict(&mut self, travel: WheelTravel) {
        let (right, left) = (travel.right.0, travel.left.0);
        let [_, _, heading, common, difference, width_error] = self.x;
        let factor_r = (1.0 + common) + 0.5 * difference;
        let factor_l = (1.0 + common) - 0.5 * difference;
        let (rolled_r, rolled_l) = (right * factor_r, left * factor_l);
        let per_width = 1.0 / (self.drive.track_width.0 + width_error);
        let turn = (rolled_r - rolled_l) * per_width;
        let advance = 0.5 * (rolled_r + rolled_l);
        let (sin, cos) = sin_cos(Radians(heading + 0.5 * turn));
        let position = [advance * cos, advance * sin];
        let per_metre = 0.25 * (self.drive.wheel_noise.0.0 * self.drive.wheel_noise.0.0);
        let (of_r, of_l) =
            ((right * factor_r * factor_r).abs(), (left * factor_l * factor_l).abs());
        let noise_s = per_metre * (of_r + of_l);
        let per_half_width = per_width + per_width;
        let noise_t = noise_s * per_half_width * per_half_width;
        let noise_st = per_metre * (of_r - of_l) * per_half_width;
        // Derivatives of advance and turn by c, d and w, and of x and y by the heading and these.
        let of_advance = [0.5 * (right + left), 0.25 * (right - left)];
        let of_turn =
            [(right - left) * per_width, 0.5 * (right + left) * per_width, -turn * per_width];
        let swing = [-position[1], position[0]];
        let row = |axis: usize, along: f32| {
            let half = 0.5 * swing[axis];
            [
                swing[axis],
                along * of_advance[0] + half * of_turn[0],
                along * of_advance[1] + half * of_turn[1],
                half * of_turn[2],
            ]
        };
        let (of_x, of_y) = (row(0, cos), row(1, sin));
        let noise = |axis: usize, along: f32| {
            let half = 0.5 * swing[axis];
            (half * noise_t + along * noise_st, half * noise_st + along * noise_s)
        };
        let ((xt, xs), (yt, ys)) = (noise(0, cos), noise(1, sin));
        let (half_x, half_y) = (0.5 * swing[0], 0.5 * swing[1]);
        let (qxx, qxy) = (half_x * xt + cos * xs, half_x * yt + cos * ys);
        let qyy = half_y * yt + sin * ys;

        let old = Self { p: self.with_random_walk(), ..*self };
        self.distance_since_update += right.abs() + left.abs();
        let at = |i: usize, j: usize| old.at(i, j);
        let turn_of = |c: f32, d: f32, w: f32| of_turn[0] * c + of_turn[1] * d + of_turn[2] * w;
        let along = |row: &[f32; 4], v: [f32; 4]| {
            row[0] * v[0] + row[1] * v[1] + row[2] * v[2] + row[3] * v[3]
        };
        let column = |j: usize| [at(2, j), at(3, j), at(4, j), at(5, j)];
        // Covariances of the turn with the calibration, and of the new x and y with the old heading and the calibration.
        let t: [f32; 3] =
            core::array::from_fn(|k| turn_of(at(3, k + 3), at(4, k + 3), at(5, k + 3)));
        let moved = |i: usize, row: &[f32; 4]| -> [f32; 4] {
            core::array::from_fn(|k| at(i, k + 2) + along(row, column(k + 2)))
        };
        let (x, y) = (moved(0, &of_x), moved(1, &of_y));
        let lacking = |variance: f32, noise: f32| (0.5 * ROUNDING * variance - noise).max(0.0);
        let mut new = self.p;
        for (i, row, moved, q) in [(0, of_x, x, qxx), (1, of_y, y, qyy)] {
            let sum = core::array::from_fn(|k| at(i, k + 2) + moved[k]);
            let growth = along(&row, sum);
            new[i][i] += lacking(new[i][i], noise_s) + (growth + ROUNDING * growth.abs() + q);
        }
        new[0][1] += along(&of_y, column(0)) + along(&of_x, y) + qxy;
        for (i, moved, q) in [(0, x, xt), (1, y, yt)] {
            new[i][2] = moved[0] + (turn_of(moved[1], moved[2], moved[3]) + q);
            new[i][3..6].copy_from_slice(&moved[1..]);
        }
        let [hc, hd, hw] = core::array::from_fn(|k| at(2, k + 3) + t[k]);
        let growth = turn_of(at(2, 3) + hc, at(2, 4) + hd, at(2, 5) + hw);
        new[2][2] += lacking(new[2][2], noise_t) + (growth + noise_t);
        new[2][3..6].copy_from_slice(&[hc, hd, hw]);
        self.p = new;
        self.add_to_pose(0, position[0]);
        self.add_to_pose(1, position[1]);
        self.add_to_pose(2, turn);
    }

    /// P, with the random walk of the calibration.
    fn with_random_walk(&self) -> [[f32; 6]; 6] {
        let scale_walk = self.drive.scale_walk.0 * self.drive.scale_walk.0;
        let width_walk = self.drive.track_width_walk.0.0 * self.drive.track_width_walk.0.0;
        let mut p = self.p;
        for (i, walk) in [0.25 * scale_walk, scale_walk, 0.5 * width_walk].into_iter().enumerate() {
            p[3 + i][3 + i] += self.distance_since_update * walk;
        }
        p
    }

    /// Adds to x, y or heading.
    fn add_to_pose(&mut self, i: usize, by: f32) {
        add(&mut self.x[i], &mut self.compensation[i], by);
        self.x[2] = Heading::new(Radians(self.x[2])).radians().0;
    }

    /// The expected range, and its derivatives by x, y and heading.
    fn expected(&self, wall: &Wall, mount: Point) -> (f32, [f32; 3]) {
        let (sin, cos) = sin_cos(Radians(self.x[2]));
        let lever_x = cos * mount.x.0 - sin * mount.y.0;
        let lever_y = sin * mount.x.0 + cos * mount.y.0;
        let sonar = Point::new(self.x[0] + lever_x, self.x[1] + lever_y);
        let signed = wall.signed_distance(sonar).0;
        let side = if signed < 0.0 { -1.0 } else { 1.0 };
        let (by_x, by_y) = (side * wall.a(), side * wall.b());
        (side * signed, [by_x, by_y, by_y * lever_x - by_x * lever_y])
    }

    /// P Hᵀ.
    fn cross(&self, h: [f32; 3]) -> [f32; 6] {
        core::array::from_fn(|i| self.at(i, 0) * h[0] + self.at(i, 1) * h[1] + self.at(i, 2) * h[2])
    }

    fn update(&mut self, range: f32, expected: f32, h: [f32; 3], noise: f32) {
        (self.p, self.distance_since_update) = (self.with_random_walk(), 0.0);
        let dot = |m: &[f32; 6]| h[0] * m[0] + h[1] * m[1] + h[2] * m[2];
        let m = self.cross(h);
        let Some(noise) = self.limited_noise(noise, h, &m) else { return };
        let variance = noise + dot(&m);
        let per_variance = 1.0 / variance;
        let gain = m.map(|m| m * per_variance);
        let innovation = range - expected;
        for i in 0..3 {
            self.add_to_pose(i, gain[i] * innovation);
        }
        for i in 3..6 {
            self.x[i] += gain[i] * innovation;
        }
        self.each(|i, j, p| p + (-variance * gain[i]) * gain[j]);
        if variance <= 256.0 * noise {
            return;
        }
        let left_over = self.cross(h);
        let rest = noise - 0.5 * (dot(&gain) * noise - dot(&left_over));
        let e: [f32; 6] = core::array::from_fn(|i| gain[i] * rest - left_over[i]);
        self.each(|i, j, p| p + (e[i] * gain[j] + gain[i] * e[j]));
    }

    /// Eq. (20).
    fn limited_noise(&self, noise: f32, h: [f32; 3], m: &[f32; 6]) -> Option<f32> {
        let along = h[0] * m[0] + h[1] * m[1] + h[2] * m[2];
        let per_variance = 1.0 / (noise + along);
        let left = |i: usize| h[i] * h[i] * (self.p[i][i] - (m[i] * per_variance) * m[i]);
        let least = SHARPEST * (left(0) + left(1) + left(2));
        if noise * along * per_variance >= least {
            return Some(noise);
        }
        (along > least).then(|| along * least / (along - least))
    }

    fn each(&mut self, entry: impl Fn(usize, usize, f32) -> f32) {
        for i in 0..6 {
            for j in i..6 {
                self.p[i][j] = entry(i, j, self.p[i][j]);
            }
        }
    }

    /// The bits of state and covariance, in the order of the seven-state filter and wheel by wheel,
    /// the seventh zero.
    fn bits(&self) -> Vec<u32> {
        let mut shown = *self;
        shown.p = shown.with_random_walk();
        let wheels =
            |common: f32, difference: f32| [common + 0.5 * difference, common - 0.5 * difference];
        let [x, y, heading, common, difference, width] = shown.x;
        let [right, left] = wheels(common, difference);
        let mut p = SMatrix::<f32, 7, 7>::zeros();
        for i in [0, 1, 2, 5] {
            for j in [0, 1, 2, 5] {
                p[(i, j)] = shown.at(i, j);
            }
            for (j, v) in wheels(shown.at(i, 3), shown.at(i, 4)).into_iter().enumerate() {
                p[(i, 3 + j)] = v;
                p[(3 + j, i)] = v;
            }
        }
        let own = wheels(shown.at(3, 3) + 0.25 * shown.at(4, 4), 2.0 * shown.at(3, 4));
        p[(3, 3)] = own[0];
        p[(4, 4)] = own[1];
        p[(3, 4)] = shown.at(3, 3) - 0.25 * shown.at(4, 4);
        p[(4, 3)] = p[(3, 4)];
        let state = [x, y, heading, right, left, width, 0.0];
        state.into_iter().chain(p.iter().copied()).map(f32::to_bits).collect()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// Over some 2,000 steps per run: the same bits in every state and every entry of P after each,
    /// and zero in the seventh.
    #[test]
    fn a_known_range_scale_has_no_effect(
        drive in any_drive(),
        state in any_state(),
        deviation in any_deviation(),
        events in proptest::collection::vec(any_event(1e-6..1e-3), 200),
    ) {
        let state = StateEstimate { range_scale: 0.0, ..state };
        let deviation = StandardDeviations { range_scale: 0.0, ..deviation };
        let mut seven = Ekf::new(drive, state, deviation).unwrap();
        let mut six = SixStateFilter::new(drive, state, deviation);
        for event in events {
            match event {
                Event::Roll(travel, times) => {
                    for _ in 0..times {
                        seven.predict(travel).unwrap();
                        six.predict(travel);
                        prop_assert_eq!(bits(&seven), six.bits(), "after {:?}", travel);
                    }
                }
                Event::Range { sight, mount, sigmas, noise } => {
                    let state = seven.state();
                    let wall = sight.wall(state.pose().position());
                    let expected = ExpectedRange::new(&wall, mount, &state);
                    let range = Metres(expected.range.0 + 0.02 * sigmas);
                    seven.update(range, &expected, SquareMetres(noise)).unwrap();

                    let (of_six, h) = six.expected(&wall, mount);
                    six.update(range.0, of_six, h, noise);
                    prop_assert_eq!(bits(&seven), six.bits(), "after {:?}", event);
                }
            }
        }
    }

    /// With a prior for the range scale the same run differs, so the test above can fail.
    #[test]
    fn an_unknown_range_scale_has_an_effect(drive in any_drive(), state in any_state(), deviation in any_deviation()) {
        let state = StateEstimate { range_scale: 0.0, ..state };
        let mut seven = Ekf::new(drive, state, deviation).unwrap();
        let mut six = SixStateFilter::new(drive, state, deviation);
        let wall = Wall::new(Point::new(40.0, -40.0), Point::new(40.0, 40.0)).unwrap();
        let expected = ExpectedRange::new(&wall, Point::default(), &state);
        let range = expected.range + Metres(0.05);
        seven.update(range, &expected, SquareMetres(1e-4)).unwrap();
        let (of_six, h) = six.expected(&wall, Point::default());
        six.update(range.0, of_six, h, 1e-4);
        prop_assert_ne!(bits(&seven), six.bits());
    }
}
