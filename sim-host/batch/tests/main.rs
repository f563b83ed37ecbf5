//! The integration tests of the crate, one program.

mod known_map;
mod reference_stream;
