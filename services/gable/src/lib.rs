//! The `gable` command: from the textured photogrammetry mesh of a city to its buildings.
//!
//! A program with methods of its own installs them and goes on as this one:
//!
//! ```no_run
//! use gable_pipeline::params::Registry;
//!
//! fn main() -> std::process::ExitCode {
//!     let methods = Registry::built_in(); // .with_reconstruction(&MyMethod)
//!     methods.install().expect("nothing has run yet");
//!     gable::main()
//! }
//! ```

mod cli;
mod commands;
mod exit;
mod interrupt;
#[cfg(feature = "otlp")]
mod otlp;
#[cfg(feature = "otlp")]
mod otlp_client;
mod progress;
mod remote;
mod sandbox;
mod send;
mod service;
mod table;
mod terminal;

use clap::Parser;
use std::process::ExitCode;

/// Does what the command line says.
pub fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    terminal::start_logging(cli.global.verbose, cli.global.quiet, cli.command.log_format());
    let result = commands::dispatch(&cli);
    if let Err(error) = &result {
        exit::tell(error, cli.command.json());
    }
    #[cfg(feature = "otlp")]
    otlp::flush();
    exit::code(&result)
}
