//! OFF files (Geomview): text or binary, with colours, normals and texture coordinates at the vertices if the keyword says so.

use crate::budget;
use crate::counts::WarningKind;
use crate::error::{SceneError, shown};
use crate::number::parse_f64;
use crate::paged::Paged;
use crate::placement::Placement;
use crate::ply_header::Scalar;
use crate::sink::{Corner, Halt, Sink};
use crate::tokens::Tokens;
use crate::triangle::Triangle;
use crate::values::Values;
use gable_files::Reach;
use gable_geometry::DVec3;
use std::io::{BufRead as _, BufReader};
use std::path::Path;

/// What the keyword says about the vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Layout {
    texture: bool,
    colour: bool,
    normal: bool,
    /// A fourth coordinate, which divides the others.
    weight: bool,
}

impl Layout {
    /// Reads `[ST][C][N][4]OFF`.
    fn of(keyword: &[u8]) -> Option<Self> {
        let mut rest = keyword.strip_suffix(b"OFF")?;
        let mut has = |prefix: &[u8]| match rest.strip_prefix(prefix) {
            Some(after) => {
                rest = after;
                true
            }
            None => false,
        };
        let layout = Self { texture: has(b"ST"), colour: has(b"C"), normal: has(b"N"), weight: has(b"4") };
        rest.is_empty().then_some(layout)
    }
}

#[derive(Clone, Copy)]
struct Vertex {
    position: DVec3,
    colour: [u8; 4],
    uv: [f32; 2],
}

/// Streams one file. The vertices stand in memory, the faces do not.
pub(crate) fn stream(path: &Path, reach: &Reach, placement: Placement, sink: &mut Sink<'_>) -> Result<(), Halt> {
    let (mut numbers, layout) = open(path, reach)?;
    let vertices = count(path, &mut numbers, "the number of vertices")?;
    let faces = count(path, &mut numbers, "the number of faces")?;
    if vertices > budget::VERTICES {
        return Err(SceneError::too_many_vertices(path).into());
    }
    // The number of edges is there by the book, and used by nobody.
    match &mut numbers {
        Values::Text(tokens) => tokens.skip_line()?,
        binary @ Values::Binary { .. } => drop(binary.next(Scalar::I32, "the number of edges")?),
    }

    let mut table: Paged<Vertex> = Paged::default();
    for _ in 0..vertices {
        let (mut read, fault) = vertex(path, &mut numbers, layout)?;
        if let Some(fault) = fault {
            sink.broken(WarningKind::BrokenVertex, fault)?;
        }
        read.position = sink.vertex(read.position, &placement);
        table.push(read);
        sink.counts.vertices += 1;
    }
    let mut corners = Vec::new();
    for _ in 0..faces {
        let size = numbers.next(Scalar::I32, "the number of a face's corners")?;
        let place = numbers.place();
        if !(0.0..=budget::CORNERS as f64).contains(&size) || size.fract() != 0.0 {
            return Err(SceneError::syntax(path, place, format!("a face cannot have {size} corners")).into());
        }
        corners.clear();
        let mut fault: Option<SceneError> = None;
        for _ in 0..size as usize {
            let index = numbers.next(Scalar::I32, "a vertex of a face")?;
            let found = if index >= 0.0 && index.fract() == 0.0 { table.get(index as usize) } else { None };
            let Some(Vertex { position, colour, uv }) = found.copied() else {
                fault.get_or_insert(SceneError::IndexOutOfRange {
                    path: path.to_owned(),
                    place: numbers.place(),
                    kind: "vertex",
                    index: index as i64,
                    count: vertices,
                });
                continue;
            };
            corners.push(Corner { position, colour, uv });
        }
        skip_colour(path, &mut numbers)?;
        sink.counts.faces += 1;
        if let Some(fault) = fault {
            sink.broken(WarningKind::BrokenFace, fault)?;
            continue;
        }
        sink.polygon(&corners, Triangle::NO_MATERIAL, path, place)?;
    }
    if let Values::Text(tokens) = &numbers
        && tokens.commas > 0
    {
        sink.commas(tokens.commas, path);
    }
    Ok(())
}

/// Opens a file: its numbers from the number of vertices on, and what its keyword says. The keyword may be left out.
fn open<'a>(path: &'a Path, reach: &Reach) -> Result<(Values<'a>, Layout), SceneError> {
    let mut reader = BufReader::with_capacity(1 << 20, reach.open(path)?);
    let start = reader.fill_buf().map_err(|e| SceneError::read(path, e))?;
    if let Some((layout, length)) = binary(start) {
        reader.consume(length);
        return Ok((Values::Binary { path, reader, offset: length as u64, big: true }, layout));
    }
    let mark = if start.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    reader.consume(mark);
    let mut tokens = Tokens::new(path, reader, Some(b'#'), 1);
    let keyword = tokens.next(false)?.unwrap_or_default().to_vec();
    let layout = match (Layout::of(&keyword), parse_f64(&keyword)) {
        (Some(layout), _) => layout,
        (None, Some(_)) => {
            tokens.again();
            Layout::default()
        }
        (None, None) => {
            return Err(SceneError::WrongMagic {
                path: path.to_owned(),
                expected: "an OFF file (OFF, COFF, NOFF, STOFF)",
                found: shown(&keyword),
            });
        }
    };
    Ok((Values::Text(tokens), layout))
}

