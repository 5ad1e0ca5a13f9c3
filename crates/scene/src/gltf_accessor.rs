//! Accessors of glTF files: vectors and indices in buffers.

use crate::budget;
use crate::error::{Place, SceneError};
use crate::glb::Container;
use gltf::Accessor;
use gltf::accessor::{DataType, Dimensions};

/// Vectors of numbers in a buffer.
pub(crate) struct Numbers {
    bytes: Vec<u8>,
    stride: usize,
    kind: DataType,
    pub(crate) count: usize,
}

impl Numbers {
    pub(crate) fn read(
        container: &Container,
        accessor: &Accessor<'_>,
        dimensions: Dimensions,
        kinds: &[DataType],
    ) -> Result<Self, SceneError> {
        let kind = accessor.data_type();
        if accessor.dimensions() != dimensions || !kinds.contains(&kind) {
            let what = format!(
                "accessor {} holds {:?} of {kind:?}, which is not read: write floats",
                accessor.index(),
                accessor.dimensions()
            );
            return Err(container.fault(&what));
        }
        let (bytes, stride, _) = read_accessor(container, accessor)?;
        Ok(Self { bytes, stride, kind, count: accessor.count() })
    }

    /// The first numbers of an item; whole numbers as fractions of their largest.
    pub(crate) fn get<const N: usize>(&self, at: usize) -> [f32; N] {
        let mut out = [0.0; N];
        for (axis, value) in out.iter_mut().enumerate() {
            let size = self.kind.size();
            let start = at * self.stride + axis * size;
            let Some(bytes) = self.bytes.get(start..start + size) else { continue };
            *value = match (self.kind, bytes) {
                (DataType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
                (DataType::U16, &[a, b]) => f32::from(u16::from_le_bytes([a, b])) / 65_535.0,
                (_, &[a, ..]) => f32::from(a) / 255.0,
                _ => 0.0,
            };
        }
        out
    }
}

/// Whole numbers in a buffer.
pub(crate) struct Indices {
    bytes: Vec<u8>,
    stride: usize,
    size: usize,
    pub(crate) count: usize,
    pub(crate) offset: u64,
}

impl Indices {
    pub(crate) fn read(container: &Container, accessor: &Accessor<'_>) -> Result<Self, SceneError> {
        let kind = accessor.data_type();
        if accessor.dimensions() != Dimensions::Scalar || !matches!(kind, DataType::U8 | DataType::U16 | DataType::U32)
        {
            return Err(container.fault(&format!("accessor {} holds {kind:?}, which are no indices", accessor.index())));
        }
        let (bytes, stride, offset) = read_accessor(container, accessor)?;
        Ok(Self { bytes, stride, size: kind.size(), count: accessor.count(), offset })
    }

    pub(crate) fn get(&self, at: usize) -> u32 {
        let mut four = [0; 4];
        if let Some(bytes) = self.bytes.get(at * self.stride..at * self.stride + self.size) {
            four[..self.size].copy_from_slice(bytes);
        }
        u32::from_le_bytes(four)
    }
}

/// The bytes of an accessor, the distance between its items, and where it starts in its buffer.
fn read_accessor(container: &Container, accessor: &Accessor<'_>) -> Result<(Vec<u8>, usize, u64), SceneError> {
    let (Some(view), None) = (accessor.view(), accessor.sparse()) else {
        return Err(container.fault(&format!("accessor {} is sparse, which is not read", accessor.index())));
    };
    let size = accessor.size();
    let stride = view.stride().unwrap_or(size).max(size);
    let length = match accessor.count() {
        0 => 0,
        count => (count as u64 - 1).saturating_mul(stride as u64).saturating_add(size as u64),
    };
    let offset = (view.offset() as u64).saturating_add(accessor.offset() as u64);
    if (accessor.offset() as u64).saturating_add(length) > view.length() as u64 {
        let what = format!("accessor {} reaches beyond its buffer view", accessor.index());
        return Err(SceneError::syntax(&container.path, Place::Byte(offset), what));
    }
    if length > budget::ACCESSOR {
        let what = format!("accessor {} has more than {} MiB", accessor.index(), budget::ACCESSOR >> 20);
        return Err(SceneError::too_much(&container.path, what));
    }
    Ok((container.read(view.buffer().index(), offset, length)?, stride, offset))
}
