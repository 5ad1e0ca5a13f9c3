//! `gable work`: a worker with several slots.

use crate::cli::WorkArgs;
use crate::exit::Outcome;
use crate::service;

/// Works until it is stopped.
pub(crate) fn run(args: &WorkArgs) -> anyhow::Result<Outcome> {
    service::block_on(async {
        let stop = service::stop_signal()?;
        let parts = service::open(&args.keep).await?;
        let workers = service::workers(&parts, &args.keep, &args.slots)?;
        tracing::info!(slots = workers.len(), "working");
        service::work(workers, stop).await
    })?;
    Ok(Outcome::Success)
}
