//! The tables of places, at the terminal and in a page whose other text stays.

use super::super::page::{self, Place};
use super::super::table::{QUALITY, quality_cells};
use super::record::PlaceRecord;
use std::path::Path;

const PLACE: Place = Place {
    records: "places.json",
    begin: "<!-- gable bench places: begin -->",
    end: "<!-- gable bench places: end -->",
};

fn strings(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|c| (*c).to_owned()).collect()
}

/// Heads of the columns of the real table, taken over here.
const JUDGED: [&str; 10] = [
    "ground called building, %",
    "terrain RMS, m",
    "mean, m",
    "area corr.",
    "area compl.",
    "buildings found",
    "merged",
    "missed",
    "objects",
    "invented",
];

fn quality(records: &[PlaceRecord]) -> Vec<Vec<String>> {
    let mut head = strings(&["place"]);
    head.extend(strings(&JUDGED));
    head.extend(strings(&["crowns"]));
    head.extend(strings(&QUALITY));
    let mut rows = vec![head];
    rows.extend(records.iter().map(|r| {
        let objects = &r.judged.objects;
        let share = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
        let metres = |k: usize| r.terrain.map_or_else(|| "-".to_owned(), |t| format!("{:.2}", t[k]));
        let mut cells = vec![
            r.row.clone(),
            format!("{:.2}", 100.0 * r.judged.labels.ground_called_building),
            metres(0),
            metres(1),
            share(objects.correctness),
            share(objects.completeness),
            format!("{} of {}", objects.found, objects.buildings),
            objects.merged.to_string(),
            objects.missed.to_string(),
            objects.objects.to_string(),
            objects.invented.to_string(),
            objects.crowns.to_string(),
        ];
        cells.extend(quality_cells(&r.figures));
        cells
    }));
    rows
}

fn made(records: &[PlaceRecord]) -> Vec<Vec<String>> {
    let head = [
        "place",
        "gable synth",
        "km²",
        "faces",
        "buildings",
        "synth, s",
        "run, s",
        "core µs per pixel",
        "date",
        "cores",
        "build",
    ];
    let mut rows = vec![strings(&head)];
    rows.extend(records.iter().map(|r| {
        vec![
            r.row.clone(),
            r.synth_arguments.join(" "),
            format!("{:.3}", r.area_km2),
            r.mesh_faces.to_string(),
            r.buildings.to_string(),
            format!("{:.1}", r.synth.wall),
            format!("{:.1}", r.run.whole.wall),
            format!("{:.1}", r.run.micros_per_pixel()),
            r.date.clone(),
            r.cores.to_string(),
            r.build.clone(),
        ]
    }));
    rows
}

/// For the terminal.
pub(super) fn text(records: &[PlaceRecord]) -> String {
    [quality(records), made(records)].map(|rows| crate::table::render(&rows)).join("\n")
}

/// Puts a record among those of a folder, in place of an earlier one of the same row, and makes the tables of the folder's
/// `README.md` anew.
pub(super) fn write(folder: &Path, record: &PlaceRecord) -> anyhow::Result<()> {
    let put = |records: &mut Vec<PlaceRecord>| {
        records.retain(|r| r.row != record.row);
        records.push(record.clone());
        records.sort_by_key(|r| r.order);
    };
    let tables = |records: &[PlaceRecord]| {
        page::markdown("Places, quality:", &quality(records)) + &page::markdown("How places are made:", &made(records))
    };
    page::change(folder, &PLACE, put, tables)
}
