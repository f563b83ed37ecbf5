//! The rules of a configuration, and the name of the field that breaks one.

#![expect(unsafe_code, reason = "exports a function to C")]

use core::ffi::c_char;

use super::sonarfix_config_t;
use crate::memory::give;
use crate::status::sonarfix_status_t;

/// Bytes of the name of a field.
pub const SONARFIX_FIELD_LENGTH: usize = 48;
/// Bytes of a rule.
pub const SONARFIX_RULE_LENGTH: usize = 96;

/// The first field of a configuration that breaks a rule, and the rule, as texts that end with zero. Both are empty if all fields are
/// right.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sonarfix_config_error_t {
    /// The field, as in a robot file: a ranger's begins with `sonar`.
    pub field: [c_char; SONARFIX_FIELD_LENGTH],
    /// What it must be.
    pub rule: [c_char; SONARFIX_RULE_LENGTH],
}

impl sonarfix_config_error_t {
    pub(crate) fn of(checked: core::result::Result<(), (&str, &str)>) -> Self {
        let (field, rule) = checked.err().unwrap_or_default();
        Self { field: text(field), rule: text(rule) }
    }
}

/// A text that ends with zero; its end is cut off if it is too long.
fn text<const N: usize>(text: &str) -> [c_char; N] {
    let mut bytes = [0; N];
    if let Some((_, free)) = bytes.split_last_mut() {
        for (to, byte) in free.iter_mut().zip(text.bytes()) {
            *to = c_char::from_ne_bytes([byte]);
        }
    }
    bytes
}

/// Checks every field of a configuration, and names the first one that breaks its rule.
///
/// A program that does not call this function does not link the texts.
///
/// @param config  the configuration
/// @param error  gets the field and its rule as texts; empty texts if every rule is met
/// @return SONARFIX_OK if the check was made, also if it found an error; SONARFIX_ERROR_VALUE or SONARFIX_ERROR_NOT_LINKED if a
///   field has no meaning to this library; or an error of a pointer
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_config_check(
    config: *const sonarfix_config_t,
    error: *mut sonarfix_config_error_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { give(error, || Ok(error_of(&super::config_of(config)?))) }
}

fn error_of(config: &sonarfix::config::Config) -> sonarfix_config_error_t {
    sonarfix_config_error_t::of(config.check().map_err(|error| (error.field, error.rule)))
}
