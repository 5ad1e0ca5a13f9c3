//! OGC API – Processes.

use crate::webhooks::{Got, receiver};
use crate::{Answer, Service, start, start_with};
use gable_coordinator::Limits;
use gable_job_store::{Artifact, Finished, Retry};
use serde_json::{Value, json};
use std::time::Duration;

async fn execute(service: &Service, process: &str, body: &Value) -> Answer {
    let path = format!("/ogc/processes/{process}/execution");
    service.ask("POST", &path, &[("content-type", "application/json")], Some(body.to_string())).await
}

/// The links of a document, by relation.
fn link<'a>(document: &'a Value, relation: &str) -> &'a str {
    let mut links = document["links"].as_array().expect("links").iter();
    let found = links.find(|l| l["rel"].as_str().is_some_and(|r| r.ends_with(relation)));
    found.and_then(|l| l["href"].as_str()).unwrap_or_else(|| panic!("no {relation}: {document}"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_finds_its_way_from_the_landing_page() {
    let service = start().await;
    let landing = service.get("/ogc").await.json();
    for relation in ["service-desc", "conformance", "processes", "job-list"] {
        let href = link(&landing, relation);
        let path = href.strip_prefix(&service.address).unwrap_or_else(|| panic!("{href} is not absolute"));
        assert_eq!(service.get(path).await.status, 200, "{relation}");
    }
    let classes = service.get("/ogc/conformance").await.json();
    let classes = classes["conformsTo"].as_array().expect("a list").clone();
    for class in ["core", "job-list", "dismiss", "callback"] {
        assert!(classes.iter().any(|c| c.as_str().is_some_and(|c| c.ends_with(&format!("/conf/{class}")))), "{class}");
    }
    let api = service.get("/ogc/api").await;
    assert_eq!(api.header("content-type"), "application/vnd.oai.openapi+json;version=3.0");
    assert!(api.json()["openapi"].as_str().is_some_and(|v| v.starts_with("3.0")));
    let processes = service.get("/ogc/processes").await.json();
    let ids: Vec<&str> =
        processes["processes"].as_array().expect("a list").iter().filter_map(|p| p["id"].as_str()).collect();
    assert_eq!(ids, ["city-model", "echo"]);
    assert_eq!(service.get("/ogc/processes?limit=1").await.json()["processes"].as_array().map(Vec::len), Some(1));
    let missing = "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-process";
    service.get("/ogc/processes/none").await.problem(404, missing);
    execute(&service, "none", &json!({})).await.problem(404, missing);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn echo_gives_its_inputs_back() {
    let service = start().await;
    let both = execute(
        &service,
        "echo",
        &json!({ "inputs": { "text": "a", "object": { "value": { "b": [1] } } }, "response": "document" }),
    )
    .await;
    assert_eq!((both.status, both.json()), (200, json!({ "text": "a", "object": { "b": [1] } })));
    let raw =
        execute(&service, "echo", &json!({ "inputs": { "text": "a", "number": 2 }, "outputs": { "text": {} } })).await;
    assert_eq!((&*raw.body, raw.header("content-type")), (&b"a"[..], "text/plain; charset=utf-8"));
    assert_eq!(execute(&service, "echo", &json!({ "inputs": { "text": 7 } })).await.status, 400);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_city_is_made_by_a_job() {
    let service = start().await;
    let not_ready = "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/result-not-ready";
    let made = execute(&service, "city-model", &json!({ "inputs": { "source": "mesh.obj", "city": "delft", "parameters": { "value": { "sampling.step": 0.3 } } } })).await;
    assert_eq!(made.status, 201, "{}", made.json());
    let id = made.json()["jobID"].as_str().expect("an id").to_owned();
    assert_eq!(made.header("location"), format!("{}/ogc/jobs/{id}", service.address));
    let place = format!("/ogc/jobs/{id}");
    let shown = service.get(&place).await.json();
    assert_eq!(
        (&shown["status"], &shown["type"], &shown["processID"]),
        (&json!("accepted"), &json!("process"), &json!("city-model"))
    );
    service.get(&format!("{place}/results")).await.problem(404, not_ready);
    let request = service.get(&format!("/api/v1/jobs/{id}")).await.json();
    assert_eq!(request["request"]["parameters"]["sampling.step"], 0.3, "it is the same job");

    let blob = service.parts.blobs.put(b"{}".to_vec()).await.expect("put");
    let artifacts = vec![Artifact { path: "result/index.json".to_owned(), blob, bytes: 2 }];
    service.finish_next(Finished { artifacts, ..Finished::default() }).await;
    let shown = service.get(&place).await.json();
    assert_eq!((&shown["status"], &shown["progress"]), (&json!("successful"), &json!(100)));
    let results = link(&shown, "results").strip_prefix(&service.address).expect("absolute").to_owned();
    let results = service.get(&results).await.json();
    assert_eq!(results.as_object().expect("outputs").keys().collect::<Vec<_>>(), ["index"]);
    let href =
        results["index"]["href"].as_str().and_then(|h| h.strip_prefix(&service.address)).expect("absolute").to_owned();
    assert_eq!(service.get(&href).await.body, b"{}");
    let over = service.ask("DELETE", &place, &[], None).await;
    over.problem(409, "state");

    for wrong in [json!({ "source": "mesh.obj" }), json!({ "source": "mesh.obj", "city": "a", "colour": 1 })] {
        assert_eq!(execute(&service, "city-model", &json!({ "inputs": wrong })).await.status, 400);
    }
    let outside = execute(&service, "city-model", &json!({ "inputs": { "source": "/etc/passwd", "city": "a" } })).await;
    outside.problem(422, "source");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn jobs_are_listed_and_dismissed() {
    let service = start().await;
    let [done, failed, waiting] = [service.new_job().await, service.new_job().await, service.new_job().await];
    service.finish_next(Finished::default()).await;
    let held = service.claim().await;
    service.parts.store.fail(&held, "no faces", Retry::Never).await.expect("fails");
    let found = async |query: &str| {
        let list = service.get(&format!("/ogc/jobs?{query}")).await.json();
        let jobs = list["jobs"].as_array().unwrap_or_else(|| panic!("{list}")).clone();
        jobs.iter().map(|j| j["jobID"].as_str().expect("an id").to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(found("").await, [&*waiting, &failed, &done]);
    assert_eq!(found("status=successful,failed").await, [&*failed, &done]);
    assert_eq!(found("datetime=2020-01-01T00:00:00Z/..").await.len(), 3);
    assert_eq!(found("datetime=../2020-01-01T00:00:00Z").await.len(), 0);
    assert_eq!(found("minDuration=1000").await.len(), 0);
    assert_eq!(found("maxDuration=1000").await, [&*failed, &done], "those that have begun");
    assert_eq!(found("processID=echo").await.len(), 0);
    assert_eq!(found("type=process&processID=city-model").await.len(), 3);
    let page = service.get("/ogc/jobs?limit=2").await.json();
    let next = link(&page, "next").strip_prefix(&service.address).expect("absolute").to_owned();
    assert_eq!(service.get(&next).await.json()["jobs"][0]["jobID"], json!(done));
    for wrong in ["status=paused", "datetime=yesterday", "limit=0", "limit=51", "minDuration=x"] {
        assert_eq!(service.get(&format!("/ogc/jobs?{wrong}")).await.status, 400, "{wrong}");
    }
    let kind = "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/job-failed";
    assert_eq!(service.get(&format!("/ogc/jobs/{failed}/results")).await.problem(500, kind), "no faces");

    let place = format!("/ogc/jobs/{waiting}");
    assert_eq!(service.ask("DELETE", &place, &[], None).await.json()["status"], "dismissed");
    service.ask("DELETE", &place, &[], None).await.problem(410, "dismissed");
    let missing = "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-job";
    service.get("/ogc/jobs/none").await.problem(404, missing);
}

/// The next message, which has to go to this receiver and be JSON.
async fn next(got: &mut std::sync::mpsc::Receiver<Got>, to: &str) -> Value {
    let begin = std::time::Instant::now();
    let message = loop {
        if let Ok(message) = got.try_recv() {
            break message;
        }
        assert!(begin.elapsed() < Duration::from_secs(20), "{to} is told nothing");
        tokio::time::sleep(Duration::from_millis(20)).await;
    };
    assert!(message.line.contains(&format!("&to={to} ")), "{}: {}", message.line, message.body);
    assert_eq!(message.headers["content-type"], "application/json");
    assert!(!message.headers.contains_key("webhook-signature"), "there is no secret to sign with");
    serde_json::from_str(&message.body).expect("JSON")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn subscribers_are_told_how_their_job_goes() {
    let service = start_with(Limits { private_webhooks: true, ..Limits::default() }).await;
    let (url, mut got) = receiver(&[]);
    let subscriber = json!({ "successUri": format!("{url}&to=done"), "inProgressUri": format!("{url}&to=going"),
        "failedUri": format!("{url}&to=failed") });
    let inputs = json!({ "source": "mesh.obj", "city": "delft" });
    let order = json!({ "inputs": inputs, "subscriber": subscriber });
    let (stop, stopped) = tokio::sync::watch::channel(false);
    let story = async {
        let made = execute(&service, "city-model", &order).await;
        assert_eq!(made.status, 201, "{}", made.json());
        let held = service.claim().await;
        let going = next(&mut got, "going").await;
        assert_eq!((&going["jobID"], &going["status"]), (&made.json()["jobID"], &json!("running")));
        let place = format!("{}/ogc/jobs/{}", service.address, held.job);
        assert_eq!(link(&going, "self"), place, "links lead to the service as the client saw it");
        let blob = service.parts.blobs.put(b"{}".to_vec()).await.expect("put");
        let artifacts = vec![Artifact { path: "result/index.json".to_owned(), blob, bytes: 2 }];
        let done = Finished { artifacts, ..Finished::default() };
        service.parts.store.finish(&held, &done).await.expect("finishes");
        let done = next(&mut got, "done").await;
        assert_eq!(done, service.get(&format!("/ogc/jobs/{}/results", held.job)).await.json());
        assert!(done["index"]["href"].as_str().is_some_and(|h| h.starts_with(&service.address)), "{done}");

        let made = execute(&service, "city-model", &order).await.json();
        let id = made["jobID"].as_str().expect("an id");
        service.parts.store.cancel(id).await.expect("cancelled");
        let failed = next(&mut got, "failed").await;
        assert_eq!((&failed["jobID"], &failed["status"]), (&json!(id), &json!("dismissed")));

        // Without a subscriber, nobody is told anything; nor of what is told already.
        execute(&service, "city-model", &json!({ "inputs": inputs })).await;
        let _ = service.claim().await;
        tokio::time::sleep(Duration::from_millis(1200)).await;
        assert_eq!(got.try_iter().count(), 0);
        stop.send_replace(true);
    };
    let delivering = gable_coordinator::deliver(&service.parts.store, true, stopped);
    let ((), delivered) = tokio::join!(story, delivering);
    delivered.expect("requests can be made");
    assert_eq!(service.get("/api/v1/webhooks").await.json(), json!([]), "subscribers are no webhooks");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn subscribers_at_addresses_that_are_not_public_are_refused() {
    let service = start().await;
    let inputs = json!({ "source": "mesh.obj", "city": "delft" });
    for (member, address, reason) in [
        ("successUri", "http://127.0.0.1:9/hook", "not a public address"),
        ("failedUri", "http://169.254.169.254/latest/meta-data", "not a public address"),
        ("inProgressUri", "file:///etc/passwd", "is no address"),
    ] {
        let order = json!({ "inputs": inputs, "subscriber": { member: address } });
        let kind = "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/invalid-parameter-value";
        let detail = execute(&service, "city-model", &order).await.problem(400, kind);
        assert!(detail.contains(member) && detail.contains(reason), "{detail}");
    }
    assert_eq!(service.get("/api/v1/jobs").await.json()["jobs"], json!([]), "nothing was taken in");
}
