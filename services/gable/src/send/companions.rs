//! The files that go with an OBJ file: its libraries, the textures that they name, and what says where it lies.

use crate::exit::UsageError;
use anyhow::Context as _;
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
    let mut files = BTreeSet::from([PathBuf::from(obj.file_name().unwrap_or_default())]);
    for library in libraries(obj)? {
        let Some(path) = inside(folder, &library)? else { continue };
        if !files.insert(path.clone()) {
            continue;
        }
        let mut text = Vec::new();
        let file = File::open(folder.join(&path)).with_context(|| format!("library {}", path.display()))?;
        file.take(LARGEST).read_to_end(&mut text).with_context(|| format!("library {}", path.display()))?;
        // Names of textures are from the folder of their library.
        let from = path.parent().unwrap_or(Path::new("")).to_owned();
        for line in String::from_utf8_lossy(&text).lines() {
            if let Some(texture) = texture(&folder.join(&from), line)
                && let Some(found) = inside(folder, &from.join(texture).to_string_lossy())?
            {
                files.insert(found);
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

/// The texture that a line of a library names: all behind the key, or its last word behind options.
fn texture(folder: &Path, line: &str) -> Option<String> {
    let (key, rest) = line.trim().split_once(char::is_whitespace)?;
    let lower = key.to_ascii_lowercase();
    if !(lower.starts_with("map_") || matches!(lower.as_str(), "bump" | "disp" | "decal" | "refl" | "norm")) {
        return None;
    }
    let (all, last) = (rest.trim(), rest.split_whitespace().next_back()?);
    [all, last].into_iter().map(|name| name.replace('\\', "/")).find(|name| folder.join(name).is_file())
}

/// A path from the folder to a file in it; none if it is not there. What is named outside of the folder would have another place on the
/// service, so it is an error.
fn inside(folder: &Path, name: &str) -> anyhow::Result<Option<PathBuf>> {
    let path = PathBuf::from(name.replace('\\', "/"));
    if !folder.join(&path).is_file() {
        return Ok(None);
    }
    if !path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        let text = format!(
            "{name} lies outside of {}, so it cannot be sent with the mesh: put both into one folder, and send that",
            folder.display()
        );
        return Err(UsageError(text).into());
    }
    Ok(Some(path.components().filter(|part| matches!(part, Component::Normal(_))).collect()))
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
        assert_eq!(names("a.obj"), ["a.mtl", "a.obj", "wall.png"], "a name with spaces behind options cannot be told");
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
        let outside = of_obj(&folder.join("b.obj")).unwrap_err().to_string();
        assert!(outside.contains("../b.mtl") && outside.contains("one folder"), "{outside}");
    }
}
