//! Tests of the file formats, of baked maps and of paths, in one program, which links once.

mod baked;
mod errors;
mod formats;
mod maps;
mod paper;
mod path;
mod plausibility;
mod rooms;
mod symmetry;
