//! Who is told of what happens, and what is still to be told.
//!
//! A message is written in the transaction of the event that it tells of. It is sent at least once: whoever takes it moves it into
//! the future first, so that it comes up again if its sender is killed.

use crate::database::Tx;
use crate::names::named;
use crate::{JobState, JobStoreError, Store};
use serde_json::{Value, json};
use sqlx::any::AnyRow;
use sqlx::{AssertSqlSafe, Row};
use std::time::Duration;

named! {
    /// What webhooks are told of.
    WebhookEvent, "event of a webhook", {
        /// A job ended well.
        JobSucceeded = "job.succeeded",
        /// A job ended without some of its blocks.
        JobPartial = "job.partial",
        /// A job could not go on.
        JobFailed = "job.failed",
        /// A job was stopped by a user.
        JobCancelled = "job.cancelled",
        /// A city has a new generation.
        CityPublished = "city.published",
        /// A job began, or went on to another stage. Only those are told who ask for it by its name.
        JobProgressed = "job.progressed",
    }
}

named! {
    /// State of a message.
    MessageState, "state of a message", {
        /// It is to be sent, or to be sent again.
        Waiting = "waiting",
        /// Its receiver has it.
        Delivered = "delivered",
        /// It was given up.
        Failed = "failed",
    }
}

impl WebhookEvent {
    fn of_end(state: JobState) -> Option<Self> {
        match state {
            JobState::Successful => Some(Self::JobSucceeded),
            JobState::Partial => Some(Self::JobPartial),
            JobState::Failed => Some(Self::JobFailed),
            JobState::Cancelled => Some(Self::JobCancelled),
            JobState::Accepted | JobState::Running | JobState::Paused => None,
        }
    }
}

/// A receiver of messages.
#[derive(Clone, PartialEq, Eq)]
pub struct Webhook {
    /// Id.
    pub id: String,
    /// Who asked for it.
    pub owner: String,
    /// Where messages go.
    pub url: String,
    /// What they are signed with; nothing for callbacks.
    pub secret: String,
    /// Which events; none for all.
    pub events: Vec<WebhookEvent>,
    /// Only of this city.
    pub city: Option<String>,
    /// Whether it is told anything.
    pub enabled: bool,
    /// When it was made, milliseconds since 1970; set by the database's clock.
    pub created: i64,
    /// Set for the callback of a job; not for what an operator has made.
    pub callback: Option<Callback>,
}

/// What a callback is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Callback {
    /// Id of the job.
    pub job: String,
    /// What links in its messages begin with: the service as the client sees it.
    pub base: String,
}

/// A receiver that is told of the job that it is submitted with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewCallback {
    /// Where messages go.
    pub url: String,
    /// Which events.
    pub events: Vec<WebhookEvent>,
    /// What links in its messages begin with.
    pub base: String,
}

/// Without the secret, so that it gets into no log.
impl std::fmt::Debug for Webhook {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Webhook").field("id", &self.id).field("owner", &self.owner).finish_non_exhaustive()
    }
}

/// A message to a receiver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WebhookMessage {
    /// Id, the same in all attempts.
    pub id: String,
    /// What it tells of.
    pub event: WebhookEvent,
    /// More of that, as JSON.
    pub data: String,
    /// What has become of it.
    pub state: MessageState,
    /// How often it was sent.
    pub attempts: i64,
    /// What the last attempt came to.
    pub answer: Option<String>,
    /// When the event was, milliseconds since 1970.
    pub created: i64,
    /// When it was delivered, or given up.
    pub finished: Option<i64>,
}

/// What an attempt came to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sent {
    /// The receiver has it.
    Delivered(String),
    /// Another attempt, after this time.
    Again(String, Duration),
    /// No further attempt.
    GivenUp(String),
    /// No further attempt, and no further message: the receiver is gone for good.
    Gone(String),
}

/// Events as they are kept: with a comma behind each, so that no name is found inside of another.
fn event_list(events: &[WebhookEvent]) -> String {
    events.iter().flat_map(|e| [e.name(), ","]).collect()
}

const COLUMNS: &str = "id, owner, url, secret, events, city, enabled, created, job, base";

impl Webhook {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        let events: String = row.try_get("events")?;
        Ok(Self {
            id: row.try_get("id")?,
            owner: row.try_get("owner")?,
            url: row.try_get("url")?,
            secret: row.try_get("secret")?,
            events: events.split_terminator(',').map(str::parse).collect::<Result<_, _>>()?,
            city: row.try_get("city")?,
            enabled: row.try_get::<i64, _>("enabled")? != 0,
            created: row.try_get("created")?,
            callback: match (row.try_get("job")?, row.try_get("base")?) {
                (Some(job), Some(base)) => Some(Callback { job, base }),
                _ => None,
            },
        })
    }
}

impl WebhookMessage {
    fn read(row: &AnyRow) -> Result<Self, JobStoreError> {
        Ok(Self {
            id: row.try_get("id")?,
            event: row.try_get::<&str, _>("event")?.parse()?,
            data: row.try_get("data")?,
            state: row.try_get::<&str, _>("state")?.parse()?,
            attempts: row.try_get("attempts")?,
            answer: row.try_get("answer")?,
            created: row.try_get("created")?,
            finished: row.try_get("finished")?,
        })
    }
}

