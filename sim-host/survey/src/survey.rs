//! The survey: attempts with different wheels, forwards and backwards in time, and the verdict.

use nalgebra::{Vector2, Vector3};
use sonarfix_batch::chain_of_poses::{Chain, Spacing};
use sonarfix_batch::odometry::wrap;
use sonarfix_batch::recording::{Reading, Recording, RecordingError, StartPose};

use crate::novel::novel;
use crate::problem::{DIFFERENCE, Robot, TRACK};
use crate::track::Track;
use crate::walls::{MappedWall, walls};

/// Distances at which the attempts are compared, metres, and how many are kept.
const STAGES: [(f64, usize); 6] = [(4.0, 9), (8.0, 6), (13.0, 4), (20.0, 3), (30.0, 2), (45.0, 1)];
/// Wheel differences to begin with.
const STEP: f64 = 0.005;
const STEPS: i32 = 6;
/// Attempts whose wheel difference and track width differ by less are the same.
const SAME: [f64; 2] = [0.002, 0.015];

/// Largest difference of the paths forwards and backwards of a map that is sure, metres.
const DIFFERS: f64 = 0.1;
/// Smallest share of the echoes that the map explains.
const LEAST_EXPLAINED: f64 = 0.2;
/// Shortest drive, metres.
const SHORTEST: f64 = 5.0;
/// Why there is no map.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurveyError {
    /// The recording cannot be used.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Too short.
    #[error("the robot drives only {0:.1} m: at least 5 m are needed")]
    TooShort(f64),
    /// No walls.
    #[error(
        "no wall was found in {0} echoes: drive along the walls at 0.5 to 2 m from them, slowly, while the sonar sweeps"
    )]
    NoWalls(usize),
}

/// Why a map is not sure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// The paths estimated forwards and backwards in time differ by this, metres.
    Directions(f64),
    /// The map explains this share of the echoes only.
    Explained(f64),
    /// The share of the walls that both directions agree on.
    Confirmed(f64),
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Directions(metres) => write!(
                f,
                "the paths estimated forwards and backwards in time differ by {:.0} cm",
                100.0 * metres
            ),
            Self::Explained(share) => {
                write!(f, "the walls explain only {:.0} % of the echoes", 100.0 * share)
            }
            Self::Confirmed(share) => write!(
                f,
                "only {:.0} % of the walls are found both forwards and backwards in time",
                100.0 * share
            ),
        }
    }
}

/// An echo in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MappedEcho {
    /// Time, seconds.
    pub time: f64,
    /// Position of the sonar.
    pub from: Vector2<f64>,
    /// The place where the echo comes from: the foot on its wall, otherwise on the axis.
    pub place: Vector2<f64>,
    /// Measured minus expected range, metres, of an echo that has a wall.
    pub residual: Option<f64>,
}

/// The result of a survey. Its frame is that of the start pose.
#[derive(Debug, Clone)]
pub struct Survey {
    /// The walls.
    pub walls: Vec<MappedWall>,
    /// Poses: time, pose.
    pub path: Vec<(f64, Vector3<f64>)>,
    /// The echoes.
    pub echoes: Vec<MappedEcho>,
    /// Why the map is not sure; empty if it is.
    pub reasons: Vec<Reason>,
    /// Largest distance between the paths forwards and backwards, metres.
    pub differs: f64,
    /// Where the paths differ by more than 10 cm: times from and to, seconds.
    pub disputed: Option<(f64, f64)>,
    /// Share of the walls' length that both directions agree on.
    pub confirmed: f64,
    /// Echoes that the map explains, and all.
    pub explained: (usize, usize),
    /// Wheel difference, and relative error of the track width.
    pub drive: [f64; 2],
    /// Distance driven, metres.
    pub distance: f64,
}

/// A rigid motion: rotation about the origin, then translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Rotation, radians.
    pub turn: f64,
    /// Translation, metres.
    pub shift: Vector2<f64>,
}

