//! What browsers are told they may do with pages, results and other sites.

use crate::{Answer, Service, start};
use gable_coordinator::checked_origin;
use gable_job_store::{Artifact, Finished};
use serde_json::json;

/// A job that is done, whose result has these files.
pub(crate) async fn job_with(service: &Service, files: &[(&str, &str)]) -> String {
    let id = service.new_job().await;
    let mut artifacts = Vec::new();
    for (path, content) in files {
        let blob = service.parts.blobs.put(content.as_bytes().to_vec()).await.expect("put");
        artifacts.push(Artifact { path: format!("result/{path}"), blob, bytes: content.len() as u64 });
    }
    service.finish_next(Finished { artifacts, ..Finished::default() }).await;
    id
}

/// What an answer's policy allows of a kind.
fn policy<'a>(answer: &'a Answer, kind: &str) -> Option<&'a str> {
    let mut parts = answer.header("content-security-policy").split(';').map(str::trim);
    parts.find_map(|part| part.strip_prefix(kind)).map(str::trim)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_page_stands_by_itself() {
    let service = start().await;
    let id = job_with(&service, &[("report.html", "<script>1</script>")]).await;
    let paths = [
        "/".to_owned(),
        "/plain".to_owned(),
        "/docs".to_owned(),
        "/docs/".to_owned(),
        "/docs/swagger-ui.css".to_owned(),
        "/healthz".to_owned(),
        "/metrics".to_owned(),
        "/nowhere".to_owned(),
        "/ogc".to_owned(),
        "/api/v1/jobs".to_owned(),
        "/api/v1/jobs/none".to_owned(),
        "/api/v1/jobs?limit=a".to_owned(),
        format!("/api/v1/jobs/{id}/files/report.html"),
        format!("/api/v1/jobs/{id}/events"),
    ];
    for path in paths {
        let answer = service.get(&path).await;
        assert_eq!(answer.header("x-frame-options"), "DENY", "{path}");
        assert_eq!(policy(&answer, "frame-ancestors"), Some("'none'"), "{path}");
        assert_eq!(policy(&answer, "base-uri"), Some("'none'"), "{path}");
        assert_eq!(answer.header("x-content-type-options"), "nosniff", "{path}");
        assert_eq!(answer.header("referrer-policy"), "no-referrer", "{path}");
        assert_eq!(answer.header("cross-origin-resource-policy"), "same-origin", "{path}");
        let scripts = policy(&answer, "script-src").or_else(|| policy(&answer, "default-src"));
        let sandboxed = policy(&answer, "sandbox").is_some();
        assert!(sandboxed || !scripts.expect("it says").contains("unsafe-inline"), "{path}: {scripts:?}");
        assert!(answer.header("access-control-allow-origin").is_empty(), "{path}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_a_job_made_has_an_origin_of_its_own() {
    let service = start().await;
    let files = ["report.html", "picture.svg", "tiles/0_0.gml", "index.json", "odd.xhtml", "0.glb"];
    let id = job_with(&service, &files.map(|path| (path, "<script>fetch('/api/v1/jobs')</script>"))).await;
    for path in files {
        let answer = service.get(&format!("/api/v1/jobs/{id}/files/{path}")).await;
        assert_eq!(answer.status, 200);
        let sandbox = policy(&answer, "sandbox").expect("it is in a sandbox");
        assert!(
            !sandbox.contains("allow-same-origin") && !sandbox.contains("allow-top-navigation"),
            "{path}: {sandbox}"
        );
        assert_eq!(policy(&answer, "default-src"), Some("'none'"), "{path}: it loads nothing");
        let part =
            service.ask("GET", &format!("/api/v1/jobs/{id}/files/{path}"), &[("range", "bytes=0-3")], None).await;
        assert!(part.status == 206 && policy(&part, "sandbox").is_some(), "{path}, in parts");
    }
    let svg = service.get(&format!("/api/v1/jobs/{id}/files/picture.svg")).await;
    assert_eq!(svg.header("content-type"), "image/svg+xml");
    let odd = service.get(&format!("/api/v1/jobs/{id}/files/odd.xhtml")).await;
    assert_eq!(odd.header("content-type"), "application/octet-stream");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pages_of_other_sites_are_let_in_by_name_only() {
    let mut service = start().await;
    let site = "https://viewer.example";
    let ask = async |service: &Service, origin: &str| {
        let asked = [
            ("origin", origin),
            ("access-control-request-method", "GET"),
            ("access-control-request-headers", "authorization"),
        ];
        service.ask("OPTIONS", "/api/v1/jobs", &asked, None).await
    };
    assert!(ask(&service, site).await.header("access-control-allow-origin").is_empty(), "none by default");
    service.parts.origins = vec![checked_origin(site).expect("an origin")];
    let service = service.again().await;
    let allowed = ask(&service, site).await;
    assert_eq!((allowed.status, allowed.header("access-control-allow-origin")), (200, site));
    assert!(allowed.header("access-control-allow-headers").contains("authorization"));
    assert!(allowed.header("access-control-allow-credentials").is_empty());
    for other in ["https://evil.example", "https://viewer.example.evil.example", "http://viewer.example", "null"] {
        assert!(ask(&service, other).await.header("access-control-allow-origin").is_empty(), "{other}");
    }
    // The answer itself says so as well, also where it is a refusal; and that it differs by who asks.
    let told = service.ask("GET", "/api/v1/jobs", &[("origin", site), ("authorization", "Bearer none")], None).await;
    assert_eq!(told.header("access-control-allow-origin"), site);
    let differs = told.headers.get_all("vary").iter().any(|v| v.to_str().is_ok_and(|v| v.contains("origin")));
    assert!(differs, "{:?}", told.headers);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn names_that_are_not_what_they_seem_are_refused() {
    let service = start().await;
    let bad = [".", "..", "delft\u{202e}fdp", "a\u{2066}b", "a\u{200f}", "a\nb", "\u{feff}a", "a\u{7f}", " "];
    for name in bad {
        let told = service.submit(&json!({ "source": "mesh.obj", "city": name }), &[]).await.problem(422, "invalid");
        assert!(told.contains("not seen"), "{told}");
        let body = json!({ "inputs": { "source": "mesh.obj", "city": name } }).to_string();
        let json = [("content-type", "application/json")];
        let told = service.ask("POST", "/ogc/processes/city-model/execution", &json, Some(body)).await;
        told.problem(422, "invalid");
        let body = json!({ "name": "a.zip", "city": name }).to_string();
        service.ask("POST", "/api/v1/open-uploads", &json, Some(body)).await.problem(422, "invalid");
        let body = json!({ "cron": "0 3 * * *", "job": { "source": "mesh.obj", "city": name } }).to_string();
        service.ask("PUT", "/api/v1/schedules/nightly", &json, Some(body)).await.problem(422, "invalid");
    }
    service.new_job().await;
    let json = [("content-type", "application/json")];
    let role = Some(json!({ "role": "viewer" }).to_string());
    let put = service.ask("PUT", "/api/v1/cities/delft/members/ann%E2%80%AEbob", &json, role).await;
    put.problem(422, "invalid");
    assert_eq!(service.get("/api/v1/jobs").await.json()["jobs"].as_array().map(Vec::len), Some(1));
}
