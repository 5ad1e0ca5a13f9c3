//! Programs of others that know the standards: schemathesis sends what the OpenAPI document allows and forbids, OWSLib is a
//! client of OGC API – Processes. `tests/run` gets both from PyPI.

use gable_tests::{Database, Service, skip, town};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// A program that `tests/run` has installed.
fn tool(test: &str, program: &str, module: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("GABLE_TEST_TOOLS").map(PathBuf::from) else {
        skip(test, "GABLE_TEST_TOOLS is not set: tests/run gets the programs");
        return None;
    };
    let there = Command::new(folder.join("bin/python")).args(["-c", &format!("import {module}")]).output();
    if !there.is_ok_and(|done| done.status.success()) {
        skip(test, &format!("{module} is not installed in {}", folder.display()));
        return None;
    }
    Some(folder.join("bin").join(program))
}

/// Runs a program to its end; fails with what it has said if it fails.
#[expect(clippy::print_stdout, reason = "the figures are for whoever runs the test")]
fn succeed(command: &mut Command, limit: Duration) {
    let begin = Instant::now();
    let done = command.output().expect("it starts");
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    let last: Vec<&str> = said.lines().filter(|l| !l.trim().is_empty()).collect();
    println!("{} in {:.0} s", last.last().unwrap_or(&""), begin.elapsed().as_secs_f64());
    assert!(begin.elapsed() < limit, "it took {:?}", begin.elapsed());
}

#[test]
fn the_api_is_what_its_document_says() {
    let name = "the_api_is_what_its_document_says";
    let Some(schemathesis) = tool(name, "schemathesis", "schemathesis") else { return };
    let mesh = town(2, 0.004).join("mesh");
    let mut service = Service::new(name, Database::Sqlite, &mesh, 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "1"]);
    let wanted = json!({ "sampling.step": 0.5, "grid.columns": 2, "grid.rows": 2, "output.report": false });
    // The name that the document's examples have, so that they find something.
    let job = service.submit(&mesh, "delft", &wanted);
    service.expect(&job, "successful", Duration::from_secs(120));
    let address = service.address();
    let authorization = format!("Authorization: Bearer {}", service.operator());
    let mut command = Command::new(schemathesis);
    command
        .args(["run", &format!("{address}/api/v1/openapi.json"), "--url", address, "--header", &authorization])
        .args([
            "--phases",
            "examples,coverage,fuzzing",
            "--max-examples",
            "4",
            "--generation-deterministic",
            "--no-color",
        ])
        // Whether a mesh is there, and west lies west of east, no schema can say: such requests are refused though they fit it.
        .args(["--exclude-checks", "positive_data_acceptance"])
        .current_dir(mesh.parent().unwrap());
    succeed(&mut command, Duration::from_secs(240));
    // What has an address may have been deleted by then; the service is still there.
    assert_eq!(service.text("/readyz"), "ok\n");
}

#[test]
fn a_client_of_the_ogc_is_served() {
    let name = "a_client_of_the_ogc_is_served";
    let Some(python) = tool(name, "python", "owslib") else { return };
    let mesh = town(2, 0.004).join("mesh");
    let mut service = Service::new(name, Database::Sqlite, &mesh, 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "1"]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("conformance/ogc.py");
    succeed(
        Command::new(python).arg(script).args([service.address(), service.operator()]).arg(&mesh),
        Duration::from_secs(180),
    );
}