impl Motion {
    /// The motion that maps points onto others with the least sum of squares.
    #[must_use]
    pub fn fit(pairs: &[(Vector2<f64>, Vector2<f64>)]) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "numbers of poses")]
        let count = pairs.len().max(1) as f64;
        let one: Vector2<f64> = pairs.iter().map(|pair| pair.0).sum::<Vector2<f64>>() / count;
        let other: Vector2<f64> = pairs.iter().map(|pair| pair.1).sum::<Vector2<f64>>() / count;
        let (mut dot, mut cross) = (0.0, 0.0);
        for (a, b) in pairs {
            let (a, b) = (a - one, b - other);
            dot += a.dot(&b);
            cross += a.x * b.y - a.y * b.x;
        }
        let motion = Self { turn: cross.atan2(dot), shift: Vector2::zeros() };
        Self { shift: other - motion.of(&one), ..motion }
    }

    /// A point after the motion.
    #[must_use]
    pub fn of(&self, point: &Vector2<f64>) -> Vector2<f64> {
        let (sin, cos) = self.turn.sin_cos();
        Vector2::new(cos * point.x - sin * point.y, sin * point.x + cos * point.y) + self.shift
    }
}

/// Maps a recording.
///
/// # Errors
/// [`SurveyError`].
pub fn survey(recording: &Recording, robot: Robot) -> Result<Survey, SurveyError> {
    recording.check()?;
    let recording = &novel(recording, robot.track_width);
    let first = recording.readings.first().ok_or(RecordingError::NoTravel)?;
    let origin =
        StartPose { time: first.time, pose: Vector3::zeros(), position: 0.0, heading: 0.0 };
    let start = recording.start.unwrap_or(origin);
    let chain_forwards = chain(recording, start.time, &robot).ok_or(RecordingError::NoTravel)?;
    let distance = chain_forwards.distances.last().copied().unwrap_or(0.0);
    if distance < SHORTEST {
        return Err(SurveyError::TooShort(distance));
    }
    let mut cut = recording.clone();
    cut.readings.retain(|reading| reading.time >= start.time);
    let backwards = reversed(&cut);
    let chain_backwards =
        chain(&backwards, f64::NEG_INFINITY, &robot).ok_or(RecordingError::NoTravel)?;
    let no_walls =
        SurveyError::NoWalls(recording.pings.iter().filter(|p| p.range.is_some()).count());
    let forwards =
        track(recording, &chain_forwards, robot, start.pose, None).ok_or(no_walls.clone())?;
    let found =
        [DIFFERENCE, TRACK].map(|k| forwards.state.constants.get(k).copied().unwrap_or(0.0));
    let back = track(&backwards, &chain_backwards, robot, Vector3::zeros(), Some(found))
        .ok_or(no_walls.clone())?;
    let mut one = outcome(&forwards, 1.0);
    let mut other = outcome(&back, -1.0);
    other.path.reverse();
    other.echoes.reverse();
    let pairs = paired(&one.path, &other.path);
    other.apply(&Motion::fit(&swapped(&pairs)));
    let pairs = paired(&one.path, &other.path);
    let differs = pairs.iter().map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let of_one = one.walls.clone();
    compare(&mut one, &other.walls, differs);
    compare(&mut other, &of_one, differs);
    let mut chosen = if back.score() > forwards.score() { other } else { one };
    chosen.differs = differs;
    chosen.disputed = disputed(&chosen.path, &pairs);
    chosen.distance = distance;
    chosen.conclude();
    if chosen.walls.is_empty() { Err(no_walls) } else { Ok(chosen) }
}

type Pairs = Vec<(Vector2<f64>, Vector2<f64>)>;

fn swapped(pairs: &Pairs) -> Pairs {
    pairs.iter().map(|(a, b)| (*b, *a)).collect()
}

