//! One piece of an OBJ file, parsed apart from the others: what it says, before indices are resolved.

use crate::budget;
use crate::number::{parse_comma, parse_f64};

/// A corner of a face as written: positive from the start of the file, negative back from the face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct RawCorner {
    pub(crate) vertex: i32,
    /// 0 for none.
    pub(crate) uv: i32,
}

/// A face: the next `corners` corners of the piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RawFace {
    pub(crate) corners: u32,
    /// Line of the piece, from 0.
    pub(crate) line: u32,
    /// Vertices of the piece before it.
    pub(crate) vertices: u32,
    /// Texture coordinates of the piece before it.
    pub(crate) uvs: u32,
}

/// A statement that holds for the faces after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Switch {
    /// `mtllib`: a library, or several, as written.
    Library(Vec<u8>),
    /// `usemtl`: a material's name.
    Material(Vec<u8>),
}

/// What a piece of an OBJ file says.
#[derive(Debug, Default)]
pub(crate) struct ObjChunk {
    pub(crate) positions: Vec<[f64; 3]>,
    /// Lines of vertices with a coordinate that is not finite, and what stands there.
    pub(crate) not_finite: Vec<(u32, String)>,
    /// sRGB and 255 for each position; empty if no vertex of the piece has a colour.
    pub(crate) colours: Vec<[u8; 4]>,
    /// NaN where the file has no finite number.
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) faces: Vec<RawFace>,
    pub(crate) corners: Vec<RawCorner>,
    /// Libraries and materials, each with the face of the piece from which on it holds.
    pub(crate) switches: Vec<(u32, Switch)>,
    /// Statements that are passed over, and the line of the first.
    pub(crate) ignored: u32,
    pub(crate) first_ignored: u32,
    /// Numbers with a comma in place of their point, and the line of the first.
    pub(crate) commas: u32,
    pub(crate) first_comma: u32,
    /// Lines in the piece.
    pub(crate) lines: u32,
    /// Zero bytes after the last line of the file.
    pub(crate) zeros: u64,
    /// The first line that is wrong, if one is; what follows it was not parsed.
    pub(crate) fault: Option<(u32, String)>,
    /// Whether the faulty line is the last and lacks its line end.
    pub(crate) fault_at_end: bool,
}

/// Parses whole lines.
pub(crate) fn parse(text: &[u8]) -> ObjChunk {
    let mut chunk = ObjChunk::default();
    let mut joined = Vec::new();
    let mut start = 0;
    while start < text.len() {
        let line_number = chunk.lines;
        let (mut line, mut next) = line_at(text, start);
        chunk.lines += 1;
        if line.ends_with(b"\\") {
            joined.clear();
            while let Some(part) = line.strip_suffix(b"\\") {
                joined.extend_from_slice(part);
                joined.push(b' ');
                if next >= text.len() {
                    line = b"";
                    break;
                }
                (line, next) = line_at(text, next);
                chunk.lines += 1;
            }
            joined.extend_from_slice(line);
            line = &joined;
        }
        let unended = next >= text.len() && !text.ends_with(b"\n");
        let faces = chunk.faces.len();
        let mut result = chunk.statement(line, line_number);
        if unended && result.is_ok() {
            result = chunk.check_last(line, faces);
        }
        if let Err(fault) = result {
            chunk.fault_at_end = unended;
            chunk.fault = Some((line_number, fault));
            break;
        }
        start = next;
    }
    chunk
}

/// The line that starts at a byte, without its end, and the byte after that.
#[inline]
fn line_at(text: &[u8], start: usize) -> (&[u8], usize) {
    let (end, next) = match memchr::memchr(b'\n', &text[start..]) {
        Some(at) => (start + at, start + at + 1),
        None => (text.len(), text.len()),
    };
    let line = &text[start..end];
    (line.strip_suffix(b"\r").unwrap_or(line), next)
}

impl ObjChunk {
    #[inline]
    fn statement(&mut self, line: &[u8], number: u32) -> Result<(), String> {
        match line {
            [b'v', b' ' | b'\t', rest @ ..] => self.position(rest, number),
            [b'f', b' ' | b'\t', rest @ ..] => self.face(rest, number),
            [b'v', b't', b' ' | b'\t', rest @ ..] => self.texture_coordinate(rest, number),
            [] | [b'#', ..] | [b'v', b'n', b' ' | b'\t', ..] => Ok(()),
            _ => self.other(line, number),
        }
    }

