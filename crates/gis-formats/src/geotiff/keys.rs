//! The keys of GeoTIFF 1.1 (OGC 19-008r4) that name a reference system.

use super::container::{Directory, Value};
use crate::GeoReference;

/// Names of values.
const PROJECTED: u16 = 1;
const PIXEL_IS_AREA: u16 = 1;
const USER_DEFINED: u16 = 32767;
const ORTHOGRAPHIC: u16 = 21;
const WGS_84: u16 = 4326;
const METRE: u16 = 9001;

/// Where the numbers of floating point stand, and the texts.
const DOUBLES: u16 = 34736;
const TEXTS: u16 = 34737;

/// Puts the keys of a place into a directory; those of the heights as well if the pixels are such heights.
pub(super) fn put(place: &GeoReference, heights: bool, directory: &mut Directory) {
    // Key, where its value stands (0: here), how many values, and the value or its place there.
    let mut keys: Vec<[u16; 4]> = Vec::new();
    let mut doubles: Vec<f64> = Vec::new();
    let plane = place.plane().and_then(|code| u16::try_from(code).ok());
    if let Some(plane) = plane {
        keys.extend([[1024, 0, 1, PROJECTED], [1025, 0, 1, PIXEL_IS_AREA], [3072, 0, 1, plane]]);
        let vertical = place.vertical().and_then(|code| u16::try_from(code).ok());
        keys.extend(vertical.filter(|_| heights).map(|code| [4096, 0, 1, code]));
    } else if let Some([latitude, longitude]) = place.tangent() {
        // A tangent plane, by the one projection that has its coordinates.
        let text = "local tangent plane|";
        directory.put(TEXTS, Value::Ascii(text.to_owned()));
        doubles.extend([longitude, latitude, 0.0, 0.0]);
        keys.extend([
            [1024, 0, 1, PROJECTED],
            [1025, 0, 1, PIXEL_IS_AREA],
            [1026, TEXTS, text.len() as u16, 0],
            [2048, 0, 1, WGS_84],
            [3072, 0, 1, USER_DEFINED],
            [3074, 0, 1, USER_DEFINED],
            [3075, 0, 1, ORTHOGRAPHIC],
            [3076, 0, 1, METRE],
            [3080, DOUBLES, 1, 0],
            [3081, DOUBLES, 1, 1],
            [3082, DOUBLES, 1, 2],
            [3083, DOUBLES, 1, 3],
        ]);
    } else {
        // Without any key GDAL reads no system; with the least of them it makes one up.
        return;
    }
    let head = [1, 1, 1, keys.len() as u16];
    directory.put(34735, Value::Short([head].into_iter().chain(keys).flatten().collect()));
    if !doubles.is_empty() {
        directory.put(DOUBLES, Value::Double(doubles));
    }
}
