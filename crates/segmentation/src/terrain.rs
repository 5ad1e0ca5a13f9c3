//! The ground surface of a city, from the low heights of coarse cells.
//!
//! The paper takes one height for a block (Zhu 2018, Eq. 3), which fails on slopes and is ruined by one spike below ground
//! (that rule is kept in [`crate::segment`] as the baseline). Here the ground is a surface:
//!
//! 1. Spikes below ground go: cells that an area closing of 16 m² raises by more than a metre.
//! 2. A trend: the low rank of blocks of 256 m, then, in later rounds, the smoothed ground of the round before.
//! 3. Seeds: cells that stand less than a tolerance above the envelope from below that rises by 3 % in all directions
//!    (the slope filter of Vosselman 2000, on heights over the trend). A roof of 10 m height needs to be over 600 m wide
//!    to hold a seed.
//! 4. Growth: a cell next to two ground cells that it does not overtop by more than a gentle slope is ground; that
//!    follows hills, banks and ramps and stops at walls. What is lower than ground is ground.
//! 5. Between ground cells the surface is a smooth continuation (Laplace's equation), under buildings and trees too.
//!
//! Steps 2–5 run a fixed number of rounds. All of it works on the cells of the absolute lattice, for the city as a whole:
//! nothing depends on blocks.

use gable_geometry::DVec2;
use gable_ortho::{GridWindow, Raster};

use crate::coarse_heights::{CoarseHeights, LowHeights};
use crate::fill::{bilinear, fill_missing};
use crate::roughness::box_mean;

/// How the ground is found; defaults suit photogrammetry of towns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TerrainParams {
    /// Slope of the envelope from below that seeds are measured against (rise over run).
    pub seed_slope: f32,
    /// Height over that envelope up to which a cell is a seed, metres.
    pub seed_tolerance: f32,
    /// Slope over the trend up to which ground grows (rise over run).
    pub growth_slope: f32,
    /// Area of the largest pit that is taken for a spike, m².
    pub pit_area: f32,
    /// Rounds of trend, seeds and growth.
    pub rounds: usize,
}

impl Default for TerrainParams {
    fn default() -> Self {
        Self { seed_slope: 0.03, seed_tolerance: 0.5, growth_slope: 0.25, pit_area: 100.0, rounds: 3 }
    }
}

/// Edge of the blocks of the first trend, metres: wider than roofs and most woods, so that each holds some ground.
const TREND_BLOCK: f64 = 256.0;

/// Area that the first closing fills, m².
const SPIKE_AREA: f64 = 16.0;

/// Depth from which a closed place is a pit, metres.
const PIT_DEPTH: f32 = 1.0;

/// Depth below the smoothed ground from which a small place is a pit, metres.
const DEEP_PIT: f32 = 2.0;

/// Side of the window that smooths the trend in later rounds, metres.
const TREND_WINDOW: f64 = 66.0;

/// Sweeps of the continuation under objects, on each level.
const SWEEPS: usize = 40;

/// A ground surface: heights at the centres of cells, bilinear between them.
#[derive(Clone, Debug)]
pub struct Terrain {
    heights: Raster<f32>,
    ground: Raster<bool>,
}

impl Terrain {
    /// The ground under the gathered heights; without any, a plane at height 0.
    ///
    /// Cost: O(cells log cells).
    #[must_use]
    pub fn from_coarse(coarse: &CoarseHeights, params: &TerrainParams) -> Self {
        let window = coarse.window();
        if window.is_empty() {
            let window = GridWindow { width: 1, height: 1, ..window };
            return Self { heights: Raster::filled(window, 0.0), ground: Raster::filled(window, false) };
        }
        let LowHeights { mut low, quartile } = coarse.low_heights(window);
        drop_pits(&mut low, (SPIKE_AREA / (window.step * window.step)).ceil() as usize, PIT_DEPTH);
        let mut trend = block_trend(&low);
        let mut ground = Vec::new();
        let mut surface = Vec::new();
        for round in 0..params.rounds.max(1) {
            let residual: Vec<f32> = low.values().iter().zip(&trend).map(|(z, t)| z - t).collect();
            ground = grow(&residual, window, params);
            surface = low.values().iter().zip(&ground).map(|(z, g)| if *g { *z } else { f32::NAN }).collect();
            fill_missing(&mut surface, window.width, window.height, SWEEPS);
            if round + 1 < params.rounds {
                let radius = (TREND_WINDOW / window.step / 2.0) as usize;
                trend = box_mean(&surface, window.width, window.height, radius);
                trend = box_mean(&trend, window.width, window.height, radius);
                drop_deep_places(&mut low, &trend, params.pit_area);
            }
        }
        // The quartile is nearer to the ground's middle than the low statistic, where the cell is all ground.
        for ((z, quartile), ground) in surface.iter_mut().zip(quartile.values()).zip(&ground) {
            if *ground && quartile - *z < 0.5 {
                *z = *quartile;
            } else if !*ground {
                *z = f32::NAN;
            }
        }
        fill_missing(&mut surface, window.width, window.height, SWEEPS);
        Self { heights: Raster::new(window, surface), ground: Raster::new(window, ground) }
    }

