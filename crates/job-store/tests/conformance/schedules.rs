//! Ticks of schedules, and messages to webhooks: each has one winner.

use crate::suite::{claim, finish, job, state, submit, task};
use gable_job_store::{
    JobFilter, JobState, MessageState, Missed, NewCallback, NewJob, NewSchedule, RunOutcome, Sent, Store, Tick,
    Webhook, WebhookEvent,
};
use std::time::Duration;

fn nightly(next: i64) -> NewSchedule {
    NewSchedule {
        name: "nightly".to_owned(),
        owner: "ann".to_owned(),
        city: "delft".to_owned(),
        request: "{}".to_owned(),
        priority: 3,
        cron: "0 2 * * *".to_owned(),
        zone: "Europe/Amsterdam".to_owned(),
        missed: Missed::Once,
        enabled: true,
        next: Some(next),
    }
}

async fn jobs(store: &Store) -> usize {
    store.jobs(&JobFilter::default(), 100).await.expect("lists").len()
}

pub(crate) async fn a_tick_has_one_winner(store: &Store) {
    let now = store.clock().await.expect("a clock");
    assert!(store.add_schedule(&nightly(now - 1)).await.expect("added"));
    assert!(!store.add_schedule(&nightly(now)).await.expect("asks"), "the name is taken");
    let due = store.due_schedules().await.expect("lists");
    assert_eq!((due.len(), &due[0].said), (1, &nightly(now - 1)));
    let ticks: Vec<_> = (0..8)
        .map(|_| {
            let (store, schedule) = (store.clone(), due[0].clone());
            tokio::spawn(
                async move { store.tick(&schedule, Tick::Run, &task(0, "scene"), Some(now + 3_600_000)).await },
            )
        })
        .collect();
    let mut won = Vec::new();
    for tick in ticks {
        won.extend(tick.await.expect("ends").expect("the database answers"));
    }
    assert_eq!((won.len(), won[0].outcome, won[0].number, won[0].due), (1, RunOutcome::Submitted, 1, now - 1));
    let found = store.jobs(&JobFilter::default(), 100).await.expect("lists");
    assert_eq!((found.len(), &found[0].owner, found[0].priority), (1, &"ann".to_owned(), 3));
    assert_eq!(won[0].job.as_ref(), Some(&found[0].id));
    assert!(store.due_schedules().await.expect("lists").is_empty());
    let kept = store.schedule("nightly").await.expect("asks").expect("there");
    assert_eq!((kept.runs, kept.job.as_ref(), kept.said.next), (1, Some(&found[0].id), Some(now + 3_600_000)));
}

pub(crate) async fn runs_do_not_overlap(store: &Store) {
    let now = store.clock().await.expect("a clock");
    let _ = store.add_schedule(&nightly(now - 2)).await.expect("added");
    for (number, expected) in [(1, RunOutcome::Submitted), (2, RunOutcome::Overlap)] {
        let due = store.due_schedules().await.expect("lists").remove(0);
        let run = store.tick(&due, Tick::Run, &task(0, "scene"), Some(now - 1)).await.expect("answers").expect("won");
        assert_eq!((run.number, run.outcome, run.job.is_some()), (number, expected, number == 1));
    }
    let by_hand = store.run_schedule("nightly", &task(0, "scene")).await.expect("answers").expect("there");
    assert_eq!(by_hand.outcome, RunOutcome::Overlap);
    finish(store, &claim(store, "w").await).await;
    let by_hand = store.run_schedule("nightly", &task(0, "scene")).await.expect("answers").expect("there");
    assert_eq!((by_hand.number, by_hand.outcome), (4, RunOutcome::Submitted));
    assert_eq!(jobs(store).await, 2);
    let history = store.schedule_runs("nightly", None, 100).await.expect("lists");
    assert_eq!(history.iter().map(|r| r.number).collect::<Vec<_>>(), [4, 3, 2, 1]);
    assert_eq!(history[0], by_hand);
    assert_eq!(store.schedule_runs("nightly", Some(3), 1).await.expect("lists")[0].number, 2);
}

