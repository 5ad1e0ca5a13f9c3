//! The bytes of a glTF file: its JSON, and its buffers wherever they are.

use crate::b3dm;
use crate::budget;
use crate::error::{Place, SceneError, shown};
use crate::gltf_nodes::Nodes;
use crate::uri::{self, Target};
use gable_files::Reach;
use gable_geometry::DVec3;
use gltf::{Document, buffer, json};
use std::collections::BTreeSet;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Where the bytes of a buffer are.
#[derive(Debug)]
enum Bytes {
    /// In a file, from a byte on.
    File { path: PathBuf, start: u64, length: u64 },
    /// In the JSON.
    Memory(Vec<u8>),
}

/// An opened GLB or glTF file; buffers are read piece by piece, as they are wanted.
#[derive(Debug)]
pub(crate) struct Container {
    pub(crate) path: PathBuf,
    pub(crate) reach: Reach,
    pub(crate) document: Document,
    pub(crate) nodes: Nodes,
    /// Whether its numbers may be quantised.
    pub(crate) quantised: bool,
    /// What all positions of a tile are relative to, as the tile says, z up.
    pub(crate) tile_centre: Option<DVec3>,
    buffers: Vec<Bytes>,
}

impl Container {
    /// Opens a file and finds its buffers.
    pub(crate) fn open(path: &Path, reach: &Reach) -> Result<Self, SceneError> {
        let Glb { json, binary, tile_centre } = read_json(path, reach)?;
        let fault = |error: &dyn std::fmt::Display| {
            let what = format!("this is not a glTF 2.0 scene that can be read: {error}");
            SceneError::Unsupported { path: path.to_owned(), what }
        };
        if memchr::memchr_iter(b'{', &json).take(budget::JSON_OBJECTS + 1).count() > budget::JSON_OBJECTS {
            let what = format!("its JSON has more than {} objects", budget::JSON_OBJECTS);
            return Err(SceneError::too_much(path, what));
        }
        let mut root: json::Root = json::deserialize::from_slice(&json).map_err(|e| fault(&e))?;
        let nodes = Nodes::read(&json).map_err(|e| fault(&e))?;
        check_compression(path, &root.extensions_required)?;
        root.extensions_required.retain(|name| !is_optional(name));
        let quantised = root.extensions_used.iter().any(|name| name == "KHR_mesh_quantization");
        check_attributes(&root).map_err(|e| fault(&e))?;
        let document = Document::from_json(root).map_err(|e| fault(&e))?;
        let mut container = Self {
            path: path.to_owned(),
            reach: reach.clone(),
            document,
            nodes,
            quantised,
            tile_centre,
            buffers: Vec::new(),
        };
        let mut buffers = Vec::new();
        for buffer in container.document.buffers() {
            buffers.push(container.find(&buffer, binary)?);
        }
        container.buffers = buffers;
        Ok(container)
    }

    fn find(&self, buffer: &buffer::Buffer<'_>, binary: Option<(u64, u64)>) -> Result<Bytes, SceneError> {
        match buffer.source() {
            buffer::Source::Bin => {
                let (start, length) =
                    binary.ok_or_else(|| self.fault("a buffer has neither a URI nor a binary chunk"))?;
                Ok(Bytes::File { path: self.path.clone(), start, length })
            }
            buffer::Source::Uri(text) => match self.resolve(text)? {
                Target::Bytes(bytes) => Ok(Bytes::Memory(bytes)),
                Target::File(path) => {
                    let length = self.reach.length(&path)?;
                    Ok(Bytes::File { path, start: 0, length })
                }
            },
        }
    }

    /// Bytes of all buffers together; a file that is several of them counts once.
    pub(crate) fn buffer_bytes(&self) -> u64 {
        let mut files = BTreeSet::new();
        let mut bytes = 0_u64;
        for buffer in &self.buffers {
            match buffer {
                Bytes::File { path, length, .. } => {
                    if files.insert(path.canonicalize().unwrap_or_else(|_| path.clone())) {
                        bytes = bytes.saturating_add(*length);
                    }
                }
                Bytes::Memory(content) => bytes = bytes.saturating_add(content.len() as u64),
            }
        }
        bytes
    }

