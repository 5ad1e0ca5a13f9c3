//! Accessors of glTF files: vectors and indices in buffers, sparse and quantised ones among them.

use crate::budget;
use crate::error::{Place, SceneError};
use crate::glb::Container;
use gltf::Accessor;
use gltf::accessor::sparse::IndexType;
use gltf::accessor::{DataType, Dimensions};

/// Vectors of numbers in a buffer.
pub(crate) struct Numbers {
    bytes: Vec<u8>,
    stride: usize,
    kind: DataType,
    /// What a whole number is divided by.
    divisor: f32,
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
        let quantised =
            container.quantised && matches!(kind, DataType::I8 | DataType::U8 | DataType::I16 | DataType::U16);
        if accessor.dimensions() != dimensions || !(quantised || kinds.contains(&kind)) {
            let what = format!(
                "accessor {} holds {:?} of {kind:?}, which is not read: write floats",
                accessor.index(),
                accessor.dimensions()
            );
            return Err(container.fault(&what));
        }
        // Without quantisation whole numbers are fractions, whether it is said or not.
        let divisor = match kind {
            _ if container.quantised && !accessor.normalized() => 1.0,
            DataType::I8 => 127.0,
            DataType::U8 => 255.0,
            DataType::I16 => 32_767.0,
            DataType::U16 => 65_535.0,
            DataType::U32 | DataType::F32 => 1.0,
        };
        let (bytes, stride, _) = read_accessor(container, accessor)?;
        Ok(Self { bytes, stride, kind, divisor, count: accessor.count() })
    }

    /// The first numbers of an item; whole numbers as fractions of their largest, unless they are quantised to other steps.
    pub(crate) fn get<const N: usize>(&self, at: usize) -> [f32; N] {
        let mut out = [0.0; N];
        for (axis, value) in out.iter_mut().enumerate() {
            let size = self.kind.size();
            let start = at * self.stride + axis * size;
            let Some(bytes) = self.bytes.get(start..start + size) else { continue };
            *value = match (self.kind, bytes) {
                (DataType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
                (DataType::U16, &[a, b]) => f32::from(u16::from_le_bytes([a, b])) / self.divisor,
                (DataType::I16, &[a, b]) => self.signed(f32::from(i16::from_le_bytes([a, b]))),
                (DataType::I8, &[a]) => self.signed(f32::from(i8::from_le_bytes([a]))),
                (_, &[a, ..]) => f32::from(a) / self.divisor,
                _ => 0.0,
            };
        }
        out
    }

    /// A signed number: of a fraction the least is as far from zero as the largest.
    fn signed(&self, value: f32) -> f32 {
        if self.divisor == 1.0 { value } else { (value / self.divisor).max(-1.0) }
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
    let size = accessor.size();
    let (mut bytes, stride, offset) = match accessor.view() {
        Some(view) => {
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
            check_length(container, accessor, length, budget::ACCESSOR)?;
            (container.read(view.buffer().index(), offset, length)?, stride, offset)
        }
        // Zeros, of which the file has no byte: no more than a file may have that is not much smaller.
        None => {
            let length = (accessor.count() as u64).saturating_mul(size as u64);
            let most = container.buffer_bytes().saturating_mul(16).saturating_add(1 << 20).min(budget::ACCESSOR);
            check_length(container, accessor, length, most)?;
            (vec![0; length as usize], size, 0)
        }
    };
    if accessor.sparse().is_some() {
        replace_some(container, accessor, &mut bytes, stride)?;
    }
    Ok((bytes, stride, offset))
}

fn check_length(container: &Container, accessor: &Accessor<'_>, length: u64, most: u64) -> Result<(), SceneError> {
    if length <= most {
        return Ok(());
    }
    let what = format!("accessor {} has more than {} MiB", accessor.index(), most >> 20);
    Err(SceneError::too_much(&container.path, what))
}

/// Puts the values of a sparse accessor in their places.
fn replace_some(
    container: &Container,
    accessor: &Accessor<'_>,
    bytes: &mut [u8],
    stride: usize,
) -> Result<(), SceneError> {
    let Some(sparse) = accessor.sparse() else { return Ok(()) };
    let (count, size) = (sparse.count(), accessor.size());
    let fault = |what: &str| container.fault(&format!("accessor {} is sparse, and {what}", accessor.index()));
    if count > accessor.count() {
        return Err(fault("has more values than items"));
    }
    let part = |view: gltf::buffer::View<'_>, offset: usize, item: usize| {
        let length = (count as u64).saturating_mul(item as u64);
        if (offset as u64).saturating_add(length) > view.length() as u64 {
            return Err(fault("reaches beyond its buffer view"));
        }
        container.read(view.buffer().index(), (view.offset() as u64).saturating_add(offset as u64), length)
    };
    let width = match sparse.indices().index_type() {
        IndexType::U8 => 1,
        IndexType::U16 => 2,
        IndexType::U32 => 4,
    };
    let indices = part(sparse.indices().view(), sparse.indices().offset(), width)?;
    let values = part(sparse.values().view(), sparse.values().offset(), size)?;
    for (index, value) in indices.chunks_exact(width).zip(values.chunks_exact(size.max(1))) {
        let mut four = [0; 4];
        four[..width].copy_from_slice(index);
        let at = u32::from_le_bytes(four) as usize;
        let place = bytes.get_mut(at * stride..at * stride + size).filter(|_| at < accessor.count());
        place.ok_or_else(|| fault("names an item that is not there"))?.copy_from_slice(value);
    }
    Ok(())
}