/// What the first line of a binary file says, as Geomview has it: `OFF BINARY`; and its bytes.
fn binary(start: &[u8]) -> Option<(Layout, usize)> {
    let end = memchr::memchr(b'\n', &start[..start.len().min(80)])?;
    let mut words = start[..end].split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let layout = Layout::of(words.next()?)?;
    (words.next()? == b"BINARY").then_some((layout, end + 1))
}

fn count(path: &Path, numbers: &mut Values<'_>, what: &str) -> Result<u64, SceneError> {
    let value = numbers.next(Scalar::I32, what)?;
    if (0.0..=1e12).contains(&value) && value.fract() == 0.0 {
        Ok(value as u64)
    } else {
        Err(SceneError::syntax(path, numbers.place(), format!("{value} stands where {what} is expected")))
    }
}

/// A face's own colour is passed over: the rest of its line, or as many numbers as are told.
fn skip_colour(path: &Path, numbers: &mut Values<'_>) -> Result<(), SceneError> {
    let binary = match numbers {
        Values::Text(tokens) => return tokens.skip_line(),
        binary @ Values::Binary { .. } => binary,
    };
    let length = binary.next(Scalar::I32, "the number of a colour's components")?;
    if !(0.0..=4.0).contains(&length) {
        let what = format!("a colour cannot have {length} components");
        return Err(SceneError::syntax(path, binary.place(), what));
    }
    (0..length as usize).try_for_each(|_| binary.next(Scalar::F32, "a face's colour").map(drop))
}

/// `x y z [w] [nx ny nz] [colour to the end of the line] [s t]`; and what is wrong with its place, if something is.
fn vertex(path: &Path, numbers: &mut Values<'_>, layout: Layout) -> Result<(Vertex, Option<SceneError>), SceneError> {
    let mut coordinates = [0.0, 0.0, 0.0, 1.0];
    let used = if layout.weight { 4 } else { 3 };
    let start = numbers.place();
    for value in &mut coordinates[..used] {
        *value = numbers.next(Scalar::F32, "a vertex coordinate")?;
    }
    let [x, y, z, w] = coordinates;
    let position = DVec3::new(x, y, z) / w;
    let fault = (!position.is_finite()).then(|| {
        let value = coordinates.iter().find(|c| !c.is_finite()).map_or("divided by 0".to_owned(), f64::to_string);
        let place = if let Values::Text(_) = numbers { numbers.place() } else { start };
        SceneError::NotFinite { path: path.to_owned(), place, value }
    });
    let mut rest = Vec::new();
    match numbers {
        Values::Text(tokens) => {
            while let Some(value) = tokens.number_on_line()? {
                if rest.len() < 16 {
                    rest.push(value);
                }
            }
            tokens.skip_line()?;
        }
        binary @ Values::Binary { .. } => {
            let parts = [(layout.normal, 3), (layout.colour, 4), (layout.texture, 2)];
            let length: usize = parts.iter().map(|(there, length)| if *there { *length } else { 0 }).sum();
            for _ in 0..length {
                rest.push(binary.next(Scalar::F32, "what goes with a vertex")?);
            }
        }
    }
    if layout.normal {
        rest.drain(..rest.len().min(3));
    }
    let uv = if layout.texture && rest.len() >= 2 {
        let uv = rest.split_off(rest.len() - 2);
        [uv[0] as f32, uv[1] as f32]
    } else {
        Corner::NO_UV
    };
    let colour = match rest[..] {
        [r, g, b, ..] if layout.colour => rgb([r, g, b], rest.iter().all(|c| *c <= 1.0)),
        _ => [0; 4],
    };
    Ok((Vertex { position, colour, uv }, fault))
}

/// A colour of either scale; whole numbers are 0 to 255, fractions 0 to 1.
fn rgb(colour: [f64; 3], fractions: bool) -> [u8; 4] {
    let scale = if fractions { 255.0 } else { 1.0 };
    let [r, g, b] = colour.map(|c| (c * scale).round().clamp(0.0, 255.0) as u8);
    [r, g, b, 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keywords_say_what_vertices_have() {
        assert_eq!(Layout::of(b"OFF"), Some(Layout::default()));
        assert_eq!(Layout::of(b"COFF"), Some(Layout { colour: true, ..Layout::default() }));
        let all = Layout { texture: true, colour: true, normal: true, weight: true };
        assert_eq!(Layout::of(b"STCN4OFF"), Some(all));
        for wrong in [b"OF".as_slice(), b"nOFF", b"NCOFF", b"ply", b""] {
            assert_eq!(Layout::of(wrong), None);
        }
    }
}
