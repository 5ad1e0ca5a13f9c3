//! The commands of the README and of the page on the service, as they are printed there. Only what belongs to a machine is another:
//! the port, and where the database and the folder of artefacts are.

use gable_tests::{Database, Service, gable, town};
use std::path::Path;
use std::process::Command;

const README: &str = include_str!("../../../README.md");
const SERVICE_PAGE: &str = include_str!("../../../docs/service.md");

/// The commands of the first block after a text of a page.
fn commands(page: &str, after: &str) -> String {
    let begin = page.find(after).unwrap_or_else(|| panic!("{after:?} is not in the page"));
    let block = page[begin..].split("```sh\n").nth(1).expect("a block");
    let block = block.split("```").next().expect("its end").to_owned();
    let count = block.lines().filter(|l| !l.trim().is_empty()).count();
    assert!((1..=5).contains(&count), "{count} commands");
    block
}

/// A folder with a mesh as the README names it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let tile = find(&town(2, 0.004).join("mesh")).expect("a tile");
    for entry in std::fs::read_dir(tile.parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        let name = if path == tile { "mesh.obj".into() } else { path.file_name().unwrap().to_owned() };
        std::fs::copy(&path, folder.path().join(name)).unwrap();
    }
    folder
}

/// An OBJ file somewhere below a folder; always the same.
fn find(folder: &Path) -> Option<std::path::PathBuf> {
    let mut entries: Vec<_> = std::fs::read_dir(folder).ok()?.map(|e| e.unwrap().path()).collect();
    entries.sort();
    entries.iter().find_map(|p| {
        if p.is_dir() { find(p) } else { Some(p.clone()).filter(|p| p.extension().is_some_and(|e| e == "obj")) }
    })
}

/// Runs commands in a shell; a service is waited for after it was started, and the job before what comes after it.
fn run(commands: &str, more: &[(String, String)], folder: &Path) -> String {
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let url = format!("http://127.0.0.1:{port}");
    let mut script = "set -eu\ntrap 'kill $(jobs -p) 2>/dev/null; wait' EXIT\n".to_owned();
    for line in commands.lines() {
        let line = line
            .replace(":8080", &format!(":{port}"))
            .replace("serve --all", &format!("serve --all --listen 127.0.0.1:{port}"));
        script += &format!("{line}\n");
        if line.starts_with("gable serve") {
            script += &format!("for i in $(seq 300); do curl -sf {url}/readyz >/dev/null && break; sleep 0.1; done\n");
        }
        if line.contains("-d '{") {
            script += "for i in $(seq 600); do gable status | grep -q successful && break; sleep 0.2; done\necho\n";
        }
    }
    script += "echo; gable status\n";
    let binaries = folder.join("bin");
    std::fs::create_dir(&binaries).unwrap();
    std::os::unix::fs::symlink(gable(), binaries.join("gable")).unwrap();
    let path = format!("{}:{}", binaries.display(), std::env::var("PATH").unwrap());
    let mut shell = Command::new("bash");
    shell.args(["-c", &script]).current_dir(folder).env("PATH", path).env("GABLE_URL", url).envs(more.iter().cloned());
    let done = shell.output().expect("bash runs");
    let said = format!("{}\n{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{script}\n{said}");
    assert!(said.contains("successful"), "{script}\n{said}");
    said
}

#[test]
fn one_machine() {
    let folder = folder();
    let said = run(&commands(README, "One machine, no set-up"), &[], folder.path());
    let city = std::fs::read_to_string(folder.path().join("city.city.jsonl")).unwrap_or_else(|e| panic!("{e}: {said}"));
    assert!(city.contains("CityJSONFeature"), "{city}");
}

#[test]
fn many_machines() {
    let folder = folder();
    let Some(service) = Service::new("many_machines", Database::Postgres, folder.path(), 5.0) else { return };
    let printed = commands(SERVICE_PAGE, "Many machines: jobs in Postgres");
    let here = printed
        .replace("postgres://gable:PASSWORD@db/gable", service.database())
        .replace("s3://gable/artefacts", service.store());
    assert!(here.contains(service.database()) && here.contains(service.store()), "{here}");
    run(&here, service.variables(), folder.path());
    assert!(service.stored() > 5, "artefacts are where they should be");
}
