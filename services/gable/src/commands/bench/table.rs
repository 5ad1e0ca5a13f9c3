//! The table of the benchmark, at the terminal and in a page whose other text stays.

use super::record::Record;
use anyhow::Context as _;
use std::fmt::Write as _;
use std::path::Path;

/// What stands in the page between these lines belongs to the command.
const BEGIN: &str = "<!-- gable bench: begin -->";
const END: &str = "<!-- gable bench: end -->";

/// Records of all scenes that were ever run, beside the page.
const RECORDS: &str = "records.json";

const PAGE: &str = "# Benchmark\n";

fn quality(records: &[Record]) -> Vec<Vec<String>> {
    let head = [
        "scene",
        "row",
        "labels mIoU",
        "building IoU",
        "tree IoU",
        "compl. / corr. ≥ 50 m²",
        "compl. / corr. ≥ 10 m²",
        "IoU of blocks",
        "IoU of buildings",
        "roof RMSE, m",
        "truth→model RMS, m",
        "polygons",
        "triangles",
        "valid, %",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for r in records {
        let f = &r.figures;
        let (share, pair) = (|v: f64| format!("{v:.3}"), |p: [f64; 2]| format!("{:.3} / {:.3}", p[0], p[1]));
        rows.push(vec![
            r.scene.clone(),
            r.row.clone(),
            share(f.label_mean_iou),
            share(f.building_iou),
            share(f.tree_iou),
            pair(f.found_50),
            pair(f.found_10),
            share(f.block_iou_50),
            share(f.building_footprint_iou),
            share(f.roof_rmse_50),
            share(f.truth_to_model_50),
            format!("{:.2}", f.polygons),
            format!("{:.2}", f.triangles),
            format!("{:.1}", 100.0 * f.valid),
        ]);
    }
    rows
}

fn costs(records: &[Record]) -> Vec<Vec<String>> {
    // The stages of all rows, in the order of the first.
    let mut stages: Vec<&str> = Vec::new();
    for stage in records.iter().flat_map(|r| &r.run.stages) {
        if !stages.contains(&stage.name.as_str()) {
            stages.push(&stage.name);
        }
    }
    let mut head: Vec<String> = ["scene", "row", "synth"].map(str::to_owned).to_vec();
    head.extend(stages.iter().map(|s| (*s).to_owned()));
    head.extend(["run", "core µs per pixel", "peak, MB (synth)", "peak, MB (run)"].map(str::to_owned));
    let mut rows = vec![head];
    let seconds = |wall: f64, core: f64| format!("{wall:.1} / {core:.1}");
    let megabytes = |bytes: u64| format!("{:.0}", bytes as f64 / 1e6);
    for r in records {
        let mut row = vec![r.scene.clone(), r.row.clone(), seconds(r.synth.wall, r.synth.core)];
        row.extend(stages.iter().map(|name| {
            let stage = r.run.stages.iter().find(|s| s.name == *name);
            stage.map_or_else(|| "-".to_owned(), |s| seconds(s.wall, s.core))
        }));
        row.push(seconds(r.run.whole.wall, r.run.whole.core));
        row.push(format!("{:.2}", r.run.micros_per_pixel()));
        row.push(megabytes(r.synth.peak_memory_bytes));
        row.push(megabytes(r.run.whole.peak_memory_bytes));
        rows.push(row);
    }
    rows
}

fn scenes(records: &[Record]) -> Vec<Vec<String>> {
    let head = ["scene", "row", "buildings from", "seed", "km²", "faces", "per m²", "slope", "date", "cores", "build"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for r in records {
        rows.push(vec![
            r.scene.clone(),
            r.row.clone(),
            r.source.clone(),
            r.seed.to_string(),
            format!("{:.3}", r.area_km2),
            r.mesh_faces.to_string(),
            format!("{}", r.density),
            format!("{}", r.slope),
            r.date.clone(),
            r.cores.to_string(),
            r.build.clone(),
        ]);
    }
    rows
}

/// For the terminal.
pub(crate) fn text(records: &[Record]) -> String {
    [quality(records), costs(records)].map(|rows| crate::table::render(&rows)).join("\n")
}

fn markdown(records: &[Record]) -> String {
    let mut out = String::new();
    let mut table = |title: &str, rows: Vec<Vec<String>>| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{title}\n");
        for (i, row) in rows.iter().enumerate() {
            let _ = writeln!(out, "| {} |", row.join(" | "));
            if i == 0 {
                let _ = writeln!(out, "|{}", "---|".repeat(row.len()));
            }
        }
        out.push('\n');
    };
    table("Quality:", quality(records));
    table("Wall and core seconds of each stage, time and memory:", costs(records));
    table("Scenes and machines:", scenes(records));
    out
}

/// Puts a record among those of a folder, in place of an earlier one of the same scene and row, and makes the tables of the
/// folder's `README.md` anew.
pub(crate) fn write(folder: &Path, record: &Record) -> anyhow::Result<()> {
    let place = |path: &Path| path.display().to_string();
    std::fs::create_dir_all(folder).with_context(|| place(folder))?;
    let kept = folder.join(RECORDS);
    let mut records: Vec<Record> = match std::fs::read_to_string(&kept) {
        Ok(text) => serde_json::from_str(&text).with_context(|| place(&kept))?,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        Err(e) => return Err(e).with_context(|| place(&kept)),
    };
    records.retain(|r| (&r.scene, &r.row) != (&record.scene, &record.row));
    records.push(record.clone());
    records.sort_by_key(|r| r.order);
    let page = folder.join("README.md");
    let old = match std::fs::read_to_string(&page) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => PAGE.to_owned(),
        read => read.with_context(|| place(&page))?,
    };
    let new = replaced(&old, &markdown(&records)).with_context(|| place(&page))?;
    std::fs::write(&kept, serde_json::to_string_pretty(&records)? + "\n").with_context(|| place(&kept))?;
    std::fs::write(&page, new).with_context(|| place(&page))
}

