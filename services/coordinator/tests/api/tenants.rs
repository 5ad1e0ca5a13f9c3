//! Whose a city is: who sees, steers and shares what, and who is told of it.

use crate::{Answer, Service, start};
use gable_coordinator::{NewToken, create_token, rotate_token};
use gable_files::SourceRoots;
use gable_job_store::{Artifact, CityBuilding, Finished, Publication, Scope};
use serde_json::{Value, json};
use std::time::Duration;

/// A header that shows a new token.
async fn token(service: &Service, name: &str, scope: Scope, groups: &[&str]) -> String {
    let groups = groups.iter().map(|g| (*g).to_owned()).collect();
    let new = NewToken { name: name.to_owned(), scope, groups, max_jobs: None, expires: None };
    format!("Bearer {}", create_token(&service.parts.store, &new).await.expect("made").expect("the name is free"))
}

impl Service {
    async fn by(&self, token: &str, method: &str, path: &str, body: Option<Value>) -> Answer {
        let headers = [("authorization", token), ("content-type", "application/json")];
        self.ask(method, &format!("/api/v1{path}"), &headers, body.map(|b| b.to_string())).await
    }

    /// Submits a job; gives its id.
    async fn job_of(&self, token: &str, city: &str) -> String {
        let made = self.by(token, "POST", "/jobs", Some(json!({ "source": "mesh.obj", "city": city }))).await;
        assert_eq!(made.status, 201, "{}", made.json());
        made.json()["id"].as_str().expect("an id").to_owned()
    }