pub(crate) async fn missed_and_changed_ticks_submit_nothing(store: &Store) {
    let now = store.clock().await.expect("a clock");
    let _ = store.add_schedule(&nightly(now - 5)).await.expect("added");
    let due = store.due_schedules().await.expect("lists").remove(0);
    let run = store.tick(&due, Tick::Miss, &task(0, "scene"), Some(now - 4)).await.expect("answers").expect("won");
    assert_eq!((run.outcome, run.job), (RunOutcome::Missed, None));
    let due = store.due_schedules().await.expect("lists").remove(0);
    assert!(store.change_schedule(&NewSchedule { enabled: false, ..nightly(now - 4) }).await.expect("changed"));
    assert_eq!(store.tick(&due, Tick::Run, &task(0, "scene"), None).await.expect("answers"), None);
    assert!(store.due_schedules().await.expect("lists").is_empty());
    assert!(
        store.change_schedule(&NewSchedule { request: "[]".to_owned(), ..nightly(now - 4) }).await.expect("changed")
    );
    assert_eq!(store.tick(&due, Tick::Run, &task(0, "scene"), None).await.expect("answers"), None);
    assert_eq!(jobs(store).await, 0);
    let listed = store.schedules(None, None, 10).await.expect("lists");
    assert_eq!((listed.len(), listed[0].runs), (1, 1));
    assert!(store.schedules(None, Some("nightly"), 10).await.expect("lists").is_empty());
    assert!(store.remove_schedule("nightly").await.expect("removed"));
    assert!(!store.remove_schedule("nightly").await.expect("asks"));
    assert!(!store.change_schedule(&nightly(now)).await.expect("asks"));
    assert!(store.schedule_runs("nightly", None, 10).await.expect("lists").is_empty());
    assert_eq!(store.run_schedule("nightly", &task(0, "scene")).await.expect("answers"), None);
}

fn hook(id: &str, events: &[WebhookEvent], city: Option<&str>) -> Webhook {
    Webhook {
        id: id.to_owned(),
        owner: "ann".to_owned(),
        url: "https://example.com/hook".to_owned(),
        secret: "whsec_c2VjcmV0".to_owned(),
        events: events.to_vec(),
        city: city.map(str::to_owned),
        enabled: true,
        created: 0,
        callback: None,
    }
}

pub(crate) async fn messages_are_for_whom_they_concern(store: &Store) {
    let hooks = [
        hook("all", &[], None),
        hook("ends", &[WebhookEvent::JobFailed, WebhookEvent::JobPartial], None),
        hook("leiden", &[], Some("leiden")),
    ];
    for hook in &hooks {
        store.add_webhook(hook).await.expect("added");
    }
    let listed = store.webhooks().await.expect("lists");
    assert_eq!(
        listed.iter().map(|h| (&*h.id, h.events.len())).collect::<Vec<_>>(),
        [("all", 0), ("ends", 2), ("leiden", 0)]
    );
    assert!(!format!("{listed:?}").contains("whsec"), "a secret gets into no log");

    let cancelled = submit(store, &job("delft", vec![task(0, "city")])).await;
    store.cancel(&cancelled).await.expect("cancelled");
    let partial = submit(store, &job("delft", vec![task(0, "city")])).await;
    let held = claim(store, "w").await;
    store.fail(&held, "no memory", gable_job_store::Retry::Never).await.expect("failed");
    assert_eq!(state(store, &partial).await, JobState::Partial);
    let told = |hook: &'static str| async move {
        let all = store.webhook_messages(hook, 10).await.expect("lists");
        all.into_iter().rev().map(|m| (m.event, m.state)).collect::<Vec<_>>()
    };
    let waiting = |event| (event, MessageState::Waiting);
    assert_eq!(told("all").await, [waiting(WebhookEvent::JobCancelled), waiting(WebhookEvent::JobPartial)]);
    assert_eq!(told("ends").await, [waiting(WebhookEvent::JobPartial)]);
    assert_eq!(told("leiden").await, []);
    let data = &store.webhook_messages("ends", 1).await.expect("lists")[0].data;
    let data: serde_json::Value = serde_json::from_str(data).expect("JSON");
    assert_eq!((&data["job"], &data["city"], &data["state"]), (&partial.into(), &"delft".into(), &"partial".into()));
}

