//! Triangulated terrain from a grid of heights, within an error tolerance.

use crate::Terrain;
use gable_geometry::DVec2;
use spade::handles::{FixedFaceHandle, InnerTag};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Heights that could not be triangulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TinError {
    /// Not as many heights as nodes.
    #[error("{values} heights for {width} × {height} nodes: give one for each")]
    Size {
        /// Heights given.
        values: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Fewer than two rows or columns, or more than 2^20.
    #[error("{width} × {height} nodes: a terrain needs 2 to 1048576 of them along each side")]
    Extent {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A height that is not finite.
    #[error("the height of column {column}, row {row} is not finite: fill holes of the terrain first")]
    Hole {
        /// Column.
        column: usize,
        /// Row.
        row: usize,
    },
    /// A cell or tolerance that is not a positive number.
    #[error("the cell is {cell} m and the tolerance {tolerance} m: both must be positive")]
    Parameter {
        /// Cell width.
        cell: f64,
        /// Tolerance.
        tolerance: f64,
    },
}

/// Triangulates a grid of heights so that at every node the surface is within `tolerance` metres of the height.
///
/// `values` are the heights of `width` × `height` **nodes**, row by row from the south, `cell` metres apart, the first
/// at `origin` (local metres). Neighbouring tiles must share the nodes of their common border.
///
/// Method: greedy insertion (Garland and Heckbert 1995, "Fast polygonal approximation of terrains and height
/// fields", algorithm III): starting from the border, the node with the largest error is inserted into a Delaunay
/// triangulation until none exceeds the tolerance; after each insertion only the triangles around the new node are
/// scanned. Departure: the border is simplified beforehand, each side for itself between the corners by the line
/// simplification of Douglas and Peucker with the same tolerance. What a border becomes therefore depends on its own
/// heights only, and two tiles that share it get the same vertices there: no cracks, whatever lies inside.
///
/// Vertices are in the order of the grid. Deterministic. O(n log n) for n nodes in practice.
///
/// # Errors
/// See [`TinError`].
pub fn tin_from_grid(
    id: &str,
    values: &[f64],
    width: usize,
    height: usize,
    cell: f64,
    origin: DVec2,
    tolerance: f64,
) -> Result<Terrain, TinError> {
    if !(2..=1 << 20).contains(&width) || !(2..=1 << 20).contains(&height) {
        return Err(TinError::Extent { width, height });
    }
    if values.len() != width * height {
        return Err(TinError::Size { values: values.len(), width, height });
    }
    if !(cell > 0.0 && cell.is_finite() && tolerance > 0.0 && tolerance.is_finite()) {
        return Err(TinError::Parameter { cell, tolerance });
    }
    if let Some(hole) = values.iter().position(|v| !v.is_finite()) {
        return Err(TinError::Hole { column: hole % width, row: hole / width });
    }
    let grid = Grid { values, width, height };
    let tin = grid.refine(tolerance);
    Ok(grid.terrain(id, &tin, cell, origin))
}

/// A node of the grid as a vertex.
#[derive(Clone, Copy)]
struct Node {
    column: i64,
    row: i64,
}

impl HasPosition for Node {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        Point2::new(self.column as f64, self.row as f64)
    }
}

type Tin = DelaunayTriangulation<Node>;
type Face = FixedFaceHandle<InnerTag>;

struct Grid<'a> {
    values: &'a [f64],
    width: usize,
    height: usize,
}

