//! The processors for which a compiled library is packed, and the compilers that Arduino's cores use for them.

/// A processor.
#[derive(Debug)]
pub struct Target {
    /// `build.mcu` of Arduino's cores, and below it the floating-point unit and ABI where they have one: a folder of the packages.
    pub folder: &'static str,
    /// Target triple of rustc.
    pub triple: &'static str,
    /// Flags of rustc.
    pub rustflags: &'static str,
    /// Prefix of the compiler.
    pub compiler: &'static str,
    /// Flags by which the cores compile for it.
    pub flags: &'static str,
}

const ARM: &str = "arm-none-eabi-";
const RISC_V: &str = "riscv64-unknown-elf-";

/// All of them.
pub const TARGETS: [Target; 8] = [
    // SAMD21, RP2040.
    Target {
        folder: "cortex-m0plus",
        triple: "thumbv6m-none-eabi",
        rustflags: "",
        compiler: ARM,
        flags: "-mcpu=cortex-m0plus -mthumb",
    },
    // SAM3X (Due), STM32F1.
    Target {
        folder: "cortex-m3",
        triple: "thumbv7m-none-eabi",
        rustflags: "",
        compiler: ARM,
        flags: "-mcpu=cortex-m3 -mthumb",
    },
    // SAMD51, STM32F4, RA4M1 (UNO R4).
    Target {
        folder: "cortex-m4/fpv4-sp-d16-hard",
        triple: "thumbv7em-none-eabihf",
        rustflags: "",
        compiler: ARM,
        flags: "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard",
    },
    // nRF52 of mbed.
    Target {
        folder: "cortex-m4/fpv4-sp-d16-softfp",
        triple: "thumbv7em-none-eabi",
        rustflags: "-Ctarget-feature=+vfp4d16sp",
        compiler: ARM,
        flags: "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=softfp",
    },
    // Teensy 4, STM32F7 and H7.
    Target {
        folder: "cortex-m7/fpv5-d16-hard",
        triple: "thumbv7em-none-eabihf",
        rustflags: "-Ctarget-cpu=cortex-m7",
        compiler: ARM,
        flags: "-mcpu=cortex-m7 -mthumb -mfpu=fpv5-d16 -mfloat-abi=hard",
    },
    // RP2350, STM32U5.
    Target {
        folder: "cortex-m33/fpv5-sp-d16-hard",
        triple: "thumbv8m.main-none-eabihf",
        rustflags: "",
        compiler: ARM,
        flags: "-mcpu=cortex-m33 -mthumb -mfpu=fpv5-sp-d16 -mfloat-abi=hard",
    },
    Target {
        folder: "esp32c3",
        triple: "riscv32imc-unknown-none-elf",
        rustflags: "",
        compiler: RISC_V,
        flags: "-march=rv32imc -mabi=ilp32",
    },
    Target {
        folder: "esp32c6",
        triple: "riscv32imac-unknown-none-elf",
        rustflags: "",
        compiler: RISC_V,
        flags: "-march=rv32imac -mabi=ilp32",
    },
];

/// The computer on which the packages are made: the library of its folder is that of the tests and of programs on a PC.
pub const HOST: &str = "x86_64-unknown-linux-gnu";

/// Processors for which the portable source is compiled.
pub const PORTABLE: [(&str, &str); 2] = [
    // ESP8266; the compilers of ESP32 and S3 are of the same family.
    ("xtensa-lx106-elf-", "-mlongcalls -mtext-section-literals"),
    (ARM, "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=softfp"),
];

impl Target {
    /// A name without a slash.
    pub fn name(&self) -> String {
        self.folder.replace('/', "-")
    }
}
