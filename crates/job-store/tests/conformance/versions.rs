//! Several versions of the program at one database; each part on an empty one.

use crate::suite::{job, state, submit, task};
use gable_job_store::{Artifact, BlobId, Claim, Claimant, Finished, JobState, JobStoreError, Retry, Store, Worker};
use std::time::Duration;

const LEASE: Duration = Duration::from_secs(30);

/// A node of a version, which is there.
async fn node(store: &Store, name: &str, version: &str) -> Claimant {
    let worker = Worker {
        id: format!("{name}-0"),
        host: "h".to_owned(),
        pid: 1,
        version: version.to_owned(),
        started: 0,
        seen: 0,
        task: None,
        memory: 0,
        node: name.to_owned(),
        task_memory: 100,
        trouble: None,
    };
    store.see_worker(&worker).await.expect("seen");
    Claimant { worker: worker.id, node: worker.node, task_memory: 100, version: version.to_owned() }
}

async fn claim(store: &Store, by: &Claimant) -> Option<Claim> {
    store.claim_as(by, LEASE).await.expect("claims")
}

/// What a task makes: a file and tasks of the next stage.
fn made(path: &str, tasks: &[&str]) -> Finished {
    let artifacts = vec![Artifact { path: path.to_owned(), blob: BlobId::of(path.as_bytes()), bytes: 1 }];
    Finished { artifacts, tasks: tasks.iter().map(|unit| task(1, unit)).collect(), ..Finished::default() }
}

pub(crate) async fn a_job_stays_with_the_version_that_began_it(store: &Store) {
    let (old, new) = (node(store, "old", "1").await, node(store, "new", "2").await);
    let id = submit(store, &job("a", vec![task(0, "scene")])).await;
    let split = claim(store, &old).await.expect("a task");
    store.finish(&split, &made("blocks", &["x", "y"])).await.expect("finishes");
    assert_eq!(claim(store, &new).await, None, "its workers are there");
    assert_eq!(store.begin_anew(&new, Duration::ZERO).await.expect("asks"), []);
    let held = claim(store, &old).await.expect("a task");
    // No node of another version counts as one that could try it.
    assert!(store.fail(&held, "once", Retry::After(Duration::ZERO)).await.expect("fails").again);
    for _ in 0..2 {
        let held = claim(store, &old).await.expect("a task, again by the only node of its version");
        store.finish(&held, &Finished::default()).await.expect("finishes");
    }
    assert_eq!(state(store, &id).await, JobState::Successful);
    // The next one is whose workers take it first.
    submit(store, &job("b", vec![task(0, "scene")])).await;
    assert!(claim(store, &new).await.is_some());
    assert_eq!(claim(store, &old).await, None);
}

pub(crate) async fn a_job_whose_version_is_gone_begins_anew(store: &Store) {
    let (old, new) = (node(store, "old", "1").await, node(store, "new", "2").await);
    let id = submit(store, &job("a", vec![task(0, "scene")])).await;
    let split = claim(store, &old).await.expect("a task");
    store.finish(&split, &made("old blocks", &["x", "y"])).await.expect("finishes");
    let frozen = claim(store, &old).await.expect("a task");
    store.part_from_worker(&old.worker).await.expect("parted");
    assert_eq!(store.begin_anew(&new, Duration::ZERO).await.expect("asks"), [], "it is held still");
    store.release(&frozen).await.expect("handed back");
    let soon = store.begin_anew(&new, Duration::from_secs(60)).await.expect("asks");
    assert_eq!(soon, [], "its workers may be starting again");
    assert_eq!(claim(store, &new).await, None);
    let begun = store.begin_anew(&new, Duration::ZERO).await.expect("asks");
    assert_eq!(begun.iter().map(|a| (&*a.job, &*a.before)).collect::<Vec<_>>(), [(&*id, "1")]);
    assert_eq!(store.begin_anew(&new, Duration::ZERO).await.expect("asks"), []);
    assert_eq!(store.artifacts(&id, "").await.expect("a list"), [], "nothing of the other version is left");

    let split = claim(store, &new).await.expect("from the first task on");
    assert_eq!((&*split.unit, split.attempt), ("scene", 1));
    store.finish(&split, &made("new blocks", &["x", "y"])).await.expect("finishes");
    let again = claim(store, &new).await.expect("a task");
    assert_eq!(again.unit, frozen.unit);
    // Whoever had held the task of the same name before comes too late, whatever number they were given.
    assert!(again.fence > frozen.fence, "{} and {}", again.fence, frozen.fence);
    assert!(matches!(store.finish(&frozen, &made("late", &[])).await, Err(JobStoreError::Lost { .. })));
    store.finish(&again, &Finished::default()).await.expect("finishes");
    let last = claim(store, &new).await.expect("a task");
    store.finish(&last, &Finished::default()).await.expect("finishes");
    assert_eq!(state(store, &id).await, JobState::Successful);
    let files = store.artifacts(&id, "").await.expect("a list");
    assert_eq!(files.iter().map(|f| &*f.path).collect::<Vec<_>>(), ["new blocks"]);
    let events = store.events(&id, 0, 1000).await.expect("events");
    let told =
        events.iter().filter_map(|e| e.message.as_deref()).filter(|m| m.contains("begun anew by gable 2: gable 1"));
    assert_eq!(told.count(), 1);
}

pub(crate) async fn what_a_version_cannot_do_another_may(store: &Store) {
    let (old, new) = (node(store, "old", "1").await, node(store, "new", "2").await);
    submit(store, &job("a", vec![task(0, "scene")])).await;
    let held = claim(store, &old).await.expect("a task");
    store.fail(&held, "it does not see the source", Retry::Elsewhere).await.expect("handed back");
    assert_eq!(claim(store, &old).await, None);
    assert!(claim(store, &new).await.is_some(), "nothing of the job is made yet");
}

/// A program beside tables that a newer one has made.
pub(crate) async fn an_old_program_says_what_to_do(address: &str) {
    let store = Store::connect(address).await.expect("opens");
    store.close().await;
    sqlx::any::install_default_drivers();
    let pool = sqlx::AnyPool::connect(address).await.expect("opens");
    let made = "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time) \
                SELECT 9000, 'of later', success, checksum, 0 FROM _sqlx_migrations WHERE version = 1";
    sqlx::query(made).execute(&pool).await.expect("made");
    pool.close().await;
    let refused = Store::connect(address).await.expect_err("its tables are not known").to_string();
    for part in ["newer gable", "9000", "Start that program", "restore"] {
        assert!(refused.contains(part), "{part}: {refused}");
    }
}

#[tokio::test]
async fn an_old_program_says_what_to_do_on_sqlite() {
    let folder = tempfile::tempdir().expect("a folder");
    an_old_program_says_what_to_do(&format!("sqlite:{}?mode=rwc", folder.path().join("jobs.db").display())).await;
}

#[tokio::test]
async fn an_old_program_says_what_to_do_on_postgres() {
    let Some(address) = crate::postgres::database("newer_tables") else { return };
    an_old_program_says_what_to_do(&address).await;
}
