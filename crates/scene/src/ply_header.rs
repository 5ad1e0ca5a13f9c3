//! The header of a PLY file.

use crate::error::{Place, SceneError, shown};
use std::io::{BufRead, Read};
use std::path::Path;

/// Longest header line, bytes.
const LONGEST_LINE: u64 = 4096;
/// Most lines of a header.
const MOST_LINES: u64 = 10_000;

/// How the numbers behind the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// A type of number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a number in a binary file.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// One property of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Property {
    pub(crate) name: String,
    pub(crate) item: Scalar,
    /// Type of the number of items, for a list.
    pub(crate) list: Option<Scalar>,
}

/// A table of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
}

/// What a header says.
#[derive(Clone, Debug)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
    /// Image files that a comment names, as MeshLab does.
    pub(crate) textures: Vec<String>,
    /// Bytes of the header.
    pub(crate) length: u64,
    /// Lines of the header.
    pub(crate) lines: u64,
}

/// Reads the header; the reader stands behind it.
pub(crate) fn read(path: &Path, reader: &mut impl BufRead) -> Result<Header, SceneError> {
    let mut header =
        Header { encoding: Encoding::Ascii, elements: Vec::new(), textures: Vec::new(), length: 0, lines: 0 };
    let mut format = false;
    let first = reader.fill_buf().map_err(|e| SceneError::read(path, e))?;
    // Old programs end lines with CR alone. What follows a header is binary, so that the first line tells of all.
    let line_end = if first.starts_with(b"ply\r") && first.get(4) != Some(&b'\n') { b'\r' } else { b'\n' };
    loop {
        let mut bytes = Vec::new();
        let read = reader.by_ref().take(LONGEST_LINE).read_until(line_end, &mut bytes);
        header.length += read.map_err(|e| SceneError::read(path, e))? as u64;
        header.lines += 1;
        let place = Place::Line(header.lines);
        if header.lines == 1 && bytes.trim_ascii() != b"ply" {
            let found = shown(&bytes[..bytes.len().min(16)]);
            return Err(SceneError::WrongMagic { path: path.to_owned(), expected: "a PLY file (ply)", found });
        }
        if bytes.last() != Some(&line_end) || header.lines > MOST_LINES {
            if bytes.len() as u64 == LONGEST_LINE || header.lines > MOST_LINES {
                return Err(SceneError::syntax(path, place, "this is no PLY header"));
            }
            return Err(SceneError::truncated(path, place, "within the header"));
        }
        let line = String::from_utf8_lossy(bytes.trim_ascii()).into_owned();
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["ply"] | [] => {}
            ["format", name, ..] => {
                format = true;
                header.encoding = match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    _ => return Err(SceneError::syntax(path, place, format!("format {name:?} is not known"))),
                };
            }
            ["comment", keyword, ..] if keyword.eq_ignore_ascii_case("TextureFile") => {
                let name = line.split_once(keyword).map_or("", |(_, name)| name.trim());
                header.textures.push(name.to_owned());
            }
            ["comment" | "obj_info", ..] => {}
            ["element", name, count] => {
                let count = count
                    .parse()
                    .map_err(|_| SceneError::syntax(path, place, format!("{count:?} is no number of elements")))?;
                header.elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
            }
            ["property", ref kind @ .., name] => {
                let property = match *kind {
                    [item] => Scalar::of(item).map(|item| (item, None)),
                    ["list", count, item] => Scalar::of(count).zip(Scalar::of(item)).map(|(c, i)| (i, Some(c))),
                    _ => None,
                };
                let (Some((item, list)), Some(element)) = (property, header.elements.last_mut()) else {
                    return Err(SceneError::syntax(path, place, format!("{line:?} is no property")));
                };
                element.properties.push(Property { name: name.to_owned(), item, list });
            }
            ["end_header"] if format => return Ok(header),
            _ => return Err(SceneError::syntax(path, place, format!("{line:?} does not belong in a PLY header"))),
        }
    }
}