    /// A number with a comma in place of its point, which is counted.
    #[cold]
    fn comma(&mut self, word: &[u8], line: u32) -> Option<f64> {
        let value = parse_comma(word)?;
        if self.commas == 0 {
            self.first_comma = line;
        }
        self.commas += 1;
        Some(value)
    }

    /// `v x y z`, `v x y z w`, `v x y z r g b`.
    #[inline]
    fn position(&mut self, rest: &[u8], line: u32) -> Result<(), String> {
        let mut words = Words { rest };
        let mut position = [0.0; 3];
        for (axis, value) in ["x", "y", "z"].iter().zip(&mut position) {
            let Some(word) = words.next() else {
                return Err(format!("a vertex without {axis}"));
            };
            *value = match parse_f64(word).or_else(|| self.comma(word, line)) {
                Some(value) => value,
                None => {
                    let word = crate::error::shown(word);
                    return Err(format!("{word} stands where a vertex has its {axis}"));
                }
            };
            if !value.is_finite() && self.not_finite.last().is_none_or(|(last, _)| *last != line) {
                self.not_finite.push((line, crate::error::shown(word)));
            }
        }
        self.positions.push(position);
        if let Some(r) = words.next() {
            self.colour(r, words);
        } else if !self.colours.is_empty() {
            self.colours.push([0; 4]);
        }
        Ok(())
    }

    /// Three more numbers after a position are a colour, 0 to 1 or 0 to 255; a single one is a weight.
    #[cold]
    fn colour(&mut self, r: &[u8], mut words: Words<'_>) {
        let channel = |word: Option<&[u8]>| word.and_then(parse_f64).filter(|c| c.is_finite());
        let rgb = (channel(Some(r)), channel(words.next()), channel(words.next()));
        let colour = if let (Some(r), Some(g), Some(b)) = rgb {
            let scale = if r.max(g).max(b) > 1.0 { 1.0 } else { 255.0 };
            let [r, g, b] = [r, g, b].map(|c| (c * scale).round().clamp(0.0, 255.0) as u8);
            [r, g, b, 255]
        } else {
            [0; 4]
        };
        if self.colours.is_empty() && colour[3] == 0 {
            return;
        }
        self.colours.resize(self.positions.len() - 1, [0; 4]);
        self.colours.push(colour);
    }

    /// `vt u [v [w]]`.
    #[inline]
    fn texture_coordinate(&mut self, rest: &[u8], line: u32) -> Result<(), String> {
        let mut words = Words { rest };
        let u = words.next().and_then(|word| parse_f64(word).or_else(|| self.comma(word, line)));
        let Some(u) = u else {
            return Err("a texture coordinate without a number".to_owned());
        };
        let v = match words.next() {
            None => 0.0,
            Some(word) => parse_f64(word).or_else(|| self.comma(word, line)).ok_or_else(|| {
                let word = crate::error::shown(word);
                format!("{word} stands where a texture coordinate has its v")
            })?,
        };
        let uv = [u as f32, v as f32];
        self.uvs.push(if uv.iter().all(|c| c.is_finite()) { uv } else { [f32::NAN; 2] });
        Ok(())
    }

    /// `f v…`, `f v/vt…`, `f v//vn…`, `f v/vt/vn…`.
    #[inline]
    fn face(&mut self, rest: &[u8], line: u32) -> Result<(), String> {
        let before = self.corners.len();
        let words = Words { rest };
        for word in words {
            let Some(corner) = corner(word) else {
                let comma = word.contains(&b',');
                let word = crate::error::shown(word);
                return Err(match comma {
                    true => format!("a comma stands in {word}: write the corners of a face apart by blanks"),
                    false => format!("{word} is no corner of a face: write v, v/vt or v/vt/vn"),
                });
            };
            self.corners.push(corner);
            if self.corners.len() - before > budget::CORNERS {
                return Err(format!("a face of more than {} corners", budget::CORNERS));
            }
        }
        self.faces.push(RawFace {
            corners: (self.corners.len() - before) as u32,
            line,
            vertices: self.positions.len() as u32,
            uvs: self.uvs.len() as u32,
        });
        Ok(())
    }

