//! One wall for each wall of a floor plan, which draws walls as double or thick lines, some twice, and has text and furniture.
//!
//! | module | what |
//! |---|---|
//! | `piece` | a straight line |
//! | `double` | walls that are drawn as their two faces |
//! | `joined` | pieces of one wall, copies, corners |
//! | `picture` | a plan before and after |

mod double;
mod joined;
mod picture;
mod piece;

use sonarfix_map::{Floor, NamedWall};

use super::drawn::Imported;
pub use piece::Piece;

/// Every line is compared with every other one.
const MOST_LINES: usize = 5_000;
/// Copies of a line are so near to each other, metres.
const COPY: f64 = 0.025;
/// Pieces of one wall are not farther apart than this, metres, besides its thickness. A door is wider.
const GAP: f64 = 0.08;
/// Strokes from this thickness on are those of walls, metres.
const THICK: f64 = 0.06;
/// Strokes thinner than this share of most of the thick ones are not of walls.
const THIN: f64 = 0.45;
/// What stands alone and is no longer than this is furniture, metres, and at most half of the whole plan.
const FURNITURE: f64 = 3.5;
/// A straight line that stands alone is a wall from this length on, metres.
const SCREEN: f64 = 1.2;
/// The breadth of what is straight, metres.
const STRAIGHT: f64 = 0.3;
/// Walls touch within this distance, metres, besides their thickness.
const TOUCH: f64 = 0.06;
/// Lines in an image are known to this part of a pixel.
const PIXELS: f64 = 1.6;
/// A piece of a wall between two doors is on the line of another wall and not farther from it, metres.
const DOOR: f64 = 2.5;

/// The walls of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The walls.
    pub walls: Vec<Piece>,
    /// What was found, one line each.
    pub notes: Vec<String>,
    /// The lines of text, furniture and dimensions.
    left_out: Vec<Piece>,
    /// All lines.
    drawn: Vec<Piece>,
}

/// The lines of a drawing that was imported.
#[must_use]
fn lines(drawing: &Imported) -> Vec<Piece> {
    let line = |(wall, thickness): (&NamedWall, f64)| Piece {
        name: wall.name().to_owned(),
        from: wall.from(),
        to: wall.to(),
        thickness,
    };
    let strokes = drawing.strokes.iter().copied().chain(std::iter::repeat(0.0));
    drawing.floor.named_walls().iter().zip(strokes).map(line).collect()
}

/// The drawing with one wall for each wall of the plan, and the plan.
///
/// # Errors
/// If there are too many lines, or no wall.
pub fn of(mut drawing: Imported) -> anyhow::Result<(Imported, Plan)> {
    let plan = walls(lines(&drawing), drawing.resolution)?;
    drawing.floor = plan.floor()?;
    drawing.notes.extend(plan.notes.iter().cloned());
    Ok((drawing, plan))
}

/// Finds the walls among the lines of a plan. `resolution` is the size of a pixel, metres, and 0 of a drawing.
///
/// # Errors
/// If there are too many lines.
fn walls(lines: Vec<Piece>, resolution: f64) -> anyhow::Result<Plan> {
    anyhow::ensure!(
        lines.len() <= MOST_LINES,
        "a plan with {} lines: at most {MOST_LINES} are compared. Remove what is no wall",
        lines.len()
    );
    let (notes, left_out) = (Vec::new(), Vec::new());
    let mut plan = Plan { walls: Vec::new(), notes, left_out, drawn: lines.clone() };
    let aside = COPY.max(PIXELS * resolution);
    let lines = joined::collinear(lines, aside, 0.0);
    plan.count(plan.drawn.len() - lines.len(), "copies and pieces of one line");
    let lines = plan.without_thin(lines);
    let mut others = Vec::new();
    let mut walls = match double::walls(&lines, aside, &mut others) {
        Some((walls, faces)) => {
            plan.count(faces, "faces of walls, of which the middle is taken");
            plan.count(others.len(), "single lines, in a plan with double ones");
            plan.left_out.append(&mut others);
            walls
        }
        None => lines,
    };
    let thickness = thickness(&walls);
    walls = joined::collinear(walls, aside.max(0.3 * thickness), GAP + thickness);
    joined::corners(&mut walls);
    plan.walls = plan.without_furniture(walls);
    if thickness > 0.0 {
        plan.notes.push(format!(
            "uncertain: the walls are about {:.0} cm thick, and the map has their middle: the face that a robot measures is {:.0} cm \
             before it",
            100.0 * thickness,
            50.0 * thickness
        ));
    }
    Ok(plan)
}

/// The number of walls of a drawing as a plan, if it has at least a third fewer walls than lines.
#[must_use]
pub fn fewer(drawing: &Imported) -> Option<usize> {
    let drawn = drawing.floor.named_walls().len();
    let walls = walls(lines(drawing), drawing.resolution).ok()?.walls.len();
    (walls > 0 && 3 * walls < 2 * drawn).then_some(walls)
}

impl Plan {
    fn count(&mut self, count: usize, what: &str) {
        if count > 0 {
            self.notes.push(format!("plan: {what} ({count})"));
        }
    }

