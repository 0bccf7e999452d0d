//! The `idim` binary.

use clap::Parser;

/// Dynamic parameter identification of robot arms.
#[derive(Debug, Parser)]
#[command(name = "idim", version)]
struct Arguments {
    #[command(subcommand)]
    command: idim::cli::Command,
}

fn main() -> std::process::ExitCode {
    idim::cli::main(&Arguments::parse().command)
}
