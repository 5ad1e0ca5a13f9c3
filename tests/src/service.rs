//! A service of real processes: a coordinator, workers, a database and a folder of artefacts of their own.

use crate::proxy::Proxy;
use crate::s3_server::{self, Bucket};
use crate::{gable, postgres, run_gable};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use ureq::RequestBuilder;

/// Files by name.
pub type Files = BTreeMap<String, Vec<u8>>;

/// Arguments with which `gable run` writes what a job writes that asks for no formats: 3D Tiles as well.
pub const AS_A_JOB: [&str; 2] = ["--formats", "cityjson,cityjsonseq,citygml,3dtiles"];

/// What a service stands on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Database {
    /// A file, and a folder for the artefacts.
    Sqlite,
    /// Postgres, and S3 for the artefacts: servers of the tests' own; tests are skipped where they are not installed.
    Postgres,
}

/// A process, killed when it is dropped.
#[derive(Debug)]
pub struct Process {
    child: Child,
    log: Arc<Mutex<String>>,
}

impl Process {
    /// Starts the binary; what it says on standard error is kept.
    fn start(arguments: &[String], variables: &[(String, String)], wait_for: Option<&str>) -> (Self, String) {
        let mut child = Command::new(gable())
            .args(arguments)
            .env_remove("RUST_LOG")
            .env_remove("GABLE_TOKEN")
            .envs(variables.iter().cloned())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary can be started");
        let log = Arc::new(Mutex::new(String::new()));
        let lines = BufReader::new(child.stderr.take().expect("piped"));
        let kept = Arc::clone(&log);
        std::thread::spawn(move || {
            for line in lines.lines().map_while(Result::ok) {
                let mut log = kept.lock().unwrap_or_else(PoisonError::into_inner);
                *log += &line;
                log.push('\n');
            }
        });
        let mut said = BufReader::new(child.stdout.take().expect("piped"));
        let process = Self { child, log };
        let mut line = String::new();
        if let Some(wanted) = wait_for {
            said.read_line(&mut line).expect("standard output can be read");
            assert!(line.contains(wanted), "{line:?} instead of {wanted:?}: {}", process.log());
        }
        std::thread::spawn(move || said.lines().for_each(drop));
        (process, line)
    }

    /// Starts a command of the binary.
    ///
    /// # Panics
    /// If it cannot be started.
    #[must_use]
    pub fn of(arguments: &[&str]) -> Self {
        let arguments: Vec<String> = arguments.iter().map(|a| (*a).to_owned()).collect();
        Self::start(&arguments, &[], None).0
    }

