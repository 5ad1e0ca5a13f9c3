//! Results of a run: what they hold, and how alike two of them are.

use gable_city_model::{CityModel, ReadOptions, read_cityjson};
use gable_geometry::{DVec2, Polygon, dvec2};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A tile's files.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Column and row as in the file names.
    pub name: String,
    /// CityJSON file.
    pub cityjson: PathBuf,
    /// CityGML file.
    pub citygml: PathBuf,
}

/// The tiles of a result, by name.
///
/// # Panics
/// If the folder cannot be read.
#[must_use]
pub fn tiles(out: &Path) -> Vec<Tile> {
    let folder = out.join("tiles");
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.expect("a readable folder").file_name().to_str().map(str::to_owned))
        .filter_map(|name| name.strip_suffix(".city.json").map(str::to_owned))
        .collect();
    names.sort();
    let tile = |name: String| Tile {
        cityjson: folder.join(format!("{name}.city.json")),
        citygml: folder.join(format!("{name}.gml")),
        name,
    };
    names.into_iter().map(tile).collect()
}

/// The whole city of a result, in coordinates that start at the world's origin of `like` if that is given.
///
/// # Panics
/// If it cannot be read.
#[must_use]
pub fn read_city(path: &Path, like: Option<&CityModel>) -> CityModel {
    let options = ReadOptions { origin: like.map(|m| m.origin) };
    read_cityjson(path, &options).unwrap_or_else(|e| panic!("{e}")).model
}

/// Every file of models below a result, by relative name.
///
/// # Panics
/// If a file cannot be read.
#[must_use]
pub fn bytes_of_models(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut take = |name: String| {
        let bytes = std::fs::read(out.join(&name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        files.insert(name, bytes);
    };
    take("city.city.jsonl".to_owned());
    take("index.json".to_owned());
    for tile in tiles(out) {
        take(format!("tiles/{}.city.json", tile.name));
        take(format!("tiles/{}.gml", tile.name));
    }
    files
}

/// The footprints of a city's buildings, by id.
#[must_use]
pub fn footprints(city: &CityModel) -> BTreeMap<String, Vec<Polygon>> {
    let polygons = |building: &gable_city_model::Building| {
        let Some(shell) = &building.lods.footprint else { return Vec::new() };
        let ring =
            |ring: &Vec<u32>| ring.iter().map(|&i| shell.vertices[i as usize].truncate()).collect::<Vec<DVec2>>();
        let polygon = |face: &gable_city_model::Face| Polygon {
            outer: face.rings.first().map(ring).unwrap_or_default(),
            holes: face.rings.iter().skip(1).map(ring).collect(),
        };
        shell.faces.iter().map(polygon).collect()
    };
    city.buildings.iter().map(|b| (b.id.clone(), polygons(b))).collect()
}

/// Intersection over union of two footprints, by samples every 0.1 m.
#[must_use]
pub fn footprint_iou(a: &[Polygon], b: &[Polygon]) -> f64 {
    const STEP: f64 = 0.1;
    let corners = || a.iter().chain(b).flat_map(|p| &p.outer);
    let low = corners().fold(DVec2::INFINITY, |m, p| m.min(*p));
    let high = corners().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p));
    if !low.is_finite() || !high.is_finite() {
        return 0.0;
    }
    let (columns, rows) = (((high.x - low.x) / STEP).ceil() as usize, ((high.y - low.y) / STEP).ceil() as usize);
    let (mut both, mut either) = (0u64, 0u64);
    for row in 0..rows {
        for column in 0..columns {
            let p = low + dvec2(column as f64 + 0.5, row as f64 + 0.5) * STEP;
            let (in_a, in_b) = (a.iter().any(|q| q.contains(p)), b.iter().any(|q| q.contains(p)));
            both += u64::from(in_a && in_b);
            either += u64::from(in_a || in_b);
        }
    }
    if either == 0 { 0.0 } else { both as f64 / either as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlap_of_two_squares() {
        let square = |x: f64| Polygon {
            outer: vec![dvec2(x, 0.0), dvec2(x + 2.0, 0.0), dvec2(x + 2.0, 2.0), dvec2(x, 2.0)],
            holes: Vec::new(),
        };
        let iou = footprint_iou(&[square(0.0)], &[square(1.0)]);
        assert!((iou - 1.0 / 3.0).abs() < 1e-9, "{iou}");
        assert_eq!(footprint_iou(&[square(0.0)], &[square(0.0)]), 1.0);
        assert_eq!(footprint_iou(&[], &[]), 0.0);
    }
}
