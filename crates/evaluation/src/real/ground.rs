//! The terrain of a result against the surface of the mesh where a person sees ground.

use super::scene::{Known, RealScene};
use crate::height_raster::HeightRaster;
use crate::statistics::{mean, median, ratio};
use gable_city_model::Terrain;
use gable_geometry::{Box2, DVec3, dvec2};
use serde::{Deserialize, Serialize};

/// Edge of the cells that heights are taken from, metres.
const CELL: f64 = 1.0;

/// A cell counts if at least as much of it is ground with a surface, m².
const LEAST: f64 = 0.5;

/// Neighbours that a cell is compared with, cells.
const REACH: i64 = 3;

/// A cell that stands higher above a neighbour than this, metres, and this for each metre between them, is not ground: a car, a
/// bush, a lamp.
const STEP_UP: f64 = 0.3;
const SLOPE: f64 = 0.6;

/// Heights of a terrain minus those of the ground.
///
/// The ground is known in cells of 1 m on the absolute lattice, of which at least half is `ground`, `grass` or `open`: the median of
/// the surface's heights there, unless it stands by more than 0.3 m + 0.6 m for each metre over a ground cell within 3 m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GroundFit {
    /// Cells.
    pub cells: usize,
    /// Share of them where the terrain is missing; these are in none of the other figures.
    pub missing: f64,
    /// Root of the mean square, metres.
    pub rms: f64,
    /// Mean, metres; below 0 if the terrain is too low.
    pub mean: f64,
    /// What 99 % of the absolute values do not exceed (nearest rank), metres.
    pub worst_percent: f64,
}

/// Heights of the ground by cell, row by row from the south-western cell.
pub(crate) struct GroundCells {
    x0: i64,
    y0: i64,
    width: usize,
    pub(crate) heights: Vec<Option<f64>>,
}

impl GroundCells {
    pub(crate) fn new(scene: &RealScene) -> Self {
        let r = &scene.surface;
        // The cells that pixel centres lie in, and the pixels of the cells along an axis.
        let cell = |first: i64, k: usize| (((first + k as i64) as f64 + 0.5) * r.step / CELL).floor() as i64;
        let axis = |first: i64, count: usize| {
            let start = cell(first, 0);
            let mut ranges: Vec<std::ops::Range<usize>> = Vec::new();
            for k in 0..count {
                let at = (cell(first, k) - start) as usize;
                ranges.resize(ranges.len().max(at + 1), k..k);
                ranges[at].end = k + 1;
            }
            (start, ranges)
        };
        let ((x0, columns), (y0, rows)) = (axis(r.x0, r.width), axis(r.y0, r.height));
        let mut heights = Vec::with_capacity(columns.len() * rows.len());
        for rows in rows {
            for columns in &columns {
                let mut inside = Vec::new();
                for row in rows.clone() {
                    for at in columns.clone().map(|column| row * r.width + column) {
                        if matches!(scene.known[at], Known::Drawn(class) if class.is_open_ground()) {
                            inside.push(r.z[at]);
                        }
                    }
                }
                heights.push((scene.area(inside.len()) >= LEAST).then(|| median(inside)));
            }
        }
        let mut cells = Self { x0, y0, width: columns.len(), heights };
        cells.heights = (0..cells.heights.len()).map(|at| cells.ground_at(at)).collect();
        cells
    }

    /// The height of a cell, unless it stands like a step over one around it.
    fn ground_at(&self, at: usize) -> Option<f64> {
        let height = self.heights[at]?;
        let (x, y) = ((at % self.width) as i64, (at / self.width) as i64);
        let rows = (self.heights.len() / self.width) as i64;
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                let distance = ((dx * dx + dy * dy) as f64).sqrt();
                let (column, row) = (x + dx, y + dy);
                let inside = column >= 0 && row >= 0 && column < self.width as i64 && row < rows;
                if !inside || distance > REACH as f64 {
                    continue;
                }
                let other = self.heights[row as usize * self.width + column as usize];
                if other.is_some_and(|low| height - low > STEP_UP + SLOPE * distance * CELL) {
                    return None;
                }
            }
        }
        Some(height)
    }
}

