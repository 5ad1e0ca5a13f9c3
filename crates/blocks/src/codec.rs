//! Triangles as bytes that compress well, and back.
//!
//! Triangles of a mesh share corners, and neighbours follow each other. So each distinct corner
//! (position, texture coordinate, colour) is written once, in the order of its first use, as the
//! difference from the one before; triangles name corners by how far back they are.

use crate::bytes::{put, take, unzigzag, zigzag};
use crate::triangle::BlockTriangle;

/// Why bytes are no triangles.
pub(crate) type Fault = &'static str;

/// A corner as whole numbers: x, y, z, u's bits, v's bits, colour.
type Corner = [i32; 6];

const COLUMNS: usize = 6;

fn corner(triangle: &BlockTriangle, at: usize) -> Corner {
    let [x, y, z] = triangle.corners[at];
    let [u, v] = triangle.uv[at].map(|c| c.to_bits() as i32);
    [x, y, z, u, v, i32::from_le_bytes(triangle.colours[at])]
}

/// Appends triangles; see the crate's page for the layout. O(n).
pub(crate) fn encode(triangles: &[BlockTriangle], out: &mut Vec<u8>) {
    let mut seen = Seen::for_corners(3 * triangles.len());
    let mut references = Vec::with_capacity(4 * triangles.len());
    for triangle in triangles {
        for at in 0..3 {
            let count = seen.corners.len() as u32;
            let index = seen.index(corner(triangle, at));
            put(&mut references, u64::from(count - index));
        }
    }
    put(out, seen.corners.len() as u64);
    let mut column = Vec::new();
    for axis in 0..COLUMNS {
        column.clear();
        let mut last = 0i32;
        for corner in &seen.corners {
            put(&mut column, zigzag(corner[axis].wrapping_sub(last)));
            last = corner[axis];
        }
        section(out, &column);
    }
    section(out, &references);
    column.clear();
    let mut last = 0u32;
    for run in triangles.chunk_by(|a, b| a.material == b.material) {
        put(&mut column, zigzag(run[0].material.wrapping_sub(last) as i32));
        put(&mut column, run.len() as u64);
        last = run[0].material;
    }
    section(out, &column);
}

/// Takes `count` triangles from the front. O(n); never reserves more than the bytes can hold.
pub(crate) fn decode(bytes: &mut &[u8], count: u64) -> Result<Vec<BlockTriangle>, Fault> {
    const ENDS: Fault = "the body ends too early";
    const RANGE: Fault = "a number in the body is out of range";
    let corners = take(bytes).ok_or(ENDS)?;
    let mut table: Vec<Corner> = Vec::new();
    for axis in 0..COLUMNS {
        let mut column = part(bytes).ok_or(ENDS)?;
        // A number takes a byte at least.
        if corners > column.len() as u64 {
            return Err(ENDS);
        }
        table.resize(corners as usize, [0; COLUMNS]);
        let mut last = 0i32;
        for corner in &mut table {
            let step = take(&mut column).ok_or(ENDS)?;
            last = last.wrapping_add(unzigzag(step).ok_or(RANGE)?);
            corner[axis] = last;
        }
        if !column.is_empty() {
            return Err(RANGE);
        }
    }
    let mut references = part(bytes).ok_or(ENDS)?;
    let mut materials = part(bytes).ok_or(ENDS)?;
    if count.checked_mul(3).is_none_or(|least| least > references.len() as u64) {
        return Err(ENDS);
    }
    let mut triangles = Vec::with_capacity(count as usize);
    let (mut next, mut material, mut run) = (0u64, 0u32, 0u64);
    for _ in 0..count {
        while run == 0 {
            let step = unzigzag(take(&mut materials).ok_or(ENDS)?).ok_or(RANGE)?;
            material = material.wrapping_add(step as u32);
            run = take(&mut materials).ok_or(ENDS)?;
        }
        run -= 1;
        let mut triangle = BlockTriangle { material, ..BlockTriangle::default() };
        for at in 0..3 {
            let back = take(&mut references).ok_or(ENDS)?;
            let index = next.checked_sub(back).ok_or(RANGE)?;
            next += u64::from(back == 0);
            let [x, y, z, u, v, colour] = *table.get(index as usize).ok_or(RANGE)?;
            triangle.corners[at] = [x, y, z];
            triangle.uv[at] = [u, v].map(|c| f32::from_bits(c as u32));
            triangle.colours[at] = colour.to_le_bytes();
        }
        triangles.push(triangle);
    }
    if !references.is_empty() || !materials.is_empty() || run != 0 || next != corners {
        return Err(RANGE);
    }
    Ok(triangles)
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

/// Corners in the order of their first use, found again by a hash table with linear probing.
struct Seen {
    corners: Vec<Corner>,
    /// Index of a corner plus one; 0 where free.
    slots: Vec<u32>,
}

impl Seen {
    fn for_corners(most: usize) -> Self {
        Self { corners: Vec::new(), slots: vec![0; (2 * most).next_power_of_two().max(2)] }
    }

    /// The index of a corner, which is added if it is new.
    fn index(&mut self, corner: Corner) -> u32 {
        let mask = self.slots.len() - 1;
        let mut at = hash(&corner) as usize & mask;
        loop {
            match self.slots[at] {
                0 => {
                    self.corners.push(corner);
                    self.slots[at] = self.corners.len() as u32;
                    return self.corners.len() as u32 - 1;
                }
                index if self.corners[index as usize - 1] == corner => return index - 1,
                _ => at = (at + 1) & mask,
            }
        }
    }
}

/// Mixes the numbers of a corner, two at a time.
fn hash(corner: &Corner) -> u64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    for pair in corner.chunks_exact(2) {
        let word = u64::from(pair[0] as u32) << 32 | u64::from(pair[1] as u32);
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
