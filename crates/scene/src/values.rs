//! The numbers of a file one after the other, as text or binary.

use crate::budget;
use crate::error::{Place, SceneError};
use crate::ply_header::{Property, Scalar};
use crate::tokens::Tokens;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

pub(crate) type Reader = BufReader<File>;

/// Numbers one after the other, as text or binary.
pub(crate) enum Values<'a> {
    Text(Tokens<'a, Reader>),
    Binary { path: &'a Path, reader: Reader, offset: u64, big: bool },
}

impl Values<'_> {
    /// Where the next number stands.
    pub(crate) fn place(&self) -> Place {
        match self {
            Self::Text(tokens) => tokens.place(),
            Self::Binary { offset, .. } => Place::Byte(*offset),
        }
    }

    /// The next number; an error that says `what` was expected otherwise.
    pub(crate) fn next(&mut self, kind: Scalar, what: &str) -> Result<f64, SceneError> {
        let (path, reader, offset, big) = match self {
            Self::Text(tokens) => return tokens.number(what),
            Self::Binary { path, reader, offset, big } => (path, reader, offset, *big),
        };
        let mut bytes = [0; 8];
        let size = kind.size();
        if let Err(error) = reader.read_exact(&mut bytes[..size]) {
            return Err(match error.kind() {
                std::io::ErrorKind::UnexpectedEof => {
                    SceneError::truncated(path, Place::Byte(*offset), format!("where {what} is expected"))
                }
                _ => SceneError::read(path, error),
            });
        }
        *offset += size as u64;
        if big {
            bytes[..size].reverse();
        }
        let bits = u64::from_le_bytes(bytes);
        Ok(match kind {
            Scalar::I8 => f64::from(bits as i8),
            Scalar::U8 => f64::from(bits as u8),
            Scalar::I16 => f64::from(bits as i16),
            Scalar::U16 => f64::from(bits as u16),
            Scalar::I32 => f64::from(bits as i32),
            Scalar::U32 => f64::from(bits as u32),
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        })
    }

    /// The number of items in a list.
    pub(crate) fn length(&mut self, path: &Path, kind: Scalar) -> Result<usize, SceneError> {
        let place = self.place();
        let length = self.next(kind, "the length of a list")?;
        if (0.0..=budget::CORNERS as f64).contains(&length) && length.fract() == 0.0 {
            Ok(length as usize)
        } else {
            Err(SceneError::syntax(path, place, format!("a list cannot have {length} items")))
        }
    }
}

/// Passes over the values of some properties.
pub(crate) fn skip(values: &mut Values<'_>, properties: &[Property]) -> Result<(), SceneError> {
    for property in properties {
        skip_one(values, property)?;
    }
    Ok(())
}

/// Passes over the value of a property.
pub(crate) fn skip_one(values: &mut Values<'_>, property: &Property) -> Result<(), SceneError> {
    let items = match property.list {
        Some(kind) => values.next(kind, "the length of a list")?.clamp(0.0, 1e18) as u64,
        None => 1,
    };
    for _ in 0..items {
        values.next(property.item, "a value")?;
    }
    Ok(())
}
