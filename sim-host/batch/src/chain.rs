//! The normal equations of a chain of poses with constant parameters, and their exact solution.
//!
//! The matrix is block-tridiagonal (poses, 3 × 3 blocks) with a dense border (constants):
//!
//! ```text
//! ┌ A  B ┐ ┌ x ┐   ┌ a ┐      A: diagonal blocks D_i, blocks U_i beside them (pose i with pose i + 1)
//! └ Bᵀ C ┘ └ c ┘ = └ b ┘
//! ```
//!
//! Block elimination along the chain costs O(n) and fills nothing in; the Schur complement S = C − Bᵀ A⁻¹ B is the
//! information of the constants alone. Its inverse is their exact marginal covariance, and the blocks of the inverse
//! that belong to neighbouring poses follow by the recursion of Takahashi et al. (1973).

#![expect(clippy::indexing_slicing, reason = "the lengths are those of the constructor")]

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Vector3};

/// The equations are not positive definite: something is not determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the equations are singular: the recording does not determine all unknowns")]
pub struct Singular;

/// The normal equations, accumulated factor by factor.
#[derive(Debug, Clone)]
pub struct Normal {
    /// Blocks D on the diagonal.
    pub diagonal: Vec<Matrix3<f64>>,
    /// Blocks U of each pose with the next.
    pub beside: Vec<Matrix3<f64>>,
    /// Rows of B of each pose.
    pub border: Vec<Matrix3xX<f64>>,
    /// C.
    pub corner: DMatrix<f64>,
    /// Right-hand side of the poses.
    pub poses: Vec<Vector3<f64>>,
    /// Right-hand side of the constants.
    pub constants: DVector<f64>,
}

/// A solution of the equations.
#[derive(Debug, Clone)]
pub struct Step {
    /// Of the poses.
    pub poses: Vec<Vector3<f64>>,
    /// Of the constants.
    pub constants: DVector<f64>,
}

/// The blocks of the inverse that belong to one factor.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// Of each pose.
    pub poses: Vec<Matrix3<f64>>,
    /// Of each pose with the next.
    pub neighbours: Vec<Matrix3<f64>>,
    /// Of each pose with the constants.
    pub cross: Vec<Matrix3xX<f64>>,
    /// Of the constants.
    pub constants: DMatrix<f64>,
}

/// The minimum of the quadratic cost whose normal equations these are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// How much lower the cost is there than where the equations were linearized.
    pub decrease: f64,
    /// Natural logarithm of the determinant of the matrix.
    pub log_determinant: f64,
}

struct Eliminated {
    /// Inverses of the pivots.
    inverse: Vec<Matrix3<f64>>,
    /// A⁻¹ B.
    border: Vec<Matrix3xX<f64>>,
    /// A⁻¹ a.
    poses: Vec<Vector3<f64>>,
    schur: nalgebra::Cholesky<f64, nalgebra::Dyn>,
}

impl Normal {
    /// Empty equations of `poses` poses and `constants` constants.
    #[must_use]
    pub fn new(poses: usize, constants: usize) -> Self {
        Self {
            diagonal: vec![Matrix3::zeros(); poses],
            beside: vec![Matrix3::zeros(); poses.saturating_sub(1)],
            border: vec![Matrix3xX::zeros(constants); poses],
            corner: DMatrix::zeros(constants, constants),
            poses: vec![Vector3::zeros(); poses],
            constants: DVector::zeros(constants),
        }
    }

