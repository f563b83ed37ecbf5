//! The compared filters, and the figures of each.

use crate::emulator::Cost;

/// One filter of the table.
pub struct Subject {
    /// Its program in `bench-mcu` or `bench-ours`.
    pub name: &'static str,
    /// Its name in the table.
    pub label: &'static str,
    /// The crate with the version for the table.
    pub package: &'static str,
    /// The form of its covariance update.
    pub form: &'static str,
}

/// The package of `PyPI` with the C source of a peer.
pub const CMSIS: &str = "cmsisdsp";

/// The first two are Sonarfix's.
pub const SUBJECTS: [Subject; 15] = [
    subject("shipped", "**Sonarfix as it ships**", "sonarfix", "plain, if sharp Joseph"),
    subject("kernel", "**Sonarfix's kernel alone**", "sonarfix", "plain, if sharp Joseph"),
    subject("derived", "derived by sympy", "bench-workload", "plain"),
    subject("derived_stabilised", "derived by sympy", "bench-workload", "Joseph"),
    subject("crazyflie", "Crazyflie's form, CMSIS-DSP", CMSIS, "Joseph"),
    subject("naive", "naive nalgebra", "nalgebra", "plain"),
    subject("naive_joseph", "naive nalgebra", "nalgebra", "Joseph"),
    subject("adskalman_symmetric", "adskalman", "adskalman", "symmetrised"),
    subject("adskalman", "adskalman", "adskalman", "Joseph"),
    subject("kfilter", "kfilter", "kfilter", "symmetrised"),
    subject("minikalman", "minikalman, arrays", "minikalman", "plain"),
    subject("minikalman_boxed", "minikalman, boxes", "minikalman", "plain"),
    subject("numeris", "numeris", "numeris", "Joseph"),
    subject("multicalc_passed_in", "multicalc, no trigonometry", "multicalc", "Joseph"),
    subject("multicalc", "multicalc, its own trigonometry", "multicalc", "Joseph"),
];

const fn subject(
    name: &'static str,
    label: &'static str,
    package: &'static str,
    form: &'static str,
) -> Subject {
    Subject { name, label, package, form }
}

/// The cost of a filter on a microcontroller.
pub struct OnTarget {
    pub predict: Cost,
    pub update: Cost,
    /// Bytes of all functions that can be reached from predict and update.
    pub text: u64,
}

impl OnTarget {
    /// Instructions of ten predicts and one update.
    pub fn ten_and_one(&self) -> f64 {
        10.0 * self.predict.mean() + self.update.mean()
    }
}

/// The cost of a filter.
pub struct Figures {
    pub version: String,
    pub m4f: OnTarget,
    pub m4f_fused: OnTarget,
    pub m4f_small: OnTarget,
    pub m3: OnTarget,
    pub m0plus: OnTarget,
    /// Instructions of ten predicts and one update on this machine.
    pub x86: f64,
    /// Nanoseconds of the same.
    pub nanoseconds: f64,
}
