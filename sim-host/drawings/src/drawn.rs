//! Segments of a drawing, and what was dropped of it.

use std::collections::{BTreeMap, HashSet};

use anyhow::ensure;
use sonarfix_map::{Floor, NamedWall};

/// Largest number of segments that are read.
pub const MAX_SEGMENTS: usize = 200_000;
/// Nearer to the origin of a map the localizer's numbers resolve a millimetre, metres: 2¹³.
const FARTHEST: f64 = 8_192.0;
/// Coordinates from which a wall's length is not known to a tenth of a millimetre any more, metres.
const UNKNOWN: f64 = 1e9;
/// A map that is farther is moved by a multiple of this, metres.
const MOVE: f64 = 100.0;
/// Most kinds of dropped things that are counted by name.
const MOST_KINDS: usize = 100;
/// Shorter segments are no walls, metres: a wall needs a direction.
const SHORTEST: f64 = 1e-4;

/// The place of a drawing in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Metres per unit of the drawing; `None` takes that of the file.
    pub unit: Option<f64>,
    /// The place of the drawing's origin in the map, metres.
    pub origin: [f64; 2],
}

impl Frame {
    /// A point of the drawing in the map.
    #[must_use]
    pub fn place(&self, unit: f64, [x, y]: [f64; 2]) -> [f64; 2] {
        [x * unit + self.origin[0], y * unit + self.origin[1]]
    }
}

/// A map that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// Its walls.
    pub floor: Floor,
    /// Scale and origin, what was dropped, and what is uncertain; one line each.
    pub notes: Vec<String>,
    /// How thick the line of each wall is, metres; empty if the drawing does not say.
    pub strokes: Vec<f64>,
    /// The size of a pixel, metres; 0 of a drawing.
    pub resolution: f64,
    /// What must be added to the map's coordinates for those of the drawing in its frame, metres; `None` if the walls are where the
    /// drawing has them.
    pub offset: Option<[f64; 2]>,
}

fn length(from: [f64; 2], to: [f64; 2]) -> f64 {
    (from[0] - to[0]).hypot(from[1] - to[1])
}

/// Collects segments and counts what is dropped.
#[derive(Debug, Default)]
pub struct Drawing {
    walls: Vec<(String, [[f64; 2]; 2])>,
    names: HashSet<String>,
    dropped: BTreeMap<String, u64>,
    notes: Vec<String>,
    strokes: Vec<f64>,
    /// The size of a pixel, metres; 0 of a drawing.
    resolution: f64,
}

impl Drawing {
    /// A drawing of pixels of this size, metres.
    pub fn of_pixels(resolution: f64) -> Self {
        Self { resolution, ..Self::default() }
    }

    /// Counts something that is dropped, by its kind and the reason.
    pub fn drop(&mut self, what: impl Into<String>) {
        let what = what.into();
        let is_known = self.dropped.contains_key(&what) || self.dropped.len() < MOST_KINDS;
        let what = if is_known { what } else { "others".to_owned() };
        *self.dropped.entry(what).or_insert(0) += 1;
    }

    /// Adds a note.
    pub fn note(&mut self, note: String) {
        self.notes.push(note);
    }

    /// Adds a wall between two points of the map, metres. Without a name, or if another wall has it, it gets a number.
    ///
    /// # Errors
    /// If there are too many walls, or a point is too far away.
    pub fn wall(&mut self, name: &str, from: [f64; 2], to: [f64; 2]) -> anyhow::Result<()> {
        if length(from, to) < SHORTEST {
            self.drop("segments shorter than 0.1 mm");
            return Ok(());
        }
        let count = self.walls.len();
        ensure!(
            count < MAX_SEGMENTS,
            "it has more than {MAX_SEGMENTS} segments: remove what is no wall"
        );
        let base = if name.is_empty() { "wall" } else { name };
        let is_free = !name.is_empty() && !self.names.contains(name);
        let name = if is_free { name.to_owned() } else { format!("{base} {}", count + 1) };
        // A name may look like a number that was given.
        let name = if self.names.contains(&name) { format!("{name} ({count})") } else { name };
        let is_known = [from, to].iter().flatten().all(|value| value.abs() < UNKNOWN);
        ensure!(is_known, "the segment {from:?} to {to:?}: it is too far from the origin");
        self.names.insert(name.clone());
        self.walls.push((name, [from, to]));
        Ok(())
    }

