//! Traces by OTLP: a collector that listens, and collectors that do not.

use gable_tests::{Database, Process, Service, signal, skip, town};
use opentelemetry_proto::tonic::collector::trace::v1::ExportTraceServiceRequest;
use opentelemetry_proto::tonic::common::v1::any_value::Value as Any;
use opentelemetry_proto::tonic::trace::v1::Span;
use opentelemetry_proto::tonic::trace::v1::status::StatusCode;
use prost::Message as _;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(180);
const ENDPOINT: &str = "OTEL_EXPORTER_OTLP_ENDPOINT";

fn mesh() -> PathBuf {
    town(2, 0.01).join("mesh")
}

/// What came in one request.
struct Received {
    head: String,
    body: ExportTraceServiceRequest,
}

/// A collector that takes traces, and keeps them.
struct Collector {
    address: String,
    received: Arc<Mutex<Vec<Received>>>,
}

impl Collector {
    fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("http://{}", listener.local_addr().unwrap());
        let received = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&received);
        std::thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let kept = Arc::clone(&kept);
                std::thread::spawn(move || {
                    let mut stream = BufReader::new(stream);
                    while let Some(request) = receive(&mut stream) {
                        kept.lock().unwrap().push(request);
                        let answer =
                            b"HTTP/1.1 200 OK\r\ncontent-type: application/x-protobuf\r\ncontent-length: 0\r\n\r\n";
                        stream.get_mut().write_all(answer).unwrap();
                    }
                });
            }
        });
        Self { address, received }
    }

    /// All spans, with the name of the service that sent them.
    fn spans(&self) -> Vec<(String, Span)> {
        let received = self.received.lock().unwrap();
        let groups = received.iter().flat_map(|r| &r.body.resource_spans);
        groups
            .flat_map(|group| {
                let resource = group.resource.as_ref().unwrap();
                let name = resource.attributes.iter().find(|a| a.key == "service.name").unwrap();
                let Some(Any::StringValue(name)) = name.value.clone().unwrap().value else { panic!("{name:?}") };
                group.scope_spans.iter().flat_map(|s| &s.spans).map(move |span| (name.clone(), span.clone()))
            })
            .collect()
    }
}

fn receive(stream: &mut BufReader<TcpStream>) -> Option<Received> {
    let mut head = String::new();
    while !head.ends_with("\r\n\r\n") {
        if stream.read_line(&mut head).ok()? == 0 {
            return None;
        }
    }
    let lower = head.to_lowercase();
    let length = lower.lines().find_map(|l| l.strip_prefix("content-length: ")).expect("a length");
    let mut body = vec![0; length.parse().unwrap()];
    stream.read_exact(&mut body).ok()?;
    Some(Received { head, body: ExportTraceServiceRequest::decode(&body[..]).expect("spans") })
}

fn attribute(span: &Span, key: &str) -> Option<String> {
    let found = span.attributes.iter().find(|a| a.key == key)?;
    Some(match found.value.as_ref()?.value.as_ref()? {
        Any::StringValue(text) => text.clone(),
        Any::IntValue(number) => number.to_string(),
        other => panic!("{key}: {other:?}"),
    })
}

