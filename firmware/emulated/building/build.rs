//! Bakes the maps.

#![allow(dead_code, reason = "the shared building also places a robot, which is not needed here")]

use std::path::PathBuf;
use std::{env, fs};

#[path = "../../../crates/sonarfix-map/tests/rooms/mod.rs"]
mod rooms;

fn main() {
    println!("cargo:rerun-if-changed=../../../crates/sonarfix-map/tests/rooms/mod.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    for count in [100, 1_000, 10_000, 100_000] {
        let image = sonarfix_map::bake(&rooms::rooms(count)).expect("the building can be baked");
        fs::write(out.join(format!("{count}.map")), image).expect("the map can be written");
    }
}
