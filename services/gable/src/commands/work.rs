//! `gable work`: a worker with several slots.

use crate::cli::WorkArgs;
use crate::exit::Outcome;
use crate::service;

/// Works until it is stopped.
pub(crate) fn run(args: &WorkArgs) -> anyhow::Result<Outcome> {
    service::block_on(async {
        let mut stop = service::stop_signal()?;
        let Some(parts) = service::open_unless_stopped(&args.keep, &mut stop).await? else { return Ok(()) };
        let workers = service::workers(&parts, &args.keep, &args.slots)?;
        tracing::info!(slots = workers.len(), "working");
        let most = service::time_to_stop(&args.slots)?;
        service::within(service::work(workers, stop.clone()), stop, most).await
    })?;
    Ok(Outcome::Success)
}
