//! Numbers with units in a file: `"2.4 mm"`.

use sonarfix::geometry::units::Duration;

use crate::single;

/// A unit, as a fraction of the SI unit.
///
/// Numerator and denominator are separate, because dividing a whole number of millimetres by 1000 gives the same double
/// as writing it in metres; multiplying by 0.001 does not.
pub(crate) struct Unit {
    name: &'static str,
    times: f64,
    over: f64,
}

const fn unit(name: &'static str, times: f64, over: f64) -> Unit {
    Unit { name, times, over }
}

impl Unit {
    /// A number of this unit in the SI unit.
    pub fn in_si(&self, number: f64) -> f64 {
        number * self.times / self.over
    }
}

/// The least and the largest value of a key, both permitted, written as in a file.
pub(crate) type Limits = (&'static str, &'static str);

/// A kind of quantity, and the units it may be written in.
pub(crate) struct Dimension {
    /// With its article: "a length".
    name: &'static str,
    units: &'static [Unit],
    /// Whether it may also be a number without a unit.
    pub is_bare: bool,
}

const fn dimension(name: &'static str, units: &'static [Unit]) -> Dimension {
    Dimension { name, units, is_bare: false }
}

const HALF_TURN: f64 = std::f64::consts::PI;

/// The unit in place of one that cannot be read.
pub(crate) static METRE: Unit = unit("m", 1.0, 1.0);

pub(crate) static LENGTH: Dimension =
    dimension("a length", &[unit("m", 1.0, 1.0), unit("cm", 1.0, 100.0), unit("mm", 1.0, 1000.0)]);

pub(crate) static ANGLE: Dimension = dimension(
    "an angle",
    &[unit("deg", HALF_TURN, 180.0), unit("rad", 1.0, 1.0), unit("mrad", 1.0, 1000.0)],
);

pub(crate) static TIME: Dimension =
    dimension("a time", &[unit("s", 1.0, 1.0), unit("ms", 1.0, 1e3), unit("us", 1.0, 1e6)]);

pub(crate) static TEMPERATURE: Dimension = dimension("a temperature", &[unit("degC", 1.0, 1.0)]);

pub(crate) static SPEED: Dimension = dimension(
    "a speed",
    &[unit("m/s", 1.0, 1.0), unit("cm/s", 1.0, 100.0), unit("mm/s", 1.0, 1000.0)],
);

pub(crate) static TURN_RATE: Dimension =
    dimension("a turn rate", &[unit("deg/s", HALF_TURN, 180.0), unit("rad/s", 1.0, 1.0)]);

/// Density of the noise of a turn rate: the angle after one second.
pub(crate) static ANGLE_WALK: Dimension = dimension(
    "an angle per square root of the time",
    &[unit("deg/sqrt(s)", HALF_TURN, 180.0), unit("rad/sqrt(s)", 1.0, 1.0)],
);

pub(crate) static TURN_RATE_WALK: Dimension = dimension(
    "a turn rate per square root of the time",
    &[unit("deg/s/sqrt(s)", HALF_TURN, 180.0), unit("rad/s/sqrt(s)", 1.0, 1.0)],
);

pub(crate) static FRACTION: Dimension =
    Dimension { is_bare: true, ..dimension("a fraction", &[unit("%", 1.0, 100.0)]) };

pub(crate) static NUMBER: Dimension = Dimension { is_bare: true, ..dimension("a number", &[]) };

pub(crate) static LENGTH_PER_LENGTH: Dimension = dimension(
    "a length per length",
    &[unit("m/m", 1.0, 1.0), unit("cm/m", 1.0, 100.0), unit("mm/m", 1.0, 1000.0)],
);

pub(crate) static LENGTH_WALK: Dimension = dimension(
    "a length per square root of the distance",
    &[unit("m/sqrt(m)", 1.0, 1.0), unit("mm/sqrt(m)", 1.0, 1000.0)],
);

pub(crate) static SCALE_WALK: Dimension = dimension(
    "a fraction per square root of the distance",
    &[unit("/sqrt(m)", 1.0, 1.0), unit("%/sqrt(m)", 1.0, 100.0)],
);

