//! Requests to the API: a line with method and path, then the body. No request makes the service fail.
#![no_main]

use axum::Router;
use axum::body::Body;
use axum::http::{Request, StatusCode};
use gable_coordinator::{Coordinator, Limits, router};
use gable_files::SourceRoots;
use gable_fuzz::Folder;
use gable_job_store::{Blobs, Store};
use libfuzzer_sys::fuzz_target;
use std::sync::{LazyLock, Mutex};
use tokio::runtime::{Builder, Runtime};
use tower::ServiceExt as _;

struct Service {
    runtime: Runtime,
    router: Router,
    // Gone when the process ends.
    _folder: Folder,
}

static SERVICE: LazyLock<Mutex<Service>> = LazyLock::new(|| {
    let folder = Folder::default();
    let root = folder.path().join("meshes");
    std::fs::create_dir(&root).expect("made");
    std::fs::write(root.join("mesh.obj"), "v 0 0 0\n").expect("written");
    let runtime = Builder::new_current_thread().enable_all().build().expect("a runtime");
    let address = format!("sqlite:{}", folder.path().join("jobs.db").display());
    let store = runtime.block_on(Store::connect(&address)).expect("SQLite opens");
    let blobs = Blobs::in_folder(&folder.path().join("blobs")).expect("opens");
    let roots = SourceRoots::new([root], []).expect("the root");
    let mut coordinator = Coordinator::new(store, blobs, roots, Limits::default());
    coordinator.open = true;
    Mutex::new(Service { router: router(coordinator), runtime, _folder: folder })
});

fuzz_target!(|data: &[u8]| {
    let end = data.iter().position(|b| *b == b'\n').unwrap_or(data.len());
    let (line, body) = data.split_at(end);
    let Some((method, path)) = std::str::from_utf8(line).ok().and_then(|line| line.split_once(' ')) else { return };
    let request = Request::builder()
        .method(method)
        .uri(path)
        .header("host", "localhost")
        .header("content-type", "application/json")
        .header("idempotency-key", "k")
        .body(Body::from(body.get(1..).unwrap_or_default().to_vec()));
    let Ok(request) = request else { return };
    // A stream of events does not end.
    if path.contains("/stream") {
        return;
    }
    let service = SERVICE.lock().expect("one at a time");
    let answer = service.runtime.block_on(async {
        let answer = service.router.clone().oneshot(request).await.expect("the router answers");
        let status = answer.status();
        let body = axum::body::to_bytes(answer.into_body(), 64 << 20).await;
        (status, body)
    });
    assert_ne!(answer.0, StatusCode::INTERNAL_SERVER_ERROR, "{:?}", answer.1);
});
