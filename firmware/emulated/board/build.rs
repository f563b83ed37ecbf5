//! Gives the linker the memory map of the board, and the program its clock.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=mps2.x");
    println!("cargo:rerun-if-changed=an505.x");
    println!("cargo:rerun-if-changed=virt.x");
    let target = env::var("TARGET").expect("cargo sets TARGET");
    // Nanoseconds of a tick of SysTick: 25 MHz, and 20 MHz on the board with a Cortex-M33. RISC-V has none.
    let (memory, tick) = if target.starts_with("thumbv8m") {
        ("an505.x", 50)
    } else if target.starts_with("riscv32") {
        ("virt.x", 0)
    } else {
        ("mps2.x", 40)
    };
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy(memory, out.join("memory.x")).expect("the memory map can be copied");
    fs::write(out.join("tick.rs"), tick.to_string()).expect("the clock can be written");
    println!("cargo:rustc-link-search={}", out.display());
}
