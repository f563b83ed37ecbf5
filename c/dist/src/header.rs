//! The functions that the header declares.

use anyhow::{Context, Result};
use regex::Regex;

/// A function of the header.
#[derive(Debug)]
pub struct Prototype {
    /// The declaration without its semicolon.
    pub text: String,
    /// The type of its result.
    pub result: String,
    /// Its name.
    pub name: String,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
}

/// A parameter of a function.
#[derive(Debug)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: Kind,
}

/// The type of a parameter, as far as its translation depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A pointer.
    Pointer,
    /// An integer of at most 32 bits.
    Integer,
    /// A number that is passed as it is.
    Other,
}

/// The functions of the header whose name begins with `sonarfix_`, in its order.
///
/// # Errors
/// If a parameter has no name.
pub fn prototypes(header: &str) -> Result<Vec<Prototype>> {
    let declaration = Regex::new(r"(?m)^([a-z][\w ]*?[ *]+)(sonarfix_\w+)\(([^;{}]*)\);")?;
    let found = declaration.captures_iter(header);
    found
        .map(|found| {
            Ok(Prototype {
                text: found[0].trim_end_matches(';').to_owned(),
                result: found[1].trim().to_owned(),
                name: found[2].to_owned(),
                parameters: parameters(&found[3])?,
            })
        })
        .collect()
}

fn parameters(list: &str) -> Result<Vec<Parameter>> {
    let parameters = list.split(',').map(str::trim);
    let parameters = parameters.filter(|parameter| !parameter.is_empty() && *parameter != "void");
    parameters
        .map(|parameter| {
            let at = parameter.rfind(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
            let (kind, name) = parameter.split_at(at.context("a parameter without a type")? + 1);
            let kind = match kind.trim() {
                kind if kind.ends_with('*') => Kind::Pointer,
                "float" | "double" | "uint64_t" | "int64_t" => Kind::Other,
                _ => Kind::Integer,
            };
            Ok(Parameter { name: name.to_owned(), kind })
        })
        .collect()
}
