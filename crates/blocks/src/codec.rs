//! Triangles as bytes that compress well, and back.
//!
//! Triangles of a mesh share corners, and neighbours follow each other. So each distinct place
//! (position and colour) and each distinct texture coordinate is written once, in the order of its
//! first use, as the difference from the one before; triangles name them by how far back they are.

use crate::bytes::{put, take, unzigzag, zigzag};
use crate::triangle::BlockTriangle;

/// Why bytes are no triangles.
pub(crate) type Fault = &'static str;

const ENDS: Fault = "the body ends too early";
const RANGE: Fault = "a number in the body is out of range";

/// x, y, z, colour.
type Place = [i32; 4];
/// The bits of u and v.
type Uv = [i32; 2];

fn place(triangle: &BlockTriangle, at: usize) -> Place {
    let [x, y, z] = triangle.corners[at];
    [x, y, z, i32::from_le_bytes(triangle.colours[at])]
}

fn uv(triangle: &BlockTriangle, at: usize) -> Uv {
    triangle.uv[at].map(|c| c.to_bits() as i32)
}

/// Appends triangles; see the crate's page for the layout. O(n).
pub(crate) fn encode(triangles: &[BlockTriangle], out: &mut Vec<u8>) {
    put_table(triangles, place, out);
    put_table(triangles, uv, out);
    let mut runs = Vec::new();
    let mut last = 0u32;
    for run in triangles.chunk_by(|a, b| a.material == b.material) {
        put(&mut runs, zigzag(run[0].material.wrapping_sub(last) as i32));
        put(&mut runs, run.len() as u64);
        last = run[0].material;
    }
    section(out, &runs);
}

/// Takes `count` triangles from the front. O(n); never reserves more than the bytes can hold.
pub(crate) fn decode(bytes: &mut &[u8], count: u64) -> Result<Vec<BlockTriangle>, Fault> {
    let mut places = Table::<4>::take(bytes, count)?;
    let mut uvs = Table::<2>::take(bytes, count)?;
    let mut runs = part(bytes).ok_or(ENDS)?;
    let mut triangles = Vec::with_capacity(count as usize);
    let (mut material, mut run) = (0u32, 0u64);
    for _ in 0..count {
        while run == 0 {
            let step = unzigzag(take(&mut runs).ok_or(ENDS)?).ok_or(RANGE)?;
            material = material.wrapping_add(step as u32);
            run = take(&mut runs).ok_or(ENDS)?;
        }
        run -= 1;
        let mut triangle = BlockTriangle { material, ..BlockTriangle::default() };
        for at in 0..3 {
            let [x, y, z, colour] = places.next()?;
            triangle.corners[at] = [x, y, z];
            triangle.colours[at] = colour.to_le_bytes();
            triangle.uv[at] = uvs.next()?.map(|c| f32::from_bits(c as u32));
        }
        triangles.push(triangle);
    }
    if !runs.is_empty() || run != 0 || !places.is_spent() || !uvs.is_spent() {
        return Err(RANGE);
    }
    Ok(triangles)
}

/// Appends the distinct values of all corners, column by column, and how far back each corner's is.
fn put_table<const N: usize>(
    triangles: &[BlockTriangle],
    value: fn(&BlockTriangle, usize) -> [i32; N],
    out: &mut Vec<u8>,
) {
    let mut seen = Seen::for_values(3 * triangles.len());
    let mut references = Vec::with_capacity(4 * triangles.len());
    for triangle in triangles {
        for at in 0..3 {
            let count = seen.values.len() as u32;
            let index = seen.index(value(triangle, at));
            put(&mut references, u64::from(count - index));
        }
    }
    put(out, seen.values.len() as u64);
    let mut column = Vec::new();
    for axis in 0..N {
        column.clear();
        let mut last = 0i32;
        for value in &seen.values {
            put(&mut column, zigzag(value[axis].wrapping_sub(last)));
            last = value[axis];
        }
        section(out, &column);
    }
    section(out, &references);
}

/// What [`put_table`] wrote, corner by corner.
struct Table<'a, const N: usize> {
    values: Vec<[i32; N]>,
    references: &'a [u8],
    /// Values that corners have used so far.
    used: u64,
}

impl<'a, const N: usize> Table<'a, N> {
    fn take(bytes: &mut &'a [u8], triangles: u64) -> Result<Self, Fault> {
        let count = take(bytes).ok_or(ENDS)?;
        let mut values: Vec<[i32; N]> = Vec::new();
        for axis in 0..N {
            let mut column = part(bytes).ok_or(ENDS)?;
            // A number takes a byte at least.
            if count > column.len() as u64 {
                return Err(ENDS);
            }
            values.resize(count as usize, [0; N]);
            let mut last = 0i32;
            for value in &mut values {
                let step = take(&mut column).ok_or(ENDS)?;
                last = last.wrapping_add(unzigzag(step).ok_or(RANGE)?);
                value[axis] = last;
            }
            if !column.is_empty() {
                return Err(RANGE);
            }
        }
        let references = part(bytes).ok_or(ENDS)?;
        if triangles.checked_mul(3).is_none_or(|least| least > references.len() as u64) {
            return Err(ENDS);
        }
        Ok(Self { values, references, used: 0 })
    }

