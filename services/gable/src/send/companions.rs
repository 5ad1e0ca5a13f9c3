//! The files that go with an OBJ file: its libraries, the textures that they name, and what says where it lies.

use crate::exit::UsageError;
use anyhow::Context as _;
use gable_files::Reach;
use gable_scene::Lookup;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::{Component, Path, PathBuf};

/// Largest library, bytes.
const LARGEST: u64 = 64 << 20;

/// Longest line that may name a library, bytes: faces have longer ones.
const LONGEST: usize = 4096;

/// The OBJ file and what goes with it, as paths from its folder.
pub(super) fn of_obj(obj: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let folder = obj.parent().unwrap_or(Path::new("/"));
    let reach = Reach::within([folder])?;
    let mut lookup = Lookup::new(&reach);
    let mut files = BTreeSet::from([PathBuf::from(obj.file_name().unwrap_or_default())]);
    // A file that names no library may have one of its own name.
    let own = obj.with_extension("mtl").file_name().unwrap_or_default().to_string_lossy().into_owned();
    for library in libraries(obj)?.into_iter().chain([own]) {
        let Some(path) = located(&mut lookup, folder, folder, &library)? else { continue };
        if !files.insert(path.clone()) {
            continue;
        }
        let mut text = Vec::new();
        let file = File::open(folder.join(&path)).with_context(|| format!("library {}", path.display()))?;
        file.take(LARGEST).read_to_end(&mut text).with_context(|| format!("library {}", path.display()))?;
        // Names of textures are from the folder of their library.
        let from = folder.join(path.parent().unwrap_or(Path::new("")));
        for line in String::from_utf8_lossy(&text).lines() {
            for name in textures(line) {
                if let Some(found) = located(&mut lookup, folder, &from, &name)? {
                    files.insert(found);
                    break;
                }
            }
        }
    }
    files.extend(georeferences(folder)?);
    Ok(files.into_iter().collect())
}

/// The files of a folder by which programs say where a mesh in it lies.
fn georeferences(folder: &Path) -> anyhow::Result<BTreeSet<PathBuf>> {
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir(folder).with_context(|| format!("folder {}", folder.display()))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().to_lowercase();
        let says = matches!(&*name, "metadata.xml" | "coords.txt" | "proj.txt")
            || name.ends_with("offset.xyz")
            || name.ends_with(".prj");
        if says && entry.path().is_file() {
            found.insert(PathBuf::from(entry.file_name()));
        }
    }
    Ok(found)
}

/// What stands in lines `mtllib …`.
fn libraries(obj: &Path) -> anyhow::Result<BTreeSet<String>> {
    let mut found = BTreeSet::new();
    let mut file =
        BufReader::with_capacity(1 << 20, File::open(obj).with_context(|| format!("file {}", obj.display()))?);
    let mut line = Vec::new();
    loop {
        line.clear();
        let count = (&mut file).take(LONGEST as u64).read_until(b'\n', &mut line)?;
        if count == 0 {
            return Ok(found);
        }
        if let Some(name) =
            line.strip_prefix(b"mtllib").filter(|rest| rest.first().is_some_and(u8::is_ascii_whitespace))
        {
            found.insert(String::from_utf8_lossy(name).trim().to_owned());
        }
        if line.last() != Some(&b'\n') {
            file.skip_until(b'\n')?;
        }
    }
}

/// What a line of a library may name as a texture: all behind the key, or its last word behind options.
fn textures(line: &str) -> Vec<String> {
    let Some((key, rest)) = line.trim().split_once(char::is_whitespace) else { return Vec::new() };
    let lower = key.to_ascii_lowercase();
    if !(lower.starts_with("map_") || matches!(lower.as_str(), "bump" | "disp" | "decal" | "refl" | "norm")) {
        return Vec::new();
    }
    let last = rest.split_whitespace().next_back().unwrap_or_default();
    vec![rest.trim().to_owned(), last.to_owned()]
}

