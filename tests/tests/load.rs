//! Many clients and many jobs.
//!
//! `GABLE_LOAD=full` asks for two hundred clients, one request a second each, that poll a job of a minute and more; by default there
//! are twenty, and the job takes some seconds. The bounds are the same. A machine that does something else for a moment makes
//! answers late and jobs slow, never the other way round: so the best of some runs counts. The clients run beside the job on the
//! same cores, and what they take counts as well: they are as light as clients can be.
#![cfg(unix)]

use gable_tests::{Database, Service, town};
use serde_json::{Value, json};
use sqlx::Connection as _;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Milliseconds.
const LIMIT: f64 = 50.0;

/// How much longer a job may take if it is polled.
const SLOWER: f64 = 1.05;

/// How long the job of the whole load is to take, seconds: a minute, and what machines differ by from one run to the next.
const LONG: f64 = 75.0;

/// Most pairs of a job that is left alone and one that is polled.
const PAIRS: usize = 5;

/// One test at a time: they measure.
static QUIET: Mutex<()> = Mutex::new(());

fn full() -> bool {
    std::env::var("GABLE_LOAD").is_ok_and(|v| v == "full")
}

/// The time below which a part of the answers were given, milliseconds.
fn quantile(times: &mut [f64], part: f64) -> f64 {
    times.sort_by(f64::total_cmp);
    times[((times.len() as f64 * part) as usize).min(times.len() - 1)]
}

/// Runs a job of a city of its own, of `side` by `side` blocks; gives how long it took, seconds. `polled` is called while it runs.
fn run_job(service: &Service, mesh: &Path, city: &str, side: u32, polled: impl FnOnce(&str)) -> f64 {
    // Each block is a process of its own.
    let wanted = json!({ "sampling.step": 0.3, "grid.columns": side, "grid.rows": side, "output.report": false });
    let job = service.submit(mesh, city, &wanted);
    polled(&job);
    service.expect(&job, "successful", Duration::from_secs(600));
    // The first event of a task, and the end.
    let shown = service.get(&format!("/jobs/{job}"));
    let at = |member: &str| -> f64 {
        let clock = shown[member].as_str().and_then(|t| t.split_once('T')).expect("a time").1.trim_end_matches('Z');
        clock.split(':').fold(0.0, |all, part| 60.0 * all + part.parse::<f64>().expect("a number"))
    };
    (at("finished") - at("started")).rem_euclid(86_400.0)
}

/// What clients saw.
#[derive(Debug, Default)]
struct Polled {
    /// Times of the answers, milliseconds.
    times: Vec<f64>,
    /// How many of them said that there is nothing new.
    unchanged: usize,
}

/// Clients that ask for a job once a second each until it is over, by ETag.
fn poll(service: &Service, job: &str, clients: u64) -> Polled {
    let over = Arc::new(AtomicBool::new(false));
    let host = service.address().trim_start_matches("http://").to_owned();
    let threads: Vec<_> = (0..clients)
        .map(|number| {
            let (host, over) = (host.clone(), Arc::clone(&over));
            let path = format!("/api/v1/jobs/{job}");
            let token = service.operator().to_owned();
            std::thread::spawn(move || {
                let mut polled = Polled::default();
                std::thread::sleep(Duration::from_millis(number * 1000 / clients));
                let mut connection = BufReader::new(TcpStream::connect(&host).expect("a connection"));
                connection.get_ref().set_nodelay(true).expect("a socket");
                let mut tag = String::new();
                while !over.load(Ordering::Relaxed) {
                    let begin = Instant::now();
                    let (status, body) = ask(&mut connection, &host, &token, &path, &mut tag);
                    polled.times.push(begin.elapsed().as_secs_f64() * 1000.0);
                    match status {
                        200 => {
                            let job: Value = serde_json::from_slice(&body).expect("JSON");
                            over.fetch_or(job["finished"].is_string(), Ordering::Relaxed);
                        }
                        304 => {
                            assert!(body.is_empty());
                            polled.unchanged += 1;
                        }
                        other => panic!("status {other}"),
                    }
                    std::thread::sleep(Duration::from_secs(1).saturating_sub(begin.elapsed()));
                }
                polled
            })
        })
        .collect();
    threads.into_iter().map(|t| t.join().expect("a client")).fold(Polled::default(), |mut all, one| {
        all.times.extend(one.times);
        all.unchanged += one.unchanged;
        all
    })
}

