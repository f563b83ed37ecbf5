//! Estimates the noise of the wheels: the maximum of the marginal likelihood by its logarithm, and the curvature there.
//!
//! The minimum of the cost alone cannot determine it, because smoothed poses follow the ranges: the noise of the wheels would be
//! too small, and zero the best. The marginal likelihood integrates the poses out ([`Problem::marginal`]). The noise of the ranges is
//! a coordinate of the maximum, because both noises share what the ranges of neighbouring pings differ by: with that of the
//! ranges held, the interval of that of the wheels would be too narrow.

#![expect(clippy::indexing_slicing, reason = "vectors and matrices of a fixed size")]

use nalgebra::{SMatrix, SVector};

use crate::odometry::WheelNoise;
use crate::problem::{Problem, State};
use crate::solve::{SolveError, solve};

/// Ranges beyond this many deviations are left out. Nearer ones have their full weight: the weights of a robust loss take
/// information from the normal ones, too, and the noise of the wheels would be too small.
const OUTLIER: f64 = 4.0;
/// A kernel so wide that the loss of a range is its square.
const QUADRATIC: f64 = 1e3;
/// Deviation of the logarithm of the noise by the prior around that of the robot file: a factor of ten.
const PRIOR: f64 = 2.3;
/// Deviation of the logarithms of its two parts by the prior around their common value: a factor of three.
const PRIOR_OF_PARTS: f64 = 1.1;
/// Deviation of the logarithm up to which a recording determines a noise: its interval then reaches from 0.4 to 2.7 times the value.
const DETERMINED: f64 = 0.5;
/// Half of a 95 % interval, in standard deviations.
const INTERVAL: f64 = 1.96;

/// A noise: its logarithm is normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noisy {
    /// The most likely value, m/√m.
    pub value: f64,
    /// Standard deviation of its natural logarithm.
    pub deviation: f64,
}

impl Noisy {
    /// The interval that has the true value with a probability of 95 %, m/√m.
    #[must_use]
    pub fn interval(&self) -> [f64; 2] {
        let factor = (INTERVAL * self.deviation).exp();
        [self.value / factor, self.value * factor]
    }

    /// Whether the recording determines it.
    #[must_use]
    pub fn is_determined(&self) -> bool {
        self.deviation <= DETERMINED
    }
}

/// The estimated noise of the wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimated {
    /// Of each wheel, if the wheels are independent.
    pub wheel: Noisy,
    /// Of the distance.
    pub distance: Noisy,
    /// Of the turns.
    pub turn: Noisy,
}

/// Estimates the noise of each wheel at a solution.
///
/// # Errors
/// [`SolveError`].
pub fn of_wheels(problem: &Problem, state: &State) -> Result<Noisy, SolveError> {
    Likelihood::at(problem, state).of_wheels()
}

/// Estimates the noise of the wheels and its parts at a solution.
///
/// # Errors
/// [`SolveError`].
pub fn estimate(problem: &Problem, state: &State) -> Result<Estimated, SolveError> {
    let mut likelihood = Likelihood::at(problem, state);
    let wheel = likelihood.of_wheels()?;
    let [distance, turn] = likelihood.of_parts()?;
    Ok(Estimated { wheel, distance, turn })
}

/// The marginal likelihood by the noise of the wheels, about a solution.
struct Likelihood<'a> {
    problem: Problem<'a>,
    state: State,
}

impl<'a> Likelihood<'a> {
    fn at(problem: &Problem<'a>, state: &State) -> Self {
        let mut problem = problem.clone();
        problem.kernel = QUADRATIC;
        let is_inlier = |k: usize, reflector: usize| {
            let term = problem.range_term(state, k, reflector);
            term.is_some_and(|term| term.residual.abs() <= OUTLIER * term.deviation)
        };
        let matches = problem.matches.iter().enumerate();
        let matches = matches.map(|(k, of)| of.filter(|reflector| is_inlier(k, *reflector)));
        problem.matches = matches.collect();
        Self { problem, state: state.clone() }
    }

    /// The maximum with independent wheels.
    fn of_wheels(&mut self) -> Result<Noisy, SolveError> {
        let [wheel, _] = self.maximize(PRIOR, |at| WheelNoise::independent(at[0].exp()))?;
        Ok(wheel)
    }

