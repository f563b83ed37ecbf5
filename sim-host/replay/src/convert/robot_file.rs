//! Writes `robot.toml`, with the source of each value as a comment.

use std::path::Path;

use crate::convert::{ConvertError, Out};

/// A value as written in the file, and its source.
pub struct Value(pub String, pub &'static str);

impl Value {
    /// A text, in quotation marks.
    #[must_use]
    pub fn text(value: &str, source: &'static str) -> Self {
        Self(format!("\"{value}\""), source)
    }
}

/// A robot file: tables of keys.
pub type Tables = Vec<(&'static str, Vec<(&'static str, Value)>)>;

/// The keys of a servo and a ranger, for a recording that has neither: a replay uses none of them. Bearings in degrees.
#[must_use]
pub fn no_servo(rightmost: f64, leftmost: f64) -> [(&'static str, Value); 3] {
    let pulse = |width: &str, bearing: f64| {
        format!("{{ width = \"{width}\", bearing = \"{bearing:.1} deg\" }}")
    };
    let pulses = format!("[{}, {}]", pulse("100 us", rightmost), pulse("900 us", leftmost));
    [
        (
            "servo_pulses",
            Value(pulses, "made up: the recording has no servo, and no replay needs it"),
        ),
        ("servo_timing", Value::text("instant", "likewise")),
        ("ranger", Value::text("hc_sr04", "likewise")),
    ]
}

/// Writes a robot file.
///
/// # Errors
/// [`ConvertError::Write`].
pub fn write(dir: &Path, name: &str, comment: &str, tables: Tables) -> Result<(), ConvertError> {
    let mut out = Out::create(dir.join(name))?;
    out.line(format_args!("# {comment}\nformat = 1"))?;
    out.line("start = \"unknown\"  # where the log has a start it is used; a lost robot searches for its pose")?;
    for (table, values) in tables {
        out.line(format_args!("\n[{table}]"))?;
        for (key, Value(value, source)) in values {
            out.line(format_args!("{key} = {value}  # {source}"))?;
        }
    }
    out.close()
}
