//! One colour per role, in figures and player, in light and dark mode.
//!
//! The hues are those of Okabe and Ito, "Color Universal Design" (2008), which people with any of
//! the common colour vision deficiencies can distinguish. In dark mode they are lighter, with the same
//! contrast to the page.

use std::fmt::Write as _;

use plotters::style::RGBColor;

/// Red, green and blue.
type Rgb = (u8, u8, u8);

/// The role of a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Background.
    Paper,
    /// Text and axes.
    Ink,
    /// The lines of a grid.
    Grid,
    /// The walls of the map.
    Wall,
    /// What is not in the map.
    Obstacle,
    /// The truth.
    Truth,
    /// The estimate.
    Estimate,
    /// Dead reckoning.
    Encoders,
    /// One standard deviation either side.
    Band,
    /// Estimate less truth.
    Error,
    /// A range that corrected the filter.
    Accepted,
    /// A range beyond the gate.
    Gated,
    /// No usable range.
    Refused,
}

impl Role {
    /// Every role, in the order of the style sheet.
    const ALL: [Self; 13] = [
        Self::Paper,
        Self::Ink,
        Self::Grid,
        Self::Wall,
        Self::Obstacle,
        Self::Truth,
        Self::Estimate,
        Self::Encoders,
        Self::Band,
        Self::Error,
        Self::Accepted,
        Self::Gated,
        Self::Refused,
    ];

    /// The name of its CSS variable, without the dashes.
    const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Ink => "ink",
            Self::Grid => "grid",
            Self::Wall => "wall",
            Self::Obstacle => "obstacle",
            Self::Truth => "truth",
            Self::Estimate => "estimate",
            Self::Encoders => "encoders",
            Self::Band => "band",
            Self::Error => "error",
            Self::Accepted => "accepted",
            Self::Gated => "gated",
            Self::Refused => "refused",
        }
    }

    /// Its colour on white. No two are the same: the style sheet finds a role by its colour.
    const fn light(self) -> Rgb {
        match self {
            Self::Paper => (0xFF, 0xFF, 0xFF),
            Self::Ink => (0x1B, 0x1F, 0x24),
            Self::Grid => (0xE3, 0xE6, 0xEA),
            Self::Wall => (0x6B, 0x72, 0x80),
            Self::Obstacle => (0x8C, 0x6B, 0x4F),
            Self::Truth => (0x00, 0x00, 0x00),
            Self::Estimate => (0x00, 0x72, 0xB2),
            Self::Encoders => (0xD5, 0x5E, 0x00),
            Self::Band => (0x56, 0xB4, 0xE9),
            Self::Error => (0xCC, 0x79, 0xA7),
            Self::Accepted => (0x00, 0x9E, 0x73),
            Self::Gated => (0xE6, 0x9F, 0x00),
            Self::Refused => (0x9A, 0xA0, 0xA8),
        }
    }

    /// Its colour on a dark page.
    const fn dark(self) -> Rgb {
        match self {
            Self::Paper => (0x16, 0x1B, 0x22),
            Self::Ink => (0xE6, 0xE9, 0xED),
            Self::Grid => (0x2B, 0x32, 0x3B),
            Self::Wall => (0x9A, 0xA3, 0xAF),
            Self::Obstacle => (0xB8, 0x95, 0x78),
            Self::Truth => (0xFF, 0xFF, 0xFF),
            Self::Estimate => (0x3F, 0xA9, 0xE8),
            Self::Encoders => (0xF0, 0x80, 0x3C),
            Self::Band => (0x56, 0xB4, 0xE9),
            Self::Error => (0xE3, 0xA0, 0xC6),
            Self::Accepted => (0x2C, 0xC2, 0x95),
            Self::Gated => (0xF2, 0xB6, 0x32),
            Self::Refused => (0x7C, 0x84, 0x8F),
        }
    }

    /// Its colour on white, for a figure.
    pub(super) const fn rgb(self) -> RGBColor {
        let (red, green, blue) = self.light();
        RGBColor(red, green, blue)
    }
}

/// The palette as a style sheet: variables for the page and the player, and rules that map the
/// colours of the figures, drawn for a white page, to these variables.
#[must_use]
pub fn css() -> String {
    let mut css = format!(":root{{{}}}\n", variables(Role::light));
    let night = variables(Role::dark);
    put(&mut css, format_args!("@media (prefers-color-scheme:dark){{:root{{{night}}}}}\n"));
    for role in Role::ALL {
        let (name, colour) = (role.name(), hex(role.light()).to_uppercase());
        for paint in ["fill", "stroke"] {
            put(
                &mut css,
                format_args!("figure svg [{paint}=\"{colour}\"]{{{paint}:var(--{name})}}\n"),
            );
        }
    }
    css
}

/// The declarations of every variable, each `--name:#rrggbb;`.
fn variables(colour: fn(Role) -> Rgb) -> String {
    let mut css = String::new();
    for role in Role::ALL {
        put(&mut css, format_args!("--{}:{};", role.name(), hex(colour(role))));
    }
    css
}

pub(super) fn hex((red, green, blue): Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Appends to a string, which does not fail.
fn put(text: &mut String, more: std::fmt::Arguments<'_>) {
    let _ = text.write_fmt(more);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two roles of one colour would be mapped to the same colour in dark mode.
    #[test]
    fn no_two_roles_share_a_colour() {
        for (n, a) in Role::ALL.into_iter().enumerate() {
            for b in Role::ALL.into_iter().skip(n + 1) {
                assert_ne!(a.light(), b.light(), "{a:?} and {b:?}");
            }
        }
    }

    #[test]
    fn every_role_has_a_variable_and_a_night_colour() {
        let css = css();
        for role in Role::ALL {
            assert!(css.contains(&format!("--{}:{}", role.name(), hex(role.light()))));
            assert!(css.contains(&format!("--{}:{}", role.name(), hex(role.dark()))));
            assert!(css.contains(&format!("stroke:var(--{})", role.name())));
        }
    }
}
