//! The orthograph file.
//!
//! All numbers are little-endian.
//!
//! | Bytes | What |
//! |---|---|
//! | 8 | magic `GABLORTH` |
//! | 4 | version, 1 |
//! | 8 | step, f64 metres |
//! | 8, 8 | lattice column and row of the south-western pixel, i64 |
//! | 4, 4 | columns and rows, u32 |
//! | 4 | Adler-32 of the header so far |
//! | 5 × (8 + n) | sections: compressed length as u64, then a zstd frame with checksum |
//!
//! Sections, for pixels row by row from the south:
//! 1. heights: the f32's bits minus those of the pixel before (wrapping), as four planes of bytes, low bytes first;
//! 2. colours: planes of red, green and blue, each byte minus the one before;
//! 3. photographed: one byte each, 0 or 1;
//! 4. normals: hemi-octahedral code as two i16 (`i16::MIN` for none), minus the one before, as four planes of bytes;
//! 5. walls: one byte each, 0 or 1 for a wall, then for each pixel with one the five f32 area, normal x, normal y,
//!    lowest and highest height, as twenty planes of bytes.

use crate::orthograph::{decode_normal, encode_normal};
use crate::{Orthograph, WallEvidence};
use gable_geometry::DVec3;
use gable_raster::{GridWindow, Raster};
use std::io::Read;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"GABLORTH";
const VERSION: u32 = 1;
const HEADER: usize = 8 + 4 + 8 + 16 + 8;
/// More pixels than any block has: a guard against broken headers.
const MAX_PIXELS: u64 = 1 << 31;
/// Fast: the planes compress well at any level.
const LEVEL: i32 = 1;

/// An orthograph file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum OrthoError {
    /// Reading or writing failed.
    #[error("cannot access the orthograph {path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The content is not an orthograph, or damaged.
    #[error("the orthograph {path} is damaged at byte {offset} ({reason}): sample the block again")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the damage was noticed.
        offset: u64,
        /// What was wrong.
        reason: String,
    },
}

impl Orthograph {
    /// Writes the file by way of a temporary one beside it, so that no half file is left behind.
    ///
    /// # Errors
    /// [`OrthoError::Io`] if the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), OrthoError> {
        let io = |source| OrthoError::Io { path: path.to_owned(), source };
        let bytes = self.encode().map_err(io)?;
        let mut temporary = path.as_os_str().to_owned();
        temporary.push(".part");
        std::fs::write(&temporary, bytes).map_err(io)?;
        std::fs::rename(&temporary, path).map_err(io)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`OrthoError::Io`] if it cannot be read, [`OrthoError::Damaged`] if it is not a whole orthograph.
    pub fn read(path: &Path) -> Result<Self, OrthoError> {
        let bytes = std::fs::read(path).map_err(|source| OrthoError::Io { path: path.to_owned(), source })?;
        Self::decode(&bytes).map_err(|(offset, reason)| OrthoError::Damaged {
            path: path.to_owned(),
            offset: offset as u64,
            reason,
        })
    }

    fn encode(&self) -> std::io::Result<Vec<u8>> {
        let window = self.window();
        let n = window.len();
        let mut out = MAGIC.to_vec();
        out.extend(VERSION.to_le_bytes());
        out.extend(window.step.to_le_bytes());
        out.extend(window.x0.to_le_bytes());
        out.extend(window.y0.to_le_bytes());
        for count in [window.width, window.height] {
            out.extend(u32::try_from(count).map_err(std::io::Error::other)?.to_le_bytes());
        }
        out.extend(adler(&out).to_le_bytes());
        let mut previous = 0u32;
        let heights = self.height.values().iter().map(|h| {
            let bits = h.to_bits();
            let delta = bits.wrapping_sub(previous);
            previous = bits;
            delta.to_le_bytes()
        });
        section(&mut out, &planes(n, heights))?;
        let mut previous = [0u8; 3];
        let colours = self.colour.values().iter().map(|c| {
            let delta = std::array::from_fn::<u8, 3, _>(|i| c[i].wrapping_sub(previous[i]));
            previous = *c;
            delta
        });
        section(&mut out, &planes(n, colours))?;
        section(&mut out, &self.photographed.values().iter().map(|&p| u8::from(p)).collect::<Vec<_>>())?;
        let mut previous = [0i16; 2];
        let normals = self.normal.values().iter().map(|n| {
            let code = encode_normal(DVec3::from_array(n.map(f64::from)));
            let [a, b] = std::array::from_fn(|i| code[i].wrapping_sub(previous[i]).to_le_bytes());
            previous = code;
            [a[0], a[1], b[0], b[1]]
        });
        section(&mut out, &planes(n, normals))?;
        let empty = WallEvidence::default();
        let mut walls: Vec<u8> = self.walls.values().iter().map(|w| u8::from(*w != empty)).collect();
        let count = walls.iter().filter(|&&w| w != 0).count();
        walls.extend(planes(count, self.walls.values().iter().filter(|w| **w != empty).map(wall_bytes)));
        section(&mut out, &walls)?;
        Ok(out)
    }

    fn decode(bytes: &[u8]) -> Result<Self, (usize, String)> {
        let (window, mut at) = header(bytes)?;
        let n = window.len();
        let mut next = |limit: usize, least: usize| -> Result<Vec<u8>, (usize, String)> {
            let (start, raw) = (at, read_section(bytes, &mut at, limit)?);
            if raw.len() < least {
                return Err((start, format!("a section of {} bytes where {least} are due", raw.len())));
            }
            Ok(raw)
        };
        let raw = next(4 * n, 4 * n)?;
        let mut previous = 0u32;
        let heights = from_planes::<4>(&raw, n).map(|delta| {
            previous = previous.wrapping_add(u32::from_le_bytes(delta));
            f32::from_bits(previous)
        });
        let height = Raster::new(window, heights.collect());
        let raw = next(3 * n, 3 * n)?;
        let mut previous = [0u8; 3];
        let colours = from_planes::<3>(&raw, n).map(|delta| {
            previous = std::array::from_fn(|i| previous[i].wrapping_add(delta[i]));
            previous
        });
        let colour = Raster::new(window, colours.collect());
        let photographed = Raster::new(window, next(n, n)?.into_iter().map(|p| p != 0).collect());
        let raw = next(4 * n, 4 * n)?;
        let mut previous = [0i16; 2];
        let normals = from_planes::<4>(&raw, n).map(|[a, b, c, d]| {
            let delta = [i16::from_le_bytes([a, b]), i16::from_le_bytes([c, d])];
            previous = std::array::from_fn(|i| previous[i].wrapping_add(delta[i]));
            decode_normal(previous)
        });
        let normal = Raster::new(window, normals.collect());
        let raw = next(21 * n, n)?;
        let (flags, rest) = raw.split_at(n);
        let count = flags.iter().filter(|&&f| f != 0).count();
        if rest.len() != 20 * count {
            return Err((at, format!("{} bytes for {count} walls", rest.len())));
        }
        let mut evidence = from_planes::<20>(rest, count).map(wall_from);
        let walls = flags.iter().map(|&f| if f == 0 { None } else { evidence.next() }.unwrap_or_default());
        let walls = Raster::new(window, walls.collect());
        if at != bytes.len() {
            return Err((at, "bytes after the end".to_owned()));
        }
        Ok(Self { height, colour, photographed, normal, walls })
    }
}

