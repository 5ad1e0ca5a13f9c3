//! Files that cover the same place: two models of it, of which one should be given.

use gable_geometry::DVec3;
use std::path::{Path, PathBuf};

/// Share of the plan that two files have in common, of what they cover together, from which on they are taken for the same place.
const SAME: f64 = 0.8;
/// Comparisons at most: tiles lie beside each other, and few have to be compared.
const COMPARISONS: usize = 20_000_000;

/// The plans of the files of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plans {
    files: Vec<Plan>,
}

#[derive(Clone, Debug)]
struct Plan {
    path: PathBuf,
    min: DVec3,
    max: DVec3,
}

impl Plans {
    /// What comes now is in this file.
    pub(crate) fn begin(&mut self, path: &Path) {
        self.files.push(Plan { path: path.to_owned(), min: DVec3::INFINITY, max: DVec3::NEG_INFINITY });
    }

    /// Takes a triangle of the file.
    #[inline]
    pub(crate) fn add(&mut self, corners: &[DVec3; 3]) {
        if let Some(file) = self.files.last_mut() {
            let [a, b, c] = *corners;
            file.min = file.min.min(a).min(b).min(c);
            file.max = file.max.max(a).max(b).max(c);
        }
    }

    /// Pairs of files that cover the same place, in the order of the files.
    pub(crate) fn overlapping(&self) -> Vec<[&Path; 2]> {
        let mut order: Vec<usize> =
            (0..self.files.len()).filter(|&i| self.files[i].min.x <= self.files[i].max.x).collect();
        order.sort_by(|&a, &b| self.files[a].min.x.total_cmp(&self.files[b].min.x).then(a.cmp(&b)));
        let (mut pairs, mut left) = (Vec::new(), COMPARISONS);
        for (at, &i) in order.iter().enumerate() {
            for &j in &order[at + 1..] {
                if self.files[j].min.x > self.files[i].max.x || left == 0 {
                    break;
                }
                left -= 1;
                if common(&self.files[i], &self.files[j]) > SAME {
                    pairs.push([i.min(j), i.max(j)]);
                }
            }
        }
        pairs.sort_unstable();
        pairs.into_iter().map(|pair| pair.map(|i| self.files[i].path.as_path())).collect()
    }
}

/// The common part of two plans, as a share of what they cover together.
fn common(a: &Plan, b: &Plan) -> f64 {
    let area = |min: DVec3, max: DVec3| (max.x - min.x).max(0.0) * (max.y - min.y).max(0.0);
    let both = area(a.min.max(b.min), a.max.min(b.max));
    let all = area(a.min, a.max) + area(b.min, b.max) - both;
    if all > 0.0 { both / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec3;

    fn pairs(boxes: &[[f64; 4]]) -> Vec<[String; 2]> {
        let mut plans = Plans::default();
        for (i, [west, south, east, north]) in boxes.iter().enumerate() {
            plans.begin(Path::new(&i.to_string()));
            plans.add(&[dvec3(*west, *south, 0.0), dvec3(*east, *south, 9.0), dvec3(*west, *north, 0.0)]);
        }
        plans.begin(Path::new("empty"));
        plans.overlapping().into_iter().map(|pair| pair.map(|p| p.display().to_string())).collect()
    }

    #[test]
    fn only_the_same_place_is_said() {
        let tiles = [[0., 0., 100., 100.], [98., 0., 200., 100.], [0., 98., 100., 200.], [98., 98., 200., 200.]];
        assert!(pairs(&tiles).is_empty());
        let twice = [[0., 0., 100., 100.], [98., 0., 200., 100.], [0.5, 0., 100., 99.]];
        assert_eq!(pairs(&twice), [["0".to_owned(), "2".to_owned()]]);
        // A house on its ground.
        assert!(pairs(&[[0., 0., 100., 100.], [40., 40., 60., 60.]]).is_empty());
    }
}
