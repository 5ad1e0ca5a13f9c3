//! How many blocks a scene is cut into where nobody asks for a number.

/// Shortest edge of a block, metres: below, what comes once for each block costs more than what is in it.
const LEAST_EDGE: f64 = 100.0;
/// Most columns, and most rows.
const MOST: u32 = 16;
/// Most triangles that a block has in the mean, if more and shorter blocks can help it: one takes 152 bytes while its block is made.
const MOST_TRIANGLES: u64 = 2_000_000;

/// Columns and rows for a scene of so many pixels of `step` metres from west to east and from south to north, and so many triangles.
/// Where a number is asked for, it is taken; the other then fits.
///
/// As many as are at least [`LEAST_EDGE`] long, from one to [`MOST`]. More only where a block would hold more than [`MOST_TRIANGLES`],
/// for memory hangs on the blocks: then the longer edge is cut, again and again.
pub(crate) fn fit(asked: [Option<u32>; 2], pixels: [i64; 2], step: f64, triangles: u64) -> [u32; 2] {
    let least = (LEAST_EDGE / step).ceil().max(1.0) as i64;
    let mut counts = [0, 1].map(|axis| asked[axis].unwrap_or((pixels[axis] / least).clamp(1, i64::from(MOST)) as u32));
    let edge = |axis: usize, counts: [u32; 2]| pixels[axis] as f64 / f64::from(counts[axis]);
    loop {
        let blocks = u64::from(counts[0]) * u64::from(counts[1]);
        let may_grow =
            |axis: &usize| asked[*axis].is_none() && counts[*axis] < MOST && i64::from(counts[*axis]) < pixels[*axis];
        let longest = [0, 1].into_iter().filter(may_grow).max_by(|&a, &b| edge(a, counts).total_cmp(&edge(b, counts)));
        match longest {
            Some(axis) if triangles > blocks.saturating_mul(MOST_TRIANGLES) => counts[axis] += 1,
            _ => return counts,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANY: [Option<u32>; 2] = [None, None];

    fn pixels(metres: [f64; 2], step: f64) -> [i64; 2] {
        metres.map(|side| (side / step).round() as i64)
    }

    #[test]
    fn blocks_are_a_hundred_metres_long_at_least_and_not_too_many() {
        for (metres, step, wanted) in [
            ([101.0, 117.0], 0.2, [1, 1]),
            ([3.0, 199.8], 0.2, [1, 1]),
            ([200.0, 336.0], 0.2, [2, 3]),
            ([1599.0, 1602.0], 0.3, [15, 15]),
            ([3500.0, 90_000.0], 0.5, [16, 16]),
            ([1000.0, 700.0], 5.0, [10, 7]),
        ] {
            let pixels = pixels(metres, step);
            let counts = fit(ANY, pixels, step, 100_000);
            assert_eq!(counts, wanted, "{metres:?} at {step}");
            for (side, count) in pixels.into_iter().zip(counts) {
                let shortest = (side / i64::from(count)) as f64 * step;
                assert!(count == 1 || shortest >= LEAST_EDGE - 1e-9, "{metres:?} at {step}: {shortest}");
            }
        }
    }

    #[test]
    fn what_is_asked_for_is_made() {
        assert_eq!(fit([Some(7), None], pixels([70.0, 420.0], 0.2), 0.2, 0), [7, 4]);
        assert_eq!(fit([Some(40), Some(1)], pixels([70.0, 420.0], 0.2), 0.2, u64::MAX), [40, 1]);
        assert_eq!(fit([None, Some(1)], pixels([70.0, 420.0], 0.2), 0.2, u64::MAX), [16, 1]);
    }

    #[test]
    fn many_triangles_are_spread_over_more_blocks() {
        assert_eq!(fit(ANY, pixels([90.0, 90.0], 0.2), 0.2, MOST_TRIANGLES), [1, 1]);
        let counts = fit(ANY, pixels([60.0, 90.0], 0.2), 0.2, 20_000_000);
        assert_eq!(counts, [3, 4]);
        assert_eq!(fit(ANY, pixels([3500.0, 3500.0], 0.2), 0.2, 92_000_000), [16, 16]);
        assert_eq!(fit(ANY, [3, 20], 0.2, u64::MAX), [3, 16], "no block without a pixel");
    }
}
