use super::*;
use crate::{BuildingRecord, Lod};
use gable_city_model::{Face, Lods, Semantic, Shell};
use gable_geometry::{DVec3, dvec2, dvec3};
use gable_raster::Raster;
use gable_segmentation::Label;

/// A village of gabled houses on a slope, known in closed form.
struct Village {
    side: f64,
}

const HOUSE: f64 = 10.0;
const PITCH: f64 = 25.0;

fn ground(x: f64, y: f64) -> f64 {
    0.05 * x + 0.02 * y
}

impl Village {
    fn houses(&self) -> impl Iterator<Item = (f64, f64)> + use<> {
        let count = (self.side / PITCH) as usize;
        (0..count * count).map(move |i| ((i % count) as f64 * PITCH + 8.0, (i / count) as f64 * PITCH + 8.0))
    }

    fn roof(x: f64, y: f64) -> Option<f64> {
        let (u, v) = (x.rem_euclid(PITCH) - 8.0, y.rem_euclid(PITCH) - 8.0);
        let inside = (0.0..HOUSE).contains(&u) && (0.0..HOUSE).contains(&v);
        let corner = ground(x - u, y - v);
        inside.then(|| corner + 5.0 + (HOUSE / 2.0 - (v - HOUSE / 2.0).abs()) * 0.7)
    }
}

fn house(x: f64, y: f64) -> Building {
    let z = ground(x, y);
    let p = |u: f64, v: f64, h: f64| dvec3(x + u * HOUSE, y + v * HOUSE, z + h);
    let (eave, ridge) = (5.0, 5.0 + 0.35 * HOUSE);
    let vertices: Vec<DVec3> = vec![
        p(0.0, 0.0, 0.0),
        p(1.0, 0.0, 0.0),
        p(1.0, 1.0, 0.0),
        p(0.0, 1.0, 0.0),
        p(0.0, 0.0, eave),
        p(1.0, 0.0, eave),
        p(1.0, 1.0, eave),
        p(0.0, 1.0, eave),
        p(0.0, 0.5, ridge),
        p(1.0, 0.5, ridge),
    ];
    let face = |ring: &[u32], semantic| Face { rings: vec![ring.to_vec()], semantic, attributes: Default::default() };
    let faces = vec![
        face(&[0, 3, 2, 1], Semantic::GroundSurface),
        face(&[0, 1, 5, 4], Semantic::WallSurface),
        face(&[1, 2, 6, 9, 5], Semantic::WallSurface),
        face(&[2, 3, 7, 6], Semantic::WallSurface),
        face(&[3, 0, 4, 8, 7], Semantic::WallSurface),
        face(&[4, 5, 9, 8], Semantic::RoofSurface),
        face(&[6, 7, 8, 9], Semantic::RoofSurface),
    ];
    let footprint = Shell { vertices: vertices.clone(), faces: faces[..1].to_vec() };
    let lods = Lods { footprint: Some(footprint), lod2: vec![Shell { vertices, faces }], ..Lods::default() };
    Building { id: format!("b-{x}-{y}"), attributes: Default::default(), lods }
}

impl ReportSource for Village {
    fn bounds(&self) -> Box2 {
        Box2 { min: dvec2(0.0, 0.0), max: dvec2(self.side, self.side) }
    }

    fn step(&self) -> f64 {
        0.2
    }

    fn overview(&self, window: GridWindow) -> Result<Overview, PipelineError> {
        let mut overview = Overview {
            colour: Raster::filled(window, [110, 150, 90]),
            height: Raster::filled(window, 0.0),
            ground: Raster::filled(window, 0.0),
            label: Raster::filled(window, Some(Label::Grass)),
        };
        for row in 0..window.height {
            for column in 0..window.width {
                let (at, p) = ((column, row), window.centre(column, row));
                overview.ground[at] = ground(p.x, p.y) as f32;
                overview.height[at] = Self::roof(p.x, p.y).unwrap_or_else(|| ground(p.x, p.y)) as f32;
                if Self::roof(p.x, p.y).is_some() {
                    overview.label[at] = Some(Label::Building);
                    overview.colour[at] = [170, 90, 70];
                }
            }
        }
        Ok(overview)
    }

