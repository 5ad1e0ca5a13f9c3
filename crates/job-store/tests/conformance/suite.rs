//! The suite, each part on an empty database.

use gable_job_store::{
    Artifact, BlobId, Claim, EventKind, Finished, JobFilter, JobState, JobStoreError, NewJob, NewTask, Order, Retry,
    Scope, Store, TaskLog, TaskState, TokenRecord, Worker,
};
use std::collections::BTreeMap;
use std::time::Duration;

const LEASE: Duration = Duration::from_secs(30);
const SHORT: Duration = Duration::from_millis(40);

pub(crate) fn task(stage: i64, unit: &str) -> NewTask {
    NewTask {
        stage,
        unit: unit.to_owned(),
        input: format!("{{\"unit\":\"{unit}\"}}"),
        required: false,
        max_attempts: 3,
    }
}

pub(crate) fn job(city: &str, tasks: Vec<NewTask>) -> NewJob {
    NewJob {
        city: city.to_owned(),
        owner: "ann".to_owned(),
        request: format!("{{\"city\":\"{city}\"}}"),
        tasks,
        ..NewJob::default()
    }
}

pub(crate) async fn submit(store: &Store, new: &NewJob) -> String {
    let submitted = store.submit(new).await.expect("submitted");
    assert!(submitted.new);
    submitted.id
}

pub(crate) async fn claim(store: &Store, worker: &str) -> Claim {
    store.claim(worker, LEASE).await.expect("claims").expect("a task is ready")
}

pub(crate) async fn finish(store: &Store, claim: &Claim) {
    store.finish(claim, &Finished::default()).await.expect("finishes");
}

pub(crate) async fn state(store: &Store, id: &str) -> JobState {
    store.job(id).await.expect("the job").state
}

pub(crate) async fn nothing_to_do(store: &Store) -> bool {
    store.claim("w", LEASE).await.expect("claims").is_none()
}

