//! From one stage of a job to the next.

use crate::database::Tx;
use crate::events::About;
use crate::{EventKind, JobState, JobStoreError, Store};
use sqlx::Row;

impl Store {
    /// Lets a job go on to its next stage, or ends it, if no task of its stage is left to do; gives the state in which it ended, if
    /// it did. The job is locked already.
    pub(crate) async fn advance(&self, tx: &mut Tx, id: &str) -> Result<Option<JobState>, JobStoreError> {
        let job = self.locked(tx, id).await?;
        if job.state.is_over() {
            return Ok(None);
        }
        // MIN over no rows is NULL: then no task is left at all.
        let row = sqlx::query("SELECT MIN(stage) AS stage FROM task WHERE job = $1 AND state IN ('ready', 'running')")
            .bind(id)
            .fetch_one(&mut **tx)
            .await?;
        match row.try_get::<Option<i64>, _>("stage")? {
            Some(stage) if stage <= job.stage => Ok(None),
            Some(stage) => {
                sqlx::query("UPDATE job SET stage = $2 WHERE id = $1").bind(id).bind(stage).execute(&mut **tx).await?;
                self.note(tx, id, EventKind::Stage, About { stage: Some(stage), ..About::default() }).await?;
                self.tell_progress(tx, id).await?;
                Ok(None)
            }
            None => {
                let failed: i64 =
                    sqlx::query("SELECT COUNT(*) AS failed FROM task WHERE job = $1 AND state = 'failed'")
                        .bind(id)
                        .fetch_one(&mut **tx)
                        .await?
                        .try_get("failed")?;
                let state = if failed > 0 { JobState::Partial } else { JobState::Successful };
                self.end(tx, id, state, None).await?;
                Ok(Some(state))
            }
        }
    }
}
