//! Of several models of one place in a folder, the finest: levels of detail, and variants that programs write side by side.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A mesh file of a folder with its size.
pub(crate) struct Candidate {
    pub(crate) path: PathBuf,
    pub(crate) bytes: u64,
}

/// Which files are left out, because another of the same place is finer.
///
/// Known are, by the names:
/// - `Tile_L14.obj` beside `Tile_L17.obj`: of a tile the highest level; with children, as in `Tile_L15_0`, `Tile_L16_00`, those that have
///   no finer one below;
/// - folders or endings `LOD0`, `LOD1`, … and folders `L14`, `L17`, …: programs number them either way, so that of the sets with the same names
///   around the number the one with the most bytes is the finest;
/// - OpenDroneMap's `odm_textured_model` beside `odm_textured_model_geo`, and 2.5D models (`odm_texturing_25d`) beside 3D ones.
pub(crate) fn coarser(files: &[Candidate]) -> BTreeSet<PathBuf> {
    let mut out = BTreeSet::new();
    let left = |out: &BTreeSet<PathBuf>| -> Vec<usize> {
        (0..files.len()).filter(|&i| !out.contains(&files[i].path)).collect()
    };
    // Levels of tiles: the tile's own children first.
    let mut tiles: BTreeMap<String, Vec<(u32, String, usize)>> = BTreeMap::new();
    for at in left(&out) {
        if let Some((tile, level, child)) = level_of(&files[at].path) {
            tiles.entry(tile).or_default().push((level, child, at));
        }
    }
    for levels in tiles.values() {
        let finest = levels.iter().map(|l| l.0).max().unwrap_or(0);
        let is_tree = levels.iter().any(|l| !l.1.is_empty());
        for (level, child, at) in levels {
            let has_finer = levels.iter().any(|(other, below, _)| other > level && below.starts_with(child.as_str()));
            if if is_tree { has_finer } else { *level < finest } {
                out.insert(files[*at].path.clone());
            }
        }
    }
    // Numbered sets.
    let mut sets: BTreeMap<String, BTreeMap<u32, (u64, Vec<usize>)>> = BTreeMap::new();
    for at in left(&out) {
        if let Some((around, number)) = numbered(&files[at].path) {
            let set = sets.entry(around).or_default().entry(number).or_default();
            set.0 += files[at].bytes;
            set.1.push(at);
        }
    }
    for levels in sets.values() {
        let most = levels.values().map(|set| set.0).max().unwrap_or(0);
        // Of equal sets the first.
        let best = levels.iter().find(|(_, set)| set.0 == most).map(|(number, _)| *number);
        for (_, (_, members)) in levels.iter().filter(|(number, _)| Some(**number) != best) {
            out.extend(members.iter().map(|at| files[*at].path.clone()));
        }
    }
    // Variants.
    let names: BTreeSet<String> = left(&out).into_iter().map(|at| plain(&files[at].path)).collect();
    for at in left(&out) {
        let name = plain(&files[at].path);
        let better = [
            name.strip_suffix("odm_textured_model.obj").map(|start| format!("{start}odm_textured_model_geo.obj")),
            flat_variant(&name),
        ];
        if better.into_iter().flatten().any(|better| names.contains(&better)) {
            out.insert(files[at].path.clone());
        }
    }
    out
}

fn plain(path: &Path) -> String {
    path.to_string_lossy().to_lowercase()
}

/// The name of the 3D model beside a 2.5D one: the same without the mark of the folder or the file.
fn flat_variant(name: &str) -> Option<String> {
    ["_25d", "_2.5d", "_2_5d", "_2d5", "-2.5d", "-25d"]
        .iter()
        .find(|mark| name.contains(**mark))
        .map(|mark| name.replace(mark, ""))
}

/// Of `…/Tile_+000_L17_01.obj`: the tile, its level, and the digits of the child.
fn level_of(path: &Path) -> Option<(String, u32, String)> {
    let stem = path.file_stem()?.to_string_lossy().to_lowercase();
    let at = stem.rfind("_l")?;
    let rest = &stem[at + 2..];
    let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let level = rest[..digits].parse().ok().filter(|_| digits <= 2)?;
    let child = match &rest[digits..] {
        "" => "",
        more => more.strip_prefix('_')?,
    };
    if !child.chars().all(|c| c.is_ascii_digit() || c == 't') {
        return None;
    }
    let folder = path.parent().map(plain).unwrap_or_default();
    Some((
        format!("{folder}/{}.{}", &stem[..at], path.extension()?.to_string_lossy().to_lowercase()),
        level,
        child.to_owned(),
    ))
}

