//! The page: tables and pictures in one file, without references to others.

use super::pictures::{OUTLINES, PictureSet, azimuth_colour};
use super::svg;
use crate::{BuildingRecord, Lod, RunStatus, RunSummary};
use gable_segmentation::Label;
use std::fmt::Write as _;

/// Rows of a table of buildings; the rest is in report.json.
const ROWS: usize = 2000;

/// Text that is safe between tags and in attributes.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Standard base64 with padding.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let group = chunk.iter().fold(0u32, |v, &b| v << 8 | u32::from(b)) << (8 * (3 - chunk.len()));
        for digit in 0..4 {
            let value = group >> (18 - 6 * digit) & 63;
            out.push(if digit <= chunk.len() { char::from(DIGITS[value as usize]) } else { '=' });
        }
    }
    out
}

/// A count with thin spaces between thousands.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// The whole page.
pub(super) fn page(title: &str, summary: &RunSummary, pictures: &[PictureSet]) -> String {
    let mut page = String::new();
    let title = escape(title);
    page += "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
    page += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
    let _ = write!(
        page,
        "<title>{title}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n",
        include_str!("style.css")
    );
    head(&mut page, &title, summary);
    attention(&mut page, summary);
    for (at, set) in pictures.iter().enumerate() {
        picture_set(&mut page, set);
        if at == 0 {
            legend(&mut page);
        }
    }
    levels(&mut page, summary);
    drawings(&mut page, summary);
    buildings(&mut page, summary);
    stages(&mut page, summary);
    settings(&mut page, summary);
    let _ = write!(page, "</main>\n<script>\n{}</script>\n</body>\n</html>\n", include_str!("script.js"));
    page
}

fn head(page: &mut String, title: &str, summary: &RunSummary) {
    let (class, word) = match summary.status {
        RunStatus::Successful => ("", "successful"),
        RunStatus::Partial => (" partial", "partial"),
    };
    let _ = writeln!(page, "<h1>{title} <span class=\"badge{class}\">{word}</span></h1>");
    let _ = writeln!(
        page,
        "<p class=\"soft\">{} · {} · {} × {} blocks · pixels of {} m · gable {}</p>",
        escape(&summary.input),
        if summary.crs == "unknown" { "reference system unknown".to_owned() } else { escape(&summary.crs) },
        summary.grid[0],
        summary.grid[1],
        summary.step_m,
        escape(&summary.version)
    );
    let lod2 = summary.at_lod(Lod::Lod2);
    let share = if summary.buildings == 0 { 0.0 } else { 100.0 * lod2 as f64 / summary.buildings as f64 };
    let rmse = median(summary.building_records.iter().filter_map(|b| b.rmse_m).collect());
    let tiles = [
        (grouped(summary.buildings as u64), "buildings"),
        (format!("{share:.1} %"), "of them at LOD2"),
        (grouped(summary.faces), "faces"),
        (rmse.map_or("–".to_owned(), |v| format!("{v:.2} m")), "roof RMSE, median"),
        (format!("{:.3} km²", summary.area_m2 / 1e6), "area"),
        (grouped(summary.triangles), "input triangles"),
        (format!("{:.1} s", summary.seconds), "wall clock"),
        (format!("{:.2} µs", summary.core_micros_per_pixel()), "core time per pixel"),
        (format!("{:.0} MB", summary.peak_memory_bytes as f64 / 1e6), "peak memory"),
    ];
    *page += "<div class=\"tiles\">";
    for (value, name) in tiles {
        let _ = write!(page, "<div class=\"tile\"><b>{value}</b><span>{name}</span></div>");
    }
    *page += "</div>\n";
}

