//! Who may use a service that nobody has made a token for yet.

use gable_tests::{Database, Process, Service, run_gable};
use std::time::{Duration, Instant};

/// All that looks like a token in what was said.
fn tokens(said: &str) -> Vec<String> {
    let hex = |text: &str| text.chars().take_while(char::is_ascii_hexdigit).collect::<String>();
    said.split("gable_").skip(1).map(hex).filter(|t| t.len() == 64).map(|t| format!("gable_{t}")).collect()
}

/// What processes have said, as soon as a text is in it.
fn said(processes: &[Process], text: &str) -> String {
    let begin = Instant::now();
    loop {
        let log: String = processes.iter().map(Process::log).collect();
        if log.contains(text) {
            return log;
        }
        assert!(begin.elapsed() < Duration::from_secs(20), "{text:?} was not said: {log}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The status that a request for the jobs is answered with.
fn status(address: &str, token: Option<&str>) -> u16 {
    let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
    let mut request = agent.get(format!("{address}/api/v1/jobs"));
    if let Some(token) = token {
        request = request.header("authorization", format!("Bearer {token}"));
    }
    request.call().expect("it answers").status().as_u16()
}

/// Several coordinators start at once on an empty database: one token is made, and told once.
fn the_first_start_tells_a_token(database: Database) {
    let folder = tempfile::tempdir().unwrap();
    let Some(service) = Service::new("first_token", database, folder.path(), 5.0) else { return };
    let started: Vec<(Process, String)> = std::thread::scope(|scope| {
        let starting: Vec<_> =
            (0..4).map(|_| scope.spawn(|| service.coordinator(&["--log-format", "json", "--quiet"]))).collect();
        starting.into_iter().map(|s| s.join().expect("it starts")).collect()
    });
    let (processes, addresses): (Vec<Process>, Vec<String>) = started.into_iter().unzip();
    let log = said(&processes, "\nexport GABLE_TOKEN=gable_");
    let told = tokens(&log);
    assert_eq!(told.len(), 1, "{log}");
    for address in &addresses {
        assert_eq!((status(address, None), status(address, Some(&told[0]))), (401, 200));
    }
    let list = ["token", "list", "--json", "--database", service.database()];
    let listed = run_gable(&list).success().json();
    assert_eq!((listed.as_array().map(Vec::len), &listed[0]["scope"]), (Some(1), &"operator".into()), "{listed}");

    // Never again, though it is still the only one; and --open opens nothing where there is a token.
    drop(processes);
    let (again, _) = service.coordinator(&[]);
    let (open, address) = service.coordinator(&["--open"]);
    assert_eq!(status(&address, None), 401);
    let log = said(&[again, open], "--open is of no effect");
    assert!(tokens(&log).is_empty() && !log.contains("GABLE_TOKEN"), "{log}");
}

#[test]
fn the_first_start_tells_a_token_on_sqlite() {
    the_first_start_tells_a_token(Database::Sqlite);
}

#[test]
fn the_first_start_tells_a_token_on_postgres() {
    the_first_start_tells_a_token(Database::Postgres);
}

#[test]
fn a_service_is_open_only_if_told_so() {
    let folder = tempfile::tempdir().unwrap();
    let mut service = Service::new("open", Database::Sqlite, folder.path(), 5.0).unwrap();
    let process = service.serve_first(&["--open"]);
    let log = said(&[process], "until a token is made");
    assert!(log.contains("WARN") && tokens(&log).is_empty(), "{log}");
    let _process = service.serve_first(&["--open"]);
    assert_eq!(status(service.address(), None), 200);
    let token = service.token("ann", "viewer");
    // Who looks may be told for a moment what held before.
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!((status(service.address(), None), status(service.address(), Some(&token))), (401, 200));

    let data = folder.path().to_str().unwrap();
    let everywhere = run_gable(&["serve", "--open", "--data", data, "--source-root", data, "--listen", "0.0.0.0:0"]);
    assert_eq!((everywhere.code, everywhere.stderr.contains("--open")), (2, true), "{}", everywhere.stderr);
}
