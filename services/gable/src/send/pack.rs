//! Packs the files of a folder while they are read: nothing is kept. The same files give the same bytes, so that what was sent of them
//! before need not be sent again.

use anyhow::Context as _;
use std::io::{Read as _, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Files that are text, and shrink; textures are packed already.
const TEXT: [&str; 8] = ["obj", "mtl", "ply", "off", "gltf", "xml", "txt", "json"];

/// Beyond this a file needs the long form of an entry, bytes.
const LONG: u64 = u32::MAX as u64 - (1 << 20);

/// All files below a folder, in order, as paths from it; without hidden ones, and without what links to folders lead to.
pub(super) fn files_below(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut open = vec![PathBuf::new()];
    while let Some(place) = open.pop() {
        let at = folder.join(&place);
        let entries = std::fs::read_dir(&at).with_context(|| format!("folder {}", at.display()))?;
        for entry in entries {
            let entry = entry.with_context(|| format!("folder {}", at.display()))?;
            let path = place.join(entry.file_name());
            if entry.file_name().to_string_lossy().starts_with('.') {
                continue;
            }
            if entry.file_type().with_context(|| format!("file {}", folder.join(&path).display()))?.is_dir() {
                open.push(path);
            } else if folder.join(&path).is_file() {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Writes an archive of files, whose paths are from the folder.
pub(super) fn pack(folder: &Path, files: &[PathBuf], out: impl Write) -> anyhow::Result<()> {
    let mut archive = ZipWriter::new_stream(out);
    let mut piece = vec![0; 1 << 18];
    for path in files {
        let parts: Vec<_> = path.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
        let place = folder.join(path);
        let mut file = std::fs::File::open(&place).with_context(|| format!("file {}", place.display()))?;
        let long = file.metadata()?.len() > LONG;
        let end = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let method = if TEXT.contains(&&*end) { CompressionMethod::Deflated } else { CompressionMethod::Stored };
        // No time of a file: it may be another in a copy of the same mesh.
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .last_modified_time(zip::DateTime::default())
            .large_file(long);
        archive.start_file(parts.join("/"), options)?;
        loop {
            let count = file.read(&mut piece).with_context(|| format!("file {}", place.display()))?;
            if count == 0 {
                break;
            }
            archive.write_all(&piece[..count])?;
        }
    }
    archive.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_files_give_the_same_bytes_and_come_out_again() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(folder.path().join("Data/Tile_1")).unwrap();
        let texture: Vec<u8> = (0..100_000_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        std::fs::write(folder.path().join("Data/Tile_1/Tile_1.obj"), "v 0 0 0\n".repeat(10_000)).unwrap();
        std::fs::write(folder.path().join("Data/Tile_1/Tile_1.jpg"), &texture).unwrap();
        std::fs::write(folder.path().join("metadata.xml"), "<SRS/>").unwrap();
        std::fs::write(folder.path().join(".hidden"), "secret").unwrap();
        let files = files_below(folder.path()).unwrap();
        let names: Vec<_> = files.iter().map(|f| f.to_str().unwrap()).collect();
        assert_eq!(names, ["Data/Tile_1/Tile_1.jpg", "Data/Tile_1/Tile_1.obj", "metadata.xml"]);
        let (mut first, mut second) = (Vec::new(), Vec::new());
        pack(folder.path(), &files, &mut first).unwrap();
        pack(folder.path(), &files, &mut second).unwrap();
        assert!(first == second && first.len() < 150_000, "{} bytes", first.len());
        let mut archive = zip::ZipArchive::new(std::io::Cursor::new(first)).unwrap();
        for file in &files {
            let mut found = Vec::new();
            archive.by_name(file.to_str().unwrap()).unwrap().read_to_end(&mut found).unwrap();
            assert_eq!(found, std::fs::read(folder.path().join(file)).unwrap());
        }
    }
}