    /// The lines without the thin ones in a plan whose walls are thick strokes. What continues a wall is a window.
    fn without_thin(&mut self, lines: Vec<Piece>) -> Vec<Piece> {
        let thick = thickness(&lines);
        if thick < THICK {
            return lines;
        }
        let (walls, thin): (Vec<_>, Vec<_>) =
            lines.into_iter().partition(|line| line.thickness >= THIN * thick);
        let is_window = |line: &Piece| {
            let continues = |end: [f64; 2]| {
                let is_next = |wall: &&Piece| {
                    let [along, left] = wall.place(end);
                    let beyond = (-along).max(along - wall.length());
                    left.abs() <= 0.5 * thick
                        && (-0.05..=thick).contains(&beyond)
                        && wall.angle(line) < 0.1
                };
                walls.iter().any(|wall| is_next(&wall))
            };
            continues(line.from) && continues(line.to)
        };
        let (windows, others): (Vec<_>, Vec<_>) = thin.into_iter().partition(is_window);
        self.count(windows.len(), "thin lines that continue a wall: windows");
        self.count(others.len(), "thin lines beside thick walls: text, furniture, dimensions");
        self.left_out.extend(others);
        walls.into_iter().chain(windows).collect()
    }

    /// The walls without what stands alone.
    fn without_furniture(&mut self, walls: Vec<Piece>) -> Vec<Piece> {
        let groups = groups(&walls);
        let members = |group: usize| {
            walls.iter().zip(&groups).filter(move |(_, of)| **of == group).map(|(wall, _)| wall)
        };
        let largest = 0.5 * sides(range(walls.iter()))[1];
        // The house has the largest box; a dimension may be as long.
        let size = |group: &usize| {
            let [breadth, length] = sides(range(members(*group)));
            length * (breadth + STRAIGHT)
        };
        let first = groups.iter().copied().max_by(|a, b| size(a).total_cmp(&size(b)));
        let house = range(members(first.unwrap_or_default()));
        let is_main = |group: usize| {
            let box_of = range(members(group));
            let [breadth, length] = sides(box_of);
            let most = if breadth < STRAIGHT { SCREEN } else { FURNITURE };
            // Dimensions are written beside the house.
            let is_inside = box_of
                .iter()
                .zip(house)
                .all(|([least, most], [from, to])| *least < to && *most > from);
            length > most.min(largest) && is_inside
        };
        let continues = |wall: &Piece| {
            let mut others = walls.iter().zip(&groups);
            others.any(|(other, of)| is_main(*of) && is_on_line(other, wall))
        };
        let is_wall = |group: &usize| is_main(*group) || members(*group).any(continues);
        let kept: Vec<bool> = groups.iter().map(is_wall).collect();
        let (walls, furniture): (Vec<_>, Vec<_>) =
            walls.into_iter().zip(kept).partition(|(_, is_kept)| *is_kept);
        self.count(furniture.len(), "lines that stand alone: furniture, text");
        self.left_out.extend(furniture.into_iter().map(|(wall, _)| wall));
        walls.into_iter().map(|(wall, _)| wall).collect()
    }

    /// The walls as a map.
    ///
    /// # Errors
    /// If no wall was found.
    pub fn floor(&self) -> anyhow::Result<Floor> {
        anyhow::ensure!(
            !self.walls.is_empty(),
            "no wall was found in the plan. {}",
            self.notes.join("; ")
        );
        let named = |(at, wall): (usize, &Piece)| {
            let wall = NamedWall::new(format!("wall {}", at + 1), wall.from, wall.to);
            wall.map_err(|error| anyhow::anyhow!("wall {}: {error}", at + 1))
        };
        Ok(Floor::new(self.walls.iter().enumerate().map(named).collect::<anyhow::Result<_>>()?))
    }
}

/// The thickness that most of the length of some lines has at least: that of the thickest third.
fn thickness(lines: &[Piece]) -> f64 {
    let mut sorted: Vec<&Piece> = lines.iter().collect();
    sorted.sort_by(|a, b| b.thickness.total_cmp(&a.thickness));
    let mut left = lines.iter().map(Piece::length).sum::<f64>() / 3.0;
    for line in sorted {
        left -= line.length();
        if left <= 0.0 {
            return line.thickness;
        }
    }
    0.0
}

/// The number of the group of each wall: walls that touch are in one.
fn groups(walls: &[Piece]) -> Vec<usize> {
    let mut groups: Vec<usize> = (0..walls.len()).collect();
    for (one, a) in walls.iter().enumerate() {
        for (other, b) in walls.iter().enumerate().skip(one + 1) {
            let (Some(&of_a), Some(&of_b)) = (groups.get(one), groups.get(other)) else { continue };
            let reach = TOUCH + 0.6 * a.thickness.max(b.thickness);
            if of_a != of_b && a.distance(b) <= reach {
                groups.iter_mut().filter(|group| **group == of_b).for_each(|group| *group = of_a);
            }
        }
    }
    groups
}

/// The shorter and the longer side of a box, metres.
fn sides(range: [[f64; 2]; 2]) -> [f64; 2] {
    let [width, height] = range.map(|[least, most]| most - least);
    [width.min(height), width.max(height)]
}

/// The least and the greatest x, and those of y, of some lines.
fn range<'p>(lines: impl Iterator<Item = &'p Piece>) -> [[f64; 2]; 2] {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for end in lines.flat_map(|line| [line.from, line.to]) {
        for ([least, most], value) in range.iter_mut().zip(end) {
            (*least, *most) = (least.min(value), most.max(value));
        }
    }
    range
}

/// Whether a line continues a wall beyond a door.
fn is_on_line(wall: &Piece, line: &Piece) -> bool {
    let ([from, to], _) = wall.shadow(line);
    let is_beside = |end| wall.place(end)[1].abs() <= TOUCH;
    let is_near = from <= wall.length() + DOOR && to >= -DOOR;
    is_near && is_beside(line.from) && is_beside(line.to)
}
