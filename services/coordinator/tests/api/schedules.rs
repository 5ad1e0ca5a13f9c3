//! Schedules and webhooks; and the clock that ticks.

use crate::{Service, start};
use gable_job_store::{Missed, NewSchedule};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Status and body of an answer.
async fn ask(service: &Service, method: &str, path: &str, body: Value) -> (u16, Value) {
    let (path, json) = (format!("/api/v1{path}"), [("content-type", "application/json")]);
    let answer = service.ask(method, &path, &json, Some(body.to_string())).await;
    (answer.status, serde_json::from_slice(&answer.body).unwrap_or(Value::Null))
}

async fn refused(service: &Service, method: &str, path: &str, body: Value, status: u16, detail: &str) {
    let (found, told) = ask(service, method, path, body).await;
    let said = told["detail"].as_str().unwrap_or_default();
    assert!(found == status && said.contains(detail), "{found} {told}");
}

fn nightly() -> Value {
    json!({ "cron": "30 2 * * MON", "zone": "Europe/Amsterdam", "job": { "source": "mesh.obj", "city": "delft" } })
}

fn with(mut body: Value, member: &str, value: Value) -> Value {
    body[member] = value;
    body
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn schedules_are_made_shown_changed_run_and_removed() {
    let service = start().await;
    let (status, made) = ask(&service, "PUT", "/schedules/nightly", nightly()).await;
    assert_eq!(status, 201, "{made}");
    assert_eq!((&made["missed"], &made["enabled"], &made["runs"]), (&json!("skip"), &json!(true), &json!(0)));
    let next: Vec<&str> =
        made["next"].as_array().expect("a list").iter().map(|n| n.as_str().expect("a time")).collect();
    assert_eq!(next.len(), 5);
    assert!(next.iter().all(|n| n.ends_with("T00:30:00Z") || n.ends_with("T01:30:00Z")), "{next:?}");
    let changed = with(with(nightly(), "missed", json!("once")), "enabled", json!(false));
    let (status, made) = ask(&service, "PUT", "/schedules/nightly", changed).await;
    assert_eq!((status, &made["missed"], &made["next"]), (200, &json!("once"), &json!([])));
    let (_, listed) = ask(&service, "GET", "/schedules", Value::Null).await;
    assert_eq!((listed.as_array().map(Vec::len), &listed[0]["name"]), (Some(1), &json!("nightly")));
    assert_eq!(ask(&service, "GET", "/schedules/nightly", Value::Null).await, (200, made));

    let (status, run) = ask(&service, "POST", "/schedules/nightly/run", Value::Null).await;
    assert_eq!((status, &run["outcome"], &run["number"]), (201, &json!("submitted"), &json!(1)));
    let (_, job) = ask(&service, "GET", &format!("/jobs/{}", run["job"].as_str().expect("an id")), Value::Null).await;
    assert_eq!((&job["city"], &job["state"]), (&json!("delft"), &json!("accepted")));
    refused(&service, "POST", "/schedules/nightly/run", Value::Null, 409, "is not over").await;
    let (_, runs) = ask(&service, "GET", "/schedules/nightly/runs", Value::Null).await;
    assert_eq!((runs[0]["outcome"].as_str(), runs[1].clone()), (Some("overlap"), run));

    assert_eq!(ask(&service, "DELETE", "/schedules/nightly", Value::Null).await.0, 204);
    for (method, path) in
        [("GET", "/nightly"), ("DELETE", "/nightly"), ("POST", "/nightly/run"), ("GET", "/nightly/runs")]
    {
        refused(&service, method, &format!("/schedules{path}"), Value::Null, 404, "no schedule \"nightly\"").await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn schedules_that_do_not_hold_are_refused() {
    let service = start().await;
    for (body, detail) in [
        (with(nightly(), "cron", json!("61 * * * *")), "61 * * * *"),
        (with(nightly(), "cron", json!("0 0 30 2 *")), "never comes true"),
        (with(nightly(), "cron", json!("1 ".repeat(200))), "at most 200 bytes"),
        (with(nightly(), "zone", json!("Europe/Atlantis")), "no time zone"),
        (with(nightly(), "missed", json!("twice")), "twice"),
        (with(nightly(), "job", json!({ "source": "../mesh.obj", "city": "delft" })), "source root"),
        (with(nightly(), "job", json!({ "source": "mesh.obj", "city": "" })), "city"),
        (with(nightly(), "more", json!(1)), "more"),
    ] {
        refused(&service, "PUT", "/schedules/nightly", body, 422, detail).await;
    }
    refused(&service, "PUT", "/schedules/night%20ly", nightly(), 422, "letters, digits").await;
    refused(&service, "GET", "/schedules?limit=0", Value::Null, 400, "limit").await;
    assert_eq!(ask(&service, "GET", "/schedules", Value::Null).await, (200, json!([])));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn missed_ticks_are_handled_as_configured() {
    let service = start().await;
    let store = &service.parts.store;
    let now = store.clock().await.expect("a clock");
    let (request, hour) = (json!({ "source": "mesh.obj", "city": "delft" }).to_string(), 3_600_000);
    for (name, missed, late) in
        [("skip", Missed::Skip, 3 * hour), ("once", Missed::Once, 3 * hour), ("soon", Missed::Skip, 1000)]
    {
        let schedule = NewSchedule {
            name: name.to_owned(),
            owner: "ann".to_owned(),
            city: name.to_owned(),
            request: request.clone(),
            priority: 0,
            cron: "0 * * * *".to_owned(),
            zone: "UTC".to_owned(),
            missed,
            enabled: true,
            next: Some(now - late),
        };
        assert!(store.add_schedule(&schedule).await.expect("added"));
    }
    let (stop, stopped) = tokio::sync::watch::channel(false);
    let wait = async {
        let begin = Instant::now();
        while !store.due_schedules().await.expect("lists").is_empty() {
            assert!(begin.elapsed() < Duration::from_secs(20), "nobody ticks");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        tokio::time::sleep(Duration::from_millis(1200)).await;
        stop.send_replace(true);
    };
    let clock = || gable_coordinator::tick(&service.parts, stopped.clone());
    tokio::join!(wait, clock(), clock());
    for (name, outcome) in [("skip", "missed"), ("once", "submitted"), ("soon", "submitted")] {
        let runs = store.schedule_runs(name, None, 10).await.expect("lists");
        assert_eq!(runs.iter().map(|r| r.outcome.name()).collect::<Vec<_>>(), [outcome], "{name}");
        let next = store.schedule(name).await.expect("asks").expect("there").said.next.expect("a tick");
        assert!(next > now && next <= now + hour + 60_000 && next % hour == 0, "{name}: {next} after {now}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn webhooks_are_made_listed_and_removed() {
    let service = start().await;
    let wanted = json!({ "url": "https://example.com/hook", "events": ["job.failed", "job.failed"], "city": "delft" });
    let (status, made) = ask(&service, "POST", "/webhooks", wanted.clone()).await;
    assert_eq!(status, 201, "{made}");
    assert_eq!(made["events"], json!(["job.failed"]));
    assert!(made["secret"].as_str().expect("a secret").starts_with("whsec_"));
    let (_, listed) = ask(&service, "GET", "/webhooks", Value::Null).await;
    assert_eq!((&listed[0]["id"], &listed[0]["secret"]), (&made["id"], &Value::Null), "a secret is told once");
    let place = format!("/webhooks/{}", made["id"].as_str().expect("an id"));
    assert_eq!(ask(&service, "GET", &format!("{place}/messages"), Value::Null).await, (200, json!([])));
    for (member, value, detail) in [
        ("url", json!("http://169.254.169.254/latest"), "not a public address"),
        ("url", json!("http://[::1]:8080/"), "not a public address"),
        ("url", json!("ftp://example.com"), "no address"),
        ("events", json!(["job.eaten"]), "job.eaten"),
        ("secret", json!("password"), "whsec_"),
        ("more", json!(1), "more"),
    ] {
        refused(&service, "POST", "/webhooks", with(wanted.clone(), member, value), 422, detail).await;
    }
    assert_eq!(ask(&service, "DELETE", &place, Value::Null).await.0, 204);
    refused(&service, "DELETE", &place, Value::Null, 404, "no webhook").await;
    refused(&service, "GET", &format!("{place}/messages"), Value::Null, 404, "no webhook").await;
}
