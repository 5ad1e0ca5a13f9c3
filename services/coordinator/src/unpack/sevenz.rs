//! 7z archives, packed by LZMA or LZMA2, as 7-Zip does.

use super::UnpackError;
use super::entry::{Intake, Kind};
use sevenz_rust2::{ArchiveReader, Error, Password};
use std::fs::File;
use std::io::BufReader;

/// Memory that an archive may ask for, KiB: a dictionary of the largest size that 7-Zip offers without more ado, and some room.
const MEMORY: usize = 512 << 10;

/// What Unix systems put into the upper half of the attributes of Windows.
const IS_UNIX: u32 = 0x8000;
const FILE_TYPE: u32 = 0o170_000;
const REGULAR: u32 = 0o100_000;
/// Of Windows: a link.
const REPARSE_POINT: u32 = 0x400;

pub(super) fn unpack(archive: BufReader<File>, intake: &mut Intake<'_>) -> Result<(), UnpackError> {
    let mut archive = ArchiveReader::new_with_memory_limit(archive, Password::empty(), MEMORY).map_err(|e| told(&e))?;
    // More threads would each take a dictionary's memory.
    archive.set_thread_count(1);
    intake.check_entries(archive.archive().files.len())?;
    let mut refused = None;
    let read = archive.for_each_entries(|entry, content| {
        let attributes = if entry.has_windows_attributes { entry.windows_attributes } else { 0 };
        let unix = if attributes & IS_UNIX == 0 { REGULAR } else { attributes >> 16 & FILE_TYPE };
        let kind = match entry.is_directory {
            true => Kind::Folder,
            false if entry.is_anti_item || unix != REGULAR || attributes & REPARSE_POINT != 0 => Kind::Other,
            false => Kind::File,
        };
        intake.take(&entry.name, kind, entry.size, content).map_err(|e| {
            refused = Some(e);
            // Ends the reading; what is told is the error above.
            Error::Other("refused".into())
        })?;
        Ok(true)
    });
    match (refused, read) {
        (Some(error), _) => Err(error),
        (None, Err(error)) => Err(told(&error)),
        (None, Ok(())) => Ok(()),
    }
}

/// What is wrong, and what to do.
fn told(error: &Error) -> UnpackError {
    match error {
        Error::UnsupportedCompressionMethod(_) | Error::PasswordRequired | Error::MaybeBadPassword(_) => {
            UnpackError::Damaged(format!(
                "{error}: pack it without a password, by LZMA2, which is what 7-Zip does unless it is told otherwise"
            ))
        }
        other => UnpackError::damaged(other),
    }
}
