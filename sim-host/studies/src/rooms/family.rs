//! Families of rooms: a seed gives the same room, path and true robot on every machine.

use std::fmt::Write;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{FileError, Scenario};

/// The tables that are the same for every room.
const ROBOT: &str = include_str!("scenario.toml");
/// How long a run lasts, seconds; whole laps, so that it is a little longer.
const DURATION: f64 = 600.0;
/// The robot's speed, m/s, and the duration of a turn of 90°, seconds.
const SPEED: f64 = 0.2;
const QUARTER_TURN: f64 = 2.0;

/// Largest true errors of the robot: of a wheel's scale, and of the track width, metres.
const SCALE: f64 = 0.01;
const TRACK_WIDTH: f64 = 0.12;
const TRACK_WIDTH_ERROR: f64 = 0.0036;
/// Air that the driver of the sonar assumes, °C, and how far it is off at most.
const ROOM: f64 = 20.0;
const COLDER_OR_WARMER: f64 = 6.0;

type Point = [f64; 2];

/// A family of rooms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// An L of 4 m to 6 m.
    Corner,
    /// A field of 1.5 m to 2.5 m for games and races.
    Arena,
    /// A closed corridor, 1.6 m to 2.2 m wide and 8 m to 12 m long.
    Corridor,
    /// A hall of 8 m to 12 m, whose opposite walls are out of range.
    Hall,
    /// A room with four walls of which no two are parallel or square.
    Slanted,
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Corner, Self::Arena, Self::Corridor, Self::Hall, Self::Slanted];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Corner => "L-room",
            Self::Arena => "arena",
            Self::Corridor => "corridor",
            Self::Hall => "hall",
            Self::Slanted => "slanted walls",
        }
    }

    /// The corners of the room and of the path, metres.
    fn outline(self, rng: &mut ChaCha8Rng) -> (Vec<Point>, Vec<Point>) {
        let mut between = |least: f64, most: f64| rng.random_range(least..most);
        match self {
            Self::Corner => {
                let (w, h) = (between(4.0, 6.0), between(4.0, 6.0));
                let (x, y) = (between(0.4, 0.6) * w, between(0.4, 0.6) * h);
                let room = vec![[0.0, 0.0], [w, 0.0], [w, y], [x, y], [x, h], [0.0, h]];
                let (u, v) = (0.5 * x, 0.5 * y);
                (room, vec![[u, v], [w - u, v], [u, v], [u, h - v]])
            }
            Self::Arena => rectangle(between(1.5, 2.5), between(1.5, 2.5), 0.4),
            Self::Corridor => rectangle(between(8.0, 12.0), between(1.6, 2.2), 0.5),
            Self::Hall => rectangle(between(8.0, 12.0), between(8.0, 12.0), between(1.0, 2.0)),
            Self::Slanted => {
                let (w, h) = (between(3.5, 6.0), between(3.5, 6.0));
                let mut bent = || between(0.03, 0.2);
                let (a, b, c, d) = (bent() * h, bent() * w, bent() * h, bent() * w);
                let room = vec![[0.0, 0.0], [w, -a], [w - b, h + c], [d, h]];
                let path = vec![
                    [0.3 * w, 0.25 * h],
                    [0.7 * w, 0.25 * h],
                    [0.7 * w, 0.75 * h],
                    [0.3 * w, 0.75 * h],
                ];
                (room, path)
            }
        }
    }

    /// The room of a seed as the text of a scenario.
    #[must_use]
    pub fn toml(self, seed: u64) -> String {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (room, path) = self.outline(&mut rng);
        let mut text = String::new();
        // Writing to a String does not fail.
        let _ = write_scenario(&mut text, (self.name(), seed), &room, &path, &mut rng);
        text
    }

    /// The room of a seed.
    ///
    /// # Errors
    /// [`FileError`], if the scenario is invalid.
    pub fn scenario(self, seed: u64) -> Result<Scenario, FileError> {
        let name = format!("{} {seed}", self.name());
        Scenario::parse(&self.toml(seed), &name, std::path::Path::new(""))
    }
}

