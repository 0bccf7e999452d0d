//! Driver of the workspace: all that `idim` does, the gate of the kernels and the rules of the house.

use clap::{Parser, Subcommand};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use xtask::tidy::{CHECKS, Tree};

/// Driver of the idim workspace.
#[derive(Debug, Parser)]
#[command(name = "xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// What the binary does.
    #[command(flatten)]
    Idim(Box<idim::cli::Command>),
    /// Check the rules of the house that a machine can check.
    Tidy,
    /// Compare the kernels' instruction counts with the committed ones (needs valgrind).
    Gate {
        /// Write the new counts instead.
        #[arg(long)]
        bless: bool,
    },
}

fn main() -> ExitCode {
    match Arguments::parse().task {
        Task::Idim(command) => idim::cli::main(&command),
        Task::Tidy => tidy(),
        Task::Gate { bless } => gate(bless),
    }
}

fn gate(bless: bool) -> ExitCode {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    match xtask::gate::run(&root, bless) {
        Ok(table) => {
            // A reader that has gone is no failure of the gate.
            let _ = writeln!(std::io::stdout(), "{table}");
            ExitCode::SUCCESS
        }
        Err(findings) => {
            eprintln!("{findings}");
            ExitCode::FAILURE
        }
    }
}

fn tidy() -> ExitCode {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let tree = Tree::read(&root);
    let findings: Vec<String> = CHECKS.iter().flat_map(|(_, check)| check(&tree)).collect();
    for finding in &findings {
        eprintln!("{finding}");
    }
    if findings.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
