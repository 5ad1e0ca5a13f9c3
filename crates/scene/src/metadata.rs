//! `metadata.xml`, which photogrammetry programs write beside their tiles.

use crate::budget;
use crate::error::SceneError;
use crate::words::{decode, numbers};
use gable_files::Reach;
use gable_geometry::DVec3;
use quick_xml::Reader;
use quick_xml::events::Event;
use std::path::{Path, PathBuf};

/// The reference system of tiles and what is added to their coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Metadata {
    pub(crate) path: PathBuf,
    /// `SRS` as written; empty if absent.
    pub(crate) srs: String,
    /// `SRSOrigin`, in the units of the system.
    pub(crate) origin: DVec3,
}

impl Metadata {
    /// Reads a file of this name. One whose root is not `ModelMetadata` belongs to something else, and so does one that may not be read.
    pub(crate) fn read(path: &Path, reach: &Reach) -> Result<Option<Self>, SceneError> {
        if !reach.is_file(path) || reach.length(path)? > budget::METADATA {
            return Ok(None);
        }
        parse(path, &reach.read(path, budget::METADATA)?)
    }
}

/// Adds a piece of text to the field in whose element it stands.
fn field(stack: &[String], srs: &mut String, origin: &mut String, piece: &str) {
    match stack.last().map(String::as_str) {
        Some("SRS") => srs.push_str(piece),
        Some("SRSOrigin") => origin.push_str(piece),
        _ => {}
    }
}

/// `None` if it is the metadata of something else.
fn parse(path: &Path, bytes: &[u8]) -> Result<Option<Metadata>, SceneError> {
    let fault = |what: String| SceneError::Metadata { path: path.to_owned(), what };
    let text = decode(bytes);
    let mut reader = Reader::from_str(text.trim_start());
    let mut stack: Vec<String> = Vec::new();
    let (mut srs, mut origin) = (String::new(), String::new());
    loop {
        let event = reader.read_event().map_err(|e| fault(format!("byte {}: {e}", reader.error_position())))?;
        match event {
            Event::Start(tag) => {
                if stack.is_empty() && tag.name().as_ref() != "ModelMetadata" {
                    return Ok(None);
                }
                if stack.len() == budget::METADATA_DEPTH {
                    return Err(fault(format!("elements are nested deeper than {}", budget::METADATA_DEPTH)));
                }
                stack.push(tag.name().as_ref().to_owned());
            }
            Event::End(_) => {
                stack.pop();
            }
            // The only reference that a WKT text needs is the quotation mark.
            Event::GeneralRef(_) => field(&stack, &mut srs, &mut origin, "\""),
            Event::Text(text) => field(&stack, &mut srs, &mut origin, &text),
            Event::CData(text) => field(&stack, &mut srs, &mut origin, &text),
            Event::Eof => break,
            _ => {}
        }
    }
    if let Some(open) = stack.last() {
        return Err(fault(format!("the file ends within <{open}>")));
    }
    let origin = if origin.trim().is_empty() {
        DVec3::ZERO
    } else {
        match numbers(&origin).as_deref() {
            Some(&[x, y, z]) => DVec3::new(x, y, z),
            _ => return Err(fault(format!("SRSOrigin is {:?}: three numbers x,y,z are expected", origin.trim()))),
        }
    };
    Ok(Some(Metadata { path: path.to_owned(), srs, origin }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &[u8]) -> Result<Option<Metadata>, String> {
        parse(Path::new("metadata.xml"), text).map_err(|e| e.to_string())
    }

    fn said(text: &str) -> (String, DVec3) {
        let found = read(text.as_bytes()).expect("good").expect("metadata");
        (found.srs.trim().to_owned(), found.origin)
    }

    #[test]
    fn reads_what_the_program_writes() {
        let text = "\u{feff}<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<ModelMetadata version=\"1\">\n\t<!--Spatial-->\n\
                    \t<SRS>ENU:34.2,108.9</SRS>\n\t<SRSOrigin>51.5, -32.5,445.0204</SRSOrigin>\n\t<Texture>\n\
                    \t\t<ColorSource>Visible</ColorSource>\n\t</Texture>\n</ModelMetadata>\n";
        assert_eq!(said(text), ("ENU:34.2,108.9".to_owned(), DVec3::new(51.5, -32.5, 445.0204)));
        let wkt = "<ModelMetadata><SRS>PROJCS[&quot;x&quot;]</SRS><SRSOrigin>1;2;3</SRSOrigin></ModelMetadata>";
        assert_eq!(said(wkt), ("PROJCS[\"x\"]".to_owned(), DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(said("<ModelMetadata><SRS/></ModelMetadata>"), (String::new(), DVec3::ZERO));
    }

    #[test]
    fn says_what_it_does_not_understand() {
        assert_eq!(read(b"<other><SRS>EPSG:1</SRS></other>"), Ok(None));
        let error = read(b"<ModelMetadata><SRSOrigin>1,2</SRSOrigin></ModelMetadata>").expect_err("two numbers");
        assert!(error.ends_with("SRSOrigin is \"1,2\": three numbers x,y,z are expected"), "{error}");
        let error = read(b"<ModelMetadata><SRS>EPSG:25832").expect_err("cut");
        assert!(error.contains("the file ends within <SRS>"), "{error}");
        assert!(read(b"<ModelMetadata><SRS></Other></ModelMetadata>").expect_err("mismatch").contains("byte"));
    }
}
