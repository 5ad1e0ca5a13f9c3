//! Which node does which task; each part on an empty database.

use crate::suite::{job, state, submit, task};
use gable_job_store::{
    Claim, Claimant, EventKind, Finished, JobState, NewTask, Retry, Store, TaskState, Verdict, Worker,
};
use std::time::Duration;

const LEASE: Duration = Duration::from_secs(30);
const NOW: Retry = Retry::After(Duration::ZERO);

/// A node that is there.
async fn node(store: &Store, name: &str, task_memory: i64, trouble: Option<&str>) -> Claimant {
    let worker = Worker {
        id: format!("{name}-0"),
        host: "h".to_owned(),
        pid: 1,
        version: String::new(),
        started: 0,
        seen: 0,
        task: None,
        memory: 0,
        node: name.to_owned(),
        task_memory,
        trouble: trouble.map(str::to_owned),
    };
    store.see_worker(&worker).await.expect("seen");
    Claimant { worker: worker.id, node: worker.node, task_memory, version: worker.version }
}

async fn claim(store: &Store, by: &Claimant) -> Option<Claim> {
    store.claim_as(by, LEASE).await.expect("claims")
}

pub(crate) async fn a_broken_node_leaves_tasks_to_others(store: &Store) {
    let (broken, sound) = (node(store, "broken", 100, None).await, node(store, "sound", 100, None).await);
    let id = submit(store, &job("a", vec![task(0, "x"), task(0, "y")])).await;
    for _ in 0..2 {
        let held = claim(store, &broken).await.expect("a task");
        assert!(store.fail(&held, "its program dies", NOW).await.expect("fails").again);
    }
    assert_eq!(claim(store, &broken).await, None, "another node has not tried them");
    for unit in ["x", "y"] {
        let held = claim(store, &sound).await.expect("a task");
        assert_eq!((&*held.unit, held.attempt), (unit, 2));
        store.finish(&held, &Finished::default()).await.expect("finishes");
    }
    assert_eq!(state(store, &id).await, JobState::Successful);
}

pub(crate) async fn a_task_fails_only_when_nodes_have_tried_it(store: &Store) {
    let (a, b) = (node(store, "a", 100, None).await, node(store, "b", 100, None).await);
    let id = submit(store, &job("a", vec![NewTask { max_attempts: 1, ..task(0, "x") }])).await;
    let held = claim(store, &a).await.expect("a task");
    assert!(store.fail(&held, "once", NOW).await.expect("fails").again, "b has not tried it");
    let held = claim(store, &b).await.expect("a task");
    assert!(!store.fail(&held, "twice", NOW).await.expect("fails").again, "all have");
    assert_eq!(state(store, &id).await, JobState::Partial);

    // Those that rest or have gone do not count, and what all have tried anyone may try again.
    let tired = node(store, "b", 100, Some("rests")).await;
    store.retry_failed(&id).await.expect("retries");
    let held = claim(store, &a).await.expect("a task, for a retry forgets who tried it");
    assert!(!store.fail(&held, "once", NOW).await.expect("fails").again, "b takes no tasks");
    assert_eq!(store.judge("a", &[]).await.expect("asks"), Verdict::default());
    store.part_from_worker(&tired.worker).await.expect("parts");
    let id = submit(store, &job("b", vec![task(0, "x")])).await;
    for again in [true, true, false] {
        let held = claim(store, &a).await.expect("a task");
        assert_eq!(store.fail(&held, "no", NOW).await.expect("fails").again, again);
    }
    assert_eq!(state(store, &id).await, JobState::Partial);
    let c = node(store, "c", 100, None).await;
    let failed = [(id, 0, "x".to_owned())];
    assert_eq!(store.judge("c", &failed).await.expect("asks"), Verdict { others: true, failed_elsewhere: 1 });
    assert_eq!(store.judge("a", &failed).await.expect("asks"), Verdict { others: true, failed_elsewhere: 0 });
    assert_eq!(claim(store, &c).await, None);
}

pub(crate) async fn losses_are_counted_apart(store: &Store) {
    let id = submit(store, &job("a", vec![NewTask { max_attempts: 2, required: true, ..task(0, "x") }])).await;
    let lose = async || {
        let held = store.claim("w", Duration::ZERO).await.expect("claims").expect("a task");
        tokio::time::sleep(Duration::from_millis(5)).await;
        assert_eq!(store.reap().await.expect("reaps").len(), 1);
        held.attempt
    };
    for _ in 0..12 {
        assert_eq!(lose().await, 1, "no attempt is used up");
    }
    let held = store.claim("w", LEASE).await.expect("claims").expect("a task");
    assert!(store.fail(&held, "no", NOW).await.expect("fails").again);
    for _ in 12..19 {
        assert_eq!(lose().await, 2);
    }
    assert_eq!(state(store, &id).await, JobState::Running);
    assert_eq!(lose().await, 2);
    assert_eq!(state(store, &id).await, JobState::Failed, "what kills workers ends");
    assert_eq!(store.job(&id).await.expect("there").reason.as_deref(), Some("worker w fell silent"));
}

pub(crate) async fn a_task_goes_to_a_node_that_has_what_it_needs(store: &Store) {
    let (small, large) = (node(store, "small", 100, None).await, node(store, "large", 200, None).await);
    let id = submit(store, &job("a", vec![task(0, "x")])).await;
    let held = claim(store, &small).await.expect("a task");
    assert!(store.fail(&held, "used 1 MB", Retry::WithMemory(Duration::ZERO, 100)).await.expect("fails").again);
    assert_eq!(claim(store, &small).await, None, "it needs more than there is");
    let held = claim(store, &large).await.expect("a task");
    store.finish(&held, &Finished::default()).await.expect("finishes");
    assert_eq!(state(store, &id).await, JobState::Successful);

    // A worker that does not see the source leaves it to others, those that come later, too.
    let id = submit(store, &job("b", vec![NewTask { required: true, ..task(0, "scene") }])).await;
    for by in [&small, &large] {
        let held = claim(store, by).await.expect("a task");
        assert!(store.fail(&held, "not seen here", Retry::Elsewhere).await.expect("fails").again);
        assert_eq!(claim(store, by).await, None, "it is not offered again");
    }
    assert_eq!(store.reap().await.expect("reaps"), [], "it waits");
    let waiting = &store.tasks(&id).await.expect("tasks")[0];
    assert_eq!(
        (waiting.state, waiting.attempts, waiting.reason.as_deref()),
        (TaskState::Ready, 0, Some("not seen here"))
    );
    let events = store.events(&id, 0, 100).await.expect("events");
    assert!(events.iter().any(|e| e.kind == EventKind::Retry && e.message.as_deref() == Some("not seen here")));
    let seeing = node(store, "seeing", 1, None).await;
    let held = claim(store, &seeing).await.expect("a task");
    assert_eq!(held.attempt, 1);
    store.finish(&held, &Finished::default()).await.expect("finishes");
    assert_eq!(state(store, &id).await, JobState::Successful);
}
