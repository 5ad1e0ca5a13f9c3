//! Arguments of the commands that ask a service on another machine.

use clap::Args;
use std::path::PathBuf;

/// Which service.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Which service")]
pub(crate) struct RemoteArgs {
    /// Address of the service
    #[arg(long, value_name = "URL", env = "GABLE_URL", default_value = "http://127.0.0.1:8080")]
    pub(crate) url: String,
    /// Token for it; gable token create makes one
    #[arg(long, value_name = "TOKEN", env = "GABLE_TOKEN", hide_env_values = true)]
    pub(crate) token: Option<String>,
    /// Certificates, as PEM, of the authorities to trust for https:// instead of those that the system trusts
    #[arg(long, value_name = "FILE", env = "GABLE_CA_FILE")]
    pub(crate) ca_file: Option<PathBuf>,
}

/// Which job, and how to tell of it.
#[derive(Args, Debug)]
pub(crate) struct JobArgs {
    /// Id of the job
    pub(crate) job: String,
    /// Print the job as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}

/// When a mesh is sent to the service.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Send {
    /// If it is on this machine, and the service cannot see it
    #[default]
    Auto,
    /// Whatever the service sees
    Always,
    /// SOURCE is what the service sees, whatever is on this machine
    Never,
}

const SUBMIT_HELP: &str = "\
Examples:
  gable submit mesh.obj --city delft
  gable submit delft/Production_1 --city delft --preset fast --set sampling.step=0.3 --watch
  GABLE_URL=https://gable.example GABLE_TOKEN=gable_… gable submit mesh.obj --city delft --json

SOURCE is a mesh on this machine, which is sent if the service cannot see it; or a path under a source root of the service
(gable serve --source-root), s3://BUCKET/PREFIX, or upload:ID. A folder is packed while it is sent, with an OBJ file go its
libraries, textures, and what says where it lies. What was cut off goes on with the same command. Prints the id of the job.
With --watch the exit code is that of the job: 0 successful, 1 failed or cancelled, 3 partial.";

/// Arguments of `gable submit`.
#[derive(Args, Debug)]
#[command(after_help = SUBMIT_HELP)]
pub(crate) struct SubmitArgs {
    /// The mesh: a file or folder of this machine, or what the service sees
    pub(crate) source: String,
    /// Whether a mesh of this machine is sent: if the service cannot see it, always, or never
    #[arg(long, value_name = "WHEN", default_value = "auto")]
    pub(crate) send: Send,
    /// Name of the city that it shows; a later job of the same city refreshes it
    #[arg(long, value_name = "NAME")]
    pub(crate) city: String,
    /// A named set of values
    #[arg(long, value_name = "NAME")]
    pub(crate) preset: Option<String>,
    /// Set any parameter; may be given many times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub(crate) settings: Vec<String>,
    /// Jobs of higher priority get workers first, -100 to 100
    #[arg(long, value_name = "N", default_value_t = 0, allow_hyphen_values = true)]
    pub(crate) priority: i64,
    /// The same key again gives the same job; by default a new one
    #[arg(long, value_name = "KEY")]
    pub(crate) key: Option<String>,
    /// Wait until the job is over, and tell how far it is
    #[arg(long)]
    pub(crate) watch: bool,
    /// Print the job as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}

const STATUS_HELP: &str = "\
Examples:
  gable status                                  the last jobs
  gable status --state running --city delft
  gable status 0199a3c4-…                       one job, stage by stage
  gable status 0199a3c4-… --watch               until it is over
  gable status 0199a3c4-… --json | jq .state

With --watch the exit code is that of the job: 0 successful, 1 failed or cancelled, 3 partial.";

/// Arguments of `gable status`.
#[derive(Args, Debug)]
#[command(after_help = STATUS_HELP)]
pub(crate) struct StatusArgs {
    /// Id of a job; without, the last jobs are listed
    pub(crate) job: Option<String>,
    /// Wait until the job is over, and tell how far it is
    #[arg(long, requires = "job")]
    pub(crate) watch: bool,
    /// Only jobs in this state
    #[arg(long, value_name = "STATE", conflicts_with = "job")]
    pub(crate) state: Option<String>,
    /// Only jobs of this city
    #[arg(long, value_name = "NAME", conflicts_with = "job")]
    pub(crate) city: Option<String>,
    /// Most jobs in the list
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub(crate) limit: u32,
    /// Print the job, or the list, as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}

const CANCEL_HELP: &str = "\
Examples:
  gable cancel 0199a3c4-…

Tasks under way are stopped at their next heartbeat. Results of a job that was cancelled do not reach its city.";

/// Arguments of `gable cancel`.
#[derive(Args, Debug)]
#[command(after_help = CANCEL_HELP)]
pub(crate) struct CancelArgs {
    #[command(flatten)]
    pub(crate) of: JobArgs,
}

const RETRY_HELP: &str = "\
Examples:
  gable retry 0199a3c4-…
  gable retry 0199a3c4-… --watch

Does again what failed of a partial or failed job, and what depends on it.";

const DELETE_HELP: &str = "\
Examples:
  gable delete 0199a3c4-…

Deletes the record of a job that is over, with its events and log. The city that it made stays; gable city delete removes that.";

/// Arguments of `gable delete`.
#[derive(Args, Debug)]
#[command(after_help = DELETE_HELP)]
pub(crate) struct DeleteArgs {
    #[command(flatten)]
    pub(crate) of: JobArgs,
}

/// Arguments of `gable retry`.
#[derive(Args, Debug)]
#[command(after_help = RETRY_HELP)]
pub(crate) struct RetryArgs {
    /// Wait until the job is over, and tell how far it is
    #[arg(long)]
    pub(crate) watch: bool,
    #[command(flatten)]
    pub(crate) of: JobArgs,
}

const DOWNLOAD_HELP: &str = "\
Examples:
  gable download --job 0199a3c4-… --out result
  gable download --city delft --out delft --prefix tiles/
  gable download --city delft --generation 3 --out delft-3

Files that are there already with the same content are not fetched again, so an interrupted download goes on where it
was. Each file is checked against its hash.";

/// Arguments of `gable download`.
#[derive(Args, Debug)]
#[command(after_help = DOWNLOAD_HELP)]
#[command(group(clap::ArgGroup::new("what").required(true).args(["job", "city"])))]
pub(crate) struct DownloadArgs {
    /// Id of the job whose result is wanted
    #[arg(long, value_name = "ID")]
    pub(crate) job: Option<String>,
    /// Name of the city whose files are wanted
    #[arg(long, value_name = "NAME")]
    pub(crate) city: Option<String>,
    /// Generation of the city; by default the current one
    #[arg(long, value_name = "N", requires = "city")]
    pub(crate) generation: Option<i64>,
    /// Folder for the files; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Only files whose paths begin with this
    #[arg(long, value_name = "PREFIX", default_value = "")]
    pub(crate) prefix: String,
    /// Print what was fetched as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) remote: RemoteArgs,
}
