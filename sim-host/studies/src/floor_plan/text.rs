//! A plan as the text of a scenario.

use std::fmt::Write;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sonarfix_plan::bare::ROBOT;

use super::clutter::{Clutter, Round};
use super::site::{CLEARANCE, Kind, Point};
use super::walls::Face;

/// Errors of wheels and track width, from `docs/hardware.md`.
const SCALE: f64 = 0.005;
const TRACK_WIDTH: f64 = 0.02;
const NOMINAL_WIDTH: f64 = 230.0;
const COLDER_OR_WARMER: f64 = 5.0;
const ROOM: f64 = 20.0;

pub(super) struct Plan {
    pub seed: u64,
    pub kind: Kind,
    pub walls: Vec<Face>,
    /// Mapped furniture.
    pub mapped: Vec<Vec<Face>>,
    /// Unmapped furniture.
    pub clutter: Clutter,
    /// The corners of the path, the start first.
    pub path: Vec<Point>,
}

impl Plan {
    /// The scenario; the errors of the robot are drawn here.
    pub fn toml(&self, rng: &mut ChaCha8Rng) -> String {
        let mut text = String::new();
        // Writing to a String does not fail.
        let _ = self.write(&mut text, rng);
        text
    }

    fn write(&self, text: &mut String, rng: &mut ChaCha8Rng) -> std::fmt::Result {
        let (seed, kind) = (self.seed, self.kind.name());
        writeln!(text, "# Written by `sonarfix-studies floor-plans --draw {seed}`.\n")?;
        writeln!(text, "format = 1\nname = \"floor plan {seed}\"")?;
        writeln!(text, "description = \"The {kind} of seed {seed}\"\nfidelity = \"pins\"\n")?;
        self.write_map(text)?;
        self.write_path(text)?;
        write_truth(text, rng)?;
        self.write_world(text, rng)?;
        text.push('\n');
        text.push_str(ROBOT);
        Ok(())
    }

    fn write_map(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "[map]\nunit = \"cm\"\nwall = [")?;
        for (n, face) in self.walls.iter().enumerate() {
            writeln!(text, "    {{ name = \"wall {n}\", {} }},", ends(face))?;
        }
        for (n, faces) in self.mapped.iter().enumerate() {
            for (side, face) in faces.iter().enumerate() {
                writeln!(text, "    {{ name = \"furniture {n}.{side}\", {} }},", ends(face))?;
            }
        }
        writeln!(text, "]\n")
    }

    fn write_path(&self, text: &mut String) -> std::fmt::Result {
        let mut corners = self.path.iter().map(|[x, y]| format!("[{x}, {y}]"));
        let start = corners.next().unwrap_or_default();
        let corners: Vec<String> = corners.collect();
        writeln!(text, "[path]\nunit = \"cm\"\nstart = {start}")?;
        writeln!(text, "corners = [{}]", corners.join(", "))?;
        writeln!(text, "speed = \"0.25 m/s\"\nturn_rate = \"60 deg/s\"")?;
        writeln!(text, "clearance = \"{CLEARANCE} cm\"\nfollow = \"truth\"\n")
    }

    fn write_world(&self, text: &mut String, rng: &mut ChaCha8Rng) -> std::fmt::Result {
        let celsius = ROOM + rng.random_range(-COLDER_OR_WARMER..COLDER_OR_WARMER);
        writeln!(
            text,
            "[world]\ntemperature = \"{celsius:.1} degC\"\nunit = \"cm\"\nobstacle = ["
        )?;
        for face in &self.clutter.faces {
            writeln!(text, "    {{ {} }},", ends(face))?;
        }
        for Round { centre: [x, y], radius } in &self.clutter.rounds {
            writeln!(text, "    {{ centre = [{x}, {y}], radius = \"{radius} cm\" }},")?;
        }
        writeln!(text, "]")
    }
}

fn ends([[x0, y0], [x1, y1]]: &Face) -> String {
    format!("from = [{x0}, {y0}], to = [{x1}, {y1}]")
}

fn write_truth(text: &mut String, rng: &mut ChaCha8Rng) -> std::fmt::Result {
    let mut within = |most: f64| rng.random_range(-most..most);
    let width = NOMINAL_WIDTH * (1.0 + within(TRACK_WIDTH));
    let (right, left) = (within(SCALE), within(SCALE));
    writeln!(text, "[truth]\ntrack_width = \"{width:.2} mm\"")?;
    writeln!(text, "scale_right = {right:.5}\nscale_left = {left:.5}\nrange_scale = \"0 %\"")?;
    writeln!(text, "wheel_noise = \"2 mm/sqrt(m)\"\nscale_walk = \"0 /sqrt(m)\"")?;
    writeln!(text, "track_width_walk = \"0 m/sqrt(m)\"\nrange_noise = \"3 mm\"")?;
    writeln!(text, "range_noise_per_metre = \"0 mm/m\"\ncone = \"15 deg\"\n")
}
