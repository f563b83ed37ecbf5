//! Places of a board, chosen by what it tells between the poses that starts confused.

use rayon::prelude::*;
use sonarfix_map::{Addition, Collision, Floor, NamedWall, PathPlan, PlacedAddition, along_walls};
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::World;
use sonarfix_sim::world::segment::{direction, distance};

use super::separation::Ears;
use super::settings::Settings;
use super::start::{Place, Start};
use crate::trial::PERIOD;

/// The board: metres from the wall.
const BOARD: Addition = Addition::Board { depth: 0.4 };
/// Distance of the places along a wall at which it is tried, metres.
const APART: f64 = 0.5;
/// Room that it leaves to the wall opposite, in widths of the robot.
const PASSAGE: f64 = 2.0;
/// Boards that are simulated, and their distance from each other, metres.
const FINALISTS: usize = 3;
const FINALISTS_APART: f64 = 1.0;
/// Lead of a unique answer (`docs/search.md`), and the share of the expected log odds that a search gets: pings that are no news
/// do not count, and furniture hides walls.
const LEAD: f64 = 24.0;
const GAINED: f64 = 0.5;
/// Pings of a sweep.
const SWEEP: f64 = 21.0;
/// The confusions of one start, and how long they last.
struct Doubts<'a> {
    start: &'a Start,
    end: f64,
    /// For each doubt and each of its rivals the evidence of a sweep without a board.
    evidence: Vec<Vec<f64>>,
}

/// The boards that end most of the confusions, apart from each other.
pub(super) fn finalists(
    place: &Place<'_>,
    starts: &[Start],
    path: Option<&PathPlan>,
    settings: &Settings,
) -> Vec<PlacedAddition> {
    let ears = Ears::new(place.scenario, &place.floor);
    let doubts: Vec<Doubts> =
        starts.par_iter().map(|start| Doubts::new(start, &ears, settings)).collect();
    let world = World::new(&place.floor);
    let boards = along_walls(&place.floor, BOARD, APART);
    let boards = boards.into_par_iter().filter(|board| is_placeable(board, place, &world, path));
    let mut scored: Vec<(f64, PlacedAddition)> = boards
        .map(|board| {
            let with = Ears::new(place.scenario, &board.on(&place.floor));
            let saved = doubts.iter().map(|doubts| doubts.saved(&board, &with)).sum();
            (saved, board)
        })
        .filter(|(saved, _)| *saved > 0.0)
        .collect();
    scored.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    let mut chosen: Vec<PlacedAddition> = Vec::new();
    for (_, board) in scored {
        let is_apart = |other: &PlacedAddition| distance(other.at, board.at) >= FINALISTS_APART;
        if chosen.len() < FINALISTS && chosen.iter().all(is_apart) {
            chosen.push(board);
        }
    }
    chosen
}

/// Whether a board stands in the free space, leaves room to pass, and is clear of a path.
fn is_placeable(
    board: &PlacedAddition,
    place: &Place<'_>,
    world: &World,
    path: Option<&PathPlan>,
) -> bool {
    let Some([_, end]) = board.faces.first().copied() else { return false };
    let is_inside = place.space.part(place.space.cell_at(end)).is_some();
    let passage = PASSAGE * 2.0 * place.clearance();
    let ahead = world.on_axis(end, direction(board.at, end));
    let leaves_room = ahead.is_none_or(|(_, wall)| distance(end, wall) >= passage);
    let faces = board
        .faces
        .iter()
        .filter_map(|[from, to]| NamedWall::new("board".to_owned(), *from, *to).ok());
    let faces = Floor::new(faces.collect());
    let is_clear =
        path.is_none_or(|path| Collision::first(path, &faces, place.clearance()).is_none());
    is_inside && leaves_room && is_clear
}

impl<'a> Doubts<'a> {
    fn new(start: &'a Start, ears: &Ears, settings: &Settings) -> Self {
        let evidence = start.doubts.iter().map(|doubt| {
            doubt.rivals.iter().map(|rival| ears.evidence(&doubt.truth, rival)).collect()
        });
        Self { start, end: settings.lost(start), evidence: evidence.collect() }
    }

    /// The seconds of confusion that a board is expected to save, `with` which the sonar hears.
    fn saved(&self, board: &PlacedAddition, with: &Ears) -> f64 {
        let is_heard = |pose: &Pose| distance([pose.x, pose.y], board.at) <= with.reach();
        let (mut lead, mut last) = (0.0, 0.0);
        for (doubt, without) in self.start.doubts.iter().zip(&self.evidence) {
            let gains = doubt.rivals.iter().zip(without).map(|(rival, without)| {
                if !is_heard(&doubt.truth) && !is_heard(rival) {
                    return 0.0;
                }
                with.evidence(&doubt.truth, rival) - without
            });
            // Some of several hypotheses are those of a bad fit, which end by themselves.
            let gain = gains.sum::<f64>() / count(without);
            let seconds = (doubt.time - last).min(2.0);
            last = doubt.time;
            lead += GAINED * gain.max(0.0) * seconds / (SWEEP * PERIOD);
            if lead >= LEAD {
                return (self.end - doubt.time).max(0.0);
            }
        }
        0.0
    }
}

#[expect(clippy::cast_precision_loss, reason = "some hypotheses")]
fn count(of: &[f64]) -> f64 {
    of.len() as f64
}
