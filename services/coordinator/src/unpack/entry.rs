//! What comes out of an archive, whatever its kind: names are checked, bytes counted, files written.

use super::{ARCHIVES, UnpackError};
use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::path::{Component, Path, PathBuf};

/// Longest path of an entry, bytes.
const LONGEST: usize = 500;

/// Ends of the names of meshes.
const MESHES: [&str; 6] = ["obj", "ply", "off", "glb", "gltf", "b3dm"];

/// Ends of the names of what meshes name, and of what says where they lie.
const NEEDED: [&str; 17] = [
    "mtl", "bin", "json", "xml", "prj", "xyz", "jpg", "jpeg", "png", "tif", "tiff", "bmp", "tga", "webp", "jp2", "j2k",
    "ktx2",
];

/// What an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    File,
    Folder,
    /// A link or a device.
    Other,
}

/// Where entries go.
pub(super) struct Intake<'a> {
    folder: &'a Path,
    /// Bytes that it may unpack to, and how many of them are left.
    most: u64,
    left: u64,
    /// Entries that it may have, and how many it had.
    most_entries: usize,
    entries: usize,
    /// Lower case: two names that differ in case only are one file on some machines.
    seen: BTreeSet<String>,
    files: Vec<String>,
}

impl<'a> Intake<'a> {
    pub(super) fn new(folder: &'a Path, most: u64, most_entries: usize) -> Self {
        Self { folder, most, left: most, most_entries, entries: 0, seen: BTreeSet::new(), files: Vec::new() }
    }

    /// Checks a number of entries that is told beforehand.
    pub(super) fn check_entries(&self, count: usize) -> Result<(), UnpackError> {
        if count > self.most_entries { Err(UnpackError::Entries(count, self.most_entries)) } else { Ok(()) }
    }

    /// Takes an entry: writes it, or passes it over. `size` is what the archive says of it, which is not to be trusted.
    pub(super) fn take(
        &mut self,
        name: &str,
        kind: Kind,
        size: u64,
        content: &mut dyn Read,
    ) -> Result<(), UnpackError> {
        self.entries += 1;
        self.check_entries(self.entries)?;
        let refused = |why| UnpackError::Entry(name.chars().take(LONGEST).collect(), why);
        let slashed = name.replace('\\', "/");
        let path = inside(&slashed).ok_or_else(|| refused("has a path that leads elsewhere"))?;
        // A tar archive of a folder begins with the folder itself.
        if path.is_empty() && kind == Kind::Folder {
            return Ok(());
        }
        if is_note(&path) {
            return self.pass_over(size, content);
        }
        if kind == Kind::Other {
            return Err(refused("is a link or a device"));
        }
        let needed = is_needed(&path);
        if !is_plain(&path) {
            return if needed && kind == Kind::File {
                Err(refused(
                    "has a name that not every system can have: it is too long, or has a colon or a control character",
                ))
            } else {
                self.pass_over(size, content)
            };
        }
        let place = self.folder.join(&path);
        let wrong = |path: &Path, source| UnpackError::File { path: path.to_owned(), source };
        if kind == Kind::Folder {
            return std::fs::create_dir_all(&place).map_err(|e| wrong(&place, e));
        }
        if !self.seen.insert(path.to_lowercase()) {
            return if needed { Err(refused("is there twice")) } else { self.pass_over(size, content) };
        }
        if size > self.left {
            return Err(UnpackError::Size(self.most >> 20));
        }
        if let Some(parent) = place.parent() {
            std::fs::create_dir_all(parent).map_err(|e| wrong(parent, e))?;
        }
        let mut out = std::fs::File::create_new(&place).map_err(|e| wrong(&place, e))?;
        self.copy(content, &mut out, &place)?;
        self.files.push(path);
        Ok(())
    }

    /// Reads what is not wanted: it counts like the rest, for reading it takes as long.
    fn pass_over(&mut self, size: u64, content: &mut dyn Read) -> Result<(), UnpackError> {
        if size > self.left {
            return Err(UnpackError::Size(self.most >> 20));
        }
        self.copy(content, &mut std::io::sink(), Path::new(""))
    }

