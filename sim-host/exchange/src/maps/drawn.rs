//! Segments of a drawing, and what was dropped of it.

use std::collections::{BTreeMap, HashSet};

use anyhow::ensure;
use sonarfix_map::{Floor, NamedWall};

/// Largest number of segments that are read.
pub const MAX_SEGMENTS: usize = 200_000;
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
}

fn length(from: [f64; 2], to: [f64; 2]) -> f64 {
    (from[0] - to[0]).hypot(from[1] - to[1])
}

/// Collects segments and counts what is dropped.
#[derive(Debug, Default)]
pub struct Drawing {
    walls: Vec<NamedWall>,
    names: HashSet<String>,
    dropped: BTreeMap<String, u64>,
    notes: Vec<String>,
}

impl Drawing {
    /// Counts something that is dropped, by its kind and the reason.
    pub fn drop(&mut self, what: impl Into<String>) {
        *self.dropped.entry(what.into()).or_insert(0) += 1;
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
        ensure!(count < MAX_SEGMENTS, "it has more than {MAX_SEGMENTS} segments");
        let base = if name.is_empty() { "wall" } else { name };
        let is_free = !name.is_empty() && !self.names.contains(name);
        let name = if is_free { name.to_owned() } else { format!("{base} {}", count + 1) };
        // A name may look like a number that was given.
        let name = if self.names.contains(&name) { format!("{name} ({count})") } else { name };
        let wall = NamedWall::new(name.clone(), from, to);
        let wall =
            wall.map_err(|error| anyhow::anyhow!("the segment {from:?} to {to:?}: {error}"))?;
        self.names.insert(name);
        self.walls.push(wall);
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
        Ok(Imported { floor: Floor::new(self.walls), notes: self.notes })
    }
}
