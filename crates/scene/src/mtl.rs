//! Material libraries of OBJ files.

use crate::budget;
use crate::counts::{WarningKind, Warnings};
use crate::error::SceneError;
use crate::material::{GREY, Material, TextureSource};
use crate::number::parse_f64;
use crate::texture;
use gable_files::Reach;
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

/// The materials of a library, at most `most`; textures that are not there are counted, and their materials are grey.
pub(crate) fn parse(
    path: &Path,
    bytes: &[u8],
    reach: &Reach,
    most: usize,
    warnings: &mut Warnings,
) -> Result<Vec<Material>, SceneError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut materials: Vec<Material> = Vec::new();
    let mut emissive = false;
    // What is known of files that were looked at; looked up only, never iterated.
    let mut looked: HashMap<PathBuf, Result<(), String>> = HashMap::new();
    for line in bytes.split(|&b| b == b'\n' || b == b'\r') {
        let line = line.trim_ascii();
        let (keyword, rest) = split_word(line);
        if keyword == b"newmtl" {
            if materials.len() == most {
                let what = format!("with it there are more than {} materials", budget::MATERIALS);
                return Err(SceneError::too_much(path, what));
            }
            let name = String::from_utf8_lossy(rest).into_owned();
            materials.push(Material { name, texture: None, colour: GREY });
            emissive = false;
            continue;
        }
        let Some(material) = materials.last_mut() else { continue };
        let lower = keyword.to_ascii_lowercase();
        match lower.as_slice() {
            b"kd" => {
                if let Some(colour) = colour(rest)
                    && material.texture.is_none()
                {
                    material.colour = colour;
                }
            }
            // Some programs write unlit textures as emission; the diffuse one wins whatever the order.
            b"map_kd" | b"map_ke" if material.texture.is_none() || (emissive && lower == b"map_kd") => {
                emissive = lower == b"map_ke";
                let file = map_file(folder, rest, reach);
                if looked.len() > budget::MATERIALS {
                    return Err(SceneError::too_much(
                        path,
                        format!("it names more than {} textures", budget::MATERIALS),
                    ));
                }
                let found = looked.entry(file.clone()).or_insert_with(|| texture::image_type(&file, reach));
                match found {
                    Ok(()) => material.texture = Some(TextureSource::File(file)),
                    Err(why) => {
                        warnings.add(WarningKind::MissingTexture, || format!("{}: {why}", file.display()));
                        material.texture = None;
                    }
                }
                material.colour = GREY;
            }
            _ => {}
        }
    }
    Ok(materials)
}

/// The file that a texture statement names: the rest of the line after its options.
fn map_file(folder: &Path, mut rest: &[u8], reach: &Reach) -> PathBuf {
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
    resolve(folder, rest, reach)
}

/// A file name in a text file, seen from the file's folder; backslashes are what Windows writes.
pub(crate) fn resolve(folder: &Path, name: &[u8], reach: &Reach) -> PathBuf {
    let name = String::from_utf8_lossy(name.trim_ascii());
    let name = name.trim_matches('"');
    let plain = folder.join(name);
    if reach.is_file(&plain) || !name.contains('\\') {
        return plain;
    }
    folder.join(name.replace('\\', "/"))
}

/// `Kd r g b` in sRGB bytes.
fn colour(rest: &[u8]) -> Option<[u8; 3]> {
    let mut words = rest.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    let mut channel = || words.next().and_then(parse_f64);
    let (r, g, b) = (channel()?, channel()?, channel()?);
    Some([r, g, b].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8))
}

/// The first word of a line, and the rest without its leading blanks.
pub(crate) fn split_word(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    (&line[..end], line[end..].trim_ascii())
}
