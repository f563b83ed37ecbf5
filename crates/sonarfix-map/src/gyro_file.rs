//! Reads the `[gyro]` table of a robot file.

use sonarfix::geometry::units::{PerRootSecond, Radians, RadiansPerSecond};
use sonarfix::sensor::gyro::GyroParameters;

use crate::document::{Node, Table};
use crate::quantity::{ANGLE_WALK, Dimension, TURN_RATE, TURN_RATE_WALK};
use crate::single;

/// Names of gyros.
const GYROS: [(&str, GyroParameters); 1] = [("mpu6050", GyroParameters::MPU_6050)];

/// The gyro of a robot, if it has one: the parameters of a known sensor, with keys of its own.
pub(crate) fn read(robot: &Table<'_>) -> Option<GyroParameters> {
    let table = robot.get("gyro")?.table(&[
        "sensor",
        "range",
        "noise",
        "bias",
        "bias_walk",
        "scale",
        "period",
        "inverted",
    ]);
    let mut gyro = table.require("sensor").one_of(&GYROS, GyroParameters::MPU_6050);
    let value = |key, dimension: &Dimension, known: f32| {
        table.get(key).map_or(known, |node: Node<'_>| single(node.deviation(dimension)))
    };
    gyro.range = RadiansPerSecond(value("range", &TURN_RATE, gyro.range.0));
    gyro.noise = PerRootSecond(Radians(value("noise", &ANGLE_WALK, gyro.noise.0.0)));
    gyro.bias = RadiansPerSecond(value("bias", &TURN_RATE, gyro.bias.0));
    let walk = value("bias_walk", &TURN_RATE_WALK, gyro.bias_walk.0.0);
    gyro.bias_walk = PerRootSecond(RadiansPerSecond(walk));
    gyro.scale = table.get("scale").map_or(gyro.scale, |node| single(node.fraction()));
    gyro.period = table.get("period").map_or(gyro.period, |node| node.period());
    gyro.is_inverted = table.get("inverted").is_some_and(|node| node.boolean());
    Some(gyro)
}