    fn copy(&mut self, from: &mut dyn Read, to: &mut dyn Write, place: &Path) -> Result<(), UnpackError> {
        let mut buffer = vec![0; 1 << 16];
        loop {
            let bytes = from.read(&mut buffer).map_err(|e| UnpackError::damaged(&e))?;
            if bytes == 0 {
                return Ok(());
            }
            self.left = self.left.checked_sub(bytes as u64).ok_or(UnpackError::Size(self.most >> 20))?;
            let written = to.write_all(&buffer[..bytes]);
            written.map_err(|source| UnpackError::File { path: place.to_owned(), source })?;
        }
    }

    /// The files, if a mesh is among them.
    pub(super) fn finish(self) -> Result<Vec<String>, UnpackError> {
        let Some(first) = self.files.first() else { return Err(UnpackError::Empty) };
        let lower: Vec<String> = self.files.iter().map(|file| file.to_lowercase()).collect();
        let ends =
            |ends: &[&str]| lower.iter().position(|file| ends.iter().any(|end| file.ends_with(&format!(".{end}"))));
        if ends(&MESHES).is_some() {
            return Ok(self.files);
        }
        Err(UnpackError::NoMesh(match ends(&ARCHIVES) {
            Some(inner) => format!("another archive, {:?}: unpack it, and send what is in it", self.files[inner]),
            None if ends(&["osgb"]).is_some() => "OSGB, which is not read: export it as OBJ or 3D Tiles".to_owned(),
            None => format!("{} other files, such as {first:?}", self.files.len()),
        }))
    }
}

/// A path without what leads nowhere (`./`, a slash at the end); none if it leads elsewhere on some system.
fn inside(name: &str) -> Option<String> {
    let name = name.strip_suffix('/').unwrap_or(name);
    let is_drive = |part: &str| part.len() == 2 && part.ends_with(':') && part.as_bytes()[0].is_ascii_alphabetic();
    if name.starts_with('/') || name.contains('\0') || is_drive(name.split('/').next().unwrap_or_default()) {
        return None;
    }
    let mut parts = Vec::new();
    for part in name.split('/') {
        match part {
            "" => return None,
            "." => {}
            ".." => return None,
            part => parts.push(part),
        }
    }
    let path: PathBuf = parts.iter().collect();
    path.components().all(|c| matches!(c, Component::Normal(_))).then(|| parts.join("/"))
}

/// Whether every system can have such a path.
fn is_plain(path: &str) -> bool {
    let strange = |c: char| c.is_control() || c == ':' || c == '\u{fffd}';
    path.len() <= LONGEST && path.split('/').all(|part| part.len() <= 255) && !path.contains(strange)
}

/// What file managers and office programs leave behind.
fn is_note(path: &str) -> bool {
    path.split('/').any(|part| {
        let lower = part.to_lowercase();
        part.starts_with('.') || part.starts_with("~$") || matches!(&*lower, "__macosx" | "thumbs.db" | "desktop.ini")
    })
}

/// Whether it is a mesh, or something that a mesh names.
fn is_needed(path: &str) -> bool {
    let end = path.rsplit_once('.').map(|(_, end)| end.to_lowercase()).unwrap_or_default();
    MESHES.contains(&&*end) || NEEDED.contains(&&*end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_in_their_folder() {
        for bad in ["../evil", "a/../../evil", "/etc/passwd", "a//b", "C:/evil", "a\0b", "..", "a/..", "", "//"] {
            assert_eq!(inside(bad), None, "{bad:?}");
        }
        assert_eq!(inside("./a/b..obj/").as_deref(), Some("a/b..obj"));
        assert_eq!(inside("./").as_deref(), Some(""));
        assert!(is_plain("Ä/b..obj") && !is_plain("a:b") && !is_plain("a\nb") && !is_plain(&"a/".repeat(400)));
    }

    #[test]
    fn notes_are_known() {
        for note in ["__MACOSX/._mesh.obj", "City/._a.jpg", "a/.DS_Store", "~$list.xlsx", "a/Thumbs.db", ".git/config"]
        {
            assert!(is_note(note), "{note}");
        }
        assert!(!is_note("City/mesh.obj") && !is_note("a~$/b.obj") && !is_note("macosx/mesh.obj"));
    }
}