    /// A surface from heights at the centres of cells; NaN where nobody will ask for the surface.
    #[must_use]
    pub fn from_heights(heights: Raster<f32>) -> Self {
        let ground = heights.map(|_| true);
        Self { heights, ground }
    }

    /// The same height everywhere: the block constant of the paper.
    #[must_use]
    pub fn constant(height: f32) -> Self {
        let window = GridWindow { step: CoarseHeights::CELL, x0: 0, y0: 0, width: 1, height: 1 };
        Self::from_heights(Raster::filled(window, height))
    }

    /// Heights at the centres of the cells.
    #[must_use]
    pub fn heights(&self) -> &Raster<f32> {
        &self.heights
    }

    /// Cells where ground was seen; elsewhere the surface is a continuation.
    #[must_use]
    pub fn ground(&self) -> &Raster<bool> {
        &self.ground
    }

    /// Height of the ground at a place, local metres; continued flat beyond the border.
    #[must_use]
    pub fn height(&self, p: DVec2) -> f64 {
        let window = self.heights.window();
        let x = p.x / window.step - window.x0 as f64 - 0.5;
        let y = p.y / window.step - window.y0 as f64 - 0.5;
        f64::from(bilinear(self.heights.values(), window.width, window.height, x as f32, y as f32))
    }

    /// Heights of the ground at the centres of a window's pixels.
    #[must_use]
    pub fn raster(&self, window: GridWindow) -> Raster<f32> {
        let mut values = Vec::with_capacity(window.len());
        for row in 0..window.height {
            values.extend((0..window.width).map(|column| self.height(window.centre(column, row)) as f32));
        }
        Raster::new(window, values)
    }
}

/// The low rank of blocks of the absolute lattice, bilinear between their centres.
fn block_trend(low: &Raster<f32>) -> Vec<f32> {
    let window = low.window();
    let side = (TREND_BLOCK / window.step).round().max(1.0) as i64;
    let (bx0, by0) = (window.x0.div_euclid(side), window.y0.div_euclid(side));
    let bw = ((window.x0 + window.width as i64 - 1).div_euclid(side) - bx0 + 1) as usize;
    let bh = ((window.y0 + window.height as i64 - 1).div_euclid(side) - by0 + 1) as usize;
    let mut cells: Vec<Vec<f32>> = vec![Vec::new(); bw * bh];
    for row in 0..window.height {
        let by = ((window.y0 + row as i64).div_euclid(side) - by0) as usize;
        for (column, z) in low.row(row).iter().enumerate() {
            if !z.is_nan() {
                cells[by * bw + ((window.x0 + column as i64).div_euclid(side) - bx0) as usize].push(*z);
            }
        }
    }
    let mut blocks: Vec<f32> = cells
        .iter_mut()
        .map(|cells| {
            if cells.is_empty() {
                return f32::NAN;
            }
            // A few cells may lie too low; a few dozen that are ground must suffice between roofs.
            let rank = (cells.len() / 64).min(12);
            *cells.select_nth_unstable_by(rank, f32::total_cmp).1
        })
        .collect();
    fill_missing(&mut blocks, bw, bh, 4);
    let mut trend = Vec::with_capacity(window.len());
    for row in 0..window.height {
        let y = ((window.y0 - by0 * side + row as i64) as f32 + 0.5) / side as f32 - 0.5;
        for column in 0..window.width {
            let x = ((window.x0 - bx0 * side + column as i64) as f32 + 0.5) / side as f32 - 0.5;
            trend.push(bilinear(&blocks, bw, bh, x, y));
        }
    }
    trend
}

