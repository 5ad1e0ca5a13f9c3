//! Material libraries of OBJ files.

use crate::budget;
use crate::counts::{WarningKind, Warnings};
use crate::error::SceneError;
use crate::lookup::Lookup;
use crate::material::{GREY, Material, TextureSource};
use crate::number::{parse_comma, parse_f64};
use crate::texture;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Options of a texture statement and how many numbers or words follow each.
///
/// `-o`, `-s` and `-t` take one to three numbers, so those are counted as long as numbers follow.
const MAP_OPTIONS: [(&[u8], usize); 11] = [
    (b"-blendu", 1),
    (b"-blendv", 1),
    (b"-boost", 1),
    (b"-bm", 1),
    (b"-cc", 1),
    (b"-clamp", 1),
    (b"-imfchan", 1),
    (b"-mm", 2),
    (b"-texres", 1),
    (b"-type", 1),
    (b"-colorspace", 1),
];

/// The materials of a library, at most `most`; textures that are not there are counted, and their materials are grey. Textures are looked
/// for beside the library, then beside `mesh`.
pub(crate) fn parse(
    path: &Path,
    bytes: &[u8],
    mesh: &Path,
    lookup: &mut Lookup<'_>,
    most: usize,
    warnings: &mut Warnings,
) -> Result<Vec<Material>, SceneError> {
    let folder = |path: &Path| path.parent().unwrap_or(Path::new("")).to_owned();
    let mut folders = vec![folder(path), folder(mesh)];
    folders.dedup();
    let mut textures = Textures { path, folders, looked: HashMap::new() };
    let mut materials: Vec<Material> = Vec::new();
    let mut rank = 0;
    for line in bytes.split(|&b| b == b'\n' || b == b'\r') {
        let line = line.trim_ascii();
        let (keyword, rest) = split_word(line);
        let lower = keyword.to_ascii_lowercase();
        if lower == b"newmtl" {
            if materials.len() == most {
                let what = format!("with it there are more than {} materials", budget::MATERIALS);
                return Err(SceneError::too_much(path, what));
            }
            let name = String::from_utf8_lossy(rest).into_owned();
            materials.push(Material { name, texture: None, colour: GREY });
            rank = 0;
            continue;
        }
        let Some(material) = materials.last_mut() else { continue };
        match lower.as_slice() {
            b"kd" => {
                if let Some(colour) = colour(rest)
                    && rank == 0
                {
                    material.colour = colour;
                }
            }
            // Some programs write unlit textures as emission, or as ambient light; the diffuse one wins whatever the order.
            b"map_kd" | b"map_ke" | b"map_ka" => {
                let own = match lower.as_slice() {
                    b"map_kd" => 3,
                    b"map_ke" => 2,
                    _ => 1,
                };
                if material.texture.is_none() || own > rank {
                    material.texture = textures.find(rest, lookup, warnings)?;
                    material.colour = GREY;
                    rank = own;
                }
            }
            _ => {}
        }
    }
    Ok(materials)
}

/// What is known of the textures that a library names.
struct Textures<'a> {
    path: &'a Path,
    folders: Vec<PathBuf>,
    /// By what stands in the library; looked up only, never iterated.
    looked: HashMap<Vec<u8>, Option<TextureSource>>,
}

impl Textures<'_> {
    /// The texture of a statement, if it is there and an image; else it is counted.
    fn find(
        &mut self,
        rest: &[u8],
        lookup: &mut Lookup<'_>,
        warnings: &mut Warnings,
    ) -> Result<Option<TextureSource>, SceneError> {
        let name = map_name(rest);
        if let Some(known) = self.looked.get(name) {
            if known.is_none() {
                warnings.add(WarningKind::MissingTexture, || String::from_utf8_lossy(name).into_owned());
            }
            return Ok(known.clone());
        }
        if self.looked.len() > budget::MATERIALS {
            return Err(SceneError::too_much(self.path, format!("it names more than {} textures", budget::MATERIALS)));
        }
        let folders: Vec<&Path> = self.folders.iter().map(PathBuf::as_path).collect();
        let found = lookup.find(&folders, name);
        if found.elsewhere {
            let name = String::from_utf8_lossy(name).into_owned();
            let what = || format!("{}: {name}: {}", self.path.display(), found.path.display());
            warnings.add(WarningKind::FoundElsewhere, what);
        }
        let texture = match texture::image_type(&found.path, lookup.reach()) {
            Ok(()) => Some(TextureSource::File(found.path)),
            Err(why) => {
                warnings.add(WarningKind::MissingTexture, || format!("{}: {why}", found.path.display()));
                None
            }
        };
        self.looked.insert(name.to_vec(), texture.clone());
        Ok(texture)
    }
}

/// The name in a texture statement: the rest of the line after its options.
fn map_name(mut rest: &[u8]) -> &[u8] {
    while rest.starts_with(b"-") {
        let (option, mut after) = split_word(rest);
        let words = MAP_OPTIONS.iter().find(|(name, _)| *name == option).map(|(_, words)| *words);
        match words {
            Some(words) => (0..words).for_each(|_| after = split_word(after).1),
            None if matches!(option, b"-o" | b"-s" | b"-t") => {
                for _ in 0..3 {
                    let (word, next) = split_word(after);
                    if parse_f64(word).is_none() {
                        break;
                    }
                    after = next;
                }
            }
            // Not an option: a file name that starts with a hyphen.
            None => break,
        }
        rest = after;
    }
    rest
}

/// `Kd r g b` in sRGB bytes.
fn colour(rest: &[u8]) -> Option<[u8; 3]> {
    let mut words = rest.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    let mut channel = || words.next().and_then(|word| parse_f64(word).or_else(|| parse_comma(word)));
    let (r, g, b) = (channel()?, channel()?, channel()?);
    Some([r, g, b].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8))
}

/// The first word of a line, and the rest without its leading blanks.
pub(crate) fn split_word(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    (&line[..end], line[end..].trim_ascii())
}
