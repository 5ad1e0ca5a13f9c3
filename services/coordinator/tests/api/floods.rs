//! Many connections, slow bodies, and more of them than an owner may send.

use crate::browsers::job_with;
use crate::{Service, start, start_with};
use gable_coordinator::{Limits, NewToken, Patience, Places, create_token, probes, router, serve};
use gable_job_store::Scope;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

/// Serves a service once more, with these limits; gives the address.
async fn serve_with(service: &Service, patience: Patience, places: Places) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    tokio::spawn(serve(listener, router(service.parts.clone()), patience, places, std::future::pending()));
    address
}

async fn connect(address: &str) -> TcpStream {
    TcpStream::connect(address.trim_start_matches("http://")).await.expect("a connection")
}

/// What comes on a connection until it is closed, within a time.
async fn rest(stream: &mut TcpStream, most: Duration) -> Option<String> {
    let mut answer = Vec::new();
    let read = tokio::time::timeout(most, stream.read_to_end(&mut answer)).await;
    read.ok().map(|_| String::from_utf8_lossy(&answer).into_owned())
}

/// Asks for a page; none if there is no answer in time.
async fn ask(address: &str, path: &str) -> Option<String> {
    let mut stream = connect(address).await;
    let asked = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    // Where there is no room, the connection is closed at once.
    let _ = stream.write_all(asked.as_bytes()).await;
    rest(&mut stream, Duration::from_secs(2)).await
}

