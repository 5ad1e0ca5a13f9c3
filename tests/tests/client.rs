//! The commands that ask a service on another machine, against a real one; and the tokens that open it.
#![cfg(unix)]

use gable_tests::{Database, Finished, Service, files_of, run_gable, same_models, town};
use serde_json::Value;
use std::path::Path;

fn ask(service: &Service, token: &str, arguments: &[&str]) -> Finished {
    run_gable(&[arguments, &["--url", service.address(), "--token", token]].concat())
}

#[test]
fn a_job_is_submitted_watched_and_downloaded() {
    let mesh = town(2, 0.004).join("mesh");
    let mut service = Service::new("client", Database::Sqlite, &mesh, 5.0).unwrap();
    let process = service.serve(&["--all", "--slots", "2", "-vvv"]);
    let token = service.make_token("ann", &["--scope", "submitter", "--max-jobs", "1", "--days", "1"]);
    let source = mesh.to_str().unwrap();
    let wanted = ["--set", "sampling.step=0.5", "--set", "grid.columns=2", "--set", "grid.rows=2"];

    // Without a token nothing is told, and the exit code says whose fault it is.
    let closed = run_gable(&["status", "--url", service.address(), "--json"]);
    assert_eq!(closed.code, 2, "{}", closed.stderr);
    assert!(
        closed.stderr.contains("authorization: Bearer") || closed.stderr.contains("Authorization: Bearer"),
        "{}",
        closed.stderr
    );
    let nowhere = ask(&service, &token, &["status", "none"]);
    assert_eq!((nowhere.code, nowhere.stderr.contains("there is no job none")), (2, true), "{}", nowhere.stderr);
    let outside = ask(&service, &token, &["submit", "/etc/passwd", "--city", "delft"]);
    assert_eq!((outside.code, outside.stderr.contains("source root")), (2, true), "{}", outside.stderr);

    let submit = [&["submit", source, "--city", "del ft", "--key", "k", "--json"], &wanted[..]].concat();
    let job = ask(&service, &token, &submit).success().json();
    let id = job["id"].as_str().unwrap();
    assert_eq!(job["owner"], "ann");
    assert_eq!(ask(&service, &token, &submit).success().json()["id"], id, "the same key, the same job");
    let watched = ask(&service, &token, &["status", id, "--watch", "--json"]).success();
    assert_eq!(watched.json()["state"], "successful");
    assert!(watched.stderr.contains("running: "), "it tells how far it is: {}", watched.stderr);
    let listed = ask(&service, &token, &["status", "--state", "successful"]).success();
    assert!(listed.stdout.contains(id) && listed.stdout.contains("del ft"), "{}", listed.stdout);
    let over = ask(&service, &token, &["cancel", id]);
    assert_eq!((over.code, over.stderr.contains("is successful")), (2, true), "{}", over.stderr);
    assert_eq!(ask(&service, &token, &["retry", id]).code, 2, "nothing failed");

    downloads(&service, &token, id);

    // No secret is in the log, however much is logged.
    let log = process.log();
    assert!(log.contains(id), "jobs are named");
    assert!(!log.contains(&token), "the token is in the log");
    assert!(!log.contains(token.trim_start_matches("gable_")), "the token is in the log");

    service.revoke("ann");
    assert_eq!(ask(&service, &token, &["status"]).code, 0, "without tokens, this machine is answered");
}

