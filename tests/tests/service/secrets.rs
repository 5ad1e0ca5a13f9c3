//! No secret is in a log, however much is logged, also when connections fail: passwords of the database and of the object store,
//! tokens, secrets and addresses of webhooks.

use gable_tests::{Database, Service, gable, run_gable, town};
use serde_json::{Value, json};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const DATABASE: &str = "db-pa55W0rd-7f3e";
const OBJECTS: &str = "s3-s3cr3tK3y-91ab";
const SESSION: &str = "s3-s3ss10n-c4d2";
const HOOK: &str = "whsec_aG9vay1zM2NyM3QtZm9yLWdhYmxlLXRlc3Rz";
const HOOK_KEY: &str = "h00k-addr3ss-k3y-5e";
const CALLBACK_KEY: &str = "callback-addr3ss-k3y-6d";
const WRONG_TOKEN: &str = "gable_0fa1523bd77c";
const USER_INFO: &str = "url-pa55w0rd-3c";

/// Processes whose outputs go to files.
struct Spy {
    folder: tempfile::TempDir,
    running: Vec<Child>,
    variables: Vec<(String, String)>,
    count: usize,
}

impl Spy {
    fn log(&self, number: usize) -> PathBuf {
        self.folder.path().join(format!("{number}.log"))
    }

    fn start(&mut self, arguments: &[&str], variables: &[(&str, &str)]) -> PathBuf {
        let log = self.log(self.count);
        self.count += 1;
        let file = File::create(&log).unwrap();
        let child = Command::new(gable())
            .args(arguments)
            .envs(self.variables.iter().cloned())
            .env("RUST_LOG", "trace")
            .envs(variables.iter().copied())
            .stdin(Stdio::null())
            .stdout(file.try_clone().unwrap())
            .stderr(file)
            .spawn()
            .unwrap();
        self.running.push(child);
        log
    }

    /// Lets what was started last go on for a while, or until it ends.
    fn end(&mut self, patience: Duration) {
        let begin = Instant::now();
        let mut child = self.running.pop().unwrap();
        while begin.elapsed() < patience && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(20));
        }
        child.kill().ok();
        child.wait().unwrap();
    }

    /// All that was said.
    fn said(&self) -> String {
        let logs = (0..self.count).map(|n| std::fs::read(self.log(n)).unwrap());
        logs.map(|log| String::from_utf8_lossy(&log).into_owned()).collect()
    }
}

impl Drop for Spy {
    fn drop(&mut self) {
        for child in &mut self.running {
            child.kill().ok();
            child.wait().ok();
        }
    }
}

