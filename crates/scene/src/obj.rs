//! OBJ files: read in pieces, parsed on all cores, resolved in the order of the files.

use crate::budget;
use crate::counts::WarningKind;
use crate::error::{Place, SceneError, shown};
use crate::library::Libraries;
use crate::line_blocks::LineBlocks;
use crate::obj_chunk::{self, ObjChunk, RawCorner, RawFace, Switch};
use crate::paged::Paged;
use crate::placement::Placement;
use crate::sink::{Corner, Halt, Sink};
use crate::triangle::Triangle;
use gable_files::Reach;
use gable_geometry::DVec3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;

/// Bytes that are parsed at a time by one thread.
const PIECE: usize = 4 << 20;
/// Batches that are read ahead of the parser.
const AHEAD: usize = 1;

/// Streams files one after the other.
///
/// A thread of its own reads ahead, so that a slow disk and the parser work at the same time. While the pieces of one
/// batch are resolved in their order, those of the next are parsed by the threads of the pool, so the order of the
/// triangles is that of the files whatever the threads. In memory stand four batches (a piece of 4 MiB for each thread)
/// and the vertices of one file.
///
/// A material library is read where the file names it: one that is named after the faces that need it comes too late.
/// `placements` are those of the files.
pub(crate) fn stream(
    files: &[PathBuf],
    placements: &[Placement],
    reach: &Reach,
    sink: &mut Sink<'_>,
) -> Result<(), Halt> {
    let width = rayon::current_num_threads().max(1);
    std::thread::scope(|scope| {
        let (ahead, batches) = sync_channel(AHEAD);
        scope.spawn(move || {
            let mut reader = Reader { files, reach, next: 0, open: None };
            loop {
                let batch = reader.batch(width);
                let last = batch.as_ref().map_or(true, Vec::is_empty);
                // The receiver goes away where the stream was stopped.
                if ahead.send(batch).is_err() || last {
                    break;
                }
            }
        });
        let next = || batches.recv().unwrap_or_else(|_| Ok(Vec::new()));
        let mut tables = Tables::default();
        let mut libraries = Libraries::new(reach);
        let mut batch = parse_batch(next()?);
        while !batch.is_empty() {
            let texts = next()?;
            let mut parsed = Vec::new();
            let resolved = rayon::in_place_scope(|scope| {
                scope.spawn(|_| parsed = parse_batch(texts));
                batch.drain(..).try_for_each(|(file, first, chunk)| {
                    if first {
                        std::mem::take(&mut tables).leave(sink)?;
                        sink.begin(&files[file]);
                        tables.file = Some(&files[file]);
                    }
                    // What follows a fault of a file is not read.
                    if tables.fault.is_some() {
                        return Ok(());
                    }
                    let taken = match chunk {
                        Ok(chunk) => tables.take(&files[file], chunk, &placements[file], &mut libraries, sink),
                        Err(fault) => Err(fault.into()),
                    };
                    match taken {
                        Err(Halt::Failed(fault)) if fault.is_damage() => {
                            tables.fault = Some(fault);
                            Ok(())
                        }
                        other => other,
                    }
                })
            });
            resolved?;
            batch = parsed;
        }
        tables.leave(sink)
    })
}

/// An OBJ file is text: a byte near its start that no text has, or another encoding's mark, gives other files away.
fn check_text(path: &Path, text: &[u8]) -> Result<(), SceneError> {
    let start = &text[..text.len().min(1024)];
    // Blanks, line ends, the end mark of DOS and the escape of terminals are what text may have.
    let is_binary = |b: &u8| matches!(b, 0..9 | 14..26 | 28..32);
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") || start.iter().any(is_binary) {
        let found = shown(&text[..text.len().min(16)]);
        return Err(SceneError::WrongMagic {
            path: path.to_owned(),
            expected: "an OBJ text file (ASCII, UTF-8)",
            found,
        });
    }
    Ok(())
}

/// A piece of a file: the file's index, whether it is its first, its text, or why the file is not read on.
type Piece<T> = (usize, bool, Result<T, SceneError>);

/// Whole lines, and how many zero bytes follow them at the end of the file.
struct Lines {
    text: Vec<u8>,
    zeros: u64,
}

fn parse_batch(texts: Vec<Piece<Lines>>) -> Vec<Piece<ObjChunk>> {
    use rayon::prelude::*;
    let parse = |(file, first, lines): Piece<Lines>| (file, first, lines.map(|lines| parse_piece(first, &lines)));
    texts.into_par_iter().map(parse).collect()
}

fn parse_piece(first: bool, Lines { text, zeros }: &Lines) -> ObjChunk {
    let mark = b"\xef\xbb\xbf".as_slice();
    let text = if first { text.strip_prefix(mark).unwrap_or(text) } else { text };
    ObjChunk { zeros: *zeros, ..obj_chunk::parse(text) }
}

struct Reader<'a> {
    files: &'a [PathBuf],
    reach: &'a Reach,
    next: usize,
    open: Option<LineBlocks<'a>>,
}

