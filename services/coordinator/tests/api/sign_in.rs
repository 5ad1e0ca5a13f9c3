//! People who sign in at a provider.

use super::provider::{CLIENT, Provider, SECRET, Wrong};
use super::{Answer, Service, start};
use gable_coordinator::{Grants, NewToken, SignIn, SignInSettings, create_token};
use gable_job_store::Scope;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;

/// A browser's word that a page of the service asks.
const OWN: (&str, &str) = ("sec-fetch-site", "same-origin");

async fn start_with(provider: &Provider, time: Duration) -> Service {
    let mut service = start().await;
    let roles = ["viewer=staff", "submitter=planners", "operator=/admins"];
    let grants = Grants {
        name: "email".to_owned(),
        groups: "groups".to_owned(),
        roles: roles.iter().map(|role| role.parse().expect("a role")).collect(),
    };
    let settings = SignInSettings {
        issuer: provider.address.clone(),
        client: CLIENT.to_owned(),
        secret: Some(SECRET.to_owned()),
        scopes: vec!["email".to_owned(), "groups".to_owned()],
        grants,
        time,
    };
    service.parts.open = false;
    service.parts.sign_in = Some(Arc::new(SignIn::new(settings).expect("settings")));
    service.again().await
}

fn person(name: &str, groups: &[&str]) -> Value {
    json!({ "email": name, "email_verified": true, "groups": groups })
}

/// The cookie that an answer sets, as a browser shows it.
fn cookie(answer: &Answer, name: &str) -> Option<String> {
    let set = answer.headers.get_all("set-cookie").iter().filter_map(|v| v.to_str().ok());
    let pairs = set.filter_map(|v| v.split(';').next()).filter(|pair| !pair.ends_with('='));
    pairs.map(str::to_owned).find(|pair| pair.starts_with(&format!("{name}=")))
}

/// Where the provider sends a browser that the service has sent to it.
async fn at_provider(begun: &Answer) -> String {
    let place = begun.header("location").to_owned();
    let asked = tokio::task::spawn_blocking(move || {
        let config = ureq::Agent::config_builder().max_redirects(0).max_redirects_will_error(false).build();
        let answer = ureq::Agent::from(config).get(&place).call().expect("the provider answers");
        answer.headers()["location"].to_str().expect("text").to_owned()
    });
    asked.await.expect("it ends")
}

impl Service {
    /// Begins a login; gives the browser's cookie, and where it is sent back to.
    async fn begin_login(&self) -> (String, String) {
        let begun = self.get("/auth/login").await;
        assert_eq!(begun.status, 303, "{}", String::from_utf8_lossy(&begun.body));
        let back = at_provider(&begun).await;
        let back = back.strip_prefix(&self.address).expect("it comes back").to_owned();
        (cookie(&begun, "gable-login").expect("a cookie"), back)
    }

    async fn sign_in(&self) -> Answer {
        let (login, back) = self.begin_login().await;
        self.ask("GET", &back, &[("cookie", &login)], None).await
    }

    /// Signs in, and gives the cookie of the session.
    async fn session(&self) -> String {
        let answer = self.sign_in().await;
        assert_eq!((answer.status, answer.header("location")), (303, "/"));
        cookie(&answer, "gable-session").expect("a session")
    }