pub(crate) async fn a_job_goes_through_its_stages(store: &Store) {
    let id = submit(store, &job("delft", vec![task(0, "city")])).await;
    assert_eq!(state(store, &id).await, JobState::Accepted);
    let split = claim(store, "w").await;
    assert_eq!((split.stage, &*split.unit, split.attempt), (0, "city", 1));
    assert_eq!((&*split.request, &*split.input), (r#"{"city":"delft"}"#, r#"{"unit":"city"}"#));
    assert_eq!(state(store, &id).await, JobState::Running);
    assert!(nothing_to_do(store).await);
    let tasks = vec![task(1, "0_0"), task(1, "0_1"), task(2, "city")];
    store.finish(&split, &Finished { tasks, ..Finished::default() }).await.expect("finishes");
    let (a, b) = (claim(store, "w").await, claim(store, "v").await);
    assert_eq!((&*a.unit, &*b.unit), ("0_0", "0_1"));
    finish(store, &a).await;
    assert!(nothing_to_do(store).await, "the next stage waits for 0_1");
    finish(store, &b).await;
    let last = claim(store, "w").await;
    assert_eq!((last.stage, &*last.unit), (2, "city"));
    assert_eq!(store.job(&id).await.expect("the job").stage, 2);
    finish(store, &last).await;
    let done = store.job(&id).await.expect("the job");
    assert_eq!(done.state, JobState::Successful);
    assert!(done.started.expect("started") >= done.created && done.finished >= done.started);
    assert_eq!(store.task_counts(&id).await.expect("counts"), {
        BTreeMap::from([((0, TaskState::Done), 1), ((1, TaskState::Done), 2), ((2, TaskState::Done), 1)])
    });
}

pub(crate) async fn a_repeated_submission_is_the_same_job(store: &Store) {
    let mut new = job("delft", vec![task(0, "city")]);
    new.idempotency_key = Some("k1".to_owned());
    let first = store.submit(&new).await.expect("submitted");
    let again = store.submit(&new).await.expect("submitted");
    assert!(first.new && !again.new);
    assert_eq!(first.id, again.id);
    assert_eq!(store.tasks(&first.id).await.expect("tasks").len(), 1);
    let other = NewJob { owner: "bob".to_owned(), ..new.clone() };
    assert!(store.submit(&other).await.expect("submitted").new, "keys belong to their owner");
    let differs = NewJob { request: "{}".to_owned(), ..new };
    assert!(matches!(store.submit(&differs).await, Err(JobStoreError::KeyReused { job, .. }) if job == first.id));
    let keyless = job("delft", vec![task(0, "city")]);
    assert!(store.submit(&keyless).await.expect("submitted").new);
    assert!(store.submit(&keyless).await.expect("submitted").new);
}

pub(crate) async fn higher_priority_first_then_older(store: &Store) {
    let old = submit(store, &job("a", vec![task(0, "x")])).await;
    let young = submit(store, &job("b", vec![task(0, "x")])).await;
    let urgent = submit(store, &NewJob { priority: 5, ..job("c", vec![task(0, "x")]) }).await;
    let raised = submit(store, &job("d", vec![task(0, "x")])).await;
    store.set_priority(&raised, 9).await.expect("set");
    let mut order = Vec::new();
    for _ in 0..4 {
        order.push(claim(store, "w").await.job);
    }
    assert_eq!(order, [raised, urgent, old, young]);
}

pub(crate) async fn pause_cancel_and_retry(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "x"), task(0, "y"), task(1, "z")])).await;
    let x = claim(store, "w").await;
    store.pause(&id).await.expect("pauses");
    assert!(nothing_to_do(store).await);
    finish(store, &x).await;
    assert_eq!(state(store, &id).await, JobState::Paused, "what was under way still counts");
    assert!(matches!(store.pause(&id).await, Err(JobStoreError::State { .. })));
    store.resume(&id).await.expect("resumes");
    let y = claim(store, "w").await;
    store.fail(&y, "bad texture", Retry::Never).await.expect("fails");
    let z = claim(store, "w").await;
    assert_eq!(z.stage, 1);
    finish(store, &z).await;
    assert_eq!(state(store, &id).await, JobState::Partial);
    store.retry_failed(&id).await.expect("retries");
    let y = claim(store, "w").await;
    assert_eq!((&*y.unit, y.attempt), ("y", 1));
    finish(store, &y).await;
    let z = claim(store, "w").await;
    assert_eq!(z.stage, 1, "what depends on it is done again");
    store.cancel(&id).await.expect("cancels");
    assert_eq!(store.heartbeat(&z, LEASE, "half").await.expect("beats"), Order::Stop);
    assert!(matches!(store.finish(&z, &Finished::default()).await, Err(JobStoreError::Lost { .. })));
    assert_eq!(state(store, &id).await, JobState::Cancelled);
    assert!(matches!(store.cancel(&id).await, Err(JobStoreError::State { .. })));
    assert!(matches!(store.retry_failed(&id).await, Err(JobStoreError::State { .. })));
    assert!(nothing_to_do(store).await);
}

pub(crate) async fn a_late_result_is_refused(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "x")])).await;
    let frozen = store.claim("frozen", SHORT).await.expect("claims").expect("ready");
    tokio::time::sleep(2 * SHORT).await;
    let reaped = store.reap().await.expect("reaps");
    let said = |r: &gable_job_store::Reaped| (r.city.clone(), r.unit.clone(), r.attempt, r.worker.clone());
    let expected = ("a".to_owned(), "x".to_owned(), 1, "frozen".to_owned());
    assert_eq!(reaped.iter().map(said).collect::<Vec<_>>(), [expected]);
    assert!(reaped[0].consequence.again && reaped[0].consequence.took >= SHORT, "{reaped:?}");
    let second = claim(store, "second").await;
    assert_eq!((second.attempt, second.fence), (1, frozen.fence + 1), "the lost one does not count");
    let made = |name: &[u8]| Artifact { path: "a".to_owned(), blob: BlobId::of(name), bytes: 1 };
    let late = Finished { artifacts: vec![made(b"late")], tasks: vec![task(1, "late")], ..Finished::default() };
    assert!(matches!(store.finish(&frozen, &late).await, Err(JobStoreError::Lost { .. })));
    assert_eq!(store.heartbeat(&frozen, LEASE, "").await.expect("beats"), Order::Stop);
    assert!(matches!(store.fail(&frozen, "late", Retry::Never).await, Err(JobStoreError::Lost { .. })));
    let good = Finished { artifacts: vec![made(b"good")], ..Finished::default() };
    store.finish(&second, &good).await.expect("finishes");
    assert!(matches!(store.finish(&second, &good).await, Err(JobStoreError::Lost { .. })), "once is enough");
    assert_eq!(store.artifacts(&id, "").await.expect("artefacts"), good.artifacts);
    assert_eq!(store.tasks(&id).await.expect("tasks").len(), 1);
    assert_eq!(state(store, &id).await, JobState::Successful);
}

