//! An operator's day at the dashboard, in a real browser.
#![cfg(unix)]

use gable_geometry::dvec2;
use gable_tests::{Database, Service, files_of, footprints, gable, read_city, run_node, skip, town};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// World coordinates of the meshes that `gable synth` makes.
const ORIGIN: [f64; 2] = [85_000.0, 446_000.0];

/// A copy of a town's mesh in which one house is a metre higher.
fn with_a_higher_house(town: &Path, mesh: &Path) {
    let city = read_city(&town.join("truth/truth.city.jsonl"), None);
    let shift = dvec2(city.origin[0] - ORIGIN[0], city.origin[1] - ORIGIN[1]);
    let (id, outline) = footprints(&city)
        .into_iter()
        .max_by(|a, b| a.1.iter().map(|p| p.area()).sum::<f64>().total_cmp(&b.1.iter().map(|p| p.area()).sum()))
        .expect("a house");
    let building = city.buildings.iter().find(|b| b.id == id).expect("it is there");
    let shells = building.lods.lod2.iter().flat_map(|s| &s.vertices);
    let ground = shells.map(|v| v.z + city.origin[2]).fold(f64::MAX, f64::min);
    for (name, bytes) in files_of(mesh).into_iter().filter(|(name, _)| name.ends_with(".obj")) {
        let mut out = String::new();
        for line in String::from_utf8(bytes).unwrap().lines() {
            let v: Vec<f64> = match line.strip_prefix("v ") {
                Some(vertex) => vertex.split(' ').map(|c| c.parse().unwrap()).collect(),
                None => Vec::new(),
            };
            let inside = |v: &[f64]| outline.iter().any(|p| p.contains(dvec2(v[0], v[1]) - shift));
            if v.len() >= 3 && v[2] > ground + 2.0 && inside(&v) {
                writeln!(out, "v {} {} {:.5}", v[0], v[1], v[2] + 1.0).unwrap();
            } else {
                out += line;
                out.push('\n');
            }
        }
        std::fs::write(mesh.join(name), out).unwrap();
    }
}

/// A program that starts tasks, but first does to those whose order fits a pattern of the shell what a command of the shell says, as long as
/// a file is there.
fn wrapper(folder: &Path, cases: &[(&str, &str, &Path)]) -> PathBuf {
    let path = folder.join("wrapper.sh");
    let mut script = "#!/bin/bash\nIFS= read -r order\ncase $order in\n".to_owned();
    for (pattern, command, marker) in cases {
        writeln!(script, "{pattern}) if [ -e '{}' ]; then {command}; fi ;;", marker.display()).unwrap();
    }
    script += "esac\nexec \"$@\" < <(printf '%s\\n' \"$order\"; exec cat)\n";
    std::fs::write(&path, script).unwrap();
    std::fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    path
}

/// Whether there is a browser; said if not.
fn has_browser(test: &str) -> bool {
    let browsers = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
    let there = std::env::var_os("GABLE_CHROMIUM").is_some() || browsers.iter().any(|b| Path::new(b).exists());
    if !there {
        skip(test, "Chromium is not installed");
    }
    there
}

/// Whether the service has its dashboard; said if not.
fn has_dashboard(test: &str, service: &Service) -> bool {
    let there = service.text("/").contains("id=\"app\"");
    if !there {
        skip(test, "the binary was built without the dashboard (Node was missing, or packages could not be had)");
    }
    there
}

/// Where pictures stay, to be looked at: beside the binary.
fn shots() -> PathBuf {
    gable().parent().unwrap().join("dashboard-pictures")
}

