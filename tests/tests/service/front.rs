//! What users send and are told, whatever the database: texts that cannot be kept, and names of files.

use gable_tests::{Database, Service};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

/// Asks; gives the status and what was told.
fn ask(service: &Service, method: &str, path: &str, body: Option<&str>) -> (u16, String) {
    let agent: ureq::Agent = ureq::Agent::config_builder()
        .http_status_as_error(false)
        .allow_non_standard_methods(true)
        .timeout_global(Some(Duration::from_secs(30)))
        .build()
        .into();
    let mut request = ureq::http::Request::builder()
        .method(method)
        .uri(format!("{}{path}", service.address()))
        .header("authorization", format!("Bearer {}", service.operator()));
    if body.is_some() {
        request = request.header("content-type", "application/json");
    }
    let request = request.body(body.unwrap_or_default().to_owned()).expect("a request");
    let mut answer = agent.run(request).expect("an answer");
    (answer.status().as_u16(), answer.body_mut().read_to_string().unwrap_or_default())
}

/// Every text that a client can send, with NUL in it.
fn nul_is_refused(database: Database) {
    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("mesh.obj"), "v 0 0 0\n").unwrap();
    let Some(mut service) = Service::new("nul", database, root.path(), 5.0) else { return };
    let _process = service.serve(&[]);
    let job = service.submit(Path::new("mesh.obj"), "delft", &json!({}));
    for path in [
        "/api/v1/jobs/%00",
        "/api/v1/jobs?city=a%00b",
        "/api/v1/jobs?owner=%00",
        "/api/v1/jobs?before=%00",
        "/api/v1/cities/a%00",
        "/api/v1/cities?after=%00",
        "/api/v1/cities/delft/members%00",
        "/api/v1/cities/delft/files/a%00b",
        "/api/v1/cities/delft/buildings?after=%00",
        "/api/v1/audit?who=%00",
        "/api/v1/schedules/%00",
        "/api/v1/uploads/%00",
        "/api/v1/open-uploads/%00",
        "/api/v1/webhooks/%00/messages",
        "/ogc/jobs/%00",
        "/ogc/jobs?before=%00",
        &format!("/api/v1/jobs/{job}/files/%00"),
        &format!("/api/v1/jobs/{job}/blocks/a%00/log"),
    ] {
        let (status, told) = ask(&service, "GET", path, None);
        assert!(status == 400 && told.contains("NUL"), "{path}: {status} {told}");
    }
    for (method, path, body) in [
        ("POST", "/api/v1/jobs", json!({ "source": "mesh.obj", "city": "a\0b" })),
        ("POST", "/api/v1/jobs", json!({ "source": "mesh\0.obj", "city": "a" })),
        ("POST", "/api/v1/jobs", json!({ "source": "mesh.obj", "city": "a", "preset": "\0" })),
        ("POST", "/api/v1/jobs", json!({ "source": "mesh.obj", "city": "a", "parameters": { "sampling.step": "\0" } })),
        ("POST", "/api/v1/jobs", json!({ "source": "mesh.obj", "city": "a", "parameters": { "\0": 1 } })),
        ("POST", "/api/v1/open-uploads", json!({ "name": "a\0.zip" })),
        ("POST", "/api/v1/webhooks", json!({ "url": "https://example.com/\0", "events": ["job.failed"] })),
        ("PUT", "/api/v1/schedules/a", json!({ "cron": "0 3 * * *", "job": { "source": "mesh.obj", "city": "a\0" } })),
        ("POST", "/api/v1/cities/delft/links", json!({ "path": "\0" })),
        ("POST", "/ogc/processes/city-model/execution", json!({ "inputs": { "source": "mesh.obj", "city": "a\0" } })),
    ] {
        let (status, told) = ask(&service, method, path, Some(&body.to_string()));
        assert!(status == 400 && told.contains("NUL"), "{method} {path} {body}: {status} {told}");
    }
    // A backslash and `u0000` are a text as any other: this one is refused for what it says.
    let told = ask(&service, "POST", "/api/v1/jobs", Some(r#"{"source":"mesh.obj","city":"a","preset":"\\u0000"}"#));
    assert_eq!(told.0, 422, "{}", told.1);
}

#[test]
fn nul_is_refused_on_sqlite() {
    nul_is_refused(Database::Sqlite);
}

#[test]
fn nul_is_refused_on_postgres() {
    nul_is_refused(Database::Postgres);
}

/// What a job tells: its reason, its events, what it said, and the workers.
fn told(service: &Service, job: &str) -> String {
    let mut told = service.get(&format!("/jobs/{job}")).to_string();
    told += &service.get(&format!("/jobs/{job}/events?limit=1000")).to_string();
    told += &service.get(&format!("/jobs/{job}/blocks")).to_string();
    told += &service.get("/workers").to_string();
    told + &service.text(&format!("/api/v1/jobs/{job}/blocks/scene/log"))
}

/// Meshes that are bad in several ways, also with NUL in what they say: the job fails for the reason, which names no place of the machine.
fn reasons_name_no_place_of_the_machine(database: Database) {
    let root = tempfile::tempdir().unwrap();
    let place = root.path().canonicalize().unwrap();
    let bad: [(&str, &[u8]); 4] = [
        ("bad.obj", b"v 0 0 0\nf 1 2 x\0y\n"),
        ("none.ply", b"ply\nformat ascii 1.0\nelement \0vertex 3\nend_header\n"),
        ("cut.glb", b"glTF\x02\0\0\0"),
        ("named.gltf", br#"{"asset":{"version":"2.0"},"buffers":[{"uri":"gone.bin","byteLength":36}]}"#),
    ];
    for (name, content) in bad {
        std::fs::create_dir_all(place.join("sent")).unwrap();
        std::fs::write(place.join("sent").join(name), content).unwrap();
    }
    let Some(mut service) = Service::new("reasons", database, &place, 5.0) else { return };
    let _process = service.serve(&["--all", "--slots", "2"]);
    let data = service.data("serve").canonicalize().unwrap();
    for (name, content) in bad {
        let in_root = place.join("sent").join(name);
        let upload: Value = match name.ends_with(".gltf") {
            true => Value::Null,
            false => service.send(&format!("/uploads?name={name}"), content),
        };
        for source in [in_root.to_str(), upload["source"].as_str()].into_iter().flatten() {
            let job = service.submit(Path::new(source), "delft", &json!({ "grid.columns": 1, "grid.rows": 1 }));
            service.expect(&job, "failed", LIMIT);
            // What was asked for is told as it was asked for.
            let told = told(&service, &job).replace(source, "");
            let reason = service.get(&format!("/jobs/{job}"))["reason"].as_str().unwrap_or_default().to_owned();
            assert!(
                reason.contains(name.split('.').next().unwrap()) || reason.contains("gone.bin"),
                "{name}: {reason}"
            );
            for hidden in [place.to_str(), data.to_str(), Some("/tmp/"), Some("\\u0000")].into_iter().flatten() {
                assert!(!told.contains(hidden), "{name} of {source}: {hidden} is told: {told}");
            }
        }
    }
}

#[test]
fn reasons_name_no_place_of_the_machine_on_sqlite() {
    reasons_name_no_place_of_the_machine(Database::Sqlite);
}

#[test]
fn reasons_name_no_place_of_the_machine_on_postgres() {
    reasons_name_no_place_of_the_machine(Database::Postgres);
}
