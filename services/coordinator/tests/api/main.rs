//! The API over real HTTP.

use gable_coordinator::{Coordinator, Limits, NewToken, Patience, Places, create_token, document, router};
use gable_files::SourceRoots;
use gable_job_store::{Artifact, Blobs, Claim, Finished, Retry, Scope, Store};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::{Duration, Instant};

mod browsers;
mod cities;
mod floods;
mod links;
mod ogc;
mod parts;
mod provider;
mod proxies;
mod schedules;
mod security;
mod sign_in;
mod tenants;
mod webhooks;

/// A service with an empty database, and the worker's side of it.
struct Service {
    address: String,
    parts: Coordinator,
    folder: Arc<tempfile::TempDir>,
}

async fn start() -> Service {
    start_with(Limits { body: 10_000, time: Duration::from_secs(20), page: 50, ..Limits::default() }).await
}

async fn start_with(limits: Limits) -> Service {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("meshes");
    std::fs::create_dir(&root).expect("made");
    std::fs::write(root.join("mesh.obj"), "v 0 0 0\n").expect("written");
    start_in(Arc::new(folder), limits).await
}

/// A coordinator over what is in a folder.
async fn start_in(folder: Arc<tempfile::TempDir>, limits: Limits) -> Service {
    let base = folder.path().canonicalize().expect("absolute");
    let root = base.join("meshes");
    let store = Store::connect(&format!("sqlite:{}", base.join("jobs.db").display())).await.expect("SQLite opens");
    let blobs = Blobs::in_folder(&base.join("blobs")).expect("opens");
    // Most tests are about something else than tokens.
    let mut parts = Coordinator::new(store, blobs, SourceRoots::new([root], []).expect("the root"), limits);
    parts.open = true;
    let address = serve(&parts).await;
    Service { address, parts, folder }
}

/// Serves; gives the address.
async fn serve(parts: &Coordinator) -> String {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let address = format!("http://{}", listener.local_addr().expect("an address"));
    let app = router(parts.clone());
    tokio::spawn(gable_coordinator::serve(
        listener,
        app,
        Patience::default(),
        Places::default(),
        std::future::pending(),
    ));
    address
}

/// An answer: status, headers, body.
struct Answer {
    status: u16,
    headers: ureq::http::HeaderMap,
    body: Vec<u8>,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&self.body)))
    }

    fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", |v| v.to_str().expect("text"))
    }

    /// The problem that it tells.
    fn problem(&self, status: u16, kind: &str) -> String {
        let told = self.json();
        assert_eq!(self.status, status, "{told}");
        assert_eq!(self.header("content-type"), "application/problem+json");
        assert_eq!((&told["type"], &told["status"]), (&json!(kind), &json!(status)));
        told["detail"].as_str().expect("a detail").to_owned()
    }
}

impl Service {
    /// The same once more, with what its parts are now.
    async fn again(self) -> Self {
        Self { address: serve(&self.parts).await, ..self }
    }

