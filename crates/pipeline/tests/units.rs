//! Jobs in units of work give what a run gives, and a unit that fails costs its block only.

mod common;

use common::{files, job, params, result, same, timeless};
use gable_files::Reach;
use gable_pipeline::{RunStatus, Stage, Unobserved, run};
use gable_synthetic_city::{Source, SynthParams, synthesise};

fn town(area_km2: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let params = SynthParams { seed: 3, source: Source::Procedural { area_km2 }, ..SynthParams::default() };
    synthesise(&params, folder.path(), &|_| {}).unwrap();
    folder
}

#[test]
#[expect(clippy::print_stdout, reason = "which case failed is for whoever reads the failure")]
fn units_make_the_bytes_of_a_run() {
    let town = town(0.01);
    let mesh = town.path().join("mesh");
    // One picture that is none, and labels, footprints and pictures of the labels.
    let broken = files(&mesh).into_keys().find(|name| name.ends_with(".jpg")).unwrap();
    std::fs::write(mesh.join(&broken), b"no picture").unwrap();
    let truth = town.path().join("truth");
    let city = truth.join("truth.city.jsonl").display().to_string();
    let cases: [&[(&str, &str)]; 3] = [
        &[],
        &[("method", "zhu2018"), ("output.report", "false"), ("sampling.step", "0.5"), ("output.terrain", "false")],
        &[
            ("segmentation.footprints", &city),
            ("segmentation.labels", truth.to_str().unwrap()),
            ("modeling.roofs", &city),
            ("output.labels", "true"),
            ("output.report", "false"),
        ],
    ];
    for settings in cases {
        println!("{settings:?}");
        let params = params(settings);
        let out = tempfile::tempdir().unwrap();
        let _ = run(&mesh, out.path(), &params, &Reach::everything(), &Unobserved).unwrap();
        let made = job(&mesh, &params, &|_| None);
        assert_eq!(made.history.failed, []);
        for stage in Stage::ALL {
            assert!(made.units.iter().any(|(s, _)| *s == stage), "no unit of {stage}");
        }
        same(&result(&made), &files(out.path()));
        let listed = String::from_utf8(made.artefacts["buildings.jsonl"].clone()).unwrap();
        let index: serde_json::Value = serde_json::from_slice(&made.artefacts["result/index.json"]).unwrap();
        assert_eq!(listed.lines().count() as u64, index["buildings"].as_u64().unwrap());
    }
}

#[test]
fn a_unit_that_fails_costs_its_block_only() {
    let town = town(0.01);
    let mesh = town.path().join("mesh");
    let params = params(&[]);
    let whole = job(&mesh, &params, &|_| None);
    for (stage, unit) in [(Stage::Sample, "1_1"), (Stage::Segment, "patch_0_0"), (Stage::Write, "1_1")] {
        let made = job(&mesh, &params, &|task| {
            (task.stage == stage && task.unit == unit).then(|| "used more memory than it may".to_owned())
        });
        assert_eq!(made.history.failed.len(), 1, "{:?}", made.history.failed);
        let summary = timeless(&made.artefacts["result/report.json"]);
        assert_eq!(summary.status, RunStatus::Partial);
        assert!(
            summary.failed_blocks().count() > 0 && summary.failed_blocks().count() < summary.blocks.len()
                || stage == Stage::Segment
        );
        let index = String::from_utf8(made.artefacts["result/index.json"].clone()).unwrap();
        assert!(index.contains("used more memory than it may"), "{index}");
        if stage == Stage::Write {
            for (name, bytes) in result(&whole) {
                if name.starts_with("tiles/") && !name.contains("1_1") {
                    assert!(result(&made)[&name] == bytes, "{name}");
                }
            }
        }
    }
}

#[test]
fn artefacts_of_a_block_do_not_tell_where_the_source_lies() {
    let town = town(0.01);
    let elsewhere = tempfile::tempdir().unwrap();
    let moved = elsewhere.path().join("moved/mesh");
    for (name, bytes) in files(&town.path().join("mesh")) {
        let place = moved.join(name);
        std::fs::create_dir_all(place.parent().unwrap()).unwrap();
        std::fs::write(place, bytes).unwrap();
    }
    let params = params(&[("output.report", "false")]);
    let (a, b) = (job(&town.path().join("mesh"), &params, &|_| None), job(&moved, &params, &|_| None));
    for (name, bytes) in &a.artefacts {
        // The last names the files of the source, and the middle two hold times.
        let differs =
            name == "textures.json" || name.starts_with("seen/") || name == "sampled.json" || name == "split.json";
        assert!(differs || &b.artefacts[name] == bytes, "{name} differs");
    }
}
