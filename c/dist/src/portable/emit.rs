//! The portable source: functions and constants of the module, and a function of the header for each that it exports.

use std::fmt::Write;

use anyhow::{Context, Result, ensure};
use regex::{Captures, Regex};

use super::access::Accesses;
use super::module::{Function, Module, Segment};
use super::stack::Stacks;
use crate::header::{Kind, Parameter, Prototype};

/// What the functions of the module need: loads, stores and numbers as WebAssembly defines them.
const RUNTIME: &str = include_str!("runtime.c");

/// Writes the portable source of a module whose constants begin at `base`.
///
/// # Errors
/// If the module is not as expected.
pub fn emit(
    module: &Module,
    accesses: Accesses,
    prototypes: &[Prototype],
    base: u32,
) -> Result<String> {
    let constants = Constants::new(&module.segments, base)?;
    let mut text = RUNTIME.to_owned();
    text += &constants.array()?;
    let stacks = Stacks::new(&module.functions)?;
    // A composition lacks the functions of the parts that it leaves out.
    let names: Vec<_> = prototypes.iter().map(|one| format!("w2c_{}", one.name)).collect();
    let reached = stacks.reached(names.iter().map(String::as_str));
    let is_reached = |function: &&Function| reached.contains(function.name.as_str());
    for function in module.functions.iter().filter(is_reached) {
        writeln!(text, "{};", signature(function))?;
    }
    let mut translator = Translator::new(accesses, &constants)?;
    for function in &module.functions {
        let translated = translator.function(function)?;
        if is_reached(&function) {
            text += &translated;
        }
    }
    ensure!(translator.accesses.is_empty(), "the source has fewer accesses than the module");
    for (prototype, name) in prototypes.iter().zip(&names) {
        if reached.contains(name.as_str()) {
            text += &exported(prototype, stacks.of(name)?)?;
        }
    }
    Ok(text)
}

/// The name of a function of the module in Rust.
fn rust_name(function: &Function) -> String {
    let mangled = function.name.trim_start_matches("w2c_");
    format!("{:#}", rustc_demangle::demangle(mangled))
}

fn signature(function: &Function) -> String {
    let parameters = function.parameters.iter().map(|parameter| format!(", {parameter}"));
    let parameters: String = parameters.collect();
    format!("static {} {}(u32 *sp{parameters})", function.result, function.name)
}

/// A function of the header, which passes its arguments to that of the module with a stack of its own.
fn exported(prototype: &Prototype, bytes: u32) -> Result<String> {
    let mut text = format!("\n{} {{\n", prototype.text);
    let stack = if bytes == 0 { "NULL" } else { "&sp" };
    if bytes > 0 {
        // One word more: where the stack pointer begins need not be a multiple of eight.
        writeln!(text, "    u64 stack[{}];", bytes.div_ceil(8) + 1)?;
        writeln!(text, "    u32 sp = ADDRESS(stack + {});", bytes.div_ceil(8))?;
    }
    let arguments = prototype.parameters.iter().map(|parameter| {
        let Parameter { name, kind } = parameter;
        match kind {
            Kind::Pointer => format!(", ADDRESS({name})"),
            Kind::Integer => format!(", (u32){name}"),
            Kind::Other => format!(", {name}"),
        }
    });
    let arguments: String = arguments.collect();
    let call = format!("w2c_{}({stack}{arguments})", prototype.name);
    match prototype.result.as_str() {
        "void" => writeln!(text, "    {call};\n}}")?,
        result if result.ends_with('*') => {
            writeln!(text, "    return ({result})(uintptr_t){call};\n}}")?;
        }
        result => writeln!(text, "    return ({result}){call};\n}}")?,
    }
    Ok(text)
}

/// The constants of the module as one array.
struct Constants {
    base: u32,
    bytes: Vec<u8>,
}

