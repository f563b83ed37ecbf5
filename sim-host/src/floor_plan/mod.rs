//! Floor plans out of a seed: homes, offices and labs that nobody drew, for asking whether a
//! schedule of the sonar that is good in one place is good in all.
//!
//! A [`FloorPlan`] is the text of a scenario, so that what the simulator runs is what a person can
//! read, keep and change. Everything is on a grid of a centimetre, in whole numbers, and drawn
//! from one stream of chance: a seed gives the same plan everywhere.
//!
//! | module | what |
//! |---|---|
//! | `rooms` | cuts the site into rooms, and a corridor |
//! | `doors` | which rooms are neighbours, and where one goes from one to the other |
//! | `walls` | the faces of walls, single lines or thick ones, with gaps for the doors |
//! | `walk` | a way through rooms and doors |
//! | `clutter` | furniture beside the way, of which the map knows a part |
//! | `text` | all that as a scenario |
//! | [`compare`] | two policies on the same plans |
//! | [`picture`] | plans drawn, and what happened on them |
//! | [`page`] | what came out, for the documentation |

mod clutter;
pub mod compare;
mod doors;
pub mod page;
pub mod picture;
mod rooms;
mod text;
mod walk;
mod walls;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{FileError, Scenario};

/// A point of a plan, centimetres.
type Point = [i32; 2];

/// The radius that the robot keeps free around itself, centimetres.
const CLEARANCE: i32 = 20;

/// What a plan is a plan of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Rooms that open into each other.
    Home,
    /// Rooms on both sides of a corridor.
    Office,
    /// Few large rooms.
    Lab,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Home, Self::Office, Self::Lab];

    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Home => "home",
            Self::Office => "office",
            Self::Lab => "lab",
        }
    }
}

/// A plan, as the text of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FloorPlan {
    /// The seed that it came from.
    pub seed: u64,
    /// What it is a plan of.
    pub kind: Kind,
    /// How many rooms it has, the corridor among them.
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
        let way = walk::through(&rooms, &doors, thickness, &mut rng);
        let mut clutter = clutter::beside(&way, &rooms, &doors, thickness, &mut rng);
        let walls = walls::faces(&rooms, &doors, thickness);
        let mapped = std::mem::take(&mut clutter.mapped);
        let plan = text::Plan { seed, kind, walls, mapped, clutter, way };
        let toml = plan.toml(&mut rng);
        Self { seed, kind, rooms: rooms.len(), toml }
    }

    /// What errors call the plan.
    #[must_use]
    pub fn name(&self) -> String {
        format!("floor plan {}", self.seed)
    }

    /// The scenario, read from the text.
    ///
    /// # Errors
    /// [`FileError`], if the plan were not one that can be driven.
    pub fn scenario(&self) -> Result<Scenario, FileError> {
        Scenario::parse(&self.toml, &self.name(), std::path::Path::new(""))
    }
}

/// One of some things, by chance; `None` of none.
fn pick<T: Copy>(rng: &mut ChaCha8Rng, of: &[T]) -> Option<T> {
    (!of.is_empty()).then(|| rng.random_range(0..of.len())).and_then(|n| of.get(n).copied())
}
