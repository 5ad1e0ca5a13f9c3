//! The table of the benchmark, at the terminal and in a page whose other text stays.

use super::page::{self, Place};
use super::record::{Entry, Figures, Record};
use std::path::Path;

const PLACE: Place =
    Place { records: "records.json", begin: "<!-- gable bench: begin -->", end: "<!-- gable bench: end -->" };

/// A row of one of the tables: names first. A row that was left out has its reason in the first cell after them.
fn row(entry: &Entry, width: usize, cells: impl Fn(&Record) -> Vec<String>) -> Vec<String> {
    let (scene, name, variant) = entry.key();
    let mut out = vec![scene.to_owned(), variant.unwrap_or(name).to_owned()];
    match entry {
        Entry::Measured(record) => out.extend(cells(record)),
        Entry::LeftOut(left) => {
            out.push(format!("left out: {}", left.reason));
            out.resize(width, String::new());
        }
    }
    out
}

/// Heads of the columns of [`quality_cells`].
pub(super) const QUALITY: [&str; 15] = [
    "labels mIoU",
    "mIoU, 1 m along borders",
    "building IoU",
    "tree IoU",
    "compl. / corr. ≥ 50 m²",
    "compl. / corr. ≥ 10 m²",
    "IoU of blocks",
    "IoU of buildings",
    "roof RMSE, m",
    "within planes, m",
    "truth→model RMS, m",
    "polygons",
    "roof polygons",
    "triangles",
    "valid, %",
];

/// The figures of an evaluation.
pub(super) fn quality_cells(f: &Figures) -> Vec<String> {
    let (share, pair) = (|v: f64| format!("{v:.3}"), |p: [f64; 2]| format!("{:.3} / {:.3}", p[0], p[1]));
    vec![
        share(f.label_mean_iou),
        share(f.border_mean_iou),
        share(f.building_iou),
        share(f.tree_iou),
        pair(f.found_50),
        pair(f.found_10),
        share(f.block_iou_50),
        share(f.building_footprint_iou),
        share(f.roof_rmse_50),
        share(f.plane_rmse_50),
        share(f.truth_to_model_50),
        format!("{:.2}", f.polygons),
        format!("{:.2}", f.roof_polygons),
        format!("{:.2}", f.triangles),
        format!("{:.1}", 100.0 * f.valid),
    ]
}

fn quality(entries: &[&Entry]) -> Vec<Vec<String>> {
    let mut head = vec!["scene", "row"];
    head.extend(QUALITY);
    head.push("same in 1×1 and 16×16, %");
    let mut rows = vec![head.iter().map(|h| (*h).to_owned()).collect::<Vec<_>>()];
    rows.extend(entries.iter().map(|entry| {
        row(entry, head.len(), |r| {
            let mut cells = quality_cells(&r.figures);
            cells.push(r.grids.map_or_else(|| "-".to_owned(), |g| format!("{:.1}", 100.0 * g.same)));
            cells
        })
    }));
    rows
}

fn costs(entries: &[&Entry]) -> Vec<Vec<String>> {
    // The stages of all rows, in the order of the first.
    let mut stages: Vec<&str> = Vec::new();
    let measured = entries.iter().filter_map(|e| if let Entry::Measured(r) = e { Some(r) } else { None });
    for stage in measured.flat_map(|r| &r.run.stages) {
        if !stages.contains(&stage.name.as_str()) {
            stages.push(&stage.name);
        }
    }
    let mut head: Vec<String> = ["scene", "row", "synth"].map(str::to_owned).to_vec();
    head.extend(stages.iter().map(|s| (*s).to_owned()));
    head.extend(
        ["run", "run, per km²", "core µs per pixel", "all threads against one", "peak, MB (synth)", "peak, MB (run)"]
            .map(str::to_owned),
    );
    let width = head.len();
    let mut rows = vec![head];
    let seconds = |wall: f64, core: f64| format!("{wall:.1} / {core:.1}");
    let megabytes = |bytes: u64| format!("{:.0}", bytes as f64 / 1e6);
    rows.extend(entries.iter().map(|entry| {
        row(entry, width, |r| {
            let mut cells = vec![seconds(r.synth.wall, r.synth.core)];
            cells.extend(stages.iter().map(|name| {
                let stage = r.run.stages.iter().find(|s| s.name == *name);
                stage.map_or_else(|| "-".to_owned(), |s| seconds(s.wall, s.core))
            }));
            let whole = r.run.whole;
            cells.push(seconds(whole.wall, whole.core));
            cells.push(seconds(whole.wall / r.area_km2, whole.core / r.area_km2));
            cells.push(format!("{:.2}", r.run.micros_per_pixel()));
            cells.push(r.one_thread.map_or_else(|| "-".to_owned(), |one| format!("{:.2}", one.wall / whole.wall)));
            cells.push(megabytes(r.synth.peak_memory_bytes));
            cells.push(megabytes(whole.peak_memory_bytes));
            cells
        })
    }));
    rows
}