pub(crate) async fn a_silent_worker_loses_its_task(store: &Store) {
    let id = submit(store, &job("a", vec![NewTask { max_attempts: 2, ..task(0, "x") }])).await;
    let alive = store.claim("w", Duration::from_millis(300)).await.expect("claims").expect("ready");
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert_eq!(store.heartbeat(&alive, Duration::from_secs(20), "half").await.expect("beats"), Order::Continue);
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert_eq!(store.reap().await.expect("reaps"), [], "a heartbeat keeps it");
    assert_eq!(store.tasks(&id).await.expect("tasks")[0].phase.as_deref(), Some("half"));
    assert_eq!(store.heartbeat(&alive, Duration::ZERO, "").await.expect("beats"), Order::Continue);
    tokio::time::sleep(SHORT).await;
    assert_eq!(store.reap().await.expect("reaps").len(), 1);
    store.claim("v", Duration::ZERO).await.expect("claims").expect("ready again");
    tokio::time::sleep(SHORT).await;
    assert_eq!(store.reap().await.expect("reaps").len(), 1);
    let task = &store.tasks(&id).await.expect("tasks")[0];
    assert_eq!((task.state, task.attempts), (TaskState::Ready, 0), "no attempt is used up");
    assert_eq!(task.reason.as_deref(), Some("worker v fell silent"));
    assert_eq!(state(store, &id).await, JobState::Running);
}

pub(crate) async fn a_task_that_always_fails_makes_the_job_partial(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "bad"), task(0, "good"), task(1, "city")])).await;
    for attempt in 1..=3 {
        let bad = claim(store, "w").await;
        assert_eq!((&*bad.unit, bad.attempt), ("bad", attempt));
        let followed = store.fail(&bad, "out of memory", Retry::After(Duration::ZERO)).await.expect("fails");
        assert_eq!((followed.again, followed.ended), (attempt < 3, None));
    }
    let good = claim(store, "w").await;
    assert_eq!(good.unit, "good");
    store.fail(&good, "disk full", Retry::After(Duration::from_millis(300))).await.expect("fails");
    assert!(nothing_to_do(store).await, "it is tried again, but not at once");
    tokio::time::sleep(Duration::from_millis(400)).await;
    finish(store, &claim(store, "w").await).await;
    let last = claim(store, "w").await;
    let followed = store.finish(&last, &Finished::default()).await.expect("finishes");
    assert_eq!((followed.again, followed.ended), (false, Some(JobState::Partial)));
    assert_eq!(state(store, &id).await, JobState::Partial);
    let tasks = store.tasks(&id).await.expect("tasks");
    assert_eq!(tasks[0].reason.as_deref(), Some("out of memory"));
    assert_eq!(tasks[1].reason, None);
}

pub(crate) async fn a_required_task_that_fails_ends_the_job(store: &Store) {
    let id =
        submit(store, &job("a", vec![NewTask { required: true, ..task(0, "city") }, task(0, "x"), task(1, "y")])).await;
    let city = claim(store, "w").await;
    let other = claim(store, "v").await;
    let followed = store.fail(&city, "mesh.obj: line 7: no such vertex", Retry::Never).await.expect("fails");
    assert_eq!((followed.again, followed.ended), (false, Some(JobState::Failed)));
    let job = store.job(&id).await.expect("the job");
    assert_eq!((job.state, job.reason.as_deref()), (JobState::Failed, Some("mesh.obj: line 7: no such vertex")));
    assert_eq!(store.heartbeat(&other, LEASE, "").await.expect("beats"), Order::Stop);
    assert!(nothing_to_do(store).await);
    store.retry_failed(&id).await.expect("retries");
    for unit in ["city", "x", "y"] {
        let next = claim(store, "w").await;
        assert_eq!(next.unit, unit);
        finish(store, &next).await;
    }
    assert_eq!(state(store, &id).await, JobState::Successful);
}

