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

    /// Switches each group of connected pixels that are `on`, or off, and whose box is at most `most` pixels wide and high. Returns
    /// the number of pixels.
    pub fn switch_small(&mut self, on: bool, most: usize) -> usize {
        let mut seen = vec![false; self.on.len()];
        let mut count = 0;
        for start in 0..self.on.len() {
            let is_new = self.on.get(start) == Some(&on) && seen.get(start) == Some(&false);
            if is_new && let Some(group) = self.small_group(start, on, most, &mut seen) {
                count += group.len();
                for at in group {
                    if let Some(pixel) = self.on.get_mut(at) {
                        *pixel = !on;
                    }
                }
            }
        }
        count
    }

    /// The pixels that are connected with one; `None` if their box is larger than `most`. Pixels that are on are connected by
    /// corners, too.
    fn small_group(
        &self,
        start: usize,
        on: bool,
        most: usize,
        seen: &mut [bool],
    ) -> Option<Vec<usize>> {
        let step = if on { 1 } else { 2 };
        let (mut open, mut group) = (vec![start], Vec::new());
        let mut limits = [usize::MAX, 0, usize::MAX, 0];
        if let Some(seen) = seen.get_mut(start) {
            *seen = true;
        }
        while let Some(at) = open.pop() {
            let (x, y) = (at % self.width, at / self.width);
            let [left, right, bottom, top] = limits;
            limits = [left.min(x), right.max(x), bottom.min(y), top.max(y)];
            // Those of a large group are not needed.
            if group.len() <= most * most {
                group.push(at);
            }
            let coordinate = |value: usize| i32::try_from(value).unwrap_or(i32::MAX);
            let near = beside((coordinate(x), coordinate(y))).into_iter().step_by(step);
            for next in near.filter_map(|pixel| self.index(pixel)) {
                if self.on.get(next) == Some(&on)
                    && let Some(seen) = seen.get_mut(next).filter(|seen| !**seen)
                {
                    *seen = true;
                    open.push(next);
                }
            }
        }
        let [left, right, bottom, top] = limits;
        (right - left < most && top - bottom < most).then_some(group)
    }

    /// The image with pixels that are so many times as large: on where one of theirs is.
    #[must_use]
    pub fn coarser(&self, times: usize) -> Self {
        let mut coarse = Self::new(self.width.div_ceil(times), self.height.div_ceil(times));
        for (at, _) in self.on.iter().enumerate().filter(|(_, on)| **on) {
            let (x, y) = (at % self.width / times, at / self.width / times);
            if let Some(pixel) = coarse.on.get_mut(y * coarse.width + x) {
                *pixel = true;
            }
        }
        coarse
    }

    /// Turns solid areas off: all pixels of squares whose side is longer than `thickest`. Returns the number of pixels.
    pub fn remove_solid(&mut self, thickest: usize) -> usize {
        let corners = self.corners(thickest);
        // The lowest row above this one, for each column, from which a square reaches down to here.
        let mut reaching = vec![usize::MAX; self.width];
        let mut count = 0;
        for y in (0..self.height).rev() {
            let from = y * self.width;
            let corners = corners.get(from..from + self.width).unwrap_or_default();
            let on = self.on.get_mut(from..from + self.width).unwrap_or_default();
            // The last corner to the right.
            let mut right = usize::MAX;
            for x in (0..on.len()).rev() {
                let is_corner = corners.get(x).copied().unwrap_or(false);
                right = if is_corner { x } else { right };
                let (Some(row), Some(on)) = (reaching.get_mut(x), on.get_mut(x)) else { continue };
                *row = if right.wrapping_sub(x) <= thickest { y } else { *row };
                if *on && row.wrapping_sub(y) <= thickest {
                    *on = false;
                    count += 1;
                }
            }
        }
        count
    }

    /// The upper right corners of squares of pixels that are on and whose side is longer than `thickest`.
    fn corners(&self, thickest: usize) -> Vec<bool> {
        let mut corners = vec![false; self.on.len()];
        // Sides of the largest square that ends at each pixel of a row, by its smallest three neighbours; a pixel to the left.
        let mut below = vec![0_usize; self.width + 1];
        for (on, corners) in
            self.on.chunks(self.width.max(1)).zip(corners.chunks_mut(self.width.max(1)))
        {
            let (mut diagonal, mut left) = (0, 0);
            for ((on, corner), side) in on.iter().zip(corners).zip(below.iter_mut().skip(1)) {
                let length = if *on { left.min(*side).min(diagonal) + 1 } else { 0 };
                (diagonal, left) = (*side, length);
                *side = length;
                *corner = length > thickest;
            }
        }
        corners
    }

    /// Thins lines to one pixel.
    pub fn thin(&mut self) {
        // In the first two passes all pixels are examined, later those beside what the last two have removed.
        let mut all = self.pixels();
        let mut last = self.remove(all.iter().copied(), 0);
        all.retain(|&pixel| self.is_on(pixel));
        let mut before = std::mem::replace(&mut last, self.remove(all.into_iter(), 1));
        for pass in [0, 1].into_iter().cycle() {
            if before.is_empty() && last.is_empty() {
                return;
            }
            let mut near: Vec<Pixel> =
                before.iter().chain(&last).copied().flat_map(beside).collect();
            near.sort_unstable();
            near.dedup();
            before = std::mem::replace(&mut last, self.remove(near.into_iter(), pass));
        }
    }

    /// Turns off those of some pixels that a pass removes, all at once; returns them.
    fn remove(&mut self, of: impl Iterator<Item = Pixel>, pass: u8) -> Vec<Pixel> {
        let is_removed = |&pixel: &Pixel| self.is_on(pixel) && self.is_removable(pixel, pass);
        let removed: Vec<Pixel> = of.filter(is_removed).collect();
        for &pixel in &removed {
            self.set(pixel, false);
        }
        removed
    }

    fn is_removable(&self, pixel: Pixel, pass: u8) -> bool {
        let around = beside(pixel).map(|pixel| self.is_on(pixel));
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

/// The eight pixels beside a pixel.
fn beside((x, y): Pixel) -> [Pixel; 8] {
    AROUND.map(|(dx, dy)| (x + dx, y + dy))
}
