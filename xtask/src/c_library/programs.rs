//! Builds the library and the programs of `c/`, and runs them.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};

use crate::cargo;
use crate::workspace::Workspace;

const WARNINGS: &str = "-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror";
const C: &str = "-std=c11 -Wstrict-prototypes";
/// Of WebAssembly the portable source keeps that parameters are not used, and that names of locals come again.
const PORTABLE: &str = "-Wno-unused-parameter -Wno-shadow";
const CPP: &str = "-std=c++17 -fno-exceptions -fno-rtti";
/// Seconds after which a program on an emulated core is killed.
const TIME_OUT: &str = "120";

/// The library for this computer.
pub struct Host {
    library: PathBuf,
}

impl Host {
    pub fn build(profile: &str, composition: &str) -> anyhow::Result<Self> {
        let library = Workspace::C.target_folder().join(profile).join("libsonarfix.a");
        build(profile, composition, "").map(|()| Self { library })
    }

    /// Compiles a program and runs it; returns its output.
    fn run(
        &self,
        compiler: &str,
        options: &str,
        sources: &str,
        arguments: &[String],
    ) -> anyhow::Result<String> {
        let program = Workspace::C.target_folder().join("program");
        let mut command = compile(compiler, options, sources);
        command.arg(&self.library).args(["-lm", "-o"]).arg(&program);
        cargo::check(command)?;
        let mut command = Command::new(&program);
        command.args(arguments);
        cargo::printed(command)
    }

    /// The program of the README, which must know its pose at the end to a centimetre.
    pub fn run_example(&self) -> anyhow::Result<()> {
        let output = self.run("cc", C, "examples/one_fix.c examples/drivers_pc.c", &[])?;
        let error = output.lines().last().and_then(|line| line.rsplit_once("error "));
        let error = error.and_then(|(_, error)| error.strip_suffix(" mm")?.parse::<f32>().ok());
        ensure!(error.is_some_and(|error| error < 10.0), "one_fix is lost: {output}");
        let lines = std::fs::read_to_string(cargo::root().join("c/examples/one_fix.c"))?;
        ensure!(lines.lines().count() <= 40, "one_fix has more than 40 lines");
        Ok(())
    }

    /// A robot that turns while it searches.
    pub fn turn_while_searching(&self) -> anyhow::Result<()> {
        self.run("cc", C, "tests/motion.c", &[]).map(drop)
    }

    pub fn replay(&self, trace: &Path) -> anyhow::Result<()> {
        let options = format!("{C} {}", traced(trace));
        self.run("cc", &options, "tests/replay.c tests/replay_pc.c tests/trace.S", &[]).map(drop)
    }

    /// The trace of a localizer alone, through the classes of the C++ header.
    pub fn replay_in_cpp(&self, trace: &Path) -> anyhow::Result<()> {
        let folder = Workspace::C.target_folder();
        let object = folder.join("trace.o");
        let mut command = compile("cc", &traced(trace), "tests/trace.S");
        command.arg("-c").arg("-o").arg(&object);
        cargo::check(command)?;
        let options = format!("{CPP} {}", object.display());
        self.run("c++", &options, "tests/replay.cpp", &[]).map(drop)
    }

    /// Random calls under `AddressSanitizer` and `UndefinedBehaviorSanitizer`; the library has debug assertions.
    pub fn call_hostilely(&self, calls: u64, seed: u64) -> anyhow::Result<()> {
        let options = format!("{C} -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all");
        let arguments = [calls.to_string(), seed.to_string()];
        let output = self.run("cc", &options, "tests/hostile.c", &arguments)?;
        println!("{}", output.trim());
        Ok(())
    }
}

/// The trace with the portable source, on this computer with pointers of 32 bits.
pub fn replay_portably(source: &Path, trace: &Path) -> anyhow::Result<()> {
    let program = Workspace::C.target_folder().join("program");
    // The alignment and the arithmetic of the processors that the source is for.
    let options =
        format!("{C} -O1 -m32 -malign-double -msse2 -mfpmath=sse {PORTABLE} {}", traced(trace));
    let mut command = compile("cc", &options, "tests/replay.c tests/replay_pc.c tests/trace.S");
    command.arg(source).args(["-lm", "-o"]).arg(&program);
    cargo::check(command)?;
    cargo::printed(Command::new(&program)).map(drop)
}

fn build(profile: &str, composition: &str, target: &str) -> anyhow::Result<()> {
    cargo::check(Workspace::C.cargo(&format!(
        "build --profile {profile} --no-default-features --features {composition} {target}"
    )))
}

/// A compiler with warnings as errors, in the folder `c`.
fn compile(compiler: &str, options: &str, sources: &str) -> Command {
    let mut command = Command::new(compiler);
    command.current_dir(Workspace::C.folder());
    command.args(WARNINGS.split(' ')).args(options.split_whitespace());
    command.args(["-Iinclude", "-Iexamples", "-Itests"]).args(sources.split(' '));
    command
}

fn traced(trace: &Path) -> String {
    format!("-DTRACE=\"{}\"", trace.display())
}

/// An emulated core.
pub struct Core {
    pub name: &'static str,
    triple: &'static str,
    compiler: &'static str,
    options: &'static str,
    /// The memory, in `firmware/emulated/board`, and the sections, in `c/tests/cores`.
    memory: &'static str,
    sections: &'static str,
    emulator: &'static str,
}

