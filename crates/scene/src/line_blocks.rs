//! A text file in pieces that end where a line ends, so that the pieces can be parsed apart.

use crate::error::{Place, SceneError};
use gable_files::Reach;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// A line longer than this is taken for a file that is not text.
const LONGEST_LINE: usize = 64 << 20;

/// Bytes by which it is judged how lines end.
const FIRST: u64 = 1 << 16;

/// Reads a text file piece by piece. Lines that end with CR alone, as old programs write them, come with LF.
pub(crate) struct LineBlocks<'a> {
    path: &'a Path,
    file: File,
    size: usize,
    carry: Vec<u8>,
    offset: u64,
    ended: bool,
    /// Whether lines end with CR alone; known from the first bytes on.
    returns: Option<bool>,
    /// Zero bytes that were passed over after the last line: only more of them may follow.
    zeros: u64,
}

impl<'a> LineBlocks<'a> {
    /// Opens a file to be read in pieces of about `size` bytes.
    pub(crate) fn open(path: &'a Path, reach: &Reach, size: usize) -> Result<Self, SceneError> {
        let file = reach.open(path)?;
        Ok(Self { path, file, size, carry: Vec::new(), offset: 0, ended: false, returns: None, zeros: 0 })
    }

    /// Zero bytes at the end of the file, which are in no piece.
    pub(crate) fn zeros(&self) -> u64 {
        self.zeros
    }

    /// Reads `wanted` more bytes; whether that was the end of the file.
    fn read(&mut self, text: &mut Vec<u8>, wanted: usize) -> Result<bool, SceneError> {
        let before = text.len();
        let read =
            self.file.by_ref().take(wanted as u64).read_to_end(text).map_err(|e| SceneError::read(self.path, e))?;
        if self.returns.is_none() {
            let first = &text[..text.len().min(FIRST as usize)];
            self.returns = Some(memchr::memchr(b'\r', first).is_some() && memchr::memchr(b'\n', first).is_none());
        }
        if self.returns == Some(true) {
            text[before..].iter_mut().filter(|b| **b == b'\r').for_each(|b| *b = b'\n');
        }
        let kept = text[before..].iter().rposition(|b| *b != 0).map_or(before, |last| before + last + 1);
        if kept > before && self.zeros > 0 {
            let what = format!("{} zero bytes end here: is it a complete copy?", self.zeros);
            return Err(SceneError::syntax(self.path, Place::Byte(self.offset + before as u64 + self.zeros), what));
        }
        self.zeros += (text.len() - kept) as u64;
        text.truncate(kept);
        Ok(read < wanted)
    }

    /// The next piece: whole lines, of which the file's last may lack its line end; `None` at the end of the file.
    pub(crate) fn next(&mut self) -> Result<Option<Vec<u8>>, SceneError> {
        let mut text = std::mem::take(&mut self.carry);
        let mut wanted = self.size.saturating_sub(text.len()).max(1 << 16);
        while !self.ended {
            let before = text.len();
            self.ended = self.read(&mut text, wanted)?;
            if self.ended {
                break;
            }
            if let Some(cut) = last_line_end(&text, before) {
                self.carry = text.split_off(cut);
                break;
            }
            if text.len() > LONGEST_LINE {
                let what = "a line of more than 64 MiB starts here: this is not a text file";
                return Err(SceneError::syntax(self.path, Place::Byte(self.offset), what));
            }
            wanted = self.size;
        }
        if text.is_empty() {
            return Ok(None);
        }
        self.offset += text.len() as u64;
        Ok(Some(text))
    }
}

/// The byte after the last line end that no backslash continues, not looking before `from`'s line.
fn last_line_end(text: &[u8], from: usize) -> Option<usize> {
    let mut end = text.len();
    // What stands before `from` was searched already, but a line end may be split from its backslash.
    let stop = from.saturating_sub(2);
    while let Some(at) = memchr::memrchr(b'\n', &text[stop..end]).map(|at| at + stop) {
        let line = text[..at].strip_suffix(b"\r").unwrap_or(&text[..at]);
        if !line.ends_with(b"\\") {
            return Some(at + 1);
        }
        end = at;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn pieces_join_to_the_file_and_end_at_line_ends() {
        let mut text = Vec::new();
        for i in 0..40_000 {
            let end = ["\n", "\r\n", "\\\n", "\\\r\n"][i % 7 % 4];
            write!(text, "f {i} {} {}{end}", i * 31, i * 77).expect("memory");
        }
        text.extend_from_slice(b"f 1 2 3");
        let file = tempfile::NamedTempFile::new().expect("temporary file");
        std::fs::write(file.path(), &text).expect("temporary file");
        let mut blocks = LineBlocks::open(file.path(), &Reach::everything(), 100_000).expect("opens");
        let mut joined = Vec::new();
        while let Some(block) = blocks.next().expect("reads") {
            joined.extend_from_slice(&block);
            let whole = joined.len() == text.len()
                || (block.ends_with(b"\n") && !block.ends_with(b"\\\n") && !block.ends_with(b"\\\r\n"));
            assert!(whole, "a piece ends within a line");
        }
        assert_eq!(joined, text);
    }
}