pub(crate) async fn callbacks_are_told_of_their_job_only(store: &Store) {
    store.add_webhook(&hook("all", &[], None)).await.expect("added");
    store.add_webhook(&hook("progress", &[WebhookEvent::JobProgressed], None)).await.expect("added");
    let callback = |url: &str, events: &[WebhookEvent]| NewCallback {
        url: url.to_owned(),
        events: events.to_vec(),
        base: "https://gable.example".to_owned(),
    };
    let (success, progress) = (WebhookEvent::JobSucceeded, WebhookEvent::JobProgressed);
    let callbacks = vec![callback("https://a/done", &[success]), callback("https://a/going", &[progress])];
    let tasks = vec![task(0, "city"), task(1, "city")];
    let id = submit(store, &NewJob { callbacks, ..job("delft", tasks.clone()) }).await;
    let other = submit(store, &job("delft", tasks)).await;
    assert_eq!(store.webhooks().await.expect("lists").len(), 2, "callbacks are no webhooks");

    // Takes all messages; gives where they go, and what of.
    let taken = async || {
        let mut taken = Vec::new();
        while let Some((to, message)) = store.take_message(Duration::from_secs(60)).await.expect("answers") {
            if let Some(callback) = &to.callback {
                assert_eq!((&*callback.base, &*to.secret), ("https://gable.example", ""));
                assert_eq!(callback.job, id);
            }
            taken.push((to.callback.map_or(to.id, |_| to.url), message.event));
        }
        taken.sort();
        taken
    };
    let told = |list: &[(&str, WebhookEvent)]| list.iter().map(|(to, e)| ((*to).to_owned(), *e)).collect::<Vec<_>>();
    let first = claim(store, "w").await;
    assert_eq!(first.job, id);
    assert_eq!(taken().await, told(&[("https://a/going", progress), ("progress", progress)]));
    finish(store, &first).await;
    let second = claim(store, "w").await;
    assert_eq!(second.stage, 1);
    // How far it is has not been told yet when it is over: that is told instead. Webhooks hear all, in order.
    finish(store, &second).await;
    assert_eq!(taken().await, told(&[("all", success), ("https://a/done", success), ("progress", progress)]));

    let (first, cancelled) = (claim(store, "w").await, WebhookEvent::JobCancelled);
    assert_eq!(first.job, other);
    store.cancel(&other).await.expect("cancelled");
    assert_eq!(taken().await, told(&[("all", cancelled), ("progress", progress)]));
}

pub(crate) async fn a_message_is_sent_until_it_is_delivered(store: &Store) {
    store.add_webhook(&hook("h", &[], None)).await.expect("added");
    let id = submit(store, &job("delft", vec![task(0, "city")])).await;
    store.cancel(&id).await.expect("cancelled");
    let takers: Vec<_> = (0..8)
        .map(|_| {
            let store = store.clone();
            tokio::spawn(async move { store.take_message(Duration::from_millis(300)).await.expect("answers") })
        })
        .collect();
    let mut taken = Vec::new();
    for taker in takers {
        taken.extend(taker.await.expect("ends"));
    }
    assert_eq!(taken.len(), 1, "one takes it");
    let (receiver, first) = taken.remove(0);
    assert_eq!((&*receiver.id, first.attempts), ("h", 1));
    // Its sender was killed: it comes up again, and what the first says later is not heard.
    tokio::time::sleep(Duration::from_millis(400)).await;
    let (_, second) = store.take_message(Duration::from_secs(60)).await.expect("answers").expect("again");
    assert_eq!((&second.id, second.attempts), (&first.id, 2));
    store.message_sent(&receiver, &first, &Sent::GivenUp("late".to_owned())).await.expect("noted");
    let pause = Duration::from_millis(200);
    store.message_sent(&receiver, &second, &Sent::Again("500".to_owned(), pause)).await.expect("noted");
    assert!(store.take_message(pause).await.expect("answers").is_none(), "not before its pause is over");
    tokio::time::sleep(Duration::from_millis(300)).await;
    let (_, third) = store.take_message(Duration::from_secs(60)).await.expect("answers").expect("again");
    assert_eq!((third.attempts, third.answer.as_deref()), (3, Some("500")));
    store.message_sent(&receiver, &third, &Sent::Delivered("200".to_owned())).await.expect("noted");
    let kept = store.webhook_messages("h", 10).await.expect("lists").remove(0);
    assert_eq!(
        (kept.state, kept.answer.as_deref(), kept.finished.is_some()),
        (MessageState::Delivered, Some("200"), true)
    );
    assert_eq!(store.forget_messages(Duration::from_secs(60)).await.expect("forgets"), 0);

    // A receiver that is gone for good is told nothing more.
    for _ in 0..2 {
        let id = submit(store, &job("delft", vec![task(0, "city")])).await;
        store.cancel(&id).await.expect("cancelled");
    }
    let (_, message) = store.take_message(Duration::from_secs(60)).await.expect("answers").expect("there");
    store.message_sent(&receiver, &message, &Sent::Gone("410".to_owned())).await.expect("noted");
    assert!(!store.webhook("h").await.expect("asks").expect("there").enabled);
    assert!(store.take_message(Duration::from_secs(60)).await.expect("answers").is_none());
    tokio::time::sleep(Duration::from_millis(20)).await;
    assert_eq!(store.forget_messages(Duration::from_millis(5)).await.expect("forgets"), 2);
    assert!(store.remove_webhook("h").await.expect("removed"));
    assert!(!store.remove_webhook("h").await.expect("asks"));
}
