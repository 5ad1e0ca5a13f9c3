//! Cleaning of the building label: opening and closing, holes, and regions that cannot be buildings.

use gable_raster::{Component, Components, Connectivity, Raster, close, components, open};

use crate::Label;
use crate::stumps::Plants;

/// What is cleaned, all in metres and square metres. Zero switches a step off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CleanupParams {
    /// Radius of the disc of the opening that breaks weak connections, metres (Zhu 2018, §4.2; no figure there).
    pub opening: f64,
    /// Radius of the disc of the closing that fills small gaps, metres (as above).
    pub closing: f64,
    /// Whether gaps at ground level stay open.
    pub keeps_gaps: bool,
    /// Holes in a building up to this area become building, m².
    pub hole_area: f64,
    /// Regions of building below this area are none, m².
    pub building_area: f64,
    /// Regions of building whose 90th percentile of height over the terrain is below this are none, metres.
    pub building_height: f64,
    /// Regions of tree up to this area that a building encloses on most sides become building, m²: plants, dormers and
    /// noise on roofs.
    pub roof_tree_area: f64,
    /// Regions of building whose mean tree probability exceeds this are trees.
    pub building_tree_share: f64,
}

/// What lies lower over the terrain is at ground level, metres.
const GROUND_LEVEL: f32 = 1.0;

impl Default for CleanupParams {
    fn default() -> Self {
        Self {
            opening: 0.5,
            closing: 0.5,
            keeps_gaps: true,
            hole_area: 6.0,
            building_area: 10.0,
            building_height: 2.2,
            roof_tree_area: 12.0,
            building_tree_share: 0.6,
        }
    }
}

impl CleanupParams {
    /// Only what the paper names: opening and closing.
    #[must_use]
    pub fn zhu2018() -> Self {
        Self {
            hole_area: 0.0,
            building_area: 0.0,
            building_height: 0.0,
            roof_tree_area: 0.0,
            building_tree_share: 1.0,
            keeps_gaps: false,
            ..Self::default()
        }
    }
}

/// Cleans a label raster in place.
///
/// `above` is the height over the terrain (NaN: no data), `plants` the probabilities of plants. Regions that touch the border of
/// the raster are not judged by area or height, as they may go on beyond. O(pixels).
pub fn clean_buildings(labels: &mut Raster<u8>, above: &Raster<f32>, plants: &Plants, params: &CleanupParams) {
    let area = labels.window().step.powi(2);
    absorb_roof_trees(labels, params.roof_tree_area / area);
    open_and_close(labels, above, plants, params);
    fill_holes(labels, params.hole_area / area);
    drop_regions(labels, above, plants, params);
}

fn open_and_close(labels: &mut Raster<u8>, above: &Raster<f32>, plants: &Plants, params: &CleanupParams) {
    let (width, height, step) = (labels.width(), labels.height(), labels.window().step);
    let mask: Vec<bool> = labels.values().iter().map(|l| *l == Label::Building as u8).collect();
    let opened = open(&mask, width, height, (params.opening / step) as f32);
    let closed = close(&opened, width, height, (params.closing / step) as f32);
    for (i, label) in labels.values_mut().iter_mut().enumerate() {
        // A gap that leads down to the ground is none, however narrow.
        let open = params.keeps_gaps && !mask[i] && above.values()[i] < GROUND_LEVEL;
        if closed[i] && !open {
            *label = Label::Building as u8;
        } else if mask[i] {
            *label = without_building(above.values()[i], plants, i);
        }
    }
}

// The class of a pixel that is no building after all.
fn without_building(above: f32, plants: &Plants, i: usize) -> u8 {
    let likely = |p: &Raster<f32>| p.values()[i] > 0.5;
    match above > 2.0 {
        true if likely(&plants.tree) => Label::Tree as u8,
        false if likely(plants.grass()) => Label::Grass as u8,
        _ => Label::Ground as u8,
    }
}

// Small tree regions whose border is mostly building become building.
fn absorb_roof_trees(labels: &mut Raster<u8>, pixels: f64) {
    let (width, height) = (labels.width(), labels.height());
    let Components { numbers, list: regions } =
        components(labels, Connectivity::Four, |label| *label == Label::Tree as u8);
    for region in regions.iter().filter(|r| r.pixels as f64 <= pixels && !r.touches_border(width, height)) {
        let (mut building, mut all) = (0, 0);
        for_border(&numbers, region, |i| {
            all += 1;
            building += usize::from(labels.values()[i] == Label::Building as u8);
        });
        if building * 4 > all * 3 {
            relabel(labels, &numbers, region, |_| Label::Building as u8);
        }
    }
}

fn fill_holes(labels: &mut Raster<u8>, pixels: f64) {
    if pixels <= 0.0 {
        return;
    }
    let (width, height) = (labels.width(), labels.height());
    let Components { numbers, list: regions } =
        components(labels, Connectivity::Four, |label| *label != Label::Building as u8);
    for region in regions.iter().filter(|r| r.pixels as f64 <= pixels && !r.touches_border(width, height)) {
        relabel(labels, &numbers, region, |_| Label::Building as u8);
    }
}