impl Store {
    /// Adds a receiver.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn add_webhook(&self, webhook: &Webhook) -> Result<(), JobStoreError> {
        let statement = "INSERT INTO webhook (id, owner, url, secret, events, city, enabled, created) \
                         VALUES ($1, $2, $3, $4, $5, $6, $7, {now})";
        sqlx::query(self.sql(statement))
            .bind(&webhook.id)
            .bind(&webhook.owner)
            .bind(&webhook.url)
            .bind(&webhook.secret)
            .bind(event_list(&webhook.events))
            .bind(&webhook.city)
            .bind(i64::from(webhook.enabled))
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// Adds a receiver that is told of one job only.
    pub(crate) async fn add_callback(
        &self,
        tx: &mut Tx,
        job: &str,
        owner: &str,
        callback: &NewCallback,
    ) -> Result<(), JobStoreError> {
        let statement = "INSERT INTO webhook (id, owner, url, secret, events, enabled, created, job, base) \
                         VALUES ($1, $2, $3, '', $4, 1, {now}, $5, $6)";
        sqlx::query(self.sql(statement))
            .bind(uuid::Uuid::now_v7().to_string())
            .bind(owner)
            .bind(&callback.url)
            .bind(event_list(&callback.events))
            .bind(job)
            .bind(&callback.base)
            .execute(&mut **tx)
            .await?;
        Ok(())
    }

