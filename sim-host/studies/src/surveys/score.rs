//! A map of a survey compared with the true walls.

use std::fmt::Write as _;

use nalgebra::Vector2;
use sonarfix_map::Outline;
use sonarfix_sim::simulate::Simulation;
use sonarfix_sim::trace::Pose;
use sonarfix_survey::survey::Survey;

use crate::floor_plan::compare::quantile;
use crate::sweeping_robot::Drive;

/// Distance between the samples of a wall, metres.
const SAMPLE: f64 = 0.05;
/// Largest distance of a mapped wall from the true one, metres.
const NEAR: f64 = 0.1;
/// Farthest wall that counts as hearable, metres.
const HEARABLE: f64 = 2.5;
/// Largest angle between a mapped wall and the true one: its cosine.
const PARALLEL: f64 = 0.996;

type Point = Vector2<f64>;

/// What a map is worth.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Score {
    /// True walls of which at least 30 cm are hearable: found (half of that) and all.
    pub walls: [usize; 2],
    /// Hearable length of the true walls: found and all, metres.
    pub hearable: [f64; 2],
    /// Root mean square and largest distance of the mapped walls from the true ones, metres.
    pub offset: [f64; 2],
    /// Largest angle of a mapped wall of 50 cm to the true one, radians.
    pub angle: f64,
    /// Share of the mapped length that is not within 10 cm of anything real.
    pub invented: f64,
    /// Median distance of a mapped corner from the true one, metres.
    pub corners: Option<f64>,
    /// Root mean square and largest error of the path, metres.
    pub path: [f64; 2],
    /// Largest difference of the paths forwards and backwards, metres.
    pub differs: f64,
    /// Whether the survey calls the map sure.
    pub is_sure: bool,
    /// Position RMS of a drive on the map, metres, and whether the robot was lost at its end.
    pub localized: (f64, bool),
}

/// A true surface.
#[derive(Debug, Clone, Copy)]
struct Surface {
    from: Point,
    to: Point,
}

impl Surface {
    fn along(&self) -> Point {
        (self.to - self.from).normalize()
    }

    fn length(&self) -> f64 {
        (self.to - self.from).norm()
    }

    fn distance(&self, point: &Point) -> f64 {
        let at = self.along().dot(&(point - self.from)).clamp(0.0, self.length());
        (self.from + self.along() * at - point).norm()
    }

    /// Points every 5 cm.
    fn samples(&self) -> impl Iterator<Item = Point> + '_ {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some metres")]
        let count = (self.length() / SAMPLE).ceil().max(1.0) as u32;
        (0..count).map(move |k| {
            let share = (f64::from(k) + 0.5) / f64::from(count);
            self.from + (self.to - self.from) * share
        })
    }

    fn is_parallel(&self, other: &Self) -> bool {
        self.along().dot(&other.along()).abs() > PARALLEL
    }

    /// Whether a straight path crosses it.
    fn blocks(&self, from: &Point, to: &Point) -> bool {
        let side = |a: &Point, b: &Point, c: &Point| (b - a).perp(&(c - a));
        side(&self.from, &self.to, from) * side(&self.from, &self.to, to) < 0.0
            && side(from, to, &self.from) * side(from, to, &self.to) < 0.0
    }
}

/// The true position at a time.
pub(super) fn true_position(truth: &[(f64, Pose)], time: f64) -> Option<Point> {
    let after = truth.partition_point(|(then, _)| *then < time - 1e-6);
    truth.get(after).or(truth.last()).map(|(_, pose)| Point::new(pose.x, pose.y))
}

impl Score {
    /// The score of a map in the true frame.
    pub(super) fn of(map: &Survey, drive: &Drive, simulation: &Simulation) -> Self {
        let named = simulation.scenario.floor.named_walls();
        let walls: Vec<Surface> = named
            .iter()
            .map(|wall| Surface { from: wall.from().into(), to: wall.to().into() })
            .collect();
        let mapped: Vec<Surface> =
            map.walls.iter().map(|wall| Surface { from: wall.from, to: wall.to }).collect();
        let mut score = Self {
            differs: map.differs,
            is_sure: map.is_sure(),
            path: path_errors(map, drive),
            ..Self::default()
        };
        let mut hiding = standing(simulation);
        hiding.extend(&walls);
        score.find_walls(&walls, &mapped, &hiding, &stations(drive, simulation));
        score.measure_errors(&walls, &mapped);
        score.invented = invented(&walls, &mapped, simulation);
        score.corners = corners(&walls, map);
        score
    }

