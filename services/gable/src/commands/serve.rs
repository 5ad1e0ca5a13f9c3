//! `gable serve`: the coordinator, and with `--all` workers beside it.

use crate::cli::ServeArgs;
use crate::exit::{Outcome, UsageError};
use crate::{service, terminal};
use anyhow::Context as _;
use gable_coordinator::{Coordinator, Limits, Patience};

/// Serves until it is stopped.
pub(crate) fn run(args: &ServeArgs) -> anyhow::Result<Outcome> {
    service::block_on(serve(args))?;
    Ok(Outcome::Success)
}

async fn serve(args: &ServeArgs) -> anyhow::Result<()> {
    let mut stop = service::stop_signal()?;
    let parts = service::open(&args.keep).await?;
    if !args.listen.ip().is_loopback() && !parts.store.has_tokens().await? {
        let text = format!(
            "--listen {}: other machines would reach it, so make a token first: gable token create",
            args.listen
        );
        return Err(UsageError(text).into());
    }
    let listener = tokio::net::TcpListener::bind(args.listen)
        .await
        .map_err(|e| UsageError(format!("--listen {}: {e}", args.listen)))?;
    let address = listener.local_addr()?;
    let workers = if args.all { service::workers(&parts, &args.keep, &args.slots)? } else { Vec::new() };
    let limits = Limits {
        upload: args.upload_size << 20,
        unpacked: args.upload_size << 22,
        private_webhooks: args.private_webhooks,
        ..Limits::default()
    };
    let coordinator = Coordinator::new(parts.store.clone(), parts.blobs.clone(), parts.roots.clone(), limits);
    // Programs that start the service read this line to learn the port.
    terminal::stdout(&format!("listening on http://{address}"));
    let working = service::work(workers, stop.clone());
    let collect_stop = stop.clone();
    let (ticking, tick_stop) = (coordinator.clone(), stop.clone());
    let ticking = gable_coordinator::tick(&ticking, tick_stop);
    let delivering = gable_coordinator::deliver(&parts.store, args.private_webhooks, stop.clone());
    let serving = async {
        let stopped = async move {
            let _ = stop.wait_for(|&s| s).await;
        };
        let app = gable_coordinator::router(coordinator);
        gable_coordinator::serve(listener, app, Patience::default(), stopped).await;
    };
    let hours = |name, value: f64| service::seconds(name, value * 3600.0);
    let collecting = service::collect(
        &parts,
        hours("collect-age", args.collect_age)?,
        hours("keep-age", args.keep_age)?,
        collect_stop,
    );
    let (working, (), (), (), delivering) = tokio::join!(working, serving, collecting, ticking, delivering);
    working.and(delivering.context("sending to webhooks"))
}
