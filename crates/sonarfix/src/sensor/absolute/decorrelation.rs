//! Symmetric 3×3 matrices over x, y and heading, and their factors L D Lᵀ (`docs/model.md`, eq. 43).

/// Three numbers by the letters of P.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PoseVector {
    pub x: f32,
    pub y: f32,
    pub h: f32,
}

impl PoseVector {
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.h.is_finite()
    }

    pub fn dot(&self, other: &Self) -> f32 {
        self.x * other.x + self.y * other.y + self.h * other.h
    }
}

/// The lower triangle of a symmetric matrix over x, y and heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseMatrix {
    pub xx: f32,
    pub xy: f32,
    pub yy: f32,
    pub xh: f32,
    pub yh: f32,
    pub hh: f32,
}

/// A = L D Lᵀ: the rows of L⁻¹, and D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decorrelated {
    /// The rows of L⁻¹: linear combinations whose errors are independent.
    pub rows: [PoseVector; 3],
    /// Their variances.
    pub variances: [f32; 3],
}

impl PoseMatrix {
    pub const IDENTITY: Self = Self { xx: 1.0, xy: 0.0, yy: 1.0, xh: 0.0, yh: 0.0, hh: 1.0 };

    pub fn is_finite(&self) -> bool {
        let Self { xx, xy, yy, xh, yh, hh } = self;
        [xx, xy, yy, xh, yh, hh].iter().all(|number| number.is_finite())
    }

    /// This and `factor` times the other.
    pub fn plus(&self, factor: f32, other: &Self) -> Self {
        Self {
            xx: self.xx + factor * other.xx,
            xy: self.xy + factor * other.xy,
            yy: self.yy + factor * other.yy,
            xh: self.xh + factor * other.xh,
            yh: self.yh + factor * other.yh,
            hh: self.hh + factor * other.hh,
        }
    }

    // ===== Eq. (43): A = L D Lᵀ =====
    /// The factors; `None` unless the matrix is positive definite by more than the rounding of its entries.
    pub fn decorrelated(&self) -> Option<Decorrelated> {
        let Self { xx, xy, yy, xh, yh, hh } = *self;
        // Each is false for NaN.
        let remains = |left: f32, of: f32| left >= f32::MIN_POSITIVE && left >= ROUNDING * of;
        if !remains(xx, xx) {
            return None;
        }
        let (yx, hx) = (xy / xx, xh / xx);
        let dy = yy - yx * xy;
        if !remains(dy, yy) {
            return None;
        }
        let left = yh - hx * xy;
        let hy = left / dy;
        let dh = hh - hx * xh - hy * left;
        if !remains(dh, hh) {
            return None;
        }
        Some(Decorrelated {
            rows: [
                PoseVector { x: 1.0, y: 0.0, h: 0.0 },
                PoseVector { x: -yx, y: 1.0, h: 0.0 },
                PoseVector { x: hy * yx - hx, y: -hy, h: 1.0 },
            ],
            variances: [xx, dy, dh],
        })
    }
}

/// Least share of a variance that is independent of the others: 16 times the rounding of an `f32`.
const ROUNDING: f32 = 1e-6;

impl Decorrelated {
    /// vᵀ A⁻¹ v.
    pub fn squared(&self, v: &PoseVector) -> f32 {
        let pairs = self.rows.iter().zip(&self.variances);
        pairs.map(|(row, variance)| row.dot(v) * row.dot(v) / variance).sum()
    }

    /// The determinant of A.
    pub fn determinant(&self) -> f32 {
        self.variances.iter().product()
    }
}

#[cfg(test)]
mod tests;