impl Reader<'_> {
    /// The next pieces, at least `width` and about as many pieces' bytes, across the ends of files.
    fn batch(&mut self, width: usize) -> Result<Vec<Piece<Lines>>, SceneError> {
        let mut pieces = Vec::new();
        let mut bytes = 0;
        while bytes < width * PIECE {
            let mut first = false;
            let blocks = match &mut self.open {
                Some(blocks) => blocks,
                None => {
                    let Some(file) = self.files.get(self.next) else { break };
                    self.next += 1;
                    first = true;
                    self.open.insert(LineBlocks::open(file, self.reach, PIECE)?)
                }
            };
            let text = match blocks.next() {
                Ok(Some(text)) if first => check_text(&self.files[self.next - 1], &text).map(|()| text),
                Ok(Some(text)) => Ok(text),
                Ok(None) => {
                    let zeros = blocks.zeros();
                    self.open = None;
                    if first || zeros > 0 {
                        // An empty file still has to be counted.
                        pieces.push((self.next - 1, first, Ok(Lines { text: Vec::new(), zeros })));
                    }
                    continue;
                }
                Err(fault) => Err(fault),
            };
            match &text {
                Ok(text) => bytes += text.len(),
                Err(fault) if fault.is_damage() => self.open = None,
                Err(_) => return text.map(|_| pieces),
            }
            pieces.push((self.next - 1, first, text.map(|text| Lines { text, zeros: 0 })));
        }
        Ok(pieces)
    }
}

/// What faces of one file refer to.
struct Tables<'a> {
    file: Option<&'a Path>,
    faces: usize,
    positions: Paged<DVec3>,
    /// Shorter than `positions` where the last vertices have no colour.
    colours: Paged<[u8; 4]>,
    uvs: Paged<[f32; 2]>,
    /// Libraries that the file has named. Looked up only, never iterated.
    libraries: HashSet<Vec<u8>>,
    /// How many more it may name.
    names_left: usize,
    /// Their materials, by name, in the scene's list. Looked up only, never iterated.
    materials: HashMap<Vec<u8>, u32>,
    /// The name of the material in use; `None` before the first.
    using: Option<Vec<u8>>,
    /// Its number; `None` where no library defines it, which is counted at each face.
    material: Option<u32>,
    lines: u64,
    corners: Vec<Corner>,
    /// What ended the reading of the file.
    fault: Option<Box<SceneError>>,
}

impl Default for Tables<'_> {
    fn default() -> Self {
        Self {
            file: None,
            faces: 0,
            positions: Paged::default(),
            colours: Paged::default(),
            uvs: Paged::default(),
            libraries: HashSet::new(),
            names_left: budget::LIBRARY_NAMES,
            materials: HashMap::new(),
            using: None,
            material: None,
            lines: 0,
            corners: Vec::new(),
            fault: None,
        }
    }
}