    /// Looks for the marks of a cut in a last line without a line end: what would be put up with elsewhere (a face of
    /// two corners, a lone keyword) is there the start of a statement. A cut inside the last number cannot be seen.
    #[cold]
    fn check_last(&self, line: &[u8], faces_before: usize) -> Result<(), String> {
        let cut = |what: &str| Err(what.to_owned());
        if matches!(line.trim_ascii(), b"v" | b"vt" | b"vn" | b"f" | b"usemtl" | b"us" | b"use") {
            return cut("within a statement");
        }
        let Some(face) = self.faces.get(faces_before) else { return Ok(()) };
        let corners = &self.corners[self.corners.len() - face.corners as usize..];
        if corners.len() < 3 {
            return cut("within a face");
        }
        let textured = corners.iter().filter(|c| c.uv != 0).count();
        if textured == corners.len() - 1 && corners[textured].uv == 0 {
            return cut("within a face's last corner");
        }
        Ok(())
    }

    /// Statements that are rare.
    #[cold]
    fn other(&mut self, line: &[u8], number: u32) -> Result<(), String> {
        let trimmed = line.trim_ascii();
        if trimmed.len() < line.len() && !trimmed.is_empty() {
            // Blanks before the keyword: allowed, though nobody writes them in large files.
            return self.statement(trimmed, number);
        }
        let (keyword, rest) = crate::mtl::split_word(trimmed);
        match keyword.to_ascii_lowercase().as_slice() {
            b"usemtl" => self.switches.push((self.faces.len() as u32, Switch::Material(rest.to_vec()))),
            b"mtllib" => self.switches.push((self.faces.len() as u32, Switch::Library(rest.to_vec()))),
            b"" | b"o" | b"g" | b"s" | b"vn" | b"vp" => {}
            _ => {
                if self.ignored == 0 {
                    self.first_ignored = number;
                }
                self.ignored += 1;
            }
        }
        Ok(())
    }
}

/// One corner: the normal's index is passed over.
#[inline]
fn corner(word: &[u8]) -> Option<RawCorner> {
    let (vertex, rest) = index(word)?;
    match rest {
        [] => Some(RawCorner { vertex, uv: 0 }),
        [b'/', b'/', rest @ ..] => index(rest).filter(|(_, end)| end.is_empty()).map(|_| RawCorner { vertex, uv: 0 }),
        // Some programs leave the slash where there is nothing to write.
        [b'/'] => Some(RawCorner { vertex, uv: 0 }),
        [b'/', rest @ ..] => {
            let (uv, rest) = index(rest)?;
            let fits = match rest {
                [] | [b'/'] => true,
                [b'/', rest @ ..] => index(rest).is_some_and(|(_, end)| end.is_empty()),
                _ => false,
            };
            // An index of 0 names nothing: it must not be taken for "none".
            fits.then_some(RawCorner { vertex, uv: if uv == 0 { i32::MIN } else { uv } })
        }
        _ => None,
    }
}

/// A whole number at the start of a word, and what follows it.
#[inline]
fn index(word: &[u8]) -> Option<(i32, &[u8])> {
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        rest => (false, rest),
    };
    let mut value = 0i64;
    let mut at = 0;
    while let Some(digit) = digits.get(at).map(|d| d.wrapping_sub(b'0')).filter(|d| *d < 10) {
        value = value * 10 + i64::from(digit);
        at += 1;
        if at > 10 {
            return None;
        }
    }
    if at == 0 {
        return None;
    }
    let value = if negative { -value } else { value };
    // Beyond what can be there: kept in range, it is reported as out of range.
    let value = value.clamp(i64::from(-i32::MAX), i64::from(i32::MAX)) as i32;
    Some((value, &digits[at..]))
}

