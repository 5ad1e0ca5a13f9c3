//! `metadata.xml`, which photogrammetry programs write beside their tiles.

use crate::budget;
use crate::counts::{WarningKind, Warnings};
use crate::error::SceneError;
use gable_files::Reach;
use gable_geometry::{Crs, DVec3};
use quick_xml::Reader;
use quick_xml::events::Event;
use std::path::{Path, PathBuf};

/// The reference system of tiles and what is added to their coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Metadata {
    pub(crate) path: PathBuf,
    /// `SRS` as written; empty if absent.
    srs: String,
    /// `SRSOrigin`, metres.
    pub(crate) origin: DVec3,
}

impl Metadata {
    /// Looks for `metadata.xml` in a folder and the two above it.
    ///
    /// A file of that name whose root is not `ModelMetadata` belongs to something else, and so does one that may not be read.
    pub(crate) fn find(folder: &Path, reach: &Reach) -> Result<Option<Self>, SceneError> {
        for folder in folder.ancestors().take(3) {
            let path = folder.join("metadata.xml");
            if reach.is_file(&path) && reach.length(&path)? <= budget::METADATA {
                let bytes = reach.read(&path, budget::METADATA)?;
                if let Some(found) = parse(&path, &bytes)? {
                    return Ok(Some(found));
                }
            }
            if folder.as_os_str().is_empty() {
                break;
            }
        }
        Ok(None)
    }

    /// The reference system; a compound's heights and a WKT's text are given up for the code.
    pub(crate) fn crs(&self, warnings: &mut Warnings) -> Result<Crs, SceneError> {
        let text = self.srs.trim();
        if text.is_empty() || text.eq_ignore_ascii_case("local") {
            return Ok(Crs::Unknown);
        }
        if let Ok(crs) = text.parse() {
            return Ok(crs);
        }
        let simple = text.split_once('+').map(|(plan, _)| plan.to_owned()).or_else(|| wkt_code(text));
        let simple: Option<Crs> = simple.and_then(|s| s.parse().ok());
        let Some(crs) = simple else {
            return Err(SceneError::UnknownCrs { path: self.path.clone(), text: text.to_owned() });
        };
        warnings.add(WarningKind::SimplifiedCrs, || format!("{}: {text} is taken as {crs}", self.path.display()));
        Ok(crs)
    }
}

/// The EPSG code of a WKT definition: the last authority in it is that of the whole.
fn wkt_code(text: &str) -> Option<String> {
    let at = ["AUTHORITY[", "ID["].iter().filter_map(|key| text.rfind(key)).max()?;
    let inside = text[at..].split_once('[')?.1.split_once(']')?.0;
    let (authority, code) = inside.split_once(',')?;
    let clean = |s: &str| s.trim().trim_matches('"').to_owned();
    (clean(authority) == "EPSG").then(|| format!("EPSG:{}", clean(code)))
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
    let text = std::str::from_utf8(bytes)
        .map_err(|e| fault(format!("byte {} is not UTF-8", e.valid_up_to())))?
        .trim_start_matches('\u{feff}');
    let mut reader = Reader::from_str(text);
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
        let numbers: Option<Vec<f64>> = origin.split(',').map(|n| n.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[x, y, z]) if x.is_finite() && y.is_finite() && z.is_finite() => DVec3::new(x, y, z),
            _ => return Err(fault(format!("SRSOrigin is {:?}: three numbers x,y,z are expected", origin.trim()))),
        }
    };
    Ok(Some(Metadata { path: path.to_owned(), srs, origin }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Option<Metadata>, String> {
        parse(Path::new("metadata.xml"), text.as_bytes()).map_err(|e| e.to_string())
    }

    fn crs(srs: &str) -> Result<Crs, String> {
        let text = format!("<?xml version=\"1.0\"?><ModelMetadata version=\"1\"><SRS>{srs}</SRS></ModelMetadata>");
        let metadata = read(&text)?.ok_or("not found")?;
        metadata.crs(&mut Warnings::default()).map_err(|e| e.to_string())
    }

    #[test]
    fn reads_what_the_programs_write() {
        let text = "\u{feff}<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<ModelMetadata version=\"1\">\n\t<!--SRS-->\n\
                    \t<SRS>ENU:34.2,108.9</SRS>\n\t<SRSOrigin>0,-12.5,445.0204</SRSOrigin>\n</ModelMetadata>\n";
        let metadata = read(text).expect("parses").expect("is one");
        assert_eq!(metadata.origin, DVec3::new(0.0, -12.5, 445.0204));
        let crs_read = metadata.crs(&mut Warnings::default()).expect("known");
        assert_eq!(crs_read, Crs::Enu { latitude: 34.2, longitude: 108.9 });
        assert_eq!(crs("EPSG:25832"), Ok(Crs::Epsg(25832)));
        assert_eq!(crs("EPSG:25832+7837"), Ok(Crs::Epsg(25832)));
        assert_eq!(crs(""), Ok(Crs::Unknown));
        let wkt = "PROJCS[&quot;x&quot;,GEOGCS[&quot;y&quot;,AUTHORITY[&quot;EPSG&quot;,&quot;4258&quot;]],\
                   AUTHORITY[&quot;EPSG&quot;,&quot;25832&quot;]]";
        assert_eq!(crs(wkt), Ok(Crs::Epsg(25832)));
    }

    #[test]
    fn says_what_it_does_not_understand() {
        assert_eq!(
            crs("Gauss-Krueger 3"),
            Err("metadata.xml: unknown reference system \"Gauss-Krueger 3\": pass --crs EPSG:code \
                 (or ENU:latitude,longitude) to say which it is"
                .to_owned())
        );
        assert_eq!(read("<other><SRS>EPSG:1</SRS></other>"), Ok(None));
        let error = read("<ModelMetadata><SRSOrigin>1,2</SRSOrigin></ModelMetadata>").expect_err("two numbers");
        assert!(error.ends_with("SRSOrigin is \"1,2\": three numbers x,y,z are expected"), "{error}");
        let error = read("<ModelMetadata><SRS>EPSG:25832").expect_err("cut");
        assert!(error.contains("the file ends within <SRS>"), "{error}");
        assert!(read("<ModelMetadata><SRS></Other></ModelMetadata>").expect_err("mismatch").contains("byte"));
    }
}
