//! Unpacks an archive that a user has sent, and refuses what would harm: paths that lead elsewhere, links, archives that
//! unpack to far more than they are, and more files than a mesh has.

use crate::Limits;
use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::path::{Component, Path, PathBuf};
use zip::ZipArchive;
use zip::result::ZipError;

/// Why an archive is refused.
#[derive(Debug, thiserror::Error)]
pub(crate) enum UnpackError {
    /// It is no ZIP archive, or damaged.
    #[error("the archive cannot be read: {0}")]
    Damaged(#[from] ZipError),
    /// An entry that no mesh has.
    #[error("entry {0:?} of the archive {1}")]
    Entry(String, &'static str),
    /// More files than an upload may have.
    #[error("the archive has {0} entries, more than the {1} of an upload")]
    Entries(usize, usize),
    /// It unpacks to more than it may.
    #[error("the archive unpacks to more than {0} MB")]
    Size(u64),
    /// No file.
    #[error("the archive has no file")]
    Empty,
    /// The local disk.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Text of a mesh shrinks to a tenth at best: what grows by more than this, beyond some room for small archives, is made to harm.
const RATIO: u64 = 200;
const ROOM: u64 = 64 << 20;

/// Longest path of an entry, bytes.
const LONGEST: usize = 500;

/// Unpacks into a folder; gives the paths of the files within it, parts joined by `/`.
pub(crate) fn unpack(archive: std::fs::File, folder: &Path, limits: &Limits) -> Result<Vec<String>, UnpackError> {
    let wrong = |path: &Path, source| UnpackError::File { path: path.to_owned(), source };
    let packed = archive.metadata().map_err(|e| wrong(folder, e))?.len();
    let most = limits.unpacked.min(packed.saturating_mul(RATIO).saturating_add(ROOM));
    let mut archive = ZipArchive::new(std::io::BufReader::new(archive))?;
    if archive.len() > limits.files {
        return Err(UnpackError::Entries(archive.len(), limits.files));
    }
    let mut left = most;
    // Lower case: two names that differ in case only are one file on some machines.
    let mut seen: BTreeSet<String> = BTreeSet::new();
    let mut files = Vec::new();
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index)?;
        let name = String::from_utf8_lossy(entry.name_raw()).into_owned();
        let refused = |why| UnpackError::Entry(name.chars().take(LONGEST).collect(), why);
        let path = plain(&name).ok_or_else(|| refused("has a path that leads elsewhere, or is too long"))?;
        if entry.is_symlink() {
            return Err(refused("is a link"));
        }
        let place = folder.join(&path);
        if entry.is_dir() {
            std::fs::create_dir_all(&place).map_err(|e| wrong(&place, e))?;
            continue;
        }
        if !seen.insert(path.to_lowercase()) {
            return Err(refused("is there twice"));
        }
        if entry.size() > left {
            return Err(UnpackError::Size(most >> 20));
        }
        if let Some(parent) = place.parent() {
            std::fs::create_dir_all(parent).map_err(|e| wrong(parent, e))?;
        }
        let mut out = std::fs::File::create_new(&place).map_err(|e| wrong(&place, e))?;
        // What an entry says of its size is not to be trusted.
        left -= copy(&mut entry, &mut out, left).map_err(|e| match e {
            Copy::Read(e) => UnpackError::Damaged(e.into()),
            Copy::Write(e) => wrong(&place, e),
            Copy::TooMuch => UnpackError::Size(most >> 20),
        })?;
        files.push(path);
    }
    if files.is_empty() { Err(UnpackError::Empty) } else { Ok(files) }
}

/// A path that stays within its folder on every system.
fn plain(name: &str) -> Option<String> {
    let name = name.replace('\\', "/");
    let trimmed = name.strip_suffix('/').unwrap_or(&name);
    let strange = |c: char| c.is_control() || c == ':' || c == '\u{fffd}';
    let inside = Path::new(trimmed).components().all(|c| matches!(c, Component::Normal(_)));
    let whole = trimmed.split('/').all(|part| !part.is_empty() && part != "." && part.len() <= 255);
    (inside && whole && trimmed.len() <= LONGEST && !trimmed.contains(strange)).then(|| trimmed.to_owned())
}

enum Copy {
    Read(std::io::Error),
    Write(std::io::Error),
    TooMuch,
}

fn copy(from: &mut impl Read, to: &mut impl Write, most: u64) -> Result<u64, Copy> {
    let mut buffer = vec![0; 1 << 16];
    let mut copied = 0_u64;
    loop {
        let bytes = from.read(&mut buffer).map_err(Copy::Read)?;
        if bytes == 0 {
            return Ok(copied);
        }
        copied += bytes as u64;
        if copied > most {
            return Err(Copy::TooMuch);
        }
        to.write_all(&buffer[..bytes]).map_err(Copy::Write)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Seek as _, SeekFrom};
    use zip::write::SimpleFileOptions;
    use zip::{CompressionMethod, ZipWriter};

    fn archive(fill: impl FnOnce(&mut ZipWriter<&mut std::fs::File>)) -> std::fs::File {
        let mut file = tempfile::tempfile().expect("a file");
        let mut writer = ZipWriter::new(&mut file);
        fill(&mut writer);
        writer.finish().expect("written");
        file.rewind().expect("rewound");
        file
    }

    fn deflated() -> SimpleFileOptions {
        SimpleFileOptions::default().compression_method(CompressionMethod::Deflated)
    }

    fn with(entries: &[(&str, &[u8])]) -> std::fs::File {
        archive(|zip| {
            for (name, content) in entries {
                zip.start_file(*name, deflated()).expect("begun");
                zip.write_all(content).expect("written");
            }
        })
    }

    fn told(file: std::fs::File, limits: &Limits) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let inner = folder.path().join("inner");
        let result = unpack(file, &inner, limits);
        let around: Vec<_> = std::fs::read_dir(folder.path()).expect("read").flatten().map(|e| e.file_name()).collect();
        assert!(around.iter().all(|name| name == "inner"), "{around:?}");
        result.expect_err("it is refused").to_string()
    }

