//! The commands that ask a service on another machine, against a real one; and the tokens that open it.

use gable_tests::{Database, Finished, Service, files_of, run_gable, same_models, skip, town};
use serde_json::Value;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

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
        closed.stderr.contains("GABLE_TOKEN") && closed.stderr.contains("Authorization: Bearer"),
        "{}",
        closed.stderr
    );
    let nowhere = ask(&service, &token, &["status", "none"]);
    assert_eq!((nowhere.code, nowhere.stderr.contains("there is no job none")), (2, true), "{}", nowhere.stderr);
    let outside = ask(&service, &token, &["submit", "/etc/passwd", "--city", "delft"]);
    assert_eq!((outside.code, outside.stderr.contains("no mesh that can be sent")), (2, true), "{}", outside.stderr);
    let unsent = ask(&service, &token, &["submit", "/etc/passwd", "--city", "delft", "--send", "never"]);
    assert_eq!((unsent.code, unsent.stderr.contains("source root")), (2, true), "{}", unsent.stderr);

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
    let revoked = ask(&service, &token, &["status"]);
    assert_eq!((revoked.code, revoked.stderr.contains("not known")), (2, true), "{}", revoked.stderr);
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

/// A certificate of an authority of its own, for a name; gives the paths of the authority, the certificate and its key. None
/// where OpenSSL is not installed.
fn certificate(folder: &Path, name: &str) -> Option<[PathBuf; 3]> {
    let [authority, authority_key, certificate, key, request, more] =
        ["ca.pem", "ca.key", "server.pem", "server.key", "server.csr", "more"].map(|file| folder.join(file));
    std::fs::write(&more, format!("subjectAltName={name}\nextendedKeyUsage=serverAuth\n")).unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let ec = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";
    for arguments in [
        format!(
            "req -x509 {ec} -keyout {} -out {} -days 2 -subj /CN=tests -addext keyUsage=critical,keyCertSign",
            text(&authority_key),
            text(&authority)
        ),
        format!("req {ec} -keyout {} -out {} -subj /CN=gable", text(&key), text(&request)),
        format!(
            "x509 -req -in {} -CA {} -CAkey {} -CAcreateserial -out {} -days 2 -extfile {}",
            text(&request),
            text(&authority),
            text(&authority_key),
            text(&certificate),
            text(&more)
        ),
    ] {
        let done = Command::new("openssl").args(arguments.split(' ')).output().ok()?;
        assert!(done.status.success(), "openssl {arguments}: {}", String::from_utf8_lossy(&done.stderr));
    }
    Some([authority, certificate, key])
}

/// A server that speaks TLS in front of a port; gives its own.
fn tls_proxy(certificate: &Path, key: &Path, port: &str) -> (Killed, String) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("conformance/tls_proxy.py");
    let mut python = Command::new("python3");
    let mut proxy =
        Killed(python.arg(script).args([certificate, key]).arg(port).stdout(Stdio::piped()).spawn().unwrap());
    let mut line = String::new();
    BufReader::new(proxy.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
    (proxy, line.trim().to_owned())
}

/// Killed when it is dropped.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        self.0.kill().ok();
        self.0.wait().ok();
    }
}

#[test]
fn tls_is_spoken_with_those_who_can_be_trusted() {
    let (ours, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let made = [certificate(ours.path(), "IP:127.0.0.1"), certificate(other.path(), "DNS:gable.example")];
    let [Some([authority, certificate, key]), Some([others, elsewhere, elsewhere_key])] = made else {
        return skip("tls_is_spoken_with_those_who_can_be_trusted", "OpenSSL is not installed");
    };
    if Command::new("python3").arg("--version").output().is_err() {
        return skip("tls_is_spoken_with_those_who_can_be_trusted", "Python is not installed");
    }
    let mesh = town(2, 0.004).join("mesh");
    let mut service = Service::new("tls", Database::Sqlite, &mesh, 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "1"]);
    let token = service.make_token("ann", &["--scope", "submitter"]);
    let port = service.address().rsplit_once(':').unwrap().1.to_owned();
    let (_proxy, tls) = tls_proxy(&certificate, &key, &port);
    let url = format!("https://127.0.0.1:{tls}");
    let ask = |url: &str, authority: &Path, arguments: &[&str]| {
        let more = ["--url", url, "--token", &token, "--ca-file", authority.to_str().unwrap()];
        run_gable(&[arguments, &more].concat())
    };

    let submit = ["submit", mesh.to_str().unwrap(), "--city", "delft", "--watch", "--json"];
    let wanted = ["--set", "sampling.step=0.5", "--set", "grid.columns=2", "--set", "grid.rows=2"];
    let job = ask(&url, &authority, &[&submit[..], &wanted].concat()).success().json();
    assert_eq!(job["state"], "successful");
    let out = ours.path().join("out");
    let download = ["download", "--city", "delft", "--out", out.to_str().unwrap(), "--json"];
    let fetched = ask(&url, &authority, &download).success().json();
    assert!(fetched["fetched"].as_u64().unwrap() > 5, "{fetched}");

    // An authority that the system does not know; another authority of the same name; a certificate for another name.
    let refused = |finished: Finished, reason: &str| {
        assert_eq!(finished.code, 1, "{}", finished.stderr);
        let said = finished.stderr.to_lowercase();
        assert!(said.contains("cannot be trusted") && said.contains("--ca-file") && said.contains(reason), "{said}");
    };
    refused(run_gable(&["status", "--url", &url, "--token", &token]), "unknownissuer");
    refused(ask(&url, &others, &["status"]), "badsignature");
    let (_elsewhere, port) = tls_proxy(&elsewhere, &elsewhere_key, &port);
    refused(ask(&format!("https://127.0.0.1:{port}"), &others, &["status"]), "not valid for name");

    let no_file = ask(&url, &ours.path().join("none.pem"), &["status"]);
    assert_eq!((no_file.code, no_file.stderr.contains("--ca-file")), (2, true), "{}", no_file.stderr);
    let no_certificate = ask(&url, &key, &["status"]);
    assert_eq!((no_certificate.code, no_certificate.stderr.contains("no certificate")), (2, true));
}

#[test]
fn a_token_is_shown_once() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
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
