//! The ticks of schedules. Every coordinator looks at all schedules; the database decides whose a tick is.

use crate::Coordinator;
use crate::api::{first_task, read_request};
use crate::cron::Ticks;
use gable_job_store::{JobStoreError, Missed, NewSchedule, Schedule, Tick};
use std::time::Duration;
use tokio::sync::watch;

/// How often schedules are looked at.
const PACE: Duration = Duration::from_millis(500);

/// A tick that nobody has looked at for so long, milliseconds, is a missed one.
const LATE: i64 = 60_000;

/// Carries out the ticks of schedules, until `stop` becomes true.
pub async fn tick(service: &Coordinator, mut stop: watch::Receiver<bool>) {
    loop {
        tokio::select! {
            () = tokio::time::sleep(PACE) => {}
            _ = stop.wait_for(|&s| s) => return,
        }
        if let Err(e) = look(service).await {
            tracing::warn!("schedules cannot be looked at: {e}");
        }
    }
}

async fn look(service: &Coordinator) -> Result<(), JobStoreError> {
    for schedule in service.store.due_schedules().await? {
        let now = service.store.clock().await?;
        let tick = due(&schedule, now);
        // All ticks until now are this one, so the following is counted from now.
        let following = Ticks::new(&schedule.said.cron, &schedule.said.zone).and_then(|t| t.after(now));
        if let Err(e) = &following {
            tracing::warn!(schedule = schedule.said.name, "no further tick: {e}");
        }
        let first = first_task(&read_request(&schedule.said.request)?);
        if let Some(run) = service.store.tick(&schedule, tick, &first, following.ok()).await? {
            let NewSchedule { name, city, owner, .. } = &schedule.said;
            match run.job.as_deref() {
                Some(job) => tracing::info!(job, city, owner, schedule = name, run = run.number, "job submitted"),
                None => tracing::warn!(city, schedule = name, run = run.number, "tick: {}", run.outcome.name()),
            }
        }
    }
    Ok(())
}

/// What a tick that has come asks for.
fn due(schedule: &Schedule, now: i64) -> Tick {
    let missed = schedule.said.next.is_some_and(|next| now - next > LATE);
    if missed && schedule.said.missed == Missed::Skip { Tick::Miss } else { Tick::Run }
}