    /// The maximum by distance and turns.
    fn of_parts(&mut self) -> Result<[Noisy; 2], SolveError> {
        let noise = |at: &SVector<f64, 3>| WheelNoise { distance: at[0].exp(), turn: at[1].exp() };
        let [distance, turn, _] = self.maximize(PRIOR_OF_PARTS, noise)?;
        Ok([distance, turn])
    }

    /// The maximum by the logarithms of noises of the wheels, with a prior around the present noise, and of the factor of the noise of
    /// the ranges. The problem is solved again at each maximum, until it stays.
    fn maximize<const N: usize>(
        &mut self,
        prior: f64,
        wheel: impl Fn(&SVector<f64, N>) -> WheelNoise,
    ) -> Result<[Noisy; N], SolveError> {
        const ROUNDS: usize = 4;
        const ITERATIONS: usize = 20;
        const SAME: f64 = 0.01;
        let present = self.problem.noise;
        let noise = |at: &SVector<f64, N>| present.with(wheel(at), at[N - 1].exp());
        let split = |k: usize, value: f64, other: f64| if k == N - 1 { value } else { other };
        let mean = SVector::<f64, N>::from_fn(|k, _| split(k, 0.0, present.wheel.turn.ln()));
        let prior = SVector::<f64, N>::from_fn(|k, _| split(k, PRIOR, prior));
        let mut found = mean;
        let mut covariance = SMatrix::<f64, N, N>::identity();
        for _ in 0..ROUNDS {
            solve(&self.problem, &mut self.state, ITERATIONS)?;
            let before = found;
            (found, covariance) = minimum(found, |at| {
                let mut problem = self.problem.clone();
                problem.noise = noise(at);
                let of_prior = 0.5 * (at - mean).component_div(&prior).norm_squared();
                Ok(problem.marginal(&self.state)? + of_ranges(&problem, &self.state) + of_prior)
            })?;
            self.problem.noise = noise(&found);
            if (found - before).norm() < SAME {
                break;
            }
        }
        let of = |k: usize| Noisy { value: found[k].exp(), deviation: covariance[(k, k)].sqrt() };
        Ok(std::array::from_fn(of))
    }
}

/// The sum of the logarithms of the ranges' deviations, which [`Problem::marginal`] leaves out.
fn of_ranges(problem: &Problem, state: &State) -> f64 {
    let matches = problem.matches.iter().enumerate();
    let terms = matches.filter_map(|(k, of)| problem.range_term(state, k, (*of)?));
    terms.map(|term| term.deviation.ln()).sum()
}

/// The minimum of a loss by logarithms of noises, and the inverse of its curvature there. Newton's method with differences.
fn minimum<const N: usize>(
    start: SVector<f64, N>,
    loss: impl Fn(&SVector<f64, N>) -> Result<f64, SolveError>,
) -> Result<(SVector<f64, N>, SMatrix<f64, N, N>), SolveError> {
    const ITERATIONS: usize = 12;
    const H: f64 = 0.05;
    /// Longest step.
    const STEP: f64 = 0.7;
    const CONVERGED: f64 = 0.01;
    let unit = |k: usize| SVector::<f64, N>::from_fn(|i, _| if i == k { H } else { 0.0 });
    let mut at = start;
    let mut covariance = SMatrix::<f64, N, N>::identity();
    for _ in 0..ITERATIONS {
        let here = loss(&at)?;
        let mut gradient = SVector::<f64, N>::zeros();
        let mut curvature = SMatrix::<f64, N, N>::zeros();
        for i in 0..N {
            let (more, less) = (loss(&(at + unit(i)))?, loss(&(at - unit(i)))?);
            gradient[i] = (more - less) / (2.0 * H);
            curvature[(i, i)] = (more + less - 2.0 * here) / (H * H);
            for j in 0..i {
                let corner = |a: f64, b: f64| loss(&(at + unit(i) * a + unit(j) * b));
                let mixed = corner(1.0, 1.0)? + corner(-1.0, -1.0)?
                    - corner(1.0, -1.0)?
                    - corner(-1.0, 1.0)?;
                curvature[(i, j)] = mixed / (4.0 * H * H);
                curvature[(j, i)] = curvature[(i, j)];
            }
        }
        // Far from the maximum the loss can be concave: along its gradient.
        let step = match curvature.cholesky() {
            Some(factor) => {
                covariance = factor.inverse();
                -factor.solve(&gradient)
            }
            None => -gradient,
        };
        let step = step * (STEP / step.norm().max(STEP));
        at += step;
        if step.norm() < CONVERGED {
            break;
        }
    }
    Ok((at, covariance))
}
