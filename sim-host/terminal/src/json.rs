//! Answers as JSON.

/// Prints a value as JSON.
///
/// # Errors
/// If it has no representation in JSON.
pub fn print(value: &impl serde::Serialize) -> anyhow::Result<()> {
    println!("{}", serde_json::to_string_pretty(value)?);
    Ok(())
}
