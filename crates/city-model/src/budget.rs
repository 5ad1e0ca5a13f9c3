//! What a city model may have at most to be read. Generous; each is checked before what it limits is made, so that few bytes cannot
//! fill the memory.

/// Bytes of a file.
pub(crate) const FILE: u64 = 4 << 30;
/// How far a vertex may lie from the local origin, metres.
pub(crate) const REACH: f64 = 1e7;
/// The largest world coordinate, metres: zones' numbers in front of eastings stay far below.
pub(crate) const WORLD: f64 = 1e9;
/// References inside of each other.
pub(crate) const REFERENCES: usize = 64;

/// What a file may come to by saying things once and meaning them many times: parts that several buildings have, polygons that many
/// surfaces refer to, surfaces whose attributes many faces have.
#[derive(Debug)]
pub(crate) struct Shared {
    /// Corners and references that are left.
    corners: u64,
    /// Bytes of attributes that are left.
    attributes: u64,
}

impl Shared {
    /// For a file of so many bytes, in which each corner takes two at least.
    pub(crate) fn of_file(bytes: usize) -> Self {
        let bytes = bytes as u64;
        Self { corners: 4 * bytes + 10_000, attributes: 16 * bytes + (64 << 20) }
    }

    /// Takes some corners; false if they are not left.
    pub(crate) fn take_corners(&mut self, count: usize) -> bool {
        let left = self.corners.checked_sub(count as u64);
        self.corners = left.unwrap_or(0);
        left.is_some()
    }

    /// Takes some bytes of attributes; false if they are not left.
    pub(crate) fn take_attributes(&mut self, bytes: usize) -> bool {
        let left = self.attributes.checked_sub(bytes as u64);
        self.attributes = left.unwrap_or(0);
        left.is_some()
    }
}

/// What is said of a file that comes to more.
pub(crate) const TOO_MUCH: &str =
    "the file uses the same geometry or attributes so often that it comes to more than is read";