/// The positions of one path, and those of another at the same times.
#[must_use]
pub fn paired(one: &[(f64, Vector3<f64>)], other: &[(f64, Vector3<f64>)]) -> Pairs {
    let at = |time: f64| {
        let after = other.partition_point(|(then, _)| *then < time);
        let (t1, to) = other.get(after).or(other.last())?;
        let before = after.checked_sub(1).and_then(|k| other.get(k)).copied();
        let (t0, from) = before.unwrap_or((*t1, *to));
        let share = if *t1 > t0 { ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 0.0 };
        Some(from.xy() + (to.xy() - from.xy()) * share)
    };
    one.iter().filter_map(|(time, pose)| Some((pose.xy(), at(*time)?))).collect()
}

/// When the paths differ by more than 10 cm: first and last time.
fn disputed(path: &[(f64, Vector3<f64>)], pairs: &Pairs) -> Option<(f64, f64)> {
    let mut times = path.iter().zip(pairs).filter(|(_, (a, b))| (a - b).norm() > DIFFERS);
    let first = times.next()?.0.0;
    let last = times.next_back().map_or(first, |((time, _), _)| *time);
    Some((first, last))
}

/// The result of a track; `clock` is −1 for the reversed recording.
fn outcome(track: &Track, clock: f64) -> Survey {
    let chain = track.problem.chain;
    let path = chain.times.iter().zip(&track.state.poses);
    let echo = |k: usize| {
        let sighting = track.sighting(k)?;
        let event = chain.pings.get(k)?;
        let ping = track.problem.recording.pings.get(event.index)?;
        let line = track.problem.matches.get(k).copied().flatten();
        let line = line.and_then(|line| track.state.lines.get(line));
        let (sin, cos) = sighting.direction.sin_cos();
        let place = match line {
            Some(line) => sighting.at + line.normal() * sighting.distance,
            None => sighting.at + Vector2::new(cos, sin) * sighting.distance,
        };
        let residual = line.map(|line| sighting.distance - line.distance(&sighting.at));
        Some(MappedEcho { time: clock * ping.time, from: sighting.at, place, residual })
    };
    Survey {
        walls: walls(track),
        path: path.map(|(time, pose)| (clock * time, *pose)).collect(),
        echoes: (0..chain.pings.len()).filter_map(echo).collect(),
        reasons: Vec::new(),
        differs: 0.0,
        disputed: None,
        confirmed: 0.0,
        explained: track.explained(),
        drive: [DIFFERENCE, TRACK].map(|k| track.state.constants.get(k).copied().unwrap_or(0.0)),
        distance: 0.0,
    }
}

/// Compares the walls with those of the other direction: the accuracy includes half of the difference, because this map
/// explains the recording better. If the paths agree, walls
/// that the other direction does not have are removed.
fn compare(survey: &mut Survey, others: &[MappedWall], differs: f64) {
    let length = |walls: &[MappedWall]| -> f64 { walls.iter().map(MappedWall::length).sum() };
    let all = length(&survey.walls);
    for wall in &mut survey.walls {
        let apart =
            others.iter().filter_map(|other| wall.apart(other)).fold(f64::INFINITY, f64::min);
        wall.is_confirmed = apart <= DIFFERS;
        let half = if wall.is_confirmed { 0.5 * apart } else { DIFFERS };
        wall.accuracy = wall.accuracy.hypot(half);
    }
    let confirmed: Vec<MappedWall> =
        survey.walls.iter().copied().filter(|wall| wall.is_confirmed).collect();
    survey.confirmed = length(&confirmed) / all.max(1e-9);
    if differs <= DIFFERS {
        survey.walls = confirmed;
    }
}

impl Survey {
    /// Moves everything.
    pub fn apply(&mut self, motion: &Motion) {
        for wall in &mut self.walls {
            wall.from = motion.of(&wall.from);
            wall.to = motion.of(&wall.to);
        }
        for (_, pose) in &mut self.path {
            let at = motion.of(&pose.xy());
            *pose = Vector3::new(at.x, at.y, wrap(pose.z + motion.turn));
        }
        for echo in &mut self.echoes {
            echo.from = motion.of(&echo.from);
            echo.place = motion.of(&echo.place);
        }
    }

