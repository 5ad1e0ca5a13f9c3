//! The table of real scenes, at the terminal and in a page whose other text stays.

use super::super::page::{self, Place};
use super::record::RealRecord;
use std::path::Path;

const PLACE: Place =
    Place { records: "real.json", begin: "<!-- gable bench real: begin -->", end: "<!-- gable bench real: end -->" };

const HEAD: [&str; 26] = [
    "scene",
    "half",
    "row",
    "area corr.",
    "area compl.",
    "buildings found",
    "merged",
    "split",
    "missed",
    "objects",
    "invented",
    "crowns, %",
    "ground called building, %",
    "building IoU",
    "tree IoU",
    "ground + grass IoU",
    "ground IoU",
    "grass IoU",
    "terrain RMS, m",
    "mean, m",
    "worst 1 %, m",
    "missing, %",
    "run, s",
    "core µs per pixel",
    "date",
    "build",
];

fn rows(records: &[RealRecord]) -> Vec<Vec<String>> {
    let mut rows = vec![HEAD.map(str::to_owned).to_vec()];
    rows.extend(records.iter().map(row));
    rows
}

fn row(record: &RealRecord) -> Vec<String> {
    let share = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
    let percent = |value: f64| format!("{:.2}", 100.0 * value);
    let (labels, objects, ground) = (&record.figures.labels, &record.figures.objects, &record.figures.ground);
    let crowns = if objects.objects == 0 { 0.0 } else { objects.crowns as f64 / objects.objects as f64 };
    vec![
        record.scene.clone(),
        record.half.name().to_owned(),
        record.row.clone(),
        share(objects.correctness),
        share(objects.completeness),
        format!("{} of {}", objects.found, objects.buildings),
        objects.merged.to_string(),
        objects.split.to_string(),
        objects.missed.to_string(),
        objects.objects.to_string(),
        objects.invented.to_string(),
        format!("{:.1}", 100.0 * crowns),
        percent(labels.ground_called_building),
        share(labels.building),
        share(labels.tree),
        share(labels.open_ground),
        share(labels.ground),
        share(labels.grass),
        format!("{:.2}", ground.rms),
        format!("{:.2}", ground.mean),
        format!("{:.2}", ground.worst_percent),
        percent(ground.missing),
        format!("{:.1}", record.run.whole.wall),
        format!("{:.1}", record.run.micros_per_pixel()),
        record.date.clone(),
        record.build.clone(),
    ]
}

/// For the terminal.
pub(super) fn text(records: &[RealRecord]) -> String {
    crate::table::render(&rows(records))
}

/// Puts a record among those of a folder, in place of an earlier one of the same scene and row, and makes the table of the folder's
/// `README.md` anew. The rows of a scene stand in the order in which they were first made.
pub(super) fn write(folder: &Path, record: &RealRecord) -> anyhow::Result<()> {
    let put = |records: &mut Vec<RealRecord>| {
        match records.iter_mut().find(|r| r.scene == record.scene && r.row == record.row) {
            Some(old) => *old = record.clone(),
            None => records.push(record.clone()),
        }
        records.sort_by_key(|r| r.order);
    };
    page::change(folder, &PLACE, put, |records| page::markdown("Real scenes:", &rows(records)))
}

#[cfg(test)]
mod tests {
    use super::super::scenes::Half;
    use super::*;
    use crate::commands::bench::record::{Cost, Timing};
    use gable_evaluation::real::{GroundFit, JudgedLabels, JudgedObjects, RealFigures};

    fn record(scene: &str, order: usize, row: &str, found: usize) -> RealRecord {
        let labels = JudgedLabels {
            area_m2: 100.0,
            building: Some(0.9),
            tree: None,
            open_ground: Some(0.8),
            ground: Some(0.7),
            grass: Some(0.6),
            ground_called_building: 0.0125,
        };
        let objects = JudgedObjects {
            completeness: Some(0.95),
            correctness: None,
            buildings: 12,
            found,
            merged: 2,
            split: 1,
            missed: 12 - found,
            objects: 20,
            invented: 4,
            crowns: 3,
        };
        let ground = GroundFit { cells: 50, missing: 0.02, rms: 0.25, mean: -0.1, worst_percent: 1.5 };
        let whole = Cost { wall: 3.0, core: 5.0, peak_memory_bytes: 1 };
        RealRecord {
            scene: scene.to_owned(),
            half: Half::Testing,
            row: row.to_owned(),
            order,
            mesh_faces: 7,
            area_km2: 0.01,
            date: "2026-01-02".to_owned(),
            cores: 2,
            build: "release".to_owned(),
            run: Timing { stages: Vec::new(), whole, pixels: 1_000_000, threads: 2 },
            figures: RealFigures { labels, objects, ground },
        }
    }

    #[test]
    fn rows_have_a_cell_for_each_column() {
        let rows = rows(&[record("wood", 0, "today", 10)]);
        assert_eq!(rows[1].len(), HEAD.len());
        let wanted = "wood testing today - 0.950 10 of 12 2 1 2 20 4 15.0 1.25 0.900 - 0.800 0.700 0.600 0.25 -0.10 1.50 2.00 \
                      3.0 5.0 2026-01-02 release";
        assert_eq!(rows[1].join(" "), wanted);
        let mut none = record("wood", 0, "today", 10);
        none.figures.objects.objects = 0;
        assert_eq!(row(&none)[11], "0.0", "no objects are no crowns");
    }

    #[test]
    fn rows_of_a_scene_stand_together_beside_other_tables() {
        let folder = tempfile::tempdir().unwrap();
        let page = || std::fs::read_to_string(folder.path().join("README.md")).unwrap();
        let other = "<!-- gable bench: begin -->\nother\n<!-- gable bench: end -->\n";
        std::fs::write(folder.path().join("README.md"), format!("# Mine\n\n{other}")).unwrap();
        for (scene, order, row, found) in
            [("yard", 0, "before", 1), ("wood", 1, "before", 2), ("yard", 0, "today", 3), ("yard", 0, "before", 4)]
        {
            write(folder.path(), &record(scene, order, row, found)).unwrap();
        }
        let text = page();
        assert!(text.starts_with("# Mine\n\n") && text.contains(other), "{text}");
        let lines: Vec<&str> = text.lines().filter(|l| l.contains("| testing |")).collect();
        let starts = ["| yard | testing | before |", "| yard | testing | today |", "| wood | testing | before |"];
        assert_eq!(lines.len(), starts.len());
        assert!(lines.iter().zip(starts).all(|(line, start)| line.starts_with(start)), "{text}");
        assert!(
            lines[0].contains("| 4 of 12 |") && !text.contains("| 1 of 12 |"),
            "the earlier record is gone: {text}"
        );
    }
}
