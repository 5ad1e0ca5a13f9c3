//! What is known of each coarse cell: its heights, its roughness, and the steep rise from it to the next.

use gable_raster::{
    Connectivity, GridWindow, around, box_mean, box_min, components_where, fill_missing, plane_residual, sides,
};

use crate::cell_plane::CellPlane;
use crate::coarse_heights::{CoarseHeights, SIDE};

/// Slope from which a difference of two neighbouring samples is a wall and not ground (rise over run): banks, ramps and hillsides
/// stay below, walls, battered ones too, are above.
const WALL_SLOPE: f32 = 1.0;

/// Difference that the noise of a mesh alone makes between two samples, metres.
const NOISE: f32 = 0.2;

/// Samples that a cell needs to count as seen: fewer are a fringe of the mesh.
const LEAST_SAMPLES: usize = 4;

/// Samples without height that a difference may reach across.
const LONGEST_GAP: usize = SIDE;

/// The cells of a window, row by row.
pub(super) struct Cells {
    pub(super) window: GridWindow,
    /// Whether the cell has enough samples; the other fields mean something only then.
    pub(super) seen: Vec<bool>,
    /// Median of the samples, metres.
    pub(super) middle: Vec<f32>,
    /// Second lowest sample, so that one spike cannot ruin it.
    pub(super) low: Vec<f32>,
    /// Lower quartile of the samples.
    pub(super) quartile: Vec<f32>,
    /// Highest less lowest sample.
    pub(super) relief: Vec<f32>,
    /// Root mean square distance of the samples to their plane: the median over the cell and those around it. 0 where cells lack
    /// samples.
    pub(super) rough: Vec<f32>,
    /// Root mean square distance of the heights of the cells in a window of 6 m to their plane: the least over the windows that hold
    /// the cell, so that a street beside houses is even. 0 where no such window is seen whole.
    pub(super) uneven: Vec<f32>,
    /// What rises steeply between the cell's centre and that of the next one to the east, metres; negative where it falls.
    pub(super) rise_east: Vec<f32>,
    /// The same to the north.
    pub(super) rise_north: Vec<f32>,
}

/// Side of the window in which the ground has to be even somewhere, metres.
const EVEN_WINDOW: f64 = 6.0;

type Samples = [f32; SIDE * SIDE];

impl Cells {
    /// The cells of the smallest window with data. O(cells).
    pub(super) fn of(coarse: &CoarseHeights) -> Self {
        let window = coarse.window();
        let samples = coarse.samples(window);
        let count = window.len();
        let mut cells = Self {
            window,
            seen: vec![false; count],
            middle: vec![f32::NAN; count],
            low: vec![f32::NAN; count],
            quartile: vec![f32::NAN; count],
            relief: vec![0.0; count],
            rough: vec![0.0; count],
            uneven: vec![0.0; count],
            rise_east: vec![0.0; count],
            rise_north: vec![0.0; count],
        };
        let mut own_rough = vec![f32::NAN; count];
        for (i, samples) in samples.iter().enumerate() {
            let mut sorted: Vec<f32> = samples.iter().copied().filter(|z| !z.is_nan()).collect();
            if sorted.len() < LEAST_SAMPLES {
                continue;
            }
            sorted.sort_by(f32::total_cmp);
            cells.seen[i] = true;
            cells.low[i] = sorted[1];
            cells.quartile[i] = sorted[sorted.len() / 4];
            cells.middle[i] = 0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2]);
            cells.relief[i] = sorted[sorted.len() - 1] - sorted[0];
            own_rough[i] = CellPlane::of(samples).map_or(f32::NAN, |plane| plane.residual as f32);
        }
        cells.rough = median_around(&own_rough, window);
        cells.uneven = unevenness(&cells.middle, window);
        cells.find_rises(&samples);
        cells
    }

    /// Whether a cell beside cell `i` lies in the window and is seen: its index, with the steep rise to it.
    pub(super) fn beside(&self, i: usize, side: Side) -> Option<(usize, f32)> {
        let [west, east, south, north] = sides(i, self.window.width, self.window.height);
        let (j, rise) = match side {
            Side::East => (east?, self.rise_east[i]),
            Side::West => (west?, -self.rise_east[west?]),
            Side::North => (north?, self.rise_north[i]),
            Side::South => (south?, -self.rise_north[south?]),
        };
        self.seen[j].then_some((j, rise))
    }

    /// The surfaces of cells that are `part`: cells side by side without a steep rise of `step` or more between them. Numbered in the
    /// order of their first cells; `None` for the others. O(cells).
    pub(super) fn surfaces(&self, part: &[bool], step: f32) -> Surfaces {
        let width = self.window.width;
        let is_level = |cell: usize, next: usize| {
            let rise = if next - cell == width { self.rise_north[cell] } else { self.rise_east[cell] };
            rise.abs() < step
        };
        let belongs = |cell: usize| part[cell] && self.seen[cell];
        let found = components_where(self.window, Connectivity::Four, belongs, is_level);
        Surfaces {
            number: found.numbers.values().iter().map(|number| number.checked_sub(1)).collect(),
            sizes: found.list.iter().map(|surface| surface.pixels).collect(),
        }
    }

    /// Area of a number of cells, m².
    pub(super) fn area(&self, cells: usize) -> f64 {
        cells as f64 * self.window.step * self.window.step
    }

    fn find_rises(&mut self, samples: &[Samples]) {
        let (width, height) = (self.window.width, self.window.height);
        let bound = WALL_SLOPE * (self.window.step as f32) / SIDE as f32 + NOISE;
        for y in 0..height {
            let along = |x: usize, lane: usize, k: usize| samples[y * width + x][lane * SIDE + k];
            let rises = rises_along(width, along, bound);
            self.rise_east[y * width..(y + 1) * width].copy_from_slice(&rises);
        }
        for x in 0..width {
            let along = |y: usize, lane: usize, k: usize| samples[y * width + x][k * SIDE + lane];
            for (y, rise) in rises_along(height, along, bound).into_iter().enumerate() {
                self.rise_north[y * width + x] = rise;
            }
        }
    }
}