    /// The receivers that operators have made, oldest first.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn webhooks(&self) -> Result<Vec<Webhook>, JobStoreError> {
        let statement = format!("SELECT {COLUMNS} FROM webhook WHERE job IS NULL ORDER BY id");
        sqlx::query(AssertSqlSafe(statement)).fetch_all(&self.pool).await?.iter().map(Webhook::read).collect()
    }

    /// A receiver.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn webhook(&self, id: &str) -> Result<Option<Webhook>, JobStoreError> {
        let statement = format!("SELECT {COLUMNS} FROM webhook WHERE id = $1");
        let row = sqlx::query(AssertSqlSafe(statement)).bind(id).fetch_optional(&self.pool).await?;
        row.as_ref().map(Webhook::read).transpose()
    }

    /// Removes a receiver with its messages; false if there is none of this id.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn remove_webhook(&self, id: &str) -> Result<bool, JobStoreError> {
        let removed = sqlx::query("DELETE FROM webhook WHERE id = $1").bind(id).execute(&self.pool).await?;
        Ok(crate::database::one_row(&removed))
    }

    /// The messages to a receiver, newest first, at most `limit`.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn webhook_messages(&self, webhook: &str, limit: i64) -> Result<Vec<WebhookMessage>, JobStoreError> {
        let rows = sqlx::query(
            "SELECT id, event, data, state, attempts, answer, created, finished FROM webhook_message \
             WHERE webhook = $1 ORDER BY id DESC LIMIT $2",
        )
        .bind(webhook)
        .bind(limit)
        .fetch_all(&self.pool)
        .await?;
        rows.iter().map(WebhookMessage::read).collect()
    }

    /// The message that waits longest for being sent, with its receiver. It comes up again after `lease` unless
    /// [`Store::message_sent`] says what became of it.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn take_message(&self, lease: Duration) -> Result<Option<(Webhook, WebhookMessage)>, JobStoreError> {
        let statement = "UPDATE webhook_message SET attempts = attempts + 1, next = {now} + $1 \
                         WHERE id = (SELECT id FROM webhook_message WHERE state = 'waiting' AND next <= {now} \
                         ORDER BY next, id LIMIT 1) AND state = 'waiting' AND next <= {now} \
                         RETURNING id, event, data, state, attempts, answer, created, finished, webhook";
        let lease = i64::try_from(lease.as_millis()).unwrap_or(i64::MAX);
        let Some(row) = sqlx::query(self.sql(statement)).bind(lease).fetch_optional(&self.pool).await? else {
            return Ok(None);
        };
        let message = WebhookMessage::read(&row)?;
        let receiver = self.webhook(row.try_get("webhook")?).await?;
        Ok(receiver.map(|webhook| (webhook, message)))
    }

    /// Says what became of a message that was taken. Nothing is changed if someone else has taken it since.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn message_sent(
        &self,
        webhook: &Webhook,
        message: &WebhookMessage,
        sent: &Sent,
    ) -> Result<(), JobStoreError> {
        let (state, answer, pause) = match sent {
            Sent::Delivered(answer) => (MessageState::Delivered, answer, None),
            Sent::Again(answer, pause) => (MessageState::Waiting, answer, Some(pause)),
            Sent::GivenUp(answer) | Sent::Gone(answer) => (MessageState::Failed, answer, None),
        };
        let statement = "UPDATE webhook_message SET state = $3, answer = $4, next = {now} + $5, \
                         finished = CASE WHEN $6 = 1 THEN {now} END WHERE id = $1 AND attempts = $2 AND state = 'waiting'";
        sqlx::query(self.sql(statement))
            .bind(&message.id)
            .bind(message.attempts)
            .bind(state.name())
            .bind(answer)
            .bind(pause.map_or(0, |p| i64::try_from(p.as_millis()).unwrap_or(i64::MAX)))
            .bind(i64::from(pause.is_none()))
            .execute(&self.pool)
            .await?;
        if matches!(sent, Sent::Gone(_)) {
            sqlx::query("UPDATE webhook SET enabled = 0 WHERE id = $1").bind(&webhook.id).execute(&self.pool).await?;
            sqlx::query("DELETE FROM webhook_message WHERE webhook = $1 AND state = 'waiting'")
                .bind(&webhook.id)
                .execute(&self.pool)
                .await?;
        }
        Ok(())
    }

    /// Forgets messages that were delivered or given up so long ago, and gives their number.
    ///
    /// # Errors
    /// If the database does not answer.
    pub async fn forget_messages(&self, age: Duration) -> Result<u64, JobStoreError> {
        let statement = "DELETE FROM webhook_message WHERE state <> 'waiting' AND finished < {now} - $1";
        let age = i64::try_from(age.as_millis()).unwrap_or(i64::MAX);
        Ok(sqlx::query(self.sql(statement)).bind(age).execute(&self.pool).await?.rows_affected())
    }

    /// Has receivers told that a job has ended.
    pub(crate) async fn tell_end(
        &self,
        tx: &mut Tx,
        job: &str,
        state: JobState,
        reason: Option<&str>,
    ) -> Result<(), JobStoreError> {
        let Some(event) = WebhookEvent::of_end(state) else { return Ok(()) };
        // Whoever has not heard yet how far it is need not hear it any more.
        sqlx::query(
            "DELETE FROM webhook_message WHERE state = 'waiting' AND event = $2 \
             AND webhook IN (SELECT id FROM webhook WHERE job = $1)",
        )
        .bind(job)
        .bind(WebhookEvent::JobProgressed.name())
        .execute(&mut **tx)
        .await?;
        self.tell_of_job(tx, event, job, state, reason).await
    }

    /// Has receivers told that a job has begun, or gone on to another stage.
    pub(crate) async fn tell_progress(&self, tx: &mut Tx, job: &str) -> Result<(), JobStoreError> {
        self.tell_of_job(tx, WebhookEvent::JobProgressed, job, JobState::Running, None).await
    }

    async fn tell_of_job(
        &self,
        tx: &mut Tx,
        event: WebhookEvent,
        job: &str,
        state: JobState,
        reason: Option<&str>,
    ) -> Result<(), JobStoreError> {
        let row = sqlx::query("SELECT city, owner FROM job WHERE id = $1").bind(job).fetch_one(&mut **tx).await?;
        let (city, owner): (String, String) = (row.try_get("city")?, row.try_get("owner")?);
        let data = json!({ "job": job, "city": city, "owner": owner, "state": state.name(), "reason": reason });
        self.tell(tx, event, &city, job, &data).await
    }

    /// Has receivers told that a city has a new generation.
    pub(crate) async fn tell_published(&self, tx: &mut Tx, city: &str, number: i64) -> Result<(), JobStoreError> {
        let row = sqlx::query(
            "SELECT job, partial, buildings, added, removed, changed FROM generation WHERE city = $1 AND number = $2",
        )
        .bind(city)
        .bind(number)
        .fetch_one(&mut **tx)
        .await?;
        let count = |name| row.try_get::<i64, _>(name);
        let job: String = row.try_get("job")?;
        let data = json!({
            "city": city, "generation": number, "job": job, "partial": count("partial")? != 0,
            "buildings": count("buildings")?, "added": count("added")?, "removed": count("removed")?,
            "changed": count("changed")?,
        });
        self.tell(tx, WebhookEvent::CityPublished, city, &job, &data).await
    }

    async fn tell(
        &self,
        tx: &mut Tx,
        event: WebhookEvent,
        city: &str,
        job: &str,
        data: &Value,
    ) -> Result<(), JobStoreError> {
        let name = event_list(&[event]);
        // An empty list stands for all events but those that have to be asked for.
        let all = if event == WebhookEvent::JobProgressed { &*name } else { "" };
        let rows = sqlx::query(
            "SELECT id FROM webhook WHERE enabled = 1 AND (city IS NULL OR city = $1) AND (job IS NULL OR job = $2) \
             AND (events = $3 OR REPLACE(events, $4, '') <> events) ORDER BY id",
        )
        .bind(city)
        .bind(job)
        .bind(all)
        .bind(&name)
        .fetch_all(&mut **tx)
        .await?;
        for row in rows {
            let statement = "INSERT INTO webhook_message (id, webhook, event, data, state, attempts, next, created) \
                             VALUES ($1, $2, $3, $4, 'waiting', 0, {now}, {now})";
            sqlx::query(self.sql(statement))
                .bind(uuid::Uuid::now_v7().to_string())
                .bind(row.try_get::<String, _>("id")?)
                .bind(event.name())
                .bind(data.to_string())
                .execute(&mut **tx)
                .await?;
        }
        Ok(())
    }
}