    /// The solution, with the diagonal raised to (1 + damping) times itself.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve(&self, damping: f64) -> Result<Step, Singular> {
        let done = self.eliminate(damping)?;
        Ok(self.substitute(&done))
    }

    fn substitute(&self, done: &Eliminated) -> Step {
        let mut rhs = self.constants.clone();
        for (border, pose) in self.border.iter().zip(&done.poses) {
            rhs -= border.tr_mul(pose);
        }
        let constants = done.schur.solve(&rhs);
        let poses =
            done.poses.iter().zip(&done.border).map(|(pose, border)| pose - border * &constants);
        Step { poses: poses.collect(), constants }
    }

    /// The covariance: blocks of the inverse.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn covariance(&self) -> Result<Covariance, Singular> {
        let done = self.eliminate(0.0)?;
        let count = self.diagonal.len();
        let constants = done.schur.inverse();
        let cross: Vec<_> = done.border.iter().map(|border| -(border * &constants)).collect();
        // The inverse of A alone, from the last pose to the first.
        let mut poses = vec![Matrix3::zeros(); count];
        let mut neighbours = vec![Matrix3::zeros(); count.saturating_sub(1)];
        for i in (0..count).rev() {
            poses[i] = done.inverse[i];
            if i + 1 < count {
                let gain = done.inverse[i] * self.beside[i];
                neighbours[i] = -gain * poses[i + 1];
                poses[i] -= neighbours[i] * gain.transpose();
            }
        }
        for i in 0..count {
            poses[i] -= &cross[i] * done.border[i].transpose();
            if i + 1 < count {
                neighbours[i] -= &cross[i] * done.border[i + 1].transpose();
            }
        }
        Ok(Covariance { poses, neighbours, cross, constants })
    }

    /// What the marginal likelihood needs of the equations.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn minimum(&self) -> Result<Minimum, Singular> {
        let done = self.eliminate(0.0)?;
        let step = self.substitute(&done);
        let of_poses: f64 = self.poses.iter().zip(&step.poses).map(|(one, by)| one.dot(by)).sum();
        let decrease = 0.5 * (of_poses + self.constants.dot(&step.constants));
        let pivots = done.inverse.iter().map(|inverse| -inverse.determinant().ln());
        let log_determinant = pivots.sum::<f64>() + done.schur.ln_determinant();
        Ok(Minimum { decrease, log_determinant })
    }

    fn eliminate(&self, damping: f64) -> Result<Eliminated, Singular> {
        let count = self.diagonal.len();
        let raised = |block: &Matrix3<f64>| {
            let mut block = *block;
            for k in 0..3 {
                block[(k, k)] *= 1.0 + damping;
            }
            block
        };
        let mut inverse: Vec<Matrix3<f64>> = Vec::with_capacity(count);
        let mut border: Vec<Matrix3xX<f64>> = Vec::with_capacity(count);
        let mut poses: Vec<Vector3<f64>> = Vec::with_capacity(count);
        for i in 0..count {
            let mut pivot = raised(&self.diagonal[i]);
            let mut row = self.border[i].clone();
            let mut rhs = self.poses[i];
            if let Some(before) = i.checked_sub(1) {
                let gain = self.beside[before].transpose() * inverse[before];
                pivot -= gain * self.beside[before];
                row -= gain * &border[before];
                rhs -= gain * poses[before];
            }
            inverse.push(inverted(&pivot)?);
            border.push(row);
            poses.push(rhs);
        }
        for i in (0..count).rev() {
            let (mut row, mut rhs) = (border[i].clone(), poses[i]);
            if i + 1 < count {
                row -= self.beside[i] * &border[i + 1];
                rhs -= self.beside[i] * poses[i + 1];
            }
            border[i] = inverse[i] * row;
            poses[i] = inverse[i] * rhs;
        }
        let mut schur = self.corner.clone();
        for k in 0..schur.nrows() {
            schur[(k, k)] *= 1.0 + damping;
        }
        for (original, solved) in self.border.iter().zip(&border) {
            schur -= original.tr_mul(solved);
        }
        let schur = (&schur + schur.transpose()) * 0.5;
        let schur = schur.cholesky().ok_or(Singular)?;
        Ok(Eliminated { inverse, border, poses, schur })
    }
}