fn header(bytes: &[u8]) -> Result<(GridWindow, usize), (usize, String)> {
    let Some(head) = bytes.get(..HEADER + 4) else {
        return Err((bytes.len(), "the file ends in its header".to_owned()));
    };
    if &head[..8] != MAGIC {
        return Err((0, "it does not start with GABLORTH".to_owned()));
    }
    let word = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    let long = |at: usize| u64::from(word(at)) | u64::from(word(at + 4)) << 32;
    if word(8) != VERSION {
        return Err((8, format!("version {}, this program reads {VERSION}", word(8))));
    }
    if word(HEADER) != adler(&head[..HEADER]) {
        return Err((HEADER, "the header's checksum is wrong".to_owned()));
    }
    let window = GridWindow {
        step: f64::from_bits(long(12)),
        x0: long(20) as i64,
        y0: long(28) as i64,
        width: word(36) as usize,
        height: word(40) as usize,
    };
    if u64::from(word(36)) * u64::from(word(40)) > MAX_PIXELS || window.step <= 0.0 || !window.step.is_finite() {
        return Err((12, "the window makes no sense".to_owned()));
    }
    Ok((window, HEADER + 4))
}

/// Appends a compressed section.
fn section(out: &mut Vec<u8>, raw: &[u8]) -> std::io::Result<()> {
    let mut encoder = zstd::Encoder::new(Vec::new(), LEVEL)?;
    encoder.include_checksum(true)?;
    std::io::Write::write_all(&mut encoder, raw)?;
    let packed = encoder.finish()?;
    out.extend((packed.len() as u64).to_le_bytes());
    out.extend(packed);
    Ok(())
}