fn scenes(entries: &[&Entry]) -> Vec<Vec<String>> {
    let head = [
        "scene",
        "row",
        "buildings from",
        "seed",
        "km²",
        "faces",
        "per m²",
        "slope",
        "texture",
        "noise",
        "date",
        "cores",
        "build",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(entries.iter().filter(|e| matches!(e, Entry::Measured(_))).map(|entry| {
        row(entry, head.len(), |r| {
            vec![
                r.source.clone(),
                r.seed.to_string(),
                format!("{:.3}", r.area_km2),
                r.mesh_faces.to_string(),
                format!("{}", r.sensing.density),
                format!("{}", r.sensing.slope),
                if r.sensing.texture { "yes" } else { "no" }.to_owned(),
                format!("{}", r.sensing.noise),
                r.date.clone(),
                r.cores.to_string(),
                r.build.clone(),
            ]
        })
    }));
    rows
}

/// The rows of the scenes themselves, and those of their variants, each scene's own default row before them.
fn parted(entries: &[Entry]) -> [Vec<&Entry>; 2] {
    let is_variant = |e: &Entry| e.key().2.is_some();
    let (own, other): (Vec<&Entry>, Vec<&Entry>) = entries.iter().partition(|e| !is_variant(e));
    let varied = |e: &Entry| e.order()[1] == 0 && other.iter().any(|o| o.key().0 == e.key().0);
    let mut variants: Vec<&Entry> = own.iter().copied().filter(|e| varied(e)).chain(other.iter().copied()).collect();
    variants.sort_by_key(|e| e.order());
    [own, variants]
}

/// For the terminal.
pub(crate) fn text(entries: &[Entry]) -> String {
    let [own, variants] = parted(entries);
    let tables = [own, variants].into_iter().filter(|list| !list.is_empty());
    let texts: Vec<String> =
        tables.flat_map(|list| [quality(&list), costs(&list)]).map(|rows| crate::table::render(&rows)).collect();
    texts.join("\n")
}

fn markdown(entries: &[Entry]) -> String {
    let [own, variants] = parted(entries);
    let mut out = page::markdown("Quality:", &quality(&own));
    out += &page::markdown("Wall and core seconds of each stage, time and memory:", &costs(&own));
    if !variants.is_empty() {
        out += &page::markdown("Variants of a scene, default row, quality:", &quality(&variants));
        out += &page::markdown("Variants of a scene, default row, time and memory:", &costs(&variants));
    }
    out + &page::markdown("Scenes and machines:", &scenes(&entries.iter().collect::<Vec<_>>()))
}

/// Puts an entry among those of a folder, in place of an earlier one of the same scene, row and variant, and makes the tables of the
/// folder's `README.md` anew.
pub(crate) fn write(folder: &Path, entry: &Entry) -> anyhow::Result<()> {
    let put = |entries: &mut Vec<Entry>| {
        entries.retain(|e| e.key() != entry.key());
        entries.push(entry.clone());
        entries.sort_by_key(Entry::order);
    };
    page::change(folder, &PLACE, put, markdown)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::bench::record::{Cost, Grids, LeftOut, Sensing, Stage, Timing};

    fn record(scene: &str, place: usize, seconds: f64, variant: Option<&str>) -> Entry {
        let figures = Figures {
            label_mean_iou: 0.9,
            border_mean_iou: 0.7,
            building_iou: 0.95,
            tree_iou: 0.8,
            found_50: [1.0, 0.5],
            found_10: [0.75, 0.25],
            block_iou_50: 0.97,
            building_footprint_iou: 0.6,
            roof_rmse_50: 0.123,
            plane_rmse_50: 0.1,
            truth_to_model_50: 0.2,
            polygons: 1.1,
            roof_polygons: 1.0,
            triangles: 1.2,
            valid: 0.995,
        };
        let whole = Cost { wall: seconds, core: 2.0 * seconds, peak_memory_bytes: 3_000_000 };
        let stages = vec![Stage { name: "split".to_owned(), wall: seconds, core: 2.0 * seconds }];
        Entry::Measured(Box::new(Record {
            scene: scene.to_owned(),
            row: "default".to_owned(),
            variant: variant.map(str::to_owned),
            order: [place, 0, usize::from(variant.is_some())],
            source: "procedural".to_owned(),
            seed: 11,
            sensing: Sensing { density: 7.5, slope: 0.05, texture: true, noise: 1.0 },
            mesh_faces: 75_000,
            area_km2: 0.01,
            date: "2026-01-02".to_owned(),
            cores: 2,
            build: "release".to_owned(),
            synth: whole,
            run: Timing { stages, whole, pixels: 1_000_000, threads: 2 },
            eval_seconds: 1.0,
            figures,
            one_thread: Some(Cost { wall: 1.9 * seconds, ..whole }),
            grids: Some(Grids { buildings: 4, same: 0.75 }),
        }))
    }

    #[test]
    fn tables_change_and_the_text_around_them_stays() {
        let folder = tempfile::tempdir().unwrap();
        let page = || std::fs::read_to_string(folder.path().join("README.md")).unwrap();
        std::fs::write(folder.path().join("README.md"), "# Mine\n\nbefore\n").unwrap();
        write(folder.path(), &record("block", 1, 4.0, None)).unwrap();
        write(folder.path(), &record("house", 0, 1.0, None)).unwrap();
        std::fs::write(folder.path().join("README.md"), page() + "\nafter\n").unwrap();
        write(folder.path(), &record("block", 1, 7.0, None)).unwrap();
        let text = page();
        assert!(text.starts_with("# Mine\n\nbefore\n") && text.ends_with("\nafter\n"), "{text}");
        assert!(
            text.contains(
                "| block | default | 7.0 / 14.0 | 7.0 / 14.0 | 7.0 / 14.0 | 700.0 / 1400.0 | 14.00 | 1.90 | 3 | 3 |"
            ),
            "{text}"
        );
        assert!(!text.contains("4.0 / 8.0"), "the earlier record is gone: {text}");
        let (house, block) = (text.find("| house |").unwrap(), text.find("| block |").unwrap());
        assert!(house < block, "in the order of the scenes");
        assert!(
            text.contains("1.000 / 0.500") && text.contains("2026-01-02") && text.contains("| 99.5 | 75.0 |"),
            "{text}"
        );
        assert!(!text.contains("Variants"), "there are none: {text}");
        write(folder.path(), &record("block", 1, 9.0, Some("no texture"))).unwrap();
        let reason = "takes an hour".to_owned();
        let left = LeftOut { scene: "house".to_owned(), row: "published".to_owned(), order: [0, 1, 0], reason };
        write(folder.path(), &Entry::LeftOut(left)).unwrap();
        let text = page();
        let variants = &text[text.find("Variants").unwrap()..];
        assert!(variants.find("| block | default |") < variants.find("| block | no texture |"), "{variants}");
        assert_eq!(text.matches("| house | published | left out: takes an hour |").count(), 2, "{text}");
        let widths: Vec<usize> =
            text.lines().filter(|l| l.contains("| house |")).map(|l| l.matches('|').count()).collect();
        assert_eq!((widths[0], widths[2]), (widths[1], widths[3]), "as wide as its table: {text}");
        std::fs::write(folder.path().join("README.md"), PLACE.begin).unwrap();
        assert!(write(folder.path(), &record("house", 0, 1.0, None)).is_err(), "a page with half a mark is left alone");
        assert_eq!(page(), PLACE.begin);
    }
}
