//! What is refused: slow clients, giant bodies, paths that climb, quotas that are used up.

use crate::{Service, start};
use gable_coordinator::{Coordinator, NewToken, Patience, Places, create_token, router, serve};
use gable_job_store::Scope;
use serde_json::json;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

/// What comes back on a connection until it is closed.
async fn raw(address: &str, sent: &[u8]) -> String {
    let mut stream = TcpStream::connect(address.trim_start_matches("http://")).await.expect("a connection");
    stream.write_all(sent).await.expect("sent");
    let mut answer = Vec::new();
    let read = tokio::time::timeout(Duration::from_secs(20), stream.read_to_end(&mut answer)).await;
    let _ = read.expect("it is not held for ever");
    String::from_utf8_lossy(&answer).into_owned()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_clients_are_cut_off() {
    let service = start().await;
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let patience =
        Patience { head: Duration::from_millis(300), drain: Duration::from_millis(300), ..Patience::default() };
    let mut parts = service.parts.clone();
    parts.limits.time = Duration::from_millis(500);
    let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
    let serving = tokio::spawn(serve(listener, router(parts), patience, Places::default(), async {
        let _ = stopped.await;
    }));
    let begin = Instant::now();
    raw(&address, b"GET /healthz HTTP/1.1\r\nHost: local").await;
    assert!(begin.elapsed() < Duration::from_secs(10), "a head that never ends: {:?}", begin.elapsed());
    let body = raw(&address, b"POST /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{").await;
    assert!(body.starts_with("HTTP/1.1 408"), "a body that never ends: {body}");
    assert!(body.contains("application/problem+json"), "{body}");
    let well = raw(&address, b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").await;
    assert!(well.starts_with("HTTP/1.1 200"), "others are answered: {well}");

    // A client that holds its connection does not keep the service from stopping.
    let _held = TcpStream::connect(&address).await.expect("a connection");
    let _ = stop.send(());
    tokio::time::timeout(Duration::from_secs(10), serving).await.expect("it stops").expect("it does not panic");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn giant_bodies_are_refused_unread() {
    let service = start().await;
    let head = b"POST /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 99999999999\r\nConnection: close\r\n\r\n";
    let told = raw(&service.address, head).await;
    assert!(told.starts_with("HTTP/1.1 413"), "{told}");
    assert!(told.contains("application/problem+json"), "{told}");
    // Without a length it is cut off where the limit is.
    let mut chunked = b"POST /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\nConnection: close\r\n\r\n".to_vec();
    chunked.extend(b"4e20\r\n");
    chunked.extend(vec![b' '; 20_000]);
    chunked.extend(b"\r\n0\r\n\r\n");
    let told = raw(&service.address, &chunked).await;
    assert!(told.starts_with("HTTP/1.1 413"), "{told}");
    // Nesting that would exhaust the stack.
    let deep = format!("{{\"parameters\":{{\"a\":{}", "[".repeat(9_000));
    let told = service.ask("POST", "/api/v1/jobs", &[("content-type", "application/json")], Some(deep)).await;
    told.problem(400, "body");
}

/// Paths as they come over the wire: clients would tidy them up.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn paths_do_not_climb() {
    let service = start().await;
    let id = service.new_job().await;
    for path in [
        format!("/api/v1/jobs/{id}/files/../../../../jobs.db"),
        format!("/api/v1/jobs/{id}/files/..%2f..%2fjobs.db"),
        format!("/api/v1/jobs/{id}/files//etc/passwd"),
        "/api/v1/cities/..%2f../files/x".to_owned(),
        "/docs/../../Cargo.toml".to_owned(),
        "/../../etc/passwd".to_owned(),
    ] {
        let told = raw(
            &service.address,
            format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").as_bytes(),
        )
        .await;
        assert!(told.starts_with("HTTP/1.1 404") || told.starts_with("HTTP/1.1 400"), "{path}: {told}");
        assert!(!told.contains("root:") && !told.contains("SQLite"), "{path}: {told}");
    }
}

/// A proxy on the same machine asks under a loopback name, from a loopback address, and says nothing of those for whom it asks.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_is_open_by_itself() {
    let service = start().await;
    let Coordinator { store, blobs, roots, limits, .. } = service.parts.clone();
    let parts = Coordinator::new(store, blobs, roots, limits);
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let app = router(parts);
    tokio::spawn(async move { axum::serve(listener, app).await });
    for path in ["/api/v1/caller", "/api/v1/jobs", "/api/v1/uploads", "/metrics", "/plain", "/ogc/jobs"] {
        let asked = format!("GET {path} HTTP/1.0\r\nHost: 127.0.0.1:8080\r\nConnection: close\r\n\r\n");
        let told = raw(&address, asked.as_bytes()).await;
        assert!(told.starts_with("HTTP/1.0 401") || told.starts_with("HTTP/1.1 401"), "{path}: {told}");
        assert!(told.contains("gable token create"), "{path}: {told}");
    }
    // One that was told to be open, too, refuses proxies that say what they are.
    let asked = [("x-forwarded-for", "203.0.113.7")];
    service.ask("GET", "/api/v1/caller", &asked, None).await.problem(401, "unauthorised");
    assert_eq!(service.get("/api/v1/caller").await.json()["tokens"], false);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn ogc_and_figures_need_a_token_as_well() {
    let service = start().await;
    let token = async |name: &str, scope, max_jobs| {
        let new = NewToken { name: name.to_owned(), scope, groups: Vec::new(), max_jobs, expires: None };
        format!("Bearer {}", create_token(&service.parts.store, &new).await.expect("made").expect("the name is free"))
    };
    let ann = token("ann", Scope::Submitter, Some(1)).await;
    let view = token("view", Scope::Viewer, None).await;
    for path in ["/metrics", "/ogc", "/ogc/processes", "/ogc/jobs", "/api/v1/cities", "/api/v1/cities/x/files/y"] {
        service.get(path).await.problem(401, "unauthorised");
    }
    assert_eq!(service.ask("GET", "/metrics", &[("authorization", &view)], None).await.status, 200);
    let body = json!({ "inputs": { "source": "mesh.obj", "city": "a" } }).to_string();
    let execute = async |service: &Service, token: &str| {
        let headers = [("authorization", token), ("content-type", "application/json")];
        service.ask("POST", "/ogc/processes/city-model/execution", &headers, Some(body.clone())).await
    };
    execute(&service, &view).await.problem(403, "forbidden");
    let made = execute(&service, &ann).await;
    assert_eq!(made.status, 201);
    execute(&service, &ann).await.problem(429, "quota");
    let place = format!("/ogc/jobs/{}", made.json()["jobID"].as_str().expect("an id"));
    let kind = "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-job";
    service.ask("DELETE", &place, &[("authorization", &view)], None).await.problem(404, kind);
    assert_eq!(service.ask("DELETE", &place, &[("authorization", &ann)], None).await.status, 200);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_repeated_submission_is_answered_though_the_quota_is_used_up() {
    let service = start().await;
    let new = NewToken {
        name: "ann".to_owned(),
        scope: Scope::Submitter,
        groups: Vec::new(),
        max_jobs: Some(1),
        expires: None,
    };
    let token = create_token(&service.parts.store, &new).await.expect("made").expect("the name is free");
    let token = format!("Bearer {token}");
    let request = json!({ "source": "mesh.obj", "city": "delft" });
    let submit =
        async |key: &str| service.submit(&request, &[("authorization", &token), ("idempotency-key", key)]).await;
    let first = submit("k").await;
    let again = submit("k").await;
    assert_eq!((first.status, again.status), (201, 200), "its answer may have been lost");
    assert_eq!(first.json()["id"], again.json()["id"]);
    submit("other").await.problem(429, "quota");
}
