//! What a method of reconstruction finds: the footprint in regions, each with its roof plane.

use crate::partition::{Edge, Partition, Region};
use gable_geometry::{DVec2, Plane, Polygon};
use std::collections::BTreeMap;

/// The footprint of a building cut into regions, each with the plane of its roof, local metres.
#[derive(Clone, Debug)]
pub struct RoofPartition {
    pub(crate) partition: Partition,
    pub(crate) planes: Vec<Plane>,
    /// How it is simpler than the building, and why; `None` if it is not.
    pub(crate) note: Option<String>,
}

impl RoofPartition {
    /// From polygons that do not overlap, each with its plane. Neighbours share their corners exactly; a corner of one on an
    /// edge of the other is a corner of both. O(corners · log corners).
    #[must_use]
    pub fn of_polygons(polygons: &[(Polygon, Plane)]) -> Self {
        let mut corners: BTreeMap<[u64; 2], u32> = BTreeMap::new();
        let mut partition = Partition { vertices: Vec::new(), edges: Vec::new(), regions: polygons.len() };
        for (region, (polygon, _)) in polygons.iter().enumerate() {
            for ring in std::iter::once(&polygon.outer).chain(&polygon.holes) {
                let first = partition.edges.len();
                let mut numbers = Vec::with_capacity(ring.len());
                for corner in ring {
                    numbers.push(number_of(*corner, &mut corners, &mut partition.vertices));
                }
                for (i, &from) in numbers.iter().enumerate() {
                    let following = (i + 1) % numbers.len();
                    partition.edges.push(Edge { from, to: numbers[following], region, next: first + following });
                }
            }
        }
        let planes = polygons.iter().map(|(_, plane)| *plane).collect();
        Self { partition, planes, note: None }
    }

    /// The same with a remark on how it is simpler than the building.
    #[must_use]
    pub fn with_note(self, note: impl Into<String>) -> Self {
        Self { note: Some(note.into()), ..self }
    }

    /// Groups of the regions apart, each in the order given.
    pub(crate) fn parts(&self, groups: &[Vec<Region>]) -> Vec<Self> {
        let parts = groups.iter().zip(self.partition.parts(groups));
        parts
            .map(|(regions, partition)| Self {
                partition,
                planes: regions.iter().map(|&r| self.planes[r]).collect(),
                note: self.note.clone(),
            })
            .collect()
    }
}

/// The number of a corner, a new one if it has none.
fn number_of(corner: DVec2, corners: &mut BTreeMap<[u64; 2], u32>, vertices: &mut Vec<DVec2>) -> u32 {
    // Zero has two signs.
    let key = [(corner.x + 0.0).to_bits(), (corner.y + 0.0).to_bits()];
    *corners.entry(key).or_insert_with(|| {
        vertices.push(corner);
        vertices.len() as u32 - 1
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::dvec2;

    #[test]
    fn neighbours_share_their_corners() {
        let square = |x: f64| Polygon {
            outer: vec![dvec2(x, 0.0), dvec2(x + 4.0, 0.0), dvec2(x + 4.0, 3.0), dvec2(x, 3.0)],
            holes: Vec::new(),
        };
        let roofs = [(square(0.0), Plane::horizontal(5.0)), (square(4.0), Plane::horizontal(8.0))];
        let found = RoofPartition::of_polygons(&roofs);
        assert_eq!((found.partition.vertices.len(), found.partition.edges.len()), (6, 8));
        assert_eq!(found.partition.areas(), [12.0, 12.0]);
        let index = found.partition.index();
        let twins = found.partition.edges.iter().filter(|e| index.contains_key(&(e.to, e.from))).count();
        assert_eq!(twins, 2, "the edge between the two is there in both directions");
    }
}
