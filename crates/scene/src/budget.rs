//! What a scene may have at most. Generous: a city of 100 million faces under textures of 16,384 pixels stays far below. Each is
//! checked before what it limits is made, so that a small file cannot fill the memory.

/// Triangles of a scene.
pub(crate) const TRIANGLES: u64 = 1_000_000_000;
/// Vertices of a file: they stand in memory, 24 to 40 bytes each.
pub(crate) const VERTICES: u64 = 250_000_000;
/// Corners of a face.
pub(crate) const CORNERS: usize = 1_000_000;
/// Corners of a face that is not convex: cutting it may take time by their square.
pub(crate) const CONCAVE_CORNERS: usize = 50_000;
/// Files and folders in a folder of tiles, together.
pub(crate) const ENTRIES: usize = 1_000_000;

/// Bytes of a material library.
pub(crate) const LIBRARY: u64 = 256 << 20;
/// Bytes of all material libraries of a scene, together.
pub(crate) const LIBRARIES: u64 = 1 << 30;
/// Library names in a file: each is looked for on the disk.
pub(crate) const LIBRARY_NAMES: usize = 10_000;
/// Materials of a scene.
pub(crate) const MATERIALS: usize = 4_000_000;

/// Bytes of an image file.
pub(crate) const IMAGE_FILE: u64 = 1 << 30;
/// Pixels along a side of an image.
pub(crate) const IMAGE_SIDE: u32 = 32_768;
/// Pixels of an image: 16,384 × 16,384.
pub(crate) const IMAGE_PIXELS: u64 = 1 << 28;
/// Bytes that decoding an image may take.
pub(crate) const IMAGE_MEMORY: u64 = 1 << 30;

/// Bytes of a glTF file's JSON.
pub(crate) const JSON: u64 = 1 << 30;
/// Objects in that JSON: each takes some hundred bytes of memory, and three in the file.
pub(crate) const JSON_OBJECTS: usize = 2_000_000;
/// Triangles of a glTF file beyond those that its bytes can hold: nodes may show a mesh more than once.
pub(crate) const REPEATED_TRIANGLES: u64 = 100_000_000;
/// The same for all vertices and indices that have to be looked at: primitives may share them.
pub(crate) const REPEATED_ITEMS: u64 = 1_000_000_000;
/// Bytes of an accessor of a glTF file: it stands in memory.
pub(crate) const ACCESSOR: u64 = 4 << 30;

/// Bytes of a `metadata.xml`.
pub(crate) const METADATA: u64 = 16 << 20;
/// Elements inside of each other in a `metadata.xml`.
pub(crate) const METADATA_DEPTH: usize = 64;
