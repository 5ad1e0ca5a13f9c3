//! Meshes that are uploaded, or lie in an object store, give the same city as those in a folder.

use gable_tests::{AS_A_JOB, Database, Files, Service, files_of, run_gable, same_models, town};
use serde_json::json;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

fn mesh() -> PathBuf {
    town(2, 0.01).join("mesh")
}

/// What `gable run` makes of the mesh.
fn expected() -> Files {
    let out = tempfile::tempdir().unwrap();
    let (mesh, path) = (mesh(), out.path().to_str().unwrap());
    let more = ["--step", "0.5", "--grid", "2x2", "--set", "output.report=false", "--quiet"];
    let _ = run_gable(&[&["run", mesh.to_str().unwrap(), "--out", path], &more[..], &AS_A_JOB].concat()).success();
    files_of(out.path())
}

#[test]
fn an_upload_and_objects_are_sources() {
    let Some(mut service) = Service::new("sources", Database::Postgres, &mesh(), 5.0) else { return };
    let files = files_of(&mesh());
    // Results are titled after their source, uploads after their city.
    let place = service.put_objects("sources", &files).expect("the S3 server is there");
    let _process = service.serve(&["--all", "--slots", "2", "--source-root", &place]);
    let wanted = json!({ "sampling.step": 0.5, "grid.columns": 2, "grid.rows": 2, "output.report": false });

    // As people pack it: with a folder around.
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (path, content) in &files {
        let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
        zip.start_file(format!("My city/{path}"), options).unwrap();
        zip.write_all(content).unwrap();
    }
    let upload = service.send("/uploads?name=my-city.zip", &zip.finish().unwrap().into_inner());
    assert_eq!(upload["files"].as_u64(), Some(files.len() as u64), "{upload}");
    assert_eq!(upload["bytes"].as_u64(), Some(files.values().map(|f| f.len() as u64).sum()));
    let uploaded = service.submit(Path::new(upload["source"].as_str().unwrap()), "mesh", &wanted);
    let stored = service.submit(Path::new(&place), "stored", &wanted);
    let expected = expected();
    for job in [uploaded, stored] {
        service.expect(&job, "successful", LIMIT);
        same_models(&service.files(&job), &expected);
    }
    let missing = service.submit(Path::new(&format!("{place}/nothing")), "missing", &wanted);
    service.expect(&missing, "failed", LIMIT);
    let reason = service.get(&format!("/jobs/{missing}"))["reason"].clone();
    assert!(reason.as_str().unwrap().contains("nothing is there"), "{reason}");
}
