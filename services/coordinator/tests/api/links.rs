//! Signed links: what they open, for how long, and for whom.

use crate::browsers::job_with;
use crate::{Service, start};
use gable_coordinator::{NewToken, create_token};
use gable_job_store::{Artifact, Finished, Publication, Scope};
use serde_json::{Value, json};
use std::time::Duration;

async fn token(service: &Service, name: &str, scope: Scope) -> String {
    let new = NewToken { name: name.to_owned(), scope, groups: Vec::new(), max_jobs: None, expires: None };
    format!("Bearer {}", create_token(&service.parts.store, &new).await.expect("made").expect("the name is free"))
}

/// Publishes a city of these files, as a job of whoever has the token.
async fn publish(service: &Service, token: &str, city: &str, files: &[(&str, &str)]) {
    let body = json!({ "source": "mesh.obj", "city": city });
    assert_eq!(service.submit(&body, &[("authorization", token)]).await.status, 201);
    let mut artifacts = Vec::new();
    for (path, content) in files {
        let blob = service.parts.blobs.put(content.as_bytes().to_vec()).await.expect("put");
        artifacts.push(Artifact { path: format!("result/{path}"), blob, bytes: content.len() as u64 });
    }
    let publication = Some(Publication { crs: "EPSG:7415".to_owned(), buildings: Vec::new() });
    service.finish_next(Finished { artifacts, publication, ..Finished::default() }).await;
}

impl Service {
    async fn link(&self, token: &str, of: &str, wanted: &Value) -> crate::Answer {
        let headers = [("authorization", token), ("content-type", "application/json")];
        self.ask("POST", &format!("/api/v1/{of}/links"), &headers, Some(wanted.to_string())).await
    }

