//! The figures as a table, for the terminal and for the report.

use crate::{Coherence, Evaluation, Inspection, LabelFigures, Regularity, Spread, Validity};
use std::fmt::Write;

/// Figures that belong together: a heading, names of columns and rows.
#[derive(Clone, Debug)]
pub(crate) struct Section {
    pub(crate) title: &'static str,
    /// Empty if there is one column that needs no name.
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<(String, Vec<String>)>,
}

impl Section {
    fn new(title: &'static str, columns: &[&str]) -> Self {
        Self { title, columns: columns.iter().map(|c| (*c).to_owned()).collect(), rows: Vec::new() }
    }

    fn row(&mut self, name: impl Into<String>, cells: impl IntoIterator<Item = String>) {
        self.rows.push((name.into(), cells.into_iter().collect()));
    }
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

fn metres(v: f64) -> String {
    format!("{v:.3} m")
}

fn degrees(v: f64) -> String {
    format!("{v:.2}°")
}

fn figure(v: f64) -> String {
    format!("{v:.3}")
}

const SPREAD: [&str; 5] = ["mean", "RMS", "95 %", "max", "samples"];

const LOD2_ROOFS: &str = "LOD2 roof surfaces → mesh";

fn spread(s: &Spread) -> Vec<String> {
    vec![metres(s.mean), metres(s.rms), metres(s.p95), metres(s.max), s.count.to_string()]
}

pub(crate) fn sections(e: &Evaluation) -> Vec<Section> {
    let mut out = vec![objects(e), footprints(e), roofs(e), planes(e), spreads(e)];
    if !e.furthest.is_empty() {
        out.push(furthest(e));
    }
    out.push(complexity(e));
    out.push(validity([&e.validity, &e.validity_strict]));
    out.push(regularity(&[("truth", &e.regularity_truth), ("result", &e.regularity)]));
    out.push(coherence(&e.coherence));
    if let Some(l) = &e.labels {
        out.push(labels("Labels", &l.all));
        out.push(labels("Labels within 1 m of a border", &l.border));
    }
    if let Some(a) = &e.agreement {
        let mut s = Section::new("Agreement with another run", &[]);
        s.row(
            "the same id and footprint (IoU ≥ 0.98)",
            [format!("{} of {} ({})", a.same, a.buildings, percent(a.share))],
        );
        s.row("the same id", [a.same_id.to_string()]);
        out.push(s);
    }
    out
}

/// What can be said of a model without truth.
pub(crate) fn inspection(i: &Inspection) -> Vec<Section> {
    let mut size = Section::new("Complexity", &["in all", "each building"]);
    size.row("buildings", [i.size.buildings.to_string()]);
    for (name, all, mean) in [
        ("polygons", i.size.polygons, i.per_building.polygons),
        ("roof polygons", i.size.roof_polygons, i.per_building.roof_polygons),
        ("triangles", i.size.triangles, i.per_building.triangles),
        ("vertices", i.size.vertices, i.per_building.vertices),
    ] {
        size.row(name, [all.to_string(), format!("{mean:.1}")]);
    }
    let mut out = Vec::new();
    if let (Some(model), Some(roofs)) = (&i.model_to_mesh, &i.lod2_roofs_to_mesh) {
        let mut s = Section::new("Distances", &SPREAD);
        s.row("model → mesh", spread(model));
        s.row(LOD2_ROOFS, spread(roofs));
        out.push(s);
    }
    out.push(size);
    out.push(validity([&i.validity, &i.validity_strict]));
    out.push(regularity(&[("result", &i.regularity)]));
    out.push(coherence(&i.coherence));
    out
}

fn objects(e: &Evaluation) -> Section {
    let columns = ["completeness", "correctness", "quality", "found", "correct"];
    let mut s = Section::new("Buildings", &columns);
    for d in &e.objects {
        let name = if d.from_m2 > 0.0 { format!("from {} m²", d.from_m2) } else { "all".to_owned() };
        for (by, rates) in [("buildings", &d.per_object), ("area", &d.per_area)] {
            let mut cells = vec![percent(rates.completeness), percent(rates.correctness), percent(rates.quality)];
            if by == "buildings" {
                cells.push(format!("{} of {}", d.found, d.truth));
                cells.push(format!("{} of {}", d.correct, d.result));
            }
            s.row(format!("{name}, by {by}"), cells);
        }
    }
    s
}

fn footprints(e: &Evaluation) -> Section {
    let f = &e.footprints;
    let mut s = Section::new("Footprints (IoU)", &["mean", "median", "≥ 0.9", "footprints"]);
    for (name, o) in [
        ("buildings", &f.buildings),
        ("buildings from 50 m²", &f.buildings_from_50),
        ("connected blocks", &f.blocks),
        ("connected blocks from 50 m²", &f.blocks_from_50),
    ] {
        s.row(name, [figure(o.mean_iou), figure(o.median_iou), percent(o.above_90), o.count.to_string()]);
    }
    s.row("corners within 2 m", [percent(f.corners_found)]);
    s.row("corners against truth", [figure(f.corner_ratio)]);
    s
}

fn roofs(e: &Evaluation) -> Section {
    let r = &e.roofs;
    let mut s = Section::new("Roofs", &[]);
    for (name, value) in [
        ("buildings matched", r.matched.to_string()),
        ("roof area covered", percent(r.covered)),
        ("height RMSE, median of buildings", metres(r.height_rmse_median)),
        ("height RMSE, median from 50 m²", metres(r.height_rmse_median_from_50)),
        ("height RMSE within planes, median from 50 m²", metres(r.height_rmse_of_planes_median_from_50)),
        ("height RMSE, all samples", metres(r.height_rmse)),
        ("height bias", metres(r.height_bias)),
        ("slope error", degrees(r.slope_error_deg)),
        ("azimuth error", degrees(r.azimuth_error_deg)),
        ("ridge bias", metres(r.ridge_bias)),
        ("eave bias", metres(r.eave_bias)),
        ("volume against truth", figure(r.volume_ratio)),
    ] {
        s.row(name, [value]);
    }
    s
}

fn planes(e: &Evaluation) -> Section {
    let p = &e.roofs.planes;
    let mut s = Section::new("Roof planes", &[]);
    s.row("truth, result", [format!("{}, {}", p.truth, p.result)]);
    s.row("1:1", [format!("{} ({} of the area)", p.one_to_one, percent(p.one_to_one_area))]);
    for (name, count) in [
        ("1:n", p.one_to_many),
        ("n:1", p.many_to_one),
        ("n:m", p.many_to_many),
        ("missed", p.missed),
        ("invented", p.invented),
    ] {
        s.row(name, [count.to_string()]);
    }
    s
}

fn spreads(e: &Evaluation) -> Section {
    let (d, f, r) = (&e.distances, &e.footprints, &e.roofs);
    let mut s = Section::new("Distances", &SPREAD);
    s.row("truth → model", spread(&d.truth_to_model));
    s.row("truth → model, found, from 50 m²", spread(&d.truth_to_model_found_from_50));
    s.row("model → truth", spread(&d.model_to_truth));
    let optional = [
        ("model → mesh", &d.model_to_mesh),
        (LOD2_ROOFS, &d.lod2_roofs_to_mesh),
        ("truth → mesh", &d.truth_to_mesh),
        ("roof points → roofs", &d.roof_points_to_roofs),
    ];
    for (name, value) in optional {
        if let Some(value) = value {
            s.row(name, spread(value));
        }
    }
    s.row("outline, truth → result", spread(&f.outline_truth_to_result));
    s.row("outline, result → truth", spread(&f.outline_result_to_truth));
    s.row("corner offset", spread(&f.corner_offset));
    s.row("ridge height", spread(&r.ridge_error));
    s.row("eave height", spread(&r.eave_error));
    if let Some(t) = &e.terrain {
        s.row("terrain, open", spread(&t.open));
        s.row("terrain, under roofs", spread(&t.under_roofs));
    }
    s
}

fn furthest(e: &Evaluation) -> Section {
    let mut s = Section::new("Furthest from the model", &["of the squares", "RMS", "x", "y"]);
    for f in &e.furthest {
        let [x, y] = f.at.map(|v| format!("{v:.1}"));
        s.row(f.id.clone(), [percent(f.share), metres(f.rms), x, y]);
    }
    s
}

fn complexity(e: &Evaluation) -> Section {
    let c = &e.complexity;
    let mut s = Section::new("Complexity", &["truth", "result", "truth each", "result each", "matched, against truth"]);
    let (t, r, a) = (&c.truth_per_building, &c.result_per_building, &c.against_truth);
    for (name, counts, means, ratio) in [
        ("polygons", [c.truth.polygons, c.result.polygons], [t.polygons, r.polygons], a.polygons),
        (
            "roof polygons",
            [c.truth.roof_polygons, c.result.roof_polygons],
            [t.roof_polygons, r.roof_polygons],
            a.roof_polygons,
        ),
        ("triangles", [c.truth.triangles, c.result.triangles], [t.triangles, r.triangles], a.triangles),
        ("vertices", [c.truth.vertices, c.result.vertices], [t.vertices, r.vertices], a.vertices),
    ] {
        let means = means.map(|m| format!("{m:.1}"));
        s.row(name, counts.map(|n| n.to_string()).into_iter().chain(means).chain([figure(ratio)]));
    }
    s
}

fn validity([default, strict]: [&Validity; 2]) -> Section {
    let mut s = Section::new("Validity of the result", &["LOD0", "LOD1", "LOD2", "no LOD2", "codes (buildings)"]);
    for (name, v) in [("default tolerances", default), ("strict tolerances", strict)] {
        let codes: Vec<String> = v.codes.iter().map(|(code, count)| format!("{code} ({count})")).collect();
        let codes = if codes.is_empty() { "none".to_owned() } else { codes.join(", ") };
        s.row(name, [percent(v.lod0), percent(v.lod1), percent(v.lod2), v.without_lod2.to_string(), codes]);
    }
    s
}

fn regularity(models: &[(&str, &Regularity)]) -> Section {
    let mut s = Section::new("Regularity", &models.iter().map(|m| m.0).collect::<Vec<_>>());
    let mut row = |name: &str, cell: fn(&Regularity) -> String| s.row(name, models.iter().map(|m| cell(m.1)));
    row("wall length along the axes (1°)", |v| percent(v.aligned_walls));
    row("distinct normals of a building", |v| format!("{:.1}", v.distinct_normals));
    row("almost coplanar faces that are exactly so", |v| percent(v.exactly_coplanar));
    row("edges under 0.3 m", |v| percent(v.short_edges));
    row("faces under 0.5 m²", |v| percent(v.small_faces));
    s
}

fn coherence(c: &Coherence) -> Section {
    let mut s = Section::new("Coherence of the result's LODs", &[]);
    s.row("buildings with LOD0, 1 and 2", [c.complete.to_string()]);
    s.row("LOD1 on the LOD0 footprint", [percent(c.lod1_on_lod0)]);
    s.row("LOD2 on the LOD0 footprint", [percent(c.lod2_on_lod0)]);
    s.row("volumes of LOD1 and LOD2 within 5 %", [percent(c.volumes)]);
    s
}

fn labels(title: &'static str, l: &LabelFigures) -> Section {
    let mut s = Section::new(title, &["IoU", "share of truth"]);
    for class in &l.classes {
        s.row(class.name.clone(), [class.iou.map_or_else(|| "–".to_owned(), percent), percent(class.share)]);
    }
    s.row("mean IoU", [percent(l.mean_iou)]);
    s.row("overall accuracy", [percent(l.accuracy), format!("{} pixels", l.pixels)]);
    s
}

/// Plain text, columns aligned.
pub(crate) fn text(sections: &[Section]) -> String {
    let mut out = String::new();
    for section in sections {
        let columns = section.rows.iter().map(|r| r.1.len()).chain([section.columns.len()]).max().unwrap_or(0);
        let width = |k: usize| {
            let head = section.columns.get(k).map_or(0, |c| c.chars().count());
            let cells = section.rows.iter().filter_map(|r| r.1.get(k)).map(|c| c.chars().count());
            cells.fold(head, usize::max)
        };
        let names = section.rows.iter().map(|r| r.0.chars().count());
        let first = names.fold(section.title.chars().count(), usize::max);
        let mut line = |name: &str, cells: &[String]| {
            let mut text = format!("{name:<first$}");
            for (k, cell) in cells.iter().enumerate().take(columns) {
                // Writing to a string cannot fail.
                let _ = write!(text, "  {cell:>w$}", w = width(k));
            }
            out.push_str(text.trim_end());
            out.push('\n');
        };
        line(section.title, &section.columns);
        line(&"─".repeat(first), &[]);
        for (name, cells) in &section.rows {
            line(name, cells);
        }
        out.push('\n');
    }
    out
}
