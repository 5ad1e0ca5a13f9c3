//! Tar archives.

use super::UnpackError;
use super::entry::{Intake, Kind};
use std::io::Read;
use tar::{Archive, EntryType};

pub(super) fn unpack(archive: impl Read, intake: &mut Intake<'_>) -> Result<(), UnpackError> {
    let mut archive = Archive::new(archive);
    for entry in archive.entries().map_err(|e| UnpackError::damaged(&e))? {
        let mut entry = entry.map_err(|e| UnpackError::damaged(&e))?;
        let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        let kind = match entry.header().entry_type() {
            EntryType::Regular | EntryType::Continuous | EntryType::GNUSparse => Kind::File,
            EntryType::Directory => Kind::Folder,
            EntryType::XGlobalHeader => continue,
            _ => Kind::Other,
        };
        let size = entry.size();
        intake.take(&name, kind, size, &mut entry)?;
    }
    Ok(())
}
