//! The C that wasm2c writes, taken apart.

use anyhow::{Context, Result, ensure};
use regex::Regex;

/// What wasm2c made of a WebAssembly module.
#[derive(Debug)]
pub struct Module {
    /// Its functions, in the order of the module.
    pub functions: Vec<Function>,
    /// Its constants.
    pub segments: Vec<Segment>,
}

/// A function of the module.
#[derive(Debug)]
pub struct Function {
    /// Its name in C.
    pub name: String,
    /// The type of its result in C.
    pub result: String,
    /// Its parameters after the instance, as C declares them.
    pub parameters: Vec<String>,
    /// The lines between its braces.
    pub body: Vec<String>,
}

/// Constants at an address of the module's memory.
#[derive(Debug)]
pub struct Segment {
    /// The address of the first byte.
    pub address: u32,
    /// The constants.
    pub bytes: Vec<u8>,
}

impl Module {
    /// Takes the output of wasm2c 1.0.32 apart.
    ///
    /// # Errors
    /// If it is not what that version writes, or if a function is called through a table, which the portable source does not have.
    pub fn parse(text: &str) -> Result<Self> {
        let functions = functions(text)?;
        ensure!(!functions.is_empty(), "wasm2c has written no function");
        for function in &functions {
            let is_indirect = function.body.iter().any(|line| line.contains("CALL_INDIRECT("));
            ensure!(!is_indirect, "{} calls a function through a pointer", function.name);
        }
        Ok(Self { functions, segments: segments(text)? })
    }
}

/// The functions with a body, but those around the module.
fn functions(text: &str) -> Result<Vec<Function>> {
    let head = Regex::new(r"^static (\w+) (w2c_\w+)\(\w+\* instance(?:, )?(.*)\) \{$")?;
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some(head) = head.captures(line) else { continue };
        let body = lines.by_ref().take_while(|&line| line != "}").map(str::to_owned).collect();
        let parameters = head[3].split(", ").filter(|one| !one.is_empty()).map(str::to_owned);
        found.push(Function {
            name: head[2].to_owned(),
            result: head[1].to_owned(),
            parameters: parameters.collect(),
            body,
        });
    }
    Ok(found)
}

/// The constants, each with its address.
fn segments(text: &str) -> Result<Vec<Segment>> {
    let load = Regex::new(r"LOAD_DATA\(instance->w2c_memory, (\d+)u, (\w+), (\d+)\);")?;
    load.captures_iter(text)
        .map(|load| {
            let bytes = bytes_of(text, &load[2])?;
            ensure!(bytes.len() == load[3].parse::<usize>()?, "{} is cut", &load[2]);
            Ok(Segment { address: load[1].parse()?, bytes })
        })
        .collect()
}

/// The bytes of an array of the source.
fn bytes_of(text: &str, name: &str) -> Result<Vec<u8>> {
    let head = format!("static const u8 {name}[] = {{");
    let (_, after) = text.split_once(&head).with_context(|| format!("no {name}"))?;
    let (array, _) = after.split_once("};").with_context(|| format!("no end of {name}"))?;
    let numbers = array.split(',').map(str::trim).filter(|number| !number.is_empty());
    numbers.map(|number| Ok(u8::from_str_radix(number.trim_start_matches("0x"), 16)?)).collect()
}
