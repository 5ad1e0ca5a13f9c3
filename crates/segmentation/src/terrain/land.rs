//! How the land lies at large: how steep it is, and how low.
//!
//! Nothing is known of ground and objects yet, so each square of the land is stood for by one of its low heights, and the plane through
//! the squares around follows the lower ones: streets rather than roofs, clearings rather than crowns.

use super::cells::Cells;

/// Edge of the squares, metres.
const SQUARE: f64 = 16.0;

/// Share of a square that has to be seen.
const SEEN: f64 = 0.25;

/// Ranks, as shares, of the heights that stand for a square: in the fit of planes, and as the lowest that is no spike.
const LOW: f64 = 0.2;
const LOWEST: f64 = 0.05;

/// Squares on each side that a plane is fitted to.
const REACH: usize = 4;

/// Rounds of the fit; from the second on what stands high over the plane counts less.
const ROUNDS: usize = 6;

/// Height over the plane at which a square counts half, metres.
const HIGH: f64 = 1.0;

/// Rank, as a share, of the square whose lowest height is as low as the land gets around a place.
const LOW_SQUARE: f64 = 0.1;

/// The lie of the land at each cell, over some 140 m around it.
pub(super) struct Land {
    /// Slopes in x and y, rise over run.
    pub(super) gradient: Vec<[f32; 2]>,
    /// Height of the cell's middle over the low places around it, metres; a slope of the land is taken off.
    pub(super) over_low_places: Vec<f32>,
}

impl Land {
    /// O(cells log cells).
    pub(super) fn of(cells: &Cells) -> Self {
        let squares = Squares::of(cells);
        let (width, height) = (cells.window.width, cells.window.height);
        let planes: Vec<[f64; 3]> = (0..squares.low.len()).map(|square| squares.low_plane(square)).collect();
        let mut land = Self { gradient: Vec::new(), over_low_places: Vec::new() };
        for i in 0..width * height {
            let (x, y) = (i % width + squares.left, i / width + squares.bottom);
            let plane = planes[y / squares.edge * squares.columns + x / squares.edge];
            let from_middle = |at: usize| ((at % squares.edge) as f64 + 0.5) * cells.window.step - SQUARE / 2.0;
            let low = plane[0] * from_middle(x) + plane[1] * from_middle(y) + plane[2];
            land.gradient.push([plane[0] as f32, plane[1] as f32]);
            land.over_low_places.push(cells.middle[i] - low as f32);
        }
        land
    }

    /// Slope at a cell, rise over run.
    pub(super) fn slope(&self, i: usize) -> f32 {
        let [x, y] = self.gradient[i];
        x.hypot(y)
    }
}

/// Squares of the absolute lattice, row by row.
struct Squares {
    /// Edge of a square in cells.
    edge: usize,
    /// Cells of the first column and row of squares that lie outside of the window.
    left: usize,
    bottom: usize,
    columns: usize,
    rows: usize,
    /// The heights of [`LOW`] and [`LOWEST`], metres, where enough is seen.
    low: Vec<Option<[f64; 2]>>,
}

impl Squares {
    fn of(cells: &Cells) -> Self {
        let window = cells.window;
        let edge = (SQUARE / window.step).round().max(1.0) as usize;
        let left = window.x0.rem_euclid(edge as i64) as usize;
        let bottom = window.y0.rem_euclid(edge as i64) as usize;
        let (columns, rows) = ((window.width + left).div_ceil(edge), (window.height + bottom).div_ceil(edge));
        let mut heights = vec![Vec::new(); columns * rows];
        for i in (0..cells.seen.len()).filter(|&i| cells.seen[i]) {
            let (x, y) = (i % window.width + left, i / window.width + bottom);
            heights[y / edge * columns + x / edge].push(cells.low[i]);
        }
        let enough = SEEN * (edge * edge) as f64;
        let low = heights.into_iter().map(|mut heights| {
            let is_seen = heights.len() as f64 > enough;
            is_seen.then(|| [ranked(&mut heights, LOW), ranked(&mut heights, LOWEST)].map(f64::from))
        });
        let low = low.collect();
        Self { edge, left, bottom, columns, rows, low }
    }

