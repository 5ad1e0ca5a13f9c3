//! ZIP archives, packed by Deflate, Deflate64 (what Windows writes beyond 2 GB), or not at all.

use super::UnpackError;
use super::entry::{Intake, Kind};
use std::fs::File;
use std::io::BufReader;
use zip::read::ZipFile;
use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

pub(super) fn unpack(archive: BufReader<File>, intake: &mut Intake<'_>) -> Result<(), UnpackError> {
    let mut archive = ZipArchive::new(archive).map_err(told)?;
    intake.check_entries(archive.len())?;
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(told)?;
        let name = name(&entry);
        let kind = match (entry.is_dir(), entry.is_symlink()) {
            (_, true) => Kind::Other,
            (true, _) => Kind::Folder,
            _ => Kind::File,
        };
        let size = entry.size();
        let is_read = matches!(
            entry.compression(),
            CompressionMethod::STORE | CompressionMethod::DEFLATE | CompressionMethod::DEFLATE64
        );
        intake.take(&name, kind, size, &mut entry).map_err(|error| {
            if is_read {
                error
            } else {
                repack(&format!("{name} is packed as by BZip2, LZMA, PPMd or Zstandard, which are not read"))
            }
        })?;
    }
    Ok(())
}

/// The name of an entry: UTF-8 also where it is not told to be, as some programs leave it; else code page 437, as the book has it.
fn name(entry: &ZipFile<'_, BufReader<File>>) -> String {
    match std::str::from_utf8(entry.name_raw()) {
        Ok(name) => name.to_owned(),
        Err(_) => entry
            .name()
            .map_or_else(|_| String::from_utf8_lossy(entry.name_raw()).into_owned(), |name| name.into_owned()),
    }
}

/// What is wrong, and what to do.
fn told(error: ZipError) -> UnpackError {
    match error {
        ZipError::UnsupportedArchive(what) => repack(what),
        other => UnpackError::damaged(&other),
    }
}

fn repack(what: &str) -> UnpackError {
    UnpackError::Damaged(format!(
        "{what}: pack it without a password, by Deflate, which is what ZIP programs do unless they are told otherwise"
    ))
}