    /// Multiplies all lengths, so that a wall that was measured has its length.
    pub fn scale(&mut self, by: f64) {
        for wall in &mut self.walls {
            wall.from *= by;
            wall.to *= by;
        }
        for (_, pose) in &mut self.path {
            pose.x *= by;
            pose.y *= by;
        }
        for echo in &mut self.echoes {
            echo.from *= by;
            echo.place *= by;
        }
    }

    /// Whether the map is sure.
    #[must_use]
    pub fn is_sure(&self) -> bool {
        self.reasons.is_empty()
    }

    /// Determines the reasons not to be sure.
    fn conclude(&mut self) {
        const AGREED: f64 = 0.7;
        if self.differs > DIFFERS {
            self.reasons.push(Reason::Directions(self.differs));
        }
        #[expect(clippy::cast_precision_loss, reason = "numbers of echoes")]
        let share = self.explained.0 as f64 / self.explained.1.max(1) as f64;
        if share < LEAST_EXPLAINED {
            self.reasons.push(Reason::Explained(share));
        }
        if self.confirmed < AGREED {
            self.reasons.push(Reason::Confirmed(self.confirmed));
        }
    }
}

/// The chain of a recording: a pose every 20 cm or 15°.
#[must_use]
pub fn chain(recording: &Recording, from: f64, robot: &Robot) -> Option<Chain> {
    Chain::build(
        recording,
        from,
        Spacing { travel: 0.2, turn: 0.26 * robot.track_width, at_echoes: false },
    )
}

/// The map of a recording in its order. `known` is one more attempt: wheel difference and error of the track width.
#[must_use]
pub fn track<'a>(
    recording: &'a Recording,
    chain: &'a Chain,
    robot: Robot,
    start: Vector3<f64>,
    known: Option<[f64; 2]>,
) -> Option<Track<'a>> {
    let steps = (-STEPS..=STEPS).map(|step| [f64::from(step) * STEP, 0.0]);
    let mut tracks: Vec<Track> =
        steps.chain(known).map(|drive| Track::new(recording, chain, robot, start, drive)).collect();
    for (distance, count) in STAGES {
        for track in &mut tracks {
            track.run(distance);
            track.solve_whole();
        }
        tracks = best(tracks, count);
    }
    let mut track = tracks.into_iter().next()?;
    track.run(f64::INFINITY);
    track.finish();
    Some(track)
}

/// The attempts with the highest scores, without those that have become the same.
fn best(tracks: Vec<Track>, count: usize) -> Vec<Track> {
    let mut scored: Vec<(f64, Track)> =
        tracks.into_iter().map(|track| (track.score(), track)).collect();
    scored.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut kept: Vec<Track> = Vec::new();
    for (_, track) in scored {
        let is_same = |other: &Track| {
            let differs = |k: usize, by: f64| {
                let [one, other] =
                    [&track, other].map(|track| track.state.constants.get(k).copied());
                one.zip(other).is_some_and(|(one, other)| (one - other).abs() > by)
            };
            !differs(DIFFERENCE, SAME[0]) && !differs(TRACK, SAME[1])
        };
        if kept.len() < count && !kept.iter().any(is_same) {
            kept.push(track);
        }
    }
    kept
}

/// The same drive backwards in time.
#[must_use]
pub fn reversed(recording: &Recording) -> Recording {
    let mut backwards = recording.clone();
    backwards.references.clear();
    backwards.start = None;
    backwards.readings =
        recording.readings.iter().rev().map(|r| Reading { time: -r.time, ..*r }).collect();
    backwards.pings.reverse();
    for ping in &mut backwards.pings {
        ping.time = -ping.time;
    }
    backwards
}