/// The middle value; the upper one of two.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn picture_set(page: &mut String, set: &PictureSet) {
    let _ = write!(page, "<h2>{}</h2>\n<div class=\"pictures\">\n", escape(&set.title));
    for picture in &set.pictures {
        let _ = writeln!(
            page,
            "<figure><img width=\"{}\" height=\"{}\" alt=\"{}\" src=\"data:{};base64,{}\"><figcaption>{}</figcaption></figure>",
            picture.size.0,
            picture.size.1,
            picture.caption,
            picture.mime,
            base64(&picture.bytes),
            picture.caption
        );
    }
    *page += "</div>\n";
}

/// What the colours of the pictures mean.
fn legend(page: &mut String) {
    *page += "<div class=\"legend\">";
    let css = |c: [u8; 3]| format!("rgb({} {} {})", c[0], c[1], c[2]);
    let mut entry = |colour: [u8; 3], name: &str| {
        let _ = write!(page, "<span><i style=\"background:{}\"></i>{name}</span>", css(colour));
    };
    OUTLINES.iter().for_each(|(colour, name)| entry(*colour, &format!("outline: {name}")));
    Label::ALL.iter().for_each(|label| entry(label.colour(), label.name()));
    for (azimuth, name) in [(0.0, "north"), (90.0, "east"), (180.0, "south"), (270.0, "west")] {
        entry(azimuth_colour(azimuth, 35.0), &format!("roof falls {name}"));
    }
    entry(azimuth_colour(0.0, 0.0), "flat roof");
    *page += "</div>\n";
}

fn stages(page: &mut String, summary: &RunSummary) {
    *page += "<h2>Stages</h2>\n<div class=\"scroll\"><table><tr><th class=\"text\">stage</th><th>wall, s</th><th>core, s</th><th>core, µs per pixel</th><th class=\"text\">share of core time</th></tr>\n";
    let all: f64 = summary.stages.iter().map(|s| s.core).sum();
    for stage in &summary.stages {
        let share = if all > 0.0 { 100.0 * stage.core / all } else { 0.0 };
        let per_pixel = if summary.pixels > 0 { stage.core * 1e6 / summary.pixels as f64 } else { 0.0 };
        let _ = writeln!(
            page,
            "<tr><td class=\"text\">{}</td><td>{:.2}</td><td>{:.2}</td><td>{per_pixel:.2}</td><td class=\"share\"><span style=\"width:{share:.1}%\"></span></td></tr>",
            stage.stage, stage.wall, stage.core
        );
    }
    *page += "</table></div>\n";
}

fn drawings(page: &mut String, summary: &RunSummary) {
    let of = |f: fn(&BuildingRecord) -> Option<f64>| summary.building_records.iter().filter_map(f).collect::<Vec<_>>();
    let _ = write!(
        page,
        "<h2>Blocks and buildings</h2>\n<div class=\"panels\">\n<div class=\"panel\"><p class=\"soft\">Blocks by seconds, north up</p>{}</div>\n<div class=\"panel\"><p class=\"soft\">Buildings by roof RMSE</p>{}<p class=\"soft\">Buildings by height</p>{}</div>\n</div>\n",
        svg::blocks(summary),
        svg::histogram(&of(|b| b.rmse_m), 0.6, 24, "m"),
        svg::histogram(&of(|b| Some(b.height_m)), 30.0, 24, "m")
    );
}

