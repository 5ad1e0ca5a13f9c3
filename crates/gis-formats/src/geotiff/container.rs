//! The container: header, directories and their values, little-endian, as TIFF 6.0 and BigTIFF have them.

use std::io::{self, Write};

/// Bytes of the header of a classic file, and of a big one: the first directory stands behind it.
pub(super) const HEADER: [u64; 2] = [8, 16];

/// The value of a tag.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Ascii(String),
    Short(Vec<u16>),
    Long(Vec<u32>),
    Double(Vec<f64>),
    /// Places in the file: four bytes each, in a big file eight.
    Offsets(Vec<u64>),
}

impl Value {
    /// Number of its type, and of its values.
    fn kind(&self, big: bool) -> (u16, u64) {
        match self {
            // With the zero at its end.
            Self::Ascii(text) => (2, text.len() as u64 + 1),
            Self::Short(v) => (3, v.len() as u64),
            Self::Long(v) => (4, v.len() as u64),
            Self::Double(v) => (12, v.len() as u64),
            Self::Offsets(v) => (if big { 16 } else { 4 }, v.len() as u64),
        }
    }

    fn bytes(&self, big: bool) -> Vec<u8> {
        match self {
            Self::Ascii(text) => text.bytes().chain([0]).collect(),
            Self::Short(v) => v.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Long(v) => v.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Double(v) => v.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Offsets(v) if big => v.iter().flat_map(|v| v.to_le_bytes()).collect(),
            // A file is big where they would not fit.
            Self::Offsets(v) => v.iter().flat_map(|v| (*v as u32).to_le_bytes()).collect(),
        }
    }
}

/// What a picture of the file is: values by tag.
#[derive(Clone, Debug, Default)]
pub(super) struct Directory(Vec<(u16, Value)>);

impl Directory {
    /// Adds a tag. They may come in any order, each once.
    pub(super) fn put(&mut self, tag: u16, value: Value) {
        let at = self.0.partition_point(|(other, _)| *other < tag);
        self.0.insert(at, (tag, value));
    }

    /// Bytes that it takes, with the values that do not fit into its entries.
    pub(super) fn size(&self, big: bool) -> u64 {
        let beside: u64 = self.0.iter().map(|(_, value)| beside(value.bytes(big).len() as u64, big)).sum();
        table(self.0.len() as u64, big) + beside
    }

    /// Its bytes at the place `at`, the next directory being at `next`, or none at 0.
    fn bytes(&self, big: bool, at: u64, next: u64) -> Vec<u8> {
        let mut out = Vec::new();
        let mut values: Vec<u8> = Vec::new();
        let first = at + table(self.0.len() as u64, big);
        number(&mut out, self.0.len() as u64, if big { 8 } else { 2 });
        let word = if big { 8 } else { 4 };
        for (tag, value) in &self.0 {
            let (kind, count) = value.kind(big);
            number(&mut out, u64::from(*tag), 2);
            number(&mut out, u64::from(kind), 2);
            number(&mut out, count, word);
            let mut bytes = value.bytes(big);
            let room = beside(bytes.len() as u64, big);
            if room == 0 {
                bytes.resize(word, 0);
                out.extend(bytes);
            } else {
                number(&mut out, first + values.len() as u64, word);
                bytes.resize(room as usize, 0);
                values.extend(bytes);
            }
        }
        number(&mut out, next, word);
        // Values begin at multiples of eight.
        out.resize((first - at) as usize, 0);
        out.extend(values);
        out
    }
}

/// Bytes of the entries of a directory, up to a multiple of eight.
fn table(entries: u64, big: bool) -> u64 {
    let bytes = if big { 8 + 20 * entries + 8 } else { 2 + 12 * entries + 4 };
    bytes.next_multiple_of(8)
}

/// Bytes that a value takes beside the entries: none if it fits into its own.
fn beside(bytes: u64, big: bool) -> u64 {
    if bytes <= if big { 8 } else { 4 } { 0 } else { bytes.next_multiple_of(8) }
}

fn number(out: &mut Vec<u8>, value: u64, bytes: usize) {
    out.extend(&value.to_le_bytes()[..bytes]);
}

/// Writes the header and the directories, one behind the other.
pub(super) fn write_head(directories: &[Directory], big: bool, out: &mut impl Write) -> io::Result<()> {
    let mut at = HEADER[usize::from(big)];
    match big {
        true => out.write_all(&[b'I', b'I', 43, 0, 8, 0, 0, 0, at as u8, 0, 0, 0, 0, 0, 0, 0])?,
        false => out.write_all(&[b'I', b'I', 42, 0, at as u8, 0, 0, 0])?,
    }
    for (i, directory) in directories.iter().enumerate() {
        let end = at + directory.size(big);
        out.write_all(&directory.bytes(big, at, if i + 1 < directories.len() { end } else { 0 }))?;
        at = end;
    }
    Ok(())
}
