//! The model of a rule: a quantity, its usual interval, and the causes that may explain a value outside of it.

use super::facts::{Fact, Facts};
use crate::quantity::{Dimension, Limits, NUMBER};

/// A value outside of the usual interval, from which a cause computes what was probably meant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    /// The number as written, without its unit.
    pub number: f64,
    /// The value in the SI unit.
    pub si: f64,
}

/// A mistake that beginners make.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cause {
    /// The mistake, as the end of a sentence.
    pub why: &'static str,
    /// What the value would be without the mistake, in the SI unit.
    pub undo: fn(Reading) -> f64,
    /// Whether the corrected value is known, or only that there is this mistake.
    pub is_exact: bool,
}

/// A cause with a known correction.
pub(super) const fn cause(why: &'static str, undo: fn(Reading) -> f64) -> Cause {
    Cause { why, undo, is_exact: true }
}

/// What is compared with the usual interval.
#[derive(Clone, Copy)]
pub(super) enum Measure {
    /// The value.
    Value,
    /// The value divided by another one, which has this name.
    Per(&'static str, Computed),
    /// Something that follows from the value and others.
    Other(Computed),
}

/// Computes a quantity at a value, in the SI unit.
type Computed = fn(&Facts, &Fact) -> Option<f64>;

/// A quantity with its usual values.
#[derive(Clone, Copy)]
pub(super) struct Rule {
    /// The key of the value.
    pub key: &'static str,
    /// The quantity, for the message.
    pub what: &'static str,
    dimension: &'static Dimension,
    /// The usual interval of what is measured.
    pub usual: Limits,
    pub measure: Measure,
    /// Whether the rule is one for this file.
    applies: fn(&Facts) -> bool,
    permits_zero: bool,
    causes: &'static [Cause],
    /// Where the interval comes from.
    pub source: &'static str,
}

/// What a value was probably meant to be.
pub(super) struct Meant {
    /// The corrected text, if it is known.
    text: Option<String>,
    why: &'static str,
}

impl Rule {
    pub const fn new(
        key: &'static str,
        what: &'static str,
        dimension: &'static Dimension,
        usual: Limits,
        source: &'static str,
    ) -> Self {
        let (measure, permits_zero, causes) = (Measure::Value, false, [].as_slice());
        let applies: fn(&Facts) -> bool = |_| true;
        Self { key, what, dimension, usual, measure, applies, permits_zero, causes, source }
    }

    /// Zero is usual as well.
    pub const fn or_zero(self) -> Self {
        Self { permits_zero: true, ..self }
    }

    /// The rule is one for such files only.
    pub const fn when(self, applies: fn(&Facts) -> bool) -> Self {
        Self { applies, ..self }
    }

    /// These causes are tried after the other units.
    pub const fn because(self, causes: &'static [Cause]) -> Self {
        Self { causes, ..self }
    }

    /// The interval is that of the quotient of the value and another quantity.
    pub const fn per(self, name: &'static str, of: Computed) -> Self {
        Self { measure: Measure::Per(name, of), ..self }
    }

    /// The interval is that of a quantity that follows from the value and others.
    pub const fn computed(self, of: Computed) -> Self {
        Self { measure: Measure::Other(of), ..self }
    }

    fn limits(&self) -> (f64, f64) {
        let is_ratio = matches!(self.measure, Measure::Per(..));
        let dimension = if is_ratio { &NUMBER } else { self.dimension };
        (dimension.number(self.usual.0), dimension.number(self.usual.1))
    }

    /// The message for a value that is not usual.
    pub fn judge(&self, facts: &Facts, fact: &Fact) -> Option<String> {
        let si = fact.value(self.dimension).filter(|_| (self.applies)(facts))?;
        let per = match self.measure {
            Measure::Value => 1.0,
            Measure::Per(_, of) => of(facts, fact).filter(|per| *per != 0.0)?,
            Measure::Other(of) => return self.judge_other(fact, of(facts, fact)?),
        };
        if self.is_usual(si / per) {
            return None;
        }
        let meant = self.meant(fact, si, per);
        Some(format!("{}{}", self.finding(fact, si / per), self.advice(fact, meant)))
    }