impl Grid<'_> {
    fn at(&self, node: Node) -> f64 {
        self.values[node.row as usize * self.width + node.column as usize]
    }

    /// Kept nodes of the border: the four sides between the corners, simplified.
    fn border(&self, tolerance: f64) -> Vec<Node> {
        let (right, top) = (self.width as i64 - 1, self.height as i64 - 1);
        let node = |column: i64, row: i64| Node { column, row };
        let mut kept = Vec::new();
        // Always from west to east and from south to north, so that neighbours decide alike.
        for row in [0, top] {
            let side: Vec<Node> = (0..=right).map(|column| node(column, row)).collect();
            kept.extend(self.simplified(&side, tolerance));
        }
        for column in [0, right] {
            let side: Vec<Node> = (0..=top).map(|row| node(column, row)).collect();
            let inner = self.simplified(&side, tolerance);
            kept.extend(&inner[1..inner.len() - 1]);
        }
        kept.sort_by_key(|n| (n.row, n.column));
        kept
    }

    /// Douglas–Peucker on the heights along a side: ends and what is needed to stay within the tolerance.
    fn simplified(&self, side: &[Node], tolerance: f64) -> Vec<Node> {
        let mut keep = vec![false; side.len()];
        let last = side.len() - 1;
        (keep[0], keep[last]) = (true, true);
        let mut open = vec![(0, last)];
        while let Some((a, b)) = open.pop() {
            let (za, zb) = (self.at(side[a]), self.at(side[b]));
            let error = |i: usize| (self.at(side[i]) - (za + (zb - za) * (i - a) as f64 / (b - a) as f64)).abs();
            let worst = (a + 1..b).map(|i| (error(i), i)).fold((tolerance, 0), |w, e| if e.0 > w.0 { e } else { w });
            if worst.1 > 0 {
                keep[worst.1] = true;
                open.extend([(a, worst.1), (worst.1, b)]);
            }
        }
        side.iter().zip(keep).filter(|(_, keep)| *keep).map(|(node, _)| *node).collect()
    }

    fn refine(&self, tolerance: f64) -> Tin {
        let mut tin = Tin::new();
        for node in self.border(tolerance) {
            // Nodes are different and small whole numbers: insertion cannot fail.
            let _ = tin.insert(node);
        }
        let mut versions: Vec<u32> = Vec::new();
        let mut heap = BinaryHeap::new();
        let scan = |tin: &Tin, face: Face, versions: &mut Vec<u32>, heap: &mut BinaryHeap<Candidate>| {
            if versions.len() <= face.index() {
                versions.resize(face.index() + 1, 0);
            }
            versions[face.index()] += 1;
            let corners = tin.face(face).vertices().map(|v| *v.data());
            if let Some((error, node)) = self.worst(corners, tolerance) {
                let place = Reverse((node.row, node.column));
                heap.push(Candidate { error, place, face, version: versions[face.index()] });
            }
        };
        let all: Vec<Face> = tin.inner_faces().map(|face| face.fix()).collect();
        for face in all {
            scan(&tin, face, &mut versions, &mut heap);
        }
        while let Some(Candidate { place: Reverse((row, column)), face, version, .. }) = heap.pop() {
            if versions[face.index()] != version {
                continue;
            }
            let Ok(vertex) = tin.insert(Node { column, row }) else { continue };
            // A new vertex of a Delaunay triangulation belongs to every triangle that changed.
            let changed: Vec<Face> =
                tin.vertex(vertex).out_edges().filter_map(|e| e.face().as_inner().map(|f| f.fix())).collect();
            for face in changed {
                scan(&tin, face, &mut versions, &mut heap);
            }
        }
        tin
    }

    /// The node inside a triangle (or on its edges, but not on the grid's border) whose height is farthest from the
    /// triangle's, if it is beyond the tolerance. Inside is decided in whole numbers.
    fn worst(&self, corners: [Node; 3], tolerance: f64) -> Option<(f64, Node)> {
        let [a, b, c] = corners;
        let cross = |p: Node, q: Node, r: Node| {
            (q.column - p.column) * (r.row - p.row) - (q.row - p.row) * (r.column - p.column)
        };
        let double = cross(a, b, c);
        if double <= 0 {
            return None;
        }
        let range = |pick: fn(&Node) -> i64, top: usize| {
            let low = corners.iter().map(pick).min().unwrap_or(0).max(1);
            let high = corners.iter().map(pick).max().unwrap_or(0).min(top as i64 - 2);
            low..=high
        };
        let (za, zb, zc) = (self.at(a), self.at(b), self.at(c));
        let mut worst: Option<(f64, Node)> = None;
        for row in range(|n| n.row, self.height) {
            let mut entered = false;
            for column in range(|n| n.column, self.width) {
                let node = Node { column, row };
                let (u, v, w) = (cross(b, c, node), cross(c, a, node), cross(a, b, node));
                if u < 0 || v < 0 || w < 0 {
                    if entered {
                        break;
                    }
                    continue;
                }
                entered = true;
                let plane = (u as f64 * za + v as f64 * zb + w as f64 * zc) / double as f64;
                let error = (self.at(node) - plane).abs();
                if error > worst.map_or(tolerance, |w| w.0) {
                    worst = Some((error, node));
                }
            }
        }
        worst
    }

    fn terrain(&self, id: &str, tin: &Tin, cell: f64, origin: DVec2) -> Terrain {
        let mut nodes: Vec<Node> = tin.vertices().map(|v| *v.data()).collect();
        nodes.sort_by_key(|n| (n.row, n.column));
        let place = |n: &Node| (origin + DVec2::new(n.column as f64, n.row as f64) * cell).extend(self.at(*n));
        let index = |n: &Node| nodes.partition_point(|m| (m.row, m.column) < (n.row, n.column)) as u32;
        let mut triangles: Vec<[u32; 3]> = tin
            .inner_faces()
            .map(|face| {
                let [a, b, c] = face.vertices().map(|v| index(v.data()));
                // The lowest corner first, so that the order is that of the vertices.
                if a < b && a < c {
                    [a, b, c]
                } else if b < c {
                    [b, c, a]
                } else {
                    [c, a, b]
                }
            })
            .collect();
        triangles.sort_unstable();
        Terrain { id: id.to_owned(), vertices: nodes.iter().map(place).collect(), triangles }
    }
}