/// Seeds and growth (steps 3 and 4) on heights over the trend; NaN is no data.
fn grow(residual: &[f32], window: GridWindow, params: &TerrainParams) -> Vec<bool> {
    let (w, h) = (window.width, window.height);
    let cell = window.step as f32;
    let envelope = envelope(residual, w, h, params.seed_slope * cell);
    let mut ground: Vec<bool> = residual.iter().zip(&envelope).map(|(z, e)| z - e <= params.seed_tolerance).collect();
    let mut queue: Vec<usize> = (0..residual.len()).filter(|&i| ground[i]).collect();
    let rise = params.growth_slope * cell;
    // Whatever the order, the same cells are reached: a cell's support only grows.
    while let Some(i) = queue.pop() {
        for (j, _) in neighbours(i, w, h) {
            if ground[j] || residual[j].is_nan() {
                continue;
            }
            let support = neighbours(j, w, h)
                .filter(|&(k, diagonal)| {
                    let reach = if diagonal { rise * std::f32::consts::SQRT_2 } else { rise };
                    ground[k] && residual[j] - residual[k] <= reach
                })
                .count();
            if support >= 2 {
                ground[j] = true;
                queue.push(j);
            }
        }
    }
    ground
}

/// Lower envelope whose slope is at most `rise` a cell: min over all cells of their value plus `rise` times the chamfer
/// distance. Two sweeps over the cells.
fn envelope(values: &[f32], width: usize, height: usize, rise: f32) -> Vec<f32> {
    let mut out: Vec<f32> = values.iter().map(|v| if v.is_nan() { f32::INFINITY } else { *v }).collect();
    let diagonal = rise * std::f32::consts::SQRT_2;
    for y in 0..height {
        for x in 0..width {
            let i = y * width + x;
            let mut v = out[i];
            if x > 0 {
                v = v.min(out[i - 1] + rise);
            }
            if y > 0 {
                v = v.min(out[i - width] + rise);
                if x > 0 {
                    v = v.min(out[i - width - 1] + diagonal);
                }
                if x + 1 < width {
                    v = v.min(out[i - width + 1] + diagonal);
                }
            }
            out[i] = v;
        }
    }
    for y in (0..height).rev() {
        for x in (0..width).rev() {
            let i = y * width + x;
            let mut v = out[i];
            if x + 1 < width {
                v = v.min(out[i + 1] + rise);
            }
            if y + 1 < height {
                v = v.min(out[i + width] + rise);
                if x > 0 {
                    v = v.min(out[i + width - 1] + diagonal);
                }
                if x + 1 < width {
                    v = v.min(out[i + width + 1] + diagonal);
                }
            }
            out[i] = v;
        }
    }
    out
}

/// Makes cells NaN that an area closing raises by more than `depth`: hollows of fewer than `cells` cells.
///
/// The water rises cell by cell in the order of heights; a pool stays a pool until it has enough cells.
fn drop_pits(low: &mut Raster<f32>, cells: usize, depth: f32) {
    let (w, h) = (low.width(), low.height());
    let values = low.values_mut();
    let mut order: Vec<usize> = (0..values.len()).filter(|&i| !values[i].is_nan()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]).then(a.cmp(&b)));
    let mut pool: Vec<usize> = (0..values.len()).collect();
    // Cells of a pool that is still small; empty once it is large.
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); values.len()];
    let mut wet = vec![false; values.len()];
    let mut pits = Vec::new();
    for i in order {
        wet[i] = true;
        members[i].push(i);
        let mut root = i;
        let mut large = false;
        let around: Vec<usize> = neighbours(i, w, h).map(|(j, _)| j).filter(|&j| wet[j]).collect();
        for j in around {
            let other = find(&mut pool, j);
            if other != root {
                large |= members[other].is_empty();
                let mut moved = std::mem::take(&mut members[other]);
                pool[other] = root;
                if moved.len() > members[root].len() {
                    // Keep the longer list as it is.
                    std::mem::swap(&mut moved, &mut members[root]);
                }
                members[root].extend(moved);
                root = find(&mut pool, root);
            }
        }
        if large || members[root].len() >= cells {
            for j in std::mem::take(&mut members[root]) {
                if values[i] - values[j] > depth {
                    pits.push(j);
                }
            }
        }
    }
    for j in pits {
        values[j] = f32::NAN;
    }
}