fn is_ok(answer: Option<&String>) -> bool {
    answer.is_some_and(|told| told.starts_with("HTTP/1.1 200"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_address_has_so_many_connections() {
    let service = start().await;
    let address = serve_with(&service, Patience::default(), Places { of_address: 4, ..Places::default() }).await;
    let mut held = Vec::new();
    for _ in 0..4 {
        held.push(connect(&address).await);
    }
    for _ in 0..50 {
        let told = ask(&address, "/healthz").await;
        assert_eq!(told.as_deref(), Some(""), "it is closed at once");
    }
    held.pop();
    let begin = Instant::now();
    while !is_ok(ask(&address, "/healthz").await.as_ref()) {
        assert!(begin.elapsed() < Duration::from_secs(5), "a place that is free again is given");
    }
    // Those that say nothing are ended by themselves.
    let hasty = Patience { head: Duration::from_millis(200), ..Patience::default() };
    let address = serve_with(&service, hasty, Places { of_address: 4, ..Places::default() }).await;
    let _held = [connect(&address).await, connect(&address).await, connect(&address).await, connect(&address).await];
    tokio::time::sleep(Duration::from_millis(800)).await;
    assert!(is_ok(ask(&address, "/healthz").await.as_ref()));
    // Also those that have asked once.
    let mut idle = connect(&address).await;
    idle.write_all(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n").await.expect("sent");
    assert!(rest(&mut idle, Duration::from_secs(5)).await.is_some_and(|told| told.starts_with("HTTP/1.1 200")));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn supervisors_are_answered_during_a_flood() {
    let service = start().await;
    let few = Places { all: 3, ..Places::default() };
    let address = serve_with(&service, Patience::default(), few.clone()).await;
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let beside = listener.local_addr().expect("an address").to_string();
    let app = probes(service.parts.clone());
    tokio::spawn(serve(listener, app, Patience::default(), Places::default(), std::future::pending()));
    let _flood = [connect(&address).await, connect(&address).await, connect(&address).await, connect(&address).await];
    assert!(!is_ok(ask(&address, "/healthz").await.as_ref()), "the flood is one");
    for path in ["/healthz", "/readyz", "/metrics"] {
        assert!(is_ok(ask(&beside, path).await.as_ref()), "{path}");
    }
    for path in ["/api/v1/jobs", "/", "/docs/", "/api/v1/links/a.b/files/x"] {
        let told = ask(&beside, path).await.unwrap_or_default();
        assert!(told.starts_with("HTTP/1.1 404"), "{path}: {told}");
    }
}

/// The head of an upload.
fn head(token: &str, length: usize) -> String {
    format!(
        "POST /api/v1/uploads?name=a.obj HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {length}\r\n\
         Authorization: {token}\r\n\r\n"
    )
}

async fn token(service: &Service, name: &str) -> String {
    let new =
        NewToken { name: name.to_owned(), scope: Scope::Submitter, groups: Vec::new(), max_jobs: None, expires: None };
    format!("Bearer {}", create_token(&service.parts.store, &new).await.expect("made").expect("the name is free"))
}

/// Sends bytes one by one until the service answers; gives the answer.
async fn trickle(stream: &mut TcpStream, pause: Duration, most: Duration) -> String {
    let begin = Instant::now();
    let mut answer = Vec::new();
    while begin.elapsed() < most {
        let mut piece = [0; 4096];
        match tokio::time::timeout(pause, stream.read(&mut piece)).await {
            Ok(Ok(0) | Err(_)) => break,
            Ok(Ok(count)) => answer.extend_from_slice(&piece[..count]),
            // What is refused takes no more.
            Err(_) => drop(stream.write_all(b"v").await),
        }
    }
    String::from_utf8_lossy(&answer).into_owned()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn uploads_that_trickle_are_ended() {
    let limits = Limits {
        upload_window: Duration::from_millis(500),
        upload_least: 1000,
        time: Duration::from_millis(500),
        ..Limits::default()
    };
    let service = start_with(limits).await;
    let ann = token(&service, "ann").await;
    let mut slow = connect(&service.address).await;
    slow.write_all(head(&ann, 100_000).as_bytes()).await.expect("sent");
    let told = trickle(&mut slow, Duration::from_millis(20), Duration::from_secs(10)).await;
    assert!(told.starts_with("HTTP/1.1 408") && told.contains("bytes came within 0.5 s"), "{told}");
    // A part as well; and a body of JSON at the same routes, which nothing else ends.
    let begun =
        "POST /api/v1/open-uploads HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: 1000\r\n";
    let head_of_json = format!("{begun}Content-Type: application/json\r\nAuthorization: {ann}\r\n\r\n{{");
    let mut slow = connect(&service.address).await;
    slow.write_all(head_of_json.as_bytes()).await.expect("sent");
    let told = trickle(&mut slow, Duration::from_millis(20), Duration::from_secs(10)).await;
    assert!(told.starts_with("HTTP/1.1 408"), "{told}");
    // One that comes as fast as it can is taken, though the service is slow to write it.
    let mesh = "v 0 0 0\n".repeat(50_000);
    let headers = [("authorization", &*ann)];
    let sent = service.ask("POST", "/api/v1/uploads?name=a.obj", &headers, Some(mesh)).await;
    assert_eq!(sent.status, 201, "{}", sent.json());
    assert_eq!(
        std::fs::read_dir(&service.parts.folder)
            .map(|d| d.flatten().filter(|e| e.path().join("body").exists()).count())
            .unwrap_or(0),
        0
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_body_has_its_time() {
    let limits = Limits { upload_time: Duration::from_millis(600), upload_least: 1, ..Limits::default() };
    let service = start_with(limits).await;
    let ann = token(&service, "ann").await;
    let mut endless = connect(&service.address).await;
    endless.write_all(head(&ann, 1 << 30).as_bytes()).await.expect("sent");
    let told = trickle(&mut endless, Duration::from_millis(10), Duration::from_secs(10)).await;
    assert!(told.starts_with("HTTP/1.1 408") && told.contains("in parts"), "{told}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn large_json_is_refused_where_uploads_are_taken() {
    let service = start().await;
    let ann = token(&service, "ann").await;
    let headers = [("authorization", &*ann), ("content-type", "application/json")];
    let giant = format!("{{\"name\":\"{}\"}}", "a".repeat(20_000));
    let told = service.ask("POST", "/api/v1/open-uploads", &headers, Some(giant)).await;
    told.problem(413, "body");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_owner_sends_so_many_bodies_and_bytes_at_a_time() {
    let service = start_with(Limits { open_uploads: 2, uploads: 100_000, ..Limits::default() }).await;
    let (ann, bob) = (token(&service, "ann").await, token(&service, "bob").await);
    let mut held = Vec::new();
    for _ in 0..2 {
        let mut stream = connect(&service.address).await;
        stream.write_all(head(&ann, 90_000).as_bytes()).await.expect("sent");
        stream.write_all(b"v 0 0 0\n").await.expect("sent");
        held.push(stream);
    }
    tokio::time::sleep(Duration::from_millis(300)).await;
    let send = async |token: &str| {
        service
            .ask("POST", "/api/v1/uploads?name=a.obj", &[("authorization", token)], Some("v 0 0 0\n".to_owned()))
            .await
    };
    send(&ann).await.problem(429, "quota");
    assert_eq!(send(&bob).await.status, 201, "others send");
    // Each of them is below what ann may have, both together are not.
    let mut answers = Vec::new();
    for stream in &mut held {
        let _ = stream.write_all(&[b'\n'; 89_992]).await;
        answers.push(rest(stream, Duration::from_secs(10)).await.unwrap_or_default());
    }
    let taken = answers.iter().filter(|a| a.starts_with("HTTP/1.1 201")).count();
    let refused = answers.iter().filter(|a| a.starts_with("HTTP/1.1 413")).count();
    assert_eq!((taken, refused), (1, 1), "{answers:?}");
    drop(held);
    send(&bob).await;
    // What was refused is not counted on.
    assert_eq!(send(&ann).await.status, 201);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_takes_nothing_is_left() {
    let service = start().await;
    let content = "x".repeat(64 << 20);
    let id = job_with(&service, &[("large.bin", &content)]).await;
    let hasty = Patience { taking: Duration::from_millis(500), ..Patience::default() };
    let address = serve_with(&service, hasty, Places::default()).await;
    let mut stream = connect(&address).await;
    let asked =
        format!("GET /api/v1/jobs/{id}/files/large.bin HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    stream.write_all(asked.as_bytes()).await.expect("sent");
    tokio::time::sleep(Duration::from_secs(3)).await;
    let mut got = Vec::new();
    let _ = tokio::time::timeout(Duration::from_secs(20), stream.read_to_end(&mut got)).await.expect("it is closed");
    assert!(got.len() < content.len(), "{} bytes came although nothing was taken for 3 s", got.len());
}