/// Waits for a line of a log, and gives what follows the text in it.
fn wait_for(log: &Path, text: &str) -> String {
    let begin = Instant::now();
    loop {
        let said = std::fs::read_to_string(log).unwrap_or_default();
        if let Some((_, rest)) = said.split_once(text) {
            return rest.split_whitespace().next().unwrap_or_default().to_owned();
        }
        assert!(begin.elapsed() < Duration::from_secs(60), "{text:?} was not said: {said}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A database that is not there.
fn nowhere() -> String {
    format!("postgres://gable:{DATABASE}@127.0.0.1:1/gable")
}

/// Starts that fail, or wait for what does not come.
fn failing_starts(spy: &mut Spy, database: &str, data: &str) {
    let nowhere = nowhere();

    let unknown = database.rsplit_once('/').unwrap().0.to_owned() + "/no_such_database";
    let no_user = database.replace("//gable:", "//nobody:");
    let garbled = format!("postgres://gable:{DATABASE}@[::bad/gable");
    let other = format!("mysql://gable:{DATABASE}@db/gable");
    for address in [&nowhere, &unknown, &no_user, &garbled, &other] {
        for command in ["serve", "work"] {
            spy.start(
                &[command, "--data", data, "--source-root", data, "-vvv"],
                &[("GABLE_DATABASE", address.as_str())],
            );
            spy.end(Duration::from_millis(1500));
        }
    }
    let away = [("AWS_ENDPOINT_URL", "http://127.0.0.1:1")];
    spy.start(&["serve", "--data", data, "--source-root", data, "--store", "s3://gable/artefacts", "-vvv"], &away);
    spy.end(Duration::from_millis(2500));
    spy.start(&["serve", "--help"], &[("GABLE_DATABASE", &nowhere)]);
    spy.end(Duration::from_secs(10));
    for url in ["http://127.0.0.1:1", &format!("http://me:{USER_INFO}@127.0.0.1:1")] {
        spy.start(&["status", "--url", url, "-vvv"], &[("GABLE_TOKEN", WRONG_TOKEN)]);
        spy.end(Duration::from_secs(20));
    }
}

/// What is asked of the service with a token.
fn ask(method: &str, url: &str, token: &str, body: Option<&Value>) -> (u16, Value) {
    let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
    let request = ureq::http::Request::builder().method(method).uri(url);
    let request = request.header("authorization", format!("Bearer {token}")).header("content-type", "application/json");
    let request = request.body(body.map(Value::to_string).unwrap_or_default()).unwrap();
    let mut answer = agent.run(request).unwrap();
    (answer.status().as_u16(), answer.body_mut().read_json().unwrap_or_default())
}

#[test]
fn no_secret_is_in_a_log() {
    let mesh = town(2, 0.004).join("mesh");
    let Some(service) = Service::new("secrets", Database::Postgres, &mesh, 5.0) else { return };
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
    let mut variables: Vec<(String, String)> = service.variables().to_vec();
    variables.iter_mut().filter(|(name, _)| name == "AWS_SECRET_ACCESS_KEY").for_each(|(_, v)| *v = OBJECTS.to_owned());
    variables.push(("AWS_SESSION_TOKEN".to_owned(), SESSION.to_owned()));
    let mut spy = Spy { folder: tempfile::tempdir().unwrap(), running: Vec::new(), variables, count: 0 };
    // The tests' server believes any password.
    let database = service.database().replace("//gable@", &format!("//gable:{DATABASE}@"));
    assert!(database.contains(DATABASE));
    // It waits for its database, which says so after some seconds, all the while.
    let waiting = spy.start(&["work", "--data", data, "-vvv"], &[("GABLE_DATABASE", &nowhere())]);
    failing_starts(&mut spy, &database, data);

    let token = run_gable(&["token", "create", "ann", "--scope", "operator", "--database", &database]).success();
    let token = token.stdout.trim().to_owned();
    let root = mesh.to_str().unwrap();
    let (serve, work) = (folder.path().join("serve"), folder.path().join("work"));
    let common = ["--store", service.store(), "--source-root", root, "--lease", "2", "-vvv"];
    let at = [("GABLE_DATABASE", &*database)];
    let serving = ["serve", "--listen", "127.0.0.1:0", "--private-webhooks", "--data", serve.to_str().unwrap()];
    let log = spy.start(&[&serving[..], &common].concat(), &at);
    let address = wait_for(&log, "listening on ");
    let working = ["work", "--slots", "1", "--task-memory", "2000", "--data", work.to_str().unwrap()];
    let work_log = spy.start(&[&working[..], &common].concat(), &at);

    let hook = json!({ "url": format!("http://127.0.0.1:1/hook?key={HOOK_KEY}"), "secret": HOOK });
    assert_eq!(ask("POST", &format!("{address}/api/v1/webhooks"), &token, Some(&hook)).0, 201);
    assert_eq!(ask("GET", &format!("{address}/api/v1/jobs"), WRONG_TOKEN, None).0, 401);
    let wanted = json!({ "sampling.step": 0.5, "grid.columns": 2, "grid.rows": 2, "output.report": false });
    let callback = format!("http://127.0.0.1:1/?key={CALLBACK_KEY}");
    let order = json!({
        "inputs": { "source": root, "city": "delft", "parameters": { "value": wanted } },
        "subscriber": { "successUri": callback, "inProgressUri": callback },
    });
    let (status, made) = ask("POST", &format!("{address}/ogc/processes/city-model/execution"), &token, Some(&order));
    assert_eq!(status, 201, "{made}");
    let job = made["jobID"].as_str().unwrap();
    let place = format!("{address}/api/v1/jobs/{job}");
    // The object store goes away in mid-job.
    std::thread::sleep(Duration::from_millis(300));
    service.objects().cut(true);
    std::thread::sleep(Duration::from_secs(2));
    service.objects().cut(false);
    spy.start(&["status", job, "--watch", "--url", &address, "-vvv"], &[("GABLE_TOKEN", &token)]);
    spy.end(Duration::from_secs(120));
    let (_, shown) = ask("GET", &place, &token, None);
    assert_eq!(shown["state"], "successful", "{shown}");
    wait_for(&log, "not delivered, again in");
    wait_for(&waiting, "waiting for the database");

    // All that was said to whom may read it.
    let answers = ["", "/events?limit=1000", "/blocks"].map(|p| ask("GET", &format!("{place}{p}"), &token, None).1);
    let mut told: String = answers.iter().map(Value::to_string).collect();
    let metrics = ureq::get(format!("{address}/metrics")).header("authorization", format!("Bearer {token}"));
    told += &metrics.call().unwrap().body_mut().read_to_string().unwrap();
    for unit in ["scene", "0_0"] {
        let log = ureq::get(format!("{place}/blocks/{unit}/log")).header("authorization", format!("Bearer {token}"));
        let log = log.call().unwrap().body_mut().read_to_string().unwrap();
        assert!(log.contains(" s  done, "), "{log}");
        told += &log;
    }
    let said = spy.said();
    for log in [&log, &work_log] {
        let log = std::fs::read_to_string(log).unwrap();
        assert!(log.contains("TRACE") && log.contains("DEBUG"), "little is logged: {log}");
    }
    assert!(said.contains(job), "jobs are named");
    let secret_of_token = token.trim_start_matches("gable_");
    for secret in [
        DATABASE,
        OBJECTS,
        SESSION,
        HOOK,
        HOOK.trim_start_matches("whsec_"),
        HOOK_KEY,
        CALLBACK_KEY,
        &token,
        secret_of_token,
        WRONG_TOKEN.trim_start_matches("gable_"),
        USER_INFO,
    ] {
        for text in [&said, &told] {
            let line = text.lines().find(|line| line.contains(secret));
            assert!(line.is_none(), "{secret} is told: {}", line.unwrap_or_default());
        }
    }
}
