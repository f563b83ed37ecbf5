//! What `calibrate` says of the echoes of simulated sensors.

use std::fmt::Write as _;

use sonarfix_batch::calibrate::CalibrateError;
use sonarfix_batch::echoes::{Echoes, Oblique, Source, Square};
use sonarfix_sim::progress::Progress;

use crate::floor_plan::compare::quantile;
use crate::rooms::Sensor;

use super::{CalibrationStudyError, Compared, Errors, From, Simulated, Variant, each_seed};

/// The sensors: the sonars of the rooms.
pub const SENSORS: [Sensor; 4] = [Sensor::HcSr04, Sensor::LvMaxSonar, Sensor::Nxt, Sensor::Ev3];

/// What a drive says of the sensor.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// Half-angle of its cone, radians, if it is determined.
    pub cone: Option<f64>,
    /// Its echoes.
    pub echoes: Echoes,
    /// The largest error of a constant, in its deviations.
    pub worst: f64,
}

/// The drives with one sensor.
#[derive(Debug, Clone)]
pub struct Row {
    /// The sensor.
    pub sensor: Sensor,
    /// Each drive, or the error.
    pub outcomes: Vec<Result<Found, CalibrateError>>,
}

/// Runs trials of robots that drive this far, metres, with a sensor; after an interruption those that have begun.
///
/// # Errors
/// [`CalibrationStudyError`].
pub fn trials(
    first: u64,
    count: u32,
    metres: f64,
    sensor: Sensor,
    progress: &impl Progress,
) -> Result<Row, CalibrationStudyError> {
    let variant = Variant { sensor: Some(sensor), ..Variant::default() };
    let outcomes = each_seed(first, count, progress, |seed| {
        let robot = Simulated::new(seed, metres, Errors::BUILDER, variant)?;
        let found = robot.calibrated(From::Start);
        Ok(found.map(|found| Found {
            cone: found.bearings.map(|of| of.half_cone),
            echoes: found.echoes,
            worst: robot.compare(&found).iter().map(Compared::deviations).fold(0.0, f64::max),
        }))
    })?;
    Ok(Row { sensor, outcomes })
}

/// The true source of the echoes of oblique walls.
fn source(sensor: Sensor) -> Source {
    if sensor == Sensor::Ev3 { Source::Cone } else { Source::Perpendicular }
}

/// The page's table: medians of what the drives say of each sensor.
#[must_use]
pub fn page(rows: &[Row]) -> String {
    let mut page = String::from(
        "| sensor | refused | half of the cone | missed | short | long | echoes at oblique walls | of the wall | perpendicular | on the axis | nearest \
         point of a cone | half-angle of that cone | largest error | right kind | wrong kind |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let found: Vec<&Found> = row.outcomes.iter().filter_map(|of| of.as_ref().ok()).collect();
        let cones = found.iter().filter_map(|found| found.cone);
        let square: Vec<Square> = found.iter().filter_map(|found| found.echoes.square).collect();
        let oblique: Vec<Oblique> = found.iter().filter_map(|found| found.echoes.oblique).collect();
        let shares =
            |of: fn(&Square) -> f64| 100.0 * quantile(square.iter().map(of).collect(), 0.5);
        let median = |of: fn(&Oblique) -> f64| quantile(oblique.iter().map(of).collect(), 0.5);
        let kinds = |is: fn(Source, Source) -> bool| {
            let truth = source(row.sensor);
            oblique.iter().filter_map(Oblique::source).filter(|found| is(*found, truth)).count()
        };
        #[expect(clippy::cast_precision_loss, reason = "numbers of echoes")]
        let echoes = median(|of| of.echoes as f64);
        let _ = writeln!(
            page,
            "| {} | {} of {} | {:.1}° | {:.1} % | {:.1} % | {:.1} % | {echoes:.0} | {:.0} % | {:.0} % | {:.0} % | {:.0} % | {:.0}° | {:.1} deviations | {} | {} |",
            row.sensor.name(),
            row.outcomes.len() - found.len(),
            row.outcomes.len(),
            quantile(cones.collect(), 0.5).to_degrees(),
            shares(|of| of.missed.value),
            shares(|of| of.short.value),
            shares(|of| of.long.value),
            100.0 * median(|of| of.of_wall),
            100.0 * median(|of| of.perpendicular),
            100.0 * median(|of| of.axis),
            100.0 * median(|of| of.cone.map_or(0.0, |cone| cone.share)),
            median(|of| of.cone.map_or(0.0, |cone| cone.half_angle)).to_degrees(),
            found.iter().map(|found| found.worst).fold(0.0, f64::max),
            kinds(|found, truth| found == truth),
            kinds(|found, truth| found != truth),
        );
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kind_of_a_simulated_sensor_is_found() {
        let rows: Vec<Row> = [Sensor::HcSr04, Sensor::Ev3]
            .into_iter()
            .map(|sensor| trials(400_001, 1, 20.0, sensor, &|| ()).unwrap())
            .collect();
        for row in &rows {
            let found = row.outcomes[0].as_ref().unwrap();
            let oblique = found.echoes.oblique.unwrap();
            assert_eq!(oblique.source(), Some(source(row.sensor)), "{oblique:?}");
            assert!(found.worst < 5.0, "{found:?}");
        }
        let page = page(&rows);
        assert!(page.lines().nth(3).unwrap().ends_with("| 1 | 0 |"), "{page}");
    }
}
