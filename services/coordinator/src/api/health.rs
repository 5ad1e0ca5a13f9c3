//! Whether the service is there, and whether it can work.

use crate::problem::Refused;
use crate::{Coordinator, Problem};
use axum::extract::State;
use axum::http::StatusCode;
use gable_job_store::JobStoreError;
use std::time::{Duration, Instant};

/// Longest time for the object store to answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// How long an answer of the object store and the disk holds: supervisors ask often, and anybody may.
const HOLDS: Duration = Duration::from_secs(2);

/// The service is there
#[utoipa::path(get, path = "/healthz", tag = "service", security(()), responses((status = 200, description = "It is", body = String)))]
pub(crate) async fn alive() -> &'static str {
    "ok\n"
}

/// The service can work: its database and its object store answer, and its folder can be written
#[utoipa::path(
    get, path = "/readyz", tag = "service", security(()),
    responses(
        (status = 200, description = "It can", body = String),
        Refused<503>,
    )
)]
pub(crate) async fn ready(State(service): State<Coordinator>) -> Result<&'static str, Problem> {
    if let Err(e) = service.store.ping().await {
        tracing::error!("not ready: {e}");
        return Err(unready("the database does not answer"));
    }
    let mut looked = service.answers.ready.lock().await;
    let trouble = match &*looked {
        Some((at, trouble)) if at.elapsed() < HOLDS => trouble.clone(),
        _ => {
            let trouble = trouble(&service).await;
            *looked = Some((Instant::now(), trouble.clone()));
            trouble
        }
    };
    trouble.map_or(Ok("ok\n"), |why| Err(unready(&why)))
}

/// What is wrong with the object store or the folder, in words without addresses.
async fn trouble(service: &Coordinator) -> Option<String> {
    let written = tempfile::NamedTempFile::new_in(&service.folder)
        .and_then(|mut file| std::io::Write::write_all(&mut file, &[0; 1 << 12]));
    if let Err(e) = written {
        tracing::error!("not ready: the folder {} cannot be written: {e}", service.folder.display());
        return Some(format!("the service's folder (--data) cannot be written: {}", e.kind()));
    }
    match tokio::time::timeout(PATIENCE, service.blobs.ping()).await {
        Ok(Ok(())) => None,
        Ok(Err(e)) => {
            tracing::error!("not ready: {e}");
            Some(match e {
                e if e.is_refused() => {
                    "the object store refuses the keys of this service (AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY)"
                        .to_owned()
                }
                JobStoreError::File { source, .. } => format!("the store of artefacts: {}", source.kind()),
                _ => "the object store does not answer".to_owned(),
            })
        }
        Err(_) => Some("the object store does not answer".to_owned()),
    }
}

fn unready(why: &str) -> Problem {
    Problem::new(StatusCode::SERVICE_UNAVAILABLE, "unavailable", "The service is not ready", why)
}