    /// The plane of the land around a square, moved down to its low places: slopes in x and y, height at the square's middle.
    /// Level at height 0 where too little is seen to tell.
    fn low_plane(&self, square: usize) -> [f64; 3] {
        let (column, row) = (square % self.columns, square / self.columns);
        let mut places = Vec::new();
        let mut lowest = Vec::new();
        for v in row.saturating_sub(REACH)..(row + REACH + 1).min(self.rows) {
            for u in column.saturating_sub(REACH)..(column + REACH + 1).min(self.columns) {
                if let Some([low, least]) = self.low[v * self.columns + u] {
                    let (x, y) = (SQUARE * (u as f64 - column as f64), SQUARE * (v as f64 - row as f64));
                    places.push([x, y, low]);
                    lowest.push([x, y, least]);
                }
            }
        }
        let Some(mut plane) = plane_through_low(&places) else { return [0.0; 3] };
        let mut under: Vec<f32> = lowest.iter().map(|place| over_plane(place, &plane) as f32).collect();
        plane[2] += f64::from(ranked(&mut under, LOW_SQUARE));
        plane
    }
}

fn ranked(values: &mut [f32], rank: f64) -> f32 {
    let at = (rank * values.len() as f64) as usize;
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

fn over_plane([x, y, z]: &[f64; 3], plane: &[f64; 3]) -> f64 {
    z - (plane[0] * x + plane[1] * y + plane[2])
}

/// Least squares with weights that fall with the height over the plane of the round before; `None` without three places off a line.
fn plane_through_low(places: &[[f64; 3]]) -> Option<[f64; 3]> {
    let mut plane = [0.0; 3];
    for round in 0..ROUNDS {
        let mut equations = [[0.0; 4]; 3];
        for place in places {
            let over = if round == 0 { 0.0 } else { over_plane(place, &plane).max(0.0) };
            let weight = 1.0 / (1.0 + (over / HIGH).powi(2));
            let terms = [place[0], place[1], 1.0, place[2]];
            for (equation, by) in equations.iter_mut().zip(terms) {
                for (sum, term) in equation.iter_mut().zip(terms) {
                    *sum += weight * by * term;
                }
            }
        }
        plane = solve(equations)?;
    }
    Some(plane)
}

/// Three linear equations, each with its right side last, by elimination with pivots; `None` if they do not determine the unknowns.
fn solve(mut m: [[f64; 4]; 3]) -> Option<[f64; 3]> {
    for k in 0..3 {
        let pivot = (k..3).max_by(|&a, &b| m[a][k].abs().total_cmp(&m[b][k].abs()))?;
        m.swap(k, pivot);
        if m[k][k].abs() < 1e-6 {
            return None;
        }
        let by = m[k];
        for (r, equation) in m.iter_mut().enumerate() {
            if r != k {
                let factor = equation[k] / by[k];
                equation.iter_mut().zip(by).for_each(|(value, by)| *value -= factor * by);
            }
        }
    }
    Some([0, 1, 2].map(|k| m[k][3] / m[k][k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;

    // Squares on a slope, every third of them on roofs.
    fn places(slope: [f64; 2]) -> Vec<[f64; 3]> {
        let mut random = Counter::new(3);
        let mut places = Vec::new();
        for v in -4..=4 {
            for u in -4..=4 {
                let (x, y) = (f64::from(u) * SQUARE, f64::from(v) * SQUARE);
                let roof = if (u + 5 * v) % 3 == 0 { random.range(5.0, 20.0) } else { random.range(-0.1, 0.1) };
                places.push([x, y, 7.0 + slope[0] * x + slope[1] * y + roof]);
            }
        }
        places
    }

    #[test]
    fn the_plane_follows_the_low_places() {
        for slope in [[0.0, 0.0], [0.1, -0.05], [-0.3, 0.3]] {
            let plane = plane_through_low(&places(slope)).unwrap();
            let off = [plane[0] - slope[0], plane[1] - slope[1], plane[2] - 7.0];
            assert!(off[0].abs() < 0.01 && off[1].abs() < 0.01 && off[2].abs() < 0.5, "{slope:?}: {off:?}");
        }
    }

    #[test]
    fn a_line_of_places_has_no_plane() {
        assert_eq!(plane_through_low(&[[0.0, 0.0, 1.0], [16.0, 0.0, 2.0], [32.0, 0.0, 3.0]]), None);
        assert_eq!(plane_through_low(&[]), None);
    }
}