    fn find_walls(
        &mut self,
        walls: &[Surface],
        mapped: &[Surface],
        hiding: &[Surface],
        stations: &[(Point, f64)],
    ) {
        const LONG: f64 = 0.3;
        for wall in walls {
            let heard: Vec<Point> =
                wall.samples().filter(|point| is_hearable(wall, point, hiding, stations)).collect();
            let is_found = |point: &&Point| {
                mapped.iter().any(|other| wall.is_parallel(other) && other.distance(point) < NEAR)
            };
            let found = heard.iter().filter(is_found).count();
            #[expect(clippy::cast_precision_loss, reason = "numbers of samples")]
            let [found, all] = [found, heard.len()].map(|count| count as f64 * SAMPLE);
            self.hearable = [self.hearable[0] + found, self.hearable[1] + all];
            if all >= LONG {
                self.walls[1] += 1;
                self.walls[0] += usize::from(found >= 0.5 * all);
            }
        }
    }

    fn measure_errors(&mut self, walls: &[Surface], mapped: &[Surface]) {
        let (mut squares, mut count) = (0.0, 0.0);
        for wall in mapped {
            for point in wall.samples() {
                let near = walls.iter().filter(|other| wall.is_parallel(other));
                let distance =
                    near.map(|other| other.distance(&point)).fold(f64::INFINITY, f64::min);
                if distance < NEAR {
                    squares += distance * distance;
                    count += 1.0;
                    self.offset[1] = self.offset[1].max(distance);
                }
            }
            let middle = (wall.from + wall.to) * 0.5;
            let same = walls.iter().find(|o| wall.is_parallel(o) && o.distance(&middle) < NEAR);
            if let Some(same) = same.filter(|_| wall.length() >= 0.5) {
                let angle = wall.along().perp(&same.along()).abs().asin();
                self.angle = self.angle.max(angle);
            }
        }
        self.offset[0] = (squares / f64::max(count, 1.0)).sqrt();
    }

    /// The cells of the table.
    pub(super) fn row(&self) -> String {
        let cm = |metres: f64| format!("{:.1}", 100.0 * metres);
        let (rms, is_lost) = self.localized;
        format!(
            "{} of {} | {:.0} % of {:.1} m | {}, {} | {:.2} | {:.0} % | {} | {}, {} | {} | {} | {:.1}{} |",
            self.walls[0],
            self.walls[1],
            100.0 * self.share(),
            self.hearable[1],
            cm(self.offset[0]),
            cm(self.offset[1]),
            self.angle.to_degrees(),
            100.0 * self.invented,
            self.corners.map_or_else(|| "–".to_owned(), cm),
            cm(self.path[0]),
            cm(self.path[1]),
            cm(self.differs),
            if self.is_sure { "sure" } else { "unsure" },
            1e3 * rms,
            if is_lost { ", lost" } else { "" },
        )
    }

    /// Found share of the hearable length.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.hearable[0] / self.hearable[1].max(1e-9)
    }

    /// Whether the map is wrong by more than 10 cm: its path is.
    #[must_use]
    pub fn is_wrong(&self) -> bool {
        self.path[1] > NEAR
    }
}

/// Root mean square and maximum.
fn path_errors(map: &Survey, drive: &Drive) -> [f64; 2] {
    let (mut squares, mut most, mut count) = (0.0, 0.0_f64, 0.0);
    for (time, pose) in &map.path {
        if let Some(truth) = true_position(&drive.truth, *time) {
            let error = (pose.xy() - truth).norm();
            squares += error * error;
            most = most.max(error);
            count += 1.0;
        }
    }
    [(squares / f64::max(count, 1.0)).sqrt(), most]
}

/// Where the sonar was, twice a second, and its heading.
fn stations(drive: &Drive, simulation: &Simulation) -> Vec<(Point, f64)> {
    const EVERY: usize = 5;
    let end = drive.recording.readings.last().map_or(0.0, |reading| reading.time);
    let driven = drive.truth.iter().take_while(|(time, _)| *time <= end).step_by(EVERY);
    let station = |(_, pose): &(f64, Pose)| {
        let at = simulation.sonar_at(pose);
        (Point::from(at), pose.heading)
    };
    driven.map(station).collect()
}

/// The furniture that stands still; a round piece as its two diameters along x and y.
fn standing(simulation: &Simulation) -> Vec<Surface> {
    let obstacles = &simulation.scenario.surroundings.obstacles;
    let mut surfaces = Vec::new();
    for obstacle in obstacles.iter().filter(|obstacle| obstacle.walk.is_none()) {
        match obstacle.outline {
            Outline::Face { from, to } => {
                surfaces.push(Surface { from: from.into(), to: to.into() });
            }
            Outline::Circle { centre, radius } => {
                let centre = Point::from(centre);
                for by in [Point::new(radius, 0.0), Point::new(0.0, radius)] {
                    surfaces.push(Surface { from: centre - by, to: centre + by });
                }
            }
        }
    }
    surfaces
}

