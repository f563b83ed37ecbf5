//! Pixels that are on or off, and lines of one pixel from thick ones: T. Y. Zhang, C. Y. Suen, "A fast parallel algorithm
//! for thinning digital patterns", 1984.

/// An image of two colours, rows from the bottom.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bitmap {
    width: usize,
    height: usize,
    on: Vec<bool>,
}

/// Column and row of a pixel.
pub type Pixel = (i32, i32);

/// The eight pixels beside a pixel, counter-clockwise from the right.
const AROUND: [Pixel; 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

impl Bitmap {
    /// An empty image.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, on: vec![false; width * height] }
    }

    fn index(&self, (x, y): Pixel) -> Option<usize> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < self.width && y < self.height).then(|| y * self.width + x)
    }

    /// Whether a pixel is on; one outside is off.
    #[must_use]
    pub fn is_on(&self, pixel: Pixel) -> bool {
        self.index(pixel).and_then(|at| self.on.get(at)).copied().unwrap_or(false)
    }

    /// Turns a pixel on or off.
    pub fn set(&mut self, pixel: Pixel, on: bool) {
        if let Some(of) = self.index(pixel).and_then(|at| self.on.get_mut(at)) {
            *of = on;
        }
    }

    /// The pixels that are on, row by row.
    #[must_use]
    pub fn pixels(&self) -> Vec<Pixel> {
        let coordinate = |value: usize| i32::try_from(value).unwrap_or(i32::MAX);
        let on = self.on.iter().enumerate().filter(|(_, on)| **on);
        on.map(|(at, _)| (coordinate(at % self.width), coordinate(at / self.width))).collect()
    }

    /// Turns solid areas off: all pixels of squares whose side is longer than `thickest`. Returns the number of pixels.
    pub fn remove_solid(&mut self, thickest: usize) -> usize {
        // Sides of the largest square of pixels that ends at each pixel, by its smallest three neighbours.
        let mut side = vec![0_u16; self.on.len()];
        let mut solid = Vec::new();
        for at in 0..self.on.len() {
            let (x, y) = (at % self.width, at / self.width);
            if !self.on.get(at).copied().unwrap_or(false) {
                continue;
            }
            let of = |back: usize| side.get(at - back).copied().unwrap_or(0);
            let inner = if x == 0 || y == 0 {
                0
            } else {
                of(1).min(of(self.width)).min(of(self.width + 1))
            };
            let length = inner.saturating_add(1);
            if let Some(side) = side.get_mut(at) {
                *side = length;
            }
            if usize::from(length) > thickest {
                solid.push((x, y));
            }
        }
        let mut count = 0;
        for (x, y) in solid {
            for row in (y - thickest)..=y {
                let from = row * self.width + x - thickest;
                let pixels = self.on.get_mut(from..=from + thickest).into_iter().flatten();
                for pixel in pixels.filter(|pixel| **pixel) {
                    *pixel = false;
                    count += 1;
                }
            }
        }
        count
    }

    /// Thins lines to one pixel.
    pub fn thin(&mut self) {
        let mut left = self.pixels();
        loop {
            let before = left.len();
            for pass in 0..2 {
                let removed: Vec<Pixel> =
                    left.iter().copied().filter(|&pixel| self.is_removable(pixel, pass)).collect();
                for &pixel in &removed {
                    self.set(pixel, false);
                }
                left.retain(|&pixel| self.is_on(pixel));
            }
            if left.len() == before {
                return;
            }
        }
    }

    fn is_removable(&self, (x, y): Pixel, pass: u8) -> bool {
        let around = AROUND.map(|(dx, dy)| self.is_on((x + dx, y + dy)));
        let [east, _, north, _, west, _, south, _] = around;
        let count = around.iter().filter(|on| **on).count();
        let next = around.iter().skip(1).chain(&around);
        let begins = around.iter().zip(next).filter(|(on, next)| !**on && **next).count();
        let is_edge = if pass == 0 {
            !(east && south && (north || west))
        } else {
            !(north && west && (east || south))
        };
        (2..=6).contains(&count) && begins == 1 && is_edge
    }
}