impl Dimension {
    /// The unit with this name.
    pub fn unit(&self, name: &str) -> Option<&'static Unit> {
        self.units.iter().find(|unit| unit.name == name)
    }

    /// Whether its numbers have units.
    pub fn has_units(&self) -> bool {
        !self.units.is_empty()
    }

    /// The names of the units, for a message.
    pub fn unit_names(&self) -> String {
        let names: Vec<_> = self.units.iter().map(|unit| unit.name).collect();
        names.join(", ")
    }

    /// The quantity in its SI unit.
    ///
    /// # Errors
    /// The error in the text, and what is allowed.
    pub fn parse(&self, text: &str) -> Result<f64, String> {
        let text = text.trim();
        let value = self.units.iter().find_map(|unit| {
            // The text before "m" in "2.4 mm" is not a number, so the order of the units is irrelevant.
            let number = finite(text.strip_suffix(unit.name)?.trim_end())?;
            Some(unit.in_si(number)).filter(|value| value.is_finite())
        });
        value.ok_or_else(|| self.refusal(text))
    }

    /// The number of a text of the table of keys, in the SI unit: one that may be bare may be so here.
    pub fn number(&self, text: &str) -> f64 {
        let bare = finite(text).filter(|_| self.is_bare);
        bare.or_else(|| self.parse(text).ok()).unwrap_or(f64::NAN)
    }

    /// The value of a key: a bare number if it may be one, else the shortest text that is read back exactly.
    pub fn text(&self, value: &dyn Number) -> Option<String> {
        let si = value.get()?;
        if self.is_bare {
            return Some(value.digits(si));
        }
        let texts = self.units.iter().map(|unit| {
            let number = value.digits(si * unit.over / unit.times);
            let read = number.parse().map_or(f64::NAN, |number| unit.in_si(number));
            (value.digits(read) != value.digits(si), format!("\"{number} {}\"", unit.name))
        });
        let (_, text) = texts.min_by_key(|(is_inexact, text)| (*is_inexact, text.len()))?;
        Some(text)
    }

    /// The number of a text and the name of its unit, which is empty for a bare number.
    pub fn split<'t>(&self, text: &'t str) -> Option<(f64, &'t str)> {
        let text = text.trim();
        let mut units = self.units.iter().filter_map(|unit| {
            let number = text.strip_suffix(unit.name)?;
            Some((finite(number.trim_end())?, text.get(number.len()..)?))
        });
        units.next_back().or_else(|| Some((finite(text)?, "")))
    }

    /// The same number in each other unit: the text, and its value in the SI unit.
    pub fn readings(&self, text: &str) -> Vec<(String, f64)> {
        let Some((number, name)) = self.split(text) else { return Vec::new() };
        let digits = text.trim().strip_suffix(name).unwrap_or(text).trim_end();
        let others = self.units.iter().filter(|unit| unit.name != name);
        others.map(|unit| (format!("{digits} {}", unit.name), unit.in_si(number))).collect()
    }

    /// A value of the SI unit with four digits in the unit of this name; bare without one.
    pub fn written(&self, si: f64, name: &str) -> String {
        let Some(unit) = self.unit(name) else { return rounded(si) };
        format!("{} {}", rounded(si * unit.over / unit.times), unit.name)
    }

    fn refusal(&self, text: &str) -> String {
        if finite(text).is_some() {
            return self.missing_unit(text);
        }
        let (name, units) = (self.name, self.unit_names());
        let example = self.examples("1").into_iter().next().unwrap_or_default();
        format!(
            "\"{text}\" is not {name}: write a finite number with a unit ({units}), as in {example}"
        )
    }

    /// The message for a number without a unit.
    pub fn missing_unit(&self, number: &str) -> String {
        let examples = self.examples(number).join(" or ");
        format!("a unit is missing: write {examples}")
    }

    fn examples(&self, number: &str) -> Vec<String> {
        let example = |unit: &Unit| format!("\"{number} {}\"", unit.name);
        self.units.iter().map(example).collect()
    }
}

/// A field of a structure that holds a number.
pub(crate) trait Number {
    /// Stores a value of the SI unit.
    fn set(&mut self, si: f64);
    /// The value in the SI unit; `None` if there is none.
    fn get(&self) -> Option<f64>;
    /// The digits of a number as exact as this field.
    fn digits(&self, number: f64) -> String;
}

impl Number for f32 {
    fn set(&mut self, si: f64) {
        *self = single(si);
    }

    fn get(&self) -> Option<f64> {
        Some((*self).into())
    }

    fn digits(&self, number: f64) -> String {
        single(number).to_string()
    }
}

impl Number for f64 {
    fn set(&mut self, si: f64) {
        *self = si;
    }

    fn get(&self) -> Option<f64> {
        Some(*self)
    }

    fn digits(&self, number: f64) -> String {
        number.to_string()
    }
}

impl<T: Number + Default> Number for Option<T> {
    fn set(&mut self, si: f64) {
        self.insert(T::default()).set(si);
    }