/// Asks once, for what is not under this tag; gives the status and the body, and takes over the new tag.
fn ask(connection: &mut BufReader<TcpStream>, host: &str, token: &str, path: &str, tag: &mut String) -> (u16, Vec<u8>) {
    let known = if tag.is_empty() { String::new() } else { format!("if-none-match: {tag}\r\n") };
    let request = format!("GET {path} HTTP/1.1\r\nhost: {host}\r\nauthorization: Bearer {token}\r\n{known}\r\n");
    connection.get_mut().write_all(request.as_bytes()).expect("the request is sent");
    let (mut status, mut length, mut line) = (0, 0, String::new());
    loop {
        line.clear();
        connection.read_line(&mut line).expect("a line of the answer");
        let text = line.trim_end();
        match text.split_once(": ") {
            None if text.is_empty() => break,
            None => status = text.split(' ').nth(1).and_then(|s| s.parse().ok()).expect("a status"),
            Some((name, value)) if name.eq_ignore_ascii_case("etag") => value.clone_into(tag),
            Some((name, value)) if name.eq_ignore_ascii_case("content-length") => {
                length = value.parse().expect("a length")
            }
            Some(_) => {}
        }
    }
    let mut body = vec![0; length];
    connection.read_exact(&mut body).expect("the body");
    (status, body)
}

/// Seconds of a core that a process has used so far, without its children; none where the system does not tell.
fn used(process: &str) -> Option<f64> {
    let line = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    let fields: Vec<&str> = line.rsplit_once(") ")?.1.split(' ').collect();
    // In hundredths of a second.
    Some((fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?) / 100.0)
}

#[test]
#[expect(clippy::print_stdout, reason = "the figures are for whoever runs the test")]
fn many_clients_poll_a_running_job() {
    let _alone = QUIET.lock().unwrap_or_else(PoisonError::into_inner);
    let clients = if full() { 200 } else { 20 };
    let mesh = town(2, 0.01).join("mesh");
    let mut service = Service::new("many_clients", Database::Sqlite, &mesh, 5.0).unwrap();
    let process = service.serve(&["--all", "--slots", "1"]);
    let pid = process.id().to_string();
    let mut side = 5;
    if full() {
        // As many blocks as take the minute on this machine.
        let took = run_job(&service, &mesh, "measure", 16, |_| ());
        side = (16.0 * (LONG / took).sqrt()).ceil().max(16.0) as u32;
        println!("16 × 16 blocks took {took:.1} s: {side} × {side} from here on");
    }
    let (mut alone, mut polled, mut p99) = (f64::MAX, f64::MAX, f64::MAX);
    for pair in 0..PAIRS {
        let begin = used(&pid);
        let quiet = run_job(&service, &mesh, &format!("alone {pair}"), side, |_| ());
        let (middle, own) = (used(&pid), used("self"));
        let mut seen = Polled::default();
        let watched =
            run_job(&service, &mesh, &format!("polled {pair}"), side, |job| seen = poll(&service, job, clients));
        let (end, own_end) = (used(&pid), used("self"));
        let (median, worst) = (quantile(&mut seen.times, 0.5), quantile(&mut seen.times, 0.99));
        let answers = seen.times.len();
        println!(
            "{clients} clients, {answers} answers, {} of them unchanged: median {median:.1} ms, p99 {worst:.1} ms; \
             the job took {watched:.2} s, and {quiet:.2} s alone",
            seen.unchanged
        );
        if let (Some(begin), Some(middle), Some(end), Some(own), Some(own_end)) = (begin, middle, end, own, own_end) {
            println!(
                "seconds of a core: the service {:.2}, and {:.2} alone; the clients {:.2}",
                end - middle,
                middle - begin,
                own_end - own
            );
        }
        assert!(answers as f64 >= 0.5 * clients as f64 * watched, "only {answers} answers");
        assert!(!full() || watched >= 60.0, "the job is over after {watched} s");
        (alone, polled, p99) = (alone.min(quiet), polled.min(watched), p99.min(worst));
        if p99 < LIMIT && polled <= SLOWER * alone {
            return;
        }
    }
    panic!("p99 {p99:.1} ms; {polled:.2} s instead of {alone:.2} s");
}

