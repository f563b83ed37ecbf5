//! The package for C as other builds take it.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::command::output;

const PROJECT: &str = "cmake_minimum_required(VERSION 3.16)
project(robot C)
find_package(sonarfix REQUIRED)
add_executable(robot one_fix.c drivers_pc.c)
target_link_libraries(robot sonarfix::sonarfix m)
";

/// Builds the example outside the package, by one command, by pkg-config and by CMake, and runs it.
///
/// # Errors
/// If it cannot be built, or is lost.
pub fn check(package: &Path, work: &Path) -> Result<()> {
    by_pkg_config(package, work)?;
    by_one_command(package, work)?;
    by_cmake(package, work, "cmake-pc", &[])?;
    let output = output(&mut Command::new(work.join("cmake-pc/build/robot")))?;
    ensure!(output.contains("error"), "the program prints no pose");
    // The portable source with the flags of the build, and the compiled library.
    let portable = "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard";
    for (name, flags, library) in [
        ("cmake-arm", portable, ""),
        ("cmake-m0plus", "-mcpu=cortex-m0plus -mthumb", "cortex-m0plus"),
    ] {
        let flags = format!("-DCMAKE_C_FLAGS={flags} --specs=nosys.specs");
        let library = format!("-DSONARFIX_LIBRARY={library}");
        let system = ["-DCMAKE_SYSTEM_NAME=Generic", "-DCMAKE_C_COMPILER=arm-none-eabi-gcc"];
        by_cmake(package, work, name, &[system[0], system[1], &flags, &library])?;
    }
    Ok(())
}

fn by_pkg_config(package: &Path, work: &Path) -> Result<()> {
    let file = package.join("pkgconfig/sonarfix.pc");
    let flags = output(Command::new("pkg-config").args(["--cflags", "--libs"]).arg(file))?;
    let program = work.join("one_fix");
    let mut cc = Command::new("cc");
    cc.args(["one_fix.c", "drivers_pc.c"]).current_dir(package.join("examples"));
    cc.args(flags.split_whitespace()).args(["-lm", "-o"]).arg(&program);
    output(&mut cc)?;
    output(&mut Command::new(program)).map(drop)
}

/// The command of the package's README for a Cortex-M4F, with the drivers of a PC's simulation.
fn by_one_command(package: &Path, work: &Path) -> Result<()> {
    let mut gcc = Command::new("arm-none-eabi-gcc");
    gcc.current_dir(package).args(["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16"]);
    gcc.args(["-mfloat-abi=hard", "-Iinclude", "-Iexamples", "examples/one_fix.c"]);
    gcc.args(["examples/drivers_pc.c", "lib/cortex-m4-fpv4-sp-d16-hard/libsonarfix.a", "-lm"]);
    gcc.args(["--specs=rdimon.specs", "-o"]);
    output(gcc.arg(work.join("one_fix.elf"))).map(drop)
}

fn by_cmake(package: &Path, work: &Path, name: &str, options: &[&str]) -> Result<()> {
    let folder = work.join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("CMakeLists.txt"), PROJECT)?;
    for source in ["one_fix.c", "drivers_pc.c", "drivers.h"] {
        std::fs::copy(package.join("examples").join(source), folder.join(source))?;
    }
    let place = package.canonicalize()?.join("cmake");
    let mut configure = Command::new("cmake");
    configure.current_dir(&folder).args(["-B", "build"]).args(options);
    output(configure.arg(format!("-Dsonarfix_DIR={}", place.display())))?;
    output(Command::new("cmake").current_dir(&folder).args(["--build", "build"]))
        .with_context(|| name.to_owned())
        .map(drop)
}
