//! A path on the command line or in a file.

use std::path::Path as FilePath;

use anyhow::Context;
use sonarfix_hal::config::RobotConfig;
use sonarfix_map::{Collision, Floor, Path, PathPlan};

/// Default speed and turn rate, metres per second and radians per second.
const SPEED: f64 = 0.25;
const TURN_RATE: f64 = std::f64::consts::FRAC_PI_3;

/// Reads corners, metres: from a file with one `x,y` per line and comments after `#`, or from the
/// argument itself, `"x,y x,y …"`.
///
/// # Errors
/// The error, its location, and what to do.
pub fn corners(argument: &str) -> anyhow::Result<Vec<[f64; 2]>> {
    if argument.split_whitespace().all(|word| point(word).is_some()) {
        return Ok(argument.split_whitespace().filter_map(point).collect());
    }
    let is_written_out = !FilePath::new(argument).exists() && argument.contains(',');
    if is_written_out {
        let wrong = argument.split_whitespace().find(|word| point(word).is_none());
        let wrong = wrong.unwrap_or_default();
        anyhow::bail!("--path: \"{wrong}\" is not a point; write \"x,y x,y …\" in metres");
    }
    let text = sonarfix_map::read_text(FilePath::new(argument))
        .with_context(|| format!("--path: cannot read the file {argument}"))?;
    from_text(&text, argument)
}

fn from_text(text: &str, name: &str) -> anyhow::Result<Vec<[f64; 2]>> {
    let mut corners = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let number = index + 1;
        let corner = point(line);
        corners.push(corner.with_context(|| {
            format!("{name}:{number}: \"{line}\" is not a point; write x,y in metres")
        })?);
    }
    Ok(corners)
}

fn point(word: &str) -> Option<[f64; 2]> {
    let (x, y) = word.split_once(',')?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    Some([number(x)?, number(y)?])
}

/// The path over these corners, of which the first is the start, at the default speeds, limited by
/// the maximum wheel speed.
///
/// # Errors
/// The error of the path, with its leg.
pub fn path(corners: &[[f64; 2]], floor: &Floor, robot: &RobotConfig) -> anyhow::Result<Path> {
    let Some((&start, corners)) = corners.split_first().filter(|(_, rest)| !rest.is_empty()) else {
        anyhow::bail!("--path: a path has two points or more, the first where it starts");
    };
    let fastest = f64::from(robot.localizer.max_wheel_speed.0);
    let half_width = 0.5 * f64::from(robot.localizer.drive.track_width.0);
    let plan = PathPlan {
        start,
        corners: corners.to_vec(),
        laps: 1,
        speed: SPEED.min(fastest),
        turn_rate: TURN_RATE.min(fastest / half_width),
    };
    if let Some(collision) = Collision::first(&plan, floor, 0.0) {
        anyhow::bail!("--path: {collision}; lead the path through a gap of the map");
    }
    Path::new(plan).map_err(|error| match error.corner() {
        Some(corner) => anyhow::anyhow!("--path: point {} {error}", corner + 2),
        None => anyhow::anyhow!("--path: {} {error}", error.field()),
    })
}