    /// Its number.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// What it has said on standard error so far.
    #[must_use]
    pub fn log(&self) -> String {
        self.log.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Kills it, as by `kill -9`, and waits until it is gone.
    ///
    /// # Panics
    /// If it cannot be waited for.
    pub fn kill(&mut self) {
        self.child.kill().ok();
        self.child.wait().expect("it can be waited for");
    }

    /// Waits until it ends by itself, and gives its exit code.
    ///
    /// # Panics
    /// If it does not end in time.
    pub fn wait(&mut self, limit: Duration) -> Option<i32> {
        let begin = Instant::now();
        while begin.elapsed() < limit {
            if let Some(status) = self.child.try_wait().expect("it can be waited for") {
                return status.code();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("it did not end in {limit:?}: {}", self.log());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// Sends a signal to a process, such as `STOP`.
///
/// # Panics
/// If there is no such process.
pub fn signal(pid: u32, name: &str) {
    let sent = Command::new("kill").arg(format!("-{name}")).arg(pid.to_string()).status().expect("kill runs");
    assert!(sent.success(), "kill -{name} {pid}");
}

/// A service: its folders and its database; processes are started one by one.
#[derive(Debug)]
pub struct Service {
    folder: TempDir,
    database: String,
    store: String,
    variables: Vec<(String, String)>,
    objects: Option<Proxy>,
    root: PathBuf,
    lease: f64,
    address: String,
    token: String,
}

impl Service {
    /// A service without any process yet, for meshes below `root`; `None`, with a printed reason, where its database cannot be had.
    ///
    /// # Panics
    /// If its folder cannot be made.
    #[must_use]
    pub fn new(test: &str, database: Database, root: &Path, lease: f64) -> Option<Self> {
        let folder = TempDir::new().expect("a temporary folder");
        let mut objects = None;
        let (database, store) = match database {
            Database::Sqlite => {
                let path = |name: &str| folder.path().join(name).display().to_string();
                (format!("sqlite:{}", path("jobs.db")), path("store"))
            }
            Database::Postgres => {
                let address = postgres::database(test)?;
                let bucket = s3_server::bucket(test)?;
                objects = Some(Proxy::to(bucket.port));
                (address, format!("{}/artefacts", bucket.place))
            }
        };
        let variables = objects.as_ref().map(|p| Bucket::variables(p.port()).to_vec()).unwrap_or_default();
        let (root, address, token) = (root.to_owned(), String::new(), String::new());
        Some(Self { folder, database, store, variables, objects, root, lease, address, token })
    }

    /// The way to its artefacts, where it can be cut: S3.
    ///
    /// # Panics
    /// If they lie in a folder.
    #[must_use]
    pub fn objects(&self) -> &Proxy {
        self.objects.as_ref().expect("the artefacts are on S3")
    }

    /// Address of its database.
    #[must_use]
    pub fn database(&self) -> &str {
        &self.database
    }

    /// Place of its artefacts.
    #[must_use]
    pub fn store(&self) -> &str {
        &self.store
    }

    /// How many artefacts there are, as far as its S3 server lists them at once.
    ///
    /// # Panics
    /// If it does not answer, or they lie in a folder.
    #[must_use]
    pub fn stored(&self) -> usize {
        let bucket = self.store.trim_start_matches("s3://").split('/').next().expect("a bucket");
        let url = format!("http://127.0.0.1:{}/{bucket}?list-type=2", self.objects().port());
        let listed = ureq::get(&url).call().and_then(|mut a| a.body_mut().read_to_string());
        listed.unwrap_or_else(|e| panic!("{url}: {e}")).matches("<Key>").count()
    }

    /// The variables of the environment that lead to its artefacts.
    #[must_use]
    pub fn variables(&self) -> &[(String, String)] {
        &self.variables
    }

    /// Makes a token.
    ///
    /// # Panics
    /// If it cannot be made.
    #[must_use]
    pub fn make_token(&self, name: &str, more: &[&str]) -> String {
        let arguments = [&["token", "create", name, "--database", &self.database], more].concat();
        run_gable(&arguments).success().stdout.trim().to_owned()
    }

    /// Takes a token away.
    ///
    /// # Panics
    /// If there is none.
    pub fn revoke(&self, name: &str) {
        let _ = run_gable(&["token", "revoke", name, "--database", &self.database]).success();
        // Whoever asks is answered from memory that is a quarter of a second old at most.
        std::thread::sleep(Duration::from_millis(500));
    }

    /// Sets a variable of the environment of processes that are started from then on.
    pub fn set(&mut self, name: &str, value: &str) {
        self.variables.push((name.to_owned(), value.to_owned()));
    }

    /// The folder of data of its processes of a kind: `serve` or `work`.
    #[must_use]
    pub fn data(&self, kind: &str) -> PathBuf {
        self.folder.path().join(kind)
    }

    fn arguments(&self, command: &str, data: &str, more: &[&str]) -> Vec<String> {
        self.arguments_seeing(&self.root, command, data, more)
    }

    fn arguments_seeing(&self, root: &Path, command: &str, data: &str, more: &[&str]) -> Vec<String> {
        let data = self.data(data).display().to_string();
        let root = root.display().to_string();
        let lease = self.lease.to_string();
        let all = [
            command,
            "--data",
            &data,
            "--database",
            &self.database,
            "--store",
            &self.store,
            "--source-root",
            &root,
            "--lease",
            &lease,
        ];
        all.iter().chain(more).map(|a| (*a).to_owned()).collect()
    }

    /// Starts a coordinator, which is asked with an operator's token from then on. With `--all` it works as well.
    ///
    /// # Panics
    /// If it does not start.
    pub fn serve(&mut self, more: &[&str]) -> Process {
        if self.token.is_empty() {
            self.token = self.token("tests", "operator");
        }
        self.serve_first(more)
    }

    /// Starts a coordinator over whatever tokens there are: it is asked without one, unless one was set.
    ///
    /// # Panics
    /// If it does not start.
    pub fn serve_first(&mut self, more: &[&str]) -> Process {
        let (process, address) = self.coordinator(more);
        self.address = address;
        process
    }

    /// Starts a coordinator; gives its address, too.
    ///
    /// # Panics
    /// If it does not start.
    #[must_use]
    pub fn coordinator(&self, more: &[&str]) -> (Process, String) {
        let more = [&["--listen", "127.0.0.1:0"], more].concat();
        let (process, line) =
            Process::start(&self.arguments("serve", "serve", &more), &self.variables, Some("listening on "));
        (process, line.trim().trim_start_matches("listening on ").to_owned())
    }

    /// Starts a worker with one slot.
    ///
    /// # Panics
    /// If it does not start.
    #[must_use]
    pub fn work(&self, more: &[&str]) -> Process {
        self.work_seeing(&self.root, more)
    }

    /// Starts a worker that sees the meshes below another folder.
    ///
    /// # Panics
    /// If it does not start.
    #[must_use]
    pub fn work_seeing(&self, root: &Path, more: &[&str]) -> Process {
        let slots: &[&str] = if more.contains(&"--slots") { &[] } else { &["--slots", "1"] };
        let arguments = self.arguments_seeing(root, "work", "work", &[slots, more].concat());
        Process::start(&arguments, &self.variables, None).0
    }

    /// Makes a token.
    ///
    /// # Panics
    /// If it cannot be made.
    #[must_use]
    pub fn token(&self, name: &str, scope: &str) -> String {
        let arguments = ["token", "--database", &self.database, "create", name, "--scope", scope];
        run_gable(&arguments).success().stdout.trim().to_owned()
    }

    /// The token with which the coordinator is asked.
    #[must_use]
    pub fn operator(&self) -> &str {
        &self.token
    }

    /// A request that shows the token, if there is one.
    fn shown<B>(&self, request: RequestBuilder<B>) -> RequestBuilder<B> {
        if self.token.is_empty() { request } else { request.header("authorization", format!("Bearer {}", self.token)) }
    }

    /// Where the coordinator is.
    #[must_use]
    pub fn address(&self) -> &str {
        &self.address
    }

    /// A page of the coordinator as text.
    ///
    /// # Panics
    /// If it does not answer well.
    #[must_use]
    pub fn text(&self, path: &str) -> String {
        let url = format!("{}{path}", self.address);
        let mut answer = self.shown(ureq::get(&url)).call().unwrap_or_else(|e| panic!("{url}: {e}"));
        answer.body_mut().read_to_string().expect("text")
    }

    /// Asks the coordinator.
    ///
    /// # Panics
    /// If it does not answer well.
    #[must_use]
    pub fn get(&self, path: &str) -> Value {
        let url = format!("{}/api/v1{path}", self.address);
        let mut answer = self.shown(ureq::get(&url)).call().unwrap_or_else(|e| panic!("{url}: {e}"));
        answer.body_mut().read_json().expect("JSON")
    }

    /// Tells the coordinator.
    ///
    /// # Panics
    /// If it does not answer well.
    pub fn post(&self, path: &str, body: &Value) -> Value {
        let url = format!("{}/api/v1{path}", self.address);
        let mut answer = self.shown(ureq::post(&url)).send_json(body).unwrap_or_else(|e| panic!("{url}: {e}"));
        answer.body_mut().read_json().expect("JSON")
    }

    /// Tells the coordinator how something is to be.
    ///
    /// # Panics
    /// If it does not answer well.
    pub fn put(&self, path: &str, body: &Value) -> Value {
        let url = format!("{}/api/v1{path}", self.address);
        let mut answer = self.shown(ureq::put(&url)).send_json(body).unwrap_or_else(|e| panic!("{url}: {e}"));
        answer.body_mut().read_json().expect("JSON")
    }

    /// Sends the coordinator a file.
    ///
    /// # Panics
    /// If it does not answer well.
    pub fn send(&self, path: &str, content: &[u8]) -> Value {
        let url = format!("{}/api/v1{path}", self.address);
        let mut answer = self.shown(ureq::post(&url)).send(content).unwrap_or_else(|e| panic!("{url}: {e}"));
        answer.body_mut().read_json().expect("JSON")
    }

    /// Puts files into a bucket of their own on the service's S3 server; gives their place. None where they lie in a folder.
    ///
    /// # Panics
    /// If they cannot be put.
    #[must_use]
    pub fn put_objects(&self, test: &str, files: &Files) -> Option<String> {
        let bucket = s3_server::bucket(&format!("{test}-source"))?;
        let name = bucket.place.trim_start_matches("s3://");
        for (path, content) in files {
            let answer = s3_server::put(bucket.port, &format!("{name}/mesh/{path}"), content).expect("it answers");
            assert!(answer.starts_with("HTTP/1.1 200"), "{path}: {answer}");
        }
        Some(format!("{}/mesh", bucket.place))
    }

    /// Submits a job; gives its id.
    ///
    /// # Panics
    /// If it is refused.
    #[must_use]
    pub fn submit(&self, source: &Path, city: &str, parameters: &Value) -> String {
        let body = serde_json::json!({ "source": source, "city": city, "parameters": parameters });
        self.post("/jobs", &body)["id"].as_str().expect("an id").to_owned()
    }

    /// The state of a job.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn state(&self, job: &str) -> String {
        self.get(&format!("/jobs/{job}"))["state"].as_str().expect("a state").to_owned()
    }

    /// Waits until a job is over, and gives its state.
    ///
    /// # Panics
    /// If it is not in time.
    #[must_use]
    pub fn wait(&self, job: &str, limit: Duration) -> String {
        let begin = Instant::now();
        loop {
            let shown = self.get(&format!("/jobs/{job}"));
            if shown["finished"].is_string() {
                return shown["state"].as_str().expect("a state").to_owned();
            }
            assert!(begin.elapsed() < limit, "not over in {limit:?}: {shown}");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Waits until a job has ended in a state.
    ///
    /// # Panics
    /// If it is not in time, or ends in another state.
    pub fn expect(&self, job: &str, state: &str, limit: Duration) {
        let found = self.wait(job, limit);
        let failed: Vec<_> = self.units(job).into_iter().filter(|u| u[2] == "failed").collect();
        assert_eq!(found, state, "{failed:?} {}", self.get(&format!("/jobs/{job}")));
    }

    /// Waits until a job has come to a stage.
    ///
    /// # Panics
    /// If it does not in time.
    pub fn wait_for_stage(&self, job: &str, stages: &[&str], limit: Duration) {
        let begin = Instant::now();
        loop {
            let shown = self.get(&format!("/jobs/{job}"));
            if shown["started"].is_string() && stages.iter().any(|s| shown["stage"] == *s) {
                return;
            }
            assert!(begin.elapsed() < limit && !shown["finished"].is_string(), "never in {stages:?}: {shown}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// All events of a job.
    ///
    /// # Panics
    /// If they cannot be had.
    #[must_use]
    pub fn events(&self, job: &str) -> Vec<Value> {
        let mut all: Vec<Value> = Vec::new();
        loop {
            let page = self.get(&format!("/jobs/{job}/events?since={}&limit=1000", all.len()));
            let page = page.as_array().expect("a list");
            if page.is_empty() {
                return all;
            }
            all.extend(page.iter().cloned());
        }
    }

    /// What changed between two generations of a city, as the database has it: ids, and `added`, `removed` or `changed`.
    ///
    /// # Panics
    /// If it cannot be had.
    #[must_use]
    pub fn changes(&self, city: &str, from: i64, to: i64) -> Vec<(String, String)> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async {
            let store = gable_job_store::Store::connect(&self.database).await.expect("the database opens");
            let changes = store.changes(city, from, to, None, 10_000).await.expect("they can be compared");
            store.close().await;
            let kind = |kind| serde_json::to_value(kind).ok().and_then(|k| k.as_str().map(str::to_owned));
            changes.into_iter().map(|c| (c.id, kind(c.kind).expect("a name"))).collect()
        })
    }

    /// The units of a job: stage, unit, state and reason.
    ///
    /// # Panics
    /// If they cannot be had.
    #[must_use]
    pub fn units(&self, job: &str) -> Vec<[String; 4]> {
        let text = |v: &Value| v.as_str().unwrap_or_default().to_owned();
        let units = self.get(&format!("/jobs/{job}/blocks"));
        let units = units.as_array().expect("a list").iter();
        units.map(|u| [text(&u["stage"]), text(&u["unit"]), text(&u["state"]), text(&u["reason"])]).collect()
    }

    /// The files of a job's result, by name.
    ///
    /// # Panics
    /// If they cannot be had.
    #[must_use]
    pub fn files(&self, job: &str) -> Files {
        let listed = self.get(&format!("/jobs/{job}/files"));
        let names = listed.as_array().expect("a list").iter().map(|f| f["path"].as_str().expect("a path").to_owned());
        names
            .map(|name| {
                let url = format!("{}/api/v1/jobs/{job}/files/{name}", self.address);
                let mut answer = self.shown(ureq::get(&url)).call().unwrap_or_else(|e| panic!("{url}: {e}"));
                (name, answer.body_mut().read_to_vec().expect("its content"))
            })
            .collect()
    }
}

/// All files below a folder, by name.
///
/// # Panics
/// If they cannot be read.
#[must_use]
pub fn files_of(folder: &Path) -> Files {
    let mut files = Files::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).unwrap_or_else(|e| panic!("{}: {e}", next.display())) {
            let path = entry.expect("a readable folder").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below it").to_string_lossy().into_owned();
                files.insert(name, std::fs::read(&path).expect("a readable file"));
            }
        }
    }
    files
}

/// Fails unless two results have the same files with the same bytes. The report tells times, so of it only the rest counts.
///
/// # Panics
/// If they differ.
pub fn same_models(found: &Files, expected: &Files) {
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, bytes) in expected {
        match name.as_str() {
            "report.html" => {}
            "report.json" => assert_eq!(timeless(&found[name]), timeless(bytes)),
            _ => assert!(&found[name] == bytes, "{name} differs"),
        }
    }
}

/// A report without what no two runs have in common.
fn timeless(report: &[u8]) -> Value {
    let mut report: Value = serde_json::from_slice(report).expect("JSON");
    for member in ["stages", "seconds", "peak_memory_bytes", "threads"] {
        report[member] = Value::Null;
    }
    for block in report["blocks"].as_array_mut().expect("blocks") {
        block["seconds"] = Value::Null;
    }
    report
}

/// Stops the tests' Postgres for a while, as a machine that fails would, and starts it again.
///
/// # Panics
/// If it cannot be stopped or started.
pub fn pause_postgres(time: Duration) {
    let programs = postgres::programs().expect("Postgres is installed");
    let control = |arguments: &[&str]| {
        let status = postgres::user(&programs.join("pg_ctl").to_string_lossy())
            .arg("-D")
            .arg(postgres::folder().join("data"))
            .arg("-l")
            .arg(postgres::folder().join("log"))
            .arg("-w")
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        assert!(status.expect("pg_ctl runs").success(), "pg_ctl {arguments:?}");
    };
    let options = std::fs::read_to_string(postgres::folder().join("data/postmaster.opts")).expect("its options");
    let options = options.split_once(' ').map_or("", |(_, rest)| rest.trim()).replace('"', "'");
    control(&["-m", "immediate", "stop"]);
    std::thread::sleep(time);
    control(&["-o", &options, "start"]);
}