    /// Does the next task, which publishes a city of one building.
    async fn publish(&self, hash: &str) {
        let content = format!("content {hash}").into_bytes();
        let blob = self.parts.blobs.put(content.clone()).await.expect("put");
        let building = CityBuilding {
            id: "b1".to_owned(),
            hash: hash.to_owned(),
            tile: "0_0".to_owned(),
            bbox: [0.0, 0.0, 1.0, 1.0],
            lod: "lod2".to_owned(),
            roof_type: None,
            height: 3.0,
            area: 1.0,
            attributes: "{}".to_owned(),
        };
        let artifacts = ["result/index.json", "seams.json"]
            .map(|path| Artifact { path: path.to_owned(), blob, bytes: content.len() as u64 })
            .to_vec();
        let publication = Some(Publication { crs: "EPSG:7415".to_owned(), buildings: vec![building] });
        self.finish_next(Finished { artifacts, publication, ..Finished::default() }).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_of_a_city_is_seen_by_its_members_only() {
    let service = start().await;
    let ann = token(&service, "ann", Scope::Submitter, &[]).await;
    let bob = token(&service, "bob", Scope::Submitter, &["south"]).await;
    let eve = token(&service, "eve", Scope::Viewer, &[]).await;
    let root = token(&service, "root", Scope::Operator, &[]).await;
    let job = service.job_of(&ann, "delft").await;
    service.publish("1").await;
    let _other = service.job_of(&bob, "leiden").await;
    let paths = [
        format!("/jobs/{job}"),
        format!("/jobs/{job}/blocks"),
        format!("/jobs/{job}/blocks/scene/log"),
        format!("/jobs/{job}/events"),
        format!("/jobs/{job}/events/stream"),
        format!("/jobs/{job}/files"),
        format!("/jobs/{job}/files/index.json"),
        format!("/jobs/{job}/map"),
        format!("/jobs/{job}/map/picture"),
        format!("/jobs/{job}/seams"),
        "/cities/delft".to_owned(),
        "/cities/delft/members".to_owned(),
        "/cities/delft/generations".to_owned(),
        "/cities/delft/generations/1".to_owned(),
        "/cities/delft/changes".to_owned(),
        "/cities/delft/tiles".to_owned(),
        "/cities/delft/files".to_owned(),
        "/cities/delft/files/index.json".to_owned(),
        "/cities/delft/buildings".to_owned(),
        "/cities/delft/buildings/b1".to_owned(),
    ];
    for path in &paths {
        for other in [&bob, &eve] {
            let told = service.by(other, "GET", path, None).await.problem(404, "not-found");
            assert!(!told.contains("index.json"), "{path}: {told}");
        }
    }
    let unknown = service.by(&bob, "GET", "/cities/nowhere", None).await.problem(404, "not-found");
    let hidden = service.by(&bob, "GET", "/cities/delft", None).await.problem(404, "not-found");
    assert_eq!(unknown.replace("nowhere", "delft"), hidden, "it cannot be told from what is not there");
    let headers = [("authorization", bob.as_str())];
    for path in [format!("/ogc/jobs/{job}"), format!("/ogc/jobs/{job}/results")] {
        assert_eq!(service.ask("GET", &path, &headers, None).await.status, 404, "{path}");
    }
    assert_eq!(service.ask("DELETE", &format!("/ogc/jobs/{job}"), &headers, None).await.status, 404);

    // Lists have no more than that.
    let cities_of = async |token: &str| {
        let jobs = service.by(token, "GET", "/jobs", None).await.json();
        let seen: Vec<String> =
            jobs["jobs"].as_array().expect("a list").iter().map(|j| j["city"].as_str().unwrap().to_owned()).collect();
        let ogc = service.ask("GET", "/ogc/jobs", &[("authorization", token)], None).await.json();
        assert_eq!(ogc["jobs"].as_array().map(Vec::len), Some(seen.len()));
        let plain = service.ask("GET", "/plain", &[("authorization", token)], None).await;
        let plain = String::from_utf8(plain.body).expect("text");
        for city in ["delft", "leiden"] {
            assert_eq!(plain.contains(city), seen.contains(&city.to_owned()), "{plain}");
        }
        let cities = service.by(token, "GET", "/cities", None).await.json();
        (seen, cities["cities"].as_array().expect("a list").len())
    };
    assert_eq!(cities_of(&ann).await, (vec!["delft".to_owned()], 1));
    assert_eq!(cities_of(&bob).await, (vec!["leiden".to_owned()], 0));
    assert_eq!(cities_of(&eve).await, (Vec::new(), 0));
    assert_eq!(cities_of(&root).await.0.len(), 2);

    // A viewer sees, and does nothing.
    let share = async |who: &str, role: &str| {
        let path = format!("/cities/delft/members/{who}");
        let answer = service.by(&ann, "PUT", &path, Some(json!({ "role": role }))).await;
        assert_eq!(answer.status, 200, "{who} {role}");
    };
    share("group:south", "viewer").await;
    for path in &paths {
        let status = service.by(&bob, "GET", path, None).await.status;
        assert!(status == 200 || !path.contains("cities") || path.contains("buildings"), "{path}: {status}");
    }
    let again = json!({ "source": "mesh.obj", "city": "delft" });
    service.by(&bob, "POST", "/jobs", Some(again.clone())).await.problem(403, "forbidden");
    service.by(&bob, "POST", &format!("/jobs/{job}/retry"), None).await.problem(403, "forbidden");
    service
        .by(&bob, "POST", "/cities/delft/roll-back", Some(json!({ "generation": 1 })))
        .await
        .problem(403, "forbidden");

    // An editor does with their own; an owner with all.
    share("bob", "editor").await;
    let of_bob = service.job_of(&bob, "delft").await;
    let of_ann = service.job_of(&ann, "delft").await;
    service.by(&bob, "POST", &format!("/jobs/{of_ann}/cancel"), None).await.problem(403, "forbidden");
    assert_eq!(service.by(&bob, "POST", &format!("/jobs/{of_bob}/pause"), None).await.status, 200);
    assert_eq!(service.by(&ann, "POST", &format!("/jobs/{of_bob}/cancel"), None).await.status, 200);
    let own = service.by(&bob, "PUT", "/cities/delft/members/bob", Some(json!({ "role": "owner" }))).await;
    own.problem(403, "forbidden");
    let last = service.by(&ann, "DELETE", "/cities/delft/members/ann", None).await.problem(409, "owner");
    assert!(last.contains("owner"), "{last}");
    assert_eq!(service.by(&bob, "DELETE", "/cities/delft/members/bob", None).await.status, 204, "who wants to leave");
    service.by(&bob, "POST", "/jobs", Some(again)).await.problem(403, "forbidden");

    // A token that may only look owns nothing, whatever it is called.
    share("eve", "owner").await;
    service
        .by(&eve, "PUT", "/cities/delft/members/x", Some(json!({ "role": "owner" })))
        .await
        .problem(403, "forbidden");
    service.by(&eve, "POST", &format!("/jobs/{of_ann}/cancel"), None).await.problem(403, "forbidden");
    assert_eq!(service.by(&eve, "GET", &format!("/jobs/{of_ann}"), None).await.status, 200);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_upload_is_a_source_for_whom_it_is_meant() {
    let service = start().await;
    let ann = token(&service, "ann", Scope::Submitter, &[]).await;
    let bob = token(&service, "bob", Scope::Submitter, &[]).await;
    let send = async |token: &str, more: &str| {
        let path = format!("/api/v1/uploads?name=m.off{more}");
        let sent = service.ask("POST", &path, &[("authorization", token)], Some("OFF\n".to_owned())).await;
        (sent.status, sent.json())
    };
    let _job = service.job_of(&ann, "delft").await;
    let (status, own) = send(&ann, "").await;
    assert_eq!(status, 201, "{own}");
    let (_, shared) = send(&ann, "&city=delft").await;
    let (status, refused) = send(&bob, "&city=delft").await;
    assert_eq!(status, 403, "{refused}");
    let uses = async |token: &str, upload: &Value, city: &str| {
        let body = json!({ "source": upload["source"], "city": city });
        service.by(token, "POST", "/jobs", Some(body)).await.status
    };
    let ids = async |token: &str| {
        let all = service.by(token, "GET", "/uploads", None).await.json();
        all.as_array().expect("a list").iter().map(|u| u["id"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let id = |upload: &Value| upload["id"].as_str().expect("an id").to_owned();
    assert_eq!((uses(&bob, &own, "b").await, uses(&bob, &shared, "b").await), (422, 422));
    assert!(ids(&bob).await.is_empty());
    let role = async |role: &str| {
        service.by(&ann, "PUT", "/cities/delft/members/bob", Some(json!({ "role": role }))).await.status
    };
    assert_eq!(role("viewer").await, 200);
    assert_eq!((uses(&bob, &shared, "b").await, ids(&bob).await), (422, vec![id(&shared)]));
    assert_eq!(role("editor").await, 200);
    assert_eq!((uses(&bob, &own, "b").await, uses(&bob, &shared, "b").await), (422, 201));
    service.by(&bob, "DELETE", &format!("/uploads/{}", id(&shared)), None).await.problem(403, "forbidden");
    service.by(&bob, "DELETE", &format!("/uploads/{}", id(&own)), None).await.problem(404, "not-found");
    assert_eq!(uses(&ann, &own, "a").await, 201);
    // In parts, too.
    let open =
        service.by(&ann, "POST", "/open-uploads", Some(json!({ "name": "m.off", "city": "delft" }))).await.json();
    assert_eq!(open["city"], "delft");
    service.by(&bob, "GET", &format!("/open-uploads/{}", id(&open)), None).await.problem(404, "not-found");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn source_roots_are_of_groups_and_priorities_of_operators() {
    let mut service = start().await;
    let base = service.folder.path().canonicalize().expect("absolute");
    // It lies within a root that is for everybody.
    let secret = base.join("meshes/south");
    std::fs::create_dir(&secret).expect("made");
    std::fs::write(secret.join("own.obj"), "v 0 0 0\n").expect("written");
    service.parts.group_roots.insert("south".to_owned(), SourceRoots::new([secret], []).expect("there"));
    let service = service.again().await;
    let ann = token(&service, "ann", Scope::Submitter, &[]).await;
    let bob = token(&service, "bob", Scope::Submitter, &["south"]).await;
    let root = token(&service, "root", Scope::Operator, &[]).await;
    let submit = async |token: &str, source: &str, priority: i64| {
        let body = json!({ "source": source, "city": format!("of {}", &token[20..30]), "priority": priority });
        service.by(token, "POST", "/jobs", Some(body)).await
    };
    for source in ["own.obj", "south/own.obj"] {
        let hidden = submit(&ann, source, 0).await.problem(422, "source");
        let missing = submit(&ann, "south/none.obj", 0).await.problem(422, "source");
        assert_eq!(hidden.replace(source, ""), missing.replace("south/none.obj", ""));
        assert_eq!((submit(&bob, source, 0).await.status, submit(&root, source, 0).await.status), (201, 201));
    }
    assert_eq!(submit(&ann, "mesh.obj", 0).await.status, 201);
    submit(&ann, "mesh.obj", 1).await.problem(403, "forbidden");
    let made = submit(&ann, "mesh.obj", -1).await;
    assert_eq!((made.status, submit(&root, "mesh.obj", 100).await.status), (201, 201));
    let path = format!("/jobs/{}/priority", made.json()["id"].as_str().expect("an id"));
    service.by(&ann, "PUT", &path, Some(json!({ "priority": 5 }))).await.problem(403, "forbidden");
    assert_eq!(service.by(&ann, "PUT", &path, Some(json!({ "priority": -7 }))).await.status, 200);
    assert_eq!(service.by(&root, "PUT", &path, Some(json!({ "priority": 7 }))).await.status, 200);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_city_is_rolled_back_and_the_audit_log_says_by_whom() {
    let service = start().await;
    let ann = token(&service, "ann", Scope::Submitter, &[]).await;
    let bob = token(&service, "bob", Scope::Submitter, &[]).await;
    let root = token(&service, "root", Scope::Operator, &[]).await;
    for hash in ["1", "2"] {
        service.job_of(&ann, "delft").await;
        service.publish(hash).await;
    }
    let file = "/cities/delft/files/index.json";
    assert_eq!(service.by(&ann, "GET", file, None).await.body, b"content 2");
    let back = service.by(&ann, "POST", "/cities/delft/roll-back", Some(json!({ "generation": 1 }))).await;
    assert_eq!(back.status, 200, "{}", back.json());
    assert_eq!((&back.json()["number"], &back.json()["restored"]), (&json!(3), &json!(1)));
    assert_eq!(service.by(&ann, "GET", file, None).await.body, b"content 1");
    let none = service.by(&ann, "POST", "/cities/delft/roll-back", Some(json!({ "generation": 9 }))).await;
    none.problem(404, "not-found");
    service
        .by(&bob, "POST", "/jobs", Some(json!({ "source": "mesh.obj", "city": "delft" })))
        .await
        .problem(403, "forbidden");
    service.get("/api/v1/jobs").await.problem(401, "unauthorised");
    service.post("/api/v1/jobs").await.problem(401, "unauthorised");

    service.by(&bob, "GET", "/audit", None).await.problem(403, "forbidden");
    service.by(&bob, "GET", "/audit?city=delft", None).await.problem(404, "not-found");
    let log = service.by(&ann, "GET", "/audit?city=delft", None).await.json();
    let rows: Vec<String> = log["entries"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|e| {
            format!("{} {} {} {} {}", e["who"], e["action"], e["target"], e["status"], e["times"]).replace('"', "")
        })
        .collect();
    let submitted = "ann POST /api/v1/jobs /api/v1/jobs 201 1";
    let download = "ann GET /api/v1/cities/{city}/files/{*path} /api/v1/cities/delft/files/index.json 200 1";
    let roll = "ann POST /api/v1/cities/{city}/roll-back /api/v1/cities/delft/roll-back";
    let expected = [
        "bob POST /api/v1/jobs /api/v1/jobs 403 1",
        &format!("{roll} 404 1"),
        download,
        &format!("{roll} 200 1"),
        download,
        submitted,
        submitted,
    ];
    assert_eq!(rows, expected);
    let made = log["entries"][6]["made"].as_str().expect("what was made");
    assert!(made.starts_with("/api/v1/jobs/0"), "{made}");
    let of_bob = service.by(&root, "GET", "/audit?who=bob&limit=1", None).await.json();
    assert_eq!((&of_bob["entries"][0]["who"], of_bob["next"].is_null()), (&json!("bob"), true));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_rotates_and_keeps_what_its_holder_has() {
    let service = start().await;
    let ann = token(&service, "ann", Scope::Submitter, &[]).await;
    let job = service.job_of(&ann, "delft").await;
    let new = rotate_token(&service.parts.store, "ann", Duration::ZERO).await.expect("asks").expect("there is one");
    let new = format!("Bearer {new}");
    service.by(&ann, "POST", &format!("/jobs/{job}/pause"), None).await.problem(401, "unauthorised");
    assert_eq!(service.by(&new, "POST", &format!("/jobs/{job}/pause"), None).await.status, 200);
}
