//! Reading of any format that this crate knows.

use crate::{Error, ReadOptions, Reading, read_citygml, read_cityjson};
use gable_files::Reach;
use std::io::Read;
use std::path::Path;

/// Reads CityJSON, CityJSONSeq or CityGML, told apart by the first character; see [`read_cityjson`] and
/// [`read_citygml`].
///
/// # Errors
/// As these two.
pub fn read_city_model(path: &Path, options: &ReadOptions) -> Result<Reading, Error> {
    let mut head = Vec::new();
    let read = Reach::everything().open(path)?.take(256).read_to_end(&mut head);
    read.map_err(|source| Error::File { path: path.to_owned(), source })?;
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head);
    let first = head.iter().find(|byte| !byte.is_ascii_whitespace());
    match first {
        Some(b'<') => read_citygml(path, options),
        Some(b'{') => read_cityjson(path, options),
        _ => Err(Error::content(path, "byte 0", "neither CityJSON nor CityGML: expected { or <")),
    }
}
