//! Arguments of `gable city` and `gable audit`.

use super::RemoteArgs;
use clap::{Args, Subcommand};

const CITY_HELP: &str = "\
Examples:
  gable city list
  gable city show delft
  gable city members delft
  gable city share delft bob editor
  gable city share delft group:planning viewer
  gable city unshare delft bob
  gable city roll-back delft 12
  gable city delete-generation delft 11
  gable city delete delft --confirm delft

A city is of whoever submits its first job. Viewers look at it and its jobs; editors submit jobs and steer their own; owners steer all
of its jobs, say who its members are, and roll it back.";

/// Arguments of `gable city`.
#[derive(Args, Debug)]
#[command(after_help = CITY_HELP)]
pub(crate) struct CityArgs {
    #[command(subcommand)]
    pub(crate) action: CityAction,
    /// Print the answer as JSON on standard output
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

/// What to do with cities.
#[derive(Debug, Subcommand)]
pub(crate) enum CityAction {
    /// List cities
    List(AtArgs),
    /// Show a city and its last generations
    Show(OneCityArgs),
    /// List the members of a city
    Members(OneCityArgs),
    /// Make someone a member, or change what they may do
    Share {
        #[command(flatten)]
        of: OneCityArgs,
        /// Name of a token, or group:NAME
        member: String,
        /// viewer, editor or owner
        role: String,
    },
    /// Let someone be a member no longer
    Unshare {
        #[command(flatten)]
        of: OneCityArgs,
        /// Name of a token, or group:NAME
        member: String,
    },
    /// Delete a generation that readers do not see
    DeleteGeneration {
        #[command(flatten)]
        of: OneCityArgs,
        /// Its number
        generation: i64,
    },
    /// Delete a city with its generations, jobs and members
    Delete {
        #[command(flatten)]
        of: OneCityArgs,
        /// The name of the city once more: nothing of it can be had back
        #[arg(long, value_name = "NAME")]
        confirm: String,
    },
    /// Publish an earlier generation anew, as the newest one
    RollBack {
        #[command(flatten)]
        of: OneCityArgs,
        /// Its number
        generation: i64,
    },
}

const UPLOAD_HELP: &str = "\
Examples:
  gable upload list
  gable upload delete 0198c0de-5f01-7a30-8000-2f0d6b1c9a55";

/// Arguments of `gable upload`.
#[derive(Args, Debug)]
#[command(after_help = UPLOAD_HELP)]
pub(crate) struct UploadArgs {
    #[command(subcommand)]
    pub(crate) action: UploadAction,
    /// Print the answer as JSON on standard output
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

/// What to do with uploads.
#[derive(Debug, Subcommand)]
pub(crate) enum UploadAction {
    /// List the meshes that were sent
    List(AtArgs),
    /// Delete a mesh that was sent
    Delete {
        /// Its id
        id: String,
        #[command(flatten)]
        at: AtArgs,
    },
}

/// Which service.
#[derive(Args, Debug)]
pub(crate) struct AtArgs {
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}

/// Which city.
#[derive(Args, Debug)]
pub(crate) struct OneCityArgs {
    /// Name of the city
    pub(crate) city: String,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}

const AUDIT_HELP: &str = "\
Examples:
  gable audit
  gable audit --who ann --limit 1000 --json
  gable audit --city delft

For operators; that of one city also for its owners.";

/// Arguments of `gable audit`.
#[derive(Args, Debug)]
#[command(after_help = AUDIT_HELP)]
pub(crate) struct AuditArgs {
    /// Only of this name
    #[arg(long, value_name = "NAME")]
    pub(crate) who: Option<String>,
    /// Only about this city
    #[arg(long, value_name = "NAME")]
    pub(crate) city: Option<String>,
    /// Only those before the entry with this id: the last one of a page gives the next page
    #[arg(long, value_name = "ID")]
    pub(crate) before: Option<String>,
    /// Most entries
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) limit: u32,
    /// Print the list as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}
