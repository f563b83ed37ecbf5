//! Every filter computes the same: after every call its state and covariance equal those of an independent filter in `f64`.
//! For Sonarfix's kernel that filter has the noise of each wheel instead of a diagonal Q, and P is asked for after every call.

use bench_ours::kernel::Kernel;
use bench_workload::model::{Range, STATES, Step, TRACK_WIDTH};
use bench_workload::{Filter, drive};

type Column = [f64; STATES];
type Square = [Column; STATES];

/// Largest error of a state in its standard deviations: about 200 roundings of 2⁻²⁴, in numbers up to 10³ times larger than
/// the deviation.
const STATE_TOLERANCE: f64 = 0.01;
/// Largest error of an entry of P, relative to the product of its two deviations.
const COVARIANCE_TOLERANCE: f64 = 0.001;

/// The process noise of a filter.
#[derive(Debug, Clone, Copy)]
enum Noise {
    /// That of the step.
    Diagonal,
    /// The variance of the turn by the noise of the right and of the left wheel, the same for every step.
    OfWheels([f32; 2]),
}

/// A textbook filter in `f64`, with a Jacobian by central differences.
struct Reference {
    x: Column,
    p: Square,
}

impl Reference {
    fn new() -> Self {
        let mut p = [[0.0; STATES]; STATES];
        for (i, variance) in drive::VARIANCES.into_iter().enumerate() {
            p[i][i] = f64::from(variance);
        }
        Self { x: drive::START.map(f64::from), p }
    }

    /// Motion along the mid-heading, with a scale error per wheel, and with an error of the travel of each wheel, metres.
    fn moved(state: &Column, step: &Step, errors: [f64; 2]) -> Column {
        let [x, y, heading, mean, difference, width_error] = *state;
        let right = f64::from(step.right) * (1.0 + mean + 0.5 * difference) + errors[0];
        let left = f64::from(step.left) * (1.0 + mean - 0.5 * difference) + errors[1];
        let turn = (right - left) / (f64::from(TRACK_WIDTH) + width_error);
        let (sin, cos) = (heading + 0.5 * turn).sin_cos();
        let advance = 0.5 * (right + left);
        [x + advance * cos, y + advance * sin, heading + turn, mean, difference, width_error]
    }

    fn predict(&mut self, step: &Step, noise: Noise) {
        let q = self.noise(step, noise);
        let mut f = [[0.0; STATES]; STATES];
        for j in 0..STATES {
            let at = |by: f64| {
                let mut state = self.x;
                state[j] += by;
                Self::moved(&state, step, [0.0; 2])
            };
            let (before, after) = (at(-1e-5), at(1e-5));
            for i in 0..STATES {
                f[i][j] = (after[i] - before[i]) / 2e-5;
            }
        }
        self.x = Self::moved(&self.x, step, [0.0; 2]);
        self.p = sandwich(&f, &self.p);
        for i in 0..STATES {
            for j in 0..STATES {
                self.p[i][j] += q[i][j];
            }
        }
    }

    /// Q of a step.
    fn noise(&self, step: &Step, noise: Noise) -> Square {
        let mut q = [[0.0; STATES]; STATES];
        match noise {
            Noise::Diagonal => {
                for (i, noise) in step.noise.into_iter().enumerate() {
                    q[i][i] = f64::from(noise);
                }
            }
            Noise::OfWheels(turns) => {
                let width = f64::from(TRACK_WIDTH) + self.x[5];
                for (errors, turn) in [[1e-5, 0.0], [0.0, 1e-5]].into_iter().zip(turns) {
                    let variance = f64::from(turn) * width * width;
                    let (before, after) = (
                        Self::moved(&self.x, step, errors.map(|error| -error)),
                        Self::moved(&self.x, step, errors),
                    );
                    let g: Column = core::array::from_fn(|i| (after[i] - before[i]) / 2e-5);
                    for i in 0..STATES {
                        for j in 0..STATES {
                            q[i][j] += variance * g[i] * g[j];
                        }
                    }
                }
            }
        }
        q
    }

    fn update(&mut self, range: &Range) {
        let h = [f64::from(range.by_x), f64::from(range.by_y), 0.0, 0.0, 0.0, 0.0];
        let variance = f64::from(range.variance);
        let m: Column = core::array::from_fn(|i| dot(&self.p[i], &h));
        let s = dot(&h, &m) + variance;
        let innovation = f64::from(range.measured) - dot(&h, &self.x) - f64::from(range.offset);
        let mut rest = [[0.0; STATES]; STATES];
        for i in 0..STATES {
            self.x[i] += m[i] / s * innovation;
            for j in 0..STATES {
                rest[i][j] = f64::from(u8::from(i == j)) - m[i] / s * h[j];
            }
        }
        self.p = sandwich(&rest, &self.p);
        for i in 0..STATES {
            for j in 0..STATES {
                self.p[i][j] += m[i] / s * variance * m[j] / s;
            }
        }
    }
}

fn dot(a: &Column, b: &Column) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A P Aᵀ.
fn sandwich(a: &Square, p: &Square) -> Square {
    let ap: Square = core::array::from_fn(|i| {
        core::array::from_fn(|j| (0..STATES).map(|k| a[i][k] * p[k][j]).sum())
    });
    core::array::from_fn(|i| core::array::from_fn(|j| dot(&ap[i], &a[j])))
}

fn assert_agrees<F: Filter>() {
    assert_agrees_with::<F>(Noise::Diagonal);
}

fn assert_agrees_with<F: Filter>(noise: Noise) {
    let mut filter = F::new(drive::START, drive::VARIANCES);
    let mut reference = Reference::new();
    for i in 0..drive::STEPS {
        let step = drive::step(&filter, i);
        filter.predict(&step);
        reference.predict(&step, noise);
        if let Some(range) = drive::range(&filter, i) {
            filter.update(&range);
            reference.update(&range);
        }
        let (state, p) = (filter.state(), filter.covariance());
        let deviation: Column = core::array::from_fn(|j| reference.p[j][j].sqrt());
        for j in 0..STATES {
            let off = (f64::from(state[j]) - reference.x[j]).abs() / deviation[j];
            assert!(off < STATE_TOLERANCE, "step {i}: state {j} is {off} σ off");
            for k in 0..STATES {
                let off = (f64::from(p[j][k]) - reference.p[j][k]).abs();
                let off = off / (deviation[j] * deviation[k]);
                assert!(off < COVARIANCE_TOLERANCE, "step {i}: P[{j}][{k}] is {off} off");
            }
        }
    }
}

#[test]
fn sonarfix_kernel() {
    assert_agrees_with::<Kernel>(Noise::OfWheels(Kernel::noise_of_turn()));
}

macro_rules! agrees {
    ($($(#[$feature:meta])* $name:ident: $filter:ty;)*) => {
        $($(#[$feature])* #[test] fn $name() { assert_agrees::<$filter>(); })*
    };
}

bench_workload::each_filter! { agrees, }