fn find(pool: &mut [usize], mut i: usize) -> usize {
    while pool[i] != i {
        pool[i] = pool[pool[i]];
        i = pool[i];
    }
    i
}

/// Makes cells NaN that lie far below the trend in connected places of at most `area` m².
fn drop_deep_places(low: &mut Raster<f32>, trend: &[f32], area: f32) {
    let (w, h) = (low.width(), low.height());
    let limit = f64::from(area) / low.window().step.powi(2);
    let values = low.values_mut();
    let mut open: Vec<bool> = values.iter().zip(trend).map(|(z, t)| z - t < -DEEP_PIT).collect();
    for start in 0..open.len() {
        if !open[start] {
            continue;
        }
        open[start] = false;
        let mut place = vec![start];
        let mut next = 0;
        while next < place.len() {
            for (j, _) in neighbours(place[next], w, h) {
                if open[j] {
                    open[j] = false;
                    place.push(j);
                }
            }
            next += 1;
        }
        if place.len() as f64 <= limit {
            place.iter().for_each(|&i| values[i] = f32::NAN);
        }
    }
}

/// The up to eight cells around a cell, and whether they touch it at a corner only.
fn neighbours(i: usize, width: usize, height: usize) -> impl Iterator<Item = (usize, bool)> {
    let (x, y) = ((i % width) as i64, (i / width) as i64);
    (0..9_i64).filter(|k| *k != 4).filter_map(move |k| {
        let (dx, dy) = (k % 3 - 1, k / 3 - 1);
        let (u, v) = (x + dx, y + dy);
        let inside = u >= 0 && v >= 0 && (u as usize) < width && (v as usize) < height;
        inside.then(|| (v as usize * width + u as usize, dx != 0 && dy != 0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Counter, dvec2};

    const WINDOW: GridWindow = GridWindow { step: 0.5, x0: -500, y0: 300, width: 800, height: 700 };

    // A scene from a ground and objects; `objects` gives the height over the ground.
    fn scene(ground: impl Fn(f64, f64) -> f64, objects: impl Fn(f64, f64) -> f64) -> (Raster<f32>, CoarseHeights) {
        let mut random = Counter::new(17);
        let mut raster = Raster::filled(WINDOW, 0.0_f32);
        for row in 0..WINDOW.height {
            for column in 0..WINDOW.width {
                let p = WINDOW.centre(column, row) - WINDOW.bounds().min;
                raster[(column, row)] = (ground(p.x, p.y) + objects(p.x, p.y) + random.range(-0.12, 0.12)) as f32;
            }
        }
        let mut coarse = CoarseHeights::new(CoarseHeights::CELL);
        coarse.accumulate(&raster);
        (raster, coarse)
    }

    // Largest error of the terrain over the places that `at` chooses, in the scene's metres.
    fn worst(terrain: &Terrain, ground: impl Fn(f64, f64) -> f64, at: impl Fn(f64, f64) -> bool) -> f64 {
        let mut worst: f64 = 0.0;
        for y in (6..344).step_by(2) {
            for x in (6..394).step_by(2) {
                let (x, y) = (f64::from(x), f64::from(y));
                if at(x, y) {
                    let p = dvec2(x, y) + WINDOW.bounds().min;
                    worst = worst.max((terrain.height(p) - ground(x, y)).abs());
                }
            }
        }
        worst
    }

    fn inside(x: f64, y: f64, [x0, y0, x1, y1]: [f64; 4]) -> bool {
        x0 <= x && x <= x1 && y0 <= y && y <= y1
    }

    // A hall of 120 × 110 m, a block with a courtyard of 14 m, a low shed, rows of houses.
    fn town(x: f64, y: f64) -> f64 {
        let houses = inside(x, y, [250.0, 20.0, 380.0, 330.0]) && (x - 250.0) % 32.0 < 14.0 && (y - 20.0) % 26.0 < 19.0;
        if inside(x, y, [40.0, 180.0, 160.0, 290.0]) {
            8.0
        } else if inside(x, y, [60.0, 40.0, 110.0, 90.0]) && !inside(x, y, [78.0, 58.0, 92.0, 72.0]) {
            18.0
        } else if inside(x, y, [150.0, 60.0, 170.0, 75.0]) {
            2.6
        } else if houses {
            7.0
        } else {
            0.0
        }
    }

    #[test]
    fn follows_slopes_under_wide_buildings_and_into_courtyards() {
        for slope in [0.0, 0.05, 0.15] {
            let ground = move |x: f64, y: f64| 30.0 + slope * x - 0.5 * slope * y;
            let terrain = Terrain::from_coarse(&scene(ground, town).1, &TerrainParams::default());
            let open = worst(&terrain, ground, |x, y| town(x, y) == 0.0);
            let under = worst(&terrain, ground, |x, y| town(x, y) > 0.0);
            assert!(open < 0.6 && under < 1.0, "slope {slope}: {open:.2} m in the open, {under:.2} m under buildings");
        }
    }

    #[test]
    fn follows_a_hill() {
        let ground = |x: f64, y: f64| 14.0 * (-((x - 200.0).powi(2) + (y - 170.0).powi(2)) / 9000.0).exp();
        let terrain = Terrain::from_coarse(&scene(ground, town).1, &TerrainParams::default());
        let open = worst(&terrain, ground, |x, y| town(x, y) == 0.0);
        assert!(open < 0.7, "{open:.2} m");
    }

    #[test]
    fn keeps_both_sides_of_a_river_bank() {
        // A quay wall: the town lies 5 m over a river of 70 m width.
        let ground = |x: f64, _: f64| if inside(x, 0.0, [180.0, 0.0, 245.0, 0.0]) { 0.0 } else { 5.0 };
        let terrain = Terrain::from_coarse(&scene(ground, town).1, &TerrainParams::default());
        // Half a cell beside the wall the surface is between the two.
        let away = |x: f64| (x - 180.0).abs() > 3.0 && (x - 245.0).abs() > 3.0;
        let open = worst(&terrain, ground, |x, y| town(x, y) == 0.0 && away(x));
        assert!(open < 0.6, "{open:.2} m");
    }

    #[test]
    fn pits_and_floaters_do_not_count() {
        let ground = |x: f64, y: f64| 0.03 * x + 0.02 * y;
        let spoilt = |x: f64, y: f64| {
            // Spikes of 1–8 m width under ground, and something that hovers.
            for (cx, cy, width, depth) in
                [(30.0, 120.0, 1.0, -25.0), (200.0, 150.0, 3.0, -12.0), (210.0, 250.0, 8.0, -6.0)]
            {
                if (x - cx).abs() < width / 2.0 && (y - cy).abs() < width / 2.0 {
                    return depth;
                }
            }
            if inside(x, y, [190.0, 30.0, 192.0, 33.0]) { 30.0 } else { town(x, y) }
        };
        let terrain = Terrain::from_coarse(&scene(ground, spoilt).1, &TerrainParams::default());
        let open = worst(&terrain, ground, |x, y| town(x, y) == 0.0);
        assert!(open < 0.6, "{open:.2} m");
    }

    #[test]
    fn woods_are_no_ground() {
        let ground = |x: f64, y: f64| 0.05 * x + 0.01 * y;
        let crowns = |x: f64, y: f64| {
            if inside(x, y, [100.0, 80.0, 260.0, 240.0]) {
                9.0 + 2.5 * ((x / 2.1).sin() + (y / 1.7).cos())
            } else {
                0.0
            }
        };
        let terrain = Terrain::from_coarse(&scene(ground, crowns).1, &TerrainParams::default());
        let all = worst(&terrain, ground, |_, _| true);
        assert!(all < 1.0, "{all:.2} m");
    }

    #[test]
    fn nothing_gives_a_plane() {
        let terrain = Terrain::from_coarse(&CoarseHeights::new(2.0), &TerrainParams::default());
        assert_eq!(terrain.height(dvec2(3.0, 4.0)), 0.0);
    }
}