const ARM: Core = Core {
    name: "",
    triple: "",
    compiler: "arm-none-eabi-gcc",
    options: "",
    memory: "mps2.x",
    sections: "arm.ld",
    emulator: "",
};

/// Those on which the golden traces are replayed; the first one is measured.
pub const CORES: [Core; 5] = [
    Core {
        name: "Cortex-M4F",
        triple: "thumbv7em-none-eabihf",
        options: "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16",
        emulator: "qemu-system-arm -machine mps2-an386",
        ..ARM
    },
    Core {
        name: "Cortex-M33",
        triple: "thumbv8m.main-none-eabihf",
        options: "-mcpu=cortex-m33 -mthumb -mfloat-abi=hard -mfpu=fpv5-sp-d16",
        memory: "an505.x",
        emulator: "qemu-system-arm -machine mps2-an505",
        ..ARM
    },
    Core {
        name: "Cortex-M3",
        triple: "thumbv7m-none-eabi",
        options: "-mcpu=cortex-m3 -mthumb",
        emulator: "qemu-system-arm -machine mps2-an385",
        ..ARM
    },
    Core {
        name: "Cortex-M0+",
        triple: "thumbv6m-none-eabi",
        options: "-mcpu=cortex-m0plus -mthumb",
        emulator: "qemu-system-arm -machine mps2-an385",
        ..ARM
    },
    Core {
        name: "RISC-V",
        triple: "riscv32imac-unknown-none-elf",
        compiler: "riscv64-unknown-elf-gcc",
        options: "-march=rv32imac -mabi=ilp32",
        memory: "virt.x",
        sections: "riscv.ld",
        emulator: "qemu-system-riscv32 -bios none -machine virt",
    },
];

impl Core {
    /// Builds the library; returns its file.
    pub fn build(&self, composition: &str) -> anyhow::Result<PathBuf> {
        build("release", composition, &format!("--target {}", self.triple))?;
        Ok(Workspace::C.target_folder().join(self.triple).join("release/libsonarfix.a"))
    }

    /// Compiles the portable source; returns the object.
    pub fn compile_portable(&self, source: &Path) -> anyhow::Result<PathBuf> {
        let object = Workspace::C.target_folder().join("portable.o");
        let options =
            format!("{C} -ffreestanding -Os -ffunction-sections {} {PORTABLE}", self.options);
        let mut command = compile(self.compiler, &options, "tests/cores/memory.c");
        command.arg(source).args(["-nostdlib", "-r", "-o"]).arg(&object);
        cargo::check(command)?;
        Ok(object)
    }

    /// Links a program with this library.
    pub fn link(&self, library: &Path, options: &str, sources: &str) -> anyhow::Result<PathBuf> {
        let folder = Workspace::C.target_folder();
        let program = folder.join("program.elf");
        let board = cargo::root().join("firmware/emulated/board");
        let options =
            format!("{C} -ffreestanding -Os -ffunction-sections {} {options}", self.options);
        let mut command = compile(self.compiler, &options, sources);
        command.args(["-nostdlib", "-T"]).arg(board.join(self.memory));
        command.args(["-T", &format!("tests/cores/{}", self.sections)]);
        command.args(["-Wl,--gc-sections", "-Wl,--no-warn-rwx-segments", "-Wl,-z,noexecstack"]);
        command.arg(library).args(["-lgcc", "-o"]).arg(&program);
        let installed = || format!("{}: is `{}` installed?", self.name, self.compiler);
        cargo::check(command).with_context(installed)?;
        Ok(program)
    }

    pub fn replay(&self, library: &Path, trace: &Path) -> anyhow::Result<()> {
        let sources = "tests/replay.c tests/trace.S tests/cores/replay_core.c tests/cores/core.c";
        let output = self.run(&self.link(library, &traced(trace), sources)?)?;
        ensure!(output.trim() == "equal", "{} with {}: {output}", self.name, trace.display());
        Ok(())
    }

    /// Prints the instructions of the calls of a Cortex-M4F in a trace of a localizer alone.
    pub fn print_cost(&self, library: &Path, trace: &Path) -> anyhow::Result<()> {
        let wrapped =
            ["odometry", "aim", "fix"].map(|call| format!("-Wl,--wrap=sonarfix_localizer_{call}"));
        let options = format!("{} {}", traced(trace), wrapped.join(" "));
        let sources = "tests/replay.c tests/trace.S tests/cores/cost.c tests/cores/core.c";
        let output = self.run(&self.link(library, &options, sources)?)?;
        let name = library.file_name().unwrap_or_default().display();
        println!("instructions of a call of {name} on a {}, on average:\n{output}", self.name);
        Ok(())
    }

    fn run(&self, program: &Path) -> anyhow::Result<String> {
        let mut command = Command::new("timeout");
        command.arg(TIME_OUT).args(self.emulator.split(' '));
        // 2⁷ ns pass with every instruction.
        command.args(["-icount", "shift=7"]);
        command.args(["-display", "none", "-monitor", "none", "-serial", "none"]);
        command.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(program);
        cargo::output(command).with_context(|| self.name)
    }
}