#[test]
fn an_operator_works_at_the_dashboard() {
    const TEST: &str = "an_operator_works_at_the_dashboard";
    if !has_browser(TEST) {
        return;
    }
    let town = town(4, 0.02);
    let folder = tempfile::tempdir().unwrap();
    let (first, later) = (folder.path().join("2025/mesh"), folder.path().join("2026/mesh"));
    for (name, bytes) in files_of(&town.join("mesh")) {
        for mesh in [&first, &later] {
            let place = mesh.join(&name);
            std::fs::create_dir_all(place.parent().unwrap()).unwrap();
            std::fs::write(place, &bytes).unwrap();
        }
    }
    with_a_higher_house(&town, &later);
    let marker = folder.path().join("poisoned");
    std::fs::write(&marker, "").unwrap();
    let dies = (r#"*'"stage":1,"unit":"2_2","input"'*"#, "kill -ABRT $$", marker.as_path());
    let wrapper = wrapper(folder.path(), &[dies]);
    let Some(mut service) = Service::new(TEST, Database::Sqlite, folder.path(), 5.0) else { return };
    let _process = service.serve(&["--all", "--slots", "2", "--task-wrapper", wrapper.to_str().unwrap()]);
    if !has_dashboard(TEST, &service) {
        return;
    }
    let shots = shots();
    let paths = [&first, &later, &marker, &shots].map(|p| p.to_str().unwrap());
    let arguments = [&[service.address(), service.operator()], &paths[..]].concat();
    let Some(measured) = run_node(TEST, "dashboard.mjs", "playwright-core", &arguments) else { return };
    // Script of the page for a poll of a job of 256 blocks, milliseconds.
    // Less than a frame at 60 Hz: five milliseconds were passed where other programs used the machine.
    assert!(measured["poll_ms"].as_f64().unwrap() < 16.0, "{measured}");
    assert!(measured["changes"].as_u64().unwrap() >= 1, "{measured}");
    assert!(measured["frames_per_second"].as_f64().unwrap() > 1.0, "{measured}");
    std::fs::write(shots.join("measured.json"), measured.to_string()).unwrap();

    // With a token that allows to look only.
    let token = service.token("eve", "viewer");
    for city in service.get("/cities")["cities"].as_array().expect("a list") {
        let path = format!("/cities/{}/members/eve", city["name"].as_str().expect("a name"));
        let _ = service.put(&path, &serde_json::json!({ "role": "viewer" }));
    }
    let arguments = [service.address(), &token, shots.to_str().unwrap()];
    let _ = run_node(TEST, "login.mjs", "playwright-core", &arguments);
}

/// The command of the README that sends a job, with another address for the service.
fn curl_of_the_readme(address: &str) -> String {
    let readme = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md")).unwrap();
    let sends = |line: &&str| line.starts_with("curl localhost:8080/api/v1/jobs ") && line.contains(" -d '{\"source\"");
    let line = readme.lines().find(sends).expect("the README sends a job by curl");
    line.replace("localhost:8080", address.trim_start_matches("http://"))
}

#[test]
fn a_job_sent_as_the_readme_says_opens_with_its_city() {
    const TEST: &str = "a_job_sent_as_the_readme_says_opens_with_its_city";
    if !has_browser(TEST) {
        return;
    }
    // The folder of OBJ tiles is the source that the README calls mesh.obj.
    let root = tempfile::tempdir().unwrap();
    for (name, bytes) in files_of(&town(4, 0.02).join("mesh")) {
        let place = root.path().join("mesh.obj").join(&name);
        std::fs::create_dir_all(place.parent().unwrap()).unwrap();
        std::fs::write(place, &bytes).unwrap();
    }
    let Some(mut service) = Service::new(TEST, Database::Sqlite, root.path(), 5.0) else { return };
    let _process = service.serve(&["--all", "--slots", "2"]);
    if !has_dashboard(TEST, &service) {
        return;
    }
    let command = curl_of_the_readme(service.address());
    let sent = Command::new("bash").args(["-c", &command]).env("GABLE_TOKEN", service.operator()).output();
    let Some(sent) = sent.ok().filter(|sent| sent.status.code() != Some(127)) else {
        return skip(TEST, "curl is not installed");
    };
    let job: serde_json::Value =
        serde_json::from_slice(&sent.stdout).unwrap_or_else(|e| panic!("{command}: {e}: {sent:?}"));
    let (id, city) = (job["id"].as_str().unwrap(), job["city"].as_str().unwrap());
    service.expect(id, "successful", Duration::from_secs(300));
    let shots = shots();
    let arguments = [service.address(), service.operator(), id, city, shots.to_str().unwrap()];
    let Some(measured) = run_node(TEST, "city.mjs", "playwright-core", &arguments) else { return };
    assert!(measured["buildings"].as_u64().unwrap() > 3, "{measured}");
}

#[test]
fn what_failed_lies_on_the_map() {
    const TEST: &str = "what_failed_lies_on_the_map";
    if !has_browser(TEST) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let markers = ["patches", "stitching"].map(|name| folder.path().join(name));
    std::fs::write(&markers[0], "").unwrap();
    let patch = r#"*'"stage":3,"unit":"patch_0_'[01]'","input"'*"#;
    let stitch = r#"*'"stage":4,"unit":"city","input"'*"#;
    let wrapper = wrapper(
        folder.path(),
        &[
            (patch, "kill -KILL $$", &markers[0]),
            (
                stitch,
                "echo 'the glue of this city is dry: give it another parameter modeling.beta' >&2; exit 2",
                &markers[1],
            ),
        ],
    );
    let mesh = town(4, 0.02).join("mesh");
    let Some(mut service) = Service::new(TEST, Database::Sqlite, &mesh, 5.0) else { return };
    let _process = service.serve(&["--all", "--slots", "2", "--task-wrapper", wrapper.to_str().unwrap()]);
    if !has_dashboard(TEST, &service) {
        return;
    }
    let wanted = json!({ "sampling.step": 0.5, "grid.columns": 4, "grid.rows": 3, "segmentation.patch": 100, "segmentation.margin": 16 });
    let partial = service.submit(&mesh, "partial", &wanted);
    service.expect(&partial, "partial", Duration::from_secs(120));
    std::fs::remove_file(&markers[0]).unwrap();
    std::fs::write(&markers[1], "").unwrap();
    let failed = service.submit(&mesh, "failed", &wanted);
    service.expect(&failed, "failed", Duration::from_secs(120));

    let shown = service.get(&format!("/jobs/{partial}"));
    let failures = shown["failures"].as_array().unwrap();
    assert_eq!((failures.len(), &failures[0]["count"]), (1, &json!(2)), "{failures:?}");
    assert!(failures[0]["what_to_do"].as_str().unwrap().contains("--slots"), "{failures:?}");
    let shots = shots();
    let arguments = [service.address(), service.operator(), &partial, &failed, shots.to_str().unwrap()];
    let _ = run_node(TEST, "failures.mjs", "playwright-core", &arguments);
}
