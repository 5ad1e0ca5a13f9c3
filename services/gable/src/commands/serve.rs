//! `gable serve`: the coordinator, and with `--all` workers beside it.

use crate::cli::{ServeArgs, SignInArgs};
use crate::exit::{Outcome, UsageError};
use crate::{service, terminal};
use anyhow::Context as _;
use gable_coordinator::{Coordinator, Grants, Limits, Patience, Places, SignIn, SignInSettings, create_first_token};
use gable_job_store::{Retention, Store};
use std::sync::Arc;
use std::time::Duration;

/// Serves until it is stopped.
pub(crate) fn run(args: &ServeArgs) -> anyhow::Result<Outcome> {
    service::block_on(serve(args))?;
    Ok(Outcome::Success)
}

async fn serve(args: &ServeArgs) -> anyhow::Result<()> {
    if args.open && !args.listen.ip().is_loopback() {
        let text = format!(
            "--open with --listen {}: every machine that reaches it could do everything: leave --open out",
            args.listen
        );
        return Err(UsageError(text).into());
    }
    let mut stop = service::stop_signal()?;
    let Some(parts) = service::open_unless_stopped(&args.keep, &mut stop).await? else { return Ok(()) };
    let listener = tokio::net::TcpListener::bind(args.listen)
        .await
        .map_err(|e| UsageError(format!("--listen {}: {e}", args.listen)))?;
    let address = listener.local_addr()?;
    let probes = match args.probes {
        Some(at) => {
            let bound = tokio::net::TcpListener::bind(at).await;
            Some(bound.map_err(|e| UsageError(format!("--probes {at}: {e}")))?)
        }
        None => None,
    };
    let workers = if args.all { service::workers(&parts, &args.keep, &args.slots)? } else { Vec::new() };
    let limits = Limits {
        upload: args.upload_size << 20,
        uploads: args.upload_quota << 20,
        unpacked: args.upload_size << 22,
        private_webhooks: args.private_webhooks,
        ..Limits::default()
    };
    let mut coordinator =
        Coordinator::new(parts.store.clone(), parts.blobs.clone(), parts.shared_roots.clone(), limits);
    coordinator.group_roots = parts.group_roots.clone();
    coordinator.open = args.open;
    coordinator.proxies.clone_from(&args.trusted_proxy);
    coordinator.origins.clone_from(&args.allow_origin);
    coordinator.sign_in = sign_in(&args.sign_in)?.map(Arc::new);
    coordinator.folder = service::incoming(&args.keep.at.data)?;
    say_who_may_ask(&parts.store, args.open).await?;
    // Programs that start the service read this line to learn the port.
    terminal::stdout(&format!("listening on http://{address}"));
    let (last_stop, most) = (stop.clone(), service::time_to_stop(&args.slots)?);
    let working = service::work(workers, stop.clone());
    let collect_stop = stop.clone();
    let (ticking, tick_stop) = (coordinator.clone(), stop.clone());
    let ticking = gable_coordinator::tick(&ticking, tick_stop);
    let (noting, note_stop) = (coordinator.clone(), stop.clone());
    let noting = gable_coordinator::keep_audit(&noting, note_stop);
    let delivering = gable_coordinator::deliver(&parts.store, args.private_webhooks, stop.clone());
    let serving = async {
        let mut also_stop = stop.clone();
        let also_stopped = async move {
            let _ = also_stop.wait_for(|&s| s).await;
        };
        let stopped = async move {
            let _ = stop.wait_for(|&s| s).await;
        };
        let places = Places {
            all: service::room_for_connections(),
            of_address: usize::try_from(args.connections).unwrap_or(usize::MAX),
            proxies: args.trusted_proxy.clone(),
        };
        let probing = async {
            if let Some(listener) = probes {
                let app = gable_coordinator::probes(coordinator.clone());
                let few = Places { all: PROBES, of_address: PROBES, proxies: Vec::new() };
                gable_coordinator::serve(listener, app, Patience::default(), few, also_stopped).await;
            }
        };
        let app = gable_coordinator::router(coordinator.clone());
        tokio::join!(gable_coordinator::serve(listener, app, Patience::default(), places, stopped), probing);
    };
    let hours = |name, value: f64| service::seconds(name, value * 3600.0);
    let collecting = service::collect(
        &parts,
        hours("collect-age", args.collect_age)?,
        hours("keep-age", args.keep_age)?,
        retention(args)?,
        collect_stop,
    );
    let all = async {
        let (working, (), (), (), delivering) = tokio::join!(
            working,
            // What was asked for last is noted, too.
            async {
                tokio::join!(serving, noting);
            },
            collecting,
            ticking,
            delivering
        );
        working.and(delivering.context("sending to webhooks"))
    };
    service::within(all, last_stop, most).await
}

/// The way to sign in, if there is one.
fn sign_in(args: &SignInArgs) -> anyhow::Result<Option<SignIn>> {
    let (Some(issuer), Some(client)) = (&args.oidc_issuer, &args.oidc_client) else { return Ok(None) };
    let settings = SignInSettings {
        issuer: issuer.clone(),
        client: client.clone(),
        // Not an argument, which every user of the machine could see.
        secret: std::env::var("GABLE_OIDC_SECRET").ok().filter(|secret| !secret.is_empty()),
        scopes: args.oidc_scope.clone(),
        grants: Grants {
            name: args.oidc_name.clone(),
            groups: args.oidc_groups.clone(),
            roles: args.oidc_role.clone(),
        },
        time: service::seconds("oidc-hours", args.oidc_hours * 3600.0)?,
    };
    Ok(Some(SignIn::new(settings).map_err(|e| UsageError(format!("--oidc-issuer: {e}")))?))
}

/// Most connections of supervisors at a time.
const PROBES: usize = 64;

/// For how long a worker that is not seen any more is told.
const WORKERS: Duration = Duration::from_secs(7 * 86_400);

/// What is kept, and for how long.
fn retention(args: &ServeArgs) -> Result<Retention, UsageError> {
    let days = |name, value: f64| match value {
        0.0 => Ok(None),
        value => service::seconds(name, value * 86_400.0).map(Some),
    };
    Ok(Retention {
        generations: args.keep_generations,
        generation_age: days("keep-generations-age", args.keep_generations_age)?,
        job_age: days("keep-jobs", args.keep_jobs)?,
        audit_age: days("keep-audit", args.keep_audit)?,
        worker_age: WORKERS,
    })
}

/// Says who may use the service. Where nobody could, because no token was made yet, makes an operator's and tells it: once, and to
/// whoever started the service only.
async fn say_who_may_ask(store: &Store, open: bool) -> anyhow::Result<()> {
    if open {
        if store.has_tokens().await? {
            tracing::warn!("--open is of no effect, for there are tokens: gable token list");
        } else {
            tracing::warn!(
                "--open: whoever reaches this port may do everything, people behind a proxy on this machine too, until a token is made"
            );
        }
    } else if let Some(token) = create_first_token(store).await? {
        terminal::stderr_line(&format!(
            "This service had no token yet. This one may do everything; it is shown this once, so keep it:\n\n\
             export GABLE_TOKEN={token}\n\n\
             The dashboard asks for it, gable's commands read it from there, and curl shows it by\n\
             -H \"authorization: Bearer $GABLE_TOKEN\". Others are made by gable token create.\n"
        ));
    }
    Ok(())
}
