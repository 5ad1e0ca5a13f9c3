//! Workers with children that are small shell scripts.

use gable_files::SourceRoots;
use gable_job_store::{BlobId, Blobs, JobState, NewJob, NewTask, Store, TaskState};
use gable_worker::{Health, Limits, REST, Settings, Worker};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;

struct Town {
    store: Store,
    blobs: Blobs,
    folder: tempfile::TempDir,
}

impl Town {
    async fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Store::connect(&format!("sqlite:{}", folder.path().join("jobs.db").display())).await;
        let blobs = Blobs::in_folder(&folder.path().join("blobs"));
        Self { store: store.expect("SQLite opens"), blobs: blobs.expect("opens"), folder }
    }

    fn worker(&self, name: &str, script: &str, change: impl FnOnce(&mut Settings)) -> Worker {
        let mut settings = Settings {
            id: name.to_owned(),
            host: "here".to_owned(),
            node: name.to_owned(),
            health: Arc::new(Health::default()),
            rest: REST,
            stage_name: |_| "stage",
            roots: SourceRoots::default(),
            program: ["sh", "-c", script].map(Into::into).to_vec(),
            folder: self.folder.path().join(name),
            blobs: self.folder.path().join(name).join("blobs"),
            cache: 1 << 20,
            lease: Duration::from_secs(30),
            limits: Limits { memory: 1 << 30, time: Duration::from_secs(30) },
            pace: Duration::from_millis(20),
            grace: Duration::from_secs(20),
        };
        change(&mut settings);
        Worker::new(self.store.clone(), self.blobs.clone(), settings).expect("a worker")
    }

    async fn submit(&self, max_attempts: i64) -> String {
        let first =
            NewTask { stage: 0, unit: "city".to_owned(), input: "{}".to_owned(), required: false, max_attempts };
        let job = NewJob {
            city: "delft".to_owned(),
            owner: "ann".to_owned(),
            request: r#"{"source":"mesh.obj"}"#.to_owned(),
            tasks: vec![first],
            ..NewJob::default()
        };
        self.store.submit(&job).await.expect("submitted").id
    }

    /// Lets a worker work until the job is over.
    async fn work(&self, worker: &Worker, job: &str) -> JobState {
        let (stop, stopped) = watch::channel(false);
        let over = async {
            loop {
                let state = self.store.job(job).await.expect("the job").state;
                if state.is_over() {
                    stop.send_replace(true);
                    return state;
                }
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        };
        let both = async { tokio::join!(worker.run(stopped), over) };
        let (ran, state) = tokio::time::timeout(Duration::from_secs(60), both).await.expect("in time");
        ran.expect("works");
        state
    }

    async fn reason(&self, job: &str) -> String {
        self.store.tasks(job).await.expect("tasks")[0].reason.clone().expect("a reason")
    }
}

