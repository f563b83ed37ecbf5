//! Random floor plans: homes, offices and labs, to compare measurement policies over many places.
//!
//! A [`FloorPlan`] is the text of a scenario, so that it can be read, stored and edited. Coordinates
//! are whole centimetres and all draws come from one random stream: a seed gives the same plan on
//! every machine.
//!
//! | module | what |
//! |---|---|
//! | `site` | kinds of plans, and units |
//! | `rooms` | partition of the site into rooms and a corridor |
//! | `doors` | neighbouring rooms, and the doors between them |
//! | `walls` | the faces of walls, single lines or thick ones, with gaps for the doors |
//! | `walk` | a path through rooms and doors |
//! | `clutter` | furniture beside the path, partly mapped |
//! | `text` | the plan as a scenario |
//! | [`compare`] | two policies on the same plans |
//! | [`picture`] | drawings of plans and of runs on them |
//! | [`page`] | the results as a page of the documentation |

mod clutter;
pub mod compare;
mod doors;
pub mod page;
pub mod picture;
mod rooms;
mod site;
mod text;
mod walk;
mod walls;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{FileError, Scenario};

pub use site::Kind;

/// A plan, as the text of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FloorPlan {
    /// Its seed.
    pub seed: u64,
    /// The kind of building.
    pub kind: Kind,
    /// Number of rooms, including the corridor.
    pub rooms: usize,
    /// The scenario (`docs/formats.md`).
    pub toml: String,
}

impl FloorPlan {
    /// The plan of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let kind = pick(&mut rng, &Kind::ALL).unwrap_or(Kind::Home);
        let rooms = rooms::partition(kind, &mut rng);
        let thickness = walls::thickness(&mut rng);
        let doors = doors::between(&rooms, thickness, &mut rng);
        let path = walk::through(&rooms, &doors, thickness, &mut rng);
        let mut clutter = clutter::beside(&path, &rooms, &doors, thickness, &mut rng);
        let walls = walls::faces(&rooms, &doors, thickness);
        let mapped = std::mem::take(&mut clutter.mapped);
        let plan = text::Plan { seed, kind, walls, mapped, clutter, path };
        let toml = plan.toml(&mut rng);
        Self { seed, kind, rooms: rooms.len(), toml }
    }

    /// The name of the plan in error messages.
    #[must_use]
    pub fn name(&self) -> String {
        format!("floor plan {}", self.seed)
    }

    /// The scenario, read from the text.
    ///
    /// # Errors
    /// [`FileError`], if the scenario is invalid.
    pub fn scenario(&self) -> Result<Scenario, FileError> {
        Scenario::parse(&self.toml, &self.name(), std::path::Path::new(""))
    }
}

/// A random element; `None` of an empty slice.
fn pick<T: Copy>(rng: &mut ChaCha8Rng, of: &[T]) -> Option<T> {
    (!of.is_empty()).then(|| rng.random_range(0..of.len())).and_then(|n| of.get(n).copied())
}
