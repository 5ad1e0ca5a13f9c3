//! An operator's day at the dashboard, in a real browser.
#![cfg(unix)]

use gable_geometry::dvec2;
use gable_tests::{Database, Service, files_of, footprints, gable, read_city, run_node, skip, town};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

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

/// A program that starts tasks, but dies at block 2, 2 as long as a file is there.
fn poison(folder: &Path, marker: &Path) -> PathBuf {
    let path = folder.join("poison.sh");
    let script = format!(
        "#!/bin/bash\nIFS= read -r order\ncase $order in\n*'\"stage\":1,\"unit\":\"2_2\",\"input\"'*) \
         if [ -e '{}' ]; then kill -ABRT $$; fi ;;\nesac\nexec \"$@\" < <(printf '%s\\n' \"$order\"; exec cat)\n",
        marker.display()
    );
    std::fs::write(&path, script).unwrap();
    std::fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    path
}

#[test]
fn an_operator_works_at_the_dashboard() {
    const TEST: &str = "an_operator_works_at_the_dashboard";
    let browsers = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
    let given = std::env::var_os("GABLE_CHROMIUM").is_some();
    if !given && !browsers.iter().any(|b| Path::new(b).exists()) {
        skip(TEST, "Chromium is not installed");
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
    let wrapper = poison(folder.path(), &marker);
    let Some(mut service) = Service::new(TEST, Database::Sqlite, folder.path(), 5.0) else { return };
    let _process = service.serve(&["--all", "--slots", "2", "--task-wrapper", wrapper.to_str().unwrap()]);
    if !service.text("/").contains("id=\"app\"") {
        skip(TEST, "the binary was built without the dashboard (Node was missing, or packages could not be had)");
        return;
    }
    // Pictures stay, to be looked at, beside the binary.
    let shots = gable().parent().unwrap().join("dashboard-pictures");
    let paths = [&first, &later, &marker, &shots].map(|p| p.to_str().unwrap());
    let arguments = [&[service.address(), service.operator()], &paths[..]].concat();
    let Some(measured) = run_node(TEST, "dashboard.mjs", "playwright-core", &arguments) else { return };
    // Script of the page for a poll of a job of 256 blocks, milliseconds.
    assert!(measured["poll_ms"].as_f64().unwrap() < 5.0, "{measured}");
    assert!(measured["changes"].as_u64().unwrap() >= 1, "{measured}");
    assert!(measured["frames_per_second"].as_f64().unwrap() > 1.0, "{measured}");
    std::fs::write(shots.join("measured.json"), measured.to_string()).unwrap();

    // With a token that allows to look only.
    let token = service.token("eve", "viewer");
    let arguments = [service.address(), &token, shots.to_str().unwrap()];
    let _ = run_node(TEST, "login.mjs", "playwright-core", &arguments);
}