/// Of a path with `LOD2` or a folder `L17` in it: what stands around the number, and the number. For a folder, what lies in it may have
/// other names in each set.
fn numbered(path: &Path) -> Option<(String, u32)> {
    let mut around = String::new();
    let parts: Vec<String> = path.components().map(|c| c.as_os_str().to_string_lossy().to_lowercase()).collect();
    let last = parts.len().checked_sub(1)?;
    for (i, part) in parts.iter().enumerate() {
        let found = if i == last { ending(part) } else { folder_number(part) };
        if let Some((mark, number)) = found {
            return Some((format!("{around}/{mark}"), number));
        }
        around += "/";
        around += part;
    }
    None
}

fn folder_number(name: &str) -> Option<(String, u32)> {
    let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let (start, number) = name.split_at(name.len() - digits);
    let number = number.parse().ok().filter(|_| digits <= 2)?;
    let start = start.trim_end_matches(['_', '-', ' ']);
    let is_level = start == "l" || start == "lod" || start.ends_with("_lod") || start.ends_with("-lod");
    is_level.then(|| (start.to_owned(), number))
}

/// Of `tile_lod2.obj`: `tile_lod.obj` and 2.
fn ending(name: &str) -> Option<(String, u32)> {
    let (stem, extension) = name.rsplit_once('.')?;
    let (start, number) = folder_number(stem)?;
    (start != "l").then(|| (format!("{start}.{extension}"), number))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(files: &[(&str, u64)]) -> Vec<String> {
        let files: Vec<Candidate> =
            files.iter().map(|(path, bytes)| Candidate { path: path.into(), bytes: *bytes }).collect();
        let out = coarser(&files);
        files.iter().filter(|f| !out.contains(&f.path)).map(|f| f.path.display().to_string()).collect()
    }

    #[test]
    fn of_levels_the_finest_of_each_tile() {
        let files = [
            ("d/T_0_L14.obj", 1),
            ("d/T_0_L17.obj", 9),
            ("d/T_0_L20.obj", 90),
            ("d/T_1_L14.obj", 1),
            ("d/T_1_L17.obj", 9),
        ];
        assert_eq!(kept(&files), ["d/T_0_L20.obj", "d/T_1_L17.obj"]);
        let tree = [
            ("d/T_L14_0.obj", 1),
            ("d/T_L15_00.obj", 1),
            ("d/T_L15_01.obj", 1),
            ("d/T_L16_000.obj", 1),
            ("d/T_L16_001.obj", 1),
        ];
        assert_eq!(kept(&tree), ["d/T_L15_01.obj", "d/T_L16_000.obj", "d/T_L16_001.obj"]);
        let other = [("d/House_Large.obj", 1), ("d/House_Lower.obj", 1), ("d/a_L.obj", 1), ("d/a_L1999.obj", 1)];
        assert_eq!(kept(&other).len(), 4);
    }

    #[test]
    fn of_numbered_sets_the_largest() {
        assert_eq!(
            kept(&[("d/LOD0/a.obj", 9), ("d/LOD0/b.obj", 9), ("d/LOD1/a.obj", 3), ("d/LOD1/b.obj", 3)]),
            ["d/LOD0/a.obj", "d/LOD0/b.obj"]
        );
        assert_eq!(kept(&[("d/lod1/x.obj", 3), ("d/lod2/y.obj", 30)]), ["d/lod2/y.obj"]);
        assert_eq!(kept(&[("d/L14/a.obj", 3), ("d/L17/a.obj", 30), ("d/L20/a.obj", 300)]), ["d/L20/a.obj"]);
        assert_eq!(
            kept(&[("d/a_LOD0.obj", 30), ("d/a_LOD1.obj", 3), ("d/b_LOD0.obj", 1)]),
            ["d/a_LOD0.obj", "d/b_LOD0.obj"]
        );
        assert_eq!(
            kept(&[("d/Tile_1/a.obj", 1), ("d/Tile_2/a.obj", 2), ("d/block1.obj", 1), ("d/block2.obj", 1)]).len(),
            4
        );
    }

    #[test]
    fn variants_side_by_side() {
        let odm = [
            ("p/odm_texturing/odm_textured_model.obj", 1),
            ("p/odm_texturing/odm_textured_model_geo.obj", 1),
            ("p/odm_texturing_25d/odm_textured_model_geo.obj", 1),
        ];
        assert_eq!(kept(&odm), ["p/odm_texturing/odm_textured_model_geo.obj"]);
        assert_eq!(kept(&[("a/city.obj", 1), ("a/city_2.5d.obj", 1)]), ["a/city.obj"]);
        assert_eq!(kept(&odm[2..]).len(), 1, "alone it is read");
    }
}
