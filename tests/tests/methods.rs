//! A program with a method of its own: it is listed, chosen by its name and told its parameters, in a run and by a worker.
#![cfg(unix)]

use gable_tests::{AS_A_JOB, Database, Files, Service, files_of, read_city, run_gable, same_models, town, use_binary};
use serde_json::json;
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(120);

fn with_boxes() {
    use_binary(Path::new(env!("CARGO_BIN_EXE_gable-with-boxes")));
}

#[test]
fn its_parameters_are_in_the_list_with_its_name() {
    with_boxes();
    let list = run_gable(&["params", "--json", "box_height"]).success().json();
    assert_eq!(list["parameters"][0]["name"], "modeling.box_height");
    assert_eq!(list["parameters"][0]["methods"], json!(["box"]));
    let refused = run_gable(&["params", "--set", "modeling.box_height=7"]);
    assert_eq!(refused.code, 2, "{}", refused.stderr);
    assert!(refused.stderr.contains("the method box"), "{}", refused.stderr);
    let refused = run_gable(&["params", "--method", "box", "--set", "modeling.box_height=0.5"]);
    assert!(refused.code == 2 && refused.stderr.contains("1 to 100 m"), "{}", refused.stderr);
}

#[test]
fn a_run_and_a_worker_make_the_same_boxes() {
    with_boxes();
    let mesh = town(2, 0.02).join("mesh");
    let out = tempfile::tempdir().unwrap();
    let more = ["--step", "0.4", "--grid", "3x3", "--method", "box", "--set", "modeling.box_height=7", "--quiet"];
    let named = ["run", mesh.to_str().unwrap(), "--out", out.path().to_str().unwrap()];
    let _ = run_gable(&[&named[..], &more, &AS_A_JOB].concat()).success();
    let city = read_city(&out.path().join("city.city.jsonl"), None);
    assert!(city.buildings.len() > 10, "{} buildings", city.buildings.len());
    for building in &city.buildings {
        assert_eq!(building.attributes["method"], gable_city_model::Value::Text("box".to_owned()));
        assert_eq!(building.lods.lod2[0].faces.len(), 6, "{}", building.id);
        let height = &building.attributes["measuredHeight"];
        assert_eq!(*height, gable_city_model::Value::Number(7.0), "{}", building.id);
    }

    let mut service = Service::new("a_run_and_a_worker_make_the_same_boxes", Database::Sqlite, &mesh, 5.0).unwrap();
    let _process = service.serve(&["--all", "--slots", "2"]);
    let wanted = json!({
        "sampling.step": 0.4, "grid.columns": 3, "grid.rows": 3, "method": "box", "modeling.box_height": 7,
    });
    let job = service.submit(&mesh, "delft", &wanted);
    assert_eq!(service.wait(&job, LIMIT), "successful");
    let found: Files = service.files(&job);
    same_models(&found, &files_of(out.path()));
}