impl Tables<'_> {
    /// Ends a file: says so if it held nothing, or was broken.
    fn leave(self, sink: &mut Sink<'_>) -> Result<(), Halt> {
        let Some(file) = self.file else { return Ok(()) };
        if sink.end(self.fault.map_or(Ok(()), |fault| Err(Halt::Failed(fault))))? && self.faces == 0 {
            sink.counts.warnings.add(WarningKind::EmptyFile, || file.display().to_string());
        }
        Ok(())
    }

    fn take(
        &mut self,
        file: &Path,
        chunk: ObjChunk,
        placement: &Placement,
        libraries: &mut Libraries<'_>,
        sink: &mut Sink<'_>,
    ) -> Result<(), Halt> {
        let (vertices, uvs) = (self.positions.len(), self.uvs.len());
        let most = (vertices + chunk.positions.len()).max(uvs + chunk.uvs.len());
        if most as u64 > budget::VERTICES {
            return Err(SceneError::too_many_vertices(file).into());
        }
        for (line, value) in chunk.not_finite {
            let place = Place::Line(self.lines + u64::from(line) + 1);
            let fault = SceneError::NotFinite { path: file.to_owned(), place, value };
            sink.broken(WarningKind::BrokenVertex, fault)?;
        }
        for &[x, y, z] in &chunk.positions {
            self.positions.push(sink.vertex(DVec3::new(x, y, z), placement));
        }
        if !chunk.colours.is_empty() {
            while self.colours.len() < vertices {
                self.colours.push([0; 4]);
            }
            chunk.colours.iter().for_each(|c| self.colours.push(*c));
        }
        chunk.uvs.iter().for_each(|uv| self.uvs.push(*uv));
        sink.counts.vertices += chunk.positions.len() as u64;
        sink.counts.faces += chunk.faces.len() as u64;
        self.faces += chunk.faces.len();

        let mut switches = chunk.switches.into_iter().peekable();
        let mut corners = chunk.corners.as_slice();
        for (at, face) in chunk.faces.iter().enumerate() {
            while let Some((_, switch)) = switches.next_if(|(from, _)| *from as usize <= at) {
                self.switch(file, switch, libraries, sink)?;
            }
            let (own, rest) = corners.split_at(face.corners as usize);
            corners = rest;
            self.face(file, face, own, vertices, uvs, sink)?;
        }
        for (_, switch) in switches {
            self.switch(file, switch, libraries, sink)?;
        }

        if chunk.commas > 0 {
            let line = self.lines + u64::from(chunk.first_comma) + 1;
            let place = || format!("{}: line {line}", file.display());
            sink.counts.warnings.add_many(WarningKind::DecimalComma, u64::from(chunk.commas), place);
        }
        if chunk.ignored > 0 {
            let line = self.lines + u64::from(chunk.first_ignored) + 1;
            let place = || format!("{}: line {line}", file.display());
            sink.counts.warnings.add_many(WarningKind::IgnoredStatement, u64::from(chunk.ignored), place);
        }
        if let Some((line, fault)) = chunk.fault {
            let place = Place::Line(self.lines + u64::from(line) + 1);
            return Err(match chunk.fault_at_end {
                true => SceneError::truncated(file, place, fault),
                false => SceneError::syntax(file, place, fault),
            }
            .into());
        }
        self.lines += u64::from(chunk.lines);
        if chunk.zeros > 0 {
            let what = format!("where {} zero bytes follow", chunk.zeros);
            sink.broken(WarningKind::ZeroBytes, SceneError::truncated(file, Place::Line(self.lines), what))?;
        }
        Ok(())
    }

    /// Takes up the materials of a library: the first definition of a name in a file counts.
    fn define(&mut self, numbers: std::ops::Range<u32>, sink: &Sink<'_>) {
        for number in numbers {
            let material = sink.materials[number as usize].name.clone().into_bytes();
            self.materials.entry(material).or_insert(number);
        }
    }

    /// Reads a library or takes up a material.
    fn switch(
        &mut self,
        file: &Path,
        switch: Switch,
        libraries: &mut Libraries<'_>,
        sink: &mut Sink<'_>,
    ) -> Result<(), SceneError> {
        match switch {
            Switch::Library(name) if self.libraries.contains(&name) => return Ok(()),
            Switch::Library(name) => {
                let instead = self.materials.is_empty();
                for numbers in libraries.named(file, &name, instead, &mut self.names_left, sink)? {
                    self.define(numbers, sink);
                }
                self.libraries.insert(name);
            }
            Switch::Material(name) => {
                // The first material of a file that has named no library.
                if self.libraries.is_empty()
                    && self.using.is_none()
                    && let Some(numbers) = libraries.of_same_name(file, sink)?
                {
                    self.define(numbers, sink);
                }
                self.using = Some(name);
            }
        }
        self.material = self.using.as_ref().and_then(|name| self.materials.get(name).copied());
        Ok(())
    }

    /// Resolves a face and hands on its triangles.
    #[inline]
    fn face(
        &mut self,
        file: &Path,
        face: &RawFace,
        raw: &[RawCorner],
        vertices: usize,
        uvs: usize,
        sink: &mut Sink<'_>,
    ) -> Result<(), Halt> {
        let line = self.lines + u64::from(face.line) + 1;
        let place = Place::Line(line);
        let (vertices, uvs) = (vertices + face.vertices as usize, uvs + face.uvs as usize);
        self.corners.clear();
        for corner in raw {
            let at = resolve(corner.vertex, vertices);
            let position = at.and_then(|at| Some((at, *self.positions.get(at)?)));
            let Some((at, position)) = position else {
                let fault = out_of_range(file, place, "vertex", corner.vertex, vertices);
                return sink.broken(WarningKind::BrokenFace, fault);
            };
            let mut uv = Corner::NO_UV;
            if corner.uv != 0 {
                let found = resolve(corner.uv, uvs).and_then(|at| self.uvs.get(at));
                match found {
                    Some(found) => uv = *found,
                    None => {
                        let fault = out_of_range(file, place, "texture coordinate", corner.uv, uvs);
                        return sink.broken(WarningKind::BrokenFace, fault);
                    }
                }
            }
            let colour = self.colours.get(at).copied().unwrap_or_default();
            self.corners.push(Corner { position, colour, uv });
        }
        if self.using.is_some() && self.material.is_none() {
            sink.warn(WarningKind::UnknownMaterial, file, place);
        }
        sink.polygon(&self.corners, self.material.unwrap_or(Triangle::NO_MATERIAL), file, place)
    }
}

/// The index from 0 that a number from 1, or back from the end, names.
#[inline]
fn resolve(index: i32, count: usize) -> Option<usize> {
    let at = if index > 0 { i64::from(index) - 1 } else { count as i64 + i64::from(index) };
    (index != 0 && at >= 0 && at < count as i64).then_some(at as usize)
}

#[cold]
fn out_of_range(path: &Path, place: Place, kind: &'static str, index: i32, count: usize) -> SceneError {
    // The parser keeps a texture index of 0 apart from "none".
    let index = if index == i32::MIN { 0 } else { i64::from(index) };
    SceneError::IndexOutOfRange { path: path.to_owned(), place, kind, index, count: count as u64 }
}