/// A room and a path at a distance from its walls.
fn rectangle(w: f64, h: f64, inside: f64) -> (Vec<Point>, Vec<Point>) {
    let corners = |d: f64| vec![[d, d], [w - d, d], [w - d, h - d], [d, h - d]];
    (corners(0.0), corners(inside))
}

fn write_scenario(
    text: &mut String,
    (name, seed): (&str, u64),
    room: &[Point],
    path: &[Point],
    rng: &mut ChaCha8Rng,
) -> std::fmt::Result {
    writeln!(text, "format = 1\nname = \"{name} {seed}\"\nfidelity = \"pins\"")?;
    writeln!(text, "description = \"The {name} of seed {seed}\"\n\n[map]\nunit = \"m\"\nwall = [")?;
    for (n, (from, to)) in closed(room).enumerate() {
        writeln!(text, "    {{ name = \"wall {n}\", from = {}, to = {} }},", at(from), at(to))?;
    }
    let (first, others) = path.split_first().unwrap_or((&[0.0; 2], &[]));
    let corners: Vec<String> = others.iter().chain([first]).map(at).collect();
    let metres: f64 = closed(path).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
    let lap = metres / SPEED + QUARTER_TURN * 4.0;
    let laps = (DURATION / lap).ceil();
    writeln!(text, "]\n\n[path]\nunit = \"m\"\nstart = {}\nclearance = \"20 cm\"", at(first))?;
    writeln!(text, "corners = [{}]\nlaps = {laps}", corners.join(", "))?;
    writeln!(text, "speed = \"{SPEED} m/s\"\nturn_rate = \"45 deg/s\"\nfollow = \"estimate\"\n")?;
    write_truth(text, rng)?;
    text.push_str(ROBOT);
    Ok(())
}

/// The walks and, with slips and bumps by variance, the noise of the wheels are those that the robot file assumes.
fn write_truth(text: &mut String, rng: &mut ChaCha8Rng) -> std::fmt::Result {
    let mut within = |most: f64| rng.random_range(-most..most);
    let width = TRACK_WIDTH + within(TRACK_WIDTH_ERROR);
    let (right, left) = (within(SCALE), within(SCALE));
    let celsius = ROOM + within(COLDER_OR_WARMER);
    writeln!(text, "[truth]\ntrack_width = \"{width:.5} m\"")?;
    writeln!(text, "scale_right = {right:.5}\nscale_left = {left:.5}\nrange_scale = \"0 %\"")?;
    writeln!(text, "wheel_noise = \"2 mm/sqrt(m)\"\nscale_walk = \"1e-4 /sqrt(m)\"")?;
    writeln!(text, "slip = {{ every = \"20 m\", by = \"3 mm\" }}")?;
    writeln!(text, "bump = {{ every = \"20 m\", by = \"3 mm\" }}")?;
    writeln!(text, "track_width_walk = \"2e-5 m/sqrt(m)\"\nrange_noise = \"3 mm\"")?;
    writeln!(text, "range_noise_per_metre = \"0 mm/m\"\ncone = \"15 deg\"\n")?;
    writeln!(text, "[world]\ntemperature = \"{celsius:.1} degC\"\n")
}

/// The sides of a polygon.
fn closed(corners: &[Point]) -> impl Iterator<Item = (&Point, &Point)> {
    corners.iter().zip(corners.iter().cycle().skip(1))
}

fn at([x, y]: &Point) -> String {
    format!("[{x:.3}, {y:.3}]")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_gives_valid_rooms_that_differ_by_seed() {
        for family in Family::ALL {
            for seed in 0..20 {
                let scenario = family.scenario(seed).unwrap();
                assert!(scenario.path.duration() >= DURATION, "{} {seed}", family.name());
            }
            assert_ne!(family.toml(0), family.toml(1));
            assert_eq!(family.toml(7), family.toml(7));
        }
    }
}
