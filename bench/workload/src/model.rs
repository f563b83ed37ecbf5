//! The model of all filters: the six states of the paper, with the wheels' scale errors as mean and difference, and the
//! motion along the mid-heading (`docs/model.md`).

/// x, y, heading, mean and difference of the scale errors, track-width error.
pub const STATES: usize = 6;
/// One number for each state.
pub type Vector = [f32; STATES];
/// Rows of a 6×6 matrix.
pub type Matrix = [Vector; STATES];

/// Distance between the wheels, metres.
pub const TRACK_WIDTH: f32 = 0.35;

/// One wheel travel.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Travel of the right wheel, metres.
    pub right: f32,
    /// Travel of the left wheel, metres.
    pub left: f32,
    /// Sine of the mid-heading: an argument, because trigonometry is not compared.
    pub sin: f32,
    /// Cosine of the mid-heading.
    pub cos: f32,
    /// The diagonal of Q.
    pub noise: Vector,
}

/// One range to a wall a x + b y + c = 0.
#[derive(Debug, Clone, Copy)]
pub struct Range {
    /// a: the derivative of the range by x.
    pub by_x: f32,
    /// b: the derivative of the range by y.
    pub by_y: f32,
    /// c, metres.
    pub offset: f32,
    /// Measured range, metres.
    pub measured: f32,
    /// Its variance, m².
    pub variance: f32,
}

impl Range {
    /// Expected range at a state, metres.
    #[must_use]
    #[inline]
    pub fn expected(&self, x: f32, y: f32) -> f32 {
        self.by_x * x + self.by_y * y + self.offset
    }
}

/// The motion of a wheel travel, with its derivatives by the state.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Increments of x, y and heading.
    pub by: [f32; 3],
    /// The derivative of the new x by heading, mean, difference and track width; that by x is one.
    pub x_by: [f32; 4],
    /// The same of y.
    pub y_by: [f32; 4],
    /// The derivative of the new heading by mean, difference and track width.
    pub heading_by: [f32; 3],
}

impl Motion {
    /// The motion of a travel at a state.
    #[must_use]
    #[inline]
    pub fn new(state: &Vector, step: &Step) -> Self {
        let [_, _, _, mean, difference, width_error] = *state;
        let &Step { right, left, sin, cos, .. } = step;
        let (turn, per_width) = turn(mean, difference, width_error, right, left);
        let (sum, spread) = (right + left, right - left);
        let advance = 0.5 * (sum * (1.0 + mean) + 0.5 * spread * difference);
        let (swing_x, swing_y) = (-advance * sin, advance * cos);
        let advance_by = [0.5 * sum, 0.25 * spread];
        let heading_by = [spread * per_width, 0.5 * sum * per_width, -turn * per_width];
        let half = heading_by.map(|by| 0.5 * by);
        Self {
            by: [advance * cos, advance * sin, turn],
            x_by: [
                swing_x,
                cos * advance_by[0] + swing_x * half[0],
                cos * advance_by[1] + swing_x * half[1],
                swing_x * half[2],
            ],
            y_by: [
                swing_y,
                sin * advance_by[0] + swing_y * half[0],
                sin * advance_by[1] + swing_y * half[1],
                swing_y * half[2],
            ],
            heading_by,
        }
    }

    /// The state after the travel.
    #[must_use]
    #[inline]
    pub fn moved(&self, state: &Vector) -> Vector {
        let [x, y, heading, mean, difference, width_error] = *state;
        let [dx, dy, turn] = self.by;
        [x + dx, y + dy, heading + turn, mean, difference, width_error]
    }

    /// The dense Jacobian F.
    #[must_use]
    #[inline]
    pub fn jacobian(&self) -> Matrix {
        let ([xh, xc, xd, xw], [yh, yc, yd, yw]) = (self.x_by, self.y_by);
        let [hc, hd, hw] = self.heading_by;
        [
            [1.0, 0.0, xh, xc, xd, xw],
            [0.0, 1.0, yh, yc, yd, yw],
            [0.0, 0.0, 1.0, hc, hd, hw],
            [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        ]
    }
}

/// The turn of a travel, radians, and the inverse of the track width.
#[must_use]
#[inline]
pub fn turn(mean: f32, difference: f32, width_error: f32, right: f32, left: f32) -> (f32, f32) {
    let per_width = 1.0 / (TRACK_WIDTH + width_error);
    let rolled = (right - left) * (1.0 + mean) + 0.5 * (right + left) * difference;
    (rolled * per_width, per_width)
}
