//! A city that is kept fresh: after one house changed, only what sees it is computed again, and the difference lists it.

use gable_geometry::{Polygon, dvec2};
use gable_tests::{Database, Service, files_of, footprints, read_city, same_models, town};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

const LIMIT: Duration = Duration::from_secs(120);
/// World coordinates of the meshes that `gable synth` makes.
const ORIGIN: [f64; 2] = [85_000.0, 446_000.0];
const STEP: f64 = 0.5;
/// Pixels.
const PATCH: i64 = 64;
const MARGIN: i64 = 16;

/// West, south, east, north.
type Bounds = [f64; 4];

fn meet(a: &Bounds, b: &Bounds, margin: f64) -> bool {
    a[0] <= b[2] + margin && b[0] <= a[2] + margin && a[1] <= b[3] + margin && b[1] <= a[3] + margin
}

fn bounds_of(polygons: &[Polygon]) -> Bounds {
    let all = polygons.iter().flat_map(|p| &p.outer);
    all.fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |[w, s, e, n], v| {
        [w.min(v.x), s.min(v.y), e.max(v.x), n.max(v.y)]
    })
}

/// A house with few neighbours, by its truth: its footprint, from the mesh's origin, and the height of its ground.
fn house(truth: &Path) -> (Vec<Polygon>, f64) {
    let city = read_city(truth, None);
    let shift = dvec2(city.origin[0] - ORIGIN[0], city.origin[1] - ORIGIN[1]);
    let mut all = footprints(&city);
    all.values_mut().flatten().for_each(|p| p.outer.iter_mut().for_each(|v| *v += shift));
    // So large that it is no close call whether it is a building: this is not about labelling.
    let large = all.iter().filter(|(_, f)| f.iter().map(Polygon::area).sum::<f64>() > 180.0);
    let neighbours = |f: &[Polygon]| all.values().filter(|other| meet(&bounds_of(f), &bounds_of(other), 1.0)).count();
    let (id, footprint) = large.min_by_key(|(_, f)| neighbours(f)).expect("a house");
    let building = city.buildings.iter().find(|b| &b.id == id).expect("it is there");
    let shells = building.lods.lod2.iter().flat_map(|s| &s.vertices);
    (footprint.clone(), shells.map(|v| v.z + city.origin[2]).fold(f64::MAX, f64::min))
}

/// Lifts the roof of a house by a metre in all tiles of a mesh; returns the bounds of each face that changed.
fn lift(mesh: &Path, house: &[Polygon], ground: f64) -> Vec<Bounds> {
    let mut changed = Vec::new();
    for (name, bytes) in files_of(mesh).into_iter().filter(|(name, _)| name.ends_with(".obj")) {
        let text = String::from_utf8(bytes).unwrap();
        let (mut out, mut places, mut lifted) = (String::new(), Vec::new(), Vec::new());
        for line in text.lines() {
            if let Some(vertex) = line.strip_prefix("v ") {
                let v: Vec<f64> = vertex.split(' ').map(|c| c.parse().unwrap()).collect();
                let high = v[2] > ground + 2.0 && house.iter().any(|p| p.contains(dvec2(v[0], v[1])));
                places.push([v[0] + ORIGIN[0], v[1] + ORIGIN[1]]);
                lifted.push(high);
                writeln!(out, "v {} {} {:.5}", v[0], v[1], v[2] + if high { 1.0 } else { 0.0 }).unwrap();
                continue;
            }
            if let Some(face) = line.strip_prefix("f ") {
                let corners: Vec<usize> =
                    face.split(' ').map(|c| c.split('/').next().unwrap().parse::<usize>().unwrap() - 1).collect();
                if corners.iter().any(|&c| lifted[c]) {
                    changed.push(corners.iter().fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |[w, s, e, n], &c| {
                        let [x, y] = places[c];
                        [w.min(x), s.min(y), e.max(x), n.max(y)]
                    }));
                }
            }
            out += line;
            out.push('\n');
        }
        std::fs::write(mesh.join(name), out).unwrap();
    }
    assert!(!changed.is_empty(), "the house has a roof");
    changed
}

/// The job of a schedule that ticks once, some seconds from now.
fn on_schedule(service: &Service, source: &Path, parameters: &Value) -> String {
    // If a busy machine needs longer to take it, its tick is tomorrow, and it is set anew.
    for wait in [3, 10, 30] {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs() + wait;
        let cron = format!("{} {} {} * * *", now % 60, now / 60 % 60, now / 3600 % 24);
        let job = json!({ "source": source, "city": "delft", "parameters": parameters });
        service.put("/schedules/delft", &json!({ "cron": cron, "zone": "Etc/UTC", "job": job }));
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(wait + 5) {
            std::thread::sleep(Duration::from_millis(100));
            if let Some(job) = service.get("/schedules/delft")["last_job"].as_str() {
                return job.to_owned();
            }
        }
    }
    panic!("no tick: {}", service.get("/schedules/delft"));
}

