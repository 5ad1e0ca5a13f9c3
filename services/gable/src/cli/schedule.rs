//! Arguments of `gable schedule`.

use super::RemoteArgs;
use clap::{Args, Subcommand};

const SCHEDULE_HELP: &str = "\
Examples:
  gable schedule create delft s3://gable/meshes/delft --city delft --cron '30 2 * * MON' --zone Europe/Amsterdam
  gable schedule list
  gable schedule show delft
  gable schedule run delft
  gable schedule delete delft

A cron expression has minute, hour, day of the month, month and weekday. Each tick submits a job, unless the one before is not over;
later jobs of a city do only what has changed.";

/// Arguments of `gable schedule`.
#[derive(Args, Debug)]
#[command(after_help = SCHEDULE_HELP)]
pub(crate) struct ScheduleArgs {
    #[command(subcommand)]
    pub(crate) action: ScheduleAction,
}

/// What to do with schedules.
#[derive(Debug, Subcommand)]
pub(crate) enum ScheduleAction {
    /// Make a schedule, or change the one of this name
    Create(CreateArgs),
    /// List schedules
    List(ListArgs),
    /// Show a schedule and its last runs
    Show(NameArgs),
    /// Submit its job now
    Run(NameArgs),
    /// Remove a schedule; its jobs stay
    Delete(NameArgs),
}

/// Arguments of `gable schedule create`.
#[derive(Args, Debug)]
pub(crate) struct CreateArgs {
    /// Name of the schedule: letters, digits, and . _ -
    pub(crate) name: String,
    /// The mesh, as the service sees it
    pub(crate) source: String,
    /// Name of the city that it shows
    #[arg(long, value_name = "NAME")]
    pub(crate) city: String,
    /// When, as a cron expression
    #[arg(long, value_name = "EXPRESSION")]
    pub(crate) cron: String,
    /// Time zone of that, by its name in the IANA database
    #[arg(long, value_name = "ZONE", default_value = "UTC")]
    pub(crate) zone: String,
    /// What becomes of ticks at which the service was down: skip, or once for one job as soon as it is there again
    #[arg(long, value_name = "WHAT", default_value = "skip")]
    pub(crate) missed: String,
    /// Do not tick yet
    #[arg(long)]
    pub(crate) disabled: bool,
    /// A named set of values
    #[arg(long, value_name = "NAME")]
    pub(crate) preset: Option<String>,
    /// Set any parameter; may be given many times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub(crate) settings: Vec<String>,
    /// Print the schedule as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}

/// Arguments of `gable schedule list`.
#[derive(Args, Debug)]
pub(crate) struct ListArgs {
    /// Print the list as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}

/// Arguments of the commands about one schedule.
#[derive(Args, Debug)]
pub(crate) struct NameArgs {
    /// Name of the schedule
    pub(crate) name: String,
    /// Print the answer as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}

impl ScheduleArgs {
    /// Whether the answer is to be JSON.
    pub(crate) fn json(&self) -> bool {
        match &self.action {
            ScheduleAction::Create(args) => args.json,
            ScheduleAction::List(args) => args.json,
            ScheduleAction::Show(args) | ScheduleAction::Run(args) | ScheduleAction::Delete(args) => args.json,
        }
    }
}