    async fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: Option<String>) -> Answer {
        let mut request = ureq::http::Request::builder().method(method).uri(format!("{}{path}", self.address));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let request = request.body(body.unwrap_or_default()).expect("a request");
        tokio::task::spawn_blocking(move || {
            let agent: ureq::Agent = ureq::Agent::config_builder()
                .http_status_as_error(false)
                .allow_non_standard_methods(true)
                .max_redirects(0)
                .max_redirects_will_error(false)
                .timeout_global(Some(Duration::from_secs(30)))
                .build()
                .into();
            let mut response = agent.run(request).expect("an answer");
            Answer {
                status: response.status().as_u16(),
                headers: response.headers().clone(),
                body: response.body_mut().read_to_vec().expect("a body"),
            }
        })
        .await
        .expect("the client ends")
    }

    async fn get(&self, path: &str) -> Answer {
        self.ask("GET", path, &[], None).await
    }

    async fn post(&self, path: &str) -> Answer {
        self.ask("POST", path, &[], None).await
    }

    async fn submit(&self, body: &Value, headers: &[(&str, &str)]) -> Answer {
        let mut all = vec![("content-type", "application/json")];
        all.extend(headers);
        self.ask("POST", "/api/v1/jobs", &all, Some(body.to_string())).await
    }

    async fn new_job(&self) -> String {
        let answer = self.submit(&json!({ "source": "mesh.obj", "city": "delft" }), &[]).await;
        assert_eq!(answer.status, 201, "{}", answer.json());
        answer.json()["id"].as_str().expect("an id").to_owned()
    }

    async fn claim(&self) -> Claim {
        self.parts.store.claim("w", Duration::from_secs(60)).await.expect("claims").expect("a task")
    }

    async fn finish_next(&self, result: Finished) {
        let held = self.claim().await;
        self.parts.store.finish(&held, &result).await.expect("finishes");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_job_is_submitted_watched_and_fetched() {
    let service = start().await;
    let request = json!({ "source": "mesh.obj", "city": "delft", "preset": "fast", "priority": 3,
        "parameters": { "grid.columns": 4, "output.report": false, "sampling.step": "0.25" } });
    let made = service.submit(&request, &[]).await;
    assert_eq!(made.status, 201, "{}", made.json());
    let job = made.json();
    let (id, place) = (job["id"].as_str().expect("an id"), made.header("location").to_owned());
    assert_eq!(place, format!("/api/v1/jobs/{id}"));
    assert_eq!(
        (&job["state"], &job["owner"], &job["source"]),
        (&json!("accepted"), &json!("local"), &json!("mesh.obj"))
    );
    let shown = service.get(&place).await;
    assert_eq!(shown.json()["request"], request);
    assert_eq!(
        shown.json()["progress"],
        json!([{ "stage": "split", "ready": 1, "running": 0, "done": 0, "failed": 0, "cancelled": 0 }])
    );
    let tag = shown.header("etag").to_owned();
    assert_eq!(service.ask("GET", &place, &[("if-none-match", &tag)], None).await.status, 304);
    let content = b"{\"type\":\"CityJSON\"}".to_vec();
    let blob = service.parts.blobs.put(content.clone()).await.expect("put");
    let file = |path: &str| Artifact { path: path.to_owned(), blob, bytes: content.len() as u64 };
    let artifacts = vec![file("result/tiles/0_0.city.json"), file("blocks/0_0.block")];
    service.finish_next(Finished { artifacts, ..Finished::default() }).await;
    let begin = Instant::now();
    while service.ask("GET", &place, &[("if-none-match", &tag)], None).await.status == 304 {
        assert!(begin.elapsed() < Duration::from_secs(1), "what a worker did is not told");
    }
    let done = service.get(&place).await.json();
    assert_eq!((&done["state"], &done["progress"][0]["done"]), (&json!("successful"), &json!(1)));
    let blocks = service.get(&format!("{place}/blocks")).await;
    assert_eq!((&blocks.json()[0]["unit"], &blocks.json()[0]["worker"]), (&json!("scene"), &json!("w")));
    assert!(blocks.json()[0]["seconds"].as_f64().expect("seconds") >= 0.0);
    let again = service.ask("GET", &format!("{place}/blocks"), &[("if-none-match", blocks.header("etag"))], None).await;
    assert_eq!(again.status, 304);
    let no_log = service.get(&format!("{place}/blocks/scene/log")).await.problem(404, "not-found");
    assert!(no_log.contains("scene"), "{no_log}");
    service.get("/api/v1/jobs/nobody/blocks/scene/log").await.problem(404, "not-found");
    let files = service.get(&format!("{place}/files")).await.json();
    assert_eq!(files, json!([{ "path": "tiles/0_0.city.json", "bytes": content.len(), "hash": blob.to_string() }]));
    let address = format!("{place}/files/tiles/0_0.city.json");
    let whole = service.get(&address).await;
    assert_eq!((whole.status, &whole.body, whole.header("content-type")), (200, &content, "application/json"));
    let part = service.ask("GET", &address, &[("range", "bytes=2-5")], None).await;
    assert_eq!((part.status, &part.body[..]), (206, &content[2..=5]));
    assert_eq!(part.header("content-range"), format!("bytes 2-5/{}", content.len()));
    let known = service.ask("GET", &address, &[("if-none-match", whole.header("etag"))], None).await;
    assert_eq!(known.status, 304);
    let outside = service.ask("GET", &address, &[("range", "bytes=99-")], None).await;
    assert_eq!(outside.problem(416, "range"), format!("the file has {} bytes", content.len()));
    let packed = service.ask("GET", "/api/v1/openapi.json", &[("accept-encoding", "gzip")], None).await;
    assert_eq!((packed.header("content-encoding"), &packed.body[..2]), ("gzip", &[0x1f, 0x8b][..]));
    service.get(&format!("{place}/files/blocks/0_0.block")).await.problem(404, "not-found");
    service.get(&format!("{place}/files/../blocks/0_0.block")).await.problem(404, "not-found");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_coordinator_soon_tells_what_another_did_and_never_goes_back() {
    let one = start().await;
    let two = start_in(Arc::clone(&one.folder), Limits::default()).await;
    let id = one.new_job().await;
    for place in [format!("/api/v1/jobs/{id}"), format!("/api/v1/jobs/{id}/blocks")] {
        let poll =
            async |service: &Service, tag: &str| service.ask("GET", &place, &[("if-none-match", tag)], None).await;
        let old = one.get(&place).await.header("etag").to_owned();
        assert_eq!(poll(&one, &old).await.status, 304);
        assert_eq!(two.post(&format!("/api/v1/jobs/{id}/pause")).await.status, 200);
        let new = two.get(&place).await.header("etag").to_owned();
        assert_ne!(new, old);
        assert_eq!(poll(&one, &new).await.status, 304, "it is not told less than it knows");
        assert_eq!(poll(&two, &new).await.status, 304);
        assert_eq!(one.post(&format!("/api/v1/jobs/{id}/resume")).await.status, 200);
        assert_eq!(poll(&one, &new).await.status, 200, "what a coordinator did itself it tells at once");
        let begin = Instant::now();
        while poll(&two, &new).await.status == 304 {
            assert!(begin.elapsed() < Duration::from_secs(1), "what the other did is not told");
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_does_not_hold_is_refused_with_a_reason() {
    let service = start().await;
    let refused = async |body: Value| service.submit(&body, &[]).await.problem(422, "invalid");
    let unseen = async |source: &str| {
        service.submit(&json!({ "source": source, "city": "a" }), &[]).await.problem(422, "source")
    };
    let outside = unseen("../jobs.db").await;
    assert_eq!(
        outside,
        "source \"../jobs.db\" is not a file or folder under a source root of this service: put the mesh there, \
         upload it, or start the service with --source-root FOLDER or s3://BUCKET/PREFIX"
    );
    assert!(unseen("/etc/passwd").await.contains("source root"));
    assert!(refused(json!({ "source": "mesh.obj", "city": " " })).await.contains("city has to be a name"));
    let wrong = refused(json!({ "source": "mesh.obj", "city": "a", "parameters": { "sampling.stp": 0.2 } })).await;
    assert!(wrong.contains("did you mean \"sampling.step\"?"), "{wrong}");
    let range = refused(json!({ "source": "mesh.obj", "city": "a", "parameters": { "sampling.step": -1 } })).await;
    assert!(range.contains("out of range"), "{range}");
    let threads =
        refused(json!({ "source": "mesh.obj", "city": "a", "parameters": { "resources.threads": 64 } })).await;
    assert!(threads.contains("for the workers to say"), "{threads}");
    let file = json!({ "source": "mesh.obj", "city": "a", "parameters": { "segmentation.weights": "/etc/passwd" } });
    assert!(refused(file).await.contains("source root"));
    assert!(refused(json!({ "source": "mesh.obj", "city": "a", "preset": "quick" })).await.contains("no preset"));
    let colour =
        service.submit(&json!({ "source": "mesh.obj", "city": "a", "colour": 1 }), &[]).await.problem(422, "body");
    assert!(colour.contains("unknown field `colour`"), "{colour}");
    let text = service.ask("POST", "/api/v1/jobs", &[("content-type", "application/json")], Some("{".to_owned())).await;
    text.problem(400, "body");
    service.ask("POST", "/api/v1/jobs", &[], Some("{}".to_owned())).await.problem(415, "body");
    let giant = json!({ "source": "m".repeat(20_000), "city": "a" });
    assert_eq!(service.submit(&giant, &[]).await.status, 413);
    service.get("/api/v1/jobs/none").await.problem(404, "not-found");
    service.get("/api/v1/jobs?limit=51").await.problem(400, "query");
    service.get("/api/v1/jobs?state=broken").await.problem(400, "query");
    service.get("/nowhere").await.problem(404, "not-found");
    service.ask("DELETE", "/api/v1/jobs", &[], None).await.problem(405, "method");
    assert_eq!(service.get("/api/v1/jobs").await.json(), json!({ "jobs": [] }), "nothing was taken in");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn jobs_are_steered() {
    let service = start().await;
    let id = service.new_job().await;
    let steer = async |what: &str| service.post(&format!("/api/v1/jobs/{id}/{what}")).await;
    assert_eq!(steer("pause").await.json()["state"], "paused");
    assert_eq!(steer("pause").await.problem(409, "state"), format!("job {id} is paused: to pause it is not possible"));
    assert_eq!(steer("resume").await.json()["state"], "running");
    let raised = service
        .ask(
            "PUT",
            &format!("/api/v1/jobs/{id}/priority"),
            &[("content-type", "application/json")],
            Some("{\"priority\":9}".to_owned()),
        )
        .await;
    assert_eq!(raised.json()["priority"], 9);
    let held = service.claim().await;
    service.parts.store.keep_log(&held, "    0.1 s  <script>\n").await.expect("kept");
    service.parts.store.fail(&held, "mesh.obj: line 1: no faces", Retry::Never).await.expect("fails");
    let said = service.get(&format!("/api/v1/jobs/{id}/blocks/scene/log")).await;
    assert_eq!((said.status, said.header("content-type")), (200, "text/plain; charset=utf-8"));
    assert_eq!(String::from_utf8_lossy(&said.body), "split, attempt 1\n    0.1 s  <script>\n");
    let failed = service.get(&format!("/api/v1/jobs/{id}")).await.json();
    assert_eq!((&failed["state"], &failed["reason"]), (&json!("failed"), &json!("mesh.obj: line 1: no faces")));
    assert_eq!(steer("retry").await.json()["state"], "running");
    assert_eq!(steer("cancel").await.json()["state"], "cancelled");
    steer("retry").await.problem(409, "state");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_repeated_submission_gives_the_same_job() {
    let service = start().await;
    let request = json!({ "source": "mesh.obj", "city": "delft" });
    let first = service.submit(&request, &[("idempotency-key", "k")]).await;
    let again = service.submit(&request, &[("idempotency-key", "k")]).await;
    assert_eq!((first.status, again.status), (201, 200));
    assert_eq!(first.json()["id"], again.json()["id"]);
    let other = service.submit(&json!({ "source": "mesh.obj", "city": "hague" }), &[("idempotency-key", "k")]).await;
    other.problem(409, "key-reused");
    let long = "k".repeat(201);
    service.submit(&request, &[("idempotency-key", &long)]).await.problem(422, "invalid");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn lists_go_page_by_page() {
    let service = start().await;
    let mut ids = Vec::new();
    for _ in 0..5 {
        ids.push(service.new_job().await);
    }
    ids.reverse();
    let mut found = Vec::new();
    let mut next = String::new();
    for _ in 0..3 {
        let page = service.get(&format!("/api/v1/jobs?limit=2&state=accepted&city=delft{next}")).await.json();
        found
            .extend(page["jobs"].as_array().expect("jobs").iter().map(|j| j["id"].as_str().expect("an id").to_owned()));
        next = page["next"].as_str().map_or_else(String::new, |id| format!("&before={id}"));
    }
    assert_eq!((found, &*next), (ids, ""));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn events_are_polled_and_streamed() {
    let service = start().await;
    let id = service.new_job().await;
    let address = format!("{}/api/v1/jobs/{id}/events/stream", service.address);
    let follower = tokio::task::spawn_blocking(move || {
        let mut response = ureq::get(&address).header("last-event-id", "1").call().expect("a stream");
        response.body_mut().read_to_string().expect("it ends with the job")
    });
    tokio::time::sleep(Duration::from_millis(300)).await;
    service.finish_next(Finished::default()).await;
    let text =
        tokio::time::timeout(Duration::from_secs(20), follower).await.expect("in time").expect("the client ends");
    let kinds: Vec<&str> = text.lines().filter_map(|l| l.strip_prefix("event: ")).collect();
    assert_eq!(kinds, ["state", "claimed", "done", "state"], "{text}");
    let numbers: Vec<&str> = text.lines().filter_map(|l| l.strip_prefix("id: ")).collect();
    assert_eq!(numbers, ["2", "3", "4", "5"]);
    let polled = service.get(&format!("/api/v1/jobs/{id}/events?since=3&limit=1")).await.json();
    assert_eq!(
        (&polled[0]["number"], &polled[0]["kind"], &polled[0]["unit"]),
        (&json!(4), &json!("done"), &json!("scene"))
    );
    assert_eq!(polled.as_array().expect("a list").len(), 1);
    service.get(&format!("/api/v1/jobs/{id}/events?since=-1")).await.problem(400, "query");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn tokens_close_the_service() {
    let service = start().await;
    let token = async |name: &str, scope, max_jobs| {
        let new = NewToken { name: name.to_owned(), scope, groups: Vec::new(), max_jobs, expires: None };
        format!("Bearer {}", create_token(&service.parts.store, &new).await.expect("made").expect("the name is free"))
    };
    let ann = token("ann", Scope::Submitter, Some(1)).await;
    let bob = token("bob", Scope::Submitter, None).await;
    let view = token("view", Scope::Viewer, None).await;
    let root = token("root", Scope::Operator, None).await;
    service.get("/api/v1/jobs").await.problem(401, "unauthorised");
    let wrong = service.ask("GET", "/api/v1/jobs", &[("authorization", "Bearer gable_0")], None).await;
    assert_eq!(wrong.header("www-authenticate"), "Bearer");
    wrong.problem(401, "unauthorised");
    assert_eq!(service.get("/healthz").await.status, 200, "for supervisors");
    assert_eq!(service.ask("GET", "/api/v1/jobs", &[("authorization", &view)], None).await.status, 200);
    let request = json!({ "source": "mesh.obj", "city": "delft" });
    service.submit(&request, &[("authorization", &view)]).await.problem(403, "forbidden");
    let made = service.submit(&request, &[("authorization", &ann)]).await;
    assert_eq!((made.status, &made.json()["owner"]), (201, &json!("ann")));
    let quota = service.submit(&request, &[("authorization", &ann)]).await.problem(429, "quota");
    assert_eq!(quota, "ann may have 1 jobs under way: wait for one, or cancel one");
    let cancel = format!("{}/cancel", made.header("location"));
    service.ask("POST", &cancel, &[("authorization", &view)], None).await.problem(404, "not-found");
    service.ask("POST", &cancel, &[("authorization", &bob)], None).await.problem(404, "not-found");
    assert_eq!(service.ask("POST", &cancel, &[("authorization", &root)], None).await.status, 200);
    assert_eq!(service.submit(&request, &[("authorization", &ann)]).await.status, 201, "the quota is free again");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_that_is_taken_away_ends_at_once_for_doing_and_soon_for_looking() {
    let one = start().await;
    let two = start_in(Arc::clone(&one.folder), Limits::default()).await;
    let store = &two.parts.store;
    let token = async |name: &str| {
        let new = NewToken {
            name: name.to_owned(),
            scope: Scope::Operator,
            groups: Vec::new(),
            max_jobs: None,
            expires: None,
        };
        format!("Bearer {}", create_token(store, &new).await.expect("made").expect("the name is free"))
    };
    let (ann, _) = (token("ann").await, token("root").await);
    let id = one.submit(&json!({ "source": "mesh.obj", "city": "delft" }), &[("authorization", &ann)]).await.json();
    let place = format!("/api/v1/jobs/{}", id["id"].as_str().expect("an id"));
    let look = async || one.ask("GET", &place, &[("authorization", &ann)], None).await.status;
    assert_eq!(look().await, 200);
    assert!(store.remove_token("ann").await.expect("removed"));
    let cancel = one.ask("POST", &format!("{place}/cancel"), &[("authorization", &ann)], None).await;
    cancel.problem(401, "unauthorised");
    let begin = Instant::now();
    while look().await == 200 {
        assert!(begin.elapsed() < Duration::from_secs(1), "a token that is taken away still opens");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_quota_holds_for_submissions_at_once() {
    let service = start().await;
    let new = NewToken {
        name: "ann".to_owned(),
        scope: Scope::Submitter,
        groups: Vec::new(),
        max_jobs: Some(3),
        expires: None,
    };
    let token = create_token(&service.parts.store, &new).await.expect("made").expect("the name is free");
    let token = format!("Bearer {token}");
    let request = json!({ "source": "mesh.obj", "city": "delft" });
    let header = [("authorization", &*token)];
    let all = futures_util::future::join_all((0..20).map(|_| service.submit(&request, &header))).await;
    let with = |status: u16| all.iter().filter(|a| a.status == status).count();
    assert_eq!((with(201), with(429)), (3, 17), "{:?}", all.iter().map(|a| a.status).collect::<Vec<_>>());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pages_of_other_sites_cannot_reach_an_open_service() {
    let service = start().await;
    let id = service.new_job().await;
    let cancel = format!("/api/v1/jobs/{id}/cancel");
    service.ask("POST", &cancel, &[("origin", "http://evil.example")], None).await.problem(403, "forbidden");
    service.ask("GET", "/api/v1/jobs", &[("host", "evil.example")], None).await.problem(401, "unauthorised");
    assert_eq!(service.get(&format!("/api/v1/jobs/{id}")).await.json()["state"], "accepted");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_service_describes_itself() {
    let service = start().await;
    let told = service.get("/api/v1/openapi.json").await.json();
    assert_eq!(told, serde_json::to_value(document()).expect("a document"));
    assert_eq!(told["openapi"], "3.1.0");
    for path in [
        "/api/v1/jobs",
        "/api/v1/jobs/{id}",
        "/api/v1/jobs/{id}/retry",
        "/api/v1/parameters",
        "/readyz",
        "/api/v1/cities/{city}/files/{path}",
    ] {
        assert!(told["paths"][path].is_object(), "{path}");
    }
    assert_eq!(service.get("/docs/").await.status, 200);
    assert_eq!(service.get("/readyz").await.body, b"ok\n");
    let list = service.get("/api/v1/parameters").await.json();
    let step = list["parameters"].as_array().expect("a list").iter().find(|p| p["name"] == "sampling.step");
    assert_eq!(step.expect("is there")["unit"], "m");
    assert!(list["parameters"].as_array().expect("a list").iter().all(|p| p["group"] != "resources"));
    assert_eq!(service.get("/api/v1/workers").await.json(), json!([]));
    service.parts.store.close().await;
    service.get("/readyz").await.problem(503, "unavailable");
}