#[test]
fn schedules_are_kept_from_the_command_line() {
    let mesh = town(2, 0.004).join("mesh");
    let mut service = Service::new("schedules_by_client", Database::Sqlite, &mesh, 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "1"]);
    let token = service.make_token("ann", &["--scope", "operator"]);
    let source = mesh.to_str().unwrap();
    let create = |cron: &str, more: &[&str]| {
        let given = ["schedule", "create", "nightly", source, "--city", "delft", "--cron", cron];
        ask(&service, &token, &[&given[..], more].concat())
    };
    let wrong = create("99 * * * *", &[]);
    assert_eq!((wrong.code, wrong.stderr.contains("the service refuses")), (2, true), "{}", wrong.stderr);
    // In February only, so that nothing ticks meanwhile.
    let made =
        create("30 2 29 2 *", &["--zone", "Europe/Amsterdam", "--set", "sampling.step=0.5", "--json"]).success().json();
    assert_eq!((&made["missed"], &made["zone"]), (&"skip".into(), &"Europe/Amsterdam".into()), "{made}");
    assert!(create("30 2 29 2 *", &["--missed", "once"]).success().stdout.contains("ticks next at"));

    let listed = ask(&service, &token, &["schedule", "list"]).success();
    assert!(listed.stdout.contains("nightly") && listed.stdout.contains("30 2 29 2 *"), "{}", listed.stdout);
    let run = ask(&service, &token, &["schedule", "run", "nightly", "--json"]).success().json();
    let job = run["job"].as_str().unwrap();
    assert_eq!(ask(&service, &token, &["status", job, "--watch"]).code, 0);
    let shown = ask(&service, &token, &["schedule", "show", "nightly", "--json"]).success().json();
    assert_eq!((&shown["missed"], &shown["last_runs"][0]["job"]), (&"once".into(), &job.into()), "{shown}");
    let _ = ask(&service, &token, &["schedule", "delete", "nightly"]).success();
    let gone = ask(&service, &token, &["schedule", "show", "nightly"]);
    assert_eq!((gone.code, gone.stderr.contains("there is no schedule")), (2, true), "{}", gone.stderr);
}

/// The files of a job and those of its city are the same, and are fetched once.
fn downloads(service: &Service, token: &str, id: &str) {
    let folder = tempfile::tempdir().unwrap();
    let fetch = |what: &[&str], to: &Path| -> Value {
        ask(service, token, &[&["download", "--json", "--out", to.to_str().unwrap()], what].concat()).success().json()
    };
    let (of_job, of_city) = (folder.path().join("job"), folder.path().join("city"));
    let first = fetch(&["--job", id], &of_job);
    assert!(first["files"].as_u64().unwrap() > 5 && first["files"] == first["fetched"], "{first}");
    let second = fetch(&["--job", id], &of_job);
    assert_eq!((&second["files"], &second["fetched"]), (&first["files"], &0.into()));
    // What was damaged is fetched again.
    std::fs::write(of_job.join("index.json"), "{}").unwrap();
    assert_eq!(fetch(&["--job", id], &of_job)["fetched"], 1);
    fetch(&["--city", "del ft"], &of_city);
    same_models(&files_of(&of_city), &files_of(&of_job));
    let none = ask(service, token, &["download", "--city", "none", "--out", of_city.to_str().unwrap()]);
    assert_eq!((none.code, none.stderr.contains("there is no city")), (2, true), "{}", none.stderr);
}

#[test]
fn a_service_that_does_not_answer_is_named() {
    let finished = run_gable(&["status", "--url", "http://127.0.0.1:1"]);
    assert_eq!(finished.code, 1);
    assert!(
        finished.stderr.contains("does not answer") && finished.stderr.contains("GABLE_URL"),
        "{}",
        finished.stderr
    );
    assert_eq!(run_gable(&["status", "--url", "ftp://x"]).code, 2);
}

#[test]
fn other_machines_need_a_token() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
    let open = run_gable(&["serve", "--data", data, "--source-root", data, "--listen", "0.0.0.0:0"]);
    assert_eq!((open.code, open.stderr.contains("gable token create")), (2, true), "{}", open.stderr);
    let made = run_gable(&["token", "create", "ann", "--scope", "viewer", "--data", data]).success();
    assert!(made.stdout.starts_with("gable_") && made.stdout.trim().len() == 70, "{}", made.stdout);
    let again = run_gable(&["token", "create", "ann", "--scope", "viewer", "--data", data]);
    assert_eq!((again.code, again.stderr.contains("already")), (2, true), "{}", again.stderr);
    let listed = run_gable(&["token", "list", "--json", "--data", data]).success();
    assert_eq!((&listed.json()[0]["name"], &listed.json()[0]["scope"]), (&"ann".into(), &"viewer".into()));
    assert!(!listed.stdout.contains(made.stdout.trim()), "it is shown once");
    let database = std::fs::read(folder.path().join("jobs.db")).unwrap();
    let wal = std::fs::read(folder.path().join("jobs.db-wal")).unwrap_or_default();
    for bytes in [database, wal] {
        let secret = made.stdout.trim().as_bytes();
        assert!(!bytes.windows(secret.len()).any(|w| w == secret), "only its hash is kept");
    }
    assert_eq!(run_gable(&["token", "revoke", "bob", "--data", data]).code, 2);
    let _ = run_gable(&["token", "revoke", "ann", "--data", data]).success();
}
