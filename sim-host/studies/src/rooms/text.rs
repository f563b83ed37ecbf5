//! A room as the text of a scenario.

use std::fmt::Write;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_map::{Obstacle, Outline};

use super::family::Room;
use super::objects::Scene;
use super::polygon::{Point, Side, length, sides};

/// How long a run lasts, seconds; whole laps, so that it is a little longer.
pub(super) const DURATION: f64 = 600.0;
/// The robot's speed, m/s, and the duration of a turn of 90°, seconds.
const SPEED: f64 = 0.2;
const QUARTER_TURN: f64 = 2.0;

/// Largest true errors of the robot: of a wheel's scale, and of the track width, metres.
const SCALE: f64 = 0.01;
const TRACK_WIDTH: f64 = 0.12;
const TRACK_WIDTH_ERROR: f64 = 0.0036;
/// Air that the driver of the sonar assumes, °C, and how far it is off at most.
const AIR: f64 = 20.0;
const COLDER_OR_WARMER: f64 = 6.0;

/// The map of the robot's software, as the text of a map file.
pub(super) fn map(walls: &[Side]) -> String {
    let mut text = "format = 1\n".to_owned();
    // Writing to a String does not fail.
    let _ = write_map(&mut text, walls);
    text
}

/// A room as the text of a scenario without the tables of robot and sensor; the errors of the robot are drawn here.
pub(super) fn scenario(name: &str, room: &Room, scene: &Scene, rng: &mut ChaCha8Rng) -> String {
    let mut text = format!(
        "format = 1\nname = \"{name}\"\nfidelity = \"pins\"\ndescription = \"The {name}\"\n\n"
    );
    // Writing to a String does not fail.
    let _ = write_map(&mut text, &scene.walls);
    let _ = write_path(&mut text, &room.path);
    let _ = write_truth(&mut text, rng);
    let _ = write_world(&mut text, &scene.obstacles, rng);
    text
}

fn write_map(text: &mut String, walls: &[Side]) -> std::fmt::Result {
    writeln!(text, "[map]\nunit = \"m\"\nwall = [")?;
    for (n, [from, to]) in walls.iter().enumerate() {
        writeln!(text, "    {{ name = \"wall {n}\", from = {}, to = {} }},", at(from), at(to))?;
    }
    writeln!(text, "]\n")
}

fn write_path(text: &mut String, path: &[Point]) -> std::fmt::Result {
    let (first, others) = path.split_first().unwrap_or((&[0.0; 2], &[]));
    let corners: Vec<String> = others.iter().chain([first]).map(at).collect();
    let metres: f64 = sides(path).map(length).sum();
    let lap = metres / SPEED + QUARTER_TURN * 4.0;
    let laps = (DURATION / lap).ceil();
    writeln!(text, "[path]\nunit = \"m\"\nstart = {}\nclearance = \"20 cm\"", at(first))?;
    writeln!(text, "corners = [{}]\nlaps = {laps}", corners.join(", "))?;
    writeln!(text, "speed = \"{SPEED} m/s\"\nturn_rate = \"45 deg/s\"\nfollow = \"estimate\"\n")
}

/// The walks and, with slips and bumps by variance, the noise of the wheels are those that the robot file assumes.
fn write_truth(text: &mut String, rng: &mut ChaCha8Rng) -> std::fmt::Result {
    let mut within = |most: f64| rng.random_range(-most..most);
    let width = TRACK_WIDTH + within(TRACK_WIDTH_ERROR);
    let (right, left) = (within(SCALE), within(SCALE));
    writeln!(text, "[truth]\ntrack_width = \"{width:.5} m\"")?;
    writeln!(text, "scale_right = {right:.5}\nscale_left = {left:.5}\nrange_scale = \"0 %\"")?;
    writeln!(text, "wheel_noise = \"2 mm/sqrt(m)\"\nscale_walk = \"1e-4 /sqrt(m)\"")?;
    writeln!(text, "slip = {{ every = \"20 m\", by = \"3 mm\" }}")?;
    writeln!(text, "bump = {{ every = \"20 m\", by = \"3 mm\" }}")?;
    writeln!(text, "track_width_walk = \"2e-5 m/sqrt(m)\"\nrange_noise = \"3 mm\"")?;
    writeln!(text, "range_noise_per_metre = \"0 mm/m\"\ncone = \"15 deg\"\n")
}

fn write_world(
    text: &mut String,
    obstacles: &[Obstacle],
    rng: &mut ChaCha8Rng,
) -> std::fmt::Result {
    let celsius = AIR + rng.random_range(-COLDER_OR_WARMER..COLDER_OR_WARMER);
    writeln!(text, "[world]\ntemperature = \"{celsius:.1} degC\"\nunit = \"m\"\nobstacle = [")?;
    for Obstacle { outline, walk } in obstacles {
        let outline = match outline {
            Outline::Circle { centre, radius } => {
                format!("centre = {}, radius = \"{radius:.3} m\"", at(centre))
            }
            Outline::Face { from, to } => format!("from = {}, to = {}", at(from), at(to)),
        };
        let walk = walk.map_or_else(String::new, |walk| {
            format!(", walk = {}, takes = \"{:.3} s\"", at(&walk.by), walk.takes)
        });
        writeln!(text, "    {{ {outline}{walk} }},")?;
    }
    writeln!(text, "]\n")
}

fn at([x, y]: &Point) -> String {
    format!("[{x:.3}, {y:.3}]")
}
