//! Names of buildings, after the place where they stand.

use gable_geometry::{DVec2, DVec3, Frame};
use std::collections::BTreeMap;

/// An identifier for each centroid (local metres): the world coordinates in whole metres, as in `b-84512-446120`, so
/// that it is the same from run to run, whatever the tiling. It can be an XML name. Where two centroids share a
/// square metre, the later ones (in the order given, which must not depend on the tiling) get a suffix.
#[must_use]
pub fn building_ids(centroids: &[DVec2], frame: &Frame) -> Vec<String> {
    let mut taken: BTreeMap<String, usize> = BTreeMap::new();
    centroids
        .iter()
        .map(|&c| {
            let world = frame.to_world(DVec3::new(c.x, c.y, 0.0));
            let name = format!("b{}{}", signed(world.x.floor()), signed(world.y.floor()));
            let n = taken.entry(name.clone()).or_insert(0);
            *n += 1;
            if *n == 1 { name } else { format!("{name}.{n}") }
        })
        .collect()
}

/// `-12` for 12 and `-m12` for −12: a sign that cannot be taken for a separator.
fn signed(value: f64) -> String {
    let value = value as i64;
    if value < 0 { format!("-m{}", -value) } else { format!("-{value}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_geometry::{Crs, dvec2};

    #[test]
    fn names_are_places_and_unique() {
        let frame = Frame { origin: [84_000.0, 446_000.0, 0.0], crs: Crs::Epsg(7415) };
        let ids = building_ids(&[dvec2(512.3, 120.9), dvec2(512.9, 120.1), dvec2(-85_000.5, 3.0)], &frame);
        assert_eq!(ids, ["b-84512-446120", "b-84512-446120.2", "b-m1001-446003"]);
    }
}
