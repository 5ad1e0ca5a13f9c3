//! The `gable` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    gable::main()
}