pub(crate) async fn a_task_handed_back_loses_no_attempt(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "x")])).await;
    for _ in 0..5 {
        let held = claim(store, "draining").await;
        assert_eq!(held.attempt, 1);
        store.release(&held).await.expect("hands back");
        assert!(matches!(store.release(&held).await, Err(JobStoreError::Lost { .. })));
    }
    finish(store, &claim(store, "w").await).await;
    assert_eq!(state(store, &id).await, JobState::Successful);
}

pub(crate) async fn the_log_of_the_last_attempt_is_kept(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "x"), task(1, "x"), task(1, "y")])).await;
    let first = claim(store, "w").await;
    store.keep_log(&first, "no luck").await.expect("keeps");
    store.fail(&first, "disk full", Retry::After(Duration::ZERO)).await.expect("fails");
    assert!(matches!(store.keep_log(&first, "late").await, Err(JobStoreError::Lost { .. })));
    let log = |stage, attempt, text: &str| TaskLog { stage, attempt, text: text.to_owned() };
    assert_eq!(store.logs(&id, "x").await.expect("logs"), [log(0, 1, "no luck")]);
    let second = claim(store, "v").await;
    assert!(matches!(store.keep_log(&first, "late").await, Err(JobStoreError::Lost { .. })));
    // What no text of Postgres may have, and what would be markup.
    store.keep_log(&second, "so far\n<b>well\0").await.expect("keeps");
    finish(store, &second).await;
    let held = claim(store, "v").await;
    store.keep_log(&held, "stopped").await.expect("keeps");
    store.release(&held).await.expect("hands back");
    let expected = [log(0, 2, "so far\n<b>well\u{fffd}"), log(1, 1, "stopped")];
    assert_eq!(store.logs(&id, "x").await.expect("logs"), expected);
    assert_eq!(store.logs(&id, "y").await.expect("logs"), []);
    assert!(matches!(store.logs("nobody", "x").await, Err(JobStoreError::NoJob(_))));
    finish(store, &claim(store, "w").await).await;
    finish(store, &claim(store, "w").await).await;

    // A log goes with its task: what was added behind a failure is dropped by a retry.
    let id = submit(store, &job("b", vec![task(0, "x"), task(1, "y")])).await;
    store.fail(&claim(store, "w").await, "no memory", Retry::Never).await.expect("fails");
    let tasks = vec![task(2, "z")];
    store.finish(&claim(store, "w").await, &Finished { tasks, ..Finished::default() }).await.expect("finishes");
    let held = claim(store, "w").await;
    store.keep_log(&held, "fine").await.expect("keeps");
    finish(store, &held).await;
    assert_eq!(store.logs(&id, "z").await.expect("logs"), [log(2, 1, "fine")]);
    store.retry_failed(&id).await.expect("retries");
    assert_eq!(store.logs(&id, "z").await.expect("logs"), []);
}

pub(crate) async fn many_workers_do_each_task_once(store: &Store) {
    let units: Vec<NewTask> = (0..60).map(|i| task(0, &format!("{i:02}"))).collect();
    let jobs = [submit(store, &job("a", units.clone())).await, submit(store, &job("b", units)).await];
    let workers: Vec<_> = (0..8)
        .map(|w| {
            let store = store.clone();
            tokio::spawn(async move {
                let mut done = Vec::new();
                while let Some(held) = store.claim(&format!("w{w}"), LEASE).await.expect("claims") {
                    finish(&store, &held).await;
                    done.push((held.job, held.unit));
                }
                done
            })
        })
        .collect();
    let mut done = Vec::new();
    for worker in workers {
        done.extend(worker.await.expect("the worker ends"));
    }
    done.sort();
    assert_eq!(done.len(), 120);
    done.dedup();
    assert_eq!(done.len(), 120, "no task was done twice");
    for id in &jobs {
        assert_eq!(state(store, id).await, JobState::Successful);
    }
}