/// The path from the folder to a file in it that another file in `from` names, found as the readers find it; none if it is not there.
/// What is named outside of the folder would have another place on the service, so it is an error, unless one of its name is inside.
fn located(lookup: &mut Lookup<'_>, folder: &Path, from: &Path, name: &str) -> anyhow::Result<Option<PathBuf>> {
    let mut folders = vec![from, folder];
    folders.dedup();
    let found = lookup.find(&folders, name.as_bytes());
    if found.is_there {
        // As it is named, without going up: a link keeps its name.
        if let Ok(path) = found.path.strip_prefix(folder)
            && path.components().all(|part| matches!(part, Component::Normal(_)))
        {
            return Ok(Some(path.to_owned()));
        }
        let path = found.path.canonicalize().with_context(|| format!("file {}", found.path.display()))?;
        let folder = folder.canonicalize().with_context(|| format!("folder {}", folder.display()))?;
        return Ok(path.strip_prefix(folder).ok().map(Path::to_owned));
    }
    let outside = from.join(name.replace('\\', "/"));
    if name.is_empty() || !outside.is_file() {
        return Ok(None);
    }
    let text = format!(
        "{name} lies outside of {}, so it cannot be sent with the mesh: put both into one folder, and send that",
        folder.display()
    );
    Err(UsageError(text).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_and_textures_go_along() {
        let base = tempfile::tempdir().unwrap();
        let folder = base.path().join("mesh");
        std::fs::create_dir_all(folder.join("maps")).unwrap();
        for (name, text) in [
            ("mesh/a.obj", "# x\nmtllib a.mtl\r\nv 0 0 0\nf 1 1 1\nmtllib none.mtl\nmtllibs b\n"),
            (
                "mesh/a.mtl",
                "newmtl m\n map_Kd -s 1 1 1 maps\\roof one.jpg\nmap_Ka wall.png\nmap_Kd gone.png\nKd 1 1 1\n",
            ),
            ("mesh/maps/roof one.jpg", ""),
            ("mesh/wall.png", ""),
            ("mesh/other.png", ""),
            ("mesh/b.obj", "mtllib ../b.mtl\n"),
            ("b.mtl", ""),
        ] {
            std::fs::write(base.path().join(name), text).unwrap();
        }
        let names = |obj: &str| -> Vec<String> {
            of_obj(&folder.join(obj)).unwrap().iter().map(|p| p.to_string_lossy().into_owned()).collect()
        };
        assert_eq!(names("a.obj"), ["a.mtl", "a.obj", "maps/roof one.jpg", "wall.png"]);
        std::fs::write(folder.join("a.mtl"), "map_Kd maps/roof one.jpg\n").unwrap();
        assert_eq!(names("a.obj"), ["a.mtl", "a.obj", "maps/roof one.jpg"]);
        for name in ["Metadata.xml", "a.prj", "a_offset.xyz", "notes.txt"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let all = ["Metadata.xml", "a.mtl", "a.obj", "a.prj", "a_offset.xyz", "maps/roof one.jpg"];
        assert_eq!(names("a.obj"), all, "what says where it lies goes along");
        for name in ["Metadata.xml", "a.prj", "a_offset.xyz"] {
            std::fs::remove_file(folder.join(name)).unwrap();
        }
        std::fs::write(folder.join("C.OBJ"), "f 1 1 1\n").unwrap();
        std::fs::write(folder.join("c.mtl"), "map_Kd C:\\work\\WALL.PNG\n").unwrap();
        assert_eq!(names("C.OBJ"), ["C.OBJ", "c.mtl", "wall.png"], "a library of its own name, a texture elsewhere");
        let outside = of_obj(&folder.join("b.obj")).unwrap_err().to_string();
        assert!(outside.contains("../b.mtl") && outside.contains("one folder"), "{outside}");
    }
}