/// Whether a point of a wall was the foot of the perpendicular from some station, in reach and in sight.
fn is_hearable(
    wall: &Surface,
    point: &Point,
    hiding: &[Surface],
    stations: &[(Point, f64)],
) -> bool {
    const BEARING: f64 = 1.75;
    stations.iter().any(|(at, heading)| {
        let apart = point - at;
        let distance = apart.norm();
        let bearing = sonarfix_sim::angle::wrap(apart.y.atan2(apart.x) - heading);
        apart.dot(&wall.along()).abs() < SAMPLE
            && (0.15..HEARABLE).contains(&distance)
            && bearing.abs() < BEARING
            && !hiding.iter().any(|other| other.blocks(at, &(at + apart * (1.0 - 0.02 / distance))))
    })
}

/// Share of the mapped length that is not near anything real that stands still.
fn invented(walls: &[Surface], mapped: &[Surface], simulation: &Simulation) -> f64 {
    let obstacles = &simulation.scenario.surroundings.obstacles;
    let standing = obstacles.iter().filter(|obstacle| obstacle.walk.is_none());
    let outlines: Vec<Outline> = standing.map(|obstacle| obstacle.outline).collect();
    let is_real = |point: &Point| {
        let of_outline = |outline: &Outline| match *outline {
            Outline::Circle { centre, radius } => {
                ((point - Point::from(centre)).norm() - radius).abs()
            }
            Outline::Face { from, to } => {
                Surface { from: from.into(), to: to.into() }.distance(point)
            }
        };
        walls.iter().any(|wall| wall.distance(point) < NEAR)
            || outlines.iter().any(|outline| of_outline(outline) < NEAR)
    };
    let (mut all, mut wrong) = (0_u32, 0_u32);
    for point in mapped.iter().flat_map(Surface::samples) {
        all += 1;
        wrong += u32::from(!is_real(&point));
    }
    f64::from(wrong) / f64::from(all.max(1))
}

/// Median distance of the mapped corners from the nearest end of a true wall.
fn corners(walls: &[Surface], map: &Survey) -> Option<f64> {
    let ends: Vec<Point> = walls.iter().flat_map(|wall| [wall.from, wall.to]).collect();
    let mut errors: Vec<f64> = Vec::new();
    for wall in &map.walls {
        for (end, is_corner) in [wall.from, wall.to].iter().zip(wall.corners) {
            if is_corner {
                let apart = ends.iter().map(|other| (other - end).norm());
                errors.push(apart.fold(f64::INFINITY, f64::min));
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() / 2).copied()
}

/// What all drives amount to, as a table.
pub(super) fn summary(drives: usize, scores: &[&Score]) -> String {
    let count = |is: &dyn Fn(&Score) -> bool| scores.iter().filter(|score| is(score)).count();
    let sure = count(&|score| score.is_sure);
    // Median and extreme: the quantiles 0.5 and `worst`.
    let over_sure = |of: &dyn Fn(&Score) -> f64, worst: f64, decimals: usize| {
        let of_sure = scores.iter().filter(|score| score.is_sure).map(|score| of(score));
        let values: Vec<f64> = of_sure.collect();
        let [median, extreme] = [0.5, worst].map(|share| quantile(values.clone(), share));
        format!("{median:.decimals$}; {extreme:.decimals$}")
    };
    let rows = [
        ("maps; sure ones".to_owned(), format!("{}; {sure}", scores.len())),
        (
            "path wrong by more than 10 cm: sure maps; unsure ones".to_owned(),
            format!(
                "{}; {}",
                count(&|score| score.is_sure && score.is_wrong()),
                count(&|score| !score.is_sure && score.is_wrong())
            ),
        ),
        (
            "sure maps with all walls; with at least 70 % of the hearable length".to_owned(),
            format!(
                "{}; {}",
                count(&|score| score.is_sure && score.walls[0] == score.walls[1]),
                count(&|score| score.is_sure && score.share() >= 0.7)
            ),
        ),
        (
            "their hearable length found, median; least, %".to_owned(),
            over_sure(&|score| 100.0 * score.share(), 0.0, 0),
        ),
        (
            "their path, RMS, median; largest, cm".to_owned(),
            over_sure(&|score| 100.0 * score.path[0], 1.0, 1),
        ),
        (
            "their walls' offset, RMS, median; largest, cm".to_owned(),
            over_sure(&|score| 100.0 * score.offset[0], 1.0, 1),
        ),
        (
            "their invented length, median; largest, %".to_owned(),
            over_sure(&|score| 100.0 * score.invented, 1.0, 0),
        ),
        (
            "localized on them, RMS, median; largest, mm".to_owned(),
            over_sure(&|score| 1e3 * score.localized.0, 1.0, 0),
        ),
        (
            "lost on them at the end".to_owned(),
            count(&|score| score.is_sure && score.localized.1).to_string(),
        ),
    ];
    let mut table = format!("| of {drives} drives | |\n|---|---|\n");
    for (what, value) in rows {
        // Writing to a String does not fail.
        let _ = writeln!(table, "| {what} | {value} |");
    }
    table
}