/// What a person has to look at: failed blocks, what was wrong in the input, buildings that are not what they should be.
fn attention(page: &mut String, summary: &RunSummary) {
    *page += "<h2>What needs attention</h2>\n";
    let failed: Vec<_> = summary.failed_blocks().collect();
    let lower: Vec<_> = summary.building_records.iter().filter(|b| b.lod != Lod::Lod2 || b.note.is_some()).collect();
    if failed.is_empty() && lower.is_empty() && summary.warnings.is_empty() {
        *page += "<p class=\"soft\">Nothing: the input is sound and every building has LOD2.</p>\n";
        return;
    }
    if !failed.is_empty() {
        let _ = writeln!(page, "<h3>Failed blocks ({}); the same command tries them again</h3>", failed.len());
        *page += "<div class=\"scroll tall\"><table class=\"bad\"><tr><th class=\"text\">block</th><th class=\"text\">reason</th></tr>\n";
        for block in failed {
            if let crate::BlockState::Failed(reason) = &block.status {
                let (ix, iy) = (block.ix, block.iy);
                let _ = writeln!(
                    page,
                    "<tr><td class=\"text\">{ix}_{iy}</td><td class=\"text long\">{}</td></tr>",
                    escape(reason)
                );
            }
        }
        *page += "</table></div>\n";
    }
    if !lower.is_empty() {
        let _ = writeln!(page, "<h3>Buildings below LOD2, or incomplete ({})</h3>", grouped(lower.len() as u64));
        table(page, lower, summary);
    }
    if !summary.warnings.is_empty() {
        *page += "<h3>The input</h3>\n<div class=\"scroll\"><table><tr><th>count</th><th class=\"text\">what</th><th class=\"text\">what became of it</th></tr>\n";
        for warning in &summary.warnings {
            let _ = write!(
                page,
                "<tr><td>{}</td><td class=\"text long\">{}",
                grouped(warning.count),
                escape(&warning.what)
            );
            if !warning.places.is_empty() {
                *page += "<details><summary>where</summary><ul>";
                warning.places.iter().for_each(|place| *page += &format!("<li>{}</li>", escape(place)));
                if warning.more() > 0 {
                    let _ = write!(page, "<li>and {} more</li>", grouped(warning.more()));
                }
                *page += "</ul></details>";
            }
            let _ = writeln!(page, "</td><td class=\"text long\">{}</td></tr>", escape(&warning.consequence));
        }
        *page += "</table></div>\n";
    }
}

fn name_of(lod: Lod) -> &'static str {
    match lod {
        Lod::None => "none",
        Lod::Lod0 => "LOD0",
        Lod::Lod1 => "LOD1",
        Lod::Lod2 => "LOD2",
    }
}

/// Buildings by level of detail, and by roof type.
fn levels(page: &mut String, summary: &RunSummary) {
    let records = &summary.building_records;
    if records.is_empty() {
        return;
    }
    let at = |lod: Lod| (name_of(lod).to_owned(), records.iter().filter(|b| b.lod == lod).collect::<Vec<_>>());
    let mut lods = vec![at(Lod::Lod2), at(Lod::Lod1), at(Lod::Lod0), at(Lod::None)];
    lods[3].0 = "not written".to_owned();
    let mut roofs: std::collections::BTreeMap<&str, Vec<&BuildingRecord>> = std::collections::BTreeMap::new();
    for (record, roof) in records.iter().filter_map(|b| Some((b, b.roof_type.as_deref()?))) {
        roofs.entry(roof).or_default().push(record);
    }
    let mut roofs: Vec<_> = roofs.into_iter().map(|(name, group)| (name.to_owned(), group)).collect();
    roofs.sort_by_key(|(_, group)| std::cmp::Reverse(group.len()));
    *page += "<h2>Buildings by level and roof</h2>\n<div class=\"panels\">\n";
    groups(page, "best level", &lods, records.len());
    groups(page, "roof type", &roofs, records.len());
    *page += "</div>\n";
}

/// A table of groups of buildings, of `all` buildings.
fn groups(page: &mut String, title: &str, groups: &[(String, Vec<&BuildingRecord>)], all: usize) {
    let _ = writeln!(
        page,
        "<div class=\"scroll\"><table><tr><th class=\"text\">{title}</th><th>buildings</th><th>share</th><th>faces</th><th>footprint, m²</th><th title=\"median over the buildings\">RMSE, m</th></tr>"
    );
    for (name, group) in groups {
        let rmse = median(group.iter().filter_map(|b| b.rmse_m).collect());
        let _ = writeln!(
            page,
            "<tr><td class=\"text\">{}</td><td>{}</td><td>{:.1} %</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escape(name),
            grouped(group.len() as u64),
            100.0 * group.len() as f64 / all.max(1) as f64,
            grouped(group.iter().map(|b| u64::from(b.faces)).sum()),
            grouped(group.iter().map(|b| b.area_m2).sum::<f64>().round() as u64),
            rmse.map_or("–".to_owned(), |v| format!("{v:.2}")),
        );
    }
    *page += "</table></div>\n";
}

