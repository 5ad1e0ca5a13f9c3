//! How colourful a flight is, and its photographs brought to one measure.

use gable_raster::Raster;
use serde::{Deserialize, Serialize};

/// Share of a city's pixels that are less green than the mark.
const SHARE: f64 = 0.95;

/// Green excess to which the mark is brought.
const TARGET: f64 = 0.25;

/// Bounds of the factor: a city without a plant must not be painted green.
const FACTOR: [f64; 2] = [0.6, 3.0];

/// Bins of the green excess, from −1 to 2.
const BINS: usize = 600;

/// Every n-th pixel of the lattice in both directions is counted.
const STRIDE: i64 = 4;

/// The green excess (2G − R − B) / (R + G + B) of the pixels of a city (Woebbecke et al. 1995), counted.
///
/// Haze, exposure and the compression of textures take from 0 to 70 % of the colour of leaves: the crowns of one city
/// are as grey as the roofs of another. What stays is that plants are the greenest things in sight. Counts of pixels at
/// fixed places of the lattice do not depend on how the city is cut or in which order its parts come.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GreenExcess {
    counts: Vec<u64>,
}

impl Default for GreenExcess {
    fn default() -> Self {
        Self { counts: vec![0; BINS] }
    }
}

impl GreenExcess {
    /// Takes in the photographed pixels of a raster.
    pub fn accumulate(&mut self, colour: &Raster<[u8; 3]>, photographed: &Raster<bool>) {
        let window = colour.window();
        let first = |origin: i64| (-origin).rem_euclid(STRIDE) as usize;
        for y in (first(window.y0)..window.height).step_by(STRIDE as usize) {
            for x in (first(window.x0)..window.width).step_by(STRIDE as usize) {
                let [r, g, b] = colour[(x, y)].map(i64::from);
                let sum = r + g + b;
                // The colour of what is nearly black is noise.
                if photographed[(x, y)] && sum >= 60 {
                    let bin = ((2 * g - r - b + sum) * (BINS as i64 / 3) / sum) as usize;
                    self.counts[bin.min(BINS - 1)] += 1;
                }
            }
        }
    }

    /// Takes in another count.
    pub fn merge(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
    }

    /// The factor by which colours are to be driven away from grey; 1 if nothing was counted.
    #[must_use]
    pub fn saturation(&self) -> f32 {
        let wanted = (self.counts.iter().sum::<u64>() as f64 * SHARE) as u64;
        let mut seen = 0;
        for (bin, count) in self.counts.iter().enumerate() {
            seen += count;
            if *count > 0 && seen >= wanted {
                let excess = (bin as f64 + 0.5) * 3.0 / BINS as f64 - 1.0;
                return (TARGET / excess.max(1e-3)).clamp(FACTOR[0], FACTOR[1]) as f32;
            }
        }
        1.0
    }
}

/// Drives colours away from the grey of the same brightness by a factor, or towards it.
#[must_use]
pub fn saturated(colour: &Raster<[u8; 3]>, factor: f32) -> Raster<[u8; 3]> {
    colour.map(|rgb| {
        let [r, g, b] = rgb.map(f32::from);
        let grey = (r + g + b) / 3.0;
        [r, g, b].map(|c| (grey + factor * (c - grey)).round().clamp(0.0, 255.0) as u8)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::Counter;
    use gable_raster::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: -37, y0: 11, width: 120, height: 90 };

    // Grey ground, and leaves on a fifth of it.
    fn scene(leaf: [u8; 3]) -> Raster<[u8; 3]> {
        let mut random = Counter::new(3);
        Raster::filled(WINDOW, ()).map(|()| if random.unit() < 0.2 { leaf } else { [120, 118, 116] })
    }

    fn seen(colour: &Raster<[u8; 3]>) -> GreenExcess {
        let mut found = GreenExcess::default();
        found.accumulate(colour, &Raster::filled(colour.window(), true));
        found
    }

    #[test]
    fn hazy_and_vivid_leaves_come_out_alike() {
        for leaf in [[66, 72, 60], [66, 94, 42], [60, 80, 50]] {
            let colour = scene(leaf);
            let same = saturated(&colour, seen(&colour).saturation());
            let after = seen(&same).saturation();
            assert!((after - 1.0).abs() < 0.1, "{leaf:?}: {after}");
        }
        let bare = Raster::filled(WINDOW, [120, 118, 116]);
        assert!((seen(&bare).saturation() - 3.0).abs() < 1e-6, "no more than the bound");
        assert!((GreenExcess::default().saturation() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn counts_do_not_depend_on_the_cut() {
        let colour = scene([66, 94, 42]);
        let mut parts = GreenExcess::default();
        for (x0, width) in [(50, 33), (-37, 87)] {
            let part = colour.crop(GridWindow { x0, width, ..WINDOW }, [0; 3]);
            parts.accumulate(&part, &Raster::filled(part.window(), true));
        }
        assert_eq!(parts, seen(&colour));
        let mut twice = parts.clone();
        twice.merge(&parts);
        parts.accumulate(&colour, &Raster::filled(colour.window(), true));
        assert_eq!(parts, twice);
    }
}