    fn buildings(&self, within: Box2, visit: &mut dyn FnMut(&Building)) -> Result<(), PipelineError> {
        for (x, y) in self.houses() {
            if within.intersects(&Box2 { min: dvec2(x, y), max: dvec2(x + HOUSE, y + HOUSE) }) {
                visit(&house(x, y));
            }
        }
        Ok(())
    }
}

fn summary(village: &Village) -> RunSummary {
    let building_records: Vec<_> = village
        .houses()
        .enumerate()
        .map(|(i, (x, y))| BuildingRecord {
            note: None,
            roof_type: Some("gable".to_owned()),
            id: format!("b-{x}-{y}"),
            tile: [0, 0],
            bbox: [x, y, x + HOUSE, y + HOUSE],
            lod: if i == 1 { Lod::Lod1 } else { Lod::Lod2 },
            reason_code: (i == 1).then(|| "invalid".to_owned()),
            reason: (i == 1).then(|| "walls cross & the <roof> is open".to_owned()),
            area_m2: HOUSE * HOUSE,
            height_m: 8.5,
            rmse_m: Some(0.1),
            faces: 7,
        })
        .collect();
    RunSummary { grid: [4, 4], buildings: building_records.len(), building_records, ..RunSummary::default() }
}

#[test]
fn the_report_is_complete_and_self_contained() {
    let village = Village { side: 60.0 };
    let out = tempfile::tempdir().unwrap();
    let files = write(out.path(), "Village <1>", &summary(&village), &village).unwrap();
    assert!(files.iter().all(|f| out.path().join(f).is_file()));
    let left: Vec<_> = std::fs::read_dir(out.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().ends_with(".partial")));

    let page = std::fs::read_to_string(out.path().join("report.html")).unwrap();
    assert!(page.contains("Village &lt;1&gt;") && page.contains("walls cross &amp; the &lt;roof&gt; is open"));
    assert_eq!(page.matches("<img ").count(), 6);
    assert!(!page.contains("http://") && !page.contains("https://"), "the page needs no other file");
    let parsed: RunSummary = serde_json::from_slice(&std::fs::read(out.path().join("report.json")).unwrap()).unwrap();
    assert_eq!(parsed, summary(&village));
    let model = image::open(out.path().join("pictures/city-model.png")).unwrap().to_rgba8();
    let reddish = model.pixels().filter(|p| p.0[3] == 255 && p.0[0] > 120 && p.0[0] > p.0[2] + 40).count();
    assert!(reddish > 500, "roofs are seen in the model: {reddish} pixels");
}

#[test]
fn a_larger_city_has_close_ups_and_the_same_bytes_again() {
    let village = Village { side: 500.0 };
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let files = write(a.path(), "Town", &summary(&village), &village).unwrap();
    write(b.path(), "Town", &summary(&village), &village).unwrap();
    assert!(files.iter().any(|f| f == "pictures/place-3-model.png"), "{files:?}");
    let kinds = pictures::KINDS.map(|kind| format!("pictures/city-{kind}"));
    assert_eq!(files[..6], kinds);
    for file in &files {
        assert_eq!(std::fs::read(a.path().join(file)).unwrap(), std::fs::read(b.path().join(file)).unwrap(), "{file}");
    }
    write(a.path(), "Village", &summary(&village), &Village { side: 60.0 }).unwrap();
    assert!(!a.path().join("pictures/place-3-model.png").exists(), "close-ups of a larger city are not left behind");
    if let Some(folder) = std::env::var_os("GABLE_KEEP_REPORT") {
        write(Path::new(&folder), "Town", &summary(&village), &village).unwrap();
    }
}

#[test]
fn an_empty_city_has_a_report_without_pictures() {
    let nothing = Village { side: -1.0 };
    let out = tempfile::tempdir().unwrap();
    let files = write(out.path(), "Nothing", &RunSummary::default(), &nothing).unwrap();
    assert_eq!(files, ["report.html", "report.json"]);
}
