//! Maps from and for other programs.
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

/// Largest text of a drawing that is read at once, bytes: SVG.
pub const MAX_TEXT_BYTES: u64 = 32 * 1024 * 1024;

/// Largest `GeoJSON`, bytes: thirty times as much is in memory.
pub const MAX_JSON_BYTES: u64 = 8 * 1024 * 1024;
