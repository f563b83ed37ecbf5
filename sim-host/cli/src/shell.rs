//! `sonarfix completions` and `sonarfix man`: what a shell and `man` know of the command.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "For this user and bash:\n  sonarfix completions bash > ~/.local/share/bash-completion/completions/sonarfix"
)]
pub struct CompletionsArgs {
    /// The shell.
    shell: Shell,
}

/// Prints the completions of a command for a shell.
pub fn completions(args: &CompletionsArgs, mut of: Command) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut of, "sonarfix", &mut script);
    print!("{}", String::from_utf8(script)?);
    Ok(())
}

#[derive(Debug, clap::Args)]
pub struct ManArgs {
    /// The folder of the pages, for example ~/.local/share/man/man1.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Writes a manual page for a command and for each of its subcommands.
pub fn man(args: &ManArgs, mut of: Command) -> anyhow::Result<()> {
    sonarfix_terminal::output::check_folder("--out", &args.out)?;
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    of.build();
    let pages = page(&of, "sonarfix", &args.out)?;
    println!("{pages} pages: man {}", args.out.join("sonarfix.1").display());
    Ok(())
}

/// Writes the pages of a subcommand and of those below it; returns their number.
fn page(command: &Command, name: &str, folder: &Path) -> anyhow::Result<usize> {
    let mut text = Vec::new();
    Man::new(command.clone()).title(name.to_owned()).render(&mut text)?;
    sonarfix_files::write(&folder.join(format!("{name}.1")), &text)?;
    let below = command.get_subcommands().filter(|it| it.get_name() != "help");
    let pages = below.map(|it| page(it, &format!("{name}-{}", it.get_name()), folder));
    Ok(1 + pages.sum::<anyhow::Result<usize>>()?)
}