    /// Makes a link; gives its path.
    async fn linked(&self, token: &str, of: &str, wanted: &Value) -> String {
        let made = self.link(token, of, wanted).await;
        assert_eq!(made.status, 201, "{}", made.json());
        let url = made.json()["url"].as_str().expect("an address").to_owned();
        url.strip_prefix(&self.address).unwrap_or_else(|| panic!("{url}")).to_owned()
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_link_opens_what_it_names_and_nothing_else() {
    let service = start().await;
    let ann = token(&service, "ann", Scope::Submitter).await;
    let files =
        [("3dtiles/tileset.json", "{}"), ("3dtiles/0/0_0.glb", "tile"), ("city.gml", "model"), ("report.html", "page")];
    publish(&service, &ann, "delft", &files).await;
    let tiles = service.linked(&ann, "cities/delft", &json!({ "path": "3dtiles/" })).await;
    assert!(tiles.ends_with("/files/3dtiles/"), "{tiles}");
    let set = service.get(&format!("{tiles}tileset.json")).await;
    assert_eq!((set.status, &set.body[..], set.header("content-type")), (200, &b"{}"[..], "application/json"));
    // What a tileset names is found beside it, and parts of it are served.
    let part = service.ask("GET", &format!("{tiles}0/0_0.glb"), &[("range", "bytes=1-2")], None).await;
    assert_eq!((part.status, &part.body[..]), (206, &b"il"[..]));
    let base = tiles.trim_end_matches("3dtiles/");
    for other in ["city.gml", "report.html", "3dtiles", "tiles/0_0.gml"] {
        service.get(&format!("{base}{other}")).await.problem(404, "not-found");
    }
    let page = service.linked(&ann, "cities/delft", &json!({ "path": "report.html", "seconds": 60 })).await;
    let shown = service.get(&page).await;
    assert_eq!((shown.status, &shown.body[..]), (200, &b"page"[..]));
    assert!(shown.header("content-security-policy").starts_with("sandbox"), "it is shown by a browser");
    assert_eq!(shown.header("referrer-policy"), "no-referrer", "the link is told to nobody");
    // A link is no token.
    let link = page.split('/').nth(4).expect("a link");
    service
        .ask("GET", "/api/v1/cities", &[("authorization", &format!("Bearer {link}"))], None)
        .await
        .problem(401, "unauthorised");
    for forged in [format!("x{link}"), link.replace('.', "A."), link[..link.len() - 2].to_owned(), "a.b".to_owned()] {
        service.get(&format!("/api/v1/links/{forged}/files/report.html")).await.problem(404, "not-found");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn links_end() {
    let service = start().await;
    let (ann, root) = (token(&service, "ann", Scope::Submitter).await, token(&service, "root", Scope::Operator).await);
    let bob = token(&service, "bob", Scope::Submitter).await;
    publish(&service, &ann, "delft", &[("city.gml", "one")]).await;
    let file = json!({ "path": "city.gml" });
    service.link(&bob, "cities/delft", &file).await.problem(404, "not-found");
    let soon = service.linked(&ann, "cities/delft", &json!({ "path": "city.gml", "seconds": 1 })).await;
    assert_eq!(service.get(&soon).await.status, 200);
    // The one of a generation stays what it is, the other one follows what readers see.
    let first = service.linked(&ann, "cities/delft", &json!({ "path": "city.gml", "generation": 1 })).await;
    let lasting = service.linked(&ann, "cities/delft", &file).await;
    publish(&service, &ann, "delft", &[("city.gml", "two")]).await;
    assert_eq!(
        (&service.get(&first).await.body[..], &service.get(&lasting).await.body[..]),
        (&b"one"[..], &b"two"[..])
    );
    tokio::time::sleep(Duration::from_millis(1100)).await;
    let ended = service.get(&soon).await.problem(404, "not-found");
    assert!(ended.contains("it has ended"), "{ended}");
    for seconds in [0, -1, 604_801] {
        let wanted = json!({ "path": "city.gml", "seconds": seconds });
        service.link(&ann, "cities/delft", &wanted).await.problem(422, "invalid");
    }
    for path in ["", "none", "city"] {
        service.link(&ann, "cities/delft", &json!({ "path": path })).await.problem(404, "not-found");
    }
    // With all others, when an operator ends them; other coordinators know within a moment.
    let end = async |by: &str| service.ask("DELETE", "/api/v1/links", &[("authorization", by)], None).await;
    end(&ann).await.problem(403, "forbidden");
    assert_eq!(end(&root).await.status, 204);
    service.get(&lasting).await.problem(404, "not-found");
    let lasting = service.linked(&ann, "cities/delft", &file).await;
    assert_eq!(service.get(&lasting).await.status, 200);
    // With the token of whoever has made it.
    assert!(service.parts.store.remove_token("ann").await.expect("removed"));
    tokio::time::sleep(Duration::from_millis(400)).await;
    service.get(&lasting).await.problem(404, "not-found");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn links_of_jobs_and_the_audit_log() {
    let service = start().await;
    let id = job_with(&service, &[("report.html", "page"), ("tiles/0_0.gml", "tile")]).await;
    let root = token(&service, "root", Scope::Operator).await;
    let link = service.linked(&root, &format!("jobs/{id}"), &json!({ "path": "tiles/" })).await;
    assert_eq!(service.get(&format!("{link}0_0.gml")).await.body, b"tile");
    service.get(&link.replace("tiles/", "report.html")).await.problem(404, "not-found");
    service
        .link(&root, &format!("jobs/{id}"), &json!({ "path": "tiles/", "generation": 1 }))
        .await
        .problem(422, "invalid");
    // A request that changes something writes what waits.
    service.ask("DELETE", "/api/v1/links", &[("authorization", &root)], None).await;
    let audit = service.ask("GET", "/api/v1/audit", &[("authorization", &root)], None).await.json();
    let told = audit.to_string();
    assert!(told.contains("link of root") && told.contains("/api/v1/links/-/files/tiles/"), "{told}");
    let secret = link.split('/').nth(4).expect("a link");
    assert!(!told.contains(secret), "a link is as good as a token: {told}");
}
