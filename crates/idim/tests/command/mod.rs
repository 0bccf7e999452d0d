//! A command line as a user types it.

use clap::Parser;

#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: idim::cli::Command,
}

/// What the command says, or its error.
pub(crate) fn run(arguments: &[&str]) -> Result<String, String> {
    let all = ["idim"].iter().chain(arguments);
    let parsed = Arguments::try_parse_from(all).map_err(|e| e.to_string())?;
    let mut out = Vec::new();
    idim::cli::run(&parsed.command, &mut out).map_err(|e| e.to_string())?;
    Ok(String::from_utf8(out).unwrap())
}
