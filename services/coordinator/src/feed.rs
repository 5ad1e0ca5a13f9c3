//! News of jobs for those who follow them: one question to the database at a time, however many follow.

use gable_job_store::{Event, JobStoreError, Store};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::watch;

/// How often the database is asked.
const PACE: Duration = Duration::from_millis(500);

/// Most events that are read of a job at once.
const BATCH: i64 = 500;

/// What is known of a job that is followed.
#[derive(Clone, Debug)]
pub(crate) struct News {
    /// Number of its last event.
    number: i64,
    /// Whether nothing more will happen to it.
    over: bool,
    /// Its last events, oldest first.
    recent: Arc<[Event]>,
}

/// The jobs that are followed. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct Feed {
    followed: Arc<Mutex<Followed>>,
}

#[derive(Debug, Default)]
struct Followed {
    jobs: BTreeMap<String, watch::Sender<News>>,
    /// Whether someone asks the database.
    asking: bool,
}

impl Feed {
    /// Follows a job, from after its event number `last`.
    ///
    /// # Errors
    /// If there is no such job, or the database does not answer.
    pub(crate) async fn follow(&self, store: &Store, id: &str, last: i64) -> Result<Follower, JobStoreError> {
        let job = store.job(id).await?;
        let mut followed = self.locked();
        let known = || News { number: job.events, over: job.state.is_over(), recent: Arc::default() };
        let news = followed.jobs.entry(id.to_owned()).or_insert_with(|| watch::Sender::new(known())).subscribe();
        if !followed.asking {
            followed.asking = true;
            tokio::spawn(self.clone().ask(store.clone()));
        }
        Ok(Follower { store: store.clone(), id: id.to_owned(), last, news })
    }

    fn locked(&self) -> MutexGuard<'_, Followed> {
        self.followed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks until nobody follows any more.
    async fn ask(self, store: Store) {
        loop {
            tokio::time::sleep(PACE).await;
            let known: BTreeMap<String, i64> = {
                let mut followed = self.locked();
                followed.jobs.retain(|_, news| news.receiver_count() > 0);
                if followed.jobs.is_empty() {
                    followed.asking = false;
                    return;
                }
                followed.jobs.iter().map(|(id, news)| (id.clone(), news.borrow().number)).collect()
            };
            match look(&store, &known).await {
                Ok(found) => {
                    let followed = self.locked();
                    for (id, news) in found {
                        if let Some(sender) = followed.jobs.get(&id) {
                            sender.send_replace(news);
                        }
                    }
                }
                // Those who follow wait, and miss nothing.
                Err(e) => tracing::warn!("no news of jobs: {e}"),
            }
        }
    }
}

/// What is new, given the numbers of the last events that are known.
async fn look(store: &Store, known: &BTreeMap<String, i64>) -> Result<Vec<(String, News)>, JobStoreError> {
    let ids: Vec<&str> = known.keys().map(String::as_str).collect();
    let mut found = Vec::new();
    for (id, number, state) in store.last_events(&ids).await? {
        let last = known[&id];
        if number != last || state.is_over() {
            let recent = store.events(&id, last, BATCH).await?.into();
            found.push((id, News { number, over: state.is_over(), recent }));
        }
    }
    Ok(found)
}

/// One who follows a job.
#[derive(Debug)]
pub(crate) struct Follower {
    store: Store,
    id: String,
    last: i64,
    news: watch::Receiver<News>,
}

impl Follower {
    /// The next events, oldest first, at least one; waits for them. None when the job is over and all was told.
    ///
    /// # Errors
    /// If the database does not answer.
    pub(crate) async fn next(&mut self) -> Result<Option<Vec<Event>>, JobStoreError> {
        loop {
            let news = self.news.borrow_and_update().clone();
            if news.number > self.last {
                let events = match news.recent.first() {
                    Some(first) if first.number <= self.last + 1 => {
                        news.recent.iter().filter(|e| e.number > self.last).cloned().collect()
                    }
                    _ => self.store.events(&self.id, self.last, BATCH).await?,
                };
                if let Some(event) = events.last() {
                    self.last = event.number;
                    return Ok(Some(events));
                }
            }
            if news.over || self.news.changed().await.is_err() {
                return Ok(None);
            }
        }
    }
}
