//! Removes spikes and pits: floating parts, cables, poles and holes that reconstruction noise leaves in a height map.

use gable_raster::{Connectivity, Raster, around, around_place, flood};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// What stands out of its surroundings by no more than this stays, metres.
const FOOT: f32 = 0.5;

/// Parameters of [`despike`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DespikeParams {
    /// Larger pieces are kept, m² (default 1).
    pub max_area: f64,
    /// What stands less far above (or below) all of its surroundings is kept, metres (default 3).
    pub min_height: f64,
}

impl Default for DespikeParams {
    fn default() -> Self {
        Self { max_area: 1.0, min_height: 3.0 }
    }
}

impl DespikeParams {
    /// Pixels of the largest piece that is removed.
    fn max_pixels(&self, step: f64) -> usize {
        (self.max_area / (step * step)).round() as usize
    }

    /// How far away, in pixels, a height can decide about a pixel: the margin that a window needs.
    #[must_use]
    pub fn reach(&self, step: f64) -> usize {
        self.max_pixels(step) + 1
    }
}

/// The height map without spikes and pits: their pixels become NaN, as do small pieces without any surroundings.
///
/// From each local peak a flood goes down, always to the highest pixel next to it, until it holds more than `max_area`:
/// the level where that happens is the height of the surroundings. A peak that stands at least `min_height` above it
/// is removed with all that hangs together with it more than 0.5 m above that level. A parapet, a chimney at the roof's edge or a roof's corner stays, for
/// the flood runs over the roof at once. Pits likewise.
///
/// Working on the raster instead of the mesh's components makes the decision local: a part cut by the border of a
/// block is judged by what lies within [`DespikeParams::reach`] pixels, so a window with that margin gives the same
/// pixels as the whole city. Cost: O(pixels) for smooth maps, and `max_area` pixels more for each peak near a large
/// step.
#[must_use]
pub fn despike(height: &Raster<f32>, params: &DespikeParams) -> Raster<f32> {
    let max_pixels = params.max_pixels(height.window().step);
    let mut out = height.clone();
    if max_pixels == 0 {
        return out;
    }
    let mut flooded = Flood { seen: vec![0; height.values().len()], ..Flood::default() };
    for sign in [1.0, -1.0] {
        for y in 0..height.height() {
            for x in 0..height.width() {
                let peak = sign * height[(x, y)];
                if peak.is_nan() || !is_peak(height, x, y, sign) {
                    continue;
                }
                let floor = peak - params.min_height as f32;
                if is_far_from_low(height, x, y, sign, floor, max_pixels) {
                    continue;
                }
                let pixel = y * height.width() + x;
                let level = flooded.surroundings(height, pixel, sign, max_pixels);
                if level <= floor {
                    flooded
                        .above(height, pixel, sign, level + FOOT)
                        .iter()
                        .for_each(|&at| out.values_mut()[at] = f32::NAN);
                }
            }
        }
    }
    out
}

fn is_peak(height: &Raster<f32>, x: usize, y: usize, sign: f32) -> bool {
    let h = sign * height[(x, y)];
    around_place(x, y, height.width(), height.height()).all(|at| {
        let n = sign * height.values()[at];
        n.is_nan() || n <= h
    })
}

/// Whether the square around a pixel in which a small piece must end is all high: then its piece cannot be small.
fn is_far_from_low(height: &Raster<f32>, x: usize, y: usize, sign: f32, floor: f32, max_pixels: usize) -> bool {
    let r = (max_pixels as f64).sqrt().ceil() as usize / 2 + 1;
    if x < r || y < r || x + r >= height.width() || y + r >= height.height() {
        return false;
    }
    (y - r..=y + r).all(|ny| height.row(ny)[x - r..=x + r].iter().all(|&h| sign * h > floor))
}

/// A pixel that the flood can go to, ordered by height, then number.
#[derive(PartialEq)]
struct Next(f32, usize);

impl Eq for Next {}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then_with(|| self.1.cmp(&other.1))
    }
}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[derive(Default)]
struct Flood {
    piece: Vec<usize>,
    rim: BinaryHeap<Next>,
    seen: Vec<u32>,
    round: u32,
}