/// Workers that die or freeze at any step, as a seeded sequence has it: the job ends with every result there once.
pub(crate) async fn random_deaths_change_nothing(store: &Store) {
    let units: Vec<NewTask> = (0..12).map(|i| NewTask { max_attempts: 1000, ..task(1, &format!("{i:02}")) }).collect();
    let id = submit(store, &job("a", vec![NewTask { max_attempts: 1000, ..task(0, "split") }])).await;
    let mut random = 0x2018_u64;
    let mut draw = move |n: u64| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % n
    };
    let result = |held: &Claim| Finished {
        artifacts: vec![Artifact {
            path: format!("{}/{}", held.stage, held.unit),
            blob: BlobId::of(format!("{} {}", held.unit, held.attempt).as_bytes()),
            bytes: held.attempt as u64,
        }],
        tasks: if held.stage == 0 { units.clone() } else { Vec::new() },
        ..Finished::default()
    };
    let mut frozen: Vec<Claim> = Vec::new();
    let mut winners = BTreeMap::new();
    while !state(store, &id).await.is_over() {
        match draw(5) {
            0 if !frozen.is_empty() => {
                // A frozen worker wakes up and hands in what it has.
                let late = frozen.swap_remove(draw(frozen.len() as u64) as usize);
                match store.finish(&late, &result(&late)).await {
                    Ok(_) => assert!(winners.insert((late.stage, late.unit.clone()), late.attempt).is_none()),
                    Err(JobStoreError::Lost { .. }) => {}
                    Err(e) => panic!("{e}"),
                }
            }
            1 => {
                store.reap().await.expect("reaps");
            }
            2 => {
                // Claimed by a worker that falls silent at once.
                frozen.extend(store.claim("dead", Duration::ZERO).await.expect("claims"));
            }
            _ => {
                if let Some(held) = store.claim("w", LEASE).await.expect("claims") {
                    store.finish(&held, &result(&held)).await.expect("finishes");
                    assert!(winners.insert((held.stage, held.unit.clone()), held.attempt).is_none());
                }
            }
        }
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    assert_eq!(state(store, &id).await, JobState::Successful);
    assert_eq!(winners.len(), 13);
    let artefacts = store.artifacts(&id, "").await.expect("artefacts");
    assert_eq!(artefacts.len(), 13);
    for artefact in artefacts {
        let (stage, unit) = artefact.path.split_once('/').expect("a path");
        let attempt = winners[&(stage.parse().expect("a stage"), unit.to_owned())];
        assert_eq!(artefact.bytes, attempt as u64, "{}: the result is the one that was accepted", artefact.path);
    }
}

pub(crate) async fn events_have_no_gaps(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "x"), task(1, "y")])).await;
    let x = claim(store, "w").await;
    store.fail(&x, "disk full", Retry::After(Duration::ZERO)).await.expect("fails");
    finish(store, &claim(store, "w").await).await;
    finish(store, &claim(store, "w").await).await;
    let events = store.events(&id, 0, 100).await.expect("events");
    let kinds: Vec<EventKind> = events.iter().map(|e| e.kind).collect();
    use EventKind::{Claimed, Done, Retry as Again, Stage, State, Submitted};
    assert_eq!(kinds, [Submitted, State, Claimed, Again, Claimed, Done, Stage, Claimed, Done, State]);
    assert!(events.iter().zip(1..).all(|(e, n)| e.number == n));
    assert!(events.windows(2).all(|w| w[0].at <= w[1].at));
    assert_eq!(events[3].message.as_deref(), Some("disk full"));
    assert_eq!(events[9].message.as_deref(), Some("successful"));
    assert_eq!(store.events(&id, 4, 3).await.expect("events"), events[4..7]);
    assert_eq!(store.job(&id).await.expect("the job").events, 10);
    let last = store.last_events(&[&id, "none"]).await.expect("asks");
    assert_eq!(last, [(id, 10, JobState::Successful)]);
}