    /// What a URI of this file stands for.
    pub(crate) fn resolve(&self, text: &str) -> Result<Target, SceneError> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        uri::resolve(folder, text).map_err(|what| self.fault(&what))
    }

    /// The error for something that is wrong in the file.
    pub(crate) fn fault(&self, what: &str) -> SceneError {
        SceneError::Unsupported { path: self.path.clone(), what: what.to_owned() }
    }

    /// Some bytes of a buffer.
    pub(crate) fn read(&self, buffer: usize, offset: u64, length: u64) -> Result<Vec<u8>, SceneError> {
        let outside = |all: u64, path: &Path, start: u64| {
            let what = format!("where bytes {offset} to {} of a buffer are expected", offset.saturating_add(length));
            SceneError::truncated(path, Place::Byte(start.saturating_add(all)), what)
        };
        let end = offset.saturating_add(length);
        match self.buffers.get(buffer) {
            None => Err(self.fault("a buffer that is named is not there")),
            Some(Bytes::Memory(bytes)) => match bytes.get(offset as usize..end as usize) {
                Some(part) if end <= bytes.len() as u64 => Ok(part.to_vec()),
                _ => Err(outside(bytes.len() as u64, &self.path, 0)),
            },
            Some(Bytes::File { path, start, length: all }) => {
                if end > *all {
                    return Err(outside(*all, path, *start));
                }
                read_at(path, &self.reach, start + offset, length)
            }
        }
    }

    /// The bytes of a view of a buffer, at most `most` of them.
    pub(crate) fn read_view(&self, view: &buffer::View<'_>, most: u64) -> Result<Vec<u8>, SceneError> {
        self.read(view.buffer().index(), view.offset() as u64, (view.length() as u64).min(most))
    }
}

/// Whether an extension may be required and is read here, or changes nothing of the shape: how surfaces shine, lights, what is told
/// about things.
fn is_optional(name: &str) -> bool {
    const NAMES: [&str; 17] = [
        "CESIUM_RTC",
        "KHR_mesh_quantization",
        "KHR_texture_basisu",
        "EXT_texture_webp",
        "EXT_texture_avif",
        "MSFT_texture_dds",
        "KHR_lights_punctual",
        "EXT_lights_image_based",
        "KHR_xmp",
        "KHR_xmp_json_ld",
        "KHR_animation_pointer",
        "EXT_structural_metadata",
        "EXT_mesh_features",
        "EXT_feature_metadata",
        "EXT_instance_features",
        "CESIUM_primitive_outline",
        "MAXAR_image_ortho",
    ];
    NAMES.contains(&name) || name.starts_with("KHR_materials_") || name.starts_with("ADOBE_materials_")
}

/// An error for shapes that are compressed in a way that is not read, with what unpacks them.
fn check_compression(path: &Path, required: &[String]) -> Result<(), SceneError> {
    const CONVERTERS: [(&str, &str, &str); 3] = [
        ("KHR_draco_mesh_compression", "Draco", "gltf-pipeline -i in.glb -o out.glb"),
        ("EXT_meshopt_compression", "meshopt", "gltfpack -noq -i in.glb -o out.glb"),
        ("KHR_meshopt_compression", "meshopt", "gltfpack -noq -i in.glb -o out.glb"),
    ];
    for (extension, name, command) in CONVERTERS {
        if required.iter().any(|required| required == extension) {
            let what = format!(
                "its shape is compressed by {name} ({extension}), which is not read: unpack it first, such as by `{command}`"
            );
            return Err(SceneError::Unsupported { path: path.to_owned(), what });
        }
    }
    Ok(())
}

/// Checks the indices that the library takes for granted when it validates.
fn check_attributes(root: &json::Root) -> Result<(), String> {
    for (mesh, primitive) in root.meshes.iter().enumerate().flat_map(|(i, m)| m.primitives.iter().map(move |p| (i, p)))
    {
        for index in primitive.attributes.values() {
            if index.value() >= root.accessors.len() {
                let count = root.accessors.len();
                return Err(format!("mesh {mesh} names accessor {}, but there are {count}", index.value()));
            }
        }
    }
    Ok(())
}