impl Flood {
    /// Floods from a pixel downward until more than `max_pixels` are held, and gives the level reached; −∞ if the piece
    /// ends before.
    fn surroundings(&mut self, height: &Raster<f32>, from: usize, sign: f32, max_pixels: usize) -> f32 {
        let values = height.values();
        self.round += 1;
        self.rim.clear();
        self.seen[from] = self.round;
        self.rim.push(Next(sign * values[from], from));
        let mut level = f32::INFINITY;
        let mut held = 0;
        while let Some(Next(h, pixel)) = self.rim.pop() {
            level = level.min(h);
            if held == max_pixels {
                return level;
            }
            held += 1;
            for at in around(pixel, height.width(), height.height()) {
                if self.seen[at] != self.round && !values[at].is_nan() {
                    self.seen[at] = self.round;
                    self.rim.push(Next(sign * values[at], at));
                }
            }
        }
        f32::NEG_INFINITY
    }

    /// What hangs together with a pixel above a level.
    fn above(&mut self, height: &Raster<f32>, from: usize, sign: f32, level: f32) -> &[usize] {
        self.round += 1;
        let (round, seen) = (self.round, &mut self.seen);
        seen[from] = round;
        flood(from, height.width(), height.height(), Connectivity::Eight, &mut self.piece, |at| {
            let takes = seen[at] != round && sign * height.values()[at] > level;
            if takes {
                seen[at] = round;
            }
            takes
        });
        &self.piece
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;
    use gable_raster::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: 0, y0: 0, width: 90, height: 80 };

    /// A house of 8 m on rough ground, a pole, a pit, a floating part over the roof's corner, a chimney of 1.5 m.
    fn scene() -> Raster<f32> {
        let mut rng = Counter::new(3);
        let mut h = Raster::filled(WINDOW, 0.0);
        h.values_mut().iter_mut().for_each(|v| *v = rng.range(0.0, 0.3) as f32);
        let mut block = |x: std::ops::Range<usize>, y: std::ops::Range<usize>, z: f32| {
            y.for_each(|y| x.clone().for_each(|x| h[(x, y)] += z));
        };
        block(20..60, 20..50, 8.0);
        block(30..34, 30..34, 1.5);
        block(5..7, 5..8, 6.0);
        block(70..73, 10..12, -9.0);
        (48..51).for_each(|y| (58..61).for_each(|x| h[(x, y)] = 20.0));
        // A cone whose sides fall by 4 m a pixel.
        for (x, y) in (0..25).map(|i| (10 + i % 5, 60 + i / 5)) {
            h[(x, y)] += 9.0 - 4.0 * x.abs_diff(12).max(y.abs_diff(62)) as f32;
        }
        h
    }

    #[test]
    fn takes_away_what_is_small_and_stands_alone() {
        let before = scene();
        let after = despike(&before, &DespikeParams::default());
        let gone: Vec<_> = (0..WINDOW.len())
            .filter(|&i| after.values()[i].is_nan())
            .map(|i| (i % WINDOW.width, i / WINDOW.width))
            .collect();
        assert_eq!(gone.len(), 6 + 6 + 9 + 25, "{gone:?}");
        assert!(gone.contains(&(5, 5)) && gone.contains(&(72, 11)) && gone.contains(&(60, 50)));
        assert!(!after[(20, 20)].is_nan() && !after[(59, 20)].is_nan(), "corners of the roof stay");
        let kept = |i: &usize| !after.values()[*i].is_nan();
        assert!((0..WINDOW.len()).filter(kept).all(|i| after.values()[i] == before.values()[i]));
    }

    #[test]
    fn a_window_with_the_margin_decides_alike() {
        let mut rng = Counter::new(11);
        let mut h = scene();
        for _ in 0..200 {
            let at = (rng.index(WINDOW.width), rng.index(WINDOW.height));
            h[at] += rng.range(-9.0, 9.0) as f32;
        }
        let params = DespikeParams { max_area: 0.4, min_height: 2.0 };
        let whole = despike(&h, &params);
        let core = GridWindow { x0: 25, y0: 22, width: 40, height: 33, ..WINDOW };
        let part = despike(&h.crop(core.grown(params.reach(0.2)), f32::NAN), &params).crop(core, 0.0);
        let same = whole.crop(core, 0.0);
        assert!(same.values().iter().zip(part.values()).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert!(same.values().iter().any(|v| v.is_nan()));
    }
}
