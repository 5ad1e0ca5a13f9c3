//! A page with tables made from records that stand beside it; its other text stays.

use anyhow::Context as _;
use serde::{Serialize, de::DeserializeOwned};
use std::fmt::Write as _;
use std::path::Path;

const PAGE: &str = "# Benchmark\n";

/// Where records and tables of one kind stand in a folder.
pub(super) struct Place {
    /// File of all records that were ever kept.
    pub(super) records: &'static str,
    /// What stands in `README.md` between these lines belongs to the command.
    pub(super) begin: &'static str,
    pub(super) end: &'static str,
}

/// Changes the records of a folder and makes their tables in its `README.md` anew.
pub(super) fn change<T: Serialize + DeserializeOwned>(
    folder: &Path,
    place: &Place,
    change: impl FnOnce(&mut Vec<T>),
    tables: impl FnOnce(&[T]) -> String,
) -> anyhow::Result<()> {
    let named = |path: &Path| path.display().to_string();
    std::fs::create_dir_all(folder).with_context(|| named(folder))?;
    let kept = folder.join(place.records);
    let mut records: Vec<T> = match std::fs::read_to_string(&kept) {
        Ok(text) => serde_json::from_str(&text).with_context(|| named(&kept))?,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        Err(e) => return Err(e).with_context(|| named(&kept)),
    };
    change(&mut records);
    let page = folder.join("README.md");
    let old = match std::fs::read_to_string(&page) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => PAGE.to_owned(),
        read => read.with_context(|| named(&page))?,
    };
    let new = replaced(&old, &tables(&records), place).with_context(|| named(&page))?;
    std::fs::write(&kept, serde_json::to_string_pretty(&records)? + "\n").with_context(|| named(&kept))?;
    std::fs::write(&page, new).with_context(|| named(&page))
}

/// The page with other tables; they come at its end where it has none.
fn replaced(page: &str, tables: &str, place: &Place) -> anyhow::Result<String> {
    let (begin, end) = (place.begin, place.end);
    let tables = format!("{begin}\n\n{tables}{end}");
    match (page.find(begin), page.find(end)) {
        (Some(from), Some(to)) if from < to => Ok(format!("{}{tables}{}", &page[..from], &page[to + end.len()..])),
        (None, None) => Ok(format!("{}\n\n{tables}\n", page.trim_end())),
        _ => anyhow::bail!("one of the lines {begin:?} and {end:?} is missing"),
    }
}

/// A titled table in Markdown; the first row is its head.
pub(super) fn markdown(title: &str, rows: &[Vec<String>]) -> String {
    let mut out = format!("{title}\n\n");
    for (i, row) in rows.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "| {} |", row.join(" | "));
        if i == 0 {
            let _ = writeln!(out, "|{}", "---|".repeat(row.len()));
        }
    }
    out.push('\n');
    out
}
