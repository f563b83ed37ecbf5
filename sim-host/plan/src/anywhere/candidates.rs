//! Places of a board, chosen by the log odds that it adds between the poses that starts confused.

use rayon::prelude::*;
use sonarfix_map::{Addition, Collision, Floor, NamedWall, PathPlan, PlacedAddition, along_walls};
use sonarfix_sim::trace::Pose;
use sonarfix_sim::world::World;
use sonarfix_sim::world::segment::{direction, distance};

use super::separation::Sweeps;
use super::settings::Settings;
use super::start::{Place, Start};
use crate::trial::PERIOD;
use sonarfix_search::search::SearchParameters;

/// The board: metres from the wall.
const BOARD: Addition = Addition::Board { depth: 0.4 };
/// Distance of the places along a wall at which it is tried, metres.
const APART: f64 = 0.5;
/// Room that it leaves to the wall opposite, in widths of the robot.
const PASSAGE: f64 = 2.0;
/// Boards that are simulated, and their distance from each other, metres.
const FINALISTS: usize = 3;
const FINALISTS_APART: f64 = 1.0;
/// The share of the expected log odds that a search gets: only novel pings count, and furniture hides walls.
const GAINED: f64 = 0.5;
/// Pings of a sweep.
const SWEEP: f64 = 21.0;
/// Seconds that one ambiguity lasts at most: two periods of the record.
const LONGEST: f64 = 2.0;

/// The ambiguities of one start, and how long they last.
struct Ambiguities<'a> {
    start: &'a Start,
    /// Seconds of search.
    end: f64,
    /// For each ambiguity and each of its wrong hypotheses the log odds of a sweep without a board.
    log_odds: Vec<Vec<f64>>,
}

/// The boards that end most of the confusions, apart from each other.
pub(super) fn finalists(
    place: &Place<'_>,
    starts: &[Start],
    path: Option<&PathPlan>,
    settings: &Settings,
) -> Vec<PlacedAddition> {
    let sweeps = Sweeps::new(place.scenario, &place.floor);
    let each = starts.par_iter().map(|start| Ambiguities::new(start, &sweeps, settings));
    let ambiguities: Vec<Ambiguities> = each.collect();
    // The lead of a unique answer (`docs/search.md`).
    let lead = f64::from(SearchParameters::default().odds);
    let world = World::new(&place.floor);
    let boards = along_walls(&place.floor, BOARD, APART);
    let boards = boards.into_par_iter().filter(|board| is_placeable(board, place, &world, path));
    let mut scored: Vec<(f64, PlacedAddition)> = boards
        .map(|board| {
            let with = Sweeps::new(place.scenario, &board.on(&place.floor));
            let saved = ambiguities.iter().map(|of| of.saved(&board, &with, lead)).sum();
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

impl<'a> Ambiguities<'a> {
    fn new(start: &'a Start, sweeps: &Sweeps, settings: &Settings) -> Self {
        let log_odds = start
            .ambiguities
            .iter()
            .map(|at| at.wrong.iter().map(|wrong| sweeps.log_odds(&at.truth, wrong)).collect());
        Self { start, end: settings.search_time(start), log_odds: log_odds.collect() }
    }

    /// The seconds of search that a board is expected to save, by the sweeps `with` it: until it has added so much to the lead.
    fn saved(&self, board: &PlacedAddition, with: &Sweeps, needed: f64) -> f64 {
        let is_in_reach = |pose: &Pose| distance([pose.x, pose.y], board.at) <= with.reach();
        let (mut lead, mut last) = (0.0, 0.0);
        for (at, without) in self.start.ambiguities.iter().zip(&self.log_odds) {
            let gains = at.wrong.iter().zip(without).map(|(wrong, without)| {
                if !is_in_reach(&at.truth) && !is_in_reach(wrong) {
                    return 0.0;
                }
                with.log_odds(&at.truth, wrong) - without
            });
            // The mean, because some of several hypotheses fit badly, and later pings end them without a board.
            let gain = gains.sum::<f64>() / count(without);
            let seconds = (at.time - last).min(LONGEST);
            last = at.time;
            lead += GAINED * gain.max(0.0) * seconds / (SWEEP * PERIOD);
            if lead >= needed {
                return (self.end - at.time).max(0.0);
            }
        }
        0.0
    }
}

#[expect(clippy::cast_precision_loss, reason = "some hypotheses")]
fn count(of: &[f64]) -> f64 {
    of.len() as f64
}
