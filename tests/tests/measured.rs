//! Making, modelling and measuring: `gable demo` and `gable eval`.

use gable_tests::{run_gable, town};

#[test]
fn the_demo_ends_with_figures_and_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let arguments = ["demo", "--out", out.to_str().unwrap(), "--area", "0.01", "--grid", "4x4"];
    let text = run_gable(&arguments).success().stdout;
    for wanted in ["buildings found", "footprint IoU", "roof RMSE", "faces", "seconds", "report.html"] {
        assert!(text.contains(wanted), "{wanted} is missing:\n{text}");
    }
    let path = text.lines().find_map(|line| line.strip_prefix("report:")).unwrap().trim();
    let page = std::fs::read_to_string(path).unwrap();
    assert!(page.contains("<img ") && page.trim_end().ends_with("</html>"));
}

#[test]
fn the_truth_is_perfect_against_itself() {
    let truth = town(1, 0.02).join("truth");
    let report = tempfile::tempdir().unwrap();
    let file = report.path().join("evaluation.html");
    let figures = run_gable(&[
        "eval",
        "--truth",
        truth.to_str().unwrap(),
        "--result",
        truth.to_str().unwrap(),
        "--report",
        file.to_str().unwrap(),
        "--json",
    ])
    .success()
    .json();
    for class in figures["objects"].as_array().unwrap() {
        assert_eq!(class["per_object"]["quality"].as_f64(), Some(1.0), "{class}");
        assert!((class["per_area"]["quality"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{class}");
    }
    assert!(figures["roofs"]["height_rmse"].as_f64().unwrap() < 1e-6, "{}", figures["roofs"]);
    assert!(figures["footprints"]["blocks"]["mean_iou"].as_f64().unwrap() > 0.999_999, "{}", figures["footprints"]);
    assert!(std::fs::read_to_string(file).unwrap().contains("<html"));
}

#[test]
fn a_folder_without_a_model_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let truth = town(1, 0.02).join("truth");
    let path = folder.path().to_str().unwrap();
    let finished = run_gable(&["eval", "--truth", truth.to_str().unwrap(), "--result", path]);
    assert_eq!(finished.code, 2, "{}", finished.stderr);
    assert!(finished.stderr.contains(path) && finished.stderr.contains("city.city.jsonl"), "{}", finished.stderr);
}

#[test]
fn weights_are_trained_from_a_city_and_used() {
    let city = town(3, 0.01);
    let folder = tempfile::tempdir().unwrap();
    let weights = folder.path().join("weights.json");
    let (city, weights) = (city.to_str().unwrap(), weights.to_str().unwrap());
    let scores = run_gable(&[
        "train",
        "--quiet",
        "--city",
        city,
        "--features",
        "full",
        "--rounds",
        "40",
        "--out",
        weights,
        "--json",
    ])
    .success()
    .json();
    assert!(scores["fit"]["tree"]["iou"].as_f64().unwrap() > 0.6, "{scores}");

    let out = folder.path().join("result");
    let out = out.to_str().unwrap();
    let trained = format!("segmentation.weights={weights}");
    let _ = run_gable(&[
        "run",
        city,
        "--out",
        out,
        "--quiet",
        "--grid",
        "2x2",
        "--set",
        &trained,
        "--set",
        "segmentation.features=full",
        "--set",
        "output.labels=true",
        "--set",
        "output.report=false",
    ])
    .success();
    let figures = run_gable(&["eval", "--truth", city, "--result", out, "--json"]).success().json();
    let classes = figures["labels"]["all"]["classes"].as_array().unwrap();
    let building = classes.iter().find(|c| c["name"] == "building").unwrap();
    assert!(building["iou"].as_f64().unwrap() > 0.75, "{classes:?}");
}

#[test]
fn the_benchmark_writes_its_table_and_the_oracles_are_better() {
    let folder = tempfile::tempdir().unwrap();
    let (out, page) = (folder.path().join("out"), folder.path().join("page"));
    let records = run_gable(&[
        "bench",
        "house",
        "--tuning",
        "--rows",
        "default,labels,footprints,planes",
        "--out",
        out.to_str().unwrap(),
        "--write",
        page.to_str().unwrap(),
        "--quiet",
        "--json",
    ])
    .success()
    .json();
    let figure = |row: usize, name: &str| records[row]["figures"][name].as_f64().unwrap();
    assert_eq!(records.as_array().unwrap().len(), 4);
    assert!(figure(1, "label_mean_iou") > 0.999, "perfect labels are perfect: {}", records[1]);
    assert!(figure(2, "building_footprint_iou") > 0.9, "perfect footprints part the buildings: {}", records[2]);
    assert!(figure(2, "building_footprint_iou") > figure(1, "building_footprint_iou"), "{records}");
    assert!(figure(3, "roof_rmse_50") < 0.01, "perfect planes are where they are: {}", records[3]);
    assert!(records[0]["run"]["whole"]["peak_memory_bytes"].as_u64().unwrap() > 0);
    let text = std::fs::read_to_string(page.join("README.md")).unwrap();
    assert!(text.contains("| house | oracle: footprints, planes |") && text.contains("labels mIoU"), "{text}");
    assert!(!out.join("house").exists(), "nothing is left behind");
    let wrong = run_gable(&["bench", "village"]);
    assert_eq!(wrong.code, 2, "{}", wrong.stderr);
    assert!(wrong.stderr.contains("house, block, district, city"), "{}", wrong.stderr);
}