pub(crate) async fn figures_tell_what_was_done(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "x"), task(1, "y")])).await;
    let paused = submit(store, &job("b", vec![task(0, "z")])).await;
    store.pause(&paused).await.expect("pauses");
    let figures = store.figures(Duration::from_secs(60)).await.expect("figures");
    assert_eq!(figures.jobs, [(JobState::Accepted, 1), (JobState::Paused, 1)]);
    let queue: Vec<_> = figures.queue.iter().map(|q| (q.stage, q.state, q.tasks, q.claimable)).collect();
    assert_eq!(queue, [(0, TaskState::Ready, 2, 1), (1, TaskState::Ready, 1, 0)]);
    assert!(figures.attempts.is_empty() && figures.workers.is_empty());
    tokio::time::sleep(Duration::from_millis(20)).await;
    let waits = store.figures(Duration::from_secs(60)).await.expect("figures").oldest_waiting;
    assert!((20..60_000).contains(&waits), "{waits}");
    assert_eq!(store.stored_bytes().await.expect("figures"), 0);

    let lost = store.claim("w", Duration::from_millis(1)).await.expect("claims").expect("a task");
    tokio::time::sleep(Duration::from_millis(30)).await;
    assert_eq!(store.reap().await.expect("reaps").len(), 1);
    assert_eq!(lost.attempt, 1);
    store.release(&claim(store, "w").await).await.expect("hands back");
    store.fail(&claim(store, "w").await, "disk full", Retry::After(Duration::ZERO)).await.expect("fails");
    let artifact = Artifact { path: "a".to_owned(), blob: BlobId::of(b"abc"), bytes: 3 };
    // The same content under another path takes no more room.
    let again = Artifact { path: "b".to_owned(), ..artifact.clone() };
    let result = Finished { artifacts: vec![artifact, again], ..Finished::default() };
    store.finish(&claim(store, "w").await, &result).await.expect("finishes");
    store.fail(&claim(store, "w").await, "bad", Retry::Never).await.expect("fails");
    assert_eq!(state(store, &id).await, JobState::Partial);
    let figures = store.figures(Duration::from_secs(60)).await.expect("figures");
    let attempts: Vec<_> = figures.attempts.iter().map(|a| (a.stage, a.outcome.name(), a.tasks, a.bytes)).collect();
    assert_eq!(
        attempts,
        [(0, "done", 1, 6), (0, "handed-back", 1, 0), (0, "lost", 1, 0), (0, "retried", 1, 0), (1, "failed", 1, 0)]
    );
    assert!(figures.attempts[2].seconds >= 0.02, "{:?}", figures.attempts);
    assert_eq!(figures.oldest_waiting, 0, "nothing is merely accepted any more");
    assert_eq!(store.stored_bytes().await.expect("figures"), 3);
}

pub(crate) async fn lists_are_paged(store: &Store) {
    let mut ids = Vec::new();
    for i in 0..7 {
        ids.push(submit(store, &job(if i % 2 == 0 { "even" } else { "odd" }, vec![task(0, "x")])).await);
    }
    ids.reverse();
    let names = |jobs: Vec<gable_job_store::Job>| jobs.into_iter().map(|j| j.id).collect::<Vec<_>>();
    let first = names(store.jobs(&JobFilter::default(), 3).await.expect("jobs"));
    assert_eq!(first, ids[..3]);
    let next = JobFilter { before: Some(first[2].clone()), ..JobFilter::default() };
    assert_eq!(names(store.jobs(&next, 100).await.expect("jobs")), ids[3..]);
    let odd = JobFilter { city: Some("odd".to_owned()), ..JobFilter::default() };
    assert_eq!(store.jobs(&odd, 100).await.expect("jobs").len(), 3);
    claim(store, "w").await;
    let running = JobFilter { states: vec![JobState::Running], ..JobFilter::default() };
    assert_eq!(names(store.jobs(&running, 100).await.expect("jobs")), ids[6..]);
    let bob = JobFilter { owner: Some("bob".to_owned()), ..JobFilter::default() };
    assert!(store.jobs(&bob, 100).await.expect("jobs").is_empty());
}

