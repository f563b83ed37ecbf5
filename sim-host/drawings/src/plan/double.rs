//! Walls that are drawn as two lines, their faces.

use super::joined::{is_one_wall, union};
use super::piece::Piece;

/// The usual thickness of a wall, metres.
const THICKNESS: (f64, f64) = (0.035, 0.5);
/// The sine of the largest angle between the faces of a wall: 2.5°.
const PARALLEL: f64 = 0.044;
/// The shortest part of a wall, metres.
const SHORTEST: f64 = 0.15;
/// A drawing in which this share of the length is faces of walls has its walls as double lines.
const USUAL: f64 = 0.5;
/// How much the thickness of walls of one drawing differs, metres.
const SPREAD: f64 = 0.04;

/// Two lines that may be the faces of a wall.
struct Pair {
    faces: [usize; 2],
    distance: f64,
    overlap: f64,
}

/// A part of a line, from and to along it.
type Part = [f64; 2];

/// The middle lines of the walls that are drawn as double lines, with the number of lines that were their faces; `None` if
/// this drawing has its walls as single lines. Parts of one wall are in line to `aside` metres. The lines that are no faces are passed to
/// `left_out`.
pub fn walls(
    lines: &[Piece],
    aside: f64,
    left_out: &mut Vec<Piece>,
) -> Option<(Vec<Piece>, usize)> {
    let mut pairs = pairs(lines, aside);
    let typical = typical(&pairs)?;
    let value = |pair: &Pair| {
        let off = (pair.distance - typical) / SPREAD;
        pair.overlap * (0.1 + (-off * off).exp())
    };
    pairs.sort_by(|a, b| value(b).total_cmp(&value(a)));
    let mut taken: Vec<Vec<Part>> = vec![Vec::new(); lines.len()];
    let mut walls: Vec<(Piece, [usize; 2])> = Vec::new();
    for Pair { faces: [one, other], .. } in pairs {
        let (Some(a), Some(b)) = (lines.get(one), lines.get(other)) else { continue };
        for part in free(a, b, taken.get(one), taken.get(other)) {
            let [from, to] = part.map(|along| {
                let here = a.at(along, 0.0);
                let there = b.at(b.place(here)[0], 0.0);
                [f64::midpoint(here[0], there[0]), f64::midpoint(here[1], there[1])]
            });
            let there = part.map(|along| b.place(a.at(along, 0.0))[0]);
            let thickness = a.shadow(b).1.abs();
            walls.push((Piece { name: a.name.clone(), from, to, thickness }, [one, other]));
            let marks = [(one, part), (other, [there[0].min(there[1]), there[0].max(there[1])])];
            for (line, part) in marks {
                if let Some(taken) = taken.get_mut(line) {
                    taken.push(part);
                }
            }
        }
    }
    let covered = |parts: &Vec<Part>| parts.iter().map(|[from, to]| to - from).sum::<f64>();
    let all: f64 = lines.iter().map(Piece::length).sum();
    let faces: f64 = taken.iter().map(covered).sum();
    if faces < USUAL * all {
        return None;
    }
    let is_face = |(_, parts): &(&Piece, &Vec<Part>)| !parts.is_empty();
    let (of_walls, others): (Vec<_>, Vec<_>) = lines.iter().zip(&taken).partition(is_face);
    left_out.extend(others.into_iter().map(|(line, _)| line.clone()));
    Some((along_faces(walls, aside), of_walls.len()))
}

/// Joins the parts of a wall along one of its faces, whatever is between them: a door interrupts both faces, another wall that
/// begins there or a hole in a scanned line only one.
fn along_faces(mut parts: Vec<(Piece, [usize; 2])>, aside: f64) -> Vec<Piece> {
    let mut walls = Vec::new();
    while let Some((mut wall, faces)) = parts.pop() {
        let mut faces = faces.to_vec();
        let is_next = |(part, of): &(Piece, [usize; 2]), wall: &Piece, faces: &[usize]| {
            of.iter().any(|face| faces.contains(face))
                && is_one_wall(wall, part, aside, f64::INFINITY)
        };
        while let Some(at) = parts.iter().position(|part| is_next(part, &wall, &faces)) {
            let (part, of) = parts.swap_remove(at);
            wall = union(&wall, &part);
            faces.extend(of);
        }
        walls.push(wall);
    }
    walls
}

fn pairs(lines: &[Piece], aside: f64) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (one, a) in lines.iter().enumerate() {
        for (other, b) in lines.iter().enumerate().skip(one + 1) {
            let ([from, to], distance) = a.shadow(b);
            let (distance, overlap) = (distance.abs(), to.min(a.length()) - from.max(0.0));
            let is_wall = (THICKNESS.0..=THICKNESS.1).contains(&distance)
                && overlap >= SHORTEST
                && overlap >= 0.5 * distance
                // The direction of a short line is uncertain.
                && a.angle(b) <= PARALLEL.max(aside / a.length().min(b.length()));
            if is_wall {
                pairs.push(Pair { faces: [one, other], distance, overlap });
            }
        }
    }
    pairs
}

/// The thickness of most of the walls.
fn typical(pairs: &[Pair]) -> Option<f64> {
    let near = |pair: &Pair| -> f64 {
        let is_near = |other: &&Pair| (other.distance - pair.distance).abs() < SPREAD / 2.0;
        pairs.iter().filter(is_near).map(|other| other.overlap).sum()
    };
    let most = pairs.iter().map(|pair| (near(pair), pair.distance));
    most.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, distance)| distance)
}

/// The parts along `a` in which both lines are beside each other and no other wall has taken them.
fn free(a: &Piece, b: &Piece, of_a: Option<&Vec<Part>>, of_b: Option<&Vec<Part>>) -> Vec<Part> {
    let ([from, to], _) = a.shadow(b);
    let mut free = vec![[from.max(0.0), to.min(a.length())]];
    let taken_of_b = of_b.into_iter().flatten().map(|part| {
        let [one, other] = part.map(|along| a.place(b.at(along, 0.0))[0]);
        [one.min(other), one.max(other)]
    });
    for [begin, end] in of_a.into_iter().flatten().copied().chain(taken_of_b) {
        let cut = |[from, to]: Part| [[from, to.min(begin)], [from.max(end), to]];
        free = free.into_iter().flat_map(cut).collect();
        free.retain(|[from, to]| to - from >= SHORTEST);
    }
    free
}