/// No task leaves anything in the worker's folder but blobs.
fn is_tidy(folder: &Path) -> bool {
    std::fs::read_dir(folder).expect("the folder").flatten().all(|e| e.file_name() == "blobs")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn tasks_read_make_and_add() {
    let town = Town::new().await;
    let job = town.submit(3).await;
    let script = r#"
        read order
        case $order in
        *'"stage":0'*)
            mkdir blocks; echo a > blocks/a; echo b > blocks/b; echo "phase: splitting" >&2; echo noise
            echo '{"made":["blocks/a","blocks/b"],"tasks":[
                {"stage":1,"unit":"join","input":{"reads":["blocks/"]},"required":true}]}' | tr -d '\n' ;;
        *) cat blocks/a blocks/b > both; echo '{"made":["both"]}' ;;
        esac"#;
    let worker = town.worker("w", script, |_| {});
    assert_eq!(town.work(&worker, &job).await, JobState::Successful);
    let found = town.store.artifacts(&job, "both").await.expect("artefacts");
    assert_eq!(found[0].blob, BlobId::of(b"a\nb\n"));
    assert_eq!(&town.blobs.get(found[0].blob).await.expect("get")[..], b"a\nb\n");
    assert!(is_tidy(&town.folder.path().join("w")));
    assert_eq!(town.store.workers().await.expect("workers"), [], "it has said that it stopped");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn bad_input_fails_at_once() {
    let town = Town::new().await;
    let job = town.submit(3).await;
    let worker = town.worker("w", "echo 'mesh.obj: line 7: no such vertex' >&2; exit 2", |_| {});
    assert_eq!(town.work(&worker, &job).await, JobState::Partial);
    assert_eq!(town.reason(&job).await, "mesh.obj: line 7: no such vertex");
    assert_eq!(town.store.tasks(&job).await.expect("tasks")[0].attempts, 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_child_that_dies_is_tried_again() {
    let town = Town::new().await;
    let job = town.submit(3).await;
    let marker = town.folder.path().join("died");
    let script = format!("if [ -e {0} ]; then echo '{{\"made\":[]}}'; else : > {0}; kill -9 $$; fi", marker.display());
    let worker = town.worker("w", &script, |_| {});
    assert_eq!(town.work(&worker, &job).await, JobState::Successful);
    assert_eq!(town.store.tasks(&job).await.expect("tasks")[0].attempts, 2);
    let events = town.store.events(&job, 0, 100).await.expect("events");
    assert!(events.iter().any(|e| e.message.as_deref().is_some_and(|m| m.contains("signal: 9"))), "{events:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn limits_are_kept() {
    let town = Town::new().await;
    for (script, limits, reason) in [
        (
            "exec sleep 60",
            Limits { memory: 1 << 30, time: Duration::from_millis(300) },
            "took longer than the limit of 0.3 s",
        ),
        // What the child has started holds its pipes open, and has to go with it.
        (
            "sleep 61 & wait",
            Limits { memory: 1 << 30, time: Duration::from_millis(300) },
            "took longer than the limit of 0.3 s",
        ),
        (
            "x=$(head -c 40000000 /dev/zero | tr '\\0' x); sleep 60",
            Limits { memory: 20 << 20, time: Duration::from_secs(30) },
            "more than the limit of 20 MB",
        ),
    ] {
        let job = town.submit(1).await;
        let worker = town.worker("w", script, |s| s.limits = limits);
        let begin = std::time::Instant::now();
        assert_eq!(town.work(&worker, &job).await, JobState::Partial);
        assert!(begin.elapsed() < Duration::from_secs(30), "{script} was waited for: {:?}", begin.elapsed());
        let told = town.reason(&job).await;
        assert!(told.contains(reason), "{told}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn reports_that_cannot_be_are_refused() {
    let town = Town::new().await;
    for (script, reason) in [
        ("echo done", "its report cannot be read"),
        ("true", "its report cannot be read"),
        (r#"echo '{"made":["../../jobs.db"]}'"#, "outside of the task's folder"),
        (r#"echo '{"made":["none"]}'"#, "No such file"),
    ] {
        let job = town.submit(1).await;
        let worker = town.worker("w", script, |_| {});
        assert_eq!(town.work(&worker, &job).await, JobState::Partial);
        let told = town.reason(&job).await;
        assert!(told.contains(reason), "{told}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cancelled_task_is_killed() {
    let town = Town::new().await;
    let job = town.submit(3).await;
    let marker = town.folder.path().join("pid");
    let script = format!("echo $$ > {}; exec sleep 60", marker.display());
    let worker = town.worker("w", &script, |s| s.lease = Duration::from_millis(300));
    let cancel = async {
        while std::fs::read_to_string(&marker).map_or(true, |t| !t.ends_with('\n')) {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        town.store.cancel(&job).await.expect("cancels");
    };
    let (state, ()) = tokio::join!(town.work(&worker, &job), cancel);
    assert_eq!(state, JobState::Cancelled);
    let pid = std::fs::read_to_string(&marker).expect("a number");
    assert!(!Path::new(&format!("/proc/{}", pid.trim())).exists(), "the child is gone");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_worker_that_stops_hands_its_task_back() {
    let town = Town::new().await;
    let job = town.submit(3).await;
    let slow = town.worker("slow", "exec sleep 60", |s| s.grace = Duration::from_millis(100));
    let (stop, stopped) = watch::channel(false);
    let told = async {
        while town.store.tasks(&job).await.expect("tasks")[0].state != TaskState::Running {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        stop.send_replace(true);
    };
    let (ran, ()) = tokio::join!(slow.run(stopped), told);
    ran.expect("stops well");
    let task = &town.store.tasks(&job).await.expect("tasks")[0];
    assert_eq!((task.state, task.attempts), (TaskState::Ready, 0));
    let quick = town.worker("quick", "echo '{\"made\":[]}'", |_| {});
    assert_eq!(town.work(&quick, &job).await, JobState::Successful);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_program_that_is_not_there_ends_the_worker() {
    let town = Town::new().await;
    town.submit(3).await;
    let worker = town.worker("w", "", |s| s.program = vec!["/no/such/program".into()]);
    let (_stop, stopped) = watch::channel(false);
    let error = worker.run(stopped).await.expect_err("it cannot work");
    assert!(error.to_string().starts_with("/no/such/program cannot be started"), "{error}");
}