/// Puts many jobs into the table, as they are when they have ended.
fn fill(database: &str, jobs: usize) {
    let statement = format!(
        "INSERT INTO job (id, city, owner, request, state, priority, stage, events, created, started, finished) \
         WITH RECURSIVE numbered (n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM numbered WHERE n + 1 < {jobs}) \
         SELECT '0199a3c4-0000-7000-8000-' || CAST(100000000000 + n AS TEXT), 'city ' || CAST(n % 50 AS TEXT), 'local', \
         '{{\"source\":\"mesh.obj\",\"city\":\"city\",\"parameters\":{{\"sampling.step\":0.25}},\"priority\":0}}', \
         'successful', 0, 7, 12, 1760000000000 + n, 1760000000000 + n, 1760000000000 + n FROM numbered"
    );
    sqlx::any::install_default_drivers();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut connection = sqlx::AnyConnection::connect(database).await.unwrap();
        let done = sqlx::query(sqlx::AssertSqlSafe(statement)).execute(&mut connection).await.unwrap();
        assert_eq!(done.rows_affected(), jobs as u64);
        connection.close().await.unwrap();
    });
}

#[expect(clippy::print_stdout, reason = "the figures are for whoever runs the test")]
fn listed(database: Database) {
    const JOBS: usize = 10_000;
    const TRIES: usize = 5;
    let _alone = QUIET.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let Some(mut service) = Service::new("ten_thousand", database, folder.path(), 5.0) else { return };
    let _process = service.serve(&[]);
    fill(service.database(), JOBS);
    // Each page of all, by clients that walk from the newest job to the oldest; and lists of some of them.
    for (query, jobs) in [
        ("?limit=100", JOBS),
        ("?limit=500", JOBS),
        ("?limit=500&state=successful", JOBS),
        ("?limit=500&state=failed", 0),
        ("?limit=500&city=city%207", JOBS / 50),
        ("?limit=500&owner=local", JOBS),
        ("?limit=50&state=successful&city=city%207", JOBS / 50),
    ] {
        let (mut found, mut next, mut pages) = (0, String::new(), Vec::new());
        loop {
            let path = format!("/jobs{query}{next}");
            let mut best = f64::MAX;
            let mut page = Value::Null;
            for _ in 0..TRIES {
                let begin = Instant::now();
                page = service.get(&path);
                best = best.min(begin.elapsed().as_secs_f64() * 1000.0);
            }
            pages.push(best);
            found += page["jobs"].as_array().unwrap().len();
            let Some(before) = page["next"].as_str() else { break };
            next = format!("&before={before}");
        }
        assert_eq!(found, jobs, "{query}");
        let (median, slowest) = (quantile(&mut pages, 0.5), quantile(&mut pages, 1.0));
        println!("{database:?} {query}: {} pages, median {median:.1} ms, slowest {slowest:.1} ms", pages.len());
        assert!(slowest < LIMIT, "{query}: {slowest:.1} ms");
    }
}

#[test]
fn many_jobs_are_listed() {
    listed(Database::Sqlite);
}

#[test]
fn many_jobs_are_listed_on_postgres() {
    listed(Database::Postgres);
}