/// The page with other tables; they come at its end where it has none.
fn replaced(page: &str, tables: &str) -> anyhow::Result<String> {
    let tables = format!("{BEGIN}\n\n{tables}{END}");
    match (page.find(BEGIN), page.find(END)) {
        (Some(begin), Some(end)) if begin < end => {
            Ok(format!("{}{tables}{}", &page[..begin], &page[end + END.len()..]))
        }
        (None, None) => Ok(format!("{}\n\n{tables}\n", page.trim_end())),
        _ => anyhow::bail!("one of the lines {BEGIN:?} and {END:?} is missing"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::bench::record::{Cost, Figures, Stage, Timing};

    fn record(scene: &str, place: usize, seconds: f64) -> Record {
        let figures = Figures {
            label_mean_iou: 0.9,
            building_iou: 0.95,
            tree_iou: 0.8,
            found_50: [1.0, 0.5],
            found_10: [0.75, 0.25],
            block_iou_50: 0.97,
            building_footprint_iou: 0.6,
            roof_rmse_50: 0.123,
            truth_to_model_50: 0.2,
            polygons: 1.1,
            triangles: 1.2,
            valid: 0.995,
        };
        let whole = Cost { wall: seconds, core: 2.0 * seconds, peak_memory_bytes: 3_000_000 };
        let stages = vec![Stage { name: "split".to_owned(), wall: seconds, core: 2.0 * seconds }];
        Record {
            scene: scene.to_owned(),
            row: "default".to_owned(),
            order: [place, 0],
            source: "procedural".to_owned(),
            seed: 11,
            density: 7.5,
            slope: 0.05,
            mesh_faces: 75_000,
            area_km2: 0.01,
            date: "2026-01-02".to_owned(),
            cores: 2,
            build: "release".to_owned(),
            synth: whole,
            run: Timing { stages, whole, pixels: 1_000_000, threads: 2 },
            eval_seconds: 1.0,
            figures,
        }
    }

    #[test]
    fn tables_change_and_the_text_around_them_stays() {
        let folder = tempfile::tempdir().unwrap();
        let page = || std::fs::read_to_string(folder.path().join("README.md")).unwrap();
        std::fs::write(folder.path().join("README.md"), "# Mine\n\nbefore\n").unwrap();
        write(folder.path(), &record("block", 1, 4.0)).unwrap();
        write(folder.path(), &record("house", 0, 1.0)).unwrap();
        std::fs::write(folder.path().join("README.md"), page() + "\nafter\n").unwrap();
        write(folder.path(), &record("block", 1, 7.0)).unwrap();
        let text = page();
        assert!(text.starts_with("# Mine\n\nbefore\n") && text.ends_with("\nafter\n"), "{text}");
        assert!(text.contains("| block | default | 7.0 / 14.0 | 7.0 / 14.0 | 7.0 / 14.0 | 14.00 | 3 | 3 |"), "{text}");
        assert!(!text.contains("4.0 / 8.0"), "the earlier record is gone: {text}");
        let (house, block) = (text.find("| house |").unwrap(), text.find("| block |").unwrap());
        assert!(house < block, "in the order of the scenes");
        assert!(text.contains("1.000 / 0.500") && text.contains("2026-01-02") && text.contains("99.5"), "{text}");
        std::fs::write(folder.path().join("README.md"), BEGIN).unwrap();
        assert!(write(folder.path(), &record("house", 0, 1.0)).is_err(), "a page with half a mark is left alone");
        assert_eq!(page(), BEGIN);
    }
}
