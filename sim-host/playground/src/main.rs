//! Writes the pages, or prints the hashes that the playground must compute.

use std::path::Path;

use anyhow::{Context, bail};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sonarfix_boards::{Board, esp};
use sonarfix_live::page::Connection;
use sonarfix_playground::request::Request;
use sonarfix_playground::run;
use sonarfix_report::{DRAWING, SCRIPT, fill, player, style};

/// The seeds that the page checks with `#check`.
const SEEDS: [u64; 3] = [0, 1, 2];

/// What a page may load and run: itself.
const POLICY: &str = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
                      script-src 'unsafe-inline' 'wasm-unsafe-eval'\">";

/// The same, and a module in the page.
const POLICY_WITH_MODULE: &str = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
                                  script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:\">";

const USAGE: &str =
    "usage: sonarfix-playground pages PROGRAM.wasm FOLDER PARTS [FIRMWARE] | digests SECONDS";

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["pages", program, folder, parts] => {
            write(program.as_ref(), folder.as_ref(), parts.as_ref(), None)
        }
        ["pages", program, folder, parts, firmware] => {
            write(program.as_ref(), folder.as_ref(), parts.as_ref(), Some(firmware.as_ref()))
        }
        ["digests", seconds] => print(seconds.parse().context(USAGE)?),
        _ => bail!(USAGE),
    }
}

/// An element of a page with the bytes of a file, which is no script.
fn element(attributes: &str, file: &Path) -> anyhow::Result<String> {
    let bytes = std::fs::read(file).with_context(|| file.display().to_string())?;
    Ok(format!("<script {attributes} type=\"text/plain\">{}</script>\n", STANDARD.encode(bytes)))
}

/// The programs of the boards that take UF2 files, from a folder of a release.
fn programs_of_drives(firmware: &Path) -> anyhow::Result<String> {
    let boards = sonarfix_boards::all()?;
    let elements =
        boards.iter().filter(|board| board.uf2.is_some()).map(|Board { name, package, .. }| {
            let file = firmware.join(format!("{package}.uf2"));
            element(&format!("id=\"program-{name}\""), &file)
        });
    elements.collect()
}

/// What the page that flashes an ESP32-C6 has of `parts`, a folder that `cargo xtask` makes, and of a folder of a release.
fn flash_elements(parts: &Path, firmware: Option<&Path>) -> anyhow::Result<String> {
    let part = |what, address, file| {
        element(&format!("data-what=\"{what}\" data-address=\"{address}\""), &parts.join(file))
    };
    let Board { name, package, .. } = sonarfix_boards::named("esp32c6")?;
    let program = firmware.map(|folder| {
        element(&format!("id=\"program-{name}\""), &folder.join(format!("{package}.bin")))
    });
    Ok([
        element("id=\"esptool\"", &parts.join("esptool.js"))?,
        part("the bootloader", esp::BOOTLOADER, "bootloader.bin")?,
        part("the table of partitions", esp::PARTITIONS, "partitions.bin")?,
        program.transpose()?.unwrap_or_default(),
    ]
    .concat())
}

/// What one page has besides the simulator.
struct Page<'a> {
    file: &'a str,
    title: &'a str,
    style: &'a str,
    body: String,
    policy: &'a str,
    /// Elements with programs.
    programs: String,
    /// In the order in which they are read.
    scripts: &'a [&'a str],
}

/// Writes the pages into a folder. `parts` has what the page that flashes a board needs, `firmware` the programs of a release.
fn write(
    program: &Path,
    folder: &Path,
    parts: &Path,
    firmware: Option<&Path>,
) -> anyhow::Result<()> {
    let program = std::fs::read(program).with_context(|| program.display().to_string())?;
    let program = STANDARD.encode(program);
    let (style, player) = (style(), player());
    let simulator = include_str!("simulator.js");
    let pages = [
        Page {
            file: "index.html",
            title: "Sonarfix playground",
            style: include_str!("page.css"),
            body: fill(include_str!("page.html"), &[("player", player.into())]),
            policy: POLICY,
            programs: String::new(),
            scripts: &[
                DRAWING,
                SCRIPT,
                simulator,
                include_str!("handles.js"),
                include_str!("address.js"),
                include_str!("playground.js"),
            ],
        },
        Page {
            file: "new-robot.html",
            title: "Sonarfix: a new robot",
            style: concat!(include_str!("page.css"), include_str!("new_robot.css")),
            body: include_str!("new_robot.html").to_owned(),
            policy: POLICY,
            programs: firmware.map(programs_of_drives).transpose()?.unwrap_or_default(),
            scripts: &[simulator, include_str!("new_robot.js")],
        },
        Page {
            file: "flash.html",
            title: "Sonarfix: flash an ESP32-C6",
            style: concat!(include_str!("page.css"), include_str!("flash.css")),
            body: include_str!("flash.html").to_owned(),
            policy: POLICY_WITH_MODULE,
            programs: flash_elements(parts, firmware)?,
            scripts: &[simulator, include_str!("flash.js")],
        },
    ];
    for page in pages {
        let values = [
            ("policy", page.policy.into()),
            ("title", page.title.into()),
            ("style", style.as_str().into()),
            ("own-style", page.style.into()),
            ("body", page.body.into()),
            ("wasm", program.as_str().into()),
            ("programs", page.programs.into()),
            ("scripts", page.scripts.join("\n").into()),
        ];
        sonarfix_files::write(&folder.join(page.file), fill(include_str!("frame.html"), &values))?;
    }
    sonarfix_files::write(&folder.join("live.html"), live(&program, simulator))
}

/// The live page of a robot on a serial port of the browser, with the program in WebAssembly.
fn live(program: &str, simulator: &str) -> String {
    let controls = fill(include_str!("serial.html"), &[("wasm", program.into())]);
    let connection = Connection {
        policy: POLICY,
        style: include_str!("serial.css"),
        controls: &controls,
        script: &[simulator, include_str!("serial.js")].join("\n"),
    };
    sonarfix_live::page::html(&connection)
}

/// The hashes of runs of `classroom` on this computer, in one line.
fn print(seconds: f64) -> anyhow::Result<()> {
    let scenario: toml::Table = toml::from_str(sonarfix_map::CLASSROOM)?;
    let digest = |seed| {
        let request =
            Request { scenario: scenario.clone(), seed, seconds, moves: vec![], searches: false };
        anyhow::Ok(run(&request)?.0.digest)
    };
    let digests = SEEDS.into_iter().map(digest).collect::<anyhow::Result<Vec<_>>>()?;
    println!("{}", digests.join(" "));
    Ok(())
}
