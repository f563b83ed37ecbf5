//! Whether the program that this library is linked into computes as it does. A compiler that contracts a product and a sum, a runtime
//! library with its own floating point, or a processor that flushes small numbers to zero changes the bits, and says nothing.

use core::hint::black_box;

use sonarfix::filter::ekf::{Ekf, EkfError, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Metres, PerRootMetre, Radians, SquareMetres};
use sonarfix::map::Wall;
use sonarfix::sensor::range::ExpectedRange;

use crate::status::{Result, sonarfix_status_t};

/// What every target computes: [`bits`].
const BITS: u32 = 3_880_783_242;

/// Checks that some steps of the filter give the bits that they give everywhere.
pub(crate) fn check() -> Result<()> {
    let is_exact = bits().is_ok_and(|bits| bits == BITS);
    if is_exact { Ok(()) } else { Err(sonarfix_status_t::SONARFIX_ERROR_ARITHMETIC) }
}

/// A hash of state and deviations after four steps with a range each.
fn bits() -> core::result::Result<u32, EkfError> {
    let mut ekf = filter()?;
    let wall = Wall::new(Point::new(3.1, -2.0), Point::new(2.9, 4.0));
    for step in 1_u8..=4 {
        let travel = black_box(0.1 + f32::from(step) * 0.003);
        ekf.predict(WheelTravel::new(travel, travel * 0.7))?;
        if let Ok(wall) = &wall {
            let mount = Point::new(0.06, -0.01);
            let expected = ExpectedRange::new(wall, mount, &ekf.state());
            ekf.update(expected.range + Metres(0.004), &expected, SquareMetres(4e-6))?;
        }
    }
    let (state, deviation) = (ekf.state(), ekf.standard_deviations());
    let results = [state.x.0, state.y.0, state.heading.0, state.scale_right, deviation.y.0];
    let hash = |hash: u32, result: &f32| (hash ^ result.to_bits()).wrapping_mul(16_777_619);
    Ok(results.iter().fold(2_166_136_261, hash))
}

fn filter() -> core::result::Result<Ekf, EkfError> {
    let drive = Drive {
        track_width: Metres(black_box(0.16)),
        wheel_noise: PerRootMetre(Metres(0.001)),
        scale_walk: PerRootMetre(1e-5),
        track_width_walk: PerRootMetre(Metres(1e-5)),
    };
    let deviations = StandardDeviations {
        x: Metres(0.02),
        y: Metres(0.03),
        heading: Radians(0.02),
        scale_right: 0.01,
        scale_left: 0.01,
        track_width_error: Metres(0.005),
        range_scale: 0.01,
    };
    Ekf::new(drive, StateEstimate::at_pose(Pose::new(0.4, 0.7, Radians(0.3))), deviations)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A change of the filter that changes its bits changes [`BITS`], too: otherwise no handle of the library opens.
    #[test]
    fn the_bits_are_those_of_the_filter() {
        assert_eq!(bits(), Ok(BITS));
    }
}