    /// Adds a wall as [`Self::wall`] does, whose line is so thick, metres.
    ///
    /// # Errors
    /// Those of [`Self::wall`].
    pub fn stroke(&mut self, from: [f64; 2], to: [f64; 2], thickness: f64) -> anyhow::Result<()> {
        self.wall("", from, to)?;
        self.strokes.resize(self.walls.len(), thickness);
        Ok(())
    }

    /// Adds the segments between points in order; `is_closed` adds the last to the first.
    ///
    /// # Errors
    /// Those of [`Self::wall`].
    pub fn chain(
        &mut self,
        name: &str,
        points: &[[f64; 2]],
        is_closed: bool,
    ) -> anyhow::Result<()> {
        for (from, to) in points.iter().zip(points.iter().skip(1)) {
            self.wall(name, *from, *to)?;
        }
        match (points.first(), points.last()) {
            (Some(first), Some(last)) if is_closed && length(*first, *last) > 0.0 => {
                self.wall(name, *last, *first)
            }
            _ => Ok(()),
        }
    }

    /// The map.
    ///
    /// # Errors
    /// If there is no wall.
    pub fn end(mut self) -> anyhow::Result<Imported> {
        for (what, count) in &self.dropped {
            self.notes.push(format!("dropped: {what} ({count})"));
        }
        ensure!(
            !self.walls.is_empty(),
            "there is no straight line in it. {}",
            self.notes.join("; ")
        );
        let offset = self.offset()?;
        if let Some([x, y]) = offset {
            self.notes.push(format!(
                "moved: ({x}, {y}) m of the drawing is the origin of the map, whose numbers would not resolve a millimetre there"
            ));
        }
        let floor = Floor::new(moved(self.walls, offset.unwrap_or_default())?);
        Ok(Imported {
            floor,
            notes: self.notes,
            strokes: self.strokes,
            resolution: self.resolution,
            offset,
        })
    }

    /// The point that becomes the origin if a wall is too far from the drawing's: the lower left corner, rounded down.
    fn offset(&self) -> anyhow::Result<Option<[f64; 2]>> {
        let ends = || self.walls.iter().flat_map(|(_, ends)| ends);
        let span = |of: fn(&[f64; 2]) -> f64| {
            ends().map(of).fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)))
        };
        let (x, y) = (span(|[x, _]| *x), span(|[_, y]| *y));
        if [x.0, x.1, y.0, y.1].iter().all(|value| value.abs() <= FARTHEST) {
            return Ok(None);
        }
        let offset = [x.0, y.0].map(|low| (low / MOVE).floor() * MOVE);
        let is_near = x.1 - offset[0] <= FARTHEST && y.1 - offset[1] <= FARTHEST;
        ensure!(
            is_near,
            "it is {:.0} × {:.0} m large: a map has at most {FARTHEST} m. Import a part of it",
            x.1 - x.0,
            y.1 - y.0
        );
        Ok(Some(offset))
    }
}

/// The walls relative to a point.
fn moved(walls: Vec<(String, [[f64; 2]; 2])>, by: [f64; 2]) -> anyhow::Result<Vec<NamedWall>> {
    let wall = |(name, ends): (String, [[f64; 2]; 2])| {
        let [from, to] = ends.map(|[x, y]| [x - by[0], y - by[1]]);
        let wall = NamedWall::new(name, from, to);
        wall.map_err(|error| anyhow::anyhow!("the segment {from:?} to {to:?}: {error}"))
    };
    walls.into_iter().map(wall).collect()
}