    #[inline]
    fn next(&mut self) -> Result<[i32; N], Fault> {
        let back = take(&mut self.references).ok_or(ENDS)?;
        let index = self.used.checked_sub(back).ok_or(RANGE)?;
        self.used += u64::from(back == 0);
        self.values.get(index as usize).copied().ok_or(RANGE)
    }

    /// Whether every value was used and every corner read.
    fn is_spent(&self) -> bool {
        self.references.is_empty() && self.used == self.values.len() as u64
    }
}

/// Appends bytes behind their number.
fn section(out: &mut Vec<u8>, bytes: &[u8]) {
    put(out, bytes.len() as u64);
    out.extend_from_slice(bytes);
}

/// Takes what [`section`] appended.
fn part<'a>(bytes: &mut &'a [u8]) -> Option<&'a [u8]> {
    let length = usize::try_from(take(bytes)?).ok()?;
    let (part, rest) = bytes.split_at_checked(length)?;
    *bytes = rest;
    Some(part)
}

/// Values in the order of their first use, found again by a hash table with linear probing.
pub(crate) struct Seen<const N: usize> {
    pub(crate) values: Vec<[i32; N]>,
    /// Index of a value plus one; 0 where free.
    slots: Vec<u32>,
}

impl<const N: usize> Seen<N> {
    /// Room for a number of values.
    pub(crate) fn for_values(most: usize) -> Self {
        Self { values: Vec::new(), slots: vec![0; (2 * most).next_power_of_two().max(2)] }
    }

    /// The index of a value, which is added if it is new.
    #[inline]
    pub(crate) fn index(&mut self, value: [i32; N]) -> u32 {
        match self.slot(value) {
            (at, 0) => {
                self.values.push(value);
                self.slots[at] = self.values.len() as u32;
                self.values.len() as u32 - 1
            }
            (_, index) => index - 1,
        }
    }

    /// The index of a value that was seen.
    #[inline]
    pub(crate) fn find(&self, value: [i32; N]) -> Option<u32> {
        self.slot(value).1.checked_sub(1)
    }

    /// The slot where a value is or would be, and what stands there.
    #[inline]
    fn slot(&self, value: [i32; N]) -> (usize, u32) {
        let mask = self.slots.len() - 1;
        let mut at = hash(&value) as usize & mask;
        loop {
            match self.slots[at] {
                index if index == 0 || self.values[index as usize - 1] == value => return (at, index),
                _ => at = (at + 1) & mask,
            }
        }
    }
}

/// Mixes the numbers of a value, two at a time.
#[inline]
fn hash<const N: usize>(value: &[i32; N]) -> u64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    for pair in value.chunks(2) {
        let word = pair.iter().fold(0, |word, v| word << 32 | u64::from(*v as u32));
        state = (state ^ word).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        state ^= state >> 29;
    }
    state
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Triangles between few corners, so that corners and materials come again, with some extreme values.
    pub(crate) fn triangles() -> impl Strategy<Value = Vec<BlockTriangle>> {
        let value = prop_oneof![8 => -50i32..50, 1 => any::<i32>()];
        let corner = (proptest::array::uniform3(value), any::<bool>());
        let corners = proptest::collection::vec(corner, 3..20);
        let picks = proptest::collection::vec((any::<[prop::sample::Index; 3]>(), 0u32..3, any::<bool>()), 0..60);
        (corners, picks).prop_map(|(corners, picks)| {
            let triangle = |(pick, material, plain): ([prop::sample::Index; 3], u32, bool)| {
                let chosen = pick.map(|i| corners[i.index(corners.len())]);
                BlockTriangle {
                    corners: chosen.map(|(c, _)| c),
                    uv: chosen.map(|(c, flag)| if flag { [c[0] as f32 / 7.0, -0.0] } else { [0.0; 2] }),
                    material: if plain { u32::MAX } else { material },
                    colours: chosen.map(|(c, flag)| if flag { [c[0] as u8, c[1] as u8, 3, 255] } else { [0; 4] }),
                }
            };
            picks.into_iter().map(triangle).collect()
        })
    }

    proptest! {
        #[test]
        fn triangles_come_back(triangles in triangles()) {
            let mut bytes = Vec::new();
            encode(&triangles, &mut bytes);
            let mut rest = bytes.as_slice();
            let back = decode(&mut rest, triangles.len() as u64);
            prop_assert_eq!(back.as_deref(), Ok(triangles.as_slice()));
            prop_assert!(rest.is_empty());
            for wrong in [triangles.len() as u64 + 1, u64::MAX] {
                prop_assert!(decode(&mut bytes.as_slice(), wrong).is_err());
            }
        }

        #[test]
        fn damaged_bytes_are_refused_or_read_but_never_panic(
            triangles in triangles(),
            at in any::<prop::sample::Index>(),
            byte in any::<u8>(),
            cut in any::<prop::sample::Index>(),
        ) {
            let mut bytes = Vec::new();
            encode(&triangles, &mut bytes);
            let length = bytes.len();
            let mut short = &bytes[..cut.index(length)];
            prop_assert!(decode(&mut short, triangles.len() as u64).is_err());
            bytes[at.index(length)] = byte;
            let _ = decode(&mut bytes.as_slice(), triangles.len() as u64);
        }

        #[test]
        fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200), count in 0u64..10) {
            let _ = decode(&mut bytes.as_slice(), count);
        }
    }
}
