//! Behind proxies: what is believed of them, and where addresses lead.

use crate::browsers::job_with;
use crate::{Service, start};
use serde_json::json;

const SAID: [(&str, &str); 4] = [
    ("x-forwarded-for", "203.0.113.7"),
    ("x-forwarded-proto", "https"),
    ("x-forwarded-host", "city.example"),
    ("x-forwarded-prefix", "/gable"),
];

/// A service that has tokens, with one of an operator, which believes the proxies of this machine, or does not.
async fn behind(trusted: bool) -> (Service, String) {
    let mut service = start().await;
    if trusted {
        service.parts.proxies = vec!["127.0.0.0/8".parse().expect("a network")];
    }
    let service = service.again().await;
    let new = gable_coordinator::NewToken {
        name: "ann".to_owned(),
        scope: gable_job_store::Scope::Operator,
        groups: Vec::new(),
        max_jobs: None,
        expires: None,
    };
    let token = gable_coordinator::create_token(&service.parts.store, &new).await.expect("made").expect("free");
    (service, format!("Bearer {token}"))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn addresses_are_those_that_the_client_sees() {
    let (service, token) = behind(true).await;
    let mut asked = vec![("authorization", &*token), ("content-type", "application/json")];
    asked.extend(SAID);
    let submit = json!({ "source": "mesh.obj", "city": "delft" });
    let made = service.ask("POST", "/api/v1/jobs", &asked, Some(submit.to_string())).await;
    assert_eq!(made.status, 201);
    assert!(made.header("location").starts_with("/gable/api/v1/jobs/"), "{}", made.header("location"));
    let executed = json!({ "inputs": submit }).to_string();
    let made = service.ask("POST", "/ogc/processes/city-model/execution", &asked, Some(executed)).await;
    assert!(made.header("location").starts_with("https://city.example/gable/ogc/jobs/"), "{}", made.header("location"));
    let landing = service.ask("GET", "/ogc", &asked, None).await.json();
    for link in landing["links"].as_array().expect("links") {
        assert!(link["href"].as_str().is_some_and(|h| h.starts_with("https://city.example/gable/")), "{link}");
    }
    assert_eq!(service.ask("GET", "/ogc/api", &asked, None).await.json()["servers"][0]["url"], "/gable/ogc");
    assert_eq!(service.ask("GET", "/docs", &asked, None).await.header("location"), "/gable/docs/");
    let described = service.ask("GET", "/api/v1/openapi.json", &asked, None).await.json();
    assert_eq!(described["servers"], json!([{ "url": "/gable" }]));
    // The pages name no address from the root, so they are found wherever they lie.
    let docs = service.ask("GET", "/docs/swagger-initializer.js", &asked, None).await;
    assert!(String::from_utf8_lossy(&docs.body).contains("\"../api/v1/openapi.json\""), "the description is found");
    let page = String::from_utf8_lossy(&service.ask("GET", "/", &asked, None).await.body).into_owned();
    assert!(!page.contains("src=\"/") && !page.contains("href=\"/"), "{page}");
    let id = job_with_token(&service, &token).await;
    let link = json!({ "path": "report.html" }).to_string();
    let link = service.ask("POST", &format!("/api/v1/jobs/{id}/links"), &asked, Some(link)).await.json();
    assert!(link["url"].as_str().is_some_and(|u| u.starts_with("https://city.example/gable/api/v1/links/")), "{link}");
}

/// A job of a result of one page.
async fn job_with_token(service: &Service, token: &str) -> String {
    let listed = service.ask("GET", "/api/v1/jobs", &[("authorization", token)], None).await.json();
    for _ in listed["jobs"].as_array().expect("jobs") {
        let blob = service.parts.blobs.put(b"page".to_vec()).await.expect("put");
        let file = gable_job_store::Artifact { path: "result/report.html".to_owned(), blob, bytes: 4 };
        service.finish_next(gable_job_store::Finished { artifacts: vec![file], ..Default::default() }).await;
    }
    listed["jobs"][0]["id"].as_str().expect("an id").to_owned()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_anybody_may_send_is_not_believed() {
    let (service, token) = behind(false).await;
    let mut asked = vec![("authorization", &*token), ("content-type", "application/json")];
    asked.extend(SAID);
    let submit = json!({ "source": "mesh.obj", "city": "delft" }).to_string();
    let made = service.ask("POST", "/api/v1/jobs", &asked, Some(submit)).await;
    assert!(made.header("location").starts_with("/api/v1/jobs/"), "{}", made.header("location"));
    let landing = service.ask("GET", "/ogc", &asked, None).await.json();
    assert!(landing["links"][0]["href"].as_str().is_some_and(|h| h.starts_with(&service.address)), "{landing}");
    let audit = service.ask("GET", "/api/v1/audit", &asked, None).await.json();
    assert_eq!(audit["entries"][0]["address"], "127.0.0.1", "{audit}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_audit_log_has_the_address_of_the_client() {
    let (service, token) = behind(true).await;
    let mut asked = vec![("authorization", &*token), ("content-type", "application/json")];
    asked.extend(SAID);
    asked[2] = ("x-forwarded-for", "6.6.6.6, 203.0.113.7, 127.0.0.9");
    let submit = json!({ "source": "mesh.obj", "city": "delft" }).to_string();
    assert_eq!(service.ask("POST", "/api/v1/jobs", &asked, Some(submit)).await.status, 201);
    let audit = service.ask("GET", "/api/v1/audit", &asked, None).await.json();
    assert_eq!(audit["entries"][0]["address"], "203.0.113.7", "{audit}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_open_service_stays_closed_to_those_behind_a_proxy() {
    let mut service = start().await;
    service.parts.proxies = vec!["127.0.0.1".parse().expect("an address")];
    let service = service.again().await;
    let id = job_with(&service, &[]).await;
    for header in SAID {
        let told = service.ask("GET", &format!("/api/v1/jobs/{id}"), &[header], None).await;
        told.problem(401, "unauthorised");
    }
}
