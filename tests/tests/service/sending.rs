//! Meshes that a service cannot see are sent to it, and what was cut off goes on where it was.

use gable_tests::{Database, Proxy, Service, files_of, run_gable, skip, start_gable, town};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

const WANTED: [&str; 6] = ["--set", "sampling.step=0.5", "--set", "grid.columns=2", "--set", "grid.rows=2"];

/// A folder of tiles with something large in it that does not shrink, so that it goes in several parts.
fn large(folder: &Path, megabytes: usize) {
    for (name, bytes) in files_of(&town(2, 0.004).join("mesh")) {
        let place = folder.join(name);
        std::fs::create_dir_all(place.parent().unwrap()).unwrap();
        std::fs::write(place, bytes).unwrap();
    }
    let mut state = 0x2018_u64;
    let mut noise = Vec::with_capacity(megabytes << 20);
    while noise.len() < megabytes << 20 {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        noise.extend_from_slice(&state.to_be_bytes()[..4]);
    }
    std::fs::write(folder.join("notes.bin"), noise).unwrap();
}

/// The parts of the only upload under way.
fn parts(service: &Service) -> usize {
    let all = service.get("/open-uploads");
    let Some(id) = all[0]["id"].as_str() else { return 0 };
    service.get(&format!("/open-uploads/{id}"))["parts"].as_array().map_or(0, Vec::len)
}

#[test]
fn a_folder_is_sent_and_goes_on_after_it_was_cut_off() {
    let (seen, ours) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mesh = ours.path().join("My city (2026)");
    large(&mesh, 100);
    let mut service = Service::new("sending", Database::Sqlite, seen.path(), 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "2"]);
    let port = service.address().rsplit_once(':').unwrap().1.parse().unwrap();
    let way = Proxy::to(port);
    let url = format!("http://127.0.0.1:{}", way.port());
    let token = service.operator().to_owned();
    let place = mesh.to_str().unwrap();
    let submit =
        [&["submit", place, "--city", "delft", "--url", &url, "--token", &token, "-v", "--json"], &WANTED[..]].concat();

    // The sender dies on the way.
    let mut sender = start_gable(&submit);
    let begin = Instant::now();
    while parts(&service) < 2 {
        assert!(begin.elapsed() < Duration::from_secs(60), "no part has come");
        std::thread::sleep(Duration::from_millis(5));
    }
    sender.kill().unwrap();
    sender.wait().unwrap();
    let before = parts(&service);
    assert!((2..7).contains(&before), "{before} parts");

    // So does the connection of the next one, which waits, and sends what is missing.
    let finished = std::thread::scope(|scope| {
        let sending = scope.spawn(|| run_gable(&submit));
        let begin = Instant::now();
        while parts(&service) == before && begin.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(5));
        }
        way.cut(true);
        std::thread::sleep(Duration::from_millis(1500));
        way.cut(false);
        sending.join().unwrap().success()
    });
    assert!(finished.stderr.contains("were there from an earlier attempt"), "{}", finished.stderr);
    let job = finished.json();
    let uploads = service.get("/uploads");
    let files = files_of(&mesh);
    assert_eq!(uploads.as_array().map(Vec::len), Some(1), "{uploads}");
    assert_eq!((&uploads[0]["source"], &uploads[0]["name"]), (&job["source"], &Value::from("My city (2026).zip")));
    assert_eq!(uploads[0]["files"].as_u64(), Some(files.len() as u64));
    assert_eq!(uploads[0]["bytes"].as_u64(), Some(files.values().map(|f| f.len() as u64).sum()));
    service.expect(job["id"].as_str().unwrap(), "successful", Duration::from_secs(120));

    // A service of this machine is not sent what it sees, and what --send never says is for it alone.
    let own = seen.path().join("mesh.obj");
    std::fs::write(&own, "v 0 0 0\n").unwrap();
    let ask = |more: &[&str]| run_gable(&[more, &["--city", "x", "--url", &url, "--token", &token, "--json"]].concat());
    let as_seen = ask(&["submit", own.to_str().unwrap()]).success().json();
    assert_eq!(as_seen["source"], own.canonicalize().unwrap().to_str().unwrap());
    let never = ask(&["submit", place, "--send", "never"]);
    assert_eq!((never.code, never.stderr.contains("source root")), (2, true), "{}", never.stderr);
    assert_eq!(service.get("/uploads").as_array().map(Vec::len), Some(1));
}

#[test]
fn curl_streams_a_file() {
    if Command::new("curl").arg("--version").output().is_err() {
        return skip("curl_streams_a_file", "curl is not installed");
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("delft.ply");
    std::fs::write(&file, vec![7; 40 << 20]).unwrap();
    let mut service = Service::new("curl", Database::Sqlite, folder.path(), 5.0).unwrap();
    let _process = service.serve(&[]);
    let url = format!("{}/api/v1/uploads?name=delft.ply", service.address());
    let header = format!("authorization: Bearer {}", service.operator());
    for more in [&[][..], &["-H", "transfer-encoding: chunked"][..]] {
        let done =
            Command::new("curl").args(["-sS", "-T", file.to_str().unwrap(), &url, "-H", &header]).args(more).output();
        let done = done.unwrap();
        let said = String::from_utf8_lossy(&done.stdout);
        let upload: Value = serde_json::from_str(&said)
            .unwrap_or_else(|e| panic!("{e}: {said} {}", String::from_utf8_lossy(&done.stderr)));
        assert_eq!(upload["bytes"], 40 << 20, "{upload}");
    }
}
