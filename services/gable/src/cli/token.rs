//! Arguments of `gable token`.

use super::DatabaseArgs;
use clap::{Args, Subcommand};
use gable_job_store::Scope;

const TOKEN_HELP: &str = "\
Examples:
  gable token create ann --scope submitter --max-jobs 4 --days 90
  gable token create grafana --scope viewer
  gable token list
  gable token rotate ann --grace 24
  gable token revoke ann
  curl -H \"authorization: Bearer $GABLE_TOKEN\" localhost:8080/api/v1/jobs

Every request to a service shows a token. Where none was made yet, the first start of gable serve makes an operator's and tells it
on standard error, once.";

/// Arguments of `gable token`.
#[derive(Args, Debug)]
#[command(after_help = TOKEN_HELP)]
pub(crate) struct TokenArgs {
    #[command(subcommand)]
    pub(crate) action: TokenAction,
    #[command(flatten)]
    pub(crate) at: DatabaseArgs,
    /// Print the result as JSON on standard output
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum TokenAction {
    /// Make a token and print it, once: only its hash is kept
    Create(NewTokenArgs),
    /// List the tokens: names, scopes, quotas, ends
    List,
    /// Put a new token in the place of one, and print it, once; what it allows stays, and so do the cities of its holder
    Rotate {
        /// Whose it is
        name: String,
        /// How long the one before opens as well, hours
        #[arg(long, value_name = "H", default_value_t = 0.0)]
        grace: f64,
    },
    /// Take a token away
    Revoke {
        /// Whose it is
        name: String,
    },
}

/// What a new token is to allow.
#[derive(Args, Debug)]
pub(crate) struct NewTokenArgs {
    /// Whose it is; jobs that are submitted with it bear this name
    pub(crate) name: String,
    /// What it allows: viewer (look), submitter (submit, and steer one's own jobs), operator (everything)
    #[arg(long, value_name = "SCOPE", value_parser = scope)]
    pub(crate) scope: Scope,
    /// A group that its holder is in; may be given many times
    #[arg(long = "group", value_name = "NAME")]
    pub(crate) groups: Vec<String>,
    /// Most jobs under way
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i64).range(0..))]
    pub(crate) max_jobs: Option<i64>,
    /// Days until it ends; without, it does not
    #[arg(long, value_name = "N")]
    pub(crate) days: Option<f64>,
}

fn scope(text: &str) -> Result<Scope, String> {
    let names: Vec<&str> = Scope::ALL.iter().map(|s| s.name()).collect();
    text.parse().map_err(|_| format!("give one of {}", names.join(", ")))
}
