#![doc = include_str!("../README.md")]

mod error;
mod reach;
mod source;

pub use error::{FileError, Refusal};
pub use reach::Reach;
pub use source::{Source, SourceError, SourceRoots};
