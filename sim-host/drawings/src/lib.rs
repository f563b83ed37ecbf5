//! Maps from and for other programs (`docs/exchange.md`). The command reads files with it, and the playground what is dropped on it.
//!
//! | module | what |
//! |---|---|
//! | [`dxf`] | drawings in DXF |
//! | [`svg`] | drawings in SVG |
//! | [`geojson`] | GeoJSON |
//! | [`grid`] | occupancy grids of ROS's `map_server` |
//! | [`scan`] | scanned floor plans |
//! | [`plan`] | one wall for each wall of a floor plan |
//! | `image` | their images: PGM and PNG |
//! | `thin` | lines of one pixel from thick ones |
//! | `lines` | straight lines in an image |
//! | `drawn` | segments with names, and what was dropped |

mod drawn;
pub mod dxf;
pub mod geojson;
pub mod grid;
mod image;
mod lines;
pub mod plan;
pub mod scan;
pub mod svg;
mod thin;

pub use drawn::{Frame, Imported, MAX_SEGMENTS};

/// The metres of a unit: its name, or a number.
///
/// # Errors
/// If it is neither.
pub fn unit(text: &str) -> Result<f64, String> {
    match text {
        "m" => Ok(1.0),
        "cm" => Ok(1e-2),
        "mm" => Ok(1e-3),
        "in" => Ok(0.0254),
        "ft" => Ok(0.3048),
        other => {
            let metres =
                other.parse().ok().filter(|metres: &f64| metres.is_finite() && *metres > 0.0);
            metres.ok_or_else(|| "m, cm, mm, in, ft or a positive number is expected".to_owned())
        }
    }
}

/// Largest text of a drawing that is read at once, bytes: SVG.
pub const MAX_TEXT_BYTES: u64 = 32 * 1024 * 1024;

/// The shortest wall that is read from an image or a drawing of a plan, metres.
pub const SHORTEST_OF_PLAN: f64 = 0.25;

/// Largest `GeoJSON`, bytes: thirty times as much is in memory.
pub const MAX_JSON_BYTES: u64 = 8 * 1024 * 1024;
