//! The map file of a survey (`docs/formats.md`), with a comment at each wall.

use std::fmt::Write as _;

use crate::drawing::name;
use crate::survey::{Reason, Survey};

/// The text of the map file.
#[must_use]
pub fn map_text(survey: &Survey) -> String {
    let mut text = String::from("# Written by `sonarfix survey`. Frame: that of the start pose.\n");
    // Writing to a String does not fail.
    let _ = match survey.reasons.as_slice() {
        [] => writeln!(text, "# The map is sure."),
        reasons => writeln!(
            text,
            "# UNSURE: {}.",
            reasons.iter().map(Reason::to_string).collect::<Vec<_>>().join("; ")
        ),
    };
    text.push_str("\nformat = 1\n\n[map]\nunit = \"m\"\nwall = [\n");
    for (index, wall) in survey.walls.iter().enumerate() {
        let _ = writeln!(
            text,
            "    {{ name = \"{}\", from = [{:.4}, {:.4}], to = [{:.4}, {:.4}], accuracy = \"{:.0} mm\" }}, # {} echoes{}",
            name(index),
            wall.from.x,
            wall.from.y,
            wall.to.x,
            wall.to.y,
            1e3 * wall.accuracy,
            wall.echoes,
            if wall.is_confirmed { "" } else { ", not confirmed" }
        );
    }
    text.push_str("]\n");
    text
}