/// The inverse of a positive definite block.
fn inverted(block: &Matrix3<f64>) -> Result<Matrix3<f64>, Singular> {
    let symmetric = (block + block.transpose()) * 0.5;
    symmetric.cholesky().map(|factor| factor.inverse()).ok_or(Singular)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Equations of random factors, each of two neighbouring poses and all constants.
    fn equations(
        count: usize,
        constants: usize,
        numbers: &[f64],
    ) -> (Normal, DMatrix<f64>, DVector<f64>) {
        let size = 3 * count + constants;
        let mut numbers = numbers.iter().copied().cycle();
        let mut normal = Normal::new(count, constants);
        let mut dense = DMatrix::identity(size, size) * 0.1;
        let mut rhs = DVector::zeros(size);
        for block in &mut normal.diagonal {
            *block += Matrix3::identity() * 0.1;
        }
        normal.corner += DMatrix::identity(constants, constants) * 0.1;
        for i in 0..count - 1 {
            for _ in 0..4 {
                let mut row = DVector::zeros(size);
                for k in (3 * i..3 * i + 6).chain(3 * count..size) {
                    row[k] = numbers.next().unwrap();
                }
                let value = numbers.next().unwrap();
                dense += &row * row.transpose();
                rhs += &row * value;
                let (one, other) = (row.fixed_rows::<3>(3 * i), row.fixed_rows::<3>(3 * i + 3));
                let rest = row.rows(3 * count, constants);
                normal.diagonal[i] += one * one.transpose();
                normal.diagonal[i + 1] += other * other.transpose();
                normal.beside[i] += one * other.transpose();
                normal.border[i] += one * rest.transpose();
                normal.border[i + 1] += other * rest.transpose();
                normal.corner += rest * rest.transpose();
                normal.poses[i] += one * value;
                normal.poses[i + 1] += other * value;
                normal.constants += rest * value;
            }
        }
        (normal, dense, rhs)
    }

    proptest! {
        #[test]
        fn solution_and_covariance_are_those_of_the_dense_inverse(
            count in 2_usize..12, constants in 1_usize..6,
            numbers in prop::collection::vec(-1.0..1.0_f64, 997), damping in 0.0..2.0_f64,
        ) {
            let (normal, dense, rhs) = equations(count, constants, &numbers);
            let mut damped = dense.clone();
            for k in 0..dense.nrows() {
                damped[(k, k)] *= 1.0 + damping;
            }
            let exact = damped.cholesky().unwrap().solve(&rhs);
            let step = normal.solve(damping).unwrap();
            let minimum = normal.minimum().unwrap();
            let factor = dense.clone().cholesky().unwrap();
            prop_assert!((minimum.log_determinant - factor.ln_determinant()).abs() < 1e-8);
            prop_assert!((minimum.decrease - 0.5 * rhs.dot(&factor.solve(&rhs))).abs() < 1e-8);
            for i in 0..count {
                prop_assert!((step.poses[i] - exact.fixed_rows::<3>(3 * i)).norm() < 1e-8);
            }
            prop_assert!((&step.constants - exact.rows(3 * count, constants)).norm() < 1e-8);

            let inverse = dense.try_inverse().unwrap();
            let covariance = normal.covariance().unwrap();
            for i in 0..count {
                let block = inverse.fixed_view::<3, 3>(3 * i, 3 * i);
                prop_assert!((covariance.poses[i] - block).norm() < 1e-7);
                let cross = inverse.view((3 * i, 3 * count), (3, constants));
                prop_assert!((&covariance.cross[i] - cross).norm() < 1e-7);
                if i + 1 < count {
                    let block = inverse.fixed_view::<3, 3>(3 * i, 3 * i + 3);
                    prop_assert!((covariance.neighbours[i] - block).norm() < 1e-7);
                }
            }
            let corner = inverse.view((3 * count, 3 * count), (constants, constants));
            prop_assert!((&covariance.constants - corner).norm() < 1e-7);
        }
    }

    #[test]
    fn an_undetermined_pose_is_singular() {
        assert_eq!(Normal::new(2, 1).solve(0.0).err(), Some(Singular));
    }
}