/// The words of a line; a comment ends it.
#[derive(Clone, Copy)]
struct Words<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let blank = |b: u8| b == b' ' || b == b'\t' || b == b'\r';
        let mut start = 0;
        while self.rest.get(start).is_some_and(|b| blank(*b)) {
            start += 1;
        }
        let mut end = start;
        while self.rest.get(end).is_some_and(|b| !blank(*b)) {
            end += 1;
        }
        let word = &self.rest[start..end];
        self.rest = &self.rest[end..];
        if word.is_empty() || word[0] == b'#' {
            self.rest = &[];
            return None;
        }
        Some(word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(vertex: i32, uv: i32) -> RawCorner {
        RawCorner { vertex, uv }
    }

    #[test]
    fn reads_every_form_of_a_corner() {
        let chunk = parse(b"f 1 2/3 4//5 6/7/8\nf -1/-2/-3 9/ 10//1 11/12/ # comment\n");
        let corners = [raw(1, 0), raw(2, 3), raw(4, 0), raw(6, 7), raw(-1, -2), raw(9, 0), raw(10, 0), raw(11, 12)];
        assert_eq!(chunk.corners, corners);
        assert_eq!(chunk.faces.iter().map(|f| f.corners).collect::<Vec<_>>(), [4, 4]);
        for word in ["", "/", "a", "1/a", "1/2/3/4", "1//", "1//2/", "--1", "1.5", "12345678901"] {
            assert_eq!(corner(word.as_bytes()), None, "{word}");
        }
    }

    #[test]
    fn lines_may_be_continued_and_end_in_any_way() {
        let chunk = parse(b"v 1 2 \\\r\n3\r\nv 4 5 6\n\n  v 7\t8 9\r\nf 1 \\\n 2 \\\n 3\nusemtl a b \nf 3 2 1");
        assert_eq!(chunk.positions, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]);
        assert_eq!(chunk.faces.len(), 2);
        assert_eq!((chunk.faces[0].line, chunk.faces[1].line, chunk.lines), (5, 9, 10));
        assert_eq!(chunk.switches, [(1, Switch::Material(b"a b".to_vec()))]);
        assert!(chunk.fault.is_none());
    }

    #[test]
    fn colours_are_of_either_scale_and_may_begin_late() {
        let chunk = parse(b"v 0 0 0\nv 0 0 0 1\nv 0 0 0 1 0.5 0\nv 0 0 0 255 128 0\nv 0 0 0\n");
        assert_eq!(chunk.colours, [[0; 4], [0; 4], [255, 128, 0, 255], [255, 128, 0, 255], [0; 4]]);
    }

    #[test]
    fn faults_name_their_line() {
        let fault = |text: &str| parse(text.as_bytes()).fault.map(|(line, _)| line);
        assert_eq!(fault("v 1 2 3\nv 1 2\n"), Some(1));
        let chunk = parse(b"v 1 2 \\\n3\n\nv 1 nan 2\nv -nan(ind) 1 1.#INF\nv 1 2 3\n");
        assert_eq!(chunk.not_finite, [(3, "\"nan\"".to_owned()), (4, "\"-nan(ind)\"".to_owned())]);
        assert!(chunk.positions.len() == 4 && chunk.fault.is_none(), "faces count on every vertex");
        assert_eq!(fault("  f 1 x 3\n"), Some(0));
    }

    #[test]
    fn a_cut_is_seen_in_a_last_line_without_end() {
        for cut in ["v 1 2", "v", "vt", "f", "us", "f 3", "f 1/1 2/", "f 1/1 2/b", "f 1/1 2/2 3", "f 1/1 2/2 3/"] {
            let chunk = parse(format!("v 1 2 3\n{cut}").as_bytes());
            assert!(chunk.fault.is_some_and(|(line, _)| line == 1) && chunk.fault_at_end, "{cut}");
        }
        for whole in
            ["f 1 2 3", "f 1/1 2/2 3/3", "f 1//1 2//1 3//1", "v 1 2 3", "# f 3", "f 1/1 2/2 3\n", "f 3\n", "v\n"]
        {
            assert!(parse(format!("v 1 2 3\n{whole}").as_bytes()).fault.is_none(), "{whole}");
        }
    }

    #[test]
    fn libraries_stand_at_the_start_of_lines() {
        let chunk = parse(b"mtllib a.mtl\n# mtllib no\nf 1 2 3\n mtllib b c.mtl\r\nmtllibx no\n");
        let library = |name: &[u8]| Switch::Library(name.to_vec());
        assert_eq!(chunk.switches, [(0, library(b"a.mtl")), (1, library(b"b c.mtl"))]);
    }
}