/// Bytes of a file.
pub(crate) fn read_at(path: &Path, reach: &Reach, offset: u64, length: u64) -> Result<Vec<u8>, SceneError> {
    let mut bytes = Vec::new();
    let mut file = reach.open(path)?;
    let read = file.seek(SeekFrom::Start(offset)).and_then(|_| file.take(length).read_to_end(&mut bytes));
    read.map_err(|e| SceneError::read(path, e))?;
    if (bytes.len() as u64) < length {
        let place = Place::Byte(offset + bytes.len() as u64);
        return Err(SceneError::truncated(
            path,
            place,
            format!("{} bytes before its end", length - bytes.len() as u64),
        ));
    }
    Ok(bytes)
}

/// A text without zero bytes at its end: some programs fill up with them where the specification has blanks.
fn without_zeros(text: &[u8]) -> &[u8] {
    &text[..text.iter().rposition(|b| *b != 0).map_or(0, |last| last + 1)]
}

/// What a file holds around its buffers.
struct Glb {
    json: Vec<u8>,
    /// Of a GLB: where its binary chunk starts, and how long it is.
    binary: Option<(u64, u64)>,
    tile_centre: Option<DVec3>,
}

/// The JSON of a GLB, a glTF or a tile (b3dm) file.
fn read_json(path: &Path, reach: &Reach) -> Result<Glb, SceneError> {
    let size = reach.length(path)?;
    let tile = b3dm::read(path, reach, size)?;
    // Where the GLB starts in the file.
    let base = tile.as_ref().map_or(0, |tile| tile.glb);
    let tile_centre = tile.and_then(|tile| tile.centre);
    let start = read_at(path, reach, base, (size - base).min(20))?;
    if !start.starts_with(b"glTF") {
        if start.trim_ascii_start().first() != Some(&b'{') && !start.starts_with(b"\xef\xbb\xbf") {
            let found = shown(&start[..start.len().min(8)]);
            return Err(SceneError::WrongMagic { path: path.to_owned(), expected: "a GLB or glTF file", found });
        }
        let json = reach.read(path, budget::JSON)?;
        let text = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&json);
        return Ok(Glb { json: without_zeros(text).to_vec(), binary: None, tile_centre });
    }
    let number = |at: usize| {
        let bytes = start.get(at..at + 4)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    };
    let cut = |what: &str| SceneError::truncated(path, Place::Byte(size), what);
    let (Some(version), Some(total), Some(length), Some(kind)) = (number(4), number(8), number(12), number(16)) else {
        return Err(cut("within its header"));
    };
    if version != 2 {
        let what = format!("it is glTF of version {version}: convert it to version 2");
        return Err(SceneError::Unsupported { path: path.to_owned(), what });
    }
    if base + u64::from(total) > size {
        return Err(cut(&format!("{} bytes before its end", base + u64::from(total) - size)));
    }
    if kind != u32::from_le_bytes(*b"JSON") {
        return Err(SceneError::syntax(path, Place::Byte(base + 16), "the first chunk of the file is not JSON"));
    }
    let after = base + 20 + u64::from(length);
    if after > size {
        return Err(cut("within its JSON"));
    }
    if u64::from(length) > budget::JSON {
        return Err(SceneError::too_much(path, format!("its JSON has more than {} MiB", budget::JSON >> 20)));
    }
    let json = read_at(path, reach, base + 20, u64::from(length))?;
    let json = without_zeros(&json).to_vec();
    let head = if after + 8 > size { Vec::new() } else { read_at(path, reach, after, 8)? };
    let [a, b, c, d, b'B', b'I', b'N', 0] = head[..] else { return Ok(Glb { json, binary: None, tile_centre }) };
    let length = u64::from(u32::from_le_bytes([a, b, c, d]));
    if after + 8 + length > size {
        return Err(cut("within its binary chunk"));
    }
    Ok(Glb { json, binary: Some((after + 8, length)), tile_centre })
}