    fn get(&self) -> Option<f64> {
        self.as_ref()?.get()
    }

    fn digits(&self, number: f64) -> String {
        T::default().digits(number)
    }
}

/// Whole microseconds, the resolution of the localizer's time.
impl Number for u64 {
    fn set(&mut self, si: f64) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "rounded, and within the limits of its key"
        )]
        let micros = (si * 1e6).round() as Self;
        *self = micros;
    }

    fn get(&self) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "exact below 285 years")]
        Some(*self as f64 / 1e6)
    }

    fn digits(&self, number: f64) -> String {
        number.to_string()
    }
}

impl Number for Duration {
    fn set(&mut self, si: f64) {
        let mut micros = 0;
        Number::set(&mut micros, si);
        *self = Self::micros(micros);
    }

    fn get(&self) -> Option<f64> {
        self.to_micros().get()
    }

    fn digits(&self, number: f64) -> String {
        number.to_string()
    }
}

/// The digits of a number with at most four significant ones.
fn rounded(number: f64) -> String {
    let text = format!("{number:.3e}");
    text.parse::<f64>().map_or(text, |number| number.to_string())
}

fn finite(text: &str) -> Option<f64> {
    let number: f64 = text.parse().ok()?;
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ALL: [&Dimension; 10] = [
        &LENGTH,
        &ANGLE,
        &TIME,
        &TEMPERATURE,
        &SPEED,
        &TURN_RATE,
        &FRACTION,
        &LENGTH_PER_LENGTH,
        &LENGTH_WALK,
        &SCALE_WALK,
    ];

    #[test]
    fn a_quantity_is_the_nearest_double_in_si_units() {
        let cases = [
            (&LENGTH, "2.4 mm", 0.0024),
            (&LENGTH, "350 mm", 0.35),
            (&LENGTH, "  -5cm ", -0.05),
            (&ANGLE, "180 deg", HALF_TURN),
            (&ANGLE, "1 mrad", 0.001),
            (&TIME, "100 ms", 0.1),
            (&SPEED, "0.4 m/s", 0.4),
            (&FRACTION, "1%", 0.01),
            (&LENGTH_WALK, "0.5 mm/sqrt(m)", 0.0005),
            (&SCALE_WALK, "5e-6/sqrt(m)", 5e-6),
        ];
        for (dimension, text, value) in cases {
            let parsed = dimension.parse(text).unwrap();
            assert_eq!(parsed.to_bits(), f64::to_bits(value), "{text}");
        }
    }

    #[test]
    fn an_invalid_quantity_is_refused_with_the_valid_units() {
        let unit_missing = "a unit is missing: write \"2.4 m\" or \"2.4 cm\" or \"2.4 mm\"";
        assert_eq!(LENGTH.parse("2.4").unwrap_err(), unit_missing);
        for text in
            ["", "inf", "mm", "2.4 kg", "2,4 mm", "inf m", "nan m", "1e999 m", "2.4 m m", "2.4 MM"]
        {
            let refusal = LENGTH.parse(text).unwrap_err();
            let expected = format!(
                "\"{text}\" is not a length: write a finite number with a unit (m, cm, mm), \
                 as in \"1 m\""
            );
            assert_eq!(refusal, expected);
        }
    }

    #[test]
    fn overflow_is_refused() {
        assert!(ANGLE.parse("1e308 deg").is_err());
    }

    proptest! {
        /// Every finite number is read in every unit, with or without a space, however the
        /// number is written.
        #[test]
        fn any_number_is_read(number in -1e12_f64..1e12, space in " {0,3}") {
            for dimension in ALL {
                for unit in dimension.units {
                    for number_text in [format!("{number}"), format!("{number:e}")] {
                        let text = format!("{number_text}{space}{}", unit.name);
                        prop_assert_eq!(dimension.parse(&text), Ok(unit.in_si(number)), "{}", text);
                    }
                }
            }
        }

        /// A number with another dimension's unit, or none, is never read.
        #[test]
        fn no_other_unit_is_read(number in -1e12_f64..1e12) {
            for dimension in ALL {
                let bare = format!("{number}");
                prop_assert!(dimension.parse(&bare).is_err());
                for unit in ALL.iter().flat_map(|other| other.units) {
                    let text = format!("{number} {}", unit.name);
                    let possible = dimension.unit(unit.name).is_some();
                    prop_assert_eq!(dimension.parse(&text).is_ok(), possible, "{}", text);
                }
            }
        }
    }
}