fn refreshed(database: Database) {
    let town = town(4, 0.02);
    let root = tempfile::tempdir().unwrap();
    let (first, second) = (root.path().join("2025/mesh"), root.path().join("2026/mesh"));
    for (name, bytes) in files_of(&town.join("mesh")) {
        for mesh in [&first, &second] {
            let place = mesh.join(&name);
            std::fs::create_dir_all(place.parent().unwrap()).unwrap();
            std::fs::write(place, &bytes).unwrap();
        }
    }
    let (footprint, ground) = house(&town.join("truth/truth.city.jsonl"));
    let faces = lift(&second, &footprint, ground);

    let Some(mut service) = Service::new("refreshed", database, root.path(), 5.0) else { return };
    let _coordinators = [service.serve(&["--all", "--slots", "2"]), service.serve(&[])];
    let _workers = [service.work(&[]), service.work(&[])];
    let wanted = json!({
        "sampling.step": STEP, "grid.columns": 8, "grid.rows": 8, "output.report": false,
        "segmentation.patch": PATCH, "segmentation.margin": MARGIN,
    });
    let before = service.submit(&first, "delft", &wanted);
    service.expect(&before, "successful", LIMIT);
    // The same again: nothing is done but to look at the source and to publish.
    let again = service.submit(&first, "delft", &wanted);
    service.expect(&again, "successful", LIMIT);
    let done = |job: &str| -> Vec<[String; 4]> { service.units(job).into_iter().filter(|u| u[2] == "done").collect() };
    let stages: Vec<_> = done(&again).into_iter().map(|u| u[0].clone()).collect();
    assert_eq!(stages, ["split", "report"]);
    same_models(&service.files(&again), &service.files(&before));

    // By the clock, with two coordinators: one tick, one job.
    let after = on_schedule(&service, &second, &wanted);
    service.expect(&after, "successful", LIMIT);
    let runs = service.get("/schedules/delft/runs");
    assert_eq!((runs.as_array().unwrap().len(), &runs[0]["outcome"]), (1, &json!("submitted")));
    assert_eq!(service.get("/jobs?city=delft")["jobs"].as_array().unwrap().len(), 3);
    let other = service.submit(&second, "delft, anew", &wanted);
    service.expect(&other, "successful", LIMIT);
    assert!(service.units(&other).iter().all(|u| u[2] == "done"), "another city takes nothing over");
    same_models(&service.files(&after), &service.files(&other));

    // Blocks: exactly those in which a face changed.
    let files = service.files(&after);
    let index: Value = serde_json::from_slice(&files["index.json"]).unwrap();
    let blocks: Vec<(String, Bounds)> = index["tiles"]
        .as_array()
        .unwrap()
        .iter()
        .map(|t| {
            let side = |i: usize| t["bbox"][i].as_f64().unwrap();
            (format!("{}_{}", t["tile"][0], t["tile"][1]), [side(0), side(1), side(2), side(3)])
        })
        .collect();
    let touched = |margin: f64| -> BTreeSet<&str> {
        let touched = blocks.iter().filter(|(_, b)| faces.iter().any(|f| meet(f, b, margin)));
        touched.map(|(name, _)| name.as_str()).collect()
    };
    let units = done(&after);
    let of =
        |stage: &str| -> BTreeSet<&str> { units.iter().filter(|u| u[0] == stage).map(|u| u[1].as_str()).collect() };
    // Corners are rounded to the lattice of coordinates.
    assert!(touched(-0.001).is_subset(&of("sample")) && of("sample").is_subset(&touched(0.001)), "{:?}", of("sample"));
    // Patches: only such as see one of these blocks, within their margin and the reach of the filters.
    let reach = (MARGIN + 10) as f64 * STEP;
    let origin = [blocks[0].1[0], blocks[0].1[1]].map(f64::floor);
    for patch in of("segment") {
        let (column, row) = patch.strip_prefix("patch_").and_then(|name| name.split_once('_')).unwrap();
        let edge = PATCH as f64 * STEP;
        let low = [column, row].map(|c| c.parse::<f64>().unwrap() * edge);
        let bounds = [origin[0] + low[0], origin[1] + low[1], origin[0] + low[0] + edge, origin[1] + low[1] + edge];
        let near = blocks.iter().any(|(name, b)| of("sample").contains(name.as_str()) && meet(&bounds, b, reach + 1.0));
        assert!(near, "patch {patch} does not see a block that changed");
    }
    let all = |stage: &str| service.units(&after).iter().filter(|u| u[0] == stage).count();
    for stage in ["sample", "segment", "model", "write"] {
        let (some, all) = (of(stage).len(), all(stage));
        assert!(some > 0 && some * 2 <= all, "{some} of {all} units of {stage} are done again");
    }

    // The difference lists the house, and no other.
    let listed = service.changes("delft", 1, 2);
    assert_eq!(listed.len(), 1, "{listed:?}");
    assert_eq!(listed[0].1, "changed");
    let told = |job: &str| {
        let events = service.events(job);
        let found = events.iter().find(|e| e["kind"] == "published" || e["kind"] == "unchanged").expect("told");
        found["message"].as_str().unwrap().to_owned()
    };
    let expected =
        ["generation 1 of delft", "generation 1 of delft holds: nothing has changed", "generation 2 of delft"];
    assert_eq!([&before, &again, &after].map(|job| told(job)), expected);
    let result = tempfile::tempdir().unwrap();
    let city = result.path().join("city.city.jsonl");
    std::fs::write(&city, &files["city.city.jsonl"]).unwrap();
    let city = read_city(&city, None);
    let building = city.buildings.iter().find(|b| b.id == listed[0].0).expect("the building is there");
    let shift = dvec2(city.origin[0] - ORIGIN[0], city.origin[1] - ORIGIN[1]);
    let vertices = building.lods.lod2.iter().flat_map(|s| &s.vertices).map(|v| v.truncate() + shift);
    let outline = Polygon { outer: vertices.collect(), holes: Vec::new() };
    assert!(meet(&bounds_of(&[outline]), &bounds_of(&footprint), 0.0), "{} is not the house", building.id);
}

#[test]
fn a_city_is_refreshed_on_sqlite() {
    refreshed(Database::Sqlite);
}

#[test]
fn a_city_is_refreshed_on_postgres() {
    refreshed(Database::Postgres);
}
