//! Disturbances of the wheels.

use crate::document::Node;
use crate::keys::{Section, number};
use crate::quantity::{ANGLE, LENGTH, TIME};

/// Disturbances of a wheel at random distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Upset {
    /// Mean distance between two, metres; infinite for none.
    pub every: f64,
    /// Excess travel that the encoder counts each time, metres; of a bump, its standard deviation.
    pub by: f64,
}

impl Default for Upset {
    fn default() -> Self {
        Self { every: f64::INFINITY, by: 0.0 }
    }
}

/// Slips of one wheel at random times, which turn the odometry and not the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingSlip {
    /// Mean time between two, seconds; infinite for none.
    pub every: f64,
    /// Least turn of the odometry by one slip, radians; either wheel slips.
    pub least: f64,
    /// Greatest turn, radians.
    pub most: f64,
}

impl Default for HeadingSlip {
    fn default() -> Self {
        Self { every: f64::INFINITY, least: 0.0, most: 0.0 }
    }
}

/// Disturbances of the wheels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Upsets {
    /// A wheel turns without rolling.
    pub slip: Upset,
    /// A wheel rolls over something.
    pub bump: Upset,
    /// A wheel spins so far that the odometry turns.
    pub heading_slip: HeadingSlip,
}

#[rustfmt::skip]
pub(crate) static UPSET: Section<Upset> = Section { name: "slip", usual: Upset::default, keys: &[
    number("every", &LENGTH, ("1 mm", "1000000 m"), |u| &mut u.every, "mean distance between two of a wheel"),
    number("by", &LENGTH, ("0 m", "10 m"), |u| &mut u.by, "travel of the wheel"),
] };

#[rustfmt::skip]
pub(crate) static HEADING_SLIP: Section<HeadingSlip> = Section { name: "heading_slip", usual: HeadingSlip::default, keys: &[
    number("every", &TIME, ("1 ms", "1000000 s"), |s| &mut s.every, "mean time between two"),
    number("least", &ANGLE, ("0 deg", "360 deg"), |s| &mut s.least, "least turn of the odometry"),
    number("most", &ANGLE, ("0 deg", "360 deg"), |s| &mut s.most, "greatest turn. At least `least`"),
] };

/// Reads `heading_slip`, whose least and greatest turn are in order.
pub(crate) fn read_heading_slip(node: Node<'_>, into: &mut HeadingSlip) {
    let table = node.table(&HEADING_SLIP.names());
    let read = || Some(HEADING_SLIP.read_from(&table, HeadingSlip::default()));
    let Some(slip) = table.faultless(read) else { return };
    if slip.most < slip.least {
        table.report_at("most", "must be at least the value of least");
    }
    *into = slip;
}
