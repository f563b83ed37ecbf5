//! The room of the map, and the path in it.

use crate::question::Refusal;

/// The walls of a map, and a path among them.
#[derive(Debug, Clone)]
pub struct Room {
    /// The rows of `map.wall`.
    pub(crate) walls: String,
    /// The start of the path, metres.
    pub(crate) start: [f64; 2],
    /// The corners of the path after the start, as in a scenario file.
    pub(crate) corners: String,
    /// The rows of `world.obstacle`.
    pub(crate) obstacles: String,
}

/// Distance of the path from the walls, as a part of the shorter side, and at most, metres.
const INSET: f64 = 0.25;
const MOST_INSET: f64 = 0.8;

impl Room {
    /// A room of 4 m by 3 m with cupboards in one corner: it looks the same from no two places.
    #[must_use]
    pub fn example() -> Self {
        let wall = |name, from, to| wall(name, from, to);
        let walls = [
            wall("south", [0.0, 0.0], [4.0, 0.0]),
            wall("east", [4.0, 0.0], [4.0, 3.0]),
            wall("north", [4.0, 3.0], [1.5, 3.0]),
            wall("side of the cupboards", [1.5, 3.0], [1.5, 2.2]),
            wall("cupboards", [1.5, 2.2], [0.0, 2.2]),
            wall("west", [0.0, 2.2], [0.0, 0.0]),
        ];
        let corners = [[3.2, 0.8], [3.2, 2.3], [2.2, 2.3], [1.0, 1.4], [1.0, 0.8]];
        let obstacles = "    { centre = [2.1, 1.5], radius = \"5 cm\" },                    # the leg of a table\n    \
                         { centre = [3.7, 0.3], radius = \"15 cm\" },                   # a bin\n";
        Self {
            walls: walls.concat(),
            start: [1.0, 0.8],
            corners: format!("{corners:?}"),
            obstacles: obstacles.to_owned(),
        }
    }

    /// An arena of 1.8 m by 1.2 m on a table, with a block in one corner: it looks the same from no two places.
    #[must_use]
    pub fn arena() -> Self {
        let walls = [
            wall("south", [0.0, 0.0], [1.8, 0.0]),
            wall("east", [1.8, 0.0], [1.8, 1.2]),
            wall("north", [1.8, 1.2], [0.5, 1.2]),
            wall("side of the block", [0.5, 1.2], [0.5, 0.8]),
            wall("front of the block", [0.5, 0.8], [0.0, 0.8]),
            wall("west", [0.0, 0.8], [0.0, 0.0]),
        ];
        let corners = [[1.4, 0.4], [1.4, 0.8], [0.8, 0.8], [0.8, 0.4], [0.4, 0.4]];
        Self {
            walls: walls.concat(),
            start: [0.4, 0.4],
            corners: format!("{corners:?}"),
            obstacles: String::new(),
        }
    }

    /// A rectangle of this length and width, as `4 x 3`, metres, and a path along its walls.
    ///
    /// # Errors
    /// [`Refusal`], if these are not two positive numbers.
    pub fn rectangle(sides: &str) -> Result<Self, Refusal> {
        let side = |text: &str| {
            text.trim().parse().ok().filter(|side| *side > 0.0 && f64::is_finite(*side))
        };
        let both = sides.split_once('x').and_then(|(x, y)| Some([side(x)?, side(y)?]));
        let [x, y] = both.ok_or_else(|| Refusal {
            option: "room",
            reason: format!(
                "\"{sides}\" is not a length and a width in metres: write, for example, 4 x 3"
            ),
        })?;
        let inset = rounded((INSET * x.min(y)).min(MOST_INSET));
        let [right, back] = [x, y].map(|side| rounded(side - inset));
        let walls = [
            wall("south", [0.0, 0.0], [x, 0.0]),
            wall("east", [x, 0.0], [x, y]),
            wall("north", [x, y], [0.0, y]),
            wall("west", [0.0, y], [0.0, 0.0]),
        ];
        Ok(Self {
            walls: walls.concat(),
            start: [inset, inset],
            corners: format!(
                "{:?}",
                [[right, inset], [right, back], [inset, back], [inset, inset]]
            ),
            obstacles: String::new(),
        })
    }
}

fn wall(name: &str, from: [f64; 2], to: [f64; 2]) -> String {
    format!("    {{ name = \"{name}\", from = {from:?}, to = {to:?} }},\n")
}

/// To centimetres.
fn rounded(metres: f64) -> f64 {
    (100.0 * metres).round() / 100.0
}
