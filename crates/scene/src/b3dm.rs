//! The frame of a tile of 3D Tiles 1.0 (b3dm) around its GLB.

use crate::error::{Place, SceneError};
use crate::glb::read_at;
use gable_files::Reach;
use gable_geometry::DVec3;
use std::path::Path;

/// Bytes of the header: mark, version, length, and the lengths of four tables.
const HEADER: u64 = 28;
/// Most bytes of the table of features: it holds a count and a place.
const TABLE: u64 = 16 << 20;

/// A tile.
pub(crate) struct Tile {
    /// Where its GLB starts, bytes.
    pub(crate) glb: u64,
    /// `RTC_CENTER`: what all positions are relative to, z up.
    pub(crate) centre: Option<DVec3>,
}

/// Reads the frame, if it is a tile.
pub(crate) fn read(path: &Path, reach: &Reach, size: u64) -> Result<Option<Tile>, SceneError> {
    let head = read_at(path, reach, 0, size.min(HEADER))?;
    for (mark, name) in [(b"i3dm", "instances (i3dm)"), (b"pnts", "points (pnts)"), (b"cmpt", "several tiles (cmpt)")] {
        if head.starts_with(mark) {
            let what = format!("it is a tile of {name}, which is not read: export the tiles as b3dm or GLB");
            return Err(SceneError::Unsupported { path: path.to_owned(), what });
        }
    }
    if !head.starts_with(b"b3dm") {
        return Ok(None);
    }
    let cut = || SceneError::truncated(path, Place::Byte(size), "within the frame of the tile");
    let number = |at: usize| {
        let bytes = head.get(at..at + 4).ok_or_else(cut)?;
        Ok(u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])))
    };
    let (version, json, binary) = (number(4)?, number(12)?, number(16)?);
    let tables = [12, 16, 20, 24].into_iter().map(number).sum::<Result<u64, SceneError>>()?;
    if version != 1 {
        let what = format!("it is a b3dm tile of version {version}: export it as of version 1");
        return Err(SceneError::Unsupported { path: path.to_owned(), what });
    }
    if HEADER + tables > size {
        return Err(cut());
    }
    if json > TABLE {
        return Err(SceneError::too_much(path, format!("its table of features has more than {} MiB", TABLE >> 20)));
    }
    let table = read_at(path, reach, HEADER, json)?;
    let floats = read_at(path, reach, HEADER + json, binary.min(TABLE))?;
    Ok(Some(Tile { glb: HEADER + tables, centre: centre(&table, &floats) }))
}

/// `RTC_CENTER` of a table of features: three numbers, or where they stand in its binary part.
fn centre(table: &[u8], floats: &[u8]) -> Option<DVec3> {
    let end = table.iter().rposition(|b| *b != 0).map_or(0, |last| last + 1);
    let table: serde_json::Value = serde_json::from_slice(&table[..end]).ok()?;
    let found = table.get("RTC_CENTER")?;
    if let Some(numbers) = found.as_array() {
        let numbers: Vec<f64> = numbers.iter().filter_map(serde_json::Value::as_f64).collect();
        return <[f64; 3]>::try_from(numbers).ok().map(DVec3::from_array);
    }
    let at = usize::try_from(found.get("byteOffset")?.as_u64()?).ok()?;
    let bytes = floats.get(at..at.checked_add(12)?)?;
    let float = |i: usize| f64::from(f32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]));
    Some(DVec3::new(float(0), float(4), float(8)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centres_stand_in_either_part() {
        let place = DVec3::new(4_000_000.0, 600_000.5, 4_900_000.0);
        assert_eq!(centre(br#"{"BATCH_LENGTH":0,"RTC_CENTER":[4000000,600000.5,4900000]}  "#, &[]), Some(place));
        let floats: Vec<u8> =
            [0.0_f32, 4_000_000.0, 600_000.5, 4_900_000.0].iter().flat_map(|f| f.to_le_bytes()).collect();
        assert_eq!(centre(br#"{"RTC_CENTER":{"byteOffset":4}}"#, &floats), Some(place));
        for none in [&b"{}"[..], b"", b"{\"RTC_CENTER\":[1,2]}", b"{\"RTC_CENTER\":{\"byteOffset\":99}}"] {
            assert_eq!(centre(none, &floats), None);
        }
    }
}