/// `shift` is added to the coordinates of the terrain.
pub(crate) fn ground_fit(scene: &RealScene, terrain: Option<&Terrain>, shift: DVec3) -> GroundFit {
    let cells = GroundCells::new(scene);
    let rows = cells.heights.len() / cells.width.max(1);
    let corner = dvec2(cells.x0 as f64, cells.y0 as f64) * CELL;
    let bounds = Box2 { min: corner, max: corner + dvec2(cells.width as f64, rows as f64) * CELL };
    // One pixel is one cell, and stands for its centre.
    let mut drawn = HeightRaster::covering(bounds, CELL);
    if let Some(terrain) = terrain {
        drawn.draw_terrain(terrain, shift);
    }
    let (mut errors, mut missing) = (Vec::new(), 0_usize);
    for (at, height) in cells.heights.iter().enumerate() {
        let Some(height) = height else { continue };
        let centre = corner + (dvec2((at % cells.width) as f64, (at / cells.width) as f64) + 0.5) * CELL;
        match drawn.at(centre) {
            Some(z) => errors.push(z - height),
            None => missing += 1,
        }
    }
    let count = errors.len();
    let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let rank = ((0.99 * count as f64).ceil() as usize).saturating_sub(1);
    GroundFit {
        cells: count + missing,
        missing: ratio(missing as f64, (count + missing) as f64),
        rms: mean(errors.iter().map(|e| e * e)).sqrt(),
        mean: mean(errors),
        worst_percent: sizes.get(rank).copied().unwrap_or(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::super::outlines::tests::{collection, rectangle};
    use super::super::scene::tests::slab;
    use super::*;
    use gable_geometry::dvec3;

    fn terrain(z: [f64; 4]) -> Terrain {
        let corners = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)];
        let vertices = corners.iter().zip(z).map(|(&(x, y), z)| dvec3(x, y, z)).collect();
        Terrain { id: String::new(), vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    /// Ground of 10 m × 10 m that rises by 0.4 m for each metre, with a box of 2 m × 1 m on it.
    fn scene() -> RealScene {
        let outlines = collection(&[
            rectangle("open", "", [0.0, 0.0, 10.0, 10.0]),
            rectangle("unsure", "", [0.0, 0.0, 10.0, 1.6]),
        ]);
        let mut mesh = slab([0.0, 0.0, 10.0, 10.0], 5.0, 0.4).to_vec();
        mesh.extend(slab([4.0, 5.0, 6.0, 6.0], 9.0, 0.0));
        RealScene::new(outlines, &mesh).unwrap()
    }

    #[test]
    fn heights_are_those_of_the_lowest_surface_around() {
        let cells = GroundCells::new(&scene());
        assert_eq!((cells.x0, cells.y0, cells.width, cells.heights.len()), (0, 0, 10, 100));
        let at = |x: usize, y: usize| cells.heights[10 * y + x];
        assert_eq!((at(3, 0), at(3, 1)), (None, None), "of the second row four tenths are ground");
        assert!((at(3, 2).unwrap() - (5.0 + 0.4 * 3.5)).abs() < 1e-6, "{:?}", at(3, 2));
        assert_eq!((at(4, 5), at(5, 5)), (None, None), "the box is no ground");
        assert_eq!(cells.heights.iter().flatten().count(), 78);
    }

    #[test]
    fn errors_of_a_hand_calculation() {
        let scene = scene();
        // 0.5 m too low everywhere.
        let fit = ground_fit(&scene, Some(&terrain([4.5, 8.5, 8.5, 4.5])), DVec3::ZERO);
        assert_eq!((fit.cells, fit.missing), (78, 0.0));
        for (found, wanted) in [(fit.rms, 0.5), (fit.mean, -0.5), (fit.worst_percent, 0.5)] {
            assert!((found - wanted).abs() < 1e-6, "{fit:?}");
        }
        // Moved east by 5 m and up by 2 m: the western half is missing, and the rest 0 m off where the slope gives what is added.
        let fit = ground_fit(&scene, Some(&terrain([5.0, 9.0, 9.0, 5.0])), dvec3(5.0, 0.0, 2.0));
        assert_eq!((fit.cells, fit.missing), (78, 39.0 / 78.0));
        assert!(fit.rms < 1e-6, "{fit:?}");
        let none = ground_fit(&scene, None, DVec3::ZERO);
        assert_eq!((none.cells, none.missing, none.rms), (78, 1.0, 0.0));
    }

    #[test]
    fn one_cell_of_a_hundred_is_the_worst_percent() {
        let outlines = collection(&[rectangle("ground", "", [0.0, 0.0, 10.0, 10.0])]);
        let scene = RealScene::new(outlines, &slab([0.0, 0.0, 10.0, 10.0], 0.0, 0.0)).unwrap();
        // Rises from 0 to 1 m, so that columns are off by 0.05, 0.15, …, 0.95 m; 99 of 100 do not exceed 0.95.
        let fit = ground_fit(&scene, Some(&terrain([0.0, 1.0, 1.0, 0.0])), DVec3::ZERO);
        assert!((fit.mean - 0.5).abs() < 1e-6 && (fit.worst_percent - 0.95).abs() < 1e-6, "{fit:?}");
        assert!((fit.rms - (0.3325_f64).sqrt()).abs() < 1e-6, "{fit:?}");
    }
}
