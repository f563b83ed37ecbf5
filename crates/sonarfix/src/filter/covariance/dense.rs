//! The blocks of P and what stands beside it as dense matrices in `f64`, for tests.

use super::blocks::Covariance;
use super::column::StateColumn;
use nalgebra::SMatrix;

/// A covariance of N quantities: correlated, with these deviations. `numbers` has N² of them.
pub(super) fn correlated<const N: usize>(sigma: [f64; N], numbers: &[f32]) -> SMatrix<f64, N, N> {
    let a = SMatrix::<f64, N, N>::from_iterator(numbers.iter().map(|number| f64::from(*number)));
    let p = a * a.transpose() + SMatrix::identity() * 0.1;
    let sigma = SMatrix::from_diagonal(&sigma.into());
    sigma * p * sigma
}

/// P of the first seven quantities, in the order x, y, h, c, d, w, k.
pub(super) fn blocks(at: impl Fn(usize, usize) -> f32) -> Covariance {
    let mut covariance = Covariance::default();
    let (pose, q, r) =
        (&mut covariance.pose, &mut covariance.calibration, &mut covariance.range_scale);
    (pose.xx, pose.xy, pose.xh, pose.yy, pose.yh, pose.hh) =
        (at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2));
    (pose.xc, pose.xd, pose.xw) = (at(0, 3), at(0, 4), at(0, 5));
    (pose.yc, pose.yd, pose.yw) = (at(1, 3), at(1, 4), at(1, 5));
    (pose.hc, pose.hd, pose.hw) = (at(2, 3), at(2, 4), at(2, 5));
    (q.cc, q.cd, q.cw, q.dd, q.dw, q.ww) =
        (at(3, 3), at(3, 4), at(3, 5), at(4, 4), at(4, 5), at(5, 5));
    (r.xk, r.yk, r.hk, r.ck, r.dk, r.wk, r.kk) =
        (at(0, 6), at(1, 6), at(2, 6), at(3, 6), at(4, 6), at(5, 6), at(6, 6));
    covariance
}

/// The covariances of a quantity with those seven.
pub(super) fn column(of: impl Fn(usize) -> f32) -> StateColumn {
    StateColumn { x: of(0), y: of(1), h: of(2), c: of(3), d: of(4), w: of(5), k: of(6) }
}

/// P, the columns of further quantities, and their own covariances, as one matrix of N = 7 + M.
pub(super) fn joint<const N: usize, const M: usize>(
    p: &Covariance,
    columns: [&StateColumn; M],
    own: [[f32; M]; M],
) -> SMatrix<f64, N, N> {
    let (p, q, r) = (&p.pose, &p.calibration, &p.range_scale);
    let states = [
        [p.xx, p.xy, p.xh, p.xc, p.xd, p.xw, r.xk],
        [p.xy, p.yy, p.yh, p.yc, p.yd, p.yw, r.yk],
        [p.xh, p.yh, p.hh, p.hc, p.hd, p.hw, r.hk],
        [p.xc, p.yc, p.hc, q.cc, q.cd, q.cw, r.ck],
        [p.xd, p.yd, p.hd, q.cd, q.dd, q.dw, r.dk],
        [p.xw, p.yw, p.hw, q.cw, q.dw, q.ww, r.wk],
        [r.xk, r.yk, r.hk, r.ck, r.dk, r.wk, r.kk],
    ];
    let columns = columns.map(|of| [of.x, of.y, of.h, of.c, of.d, of.w, of.k]);
    SMatrix::from_fn(|i, j| {
        f64::from(match (i.checked_sub(7), j.checked_sub(7)) {
            (None, None) => states[i][j],
            (Some(i), None) => columns[i][j],
            (None, Some(j)) => columns[j][i],
            (Some(i), Some(j)) => own[i][j],
        })
    })
}

/// Whether all entries are near, by the deviations of `scale`.
pub(super) fn is_near<const N: usize>(
    is: &SMatrix<f64, N, N>,
    expected: &SMatrix<f64, N, N>,
    scale: &SMatrix<f64, N, N>,
) -> bool {
    (0..N).all(|i| {
        (0..N).all(|j| {
            let size = (scale[(i, i)] * scale[(j, j)]).sqrt();
            (is[(i, j)] - expected[(i, j)]).abs() < 1e-4 * size
        })
    })
}