/// Reads the section at `at`, of at most `limit` bytes, and moves on. Memory grows with what is really there.
fn read_section(bytes: &[u8], at: &mut usize, limit: usize) -> Result<Vec<u8>, (usize, String)> {
    let start = *at;
    let length = bytes.get(start..start + 8).ok_or((start, "the file ends before a section".to_owned()))?;
    let length = length.iter().rev().fold(0u64, |v, &b| v << 8 | u64::from(b));
    let packed = usize::try_from(length)
        .ok()
        .and_then(|l| (start + 8).checked_add(l))
        .and_then(|end| bytes.get(start + 8..end))
        .ok_or((start, "the file ends in a section".to_owned()))?;
    let fault = |e: std::io::Error| (start + 8, e.to_string());
    let mut raw = Vec::new();
    let decoder = zstd::Decoder::with_buffer(packed).map_err(fault)?;
    decoder.take(limit as u64 + 1).read_to_end(&mut raw).map_err(fault)?;
    if raw.len() > limit {
        return Err((start + 8, format!("a section is longer than {limit} bytes")));
    }
    *at = start + 8 + packed.len();
    Ok(raw)
}

/// All first bytes, then all second bytes, and so on.
fn planes<const N: usize>(n: usize, items: impl Iterator<Item = [u8; N]>) -> Vec<u8> {
    let mut out = vec![0; N * n];
    for (i, item) in items.enumerate() {
        for (k, byte) in item.into_iter().enumerate() {
            out[k * n + i] = byte;
        }
    }
    out
}

fn from_planes<const N: usize>(planes: &[u8], n: usize) -> impl Iterator<Item = [u8; N]> {
    (0..n).map(move |i| std::array::from_fn(|k| planes[k * n + i]))
}

fn wall_bytes(w: &WallEvidence) -> [u8; 20] {
    let values = [w.area, w.normal[0], w.normal[1], w.z_min, w.z_max].map(f32::to_le_bytes);
    std::array::from_fn(|i| values[i / 4][i % 4])
}

fn wall_from(bytes: [u8; 20]) -> WallEvidence {
    let value = |i: usize| f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]]);
    WallEvidence { area: value(0), normal: [value(1), value(2)], z_min: value(3), z_max: value(4) }
}

fn adler(bytes: &[u8]) -> u32 {
    let (mut a, mut b) = (1u32, 0u32);
    for &byte in bytes {
        a = (a + u32::from(byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    b << 16 | a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantised_normal;
    use gable_geometry::Counter;

    fn orthograph(seed: u64) -> Orthograph {
        let window = GridWindow { step: 0.2, x0: -7, y0: 1 << 33, width: 37, height: 21 };
        let mut rng = Counter::new(seed);
        let mut o = Orthograph::empty(window);
        for i in 0..window.len() {
            if rng.unit() < 0.1 {
                continue;
            }
            o.height.values_mut()[i] = rng.range(-20.0, 300.0) as f32;
            o.colour.values_mut()[i] = std::array::from_fn(|_| rng.bits() as u8);
            o.photographed.values_mut()[i] = rng.unit() < 0.9;
            o.normal.values_mut()[i] = quantised_normal(DVec3::new(rng.normal(), rng.normal(), rng.normal()));
            if rng.unit() < 0.2 {
                let normal = [rng.range(-1.0, 1.0) as f32, rng.range(-1.0, 1.0) as f32];
                o.walls.values_mut()[i] = WallEvidence { area: rng.unit() as f32, normal, z_min: 1.0, z_max: 3.5 };
            }
        }
        o
    }

    #[test]
    fn comes_back_bit_by_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("block.ortho");
        for o in [orthograph(1), Orthograph::empty(GridWindow { step: 0.5, x0: 0, y0: 0, width: 0, height: 0 })] {
            o.write(&path).unwrap();
            let back = Orthograph::read(&path).unwrap();
            assert_eq!(back.window(), o.window());
            assert!(back.height.values().iter().zip(o.height.values()).all(|(a, b)| a.to_bits() == b.to_bits()));
            assert_eq!(back.colour, o.colour);
            assert_eq!(back.photographed, o.photographed);
            assert_eq!(back.normal, o.normal);
            assert_eq!(back.walls, o.walls);
            assert_eq!(back.encode().unwrap(), o.encode().unwrap());
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");
    }

    #[test]
    fn damage_is_noticed_and_never_panics() {
        let bytes = orthograph(2).encode().unwrap();
        let mut rng = Counter::new(4);
        for _ in 0..400 {
            let mut broken = bytes.clone();
            let at = rng.index(broken.len());
            broken[at] ^= 1 << rng.index(8);
            assert!(Orthograph::decode(&broken).is_err(), "a flipped bit at {at}");
            assert!(Orthograph::decode(&bytes[..at]).is_err(), "cut at {at}");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(Orthograph::decode(&longer).is_err());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.ortho");
        assert!(matches!(Orthograph::read(&path), Err(OrthoError::Io { .. })));
        std::fs::write(&path, b"nonsense, but longer than a header has to be, so that it is looked at").unwrap();
        let message = Orthograph::read(&path).unwrap_err().to_string();
        assert!(message.contains("byte 0") && message.contains("does not start with GABLORTH"), "{message}");
    }
}