    async fn shows(
        &self,
        method: &str,
        path: &str,
        cookie: &str,
        more: &[(&str, &str)],
        body: Option<&Value>,
    ) -> Answer {
        let mut headers = vec![("cookie", cookie), ("content-type", "application/json")];
        headers.extend(more);
        self.ask(method, path, &headers, body.map(Value::to_string)).await
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn people_sign_in_and_out() {
    let provider = Provider::start();
    let service = start_with(&provider, Duration::from_secs(3600)).await;
    assert_eq!(service.get("/api/v1/sign-in").await.json(), json!({ "provider": "127.0.0.1" }));
    provider.sees(person("ann@city.example", &["planners", "/south"]), json!({}));
    let begun = service.get("/auth/login").await;
    let (place, set) = (begun.header("location"), begun.header("set-cookie"));
    assert!(place.starts_with(&format!("{}/authorize?from=tests&response_type=code&", provider.address)), "{place}");
    assert!(!place.contains("code_verifier") && place.contains("code_challenge_method=S256"), "{place}");
    assert!(set.contains("; HttpOnly") && set.contains("; SameSite=Lax") && !set.contains("Secure"), "{set}");

    let session = service.session().await;
    let caller = service.shows("GET", "/api/v1/caller", &session, &[], None).await.json();
    assert_eq!(
        (&caller["name"], &caller["scope"], &caller["signed_in"]),
        (&json!("user:ann@city.example"), &json!("submitter"), &json!(true))
    );
    assert!(caller["ends"].is_string());

    // Who changes something does so from a page of the service.
    let job = json!({ "source": "mesh.obj", "city": "delft" });
    let submit = async |more: &[(&str, &str)]| service.shows("POST", "/api/v1/jobs", &session, more, Some(&job)).await;
    let site = |site| ("sec-fetch-site", site);
    for forged in [&[site("cross-site")][..], &[site("same-site")], &[], &[("origin", "https://evil.example")]] {
        let told = submit(forged).await.problem(403, "forbidden");
        assert!(told.contains("from the dashboard only"), "{forged:?}: {told}");
    }
    let own_origin = [("origin", service.address.as_str())];
    assert_eq!(submit(&[OWN]).await.status, 201);
    let made = submit(&own_origin).await;
    assert_eq!((made.status, &made.json()["owner"]), (201, &json!("user:ann@city.example")));
    let audit = service.parts.store.audit(&gable_job_store::AuditFilter::default(), 10).await.expect("asks");
    assert!(audit.iter().any(|entry| entry.who == "user:ann@city.example" && entry.action == "GET /auth/callback"));
    // A token counts before a cookie, also a wrong one.
    let wrong = [("authorization", "Bearer gable_00"), OWN];
    assert_eq!(service.shows("GET", "/api/v1/caller", &session, &wrong, None).await.status, 401);
    // The database has no cookie.
    let value = session.split_once('=').expect("a value").1;
    let kept = std::fs::read(service.folder.path().join("jobs.db")).expect("the database");
    let log = std::fs::read(service.folder.path().join("jobs.db-wal")).unwrap_or_default();
    assert!(![kept, log].iter().any(|file| file.windows(value.len()).any(|w| w == value.as_bytes())));

    let out = async |more: &[(&str, &str)]| service.shows("POST", "/auth/logout", &session, more, None).await;
    assert_eq!(out(&[site("cross-site")]).await.status, 403, "no other page signs somebody out");
    let left = out(&[OWN]).await;
    assert_eq!(left.status, 204);
    assert!(
        left.header("set-cookie").starts_with("gable-session=; ") && left.header("set-cookie").contains("Max-Age=0")
    );
    let told = service.shows("GET", "/api/v1/caller", &session, &[], None).await.problem(401, "unauthorised");
    assert!(told.contains("sign in again"), "{told}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn groups_say_what_somebody_may_do() {
    let provider = Provider::start();
    let service = start_with(&provider, Duration::from_secs(3600)).await;
    let scope = async |claims: Value, more: Value| {
        provider.sees(claims, more);
        let session = service.session().await;
        service.shows("GET", "/api/v1/caller", &session, &[], None).await.json()["scope"].clone()
    };
    assert_eq!(scope(person("a@b", &["staff"]), json!({})).await, "viewer");
    assert_eq!(scope(person("a@b", &["staff", "/admins"]), json!({})).await, "operator");
    // What is not in the token is asked for.
    let short = json!({ "email": "a@b", "email_verified": true });
    assert_eq!(
        scope(short.clone(), json!({ "sub": "7", "groups": ["planners"], "email": "evil@b" })).await,
        "submitter"
    );
    provider.sees(short, json!({ "sub": "8", "groups": ["/admins"] }));
    assert_eq!(service.sign_in().await.header("location"), "/#/jobs?sign-in=failed", "of somebody else");

    let refused = async |claims: Value| {
        provider.sees(claims, json!({ "sub": "7" }));
        let answer = service.sign_in().await;
        assert_eq!(cookie(&answer, "gable-session"), None);
        answer.header("location").to_owned()
    };
    assert_eq!(refused(person("a@b", &["guests"])).await, "/#/jobs?sign-in=no-role");
    let unverified = json!({ "email": "operator", "email_verified": false, "groups": ["/admins"] });
    assert_eq!(refused(unverified).await, "/#/jobs?sign-in=no-name");
    assert_eq!(refused(person("a\u{202e}b", &["/admins"])).await, "/#/jobs?sign-in=no-name");
    provider.sees(person("a@b", &["staff"]), json!({}));
    provider.denies();
    assert_eq!(service.sign_in().await.header("location"), "/#/jobs?sign-in=denied");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_does_not_hold_lets_nobody_in() {
    let provider = Provider::start();
    let service = start_with(&provider, Duration::from_secs(3600)).await;
    provider.sees(person("ann@city.example", &["/admins"]), json!({}));
    for wrong in Wrong::ALL {
        provider.does_wrong(Some(wrong));
        let answer = service.sign_in().await;
        assert_eq!((answer.status, answer.header("location")), (303, "/#/jobs?sign-in=failed"), "{wrong:?}");
        assert_eq!(cookie(&answer, "gable-session"), None, "{wrong:?}");
    }
    provider.does_wrong(None);

    // A login that another browser has begun, none, a forged one, and a code that was used.
    let (own, back) = service.begin_login().await;
    let (other, _) = service.begin_login().await;
    let forged = format!("{own}0");
    for cookie in [other.as_str(), "", "gable-login=a.9999999999999.b", &forged] {
        let answer = service.ask("GET", &back, &[("cookie", cookie)], None).await;
        assert_eq!(answer.header("location"), "/#/jobs?sign-in=expired", "{cookie}");
    }
    let swapped = format!("{}&iss=https://evil.example", back);
    let answer = service.ask("GET", &swapped, &[("cookie", &own)], None).await;
    assert_eq!(answer.header("location"), "/#/jobs?sign-in=expired", "of another provider");
    assert_eq!(service.ask("GET", &back, &[("cookie", &own)], None).await.header("location"), "/");
    let again = service.ask("GET", &back, &[("cookie", &own)], None).await;
    assert_eq!((again.header("location"), cookie(&again, "gable-session")), ("/#/jobs?sign-in=failed", None));

    // A service without a provider has no such addresses.
    let plain = start().await;
    assert_eq!(plain.get("/api/v1/sign-in").await.json(), json!({}));
    plain.get("/auth/login").await.problem(404, "not-found");
    assert_eq!(plain.shows("GET", "/api/v1/caller", "gable-session=x", &[], None).await.json()["name"], "local");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn sessions_end_and_links_with_them() {
    let provider = Provider::start();
    let service = start_with(&provider, Duration::from_secs(3)).await;
    provider.sees(person("ann@city.example", &["planners"]), json!({}));
    let short = service.session().await;
    assert_eq!(service.shows("GET", "/api/v1/caller", &short, &[], None).await.status, 200);
    tokio::time::sleep(Duration::from_millis(3500)).await;
    assert_eq!(service.shows("GET", "/api/v1/caller", &short, &[], None).await.status, 401);

    let service = start_with(&provider, Duration::from_secs(600)).await;
    let session = service.session().await;
    let job = json!({ "source": "mesh.obj", "city": "delft" });
    let made = service.shows("POST", "/api/v1/jobs", &session, &[OWN], Some(&job)).await;
    let id = made.json()["id"].as_str().expect("an id").to_owned();
    let blob = service.parts.blobs.put(b"{}".to_vec()).await.expect("put");
    let file = gable_job_store::Artifact { path: "result/index.json".to_owned(), blob, bytes: 2 };
    service.finish_next(gable_job_store::Finished { artifacts: vec![file], ..Default::default() }).await;
    let wanted = json!({ "path": "index.json", "seconds": 86_400 });
    let link = service.shows("POST", &format!("/api/v1/jobs/{id}/links"), &session, &[OWN], Some(&wanted)).await;
    assert_eq!(link.status, 201, "{}", link.json());
    let until: jiff::Timestamp = link.json()["expires"].as_str().expect("a time").parse().expect("a time");
    assert!((until - jiff::Timestamp::now()).as_secs() <= 600, "not longer than the session: {until}");
    let url = link.json()["url"].as_str().expect("an address").strip_prefix(&service.address).expect("here").to_owned();
    assert_eq!(service.get(&url).await.status, 200);

    let new =
        NewToken { name: "boss".to_owned(), scope: Scope::Operator, groups: Vec::new(), max_jobs: None, expires: None };
    let token = create_token(&service.parts.store, &new).await.expect("made").expect("new");
    let bearer = format!("Bearer {token}");
    let end = async |name: &str| {
        service.ask("DELETE", &format!("/api/v1/sessions/{name}"), &[("authorization", &bearer)], None).await
    };
    assert_eq!(service.shows("DELETE", "/api/v1/sessions/user:x", &session, &[OWN], None).await.status, 403);
    assert_eq!((end("boss").await.status, end("user:nobody").await.status), (404, 404));
    assert_eq!(end("user:ann%40city.example").await.status, 204);
    assert_eq!(service.shows("GET", "/api/v1/caller", &session, &[], None).await.status, 401);
    assert_eq!(service.get(&url).await.status, 404, "a link ends with its maker's session");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn behind_a_proxy_cookies_are_secret() {
    let provider = Provider::start();
    let mut service = start_with(&provider, Duration::from_secs(600)).await;
    service.parts.proxies = vec!["127.0.0.1".parse().expect("an address")];
    let service = service.again().await;
    provider.sees(person("ann@city.example", &["staff"]), json!({}));
    let way = [("x-forwarded-proto", "https"), ("x-forwarded-host", "city.example"), ("x-forwarded-prefix", "/gable")];
    let begun = service.ask("GET", "/auth/login", &way, None).await;
    let login = cookie(&begun, "__Host-gable-login").expect("a cookie");
    assert!(begun.header("set-cookie").ends_with("; Secure"), "{}", begun.header("set-cookie"));
    let back = at_provider(&begun).await;
    let back = back.strip_prefix("https://city.example/gable").expect("as the browser sees it").to_owned();
    let taken = service.ask("GET", &back, &[&way[..], &[("cookie", login.as_str())]].concat(), None).await;
    assert_eq!(taken.header("location"), "/gable/");
    let session = cookie(&taken, "__Host-gable-session").expect("a session");
    let shows = async |cookie: &str| service.shows("GET", "/api/v1/caller", cookie, &way, None).await.status;
    // Another host of the domain can set a cookie, but none with this prefix.
    let tossed = session.replace("__Host-", "");
    assert_eq!((shows(&session).await, shows(&tossed).await), (200, 401));
}