fn buildings(page: &mut String, summary: &RunSummary) {
    let _ = writeln!(page, "<h2>All buildings ({})</h2>", grouped(summary.building_records.len() as u64));
    *page += "<p class=\"soft\">Click a heading to sort; a tile opens its CityJSON file.</p>\n";
    table(page, summary.building_records.iter().collect(), summary);
}

/// The largest buildings as a table that can be sorted.
fn table(page: &mut String, mut records: Vec<&BuildingRecord>, summary: &RunSummary) {
    records.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2).then_with(|| a.id.cmp(&b.id)));
    *page += "<div class=\"scroll tall\"><table class=\"sortable\"><tr><th class=\"text\">id</th><th class=\"text\">tile</th><th class=\"text\">LOD</th><th class=\"text\">roof</th><th>footprint, m²</th><th>height, m</th><th>RMSE, m</th><th>faces</th><th class=\"text\">remark</th></tr>\n";
    for b in records.iter().take(ROWS) {
        let tile = format!("{}_{}", b.tile[0], b.tile[1]);
        let file = ["city.json", "gml"].map(|ending| format!("tiles/{tile}.{ending}"));
        let tile = match file.iter().find(|f| summary.files.contains(f)) {
            Some(file) if b.lod != Lod::None => format!("<a href=\"{file}\">{tile}</a>"),
            _ => tile,
        };
        let remark: Vec<&str> = b.reason.iter().chain(&b.note).map(String::as_str).collect();
        let _ = writeln!(
            page,
            "<tr><td class=\"text id\">{}</td><td class=\"text\">{tile}</td><td class=\"text\">{}</td><td class=\"text\">{}</td><td>{:.1}</td><td>{:.1}</td><td>{}</td><td>{}</td><td class=\"text long\">{}</td></tr>",
            escape(&b.id),
            name_of(b.lod),
            escape(b.roof_type.as_deref().unwrap_or("–")),
            b.area_m2,
            b.height_m,
            b.rmse_m.map_or("–".to_owned(), |v| format!("{v:.2}")),
            b.faces,
            escape(&remark.join("; "))
        );
    }
    *page += "</table></div>\n";
    if records.len() > ROWS {
        let _ = writeln!(
            page,
            "<p class=\"soft\">{} smaller ones are in report.json.</p>",
            grouped((records.len() - ROWS) as u64)
        );
    }
}

fn settings(page: &mut String, summary: &RunSummary) {
    *page += "<h2>Settings and files</h2>\n";
    if summary.parameters.is_empty() {
        *page += "<p>Every parameter has its default.</p>\n";
    } else {
        *page +=
            "<div class=\"scroll\"><table><tr><th class=\"text\">parameter</th><th class=\"text\">value</th></tr>\n";
        for (name, value) in &summary.parameters {
            let _ = writeln!(
                page,
                "<tr><td class=\"text\">{}</td><td class=\"text\">{}</td></tr>",
                escape(name),
                escape(value)
            );
        }
        *page += "</table></div>\n";
    }
    let _ = write!(page, "<details><summary>Files ({})</summary><p class=\"soft\">", summary.files.len());
    for file in &summary.files {
        let file = escape(file);
        let _ = write!(page, "<a href=\"{file}\">{file}</a><br>");
    }
    *page += "</p></details>\n";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_as_in_rfc_4648() {
        let cases =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")];
        for (plain, coded) in cases {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xff, 0xfe]), "//4=");
    }

    #[test]
    fn thousands_are_grouped() {
        assert_eq!((grouped(7), grouped(1234567)), ("7".to_owned(), "1\u{202f}234\u{202f}567".to_owned()));
    }
}