fn drop_regions(labels: &mut Raster<u8>, above: &Raster<f32>, plants: &Plants, params: &CleanupParams) {
    let (width, height) = (labels.width(), labels.height());
    let least = params.building_area / labels.window().step.powi(2);
    let Components { numbers, list: regions } =
        components(labels, Connectivity::Four, |label| *label == Label::Building as u8);
    let mut heights = Vec::new();
    for region in regions.iter().filter(|r| !r.touches_border(width, height)) {
        heights.clear();
        let mut trees = 0.0;
        for_pixels(&numbers, region, |i| {
            trees += f64::from(plants.tree.values()[i]);
            if !above.values()[i].is_nan() {
                heights.push(above.values()[i]);
            }
        });
        let high = heights.len() * 9 / 10;
        let high = if heights.is_empty() { 0.0 } else { *heights.select_nth_unstable_by(high, f32::total_cmp).1 };
        let leafy = trees / region.pixels as f64 > params.building_tree_share;
        if leafy {
            relabel(labels, &numbers, region, |_| Label::Tree as u8);
        } else if (region.pixels as f64) < least || f64::from(high) < params.building_height {
            relabel(labels, &numbers, region, |i| without_building(above.values()[i], plants, i));
        }
    }
}

fn for_pixels(numbers: &Raster<u32>, region: &Component, mut f: impl FnMut(usize)) {
    for y in region.y0..region.y1 {
        for x in region.x0..region.x1 {
            let i = y * numbers.width() + x;
            if numbers.values()[i] == region.id {
                f(i);
            }
        }
    }
}

// The pixels beside a region, once for each side that they share with it. The region must not touch the border.
fn for_border(numbers: &Raster<u32>, region: &Component, mut f: impl FnMut(usize)) {
    let width = numbers.width();
    for_pixels(numbers, region, |i| {
        for j in [i - 1, i + 1, i - width, i + width] {
            if numbers.values()[j] != region.id {
                f(j);
            }
        }
    });
}

fn relabel(labels: &mut Raster<u8>, numbers: &Raster<u32>, region: &Component, label: impl Fn(usize) -> u8) {
    let values = labels.values_mut();
    for_pixels(numbers, region, |i| values[i] = label(i));
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_raster::GridWindow;

    const WINDOW: GridWindow = GridWindow { step: 0.2, x0: 0, y0: 0, width: 200, height: 150 };

    fn paint(raster: &mut Raster<u8>, x: std::ops::Range<usize>, y: std::ops::Range<usize>, label: Label) {
        for row in y {
            for column in x.clone() {
                raster[(column, row)] = label as u8;
            }
        }
    }

    #[test]
    fn cars_go_houses_stay_and_courtyards_stay_open() {
        let mut labels = Raster::filled(WINDOW, Label::Ground as u8);
        let mut above = Raster::filled(WINDOW, 0.0_f32);
        let plants = Plants { tree: Raster::filled(WINDOW, 0.1_f32), low: None };
        // A house of 20 × 16 m with a courtyard of 4 × 4 m, a chimney hole and a plant on the roof.
        paint(&mut labels, 20..120, 30..110, Label::Building);
        paint(&mut labels, 60..80, 60..80, Label::Ground);
        paint(&mut labels, 30..34, 40..44, Label::Ground);
        paint(&mut labels, 100..108, 90..98, Label::Tree);
        // A car of 4 × 2 m and a low table of 6 × 4 m.
        paint(&mut labels, 140..160, 30..40, Label::Building);
        paint(&mut labels, 140..170, 60..80, Label::Building);
        for (z, label) in above.values_mut().iter_mut().zip(labels.values()) {
            *z = if *label == Label::Building as u8 { 6.0 } else { 0.0 };
        }
        for row in 60..80 {
            for column in 140..170 {
                above[(column, row)] = 1.8;
            }
        }
        clean_buildings(&mut labels, &above, &plants, &CleanupParams::default());
        assert_eq!(labels[(70, 70)], Label::Ground as u8);
        assert_eq!(labels[(31, 41)], Label::Building as u8);
        assert_eq!(labels[(104, 94)], Label::Building as u8);
        assert_eq!(labels[(150, 35)], Label::Ground as u8);
        assert_eq!(labels[(150, 70)], Label::Ground as u8);
        // The corners of the house keep their place to within the opening's rounding.
        assert_eq!(labels[(21, 31)], Label::Building as u8);
        let pixels = labels.values().iter().filter(|l| **l == Label::Building as u8).count();
        assert!((pixels as i64 - (100 * 80 - 400)).abs() < 40, "{pixels}");
    }

    #[test]
    fn a_region_at_the_border_is_not_judged() {
        let mut labels = Raster::filled(WINDOW, Label::Ground as u8);
        paint(&mut labels, 0..8, 40..60, Label::Building);
        let above = Raster::filled(WINDOW, 5.0_f32);
        let plants = Plants { tree: Raster::filled(WINDOW, 0.0), low: None };
        clean_buildings(&mut labels, &above, &plants, &CleanupParams::default());
        assert_eq!(labels[(3, 50)], Label::Building as u8);
    }
}
