//! What a study of trials prints.

use serde::Serialize;
use sonarfix_report::Table;

#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Output {
    /// Prints every trial.
    #[arg(long)]
    trials: bool,
    /// Prints JSON instead of a table.
    #[arg(long)]
    json: bool,
}

impl Output {
    /// Prints the summary, in JSON by this name, and the trials: those in a table only if they are asked for.
    pub fn print<S: Serialize, T: Serialize>(
        self,
        (name, summary): (&str, &S),
        trials: &[T],
        of_summary: impl FnOnce(&S) -> Table,
        of_trials: impl FnOnce(&[T]) -> Table,
    ) -> anyhow::Result<()> {
        if self.json {
            let value = serde_json::json!({ name: summary, "trials": trials });
            return sonarfix_terminal::json::print(&value);
        }
        if self.trials {
            println!("{}\n", of_trials(trials).text());
        }
        println!("{}", of_summary(summary).text());
        Ok(())
    }
}

/// A time, seconds, and whether what was found then is wrong; a dash if nothing was.
pub fn found(after: Option<f64>, is_right: bool) -> String {
    let wrong = if is_right { "" } else { ", wrong" };
    after.map_or("-".to_owned(), |after| format!("{after:.1} s{wrong}"))
}