/// Cells by the surface that they belong to.
pub(super) struct Surfaces {
    pub(super) number: Vec<Option<u32>>,
    /// Cells of each.
    pub(super) sizes: Vec<usize>,
}

/// One of the four cells beside a cell.
#[derive(Clone, Copy)]
pub(super) enum Side {
    East,
    West,
    North,
    South,
}

impl Side {
    pub(super) const ALL: [Self; 4] = [Self::East, Self::West, Self::North, Self::South];

    /// Unit vector to that side.
    pub(super) fn direction(self) -> [f32; 2] {
        match self {
            Self::East => [1.0, 0.0],
            Self::West => [-1.0, 0.0],
            Self::North => [0.0, 1.0],
            Self::South => [0.0, -1.0],
        }
    }
}

/// Steep rises between the centres of the cells of a row (or column) and the next.
///
/// `sample(cell, lane, k)` is the k-th sample along the row in one of its lanes. Of each lane the differences that are steeper than a
/// wall's add up; the mean of the middle two lanes counts, so that a post or a gap in a wall decides nothing.
fn rises_along(cells: usize, sample: impl Fn(usize, usize, usize) -> f32, bound: f32) -> Vec<f32> {
    let mut by_lane = vec![[0.0_f32; SIDE]; cells];
    let mut steep = vec![0.0_f32; cells * SIDE];
    for lane in 0..SIDE {
        let mut last: Option<(usize, f32)> = None;
        for k in 0..cells * SIDE {
            let z = sample(k / SIDE, lane, k % SIDE);
            // steep[k] is what rises from the sample before to this one.
            steep[k] = 0.0;
            if z.is_nan() {
                continue;
            }
            if let Some((at, before)) = last
                && k - at <= LONGEST_GAP
                && (z - before).abs() > bound
            {
                steep[k] = z - before;
            }
            last = Some((k, z));
        }
        let half = SIDE / 2;
        for cell in 0..cells.saturating_sub(1) {
            // The centres lie between two samples each.
            let (from, to) = (cell * SIDE + half, (cell + 1) * SIDE + half);
            let inner: f32 = steep[from + 1..to].iter().sum();
            by_lane[cell][lane] = 0.5 * steep[from] + inner + 0.5 * steep[to];
        }
    }
    let middle = |lanes: &mut [f32; SIDE]| {
        lanes.sort_by(f32::total_cmp);
        0.5 * (lanes[SIDE / 2 - 1] + lanes[SIDE / 2])
    };
    by_lane.iter_mut().map(middle).collect()
}

/// See [`Cells::uneven`].
fn unevenness(heights: &[f32], window: GridWindow) -> Vec<f32> {
    let (width, height) = (window.width, window.height);
    let radius = ((EVEN_WINDOW / window.step - 1.0) / 2.0).round().max(1.0) as usize;
    let unseen: Vec<f32> = heights.iter().map(|z| if z.is_nan() { 1.0 } else { 0.0 }).collect();
    let mut filled = heights.to_vec();
    fill_missing(&mut filled, width, height, 0);
    let mut residual = plane_residual(&filled, width, height, radius);
    let gaps = box_mean(&unseen, width, height, radius);
    for (i, residual) in residual.iter_mut().enumerate() {
        let (x, y) = (i % width, i / width);
        let whole = x >= radius && y >= radius && x + radius < width && y + radius < height;
        // Sums of whole numbers are exact, so a window without gaps has none.
        if !whole || gaps[i] > 0.0 || residual.is_nan() {
            *residual = f32::INFINITY;
        }
    }
    let least = box_min(&residual, width, height, radius);
    least.into_iter().map(|r| if r.is_finite() { r } else { 0.0 }).collect()
}

/// The median over each cell and the eight around it of what is no NaN; 0 where all are.
fn median_around(values: &[f32], window: GridWindow) -> Vec<f32> {
    let mut near = Vec::with_capacity(9);
    let mut out = Vec::with_capacity(values.len());
    for cell in 0..values.len() {
        near.clear();
        near.push(values[cell]);
        near.extend(around(cell, window.width, window.height).map(|other| values[other]));
        near.retain(|value| !value.is_nan());
        near.sort_by(f32::total_cmp);
        out.push(near.get(near.len() / 2).copied().unwrap_or(0.0));
    }
    out
}