fn wait_for(process: &Process, text: &str) {
    let begin = Instant::now();
    while !process.log().contains(text) {
        assert!(begin.elapsed() < Duration::from_secs(20), "no {text:?}: {}", process.log());
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Whether the program under test can send traces at all: a wrong address is told either way.
fn can_trace(test: &str) -> bool {
    let mut service = Service::new(test, Database::Sqlite, &mesh(), 2.0).unwrap();
    service.set(ENDPOINT, "http://me:password@[");
    let process = service.serve(&[]);
    wait_for(&process, "no traces are sent: ");
    let log = process.log();
    assert!(log.matches("no traces are sent: ").count() == 1 && !log.contains("password"), "{log}");
    end(process);
    let lacks = log.contains("built without the feature otlp");
    if lacks {
        skip(test, "the program is built without the feature otlp");
    }
    !lacks
}

fn end(mut process: Process) {
    signal(process.id(), "TERM");
    assert_eq!(process.wait(Duration::from_secs(20)), Some(0), "{}", process.log());
}

#[test]
fn the_tasks_of_a_job_are_one_trace() {
    if !can_trace("the_tasks_of_a_job_are_one_trace") {
        return;
    }
    let mut service = Service::new("one_trace", Database::Sqlite, &mesh(), 2.0).unwrap();
    let collector = Collector::new();
    service.set(ENDPOINT, &collector.address);
    service.set("OTEL_EXPORTER_OTLP_HEADERS", "x-key=secret");
    service.set("OTEL_SERVICE_NAME", "gable-of-delft");
    // Block 1_1 dies whenever it is sampled.
    let folder = tempfile::tempdir().unwrap();
    let wrapper = folder.path().join("poison.sh");
    let script = r#"#!/bin/bash
IFS= read -r order
case $order in *'"stage":1,"unit":"1_1","input"'*) echo "a pylon fell on it" >&2; exit 1 ;; esac
exec "$@" < <(printf '%s\n' "$order"; exec cat)
"#;
    std::fs::write(&wrapper, script).unwrap();
    std::fs::set_permissions(&wrapper, std::fs::Permissions::from_mode(0o755)).unwrap();
    let coordinator = service.serve(&[]);
    let workers = [(); 2].map(|()| service.work(&["--task-wrapper", wrapper.to_str().unwrap()]));
    let wanted = json!({ "sampling.step": 0.5, "grid.columns": 3, "grid.rows": 2, "output.report": false });
    let job = service.submit(&mesh(), "delft", &wanted);
    service.expect(&job, "partial", LIMIT);
    let _ = service.get(&format!("/jobs?city={}", "nowhere"));
    let claims = service.events(&job).into_iter().filter(|e| e["kind"] == "claimed");
    let text = |v: &serde_json::Value| v.as_str().unwrap().to_owned();
    let mut expected: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    for claim in claims {
        expected.entry((text(&claim["stage"]), text(&claim["unit"]))).or_default().push(text(&claim["message"]));
    }
    for process in workers.into_iter().chain([coordinator]) {
        end(process);
    }

    for received in collector.received.lock().unwrap().iter() {
        assert!(received.head.starts_with("POST /v1/traces HTTP/1.1\r\n"), "{}", received.head);
        assert!(received.head.contains("x-key: secret"), "{}", received.head);
    }
    let spans = collector.spans();
    assert!(spans.iter().all(|(service, _)| service == "gable-of-delft"));
    let (requests, tasks): (Vec<_>, Vec<_>) =
        spans.into_iter().map(|(_, s)| s).partition(|s| attribute(s, "http.request.method").is_some());
    let trace = job.replace('-', "");
    let mut found: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    let mut in_order = tasks.clone();
    in_order.sort_by_key(|s| s.start_time_unix_nano);
    for span in &in_order {
        let of = |key: &str| attribute(span, key).unwrap_or_else(|| panic!("no {key}: {span:?}"));
        let id: String = span.trace_id.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!((&id, &of("gable.job")), (&trace, &job));
        assert_eq!(span.name, of("gable.stage"));
        assert!(span.start_time_unix_nano < span.end_time_unix_nano);
        let seen = found.entry((of("gable.stage"), of("gable.unit"))).or_default();
        seen.push(of("gable.worker"));
        assert_eq!(of("gable.attempt"), seen.len().to_string());
        let status = span.status.clone().unwrap_or_default();
        if (span.name.as_str(), of("gable.unit").as_str()) == ("sample", "1_1") {
            assert_eq!((of("gable.outcome").as_str(), status.code()), ("failed", StatusCode::Error));
            assert_eq!(status.message, "a pylon fell on it");
        } else {
            assert_eq!((of("gable.outcome").as_str(), status.code()), ("done", StatusCode::Unset));
        }
    }
    assert_eq!(found, expected);
    let workers: BTreeSet<_> = found.values().flatten().collect();
    assert_eq!(workers.len(), 2, "both took part");

    // Requests are traces of their own, and tell no more of an address than its path.
    let traces: BTreeSet<_> = requests.iter().map(|s| s.trace_id.clone()).collect();
    assert_eq!(traces.len(), requests.len());
    let path = |s: &Span| attribute(s, "url.path").expect("a path");
    let submission = requests.iter().find(|s| s.name == "POST" && path(s) == "/api/v1/jobs").expect("the submission");
    assert_eq!(attribute(submission, "http.response.status_code").as_deref(), Some("201"));
    assert!(requests.iter().any(|s| path(s) == "/api/v1/jobs" && s.name == "GET"));
    assert!(!format!("{requests:?}").contains("nowhere") && !format!("{tasks:?}").contains("secret"));
}

#[test]
fn a_collector_that_is_away_hurts_no_job() {
    if !can_trace("a_collector_that_is_away_hurts_no_job") {
        return;
    }
    // One that refuses, and one that takes connections and says nothing.
    let refusing = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    for address in [refusing, silent.local_addr().unwrap()] {
        let mut service = Service::new("no_collector", Database::Sqlite, &mesh(), 2.0).unwrap();
        service.set(ENDPOINT, &format!("http://{address}"));
        // A batch every 0.1 s, so that many are lost.
        service.set("OTEL_BSP_SCHEDULE_DELAY", "100");
        let process = service.serve(&["--all", "--slots", "2"]);
        let wanted = json!({ "sampling.step": 0.5, "grid.columns": 2, "grid.rows": 2, "output.report": false });
        let job = service.submit(&mesh(), "delft", &wanted);
        service.expect(&job, "successful", LIMIT);
        if address == refusing {
            wait_for(&process, "spans are lost");
        }
        let log = process.log();
        assert!(log.matches("spans are lost").count() <= 1, "{log}");
        end(process);
    }
}
