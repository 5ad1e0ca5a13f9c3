//! Workers that are broken, see too little, or have no disk, beside those that do well; and services that cannot begin.

use gable_tests::{Database, Process, Service, run_gable, signal, skip, town};
use serde_json::{Value, json};
use std::io::{Read as _, Write as _};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(180);

fn mesh() -> PathBuf {
    town(2, 0.01).join("mesh")
}

fn parameters(side: u32) -> Value {
    json!({ "sampling.step": 0.5, "grid.columns": side, "grid.rows": side, "output.report": false })
}

/// A program that starts each task, and dies at all but the first of a job.
fn dying(folder: &Path) -> PathBuf {
    let path = folder.join("dying.sh");
    let script = "#!/bin/bash\nIFS= read -r order\necho 'its memory is broken' >&2\nkill -ABRT $$\n";
    std::fs::write(&path, script).unwrap();
    std::fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    path
}

/// What is so in time.
fn until(what: &str, mut is: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !is() {
        assert!(begin.elapsed() < Duration::from_secs(60), "never: {what}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// What the workers say is wrong with them.
fn troubles(service: &Service) -> Vec<String> {
    let workers = service.get("/workers");
    let workers = workers.as_array().expect("a list").iter();
    workers.filter_map(|w| w["trouble"].as_str().map(str::to_owned)).collect()
}

fn a_broken_node_ruins_no_job(database: Database) {
    let Some(mut service) = Service::new("a_broken_node", database, &mesh(), 5.0) else { return };
    let folder = tempfile::tempdir().unwrap();
    let _coordinator = service.serve(&[]);
    let wrapper = dying(folder.path());
    let broken = service.work(&["--slots", "2", "--task-wrapper", wrapper.to_str().unwrap()]);
    let _sound = service.work(&[]);
    until("both are there", || service.get("/workers").as_array().map(Vec::len) == Some(3));
    let job = service.submit(&mesh(), "delft", &parameters(6));
    service.expect(&job, "successful", LIMIT);
    // It stops, and says so, where people look.
    until("it says so", || troubles(&service).iter().any(|t| t.contains("different tasks failed here in a row")));
    assert!(troubles(&service).iter().all(|t| t.contains("its memory is broken")), "{:?}", troubles(&service));
    assert!(broken.log().contains("takes no more tasks"), "{}", broken.log());
    let failed = service.events(&job).iter().filter(|e| e["kind"] == "retry").count();
    assert!((5..=16).contains(&failed), "{failed} attempts of the broken node");
    let figures = service.text("/metrics");
    assert!(figures.contains("gable_workers_in_trouble 2"), "{figures}");
}

fn a_worker_that_does_not_see_the_source_leaves_it_to_others(database: Database) {
    let Some(mut service) = Service::new("not_seen", database, &mesh(), 5.0) else { return };
    let elsewhere = tempfile::tempdir().unwrap();
    let _coordinator = service.serve(&[]);
    let blind = service.work_seeing(elsewhere.path(), &[]);
    until("it is there", || service.get("/workers").as_array().map(Vec::len) == Some(1));
    let job = service.submit(&mesh(), "delft", &parameters(2));
    until("it leaves it", || service.events(&job).iter().any(|e| e["kind"] == "retry"));
    let waiting = service.units(&job);
    assert!(waiting[0][2] == "ready" && waiting[0][3].contains("--source-root"), "{waiting:?}");
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(service.events(&job).iter().filter(|e| e["kind"] == "retry").count(), 1, "it is not offered again");
    let _seeing = service.work(&[]);
    service.expect(&job, "successful", LIMIT);
    drop(blind);
}

mod sqlite {
    #[test]
    fn a_broken_node_ruins_no_job() {
        super::a_broken_node_ruins_no_job(super::Database::Sqlite);
    }

    #[test]
    fn a_worker_that_does_not_see_the_source_leaves_it_to_others() {
        super::a_worker_that_does_not_see_the_source_leaves_it_to_others(super::Database::Sqlite);
    }
}

mod on_postgres {
    #[test]
    fn a_broken_node_ruins_no_job() {
        super::a_broken_node_ruins_no_job(super::Database::Postgres);
    }

    #[test]
    fn a_worker_that_does_not_see_the_source_leaves_it_to_others() {
        super::a_worker_that_does_not_see_the_source_leaves_it_to_others(super::Database::Postgres);
    }
}

/// A disk of some size at a folder, as long as it lives.
struct Disk(PathBuf);

impl Disk {
    fn new(folder: &Path, size: &str) -> Option<Self> {
        std::fs::create_dir_all(folder).unwrap();
        let size = format!("size={size}");
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(folder).output();
        let mounted = mounted.is_ok_and(|o| o.status.success());
        mounted.then(|| Self(folder.to_owned()))
    }

    fn grow(&self, size: &str) {
        let grown = Command::new("mount").args(["-o", &format!("remount,size={size}")]).arg(&self.0).status();
        assert!(grown.unwrap().success());
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_is_told_and_waited_for() {
    const TEST: &str = "a_full_disk_is_told_and_waited_for";
    let mut service = Service::new("full_disk", Database::Sqlite, &mesh(), 5.0).unwrap();
    let Some(disk) = Disk::new(&service.data("work"), "200k") else {
        return skip(TEST, "a file system cannot be mounted here");
    };
    let _coordinator = service.serve(&[]);
    let worker = service.work(&[]);
    let job = service.submit(&mesh(), "delft", &parameters(2));
    let told = || service.events(&job).iter().any(|e| e["message"].as_str().is_some_and(|m| m.contains("os error 28")));
    until("the job says so", told);
    until("the worker says so", || troubles(&service).iter().any(|t| t.contains("cannot be written")));
    assert_eq!(service.state(&job), "running");
    disk.grow("2g");
    service.expect(&job, "successful", LIMIT);
    until("nothing is wrong any more", || troubles(&service).is_empty());
    assert!(worker.log().contains("takes tasks"), "{}", worker.log());
    drop(worker);
}

#[test]
fn what_cannot_be_written_is_not_ready() {
    const TEST: &str = "what_cannot_be_written_is_not_ready";
    let mut service = Service::new("not_ready", Database::Sqlite, &mesh(), 5.0).unwrap();
    let Some(disk) = Disk::new(&service.data("serve"), "1m") else {
        return skip(TEST, "a file system cannot be mounted here");
    };
    let _coordinator = service.serve(&[]);
    assert_eq!(service.text("/readyz"), "ok\n");
    let full = std::fs::write(service.data("serve").join("filler"), vec![1; 2 << 20]);
    assert!(full.is_err());
    std::thread::sleep(Duration::from_millis(2500));
    let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
    let mut answer = agent.get(format!("{}/readyz", service.address())).call().unwrap();
    let problem: Value = answer.body_mut().read_json().unwrap();
    assert_eq!(answer.status().as_u16(), 503, "{problem}");
    assert!(problem["detail"].as_str().unwrap().contains("--data"), "{problem}");
    disk.grow("8m");
    std::thread::sleep(Duration::from_millis(2500));
    assert_eq!(service.text("/readyz"), "ok\n");
}

/// A server that answers everything with 403; gives its address.
fn refusing() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let mut stream = stream;
            let mut head = [0; 4096];
            let _ = stream.read(&mut head);
            let _ = stream.write_all(b"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
        }
    });
    address
}

#[test]
fn keys_that_are_missing_or_wrong_are_named_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
    let start = |variables: &[(&str, &str)]| {
        let begin = Instant::now();
        let mut command = Command::new(gable_tests::gable());
        command.args([
            "serve",
            "--listen",
            "127.0.0.1:0",
            "--data",
            data,
            "--source-root",
            data,
            "--store",
            "s3://b/p",
        ]);
        for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("AWS_")) {
            command.env_remove(name);
        }
        let output = command.envs(variables.iter().copied()).output().unwrap();
        assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
        assert!(!output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let none = start(&[]);
    assert!(none.contains("AWS_ACCESS_KEY_ID") && none.lines().count() < 5, "{none}");
    let half = start(&[("AWS_ACCESS_KEY_ID", "k")]);
    assert!(half.contains("AWS_SECRET_ACCESS_KEY is not set"), "{half}");
    let refusing = refusing();
    let keys = [("AWS_ACCESS_KEY_ID", "k"), ("AWS_SECRET_ACCESS_KEY", "s"), ("AWS_ENDPOINT_URL", refusing.as_str())];
    let wrong = start(&keys);
    assert!(wrong.contains("refuses the keys") && wrong.contains("s3://b/p"), "{wrong}");
}

#[test]
fn a_service_that_waits_for_what_it_stands_on_is_stopped_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().to_str().unwrap();
    // Nobody listens there.
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let database = format!("postgres://gable@127.0.0.1:{port}/gable");
    for command in ["serve", "work"] {
        let mut process = Process::of(&[command, "--data", data, "--source-root", data, "--database", &database]);
        until("it waits", || process.log().contains("waiting for the database"));
        signal(process.id(), "TERM");
        assert_eq!(process.wait(Duration::from_secs(5)), Some(0), "{}", process.log());
    }
    let unknown = run_gable(&["work", "--data", data, "--source-root", data, "--store", "gs://b"]);
    assert_eq!(unknown.code, 2, "{}", unknown.stderr);
}