    fn judge_other(&self, fact: &Fact, value: f64) -> Option<String> {
        let reading = Reading { number: value, si: value };
        let mut causes = self.causes.iter();
        let cause = causes.find(|cause| self.is_usual((cause.undo)(reading)));
        let meant = cause.map(|cause| Meant { text: None, why: cause.why });
        let ((least, most), what, text) = (self.usual, self.what, fact.quoted());
        let found = self.dimension.written(value, self.dimension.split(least)?.1);
        let finding = format!("with {text}, {what} is {found}: usual are {least} to {most}");
        (!self.is_usual(value)).then(|| format!("{finding}{}", self.advice(fact, meant)))
    }

    fn is_usual(&self, value: f64) -> bool {
        let (least, most) = self.limits();
        let slack = 1e-6 * value.abs();
        (self.permits_zero && value == 0.0) || (least <= value + slack && value - slack <= most)
    }

    fn finding(&self, fact: &Fact, value: f64) -> String {
        let (text, what, (least, most)) = (fact.quoted(), self.what, self.usual);
        match self.measure {
            Measure::Value | Measure::Other(_) => {
                format!("{text} is implausible as {what}: usual are {least} to {most}")
            }
            Measure::Per(name, _) => format!(
                "{text} is implausible as {what}: it is {} times {}, usual are {least} to {most}",
                short(value),
                name
            ),
        }
    }

    fn advice(&self, fact: &Fact, meant: Option<Meant>) -> String {
        match meant {
            Some(Meant { text: Some(text), why: "" }) => {
                format!("; did you mean {}?", fact.quoted_as(&text))
            }
            Some(Meant { text: Some(text), why }) => {
                format!("; did you mean {} ({why})?", fact.quoted_as(&text))
            }
            Some(Meant { text: None, why }) => format!("; {why}"),
            None => format!(
                "; check the number and its unit, or mark the line with `# plausible` ({})",
                self.source
            ),
        }
    }

    /// The first explanation that leads to a usual value: another unit, then the causes, then the decimal point.
    pub fn meant(&self, fact: &Fact, si: f64, per: f64) -> Option<Meant> {
        let (number, unit) = self.dimension.split(&fact.text)?;
        let is_usual = |value: f64| self.is_usual(value / per);
        let (least, most) = self.limits();
        // Of an interval around zero, a value of a third.
        let centre = if least > 0.0 { (least * most).sqrt() } else { most.abs() / 3.0 };
        let far = |value: f64| (value / per / centre).abs().ln().abs();
        // Nobody writes milliradians by mistake.
        let units = self.dimension.readings(&fact.text).into_iter();
        let units = units.filter(|(text, _)| !text.ends_with("mrad"));
        let unit_meant = units.filter(|(_, value)| is_usual(*value));
        let unit_meant = unit_meant.min_by(|(_, a), (_, b)| far(*a).total_cmp(&far(*b)));
        if let Some((text, _)) = unit_meant {
            return Some(Meant { text: Some(text), why: "" });
        }
        let shift = |factor: f64| (factor, is_usual(si * factor));
        let shifts = [10.0, 0.1, 100.0, 0.01, 1e3, 1e-3].map(shift);
        let by_cause = self.causes.iter().find_map(|cause| {
            let value = (cause.undo)(Reading { number, si });
            is_usual(value).then_some((value, cause.why, cause.is_exact))
        });
        let by_shift = || {
            let (factor, _) = shifts.into_iter().find(|(_, is_usual)| *is_usual)?;
            Some((si * factor, "the decimal point", true))
        };
        let by_sign = || is_usual(-si).then_some((-si, "the sign", true));
        let (value, why, is_exact) = by_cause.or_else(by_sign).or_else(by_shift)?;
        let text = is_exact.then(|| self.dimension.written(value, unit));
        Some(Meant { text, why })
    }

    /// What a text that is refused was probably meant to be.
    pub fn suggestion(&self, fact: &Fact) -> Option<String> {
        let si = fact.value(self.dimension)?;
        let is_absolute = matches!(self.measure, Measure::Value);
        let meant =
            if is_absolute && !self.is_usual(si) { self.meant(fact, si, 1.0)?.text } else { None };
        meant.map(|text| fact.quoted_as(&text))
    }
}

/// A number with three digits.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = 2.0 - value.abs().log10().floor();
    let scale = 10_f64.powf(digits.clamp(-300.0, 300.0));
    format!("{}", (value * scale).round() / scale)
}
