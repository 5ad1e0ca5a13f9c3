//! The commands.

mod bench;
mod city;
mod demo;
mod download;
mod eval;
mod jobs;
mod params;
mod run;
mod schedule;
mod serve;
mod synth;
mod task;
mod thinned;
mod token;
mod train;
mod work;

use crate::cli::{Cli, Command, ParamArgs};
use crate::exit::{Outcome, UsageError};
use anyhow::Context as _;
use gable_files::Reach;
use gable_pipeline::Params;
use std::path::{Path, PathBuf};

/// Runs the command that was given.
pub(crate) fn dispatch(cli: &Cli) -> anyhow::Result<Outcome> {
    match &cli.command {
        Command::Run(args) => run::run(args, cli.global.quiet),
        Command::Demo(args) => demo::run(args, cli.global.quiet),
        Command::Eval(args) => eval::run(args),
        Command::Bench(args) => bench::run(args, cli.global.quiet),
        Command::Synth(args) => synth::run(args, cli.global.quiet),
        Command::Train(args) => train::run(args, cli.global.quiet),
        Command::Params(args) => params::run(args),
        Command::Serve(args) => serve::run(args),
        Command::Work(args) => work::run(args),
        Command::Token(args) => token::run(args),
        Command::Submit(args) => jobs::submit(args, cli.global.quiet),
        Command::Status(args) => jobs::status(args),
        Command::Cancel(args) => jobs::cancel(args),
        Command::Retry(args) => jobs::retry(args),
        Command::Download(args) => download::run(args, cli.global.quiet),
        Command::City(args) => city::run(args),
        Command::Upload(args) => city::upload(args),
        Command::Delete(args) => jobs::delete(args),
        Command::Audit(args) => city::audit(args),
        Command::Schedule(args) => schedule::run(args),
        Command::Task(args) => task::run(args),
    }
}

/// The mesh that a path stands for: a folder that `gable synth` has made holds it in `mesh`, beside the truth.
pub(crate) fn mesh_folder(path: &Path) -> PathBuf {
    let made = path.join("truth").join("truth.json").is_file();
    let inner = path.join("mesh");
    if made && inner.is_dir() { inner } else { path.to_owned() }
}

/// What a mesh may name: what lies in some folders, or, without any, all that the user may read.
pub(crate) fn reach(roots: &[PathBuf]) -> anyhow::Result<Reach> {
    if roots.is_empty() {
        return Ok(Reach::everything());
    }
    Ok(Reach::within(roots).map_err(|e| UsageError(format!("--source-root {e}")))?)
}

/// The values that the arguments ask for.
pub(crate) fn assemble(args: &ParamArgs) -> anyhow::Result<Params> {
    let config = args.config.as_ref().map(|path| {
        std::fs::read_to_string(path).map_err(|e| UsageError(format!("config file {}: {e}", path.display())))
    });
    let config = config.transpose()?;
    let mut settings = Vec::new();
    for setting in &args.settings {
        let Some((name, value)) = setting.split_once('=') else {
            return Err(UsageError(format!("--set {setting:?} has no value: write --set NAME=VALUE")).into());
        };
        settings.push((name.to_owned(), value.to_owned()));
    }
    if let Some(grid) = &args.grid {
        let (columns, rows) = if grid == "auto" { ("0", "0") } else { counts(grid)? };
        settings.push(("grid.columns".to_owned(), columns.to_owned()));
        settings.push(("grid.rows".to_owned(), rows.to_owned()));
        settings.push(("grid.block_size".to_owned(), "0".to_owned()));
    }
    let flags = [
        ("sampling.step", &args.step),
        ("grid.block_size", &args.block_size),
        ("method", &args.method),
        ("input.up", &args.up),
        ("input.crs", &args.crs),
        ("input.origin", &args.origin),
        ("input.error", &args.error),
        ("output.formats", &args.formats),
        ("resources.threads", &args.threads),
        ("resources.memory", &args.memory),
    ];
    if args.strict {
        settings.push(("input.strict".to_owned(), "true".to_owned()));
    }
    for (name, value) in flags {
        if let Some(value) = value {
            settings.push((name.to_owned(), value.clone()));
        }
    }
    let params = Params::assemble(args.preset.as_deref(), config.as_deref(), &settings);
    match &args.config {
        Some(path) => params.with_context(|| format!("with config file {}", path.display())),
        None => Ok(params?),
    }
}

/// Columns and rows, as `--grid` has them. Zero, which stands for a grid that fits, is left to `auto`.
fn counts(grid: &str) -> Result<(&str, &str), UsageError> {
    let counts = grid.split_once(['x', 'X', '×']).map(|(columns, rows)| (columns.trim(), rows.trim()));
    let nothing = |count: &str| !count.is_empty() && count.bytes().all(|digit| digit == b'0');
    match counts {
        Some((columns, rows)) if !nothing(columns) && !nothing(rows) => Ok((columns, rows)),
        _ => {
            let what = "write columns x rows, such as 16x16, or auto for a grid that fits the size";
            Err(UsageError(format!("--grid {grid:?} cannot be read: {what}")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(set: &[&str]) -> ParamArgs {
        ParamArgs { settings: set.iter().map(|s| (*s).to_owned()).collect(), ..ParamArgs::default() }
    }

    #[test]
    fn flags_set_parameters() {
        let flags = ParamArgs {
            grid: Some("4x3".to_owned()),
            method: Some("zhu2018".to_owned()),
            step: Some("0.3".to_owned()),
            ..args(&["step=0.1"])
        };
        let params = assemble(&flags).unwrap();
        assert_eq!((params.grid.columns, params.grid.rows, params.sampling.step), (4, 3, 0.3));
        assert_eq!(params.modeling.method, "zhu2018");
        let auto = ParamArgs { grid: Some("auto".to_owned()), ..args(&["grid.columns=5", "grid.block_size=50"]) };
        assert_eq!(assemble(&auto).unwrap().grid, Params::default().grid);
    }

    #[test]
    fn wrong_flags_are_usage_errors() {
        let message = |args: &ParamArgs| assemble(args).unwrap_err().to_string();
        assert!(message(&args(&["step"])).contains("--set NAME=VALUE"));
        assert!(message(&ParamArgs { grid: Some("16".to_owned()), ..args(&[]) }).contains("16x16"));
        let absent = ParamArgs { config: Some("/does/not/exist.toml".into()), ..args(&[]) };
        assert!(message(&absent).contains("/does/not/exist.toml"));
    }
}