    #[test]
    fn a_folder_of_tiles_is_unpacked() {
        let folder = tempfile::tempdir().expect("a folder");
        let zip = archive(|zip| {
            zip.add_directory("City/Data/", deflated()).expect("a folder");
            for name in ["City/metadata.xml", "City/Data/Tile_1/Tile 1.obj"] {
                zip.start_file(name, deflated()).expect("begun");
                zip.write_all(name.as_bytes()).expect("written");
            }
        });
        let files = unpack(zip, folder.path(), &Limits::default()).expect("unpacked");
        assert_eq!(files, ["City/metadata.xml", "City/Data/Tile_1/Tile 1.obj"]);
        for name in &files {
            assert_eq!(std::fs::read(folder.path().join(name)).expect("read"), name.as_bytes());
        }
    }

    #[test]
    fn paths_stay_in_their_folder() {
        for bad in [
            "../evil",
            "a/../../evil",
            "/etc/passwd",
            "a/./b",
            "a//b",
            "..\\evil",
            "C:\\evil",
            "c:evil",
            "a\0b",
            "a\nb",
            "..",
            ".",
        ] {
            assert_eq!(plain(bad), None, "{bad:?}");
        }
        assert_eq!(plain(&"a/".repeat(400)), None);
        assert_eq!(plain("a\\b.obj").as_deref(), Some("a/b.obj"));
        assert_eq!(plain("Ä/b..obj").as_deref(), Some("Ä/b..obj"));
        for bad in ["../evil", "a/../../evil", "/evil"] {
            assert!(
                told(with(&[("mesh.obj", b"v 0 0 0"), (bad, b"x")]), &Limits::default()).contains("leads elsewhere")
            );
        }
    }

    #[test]
    fn links_and_doubles_are_refused() {
        let link = archive(|zip| zip.add_symlink("mesh.obj", "/etc/passwd", deflated()).expect("a link"));
        assert!(told(link, &Limits::default()).contains("is a link"));
        let twice = with(&[("mesh.obj", b"1"), ("Mesh.OBJ", b"2")]);
        assert!(told(twice, &Limits::default()).contains("is there twice"));
        let none = archive(|zip| zip.add_directory("a/", deflated()).expect("a folder"));
        assert!(told(none, &Limits::default()).contains("no file"));
    }

    #[test]
    fn bombs_are_refused() {
        let zeros = vec![0; 100 << 20];
        let text = told(with(&[("a", &zeros)]), &Limits::default());
        assert!(text.contains("unpacks to more than"), "{text}");
        let half = vec![0; 33 << 20];
        let text = told(with(&[("a", &half), ("b", &half), ("c", &half)]), &Limits::default());
        assert!(text.contains("unpacks to more than"), "{text}");
        let few = Limits { files: 2, ..Limits::default() };
        assert!(told(with(&[("a", b""), ("b", b""), ("c", b"")]), &few).contains("3 entries"));
        let small = Limits { unpacked: 5, ..Limits::default() };
        assert!(told(with(&[("a", b"123"), ("b", b"456")]), &small).contains("unpacks to more than 0 MB"));

        // An archive that says of its entry that it has one byte.
        let mut lie = with(&[("a", &zeros)]);
        let mut bytes = Vec::new();
        lie.read_to_end(&mut bytes).expect("read");
        let size = (zeros.len() as u32).to_le_bytes();
        for at in 0..bytes.len() - 4 {
            if bytes[at..at + 4] == size {
                bytes[at..at + 4].copy_from_slice(&1_u32.to_le_bytes());
            }
        }
        lie.seek(SeekFrom::Start(0)).and_then(|_| lie.write_all(&bytes)).and_then(|()| lie.rewind()).expect("written");
        assert!(!told(lie, &Limits::default()).is_empty());
    }

    #[test]
    fn what_is_no_archive_is_refused() {
        let mut bytes = Vec::new();
        with(&[("mesh.obj", &[7; 1000])]).read_to_end(&mut bytes).expect("read");
        for cut in [0, 10, bytes.len() / 2, bytes.len() - 1] {
            let mut file = tempfile::tempfile().expect("a file");
            file.write_all(&bytes[..cut]).and_then(|()| file.rewind()).expect("written");
            assert!(told(file, &Limits::default()).contains("cannot be read"), "cut at {cut}");
        }
        let at = bytes.windows(8).position(|w| w == b"mesh.obj").expect("there") + 9;
        bytes[at] ^= 0xff;
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(&bytes).and_then(|()| file.rewind()).expect("written");
        assert!(told(file, &Limits::default()).contains("cannot be read"));
    }
}