pub(crate) async fn artefacts_are_found_by_prefix(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "x"), task(1, "y")])).await;
    let made = |path: &str| Artifact { path: path.to_owned(), blob: BlobId::of(path.as_bytes()), bytes: 3 };
    let artifacts = vec![made("tiles/0_0"), made("tiles/0_1"), made("tile%/1")];
    store
        .finish(&claim(store, "w").await, &Finished { artifacts: artifacts.clone(), ..Finished::default() })
        .await
        .expect("finishes");
    assert_eq!(store.artifacts(&id, "tiles/").await.expect("artefacts"), artifacts[..2]);
    assert_eq!(store.artifacts(&id, "tile%").await.expect("artefacts"), artifacts[2..]);
    assert!(store.is_referenced(BlobId::of(b"tiles/0_0")).await.expect("asks"));
    let replaced = Artifact { blob: BlobId::of(b"new"), ..made("tiles/0_0") };
    store
        .finish(&claim(store, "w").await, &Finished { artifacts: vec![replaced.clone()], ..Finished::default() })
        .await
        .expect("finishes");
    assert_eq!(store.artifacts(&id, "tiles/0_0").await.expect("artefacts"), [replaced]);
    assert!(!store.is_referenced(BlobId::of(b"tiles/0_0")).await.expect("asks"));
}

pub(crate) async fn artefacts_are_found_by_place(store: &Store) {
    let id = submit(store, &job("a", vec![task(0, "x")])).await;
    let artifact = |path: &str| Artifact { path: path.to_owned(), blob: BlobId::of(path.as_bytes()), bytes: 1 };
    let artifacts = ["a/1", "a/2", "ab", "b/1", "b/11"].map(artifact).to_vec();
    store.finish(&claim(store, "w").await, &Finished { artifacts, ..Finished::default() }).await.expect("finishes");
    let found = store.artifacts_at(&id, &["b/1", "a/", "none", "a/2"].map(str::to_owned)).await.expect("finds");
    assert_eq!(found, ["a/1", "a/2", "b/1"].map(artifact));
    let many: Vec<String> = (0..1200).map(|i| format!("b/{i}")).collect();
    assert_eq!(store.artifacts_at(&id, &many).await.expect("finds").len(), 2);
    assert!(store.artifacts_at(&id, &[]).await.expect("finds").is_empty());
}

pub(crate) async fn workers_are_seen(store: &Store) {
    let worker = Worker {
        id: "w1".to_owned(),
        host: "lap".to_owned(),
        pid: 7,
        version: "0.1.0".to_owned(),
        started: 0,
        seen: 0,
        task: None,
        memory: 1 << 40,
        node: "n".to_owned(),
        task_memory: 7,
        trouble: None,
    };
    store.see_worker(&worker).await.expect("seen");
    tokio::time::sleep(Duration::from_millis(20)).await;
    store.see_worker(&Worker { task: Some("0_0".to_owned()), ..worker }).await.expect("seen");
    let found = store.workers().await.expect("workers");
    assert_eq!(found.len(), 1);
    assert!(found[0].seen > found[0].started && found[0].started > 0);
    assert_eq!((found[0].task.as_deref(), found[0].memory), (Some("0_0"), 1 << 40));
}

pub(crate) async fn tokens_open_and_end(store: &Store) {
    let token = |name: &str, hash: &str, expires| TokenRecord {
        hash: hash.to_owned(),
        name: name.to_owned(),
        scope: Scope::Viewer,
        groups: Vec::new(),
        max_jobs: Some(2),
        expires,
        created: 0,
    };
    let plain = |found: Option<TokenRecord>| found.map(|t| TokenRecord { created: 0, ..t });
    assert!(!store.has_tokens().await.expect("asks"));
    assert!(store.add_token(&token("ann", "h1", None)).await.expect("adds"));
    assert!(!store.add_token(&token("ann", "h2", None)).await.expect("adds"), "the name is taken");
    assert!(store.add_token(&token("old", "h3", Some(1))).await.expect("adds"));
    assert_eq!(plain(store.token("h1").await.expect("asks")), Some(token("ann", "h1", None)));
    assert_eq!(store.token("h2").await.expect("asks"), None);
    assert_eq!(store.token("h3").await.expect("asks"), None, "it has ended");
    let listed = store.tokens().await.expect("lists");
    assert_eq!(listed.iter().map(|t| t.name.as_str()).collect::<Vec<_>>(), ["ann", "old"]);
    assert!(listed.iter().all(|t| t.created > 1_700_000_000_000), "by the database's clock");
    assert!(store.remove_token("ann").await.expect("removes"));
    assert!(!store.remove_token("ann").await.expect("removes"));
    assert_eq!(store.token("h1").await.expect("asks"), None);
    assert!(store.has_tokens().await.expect("asks"), "one that has ended keeps the service closed");
}