/// A node to insert: largest error first, then the first in the grid.
#[derive(Clone, Copy)]
struct Candidate {
    error: f64,
    place: Reverse<(i64, i64)>,
    face: Face,
    version: u32,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.error
            .total_cmp(&other.error)
            .then(self.place.cmp(&other.place))
            .then(self.face.index().cmp(&other.face.index()))
            .then(self.version.cmp(&other.version))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Counter, DVec3, dvec2};
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Hills with a terrace and noise.
    fn hills(width: usize, height: usize, seed: u64) -> Vec<f64> {
        let mut random = Counter::new(seed);
        let node = |i: usize| ((i % width) as f64, (i / width) as f64);
        (0..width * height)
            .map(node)
            .map(|(x, y)| {
                let terrace = if x + 0.3 * y > 0.6 * width as f64 { 2.0 } else { 0.0 };
                3.0 * (x / 7.0).sin() + 2.0 * (y / 5.0).cos() + terrace + random.range(-0.05, 0.05)
            })
            .collect()
    }

    /// Height of the surface by testing every triangle.
    fn surface(tin: &Terrain, x: f64, y: f64) -> Option<f64> {
        tin.triangles.iter().find_map(|t| {
            let [a, b, c] = t.map(|i| tin.vertices[i as usize]);
            let cross = |p: DVec3, q: DVec3| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
            let weights = [cross(b, c), cross(c, a), cross(a, b)];
            let sum: f64 = weights.iter().sum();
            assert!(sum > 0.0, "counter-clockwise from above");
            let inside = weights.iter().all(|w| *w >= -1e-9 * sum);
            inside.then(|| (weights[0] * a.z + weights[1] * b.z + weights[2] * c.z) / sum)
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn every_node_is_within_the_tolerance(w in 2..40usize, h in 2..40usize, seed in 0..1000u64, tol in 0.02..2.0f64) {
            let values = hills(w, h, seed);
            let tin = tin_from_grid("t", &values, w, h, 2.0, dvec2(-10.0, 4.0), tol).unwrap();
            for i in 0..w * h {
                let (x, y) = (-10.0 + 2.0 * (i % w) as f64, 4.0 + 2.0 * (i / w) as f64);
                let z = surface(&tin, x, y);
                prop_assert!(z.is_some_and(|z| (z - values[i]).abs() <= tol + 1e-9), "{i}: {z:?} {}", values[i]);
            }
            let area: f64 = tin.triangles.iter().map(|t| t.map(|i| tin.vertices[i as usize].truncate()))
                .map(|[a, b, c]| 0.5 * (b - a).perp_dot(c - a)).sum();
            prop_assert!((area - 4.0 * ((w - 1) * (h - 1)) as f64).abs() < 1e-6);
        }
    }

    #[test]
    fn neighbours_share_their_border() {
        let (w, h) = (61, 41);
        let all = hills(w, h, 7);
        let cut = |from: usize, to: usize| -> Vec<f64> {
            (0..h).flat_map(|row| all[row * w + from..=row * w + to].to_vec()).collect()
        };
        let west = tin_from_grid("w", &cut(0, 30), 31, h, 2.0, dvec2(0.0, 0.0), 0.2).unwrap();
        let east = tin_from_grid("e", &cut(30, 60), 31, h, 2.0, dvec2(60.0, 0.0), 0.2).unwrap();
        let border = |tin: &Terrain| -> BTreeSet<[u64; 3]> {
            let on = tin.vertices.iter().filter(|v| v.x == 60.0);
            on.map(|v| v.to_array().map(f64::to_bits)).collect()
        };
        assert_eq!(border(&west), border(&east));
        assert!(border(&west).len() > 5 && border(&west).len() < h);
        // It is a simplification.
        assert!(west.vertices.len() < 31 * h / 2, "{}", west.vertices.len());
    }

    #[test]
    fn a_plane_needs_two_triangles() {
        let values: Vec<f64> = (0..30 * 20).map(|i| 0.25 * (i % 30) as f64 - 0.5 * (i / 30) as f64).collect();
        let tin = tin_from_grid("t", &values, 30, 20, 2.0, dvec2(0.0, 0.0), 0.01).unwrap();
        assert_eq!((tin.vertices.len(), tin.triangles.len()), (4, 2));
    }

    #[test]
    fn nonsense_is_refused() {
        let at = dvec2(0.0, 0.0);
        let make = |values: &[f64], w, h, cell, tol| tin_from_grid("t", values, w, h, cell, at, tol).unwrap_err();
        assert_eq!(make(&[1.0; 3], 2, 2, 1.0, 0.1), TinError::Size { values: 3, width: 2, height: 2 });
        assert_eq!(make(&[1.0; 2], 1, 2, 1.0, 0.1), TinError::Extent { width: 1, height: 2 });
        assert_eq!(make(&[1.0, f64::NAN, 1.0, 1.0], 2, 2, 1.0, 0.1), TinError::Hole { column: 1, row: 0 });
        assert!(matches!(make(&[1.0; 4], 2, 2, 0.0, 0.1), TinError::Parameter { .. }));
        assert!(matches!(make(&[1.0; 4], 2, 2, 1.0, f64::NAN), TinError::Parameter { .. }));
    }
}