impl Constants {
    fn new(segments: &[Segment], base: u32) -> Result<Self> {
        let mut bytes = Vec::new();
        for segment in segments {
            let at = segment.address.checked_sub(base).context("constants below the base")?;
            let at = usize::try_from(at)?;
            ensure!(at >= bytes.len(), "constants are not in order");
            bytes.resize(at, 0);
            bytes.extend_from_slice(&segment.bytes);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        Ok(Self { base, bytes })
    }

    /// A number as C: an address of a constant relative to the array.
    fn word(&self, word: u32) -> Option<String> {
        let at = word.checked_sub(self.base)?;
        let is_inside = usize::try_from(at).is_ok_and(|at| at <= self.bytes.len());
        is_inside.then(|| format!("CONSTANT({at})"))
    }

    fn array(&self) -> Result<String> {
        let mut text = format!("static const u32 constants[{}] = {{", self.bytes.len() / 4);
        for (k, bytes) in self.bytes.chunks(4).enumerate() {
            let word = u32::from_le_bytes(bytes.try_into()?);
            text += if k % 8 == 0 { "\n    " } else { " " };
            text += &self.word(word).unwrap_or_else(|| format!("{word:#x}"));
            text += ",";
        }
        Ok(text + "\n};\n\n")
    }
}

/// Translates functions in the order of the module.
struct Translator<'m> {
    accesses: Accesses,
    constants: &'m Constants,
    access: Regex,
    float: Regex,
    number: Regex,
    long_number: Regex,
}

impl<'m> Translator<'m> {
    fn new(accesses: Accesses, constants: &'m Constants) -> Result<Self> {
        let access = r"\b([if]\d\d_(?:load|store)\w*)\(&instance->w2c_memory, \(u64\)\((\w+)\)(?: \+ (\d+)u?)?";
        Ok(Self {
            accesses,
            constants,
            access: Regex::new(access)?,
            float: Regex::new(r"^( *w2c_f\d+ = )(-?\d+(?:\.\d+)?(?:e[-+]?\d+)?);$")?,
            number: Regex::new(r"\b(\d+)u\b")?,
            long_number: Regex::new(r"\b(\d+)ull\b")?,
        })
    }

    fn function(&mut self, function: &Function) -> Result<String> {
        let mut text = format!("\n/* {} */\n{} {{\n", rust_name(function), signature(function));
        for line in &function.body {
            if !matches!(line.trim(), "FUNC_PROLOGUE;" | "FUNC_EPILOGUE;") {
                text += &self.line(line)?;
                text += "\n";
            }
        }
        Ok(text + "}\n")
    }

    fn line(&mut self, line: &str) -> Result<String> {
        let line = self.accesses_of(line)?;
        let line = line.replace("instance->w2c___stack_pointer", "*sp");
        let line = line.replace("&instance->w2c_memory, ", "");
        let line = line.replace("(instance, ", "(sp, ").replace("(instance)", "(sp)");
        ensure!(!line.contains("instance"), "an unknown use of the instance: {line}");
        let line = self.float.replace(&line, |found: &Captures<'_>| {
            let point = if found[2].contains(['.', 'e']) { "" } else { ".0" };
            format!("{}{}{point}f;", &found[1], &found[2])
        });
        Ok(self.numbers_of(&line))
    }

    /// Loads and stores, by whether they are aligned.
    fn accesses_of(&mut self, line: &str) -> Result<String> {
        let Some(found) = self.access.captures(line) else { return Ok(line.to_owned()) };
        let offset = found.get(3).map_or("0", |offset| offset.as_str());
        let is_aligned = self.accesses.next_is_aligned(&found[1], offset.parse()?)?;
        let suffix = if is_aligned { "" } else { "_unaligned" };
        let address = if offset == "0" { String::new() } else { format!(" + {offset}u") };
        let access = format!("{}{suffix}({}{address}", &found[1], &found[2]);
        let replaced = line.replacen(&found[0], &access, 1);
        ensure!(self.access.captures(&replaced).is_none(), "two accesses in {line}");
        Ok(replaced)
    }

    /// Addresses of constants, alone or as half of a number of 64 bits.
    fn numbers_of(&self, line: &str) -> String {
        let word = |number: u32| self.constants.word(number);
        let short = self.number.replace_all(line, |found: &Captures<'_>| {
            found[1].parse().ok().and_then(word).unwrap_or_else(|| found[0].to_owned())
        });
        let long = self.long_number.replace_all(&short, |found: &Captures<'_>| {
            let Ok(number) = found[1].parse::<u64>() else { return found[0].to_owned() };
            let half = |shift: u32| u32::try_from((number >> shift) & 0xffff_ffff).ok();
            let (high, low) = (half(32).and_then(word), half(0).and_then(word));
            if high.is_none() && low.is_none() {
                return found[0].to_owned();
            }
            let text = |name: Option<String>, shift: u32| {
                name.unwrap_or_else(|| format!("{}u", (number >> shift) & 0xffff_ffff))
            };
            format!("(((u64){} << 32) | {})", text(high, 32), text(low, 0))
        });
        long.into_owned()
    }
}
