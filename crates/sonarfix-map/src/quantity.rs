//! Numbers with units in a file: `"2.4 mm"`.

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

/// A kind of quantity, and the units it may be written in.
pub(crate) struct Dimension {
    /// With its article: "a length".
    name: &'static str,
    units: &'static [Unit],
}

const HALF_TURN: f64 = std::f64::consts::PI;

/// The unit in place of one that cannot be read.
pub(crate) static METRE: Unit = unit("m", 1.0, 1.0);

pub(crate) const LENGTH: Dimension = Dimension {
    name: "a length",
    units: &[unit("m", 1.0, 1.0), unit("cm", 1.0, 100.0), unit("mm", 1.0, 1000.0)],
};

pub(crate) const ANGLE: Dimension = Dimension {
    name: "an angle",
    units: &[unit("deg", HALF_TURN, 180.0), unit("rad", 1.0, 1.0), unit("mrad", 1.0, 1000.0)],
};

pub(crate) const TIME: Dimension = Dimension {
    name: "a time",
    units: &[unit("s", 1.0, 1.0), unit("ms", 1.0, 1e3), unit("us", 1.0, 1e6)],
};

pub(crate) const TEMPERATURE: Dimension =
    Dimension { name: "a temperature", units: &[unit("degC", 1.0, 1.0)] };

pub(crate) const SPEED: Dimension = Dimension {
    name: "a speed",
    units: &[unit("m/s", 1.0, 1.0), unit("cm/s", 1.0, 100.0), unit("mm/s", 1.0, 1000.0)],
};

pub(crate) const TURN_RATE: Dimension = Dimension {
    name: "a turn rate",
    units: &[unit("deg/s", HALF_TURN, 180.0), unit("rad/s", 1.0, 1.0)],
};

/// Density of the noise of a turn rate: the angle after one second.
pub(crate) const ANGLE_WALK: Dimension = Dimension {
    name: "an angle per square root of the time",
    units: &[unit("deg/sqrt(s)", HALF_TURN, 180.0), unit("rad/sqrt(s)", 1.0, 1.0)],
};

pub(crate) const TURN_RATE_WALK: Dimension = Dimension {
    name: "a turn rate per square root of the time",
    units: &[unit("deg/s/sqrt(s)", HALF_TURN, 180.0), unit("rad/s/sqrt(s)", 1.0, 1.0)],
};

pub(crate) const FRACTION: Dimension =
    Dimension { name: "a fraction", units: &[unit("%", 1.0, 100.0)] };

pub(crate) const LENGTH_PER_LENGTH: Dimension = Dimension {
    name: "a length per length",
    units: &[unit("m/m", 1.0, 1.0), unit("cm/m", 1.0, 100.0), unit("mm/m", 1.0, 1000.0)],
};

pub(crate) const LENGTH_WALK: Dimension = Dimension {
    name: "a length per square root of the distance",
    units: &[unit("m/sqrt(m)", 1.0, 1.0), unit("mm/sqrt(m)", 1.0, 1000.0)],
};

pub(crate) const SCALE_WALK: Dimension = Dimension {
    name: "a fraction per square root of the distance",
    units: &[unit("/sqrt(m)", 1.0, 1.0), unit("%/sqrt(m)", 1.0, 100.0)],
};

impl Dimension {
    /// The unit with this name.
    pub fn unit(&self, name: &str) -> Option<&'static Unit> {
        self.units.iter().find(|unit| unit.name == name)
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

    fn refusal(&self, text: &str) -> String {
        if finite(text).is_some() {
            return self.missing_unit(text);
        }
        let (name, units) = (self.name, self.unit_names());
        let example = self.examples("1").swap_remove(0);
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