pub(crate) async fn the_first_token_has_one_maker(store: &Store) {
    let token = |hash: &str, name: &str| TokenRecord {
        hash: hash.to_owned(),
        name: name.to_owned(),
        scope: Scope::Operator,
        groups: Vec::new(),
        max_jobs: None,
        expires: None,
        created: 0,
    };
    let makers = (0..8).map(|number| {
        let (store, token) = (store.clone(), token(&format!("h{number}"), "operator"));
        tokio::spawn(async move { (store.add_first_token(&token).await.expect("asks"), token.hash) })
    });
    let mut made = Vec::new();
    for maker in makers.collect::<Vec<_>>() {
        let (first, hash) = maker.await.expect("it ends");
        made.extend(first.then_some(hash));
    }
    assert_eq!(made.len(), 1, "{made:?}");
    let tokens = store.tokens().await.expect("lists");
    assert_eq!((tokens.len(), &tokens[0].hash), (1, &made[0]));
    assert!(!store.add_first_token(&token("h", "another")).await.expect("asks"), "there is one");
    assert!(store.add_token(&token("h", "another")).await.expect("adds"));
}

pub(crate) async fn a_quota_holds_however_many_submit_at_once(store: &Store) {
    let token = TokenRecord {
        hash: "h".to_owned(),
        name: "ann".to_owned(),
        scope: Scope::Submitter,
        groups: Vec::new(),
        max_jobs: Some(5),
        expires: None,
        created: 0,
    };
    assert!(store.add_token(&token).await.expect("adds"));
    let limited = NewJob { max_jobs: Some(5), ..job("delft", vec![task(0, "x")]) };
    let all: Vec<_> = (0..40)
        .map(|number| {
            // Half of them twice under the same key: a repetition takes no place.
            let key = (number % 2 == 0).then(|| format!("k{}", number / 4));
            let new = NewJob { idempotency_key: key, ..limited.clone() };
            let store = store.clone();
            tokio::spawn(async move { store.submit(&new).await })
        })
        .collect();
    let (mut made, mut refused, mut repeated) = (Vec::new(), 0, 0);
    for one in all {
        match one.await.expect("ends") {
            Ok(submitted) if submitted.new => made.push(submitted.id),
            Ok(_) => repeated += 1,
            Err(JobStoreError::Quota { owner, most }) => {
                assert_eq!((&*owner, most), ("ann", 5));
                refused += 1;
            }
            Err(e) => panic!("{e}"),
        }
    }
    assert_eq!((made.len(), refused + repeated), (5, 35));
    let listed = store.jobs(&JobFilter { owner: Some("ann".to_owned()), ..JobFilter::default() }, 100).await;
    assert_eq!(listed.expect("lists").len(), 5, "what was refused left nothing behind");
    store.cancel(&made[0]).await.expect("cancels");
    assert!(store.submit(&limited).await.expect("a place is free").new);
    assert!(matches!(store.submit(&limited).await, Err(JobStoreError::Quota { .. })));
    let other = NewJob { owner: "bob".to_owned(), ..limited };
    assert!(store.submit(&other).await.expect("a quota is one owner's").new);
}

pub(crate) async fn wrong_requests_are_refused(store: &Store) {
    assert!(matches!(store.job("none").await, Err(JobStoreError::NoJob(_))));
    assert!(matches!(store.cancel("none").await, Err(JobStoreError::NoJob(_))));
    let id = submit(store, &job("'; DROP TABLE job; --", vec![task(0, "x")])).await;
    let held = claim(store, "w").await;
    let early = Finished { tasks: vec![task(0, "again")], ..Finished::default() };
    assert!(matches!(store.finish(&held, &early).await, Err(JobStoreError::StageOrder { .. })));
    finish(store, &held).await;
    assert_eq!(state(store, &id).await, JobState::Successful);
    let empty = submit(store, &job("empty", Vec::new())).await;
    assert_eq!(state(store, &empty).await, JobState::Successful);
    assert!(matches!(Store::connect("mysql://root:secret@db/x").await, Err(JobStoreError::Address(a)) if a == "mysql"));
}
